//! Rust twins of `shaders/common/frame.wgsl`; `tests/shaders.rs` compares sizes and offsets with the WGSL.

use bytemuck::{Pod, Zeroable};

/// Period in metres of everything that is drawn by world position (ground noise); a power of two.
pub const NOISE_PERIOD: f64 = 1024.0;

/// Most cascades a view can have.
pub const MAX_CASCADES: usize = 4;

/// `Frame` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FrameUniform {
    /// Camera-relative metres to clip space, column-major.
    pub clip_from_relative: [[f32; 4]; 4],
    /// Its inverse.
    pub relative_from_clip: [[f32; 4]; 4],
    /// Camera modulo [`NOISE_PERIOD`] (x, z), height above the datum (y), focal length in pixels (w).
    pub camera: [f32; 4],
    /// Width, height in pixels and their inverses.
    pub viewport: [f32; 4],
    /// Alpha to coverage, tint by level of detail, mean canopy cover, unused.
    pub flags: [f32; 4],
}

/// `Light` of `frame.wgsl`, premultiplied by the exposure.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightUniform {
    /// To the key light, and the sine of its elevation.
    pub key_direction: [f32; 4],
    /// Illuminance of the key light normal to its direction.
    pub key_illuminance: [f32; 4],
    /// To the sun, and the cosine of its disc's angular radius.
    pub sun_direction: [f32; 4],
    /// Radiance of the sun's disc.
    pub sun_radiance: [f32; 4],
    /// To the moon, and the cosine of its disc's angular radius.
    pub moon_direction: [f32; 4],
    /// Radiance of the moon's disc, and its lit fraction.
    pub moon_radiance: [f32; 4],
    /// Exitant radiance of a white Lambertian surface under the sky, bands 0 to 2.
    pub sky: [[f32; 4]; 9],
    /// Extinction per metre at the datum, one over the scale height.
    pub fog: [f32; 4],
    /// Unit vector to the sun in the ground plane (x, z), exposure, the most colour that night sight takes.
    pub sky_frame: [f32; 4],
    /// Night tint and its amount.
    pub night: [f32; 4],
    /// Columns of the rotation from the world into the stars' frame.
    pub star_frame: [[f32; 4]; 3],
    /// Cells along a cube face's edge, seed, share of cells with a star, unused.
    pub stars: [f32; 4],
}

/// `Cascade` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CascadeUniform {
    /// Camera-relative metres to the map's clip space.
    pub map_from_relative: [[f32; 4]; 4],
    /// Metres a texel, served radius in metres, depth range in metres, unused.
    pub size: [f32; 4],
}

/// `Shadow` of `frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ShadowUniform {
    /// From the finest to the widest.
    pub cascades: [CascadeUniform; MAX_CASCADES],
    /// Number of cascades, one over the map's size in texels, unused, unused.
    pub count: [f32; 4],
    /// Ground map: camera-relative origin (x, z) and inverse size.
    pub ground: [f32; 4],
}

/// `CascadeView` of `shaders/sun_shadow/caster.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CascadeViewUniform {
    /// Metres relative to the box's centre to the map's clip space.
    pub clip_from_anchor: [[f32; 4]; 4],
    /// To the light.
    pub direction: [f32; 4],
}
