// Noise that is fixed to the scene and has the same size on paper at every distance: a dynamic solid texture [Bénard,
// Bousseau, Thollot 2009]. Octaves fade in and out with the distance, so that nothing swims and nothing pops.
#define_import_path canopy::style_noise

#import canopy::constants::NOISE_SPAN
#import canopy::frame::{frame, relative_position}
#import canopy::hash::mix32
#import canopy::style::style

fn lattice(cell: vec3<i32>, seed: u32) -> f32 {
    let c = vec3<u32>(cell);
    let h = mix32(c.x * 0x8da6b343u + c.y * 0xd8163841u + c.z * 0xcb1ab31fu + seed);
    return f32(h >> 8u) / 8388608.0 - 1.0;
}

// Value noise on the lattice of integers, -1..1. `wrap` is the number of cells after which it repeats, a power of two.
fn value_noise(p: vec3<f32>, wrap: i32, seed: u32) -> f32 {
    let base = floor(p);
    let f = p - base;
    let t = f * f * (3.0 - 2.0 * f);
    let mask = vec3(wrap - 1);
    let a = vec3<i32>(base) & mask;
    let b = (vec3<i32>(base) + 1) & mask;
    let bottom = mix(
        mix(lattice(vec3(a.x, a.y, a.z), seed), lattice(vec3(b.x, a.y, a.z), seed), t.x),
        mix(lattice(vec3(a.x, b.y, a.z), seed), lattice(vec3(b.x, b.y, a.z), seed), t.x),
        t.y,
    );
    let top = mix(
        mix(lattice(vec3(a.x, a.y, b.z), seed), lattice(vec3(b.x, a.y, b.z), seed), t.x),
        mix(lattice(vec3(a.x, b.y, b.z), seed), lattice(vec3(b.x, b.y, b.z), seed), t.x),
        t.y,
    );
    return mix(bottom, top, t.z);
}

// The sky is a sphere, metres.
const SKY_RADIUS: f32 = 4000.0;

// Where noise is looked up for a pixel.
struct NoisePlace {
    position: vec3<f32>,
    // The length there that is a pixel of a picture of 720 lines.
    pixel: f32,
    // Metres from the camera to what is seen.
    distance: f32,
}

// Metres a pixel of noise that has one size in metres: that of a tree some 20 m away.
const SOLID_PIXEL: f32 = 0.03;

// The place of noise for a pixel in which `depth` is seen; that of the sky is 0. The sky turns with the view and does not move with the
// camera.
fn noise_place(uv: vec2<f32>, depth: f32) -> NoisePlace {
    // In pixels of a picture of 720 lines.
    let page = uv * style.size / style.unit;
    let sky = depth <= 0.0;
    let along = relative_position(uv, depth);
    let relative = select(along, normalize(along) * SKY_RADIUS, sky);
    let on_page = style.noise_anchor == 1u;
    let solid = style.noise_anchor == 2u;
    let position = relative + select(style.anchor, vec3(0.0), sky);
    let distance = length(relative);
    let footprint = distance / frame.focal_length_pixels * style.unit;
    return NoisePlace(
        select(position, vec3(page, 0.0), on_page),
        select(select(footprint, SOLID_PIXEL, solid), 1.0, on_page),
        distance,
    );
}

// Noise at `position` (metres, modulo NOISE_SPAN) whose features are `size` metres, -1..1: two octaves that trade places as
// the size grows.
fn anchored_noise(position: vec3<f32>, size: f32, seed: u32) -> f32 {
    let level = clamp(log2(max(size, 1e-3)), -8.0, 11.0);
    let octave = floor(level);
    let blend = level - octave;
    let cell = exp2(octave);
    let finer = value_noise(position / cell, i32(NOISE_SPAN / cell), seed);
    let coarser = value_noise(position / (2.0 * cell), i32(NOISE_SPAN / (2.0 * cell)), seed);
    // The deviation of a sum of independent values stays the same.
    return mix(finer, coarser, blend) * inverseSqrt(blend * blend + (1.0 - blend) * (1.0 - blend));
}
