// What every pass of a view shares: bind group 0. Rust twins in src/render/frame/uniforms.rs.
#define_import_path canopy::frame

struct Frame {
    // Camera-relative metres (world axes, camera at the origin) to clip space, reversed depth.
    clip_from_relative: mat4x4<f32>,
    relative_from_clip: mat4x4<f32>,
    // xz: camera position modulo NOISE_PERIOD in metres, y: metres above the datum, w: focal length in pixels.
    camera: vec4<f32>,
    // Width, height in pixels and their inverses.
    viewport: vec4<f32>,
    // x: 1 where alpha to coverage is on, y: 1 where trees are tinted by level of detail, z: mean canopy cover.
    flags: vec4<f32>,
}

// The light of the moment, premultiplied by the exposure.
struct Light {
    // To the light that casts shadows; w: sine of its elevation.
    key_direction: vec4<f32>,
    // Illuminance normal to its direction.
    key_illuminance: vec4<f32>,
    // To the sun; w: cosine of the disc's angular radius.
    sun_direction: vec4<f32>,
    // Radiance of the sun's disc.
    sun_radiance: vec4<f32>,
    // To the moon; w: cosine of the disc's angular radius.
    moon_direction: vec4<f32>,
    // Radiance of the moon's disc; w: lit fraction.
    moon_radiance: vec4<f32>,
    // Radiance that a white Lambertian surface sends back under the sky: spherical harmonics, bands 0 to 2.
    sky: array<vec4<f32>, 9>,
    // Extinction per metre at the datum, rgb; w: one over the scale height in metres.
    fog: vec4<f32>,
    // xy: unit vector to the sun in the ground plane (x, z), z: exposure, w: the most colour that night sight takes.
    sky_frame: vec4<f32>,
    // rgb: night tint, w: its amount 0..1.
    night: vec4<f32>,
    // World axes to the stars' frame, by columns.
    star_frame: array<vec4<f32>, 3>,
    // x: cells along a cube face's edge, y: seed, z: share of cells with a star.
    stars: vec4<f32>,
}

// Where the ground map lies: u = (x - origin.x) * inverse_size.x in camera-relative metres.
struct GroundMap {
    origin: vec2<f32>,
    inverse_size: vec2<f32>,
}

struct Cascade {
    // Camera-relative metres to the map: xy in -1..1, z the reversed depth 0..1.
    map_from_relative: mat4x4<f32>,
    // x: metres a texel, y: radius around the camera that it serves in metres, z: depth range in metres.
    size: vec4<f32>,
}

const MAX_CASCADES: i32 = 4;

struct Shadow {
    cascades: array<Cascade, MAX_CASCADES>,
    // x: number of cascades, y: one over the map's size in texels.
    count: vec4<f32>,
    ground: GroundMap,
}

const NOISE_PERIOD: f32 = 1024.0;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> light: Light;
@group(0) @binding(2) var<uniform> shadow: Shadow;
@group(0) @binding(3) var sky_texture: texture_2d<f32>;
@group(0) @binding(4) var sky_sampler: sampler;
@group(0) @binding(5) var shadow_map: texture_depth_2d_array;
@group(0) @binding(6) var shadow_sampler: sampler_comparison;
@group(0) @binding(7) var ground_texture: texture_2d<f32>;
@group(0) @binding(8) var stand_texture: texture_2d<f32>;
