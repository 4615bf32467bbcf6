// Light inside a stand of trees: what neighbours leave of sky and sun, and what they send instead. The table is that of
// src/light/stand.rs, exposed.
#define_import_path canopy::stand

#import canopy::frame::{stand_texture, sky_sampler}

struct StandLight {
    // Share of the sky that the neighbours leave, in the mean over the upper half.
    sky: vec3<f32>,
    // Share of the key light that they leave.
    beam: f32,
    // Radiance from above of what they scatter.
    down: vec3<f32>,
    // Radiance from below, less what the surroundings of a lone tree have there of the ground, times `sky`.
    up: vec3<f32>,
}

// Covers, depths and rows of the table: the last row is the ground's.
const COVERS: f32 = 16.0;
const DEPTHS: f32 = 16.0;
const ROWS: f32 = 17.0;

fn look_up(cover: f32, row: f32) -> StandLight {
    let u = (clamp(cover, 0.0, 1.0) * (COVERS - 1.0) + 0.5) / COVERS;
    let v = (row + 0.5) / (3.0 * ROWS);
    let first = textureSampleLevel(stand_texture, sky_sampler, vec2(u, v), 0.0);
    var stand: StandLight;
    stand.sky = first.rgb;
    stand.beam = first.a;
    stand.down = textureSampleLevel(stand_texture, sky_sampler, vec2(u, v + 1.0 / 3.0), 0.0).rgb;
    stand.up = textureSampleLevel(stand_texture, sky_sampler, vec2(u, v + 2.0 / 3.0), 0.0).rgb;
    return stand;
}

// Where crowns cover the share `cover` of the ground, at a depth of 0 (the tops) to 1 (the ground).
fn stand_light(cover: f32, depth: f32) -> StandLight {
    return look_up(cover, clamp(depth, 0.0, 1.0) * (DEPTHS - 1.0));
}

// On the ground.
fn ground_light(cover: f32) -> StandLight {
    return look_up(cover, DEPTHS);
}

// Share of a beam that is brought by two bands of scattered light: the first coefficient, and the second band's vector times
// the beam's direction.
fn two_bands(first: f32, band: f32) -> f32 {
    return max(0.28209479 * first + 0.48860251 * band, 0.0);
}

// Irradiance over pi on what faces the height `y` of a unit normal and would have `open` of the surroundings alone.
fn in_stand(open: vec3<f32>, y: f32, stand: StandLight) -> vec3<f32> {
    return max(stand.sky * open + 0.5 * ((1.0 + y) * stand.down + (1.0 - y) * stand.up), vec3(0.0));
}

// The same on a side whose first coefficient of transfer is `mean` and whose second band rises by `rise` (relative to it)
// towards the zenith: a hemisphere of radiance 1 has the coefficients sqrt(pi) and 0.4886 pi.
fn in_stand_by_transfer(open: vec3<f32>, mean: vec3<f32>, rise: vec3<f32>, stand: StandLight) -> vec3<f32> {
    let others = 1.7724539 * (stand.down + stand.up) + 1.5349901 * rise * (stand.down - stand.up);
    return max(stand.sky * max(open, vec3(0.0)) + mean * others, vec3(0.0));
}
