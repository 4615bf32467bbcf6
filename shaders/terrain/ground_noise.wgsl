// Noise of the ground's colour, without a period: gradient noise [Perlin 1985; the fade of Perlin 2002] over a hashed
// lattice, and scattered leaves. The Rust twin is src/terrain/ground_noise.rs.
#define_import_path canopy::ground_noise

#import canopy::constants::{NOISE_OCTAVE_DEVIATION, NOISE_WEIGHT_RATIO, LEAF_OCTAVE, LEAF_SEED}
#import canopy::hash::mix32
#import canopy::frame::frame

fn hash_row(z: u32, seed: u32) -> u32 {
    return mix32(z + seed * 0x632be5abu);
}

fn hash_cell(x: u32, row: u32) -> u32 {
    return mix32(x * 0x9e3779b1u + row);
}

// A point in the lattice of an octave.
struct LatticePoint {
    cell: vec2<u32>,
    // In the cell, 0..1.
    within: vec2<f32>,
}

// Octave i has cells of 1024 / 2^i metres. The lattices of neighbouring octaves are rotated by the angle of a 3-4-5
// triangle and shifted, so that no direction and no point is common to all. A block of frame.noise_block is 5120 m wide:
// a whole number of cells of any octave, rotated or not. Cells are counted modulo 2^32.
fn lattice_point(xz: vec2<f32>, octave: i32) -> LatticePoint {
    let turn = octave % 3;
    let sine = select(select(-0.8, 0.8, turn == 1), 0.0, turn == 0);
    let cosine = select(0.6, 1.0, turn == 0);
    let block_sine = select(select(-4, 4, turn == 1), 0, turn == 0);
    let block_cosine = select(3, 5, turn == 0);
    let rotated = vec2(cosine * xz.x - sine * xz.y, sine * xz.x + cosine * xz.y);
    let position = rotated * (exp2(f32(octave)) / 1024.0) + f32(octave) * vec2(0.37, 0.71);
    let block = frame.noise_block;
    let first = vec2(block_cosine * block.x - block_sine * block.y, block_sine * block.x + block_cosine * block.y);
    let corner = floor(position);
    let cell = bitcast<vec2<u32>>(vec2<i32>(corner)) + (bitcast<vec2<u32>>(first) << vec2(u32(octave)));
    return LatticePoint(cell, position - corner);
}

// The gradients of two independent noises at a lattice point, times the offset from it.
fn corner_value(hash: u32, offset: vec2<f32>) -> vec2<f32> {
    let gradients = unpack4x8snorm(hash);
    return gradients.xz * offset.x + gradients.yw * offset.y;
}

// Two independent noises of standard deviation 1 in one octave.
fn noise_octave(xz: vec2<f32>, octave: i32) -> vec2<f32> {
    let point = lattice_point(xz, octave);
    let f = point.within;
    let near_row = hash_row(point.cell.y, u32(octave));
    let far_row = hash_row(point.cell.y + 1u, u32(octave));
    let a = corner_value(hash_cell(point.cell.x, near_row), f);
    let b = corner_value(hash_cell(point.cell.x + 1u, near_row), f - vec2(1.0, 0.0));
    let c = corner_value(hash_cell(point.cell.x, far_row), f - vec2(0.0, 1.0));
    let d = corner_value(hash_cell(point.cell.x + 1u, far_row), f - vec2(1.0, 1.0));
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    return mix(mix(a, b, fade.x), mix(c, d, fade.x), fade.y) * (1.0 / NOISE_OCTAVE_DEVIATION);
}

// The part of a pattern with this wavelength that a pixel of the width `footprint` can show (both in metres): none
// below one and a half pixels, all above four.
fn visible_part(wavelength: f32, footprint: f32) -> f32 {
    return smoothstep(1.5, 4.0, wavelength / max(footprint, 1e-6));
}

