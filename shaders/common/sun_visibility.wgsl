// Visibility of the key light at a point: nearby, from the cascades of the sun_shadow pass; everywhere, from the
// horizon map of the terrain (src/terrain/sun_horizon.rs).
#define_import_path canopy::sun_visibility

#import canopy::constants::MAX_CASCADES
#import canopy::frame::{frame, light, shadow, shadow_map, shadow_sampler, ground_texture, hidden_sky_texture, sky_sampler}
#import canopy::stand::Relief

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

// What relief does to the light at a point.
fn relief_at(relative: vec3<f32>, ground: GroundSample, height_above_ground: f32) -> Relief {
    let uv = (relative.xz - shadow.ground.origin) * shadow.ground.inverse_size;
    let edge = 1.0 / f32(textureDimensions(hidden_sky_texture).y);
    let v = 0.5 * clamp(uv.y, edge, 1.0 - edge);
    let hidden = textureSampleLevel(hidden_sky_texture, sky_sampler, vec2(uv.x, v), 0.0);
    let direction = textureSampleLevel(hidden_sky_texture, sky_sampler, vec2(uv.x, v + 0.5), 0.0);
    let key = terrain_visibility(ground, height_above_ground);
    return Relief(hidden.rgb * light.level_radiance, hidden.a, direction.xyz, key, direction.w);
}

// Metres.
const MOST_LEAF_BIAS: f32 = 0.3;

// Place in a cascade's map, and depth, of a position that is moved off the surfaces that cast there. `bias` is 1 for solid
// surfaces; less if the position is known to be off the caster, more among leaves.
fn map_position(index: i32, relative: vec3<f32>, normal: vec3<f32>, bias: f32) -> vec3<f32> {
    let texel = shadow.cascades[index].texel;
    let slope = 1.0 - abs(dot(normal, light.key_direction));
    // Offset along the normal by the radius of the filter, and along the ray by one texel.
    let offset = normal * (0.6 + 1.6 * slope) + light.key_direction * 1.2;
    // The part of a bias above 1 depends on the leaves, not on the map: in coarse maps it would be metres.
    let position = relative + offset * min(texel * bias, max(texel, MOST_LEAF_BIAS));
    let map = shadow.cascades[index].map_from_relative * vec4(position, 1.0);
    return vec3(map.xy * vec2(0.5, -0.5) + 0.5, map.z);
}

// Mean of four bilinear comparisons on a square that is rotated by 21 degrees and whose corners are `radius` from the
// centre, in the map's coordinates.
fn compare_around(index: i32, map: vec3<f32>, radius: f32) -> f32 {
    let corner = vec2(0.932, 0.362) * radius;
    var sum = textureSampleCompareLevel(shadow_map, shadow_sampler, map.xy + corner, index, map.z);
    sum += textureSampleCompareLevel(shadow_map, shadow_sampler, map.xy + vec2(-corner.y, corner.x), index, map.z);
    sum += textureSampleCompareLevel(shadow_map, shadow_sampler, map.xy - corner, index, map.z);
    sum += textureSampleCompareLevel(shadow_map, shadow_sampler, map.xy + vec2(corner.y, -corner.x), index, map.z);
    return 0.25 * sum;
}

// A soft edge about three texels wide.
fn cascade_visibility(index: i32, relative: vec3<f32>, normal: vec3<f32>, bias: f32) -> f32 {
    return compare_around(index, map_position(index, relative, normal, bias), 0.966 * shadow.inverse_map_size);
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
fn cascade_at(distance: f32, pixel: vec2<f32>) -> i32 {
    let last = shadow.cascade_count - 1;
    let jittered = distance / mix(0.93, 1.0, pixel_noise(pixel));
    var index = 0;
    for (var i = 0; i < MAX_CASCADES - 1; i += 1) {
        index += i32((i < last) & (jittered >= shadow.cascades[i].radius));
    }
    return index;
}

fn cascade_weight(distance: f32) -> f32 {
    let last = shadow.cascade_count - 1;
    let radius = shadow.cascades[max(last, 0)].radius;
    return select(0.0, 1.0 - smoothstep(0.85 * radius, radius, distance), last >= 0);
}

fn cascaded_visibility(relative: vec3<f32>, normal: vec3<f32>, bias: f32, pixel: vec2<f32>) -> CascadeSample {
    let distance = length(relative);
    let index = cascade_at(distance, pixel);
    return CascadeSample(cascade_visibility(index, relative, normal, bias), cascade_weight(distance));
}

// Comparisons of a soft shadow, and the widest disc in texels that they cover without gaps: each reads two texels along an axis.
const SOFT_COMPARISONS: i32 = 32;
const WIDEST_DISC: f32 = 8.0;

// The same with an edge of +-`shadow.softness` metres: the mean of comparisons over a disc. Where the map is finer than the
// comparisons are dense, the next coarser one is read.
fn soft_cascaded_visibility(relative: vec3<f32>, normal: vec3<f32>, pixel: vec2<f32>) -> CascadeSample {
    let distance = length(relative);
    var index = cascade_at(distance, pixel);
    for (var i = 0; i < MAX_CASCADES - 1; i += 1) {
        let too_fine = shadow.softness > WIDEST_DISC * shadow.cascades[i].texel;
        index += i32((i == index) & (i + 1 < shadow.cascade_count) & too_fine);
    }
    let map = map_position(index, relative, normal, 1.0);
    let radius = max(shadow.softness / shadow.cascades[index].texel, 1.0) * shadow.inverse_map_size;
    // A spiral of equal areas [Vogel 1979]: each point turned by the golden angle against the one before.
    let turn = mat2x2(-0.7373688, 0.6754903, -0.6754903, -0.7373688);
    var direction = vec2(1.0, 0.0);
    var sum = 0.0;
    for (var i = 0; i < SOFT_COMPARISONS; i += 1) {
        let offset = direction * (radius * sqrt((f32(i) + 0.5) / f32(SOFT_COMPARISONS)));
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, map.xy + offset, index, map.z);
        direction = turn * direction;
    }
    return CascadeSample(sum / f32(SOFT_COMPARISONS), cascade_weight(distance));
}

// Metres: what is smaller than this between the leaves is detail that a plant's transfer does not have.
const DETAIL_RADIUS: f32 = 0.6;

// What maps that are fine enough to show leaves know of the visibility of the key light around a position.
struct LeafSample {
    // Mean within the radius of the detail.
    mean: f32,
    // The visibility less the mean.
    detail: f32,
    // 1 where the maps are fine enough, else 0.
    weight: f32,
}

fn cascaded_leaf_visibility(relative: vec3<f32>, normal: vec3<f32>, bias: f32, pixel: vec2<f32>) -> LeafSample {
    let distance = length(relative);
    let index = cascade_at(distance, pixel);
    let map = map_position(index, relative, normal, bias);
    let step = shadow.inverse_map_size;
    let texels = DETAIL_RADIUS / shadow.cascades[index].texel;
    let sharp = compare_around(index, map, 0.966 * step);
    let wide = 0.5 * (compare_around(index, map, texels * step) + compare_around(index, map, 0.5 * texels * step));
    return LeafSample(wide, sharp - wide, saturate(0.5 * texels - 0.5) * cascade_weight(distance));
}
