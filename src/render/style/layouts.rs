//! Bind group layouts of the styles' passes.

use bevy::render::render_resource::{
    BindGroupLayoutDescriptor, BindGroupLayoutEntries, BufferSize, SamplerBindingType, ShaderStages, TextureSampleType,
    binding_types::{sampler, storage_buffer_read_only_sized, texture_2d, texture_2d_array, uniform_buffer_sized},
};

use super::uniforms::{BlurUniform, ParticleViewUniform, StyleUniform};
use crate::style::Style;

/// Bytes of a job of the Gaussian.
pub const BLUR_SIZE: Option<BufferSize> = BufferSize::new(size_of::<BlurUniform>() as u64);
const STYLE_SIZE: Option<BufferSize> = BufferSize::new(size_of::<StyleUniform>() as u64);

/// What the picture's pipeline depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Picture {
    /// Washes.
    Watercolour,
    /// Contours and hatching.
    Lines,
    /// Few tones.
    Toon,
}

impl Picture {
    /// The picture of a style; `None` for a photograph.
    pub fn of(style: &Style) -> Option<Self> {
        match style {
            Style::Photograph => None,
            Style::Watercolour(_) => Some(Self::Watercolour),
            Style::Lines(_) => Some(Self::Lines),
            Style::Toon(_) => Some(Self::Toon),
        }
    }
}

/// Group 1: the style, depth, surfaces.
pub fn illumination_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_style_light",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform_buffer_sized(false, STYLE_SIZE),
                texture_2d(TextureSampleType::Depth),
                texture_2d(TextureSampleType::Float { filterable: false }),
            ),
        ),
    )
}

/// Group 1 of the contours: the style, light, normals.
pub fn contours_layout() -> BindGroupLayoutDescriptor {
    let map = || texture_2d(TextureSampleType::Float { filterable: true });
    BindGroupLayoutDescriptor::new(
        "canopy_style_contours",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (uniform_buffer_sized(false, STYLE_SIZE), map(), map(), sampler(SamplerBindingType::Filtering)),
        ),
    )
}

/// Group 1 of the lines: the style, contours.
pub fn lines_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_style_lines",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform_buffer_sized(false, STYLE_SIZE),
                texture_2d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
            ),
        ),
    )
}

/// Group 1 of the noise: the style, depth.
pub fn noises_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_style_noises",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (uniform_buffer_sized(false, STYLE_SIZE), texture_2d(TextureSampleType::Depth)),
        ),
    )
}

/// Group 0: the job; identifiers, or a map and its sampler.
pub fn blur_layout(identities: bool) -> BindGroupLayoutDescriptor {
    let job = uniform_buffer_sized(true, BLUR_SIZE);
    let entries = if identities {
        BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, (job, texture_2d(TextureSampleType::Uint))).to_vec()
    } else {
        let map = texture_2d(TextureSampleType::Float { filterable: true });
        let entries = (job, map, sampler(SamplerBindingType::Filtering));
        BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, entries).to_vec()
    };
    BindGroupLayoutDescriptor::new("canopy_style_blur", &entries)
}

/// Group 2 of the particles: particles, settings, soft depth.
pub fn particles_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_style_particles",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX_FRAGMENT,
            (
                storage_buffer_read_only_sized(false, None).visibility(ShaderStages::VERTEX),
                uniform_buffer_sized(false, BufferSize::new(size_of::<ParticleViewUniform>() as u64)),
                texture_2d(TextureSampleType::Float { filterable: false }).visibility(ShaderStages::FRAGMENT),
            ),
        ),
    )
}

/// Group 1 of the picture.
pub fn picture_layout(picture: Picture) -> BindGroupLayoutDescriptor {
    let uniform = uniform_buffer_sized(false, STYLE_SIZE);
    let map = || texture_2d(TextureSampleType::Float { filterable: true });
    let depth = texture_2d(TextureSampleType::Depth);
    let filtering = || sampler(SamplerBindingType::Filtering);
    let entries = match picture {
        Picture::Watercolour => BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform,
                depth,
                texture_2d(TextureSampleType::Uint),
                map(),
                map(),
                map(),
                texture_2d_array(TextureSampleType::Float { filterable: true }),
                map(),
                map(),
                storage_buffer_read_only_sized(false, None),
                filtering(),
                filtering(),
                map(),
                map(),
                map(),
                map(),
            ),
        )
        .to_vec(),
        Picture::Lines | Picture::Toon => BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform,
                depth,
                map(),
                map(),
                map(),
                map(),
                map(),
                map(),
                filtering(),
                filtering(),
                texture_2d(TextureSampleType::Uint),
            ),
        )
        .to_vec(),
    };
    BindGroupLayoutDescriptor::new("canopy_style_picture", &entries)
}
