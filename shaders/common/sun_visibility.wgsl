// Visibility of the key light at a point: nearby, from the cascades of the sun_shadow pass; everywhere, from the
// horizon map of the terrain (src/terrain/sun_horizon.rs).
#define_import_path canopy::sun_visibility

#import canopy::constants::MAX_CASCADES
#import canopy::frame::{frame, light, shadow, shadow_map, shadow_sampler, ground_texture, sky_sampler}

// The ground map's values below a point.
struct GroundSample {
    // Height above the ground up to which the terrain hides the key light, metres.
    shadow_height: f32,
    // Canopy cover, 0..1.
    cover: f32,
    // Mean canopy cover of the surroundings.
    surrounding_cover: f32,
    // Canopy cover of trees that are not drawn, because they are beyond those of the scene.
    undrawn_cover: f32,
}

fn sample_ground(relative: vec3<f32>) -> GroundSample {
    let uv = (relative.xz - shadow.ground.origin) * shadow.ground.inverse_size;
    let texel = textureSampleLevel(ground_texture, sky_sampler, uv, 0.0);
    return GroundSample(texel.x, texel.y, texel.z, texel.w);
}

// Light that clears the terrain: a penumbra that widens with the distance to the ridge is approximated by one of
// fixed height, the sun's disc over a kilometre. It lies below the horizon, because open ground is its own
// horizon: centred on it, the penumbra would halve the light there.
fn terrain_visibility(ground: GroundSample, height_above_ground: f32) -> f32 {
    return smoothstep(-6.0, 0.0, height_above_ground - ground.shadow_height);
}

// Metres.
const MOST_LEAF_BIAS: f32 = 0.3;

// `bias` is 1 for solid surfaces; less if the position is known to be off the caster, more among leaves.
fn cascade_visibility(index: i32, relative: vec3<f32>, normal: vec3<f32>, bias: f32) -> f32 {
    let texel = shadow.cascades[index].texel;
    let slope = 1.0 - abs(dot(normal, light.key_direction));
    // Offset along the normal by the radius of the filter, and along the ray by one texel.
    let offset = normal * (0.6 + 1.6 * slope) + light.key_direction * 1.2;
    // The part of a bias above 1 depends on the leaves, not on the map: in coarse maps it would be metres.
    let position = relative + offset * min(texel * bias, max(texel, MOST_LEAF_BIAS));
    let map = shadow.cascades[index].map_from_relative * vec4(position, 1.0);
    let uv = map.xy * vec2(0.5, -0.5) + 0.5;
    let step = shadow.inverse_map_size;
    // Four bilinear comparisons on a rotated cross: a soft edge about three texels wide.
    var sum = textureSampleCompareLevel(shadow_map, shadow_sampler, uv + vec2(0.9, 0.35) * step, index, map.z);
    sum += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + vec2(-0.35, 0.9) * step, index, map.z);
    sum += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + vec2(-0.9, -0.35) * step, index, map.z);
    sum += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + vec2(0.35, -0.9) * step, index, map.z);
    return 0.25 * sum;
}

// Interleaved gradient noise [Jimenez 2014], 0..1, fixed to the pixel.
fn pixel_noise(pixel: vec2<f32>) -> f32 {
    return fract(52.9829189 * fract(dot(floor(pixel), vec2(0.06711056, 0.00583715))));
}

// The result of the cascades for the key light at a point.
struct CascadeSample {
    visibility: f32,
    // Weight of `visibility`: 1 within the cascades, 0 beyond the last one.
    weight: f32,
}

// Each pixel reads one cascade: where two meet, noise decides which, over the last 7 % of the finer one's radius. The
// choice is arithmetic, because software rasterisers run both sides of every branch.
fn cascaded_visibility(relative: vec3<f32>, normal: vec3<f32>, bias: f32, pixel: vec2<f32>) -> CascadeSample {
    let last = shadow.cascade_count - 1;
    let distance = length(relative);
    let jittered = distance / mix(0.93, 1.0, pixel_noise(pixel));
    var index = 0;
    for (var i = 0; i < MAX_CASCADES - 1; i += 1) {
        index += i32((i < last) & (jittered >= shadow.cascades[i].radius));
    }
    let radius = shadow.cascades[max(last, 0)].radius;
    let weight = select(0.0, 1.0 - smoothstep(0.85 * radius, radius, distance), last >= 0);
    return CascadeSample(cascade_visibility(index, relative, normal, bias), weight);
}
