// The light on the surfaces that are seen [Luft 2006, 3.2 and 3.3]: the lighting map, and the shadow by the blurred depth test.
#import canopy::frame::{frame, light, shadow, shadow_map, relative_position}
#import canopy::style::{style, full_screen, FullScreen, landscape_depth, split_depth}
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

// The map's depth around a position, under a Gaussian of 5 x 5 points.
struct Around {
    // Mean depth.
    depth: f32,
    // Mean distance in depth of what is nearer to the light; 0 where nothing is.
    blocked: f32,
}

// `step` between points, in texels. A point is nearer to the light than `depth` if it is so by more than `allowance` a texel.
fn depths_around(index: i32, center: vec2<f32>, step: f32, depth: f32, allowance: f32) -> Around {
    let last = vec2<i32>(textureDimensions(shadow_map)) - 1;
    var sum = 0.0;
    var weights = 0.0;
    var blocked = 0.0;
    var blockers = 0.0;
    for (var y = -2; y <= 2; y += 1) {
        for (var x = -2; x <= 2; x += 1) {
            let offset = vec2(f32(x), f32(y));
            let texel = clamp(vec2<i32>(center + offset * step), vec2(0), last);
            let weight = exp2(-0.4 * dot(offset, offset));
            let found = textureLoad(shadow_map, texel, index, 0);
            sum += weight * found;
            weights += weight;
            // The map's depth is reversed: nearer to the light is greater.
            let nearer = weight * f32(found - depth > allowance * step * length(offset));
            blocked += nearer * (found - depth);
            blockers += nearer;
        }
    }
    return Around(sum / weights, blocked / max(blockers, 1e-6));
}

// Metres above the ground below which a position takes the shadow of what is near as sharp as it is.
const CONTACT_HEIGHT: f32 = 0.5;
// Softnesses between ground and caster from which on the shadow is as soft as it may be.
const CONTACT_REACH: f32 = 24.0;

// Light by the blurred depth test [Luft 2006, eq. 5]: the map's depths under a Gaussian, then the smooth step over the band of
// +-`style.shadow_softness` metres. On the ground the Gaussian and the band narrow towards the foot of what casts, as a penumbra does [Fernando 2005]:
// under a wide one a trunk is lost, whose depth near its foot differs from the ground's by less than the band.
fn soft_light(relative: vec3<f32>, normal: vec3<f32>, height: f32) -> f32 {
    let index = cascade_of(length(relative));
    let cascade = shadow.cascades[index];
    let map = map_position(index, relative, normal, 2.0);
    let center = map.xy * vec2<f32>(textureDimensions(shadow_map));
    // A quarter of the band, as wide as the softness is deep.
    let step = max(0.5 * style.shadow_softness / max(cascade.texel, 1e-4), 1.0) * 0.5;
    let m = cascade.map_from_relative;
    let per_metre = length(vec3(m[0].z, m[1].z, m[2].z));
    var delta = max(style.shadow_softness * per_metre, 1e-6);
    // The slope of the surface in the light's space: its own parts that are nearer to the light do not count.
    let facing = max(abs(dot(normal, light.key_direction)), 0.05);
    let slope = sqrt(1.0 - min(facing * facing, 1.0)) / facing;
    let allowance = slope * cascade.texel * per_metre;
    var around = depths_around(index, center, step, map.z, allowance);
    // Without a branch: lavapipe (Mesa 22.3) fails on one that has a loop of lookups in it.
    let distance = saturate(around.blocked / (CONTACT_REACH * delta));
    let width = select(1.0, mix(distance * distance, 1.0, saturate(height / CONTACT_HEIGHT)), around.blocked > 0.0);
    let narrow = max(step * width, min(step, 0.5));
    around = depths_around(index, center, narrow, map.z, allowance);
    delta *= narrow / step;
    // Half the band keeps lit surfaces lit.
    let lit = smoothstep(-delta, delta, map.z - around.depth + 0.5 * delta);
    return mix(1.0, lit, cascade_weight(length(relative)));
}

// Light (0..1), pigment of the shadow (0..1), and depth (0..1) in two values.
@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let texel = vec2<i32>(in.clip.xy);
    let depth = textureLoad(depths, texel, 0);
    let sky = depth <= 0.0;
    let relative = relative_position(in.uv, depth);
    let direction = normalize(relative);
    // The sky is painted from the horizon to the zenith.
    if sky {
        return vec4(saturate(1.25 * direction.y), 0.0, 1.0, 0.0);
    }
    let stored = textureLoad(surfaces, texel, 0);
    let ambient = max(length(stored.xyz), 1e-4);
    let normal = stored.xyz / ambient;
    let facing = dot(normal, light.key_direction);
    let ground = sample_ground(relative);
    let open = terrain_visibility(ground, stored.w);
    let shade = 1.0 - soft_light(relative, normal, stored.w) * open;
    let diffuse = 0.5 + 0.5 * facing;
    let lit = diffuse * mix(0.6, 1.0, ambient);
    return vec4(lit, shade * direct_share(), split_depth(landscape_depth(length(relative))));
}
