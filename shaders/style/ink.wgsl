// Lines, and toon shading with contours [Luft 2007, section 4; Decaudin 1996].
#import canopy::constants::PAPER_SIDE
#import canopy::frame::light
#import canopy::style::{style, full_screen, FullScreen, airiness}
#import canopy::style_noise::{anchored_noise, noise_place}
#import canopy::style_strokes::stroke_ink

@group(1) @binding(1) var depths: texture_depth_2d;
@group(1) @binding(2) var colors: texture_2d<f32>;
// Light, pigment of the shadow, depth in two values: as seen, and under the Gaussian.
@group(1) @binding(3) var lights: texture_2d<f32>;
@group(1) @binding(4) var soft_lights: texture_2d<f32>;
// Lines, rims, depth of what is in front.
@group(1) @binding(5) var lines: texture_2d<f32>;
@group(1) @binding(6) var papers: texture_2d<f32>;
@group(1) @binding(7) var ramps: texture_2d<f32>;
@group(1) @binding(8) var linear_sampler: sampler;
@group(1) @binding(9) var paper_sampler: sampler;
@group(1) @binding(10) var identities: texture_2d<u32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

#ifdef TOON
// The colour of one texel of the maps in `style.tones` tones.
fn toned(texel: vec2<i32>) -> vec3<f32> {
    let lit = textureLoad(lights, texel, 0);
    let albedo = textureLoad(colors, texel, 0).rgb;
    // The light, with the shadow: a surface in shade has the light of one that is turned away.
    let soft = textureSampleLevel(soft_lights, linear_sampler, (vec2<f32>(texel) + 0.5) / style.map_size, 0.0);
    let reach = mix(lit.x, soft.x, 0.7) * (1.0 - 0.45 * smoothstep(0.35, 0.65, soft.y));
    // Most of a crown lies between a quarter and three quarters.
    let tone = (floor(smoothstep(0.18, 0.82, reach) * style.tones * 0.999) + 0.5) / style.tones;
    // Albedo to paint: brighter and more saturated than leaves are.
    let luminance = dot(albedo, vec3(0.2126, 0.7152, 0.0722));
    let vivid = max(mix(vec3(luminance), albedo, 0.95), vec3(0.0)) * 3.6;
    let painted = min(vivid, vec3(0.95)) * mix(0.22, 1.3, tone);
    let hazy = mix(painted, style.distance, 0.85 * airiness(lit.z));
    // The sky in tones from the horizon to the zenith.
    let size = vec2<f32>(textureDimensions(ramps));
    let step = (floor(lit.x * 2.0 * style.tones) + 0.5) / (2.0 * style.tones);
    let sky = textureSampleLevel(ramps, linear_sampler, vec2(clamp(step, 0.01, 0.99), 0.5 / size.y), 0.0).rgb;
    return select(hazy, sky, textureLoad(depths, texel, 0) <= 0.0) * style.night;
}
#endif

@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let page = in.uv * style.size / style.unit;
    let height = textureSampleLevel(papers, paper_sampler, page / PAPER_SIDE, 0.0).x;
    let texel = vec2<i32>(clamp(in.uv * style.map_size, vec2(0.0), style.map_size - 1.0));
    let depth = textureLoad(depths, texel, 0);
    let sky = depth <= 0.0;
    let place = noise_place(in.uv, depth);
#ifdef TOON
    // The maps are twice as fine as the picture: the mean of four.
    let first = vec2<i32>(floor(in.uv * style.map_size - 0.5));
    let last = vec2<i32>(style.map_size) - 1;
    var color = vec3(0.0);
    for (var i = 0; i < 4; i += 1) {
        color += 0.25 * toned(clamp(first + vec2(i & 1, i >> 1u), vec2(0), last));
    }
    // Without a width the map is of an earlier frame.
    let drawn = textureSampleLevel(lines, linear_sampler, in.uv, 0.0).x * f32(style.line_width > 0.0);
    let soft = textureSampleLevel(soft_lights, linear_sampler, in.uv, 0.0);
    let strokes = stroke_ink(in.uv, place.distance, soft.z, 1.0 - soft.x, identities) * f32(!sky);
    return vec4(mix(color, style.ink * 0.4 * style.night, saturate(max(1.2 * drawn, strokes))), 1.0);
#else
    let middle = anchored_noise(place.position, place.pixel * 26.0, 2u);
    let fine = anchored_noise(place.position, place.pixel * 5.0, 3u);
    // A pen in a hand.
    let tremble = vec2(middle, fine) * vec2(0.8, 0.6) * style.unit / style.size;
    let soft = textureSampleLevel(soft_lights, linear_sampler, in.uv + tremble, 0.0);
    let line = textureSampleLevel(lines, linear_sampler, in.uv + tremble, 0.0);
    let air = airiness(soft.z);
    // Hatching: strokes across the page where it is dark, a second direction where it is darkest.
    let dark = saturate(1.0 - 1.35 * soft.x + 0.45 * soft.y) * f32(!sky) * (1.0 - air);
    let along = page.x + page.y + 2.5 * middle;
    let across = page.x - 0.55 * page.y + 2.5 * middle;
    let first = smoothstep(0.25, 0.75, abs(fract(along / 5.0) - 0.5) * 2.0 + 1.1 * dark - 0.75);
    let second = smoothstep(0.25, 0.75, abs(fract(across / 5.5) - 0.5) * 2.0 + 1.1 * dark - 1.05);
    let hatched = style.hatching * 0.7 * max(first * smoothstep(0.22, 0.40, dark), second * smoothstep(0.5, 0.65, dark));
    let pressure = 0.85 + 0.25 * middle;
    let grain = smoothstep(0.1, 0.5, height + 0.35);
    let strokes = stroke_ink(in.uv + 0.3 * tremble, place.distance, soft.z, dark, identities) * f32(!sky);
    let drawn = 1.25 * line.x * (1.0 - 0.6 * airiness(line.z));
    let ink = saturate(max(drawn, max(hatched, 1.1 * strokes) * (1.0 - 0.6 * air)) * pressure * grain);
    return vec4(mix(style.paper * (1.0 + 0.12 * (height - 0.5)), style.ink * 0.7, ink), 1.0);
#endif
}
