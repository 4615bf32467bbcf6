// Light inside a stand of trees: the transmittance of neighbouring crowns for sky and sun, and their scattered light.
// The table comes from src/light/stand.rs, its radiance multiplied by the exposure.
#define_import_path canopy::stand

#import canopy::constants::{STAND_COVERS, STAND_DEPTHS}
#import canopy::frame::{frame, light, stand_texture, sky_sampler}

struct StandLight {
    // Transmittance of the neighbouring crowns for the light of the sky that the own crown leaves, of what is seen.
    sky_transmittance: vec3<f32>,
    // Their transmittance for the key light.
    key_transmittance: f32,
    // Downwelling radiance that they scatter.
    downwelling: vec3<f32>,
    // Upwelling radiance, less `sky_transmittance` times that of the ground around a lone tree, which the sky's harmonics have.
    upwelling: vec3<f32>,
    // Of the sky's light that relief hides: the mean radiance over all directions, and the mean direction of its luminance.
    hidden: vec3<f32>,
    hidden_direction: vec3<f32>,
}

// What relief does to the light.
struct Relief {
    // Of the sky's light that it hides: the mean radiance over all directions.
    hidden: vec3<f32>,
    // The fraction of the sky's light that it leaves on level ground, 0..1.
    level_fraction: f32,
    // Mean direction of the luminance that it hides: the closer to one direction that comes from, the closer to 1 is its length.
    direction: vec3<f32>,
    // Visibility of the key light, 0..1.
    key: f32,
    // What the slope leaves of the optical depth of neighbouring crowns for the light of the sky: src/light/slope.rs.
    slope_factor: f32,
}

// What is seen from the open has an open way to the eye. Crowns that would hide the sky around that way would have hidden it from the eye
// too, so that it gets more light of the sky than the mean of its depth, which the table has. This part of the optical depth lies in such
// crowns. From within the stand, the way to the eye says nothing about the sky above.
const SEEN_PART: f32 = 0.4;

// What relief leaves of scattered radiance. `table` has it in the open, and the fraction of its luminance without the key light.
fn behind_relief(table: vec4<f32>, relief: Relief) -> vec3<f32> {
    let shaded = min(light.shaded_hue * table.a, vec3(1.0));
    return table.rgb * ((1.0 - shaded) * relief.key + shaded * relief.level_fraction);
}

// In the row of a depth; the last row is the ground's. The table has four blocks, one below the other: transmittances at leaves, downwelling
// radiance, upwelling radiance, transmittances at trunks.
fn look_up(cover: f32, row: f32, transmittances: f32, relief: Relief) -> StandLight {
    let u = (clamp(cover, 0.0, 1.0) * (STAND_COVERS - 1.0) + 0.5) / STAND_COVERS;
    let v = (row + 0.5) / (4.0 * (STAND_DEPTHS + 1.0));
    let first = textureSampleLevel(stand_texture, sky_sampler, vec2(u, v + 0.25 * transmittances), 0.0);
    var stand: StandLight;
    stand.sky_transmittance = pow(max(first.rgb, vec3(1e-6)), vec3(relief.slope_factor * (1.0 - SEEN_PART * frame.openness)));
    stand.key_transmittance = first.a;
    stand.downwelling = behind_relief(textureSampleLevel(stand_texture, sky_sampler, vec2(u, v + 0.25), 0.0), relief);
    let upwelling = behind_relief(textureSampleLevel(stand_texture, sky_sampler, vec2(u, v + 0.5), 0.0), relief);
    stand.upwelling = upwelling - stand.sky_transmittance * light.ground_radiance;
    stand.hidden = relief.hidden;
    stand.hidden_direction = relief.direction;
    return stand;
}

// The light on leaves for a canopy cover of `cover`, at a depth of 0 (the tops) to 1 (the ground).
fn stand_light(cover: f32, depth: f32, relief: Relief) -> StandLight {
    return look_up(cover, clamp(depth, 0.0, 1.0) * (STAND_DEPTHS - 1.0), 0.0, relief);
}

// The same on wood.
fn trunk_light(cover: f32, depth: f32, relief: Relief) -> StandLight {
    return look_up(cover, clamp(depth, 0.0, 1.0) * (STAND_DEPTHS - 1.0), 3.0, relief);
}

// The light on the ground.
fn ground_light(cover: f32, relief: Relief) -> StandLight {
    return look_up(cover, STAND_DEPTHS, 0.0, relief);
}

// Spherical harmonics of the first two bands in a direction, not below zero: the first coefficient, and the second
// band's vector times the direction.
fn evaluate_two_bands(mean: f32, band: f32) -> f32 {
    return max(0.28209479 * mean + 0.48860251 * band, 0.0);
}

// Irradiance over pi that relief hides from a unit normal: HiddenLight::from_normal of src/light/hidden_sky.rs.
fn hidden_from(normal: vec3<f32>, stand: StandLight) -> vec3<f32> {
    let along = dot(normal, stand.hidden_direction);
    let concentration = length(stand.hidden_direction);
    let lobe = 1.0 + 2.0 * along + 0.625 * concentration * (3.0 * along * along - concentration * concentration);
    return stand.hidden * max(lobe, 0.0);
}

// Irradiance over pi on what has a unit normal, and `open` without relief and neighbours.
fn in_stand(open: vec3<f32>, normal: vec3<f32>, stand: StandLight) -> vec3<f32> {
    let scattered = 0.5 * ((1.0 + normal.y) * stand.downwelling + (1.0 - normal.y) * stand.upwelling);
    return max(stand.sky_transmittance * max(open - hidden_from(normal, stand), vec3(0.0)) + scattered, vec3(0.0));
}

// The same on a side whose first coefficient of transfer is `mean`, and whose second band is `band`: a vector for each channel, relative to
// `mean`. `hidden_direction` is that of the stand in the vectors' frame. Light of the mean radiance 1 over all directions has the first
// coefficient sqrt(4 pi), and if it comes from one direction, the second band sqrt(12 pi) there; a hemisphere of radiance 1 has the coefficients
// sqrt(pi) and 0.4886 pi.
fn in_stand_by_transfer(open: vec3<f32>, mean: vec3<f32>, band: mat3x3<f32>, hidden_direction: vec3<f32>, stand: StandLight) -> vec3<f32> {
    let zenith = vec3(band[0].y, band[1].y, band[2].y);
    let even = 1.7724539 * (stand.downwelling + stand.upwelling);
    let scattered = even + 1.5349901 * zenith * (stand.downwelling - stand.upwelling);
    let hidden = mean * stand.hidden * max(3.5449077 + 6.1399602 * (hidden_direction * band), vec3(0.0));
    return max(stand.sky_transmittance * max(open - hidden, vec3(0.0)) + mean * scattered, vec3(0.0));
}
