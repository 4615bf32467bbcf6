//! What the shaders of the styles read.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::{
    render::{components::DrawnStyle, view::PreparedView},
    style::{Deviations, LineNormals, NoiseAnchor, Style, Watercolour, anchor::anchor, deviations::LINES},
};

/// `Style` of `shaders/style/style.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct StyleUniform {
    /// The camera in metres, modulo [`NOISE_SPAN`](crate::style::anchor::NOISE_SPAN).
    pub anchor: [f32; 3],
    /// Pixels of the picture per pixel of one of 720 lines.
    pub unit: f32,
    /// Pixels of the picture.
    pub size: [f32; 2],
    /// Pixels of the maps.
    pub map_size: [f32; 2],
    /// Linear colour of the paper.
    pub paper: [f32; 3],
    /// Unpainted margin as a fraction of the picture's height.
    pub margin: f32,
    /// Linear colour of pencil and pen.
    pub ink: [f32; 3],
    /// Strength of the pencil.
    pub sketch: f32,
    /// Linear colour of the distance.
    pub distance: [f32; 3],
    /// How much the distance fades.
    pub air: f32,
    /// Transmittance of the night's glaze.
    pub night: [f32; 3],
    /// As [`Watercolour::flow`].
    pub flow: f32,
    /// As [`Watercolour::edges`].
    pub edges: f32,
    /// As [`Watercolour::granulation`].
    pub granulation: f32,
    /// As [`Watercolour::wetness`].
    pub wetness: f32,
    /// As [`Watercolour::dabs`].
    pub dabs: f32,
    /// As [`Watercolour::shadow`].
    pub shadow: f32,
    /// Metres.
    pub shadow_softness: f32,
    /// Pixels of the maps.
    pub line_width: f32,
    /// How small a discontinuity has a contour.
    pub detail: f32,
    /// Hatching of what lies in shade.
    pub hatching: f32,
    /// Tones of each colour.
    pub tones: f32,
    /// 1: contours of normals scaled by the ambient visibility.
    pub scaled_normals: f32,
    /// How far foliage takes on the colour of the scene's own leaves.
    pub scene: f32,
    /// As [`NoiseAnchor`], in its order.
    pub noise_anchor: u32,
    /// As [`Watercolour::textures`].
    pub textures: f32,
    /// Deviation of the Gaussian of light and depth, pixels of the maps.
    pub softness: f32,
    /// WGSL rounds the size up to 16 bytes.
    pub padding: u32,
}

/// `Layer` of `shaders/style/watercolor.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LayerUniform {
    /// Threshold of the shape.
    pub threshold: f32,
    /// Half the width of its edge.
    pub softness: f32,
    /// Factor on the darkening of rims.
    pub edge: f32,
    /// 1 for foliage.
    pub foliage: f32,
}

/// `Particle` of `shaders/style/particles.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GpuParticle {
    /// Metres in the plant's frame.
    pub position: [f32; 3],
    /// Octahedral, two snorm16.
    pub normal: u32,
}

/// `ParticleView` of `shaders/style/particles.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ParticleViewUniform {
    /// Metres across a dab.
    pub size: f32,
    /// Least pixels of the maps across one.
    pub least_pixels: f32,
    /// Dabs per area of a crown and area of their own.
    pub cover: f32,
    /// Metres to which they are seen into a crown.
    pub reach: f32,
    /// Between dark, medium and bright.
    pub thresholds: [f32; 2],
    /// Texels of the maps.
    pub map_size: [f32; 2],
    /// Metres over which they give way to washes.
    pub fade: [f32; 2],
}

/// `BlurJob` of `shaders/style/blur.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BlurUniform {
    /// From one point of the Gaussian to the next, in texels of the source.
    pub step: [f32; 2],
    /// Texels of the source along the sides of a texel of the target.
    pub scale: [f32; 2],
    /// From one point to the next, in standard deviations.
    pub spacing: f32,
    /// First of the four layers, for identifiers.
    pub first_layer: u32,
    /// 1: the third and fourth channel are a depth in two values.
    pub splits_depth: u32,
    /// WGSL rounds the size up to 8 bytes.
    pub padding: u32,
}

/// Width of the pencil under a watercolour, pixels of a picture of 720 lines.
const PENCIL_WIDTH: f32 = 1.6;

impl StyleUniform {
    /// The values of `drawn` in `view`, for a picture and maps of these sizes in pixels.
    pub fn new(drawn: &DrawnStyle, view: &PreparedView, size: (u32, u32), map_size: (u32, u32)) -> Self {
        let float = |(width, height): (u32, u32)| [width as f32, height as f32];
        let unit = size.1 as f32 / LINES;
        let map_unit = map_size.1 as f32 / LINES;
        let mut uniform = Self {
            anchor: anchor(view.camera).to_array(),
            unit,
            size: float(size),
            map_size: float(map_size),
            tones: 3.0,
            softness: Deviations::of(&drawn.style).lights * map_unit,
            ..Self::default()
        };
        if let Some(palette) = drawn.palette() {
            uniform.paper = palette.paper.0.to_array();
            uniform.ink = palette.ink.0.to_array();
            uniform.distance = palette.distance.0.to_array();
            uniform.scene = palette.scene;
            uniform.night = Vec3::ONE.lerp(palette.night.0, night(view.exposure)).to_array();
        }
        let mut lines = |width: f32, detail: f32, normals: LineNormals| {
            uniform.line_width = width * map_unit;
            uniform.detail = detail;
            uniform.scaled_normals = f32::from(u8::from(normals == LineNormals::Scaled));
        };
        match &drawn.style {
            Style::Photograph => {}
            Style::Watercolour(w) => {
                lines(PENCIL_WIDTH, 1.0, LineNormals::Scaled);
                let Watercolour { margin, sketch, air, flow, edges, granulation, wetness, dabs, shadow, .. } = *w;
                let shadow_softness = w.shadow_softness;
                uniform = Self {
                    margin,
                    sketch,
                    air,
                    flow,
                    edges,
                    granulation,
                    wetness,
                    dabs,
                    shadow,
                    shadow_softness,
                    noise_anchor: number(w.noise),
                    textures: w.textures,
                    ..uniform
                };
            }
            Style::Lines(l) => {
                lines(l.width, l.detail, l.normals);
                uniform.hatching = l.hatching;
                uniform.noise_anchor = number(l.noise);
                uniform.shadow_softness = 2.0;
            }
            Style::Toon(t) => {
                lines(t.width, t.detail, t.normals);
                uniform.tones = t.tones.max(1) as f32;
                uniform.shadow_softness = 1.0;
            }
        }
        uniform
    }
}

fn number(anchor: NoiseAnchor) -> u32 {
    match anchor {
        NoiseAnchor::Scene => 0,
        NoiseAnchor::Page => 1,
        NoiseAnchor::Solid => 2,
    }
}

/// How much of the night's glaze there is (0..1) at a camera's exposure, the factor from radiance to the picture: none by day, all
/// of it from moonlight on.
fn night(exposure: f32) -> f32 {
    let ev100 = (1.0 / (1.2 * exposure.max(1e-12))).log2();
    1.0 - crate::math::smoothstep(0.0, 9.0, ev100)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_night_is_glazed_and_the_day_is_not() {
        let exposure = |ev: f32| 1.0 / (1.2 * ev.exp2());
        assert!(night(exposure(14.0)) < 1e-6 && night(exposure(-2.0)) > 0.99 && night(0.0) < 1e-6);
    }
}
