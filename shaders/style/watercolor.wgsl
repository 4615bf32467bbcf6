// Watercolour: layers of pigment on paper [Luft 2006]. The equations of a layer are those of src/style/wash.rs.
#import canopy::constants::{PAPER_SIDE, GROUND_LAYER}
#import canopy::style::{style, full_screen, FullScreen, airiness}
#import canopy::style_noise::{anchored_noise, noise_place}
#import canopy::style_strokes::stroke_ink

struct Layer {
    // Threshold of the shape, and half the width of its edge.
    threshold: f32,
    softness: f32,
    // Factor on the darkening of rims.
    edge: f32,
    // Factor on the shade of crowns, and of dabs.
    foliage: f32,
}

@group(1) @binding(1) var depths: texture_depth_2d;
@group(1) @binding(2) var identities: texture_2d<u32>;
// Light, pigment of the shadow, depth in two values: under the Gaussian, and under a wide one.
@group(1) @binding(3) var soft_lights: texture_2d<f32>;
@group(1) @binding(4) var wide_lights: texture_2d<f32>;
// Lines, rims, depth of what is in front.
@group(1) @binding(5) var lines: texture_2d<f32>;
// Intensities of the layers, four a slice.
@group(1) @binding(6) var shapes: texture_2d_array<f32>;
// Colours by light; a row a layer, then one each for the shadow and the dabs.
@group(1) @binding(7) var ramps: texture_2d<f32>;
@group(1) @binding(8) var papers: texture_2d<f32>;
@group(1) @binding(9) var<storage, read> layers: array<Layer>;
@group(1) @binding(10) var linear_sampler: sampler;
@group(1) @binding(11) var paper_sampler: sampler;
// Intensities of the particles: dark, medium, bright.
@group(1) @binding(12) var soft_dabs: texture_2d<f32>;
// Albedo, and how much of a pixel has one.
@group(1) @binding(13) var soft_colors: texture_2d<f32>;
// The same as seen.
@group(1) @binding(14) var colors: texture_2d<f32>;
// Noise of three sizes: middle, broad, of clouds.
@group(1) @binding(15) var noises: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

// Transmittance and alpha of row `row` of the ramps at `t`.
fn ramp(row: i32, t: f32) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(ramps));
    let at = vec2((0.5 + saturate(t) * (size.x - 1.0)) / size.x, (f32(row) + 0.5) / size.y);
    return textureSampleLevel(ramps, linear_sampler, at, 0.0);
}

fn paper_height(page: vec2<f32>) -> f32 {
    return textureSampleLevel(papers, paper_sampler, page / PAPER_SIDE, 0.0).x;
}

struct Pigment {
    coverage: f32,
    rim: f32,
    density: f32,
}

const PAPER_ON_SHAPE: f32 = 0.22;
const RIM: f32 = 0.38;
const LUMINANCE: vec3<f32> = vec3(0.2126, 0.7152, 0.0722);
// Threshold of the layer of shadows: what is two pixels wide, as the shadow of a trunk, is painted.
const SHADOW: f32 = 0.34;
// The washes of dark and medium foliage.
const GLAZE: Layer = Layer(0.5, 0.10, 0.9, 1.0);

// The twin of Wash::pigment in src/style/wash.rs.
fn pigment(intensity: f32, layer: Layer, height: f32, flow: f32) -> Pigment {
    let raised = intensity + PAPER_ON_SHAPE * (height - 0.5);
    let coverage = smoothstep(layer.threshold - layer.softness, layer.threshold + layer.softness, raised);
    let rim = coverage * (1.0 - smoothstep(layer.threshold, layer.threshold + RIM, intensity)) * layer.edge;
    let density = 1.0 + style.edges * rim + style.granulation * (0.5 - height) + style.flow * flow;
    return Pigment(coverage, rim, max(density, 0.0));
}

// Glazing: transmittances multiply.
fn glaze(under: vec3<f32>, transmittance: vec3<f32>, density: f32, amount: f32) -> vec3<f32> {
    return mix(under, under * pow(max(transmittance, vec3(1e-3)), vec3(density)), saturate(amount));
}

fn luminance_at(uv: vec2<f32>) -> f32 {
    return dot(textureSampleLevel(colors, linear_sampler, uv, 0.0).rgb, LUMINANCE);
}

// Intensities (dark, medium, bright) of a texture whose mean luminance around `uv` is `mean`: its luminance in three steps, as an
// intensity texture that is made of a plant's colours [Luft 2006, 4.3].
fn texture_intensities(uv: vec2<f32>, mean: f32) -> vec3<f32> {
    let reach = 0.7 * style.unit / style.size;
    let across = vec2(reach.x, -reach.y);
    let luminance = 0.25 * (luminance_at(uv + reach) + luminance_at(uv - reach) + luminance_at(uv + across) + luminance_at(uv - across));
    let share = luminance / max(mean, 1e-3);
    let dark = 1.0 - smoothstep(0.40, 0.55, share);
    return vec3(dark, (1.0 - smoothstep(0.70, 0.85, share)) * (1.0 - dark), smoothstep(1.25, 1.5, share));
}

