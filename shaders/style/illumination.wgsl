// The light on the surfaces that are seen [Luft 2006, 3.2 and 3.3]: the lighting map, and the shadow by the blurred depth test.
#import canopy::frame::{frame, light, shadow, shadow_map, relative_position}
#import canopy::style::{style, full_screen, FullScreen, landscape_depth}
#import canopy::sun_visibility::{sample_ground, terrain_visibility, map_position, cascade_weight}
#import canopy::constants::MAX_CASCADES

@group(1) @binding(1) var depths: texture_depth_2d;
@group(1) @binding(2) var surfaces: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

const INVERSE_PI: f32 = 0.318309886;
const LUMINANCE: vec3<f32> = vec3(0.2126, 0.7152, 0.0722);

// Share of the direct light in all light on open ground: without sun there is no shadow to paint.
fn direct_share() -> f32 {
    let key = dot(light.key_illuminance, LUMINANCE) * INVERSE_PI * max(light.key_direction.y, 0.05);
    let sky = max(dot(light.sky[0].rgb, LUMINANCE) * 0.282, 0.0);
    return key / max(key + sky, 1e-12);
}

// The cascade whose map is read at a distance.
fn cascade_of(distance: f32) -> i32 {
    var index = 0;
    for (var i = 0; i < MAX_CASCADES - 1; i += 1) {
        index += i32((i < shadow.cascade_count - 1) & (distance >= 0.95 * shadow.cascades[i].radius));
    }
    return index;
}

// Light by the blurred depth test [Luft 2006, eq. 5]: the map's depths under a Gaussian of 5 x 5 points, then the smooth step over
// the band of +-`style.shadow_softness` metres.
fn soft_light(relative: vec3<f32>, normal: vec3<f32>) -> f32 {
    let index = cascade_of(length(relative));
    let cascade = shadow.cascades[index];
    let map = map_position(index, relative, normal, 2.0);
    let size = textureDimensions(shadow_map);
    let center = map.xy * vec2<f32>(size);
    // A quarter of the band, as wide as the softness is deep.
    let step = max(0.5 * style.shadow_softness / max(cascade.texel, 1e-4), 1.0) * 0.5;
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -2; y <= 2; y += 1) {
        for (var x = -2; x <= 2; x += 1) {
            let at = center + vec2(f32(x), f32(y)) * step;
            let texel = clamp(vec2<i32>(at), vec2(0), vec2<i32>(size) - 1);
            let weight = exp2(-0.4 * f32(x * x + y * y));
            sum += weight * textureLoad(shadow_map, texel, index, 0);
            weights += weight;
        }
    }
    let m = cascade.map_from_relative;
    let per_metre = length(vec3(m[0].z, m[1].z, m[2].z));
    let delta = max(style.shadow_softness * per_metre, 1e-6);
    // The map's depth is reversed: nearer to the light is greater. Half the band keeps lit surfaces lit.
    let lit = smoothstep(-delta, delta, map.z - sum / weights + 0.5 * delta);
    return mix(1.0, lit, cascade_weight(length(relative)));
}

// Light (0..1), pigment of the shadow (0..1), depth (0..1), and the length of the normal.
@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let texel = vec2<i32>(in.clip.xy);
    let depth = textureLoad(depths, texel, 0);
    let sky = depth <= 0.0;
    let relative = relative_position(in.uv, depth);
    let direction = normalize(relative);
    // The sky is painted from the horizon to the zenith.
    if sky {
        return vec4(saturate(1.25 * direction.y), 0.0, 1.0, 1.0);
    }
    let stored = textureLoad(surfaces, texel, 0);
    let ambient = max(length(stored.xyz), 1e-4);
    let normal = stored.xyz / ambient;
    let facing = dot(normal, light.key_direction);
    let ground = sample_ground(relative);
    let open = terrain_visibility(ground, stored.w);
    let shade = 1.0 - soft_light(relative, normal) * open;
    let diffuse = 0.5 + 0.5 * facing;
    let lit = diffuse * mix(0.6, 1.0, ambient);
    return vec4(lit, shade * direct_share(), landscape_depth(length(relative)), ambient);
}