// Some neighbouring octaves of noise.
struct NoiseBand {
    // Two independent noises, of mean 0 and standard deviation 1 where all octaves are visible.
    value: vec2<f32>,
    // The part of their variance that is too fine for the pixel, 0..1.
    lost: f32,
}

// The octaves from `first` on, `count` of them. Each has NOISE_WEIGHT_RATIO of the weight of the one before, and is
// faded out where pixels are too wide for it: those are not computed.
fn noise_band(xz: vec2<f32>, first: i32, count: i32, footprint: f32) -> NoiseBand {
    var sum = vec2(0.0);
    var kept = 0.0;
    var weight = 1.0;
    for (var i = first; i < first + count; i += 1) {
        let visible = visible_part(1024.0 * exp2(-f32(i)), footprint);
        if visible <= 0.0 {
            break;
        }
        sum += weight * visible * noise_octave(xz, i);
        kept += weight * visible * weight * visible;
        weight *= NOISE_WEIGHT_RATIO;
    }
    let ratio = NOISE_WEIGHT_RATIO * NOISE_WEIGHT_RATIO;
    let all = (1.0 - pow(ratio, f32(count))) / (1.0 - ratio);
    return NoiseBand(sum * inverseSqrt(all), max(1.0 - kept / all, 0.0));
}

// Two bands of two octaves each, the second of which goes on where the first ends, as one of four.
fn joined_bands(first: NoiseBand, second: NoiseBand) -> NoiseBand {
    let weight = NOISE_WEIGHT_RATIO * NOISE_WEIGHT_RATIO;
    let square = weight * weight;
    let value = (first.value + weight * second.value) * inverseSqrt(1.0 + square);
    return NoiseBand(value, (first.lost + square * second.lost) / (1.0 + square));
}

// A smooth step of a noise at `center`. The wider it is, the more of the noise's variance, `lost`, is missing: so the
// mean over many pixels stays the same.
fn noise_step(center: f32, half_width: f32, value: f32, lost: f32) -> f32 {
    let width = sqrt(half_width * half_width + 3.0 * lost);
    return smoothstep(center - width, center + width, value);
}

// Fallen leaves, or blades of grass: one in each cell of an octave. The tone of the one on top, -1..1, or 0 where there
// is none. `half_width` is a fraction of the cell; a leaf is 1.4 cells long.
fn scattered_leaves(xz: vec2<f32>, half_width: f32, footprint: f32) -> f32 {
    let cell_size = 1024.0 * exp2(-f32(LEAF_OCTAVE));
    let visible = visible_part(0.5 * cell_size, footprint);
    let point = lattice_point(xz, LEAF_OCTAVE);
    let softness = max(footprint / cell_size, 0.02);
    // The four nearest cells.
    let first = select(vec2<i32>(0), vec2<i32>(-1), point.within < vec2(0.5));
    var tone = 0.0;
    var top = -2.0;
    // Not visible: no round.
    let rounds = select(0, 4, visible > 0.0);
    for (var i = 0; i < rounds; i += 1) {
        let neighbour = first + vec2(i & 1, i >> 1u);
        let cell = point.cell + bitcast<vec2<u32>>(neighbour);
        let leaf = unpack4x8snorm(hash_cell(cell.x, hash_row(cell.y, LEAF_SEED)));
        let offset = point.within - vec2<f32>(neighbour) - 0.5 - 0.2 * leaf.xy;
        let sine = leaf.z;
        let cosine = sqrt(max(1.0 - sine * sine, 0.0));
        let along = (offset.x * cosine + offset.y * sine) * (1.0 / 0.7);
        let across = abs(offset.y * cosine - offset.x * sine);
        let edge = half_width * (1.0 - along * along);
        let covered = select(0.0, saturate((edge - across) / softness + 0.5), abs(along) < 1.0 && leaf.w > top);
        tone = mix(tone, leaf.w, covered);
        top = select(top, leaf.w, covered > 0.0);
    }
    return tone * visible;
}
