// The colour of the ground: leaf litter and herbs under trees, grass in the open, rock where it is steep. The Rust twin
// is src/reference/soil.rs.
#define_import_path canopy::ground_color

#import canopy::constants::LEAF_OCTAVE
#import canopy::frame::frame
#import canopy::ground_noise::{joined_bands, noise_band, noise_step, scattered_leaves, visible_part}

// Slope of the relief of crowns that are seen as a surface: with it the picture has the local contrast of the trees that end there.
const CROWN_RELIEF: f32 = 0.6;

struct GroundColor {
    albedo: vec3<f32>,
    // What bends the normal: a slope along x and z.
    tilt: vec2<f32>,
    // Between clods and blades: the fraction of the surroundings that is visible, 0..1.
    ambient_visibility: f32,
}

// `xz` as `frame.camera.xz` counts it, metres; `steepness` 1 less the normal's height; `cover` the canopy cover, `far`
// how much of it is seen as crowns, because its trees are not drawn, 0..1; `footprint` the width of a pixel on the
// ground, metres.
fn ground_color(xz: vec2<f32>, steepness: f32, cover: f32, far: f32, footprint: f32) -> GroundColor {
    let wide = noise_band(xz, 0, 4, footprint);
    // Octaves of 8 to 16 m, as wide as crowns.
    let crown_sized = noise_band(xz, 6, 2, footprint);
    let middle = joined_bands(noise_band(xz, 4, 2, footprint), crown_sized);
    let fine = noise_band(xz, 8, 3, footprint);
    let grain = noise_band(xz, 11, 4, footprint);

    let wooded = noise_step(0.275, 0.175, cover + 0.05 * middle.value.y + 0.03 * fine.value.x, 0.0025 * middle.lost + 0.0009 * fine.lost);
    // Leaves are broad, blades of grass narrow.
    let leaf = scattered_leaves(xz, 0.10 + 0.24 * wooded, footprint);
    let leaf_lost = 1.0 - visible_part(512.0 * exp2(-f32(LEAF_OCTAVE)), footprint);

    let dryness = noise_step(0.0, 1.1, 0.4 * fine.value.x + 0.55 * grain.value.x + 0.95 * leaf, 0.16 * fine.lost + 0.30 * grain.lost + 0.25 * leaf_lost);
    let bleached = noise_step(1.0, 0.25, leaf + 0.25 * grain.value.y, 0.06 * grain.lost + 0.25 * leaf_lost);
    let leaves = mix(vec3(0.033, 0.028, 0.015), vec3(0.098, 0.078, 0.040), dryness);
    let litter = mix(leaves, vec3(0.128, 0.110, 0.068), 0.75 * bleached);
    let herb_tone = noise_step(0.0, 1.2, 0.8 * grain.value.y + 0.6 * leaf, 0.64 * grain.lost + 0.1 * leaf_lost);
    let herbs = mix(vec3(0.026, 0.044, 0.012), vec3(0.058, 0.088, 0.023), herb_tone);
    let green = noise_step(0.6, 0.5, 0.6 * middle.value.y + 0.65 * fine.value.y + 0.3 * grain.value.y, 0.36 * middle.lost + 0.42 * fine.lost + 0.09 * grain.lost);
    let forest_floor = mix(litter, herbs, 0.85 * green);

    let lush_tone = noise_step(0.0, 1.4, 0.4 * fine.value.x + 0.7 * grain.value.x + 0.9 * leaf, 0.16 * fine.lost + 0.49 * grain.lost + 0.1 * leaf_lost);
    let dry_tone = noise_step(0.0, 1.4, 0.4 * fine.value.y + 0.7 * grain.value.y + 0.9 * leaf, 0.16 * fine.lost + 0.49 * grain.lost + 0.1 * leaf_lost);
    let lush = mix(vec3(0.042, 0.076, 0.016), vec3(0.090, 0.134, 0.033), lush_tone);
    let dry = mix(vec3(0.100, 0.098, 0.040), vec3(0.185, 0.164, 0.078), dry_tone);
    let drought = 0.7 * wide.value.x + 0.6 * middle.value.x + 0.35 * fine.value.y + 0.25 * grain.value.x;
    let meadow = mix(lush, dry, noise_step(0.35, 1.3, drought, 0.49 * wide.lost + 0.36 * middle.lost + 0.12 * fine.lost + 0.06 * grain.lost));

    let rock_tone = noise_step(0.0, 1.3, 0.6 * fine.value.y + 0.6 * grain.value.y, 0.36 * fine.lost + 0.36 * grain.lost);
    let rock = mix(vec3(0.13, 0.12, 0.105), vec3(0.25, 0.235, 0.21), rock_tone);

    var albedo = mix(meadow, forest_floor, wooded);
    // Crowns from above: as bright as the trees that end here, with their variation from crown to crown.
    let crown_tone = noise_step(0.0, 1.4, 0.25 * middle.value.x + 0.9 * fine.value.y, 0.06 * middle.lost + 0.81 * fine.lost);
    let crowns = frame.crown_albedo * mix(0.62, 1.38, crown_tone);
    albedo = mix(albedo, crowns, wooded * far);
    let stony = noise_step(0.36, 0.06, steepness + 0.025 * middle.value.x + 0.015 * fine.value.x, 0.0006 * middle.lost + 0.0002 * fine.lost);
    albedo = mix(albedo, rock, stony);
    albedo *= clamp(1.0 + 0.07 * (wide.value.y + middle.value.x) + 0.05 * fine.value.x, 0.5, 1.6);

    var color: GroundColor;
    color.albedo = albedo;
    // Crowns stand beside each other as hills do.
    color.tilt = 0.06 * fine.value + 0.13 * grain.value + CROWN_RELIEF * wooded * far * crown_sized.value;
    color.ambient_visibility = clamp(0.9 + 0.05 * grain.value.x + 0.08 * leaf, 0.6, 1.0);
    return color;
}
