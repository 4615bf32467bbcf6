// Bind group 0, which all passes of a view share. Rust twins in src/render/bindings/uniforms.rs.
#define_import_path canopy::frame

#import canopy::constants::MAX_CASCADES

struct Frame {
    // Camera-relative metres (world axes, camera at the origin) to clip space, reversed depth.
    clip_from_relative: mat4x4<f32>,
    relative_from_clip: mat4x4<f32>,
    // Camera position: x and z from the middle of its block of the ground's noise, y above the datum; metres.
    camera: vec3<f32>,
    focal_length_pixels: f32,
    // Mean canopy cover where the terrain is known, 0..1.
    mean_cover: f32,
    // How open the camera's place is: the fraction of the light on open ground that reaches it, 0..1.
    openness: f32,
    // The camera's block of the ground's noise: column and row, modulo 2^32.
    noise_block: vec2<i32>,
    // The forest as a surface: distances at which it begins and at which no tree is drawn, and its height, metres.
    forest_surface: vec4<f32>,
    // Albedo of crowns that are seen together.
    crown_albedo: vec3<f32>,
    // For each of the first layers of foliage of the styles, the fraction of the forest's leaves in it and in those before it, 0..1.
    crown_layers: vec4<f32>,
}

// The current light, premultiplied by the exposure.
struct Light {
    // Unit vector to the key light: the one that casts shadows, sun or moon.
    key_direction: vec3<f32>,
    // Factor from radiance in nits to the attachment's values.
    exposure: f32,
    // Illuminance of the key light, normal to its direction.
    key_illuminance: vec3<f32>,
    // Maximum loss of colour by night vision, 0..1.
    scotopic_strength: f32,
    sun_direction: vec3<f32>,
    // Cosine of the disc's angular radius.
    sun_disc_cosine: f32,
    // Radiance of the sun's disc.
    sun_radiance: vec3<f32>,
    // Cells of the star field along a cube face's edge.
    star_cells: f32,
    moon_direction: vec3<f32>,
    // Cosine of the disc's angular radius.
    moon_disc_cosine: f32,
    // Radiance of the moon's disc.
    moon_radiance: vec3<f32>,
    // Fraction of the star field's cells with a star, 0..1.
    star_density: f32,
    // Exitant radiance of a white Lambertian surface under the sky: spherical harmonics, bands 0 to 2.
    sky: array<vec4<f32>, 9>,
    // Extinction per metre at the datum.
    fog_extinction: vec3<f32>,
    // 1/m.
    fog_inverse_scale_height: f32,
    // Colour of night vision, luminance 1.
    scotopic_tint: vec3<f32>,
    // Fraction of night vision that the adaptation to the whole image allows, 0..1.
    scotopic_amount: f32,
    // World axes to the stars' frame.
    star_frame: mat3x3<f32>,
    // Radiance of open, level ground.
    ground_radiance: vec3<f32>,
    star_seed: u32,
    // Colour of the fraction of light that is left without the key light, relative to that of its luminance.
    shaded_hue: vec3<f32>,
    // Luminance of white, level ground in the light of the whole sky.
    level_radiance: f32,
    // Unit vector to the sun in the ground plane (x, z).
    sky_axis: vec2<f32>,
}

// Position of the ground map: u = (x - origin.x) * inverse_size.x in camera-relative metres.
struct GroundMap {
    origin: vec2<f32>,
    inverse_size: vec2<f32>,
}

struct Cascade {
    // Camera-relative metres to the map: xy in -1..1, z the reversed depth 0..1.
    map_from_relative: mat4x4<f32>,
    // Metres per texel.
    texel: f32,
    // Radius around the camera within which the map is read, metres.
    radius: f32,
}

struct Shadow {
    cascades: array<Cascade, MAX_CASCADES>,
    ground: GroundMap,
    // Number of cascades.
    cascade_count: i32,
    // One over the map's size in texels.
    inverse_map_size: f32,
    // Half width in metres of the soft edge of shadows on the ground.
    softness: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> light: Light;
@group(0) @binding(2) var<uniform> shadow: Shadow;
@group(0) @binding(3) var sky_texture: texture_2d<f32>;
@group(0) @binding(4) var sky_sampler: sampler;
@group(0) @binding(5) var shadow_map: texture_depth_2d_array;
@group(0) @binding(6) var shadow_sampler: sampler_comparison;
@group(0) @binding(7) var ground_texture: texture_2d<f32>;
@group(0) @binding(8) var stand_texture: texture_2d<f32>;
// What relief hides of the sky's light, in two blocks, one below the other, that lie as the ground's texture does: the mean radiance over all
// directions, over `Light::level_radiance`, with the fraction of the sky's light that is left on level ground; its mean direction.
@group(0) @binding(9) var hidden_sky_texture: texture_2d<f32>;

// Camera-relative position, metres, of what is seen at `uv` (0..1, v down) with a reversed `depth`; for the sky (0), a point on its ray.
fn relative_position(uv: vec2<f32>, depth: f32) -> vec3<f32> {
    let ndc = vec2(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0);
    let position = frame.relative_from_clip * vec4(ndc, select(0.5, depth, depth > 0.0), 1.0);
    return position.xyz / position.w;
}
