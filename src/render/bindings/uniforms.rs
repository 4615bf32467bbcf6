//! Rust twins of `shaders/common/frame.wgsl`; `tests/shaders.rs` compares sizes and offsets with the WGSL.

use bytemuck::{Pod, Zeroable};

/// Layers of foliage that the surface of a forest shows.
pub const FOREST_LAYERS: usize = 4;

/// Maximum number of cascades of a view.
pub const MAX_CASCADES: usize = 4;

/// `Frame` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FrameUniform {
    /// Camera-relative metres to clip space, column-major.
    pub clip_from_relative: [[f32; 4]; 4],
    /// Its inverse.
    pub relative_from_clip: [[f32; 4]; 4],
    /// Camera position: x and z on the ground, from the middle of their [block](crate::terrain::ground_noise::NOISE_BLOCK), y above the datum;
    /// metres.
    pub camera: [f32; 3],
    /// Focal length in pixels (vertical).
    pub focal_length_pixels: f32,
    /// Mean canopy cover where the terrain is known, 0..1.
    pub mean_cover: f32,
    /// How open the camera's place is, 0..1.
    pub openness: f32,
    /// The camera's block of the ground's noise: column and row, modulo 2³².
    pub noise_block: [i32; 2],
    /// The forest as a surface: distances at which it begins and at which no tree is drawn, and its height above the ground, metres.
    pub forest_surface: [f32; 4],
    /// Albedo of crowns that are seen together.
    pub crown_albedo: [f32; 3],
    /// WGSL begins a vector of four values at 16 bytes.
    pub albedo_padding: f32,
    /// For each of the first layers of foliage of the styles, the fraction of the forest's leaves in it and in those before it, 0..1.
    pub crown_layers: [f32; FOREST_LAYERS],
}

/// `Light` of `frame.wgsl`, premultiplied by the exposure.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightUniform {
    /// Unit vector to the key light: the one that casts shadows, sun or moon.
    pub key_direction: [f32; 3],
    /// Factor from radiance in nits to the attachment's values.
    pub exposure: f32,
    /// Illuminance of the key light, normal to its direction.
    pub key_illuminance: [f32; 3],
    /// Maximum loss of colour by night vision, 0..1.
    pub scotopic_strength: f32,
    /// Unit vector to the sun.
    pub sun_direction: [f32; 3],
    /// Cosine of the disc's angular radius.
    pub sun_disc_cosine: f32,
    /// Radiance of the sun's disc.
    pub sun_radiance: [f32; 3],
    /// Cells of the star field along a cube face's edge.
    pub star_cells: f32,
    /// Unit vector to the moon.
    pub moon_direction: [f32; 3],
    /// Cosine of the disc's angular radius; above 1 without a moon.
    pub moon_disc_cosine: f32,
    /// Radiance of the moon's disc.
    pub moon_radiance: [f32; 3],
    /// Fraction of the star field's cells with a star, 0..1.
    pub star_density: f32,
    /// Exitant radiance of a white Lambertian surface under the sky, bands 0 to 2.
    pub sky: [[f32; 4]; 9],
    /// Extinction per metre at the datum.
    pub fog_extinction: [f32; 3],
    /// One over the fog's scale height, 1/m.
    pub fog_inverse_scale_height: f32,
    /// Colour of night vision, luminance 1.
    pub scotopic_tint: [f32; 3],
    /// Fraction of night vision that the adaptation to the whole image allows, 0..1.
    pub scotopic_amount: f32,
    /// Rotation from the world into the stars' frame, by columns of four.
    pub star_frame: [[f32; 4]; 3],
    /// Radiance of open, level ground.
    pub ground_radiance: [f32; 3],
    /// Seed of the star field.
    pub star_seed: u32,
    /// Colour of the fraction of light that is left without the key light, relative to that of its luminance.
    pub shaded_hue: [f32; 3],
    /// Luminance of white, level ground in the light of the whole sky.
    pub level_radiance: f32,
    /// Unit vector to the sun in the ground plane (x, z).
    pub sky_axis: [f32; 2],
    /// WGSL rounds the size up to 16 bytes.
    pub end_padding: [u32; 2],
}

/// `Cascade` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CascadeUniform {
    /// Camera-relative metres to the map's clip space.
    pub map_from_relative: [[f32; 4]; 4],
    /// Metres per texel.
    pub texel: f32,
    /// Radius around the camera within which the map is read, metres.
    pub radius: f32,
    /// WGSL rounds the size up to 16 bytes.
    pub padding: [f32; 2],
}

/// `Shadow` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ShadowUniform {
    /// From the finest to the widest.
    pub cascades: [CascadeUniform; MAX_CASCADES],
    /// Ground map: camera-relative origin (x, z) and inverse size.
    pub ground: [f32; 4],
    /// Number of cascades.
    pub cascade_count: i32,
    /// One over the map's size in texels.
    pub inverse_map_size: f32,
    /// Half width in metres of the soft edge of shadows on the ground.
    pub softness: f32,
    /// WGSL rounds the size up to 16 bytes.
    pub padding: f32,
}

/// `CascadeView` of `shaders/sun_shadow/caster.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CascadeViewUniform {
    /// Metres relative to the box's centre to the map's clip space.
    pub clip_from_anchor: [[f32; 4]; 4],
    /// Unit vector to the light.
    pub direction: [f32; 3],
    /// WGSL rounds the size up to 16 bytes.
    pub padding: f32,
}