@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    // The page, in pixels of a picture of 720 lines.
    let page = in.uv * style.size / style.unit;
    let height = paper_height(page);
    // Light that falls onto the paper from the upper left.
    let relief = paper_height(page - 0.8) - paper_height(page + 0.8);

    // Noise that moves with what is painted.
    let texel = vec2<i32>(clamp(in.uv * style.map_size, vec2(0.0), style.map_size - 1.0));
    let depth = textureLoad(depths, texel, 0);
    let sky = depth <= 0.0;
    let place = noise_place(in.uv, depth);
    let noise = textureSampleLevel(noises, linear_sampler, in.uv, 0.0);
    let middle = noise.x;
    let broad = noise.y;
    let cloud = noise.z;
    let fine = anchored_noise(place.position, place.pixel * 6.0, 3u);
    let finer = anchored_noise(place.position, place.pixel * 3.2, 4u);

    // The hand: shapes waver. Not so ground that is seen along itself, where noise that is fixed to it is squeezed from row to row: trunks in front
    // of it would have combs for outlines.
    let rise = abs(place.position.y - style.anchor.y) / max(place.distance, 1e-3);
    let level = (textureLoad(identities, texel, 0).x == GROUND_LAYER) & (style.noise_anchor != 1u);
    let steady = select(1.0, smoothstep(0.05, 0.5, rise), level);
    let waver = steady * (vec2(middle, broad) * (1.8 + 5.0 * style.wetness) + vec2(fine, finer) * 0.5) * style.unit / style.size;
    let uv = in.uv + waver;
    let soft = textureSampleLevel(soft_lights, linear_sampler, uv, 0.0);
    let wide = textureSampleLevel(wide_lights, linear_sampler, uv, 0.0);
    let at = vec2<i32>(clamp(uv * style.map_size, vec2(0.0), style.map_size - 1.0));
    let tree = f32(textureLoad(identities, at, 0).y) / 255.0 - 0.5;
    let air = style.air * airiness(soft.z);

    // Forms stand out against their surroundings: light against its wide mean, and a rim where something nearer ends in front of
    // something farther [Luft, Colditz, Deussen 2006, unsharp masking of the depth].
    let form = saturate((mix(soft.x, wide.x, 0.25) + 0.5 * (soft.x - wide.x) - 0.20) / 0.62);
    let drawn = textureSampleLevel(lines, linear_sampler, uv, 0.0).y;
    let seen_color = textureSampleLevel(soft_colors, linear_sampler, uv, 0.0);
    let albedo = seen_color.rgb / max(seen_color.a, 1e-3);
    // Textures are painted where a leaf is larger than a dab of the brush.
    let close = style.textures * (1.0 - smoothstep(0.18, 0.32, soft.z)) * f32(!sky);
    let intensities = close * texture_intensities(uv, dot(albedo, LUMINANCE));
    let particles = saturate(textureSampleLevel(soft_dabs, linear_sampler, uv, 0.0).rgb + intensities);
    // Bright dabs are left out of the washes, as paper that masking fluid has kept.
    let kept = smoothstep(0.30, 0.62, particles.z + 0.25 * (height - 0.5) - 0.5 * soft.y) * saturate(style.dabs);
    let step = wide.z - soft.z;
    let near_rim = smoothstep(0.002, 0.02, step);
    let behind = smoothstep(0.002, 0.03, -step);

    // The hue of the scene's own leaves and petals.
    let hue = albedo / max(dot(albedo, LUMINANCE), 1e-4);

    var color = style.paper * (1.0 + 0.10 * relief);
    var foliage = 0.0;
    var painted = 0.0;
    let count = i32(arrayLength(&layers));
    for (var first = 0; first < count; first += 4) {
        let slice = textureSampleLevel(shapes, linear_sampler, uv, first / 4, 0.0);
        for (var channel = 0; channel < min(count - first, 4); channel += 1) {
            let k = first + channel;
            let layer = layers[k];
            let wash = pigment(slice[channel], layer, height, broad * 0.7 + middle * select(0.4, 0.12, k == 0));
            // Most layers are elsewhere.
            if wash.coverage > 0.0 {
                // The sky's ramp is over its height, and has no form.
                let unevenness = layer.foliage * (0.14 * tree + 0.08 * middle) + (1.0 - layer.foliage) * (0.22 * broad + 0.12 * middle);
                let t = select(mix(form, 0.45 + 0.55 * form, layer.foliage) + unevenness, soft.x, k == 0);
                let paint = ramp(k, t);
                // Each crown is mixed anew, warmer or cooler.
                let mixed = paint.rgb * (1.0 + layer.foliage * tree * vec3(0.20, 0.04, -0.30) + layer.foliage * broad * vec3(0.06, 0.0, -0.10));
                let own = min(hue * dot(mixed, LUMINANCE), vec3(1.0));
                let pigmented = mix(mixed, own, style.scene * layer.foliage);
                let transmittance = mix(saturate(pigmented), style.distance, 0.9 * air * f32(k > 0));
                let rim = style.edges * min(0.5 * near_rim + 0.2 * behind + 1.2 * drawn, 1.3) * (1.0 - 0.6 * air) * layer.edge;
                let clear = select(0.0, smoothstep(0.0, 0.55, 0.8 * cloud + 0.35 * broad), k == 0);
                let thickness = (1.0 - 0.4 * air) * (1.0 + layer.foliage * 0.35 * tree) * (1.0 - 0.5 * kept * layer.foliage) * (1.0 - 0.8 * clear);
                color = glaze(color, transmittance, (wash.density + rim) * thickness, wash.coverage * paint.a);
                foliage += layer.foliage * wash.coverage;
                painted = max(painted, wash.coverage * paint.a);
            }
        }
    }
    foliage = saturate(foliage);

    // Two more washes of foliage, over where the crowns turn away from the light, and the dabs of near crowns in them: dark, medium
    // and bright areas, each with its own shape, glazed over each other [Luft 2006, 4.2].
    let near = 1.0 - smoothstep(0.55, 0.80, soft.z);
    let row = i32(arrayLength(&layers)) + 1;
    let glazed = foliage * style.dabs * near * (1.0 - 0.75 * air);
    let ragged = 0.16 * middle + 0.10 * fine;
    for (var map = 0; map < 2; map += 1) {
        let limit = select(0.58, 0.30, map == 0);
        let area = saturate(0.5 + 2.6 * (limit - form - ragged));
        let wash = pigment(saturate(area + 0.75 * particles[map]), GLAZE, height, 0.6 * middle);
        let paint = ramp(row + map, form);
        let own = min(hue * dot(paint.rgb, LUMINANCE), vec3(1.0));
        color = glaze(color, mix(paint.rgb, own, 0.7 * style.scene), 0.8 * wash.density + 0.4 * style.edges * drawn, wash.coverage * glazed * paint.a * (1.0 - 0.6 * kept));
    }
    let bright = ramp(row + 2, form);
    color = glaze(color, bright.rgb, 1.0, kept * glazed * bright.a);

    // The layer of shadows.
    let shade = soft.y + 0.10 * middle + 0.16 * (height - 0.5);
    let half_edge = 0.10 + 0.3 * style.wetness;
    let shadow = smoothstep(SHADOW - half_edge, SHADOW + half_edge, shade);
    let shadow_rim = shadow * (1.0 - smoothstep(SHADOW, 2.0 * SHADOW, shade));
    let shadow_paint = ramp(i32(arrayLength(&layers)), airiness(soft.z));
    let shadow_density = 0.85 + 0.35 * style.edges * shadow_rim + style.granulation * (0.5 - height) + 0.3 * style.flow * broad;
    color = glaze(color, shadow_paint.rgb, max(shadow_density, 0.0), shadow * style.shadow * shadow_paint.a * mix(1.0, 0.45, foliage));

    // The pencil drawing, which the paper's hills take, of what is painted: not the horizon behind a plant on white paper.
    let tremble = steady * vec2(broad, middle) * 1.6 * style.unit / style.size;
    let sketched = textureSampleLevel(lines, linear_sampler, in.uv + tremble, 0.0);
    let grain = smoothstep(0.25, 0.55, height + 0.16 * finer);
    let faded = 1.0 - 0.7 * style.air * airiness(sketched.z);
    let pencil = 1.6 * sketched.x * grain * style.sketch * (0.9 + 0.5 * broad) * faded * smoothstep(0.1, 0.3, painted);
    let stroke_uv = in.uv + 0.3 * vec2(middle, fine) * style.unit / style.size;
    let strokes = stroke_ink(stroke_uv, place.distance, soft.z, max(1.0 - form, soft.y), identities) * f32(!sky);
    let brushed = strokes * mix(0.75, 1.0, grain) * (1.0 - 0.7 * air);
    color *= mix(vec3(1.0), style.ink, saturate(max(pencil, brushed)) * 0.85);

    // The night is one glaze over all.
    color *= style.night;

    // The margin: the brush does not end in a straight line.
    let from_edge = min(min(page.x, page.y), min(style.size.x / style.unit - page.x, style.size.y / style.unit - page.y));
    let end = style.margin * 720.0 + 5.0 * broad + 3.0 * middle + 6.0 * (height - 0.5);
    let inside = select(1.0, smoothstep(end - 1.0, end + 1.5, from_edge), style.margin > 0.0);
    color = mix(style.paper * (1.0 + 0.10 * relief), color, inside);
    return vec4(saturate(color), 1.0);
}
