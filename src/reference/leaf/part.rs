//! A part of a plant whose leaves have layers.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::{GrayImage, RgbaImage};

use super::layers::Layers;
use super::{LeafModel, LeafView};
use crate::plant::leaf_textures::{Derivation, EVEN, Sign, mean_optical_depth, thickness_and_absorption};
use crate::plant::surface::{channels_of, color_of, filled, value_of};
use crate::plant::tissue_light::TissueLight;
use crate::plant::{LeafTissue, Measured, PartKind, PlantPart};

/// The leaves of a part, ready to be looked up.
#[derive(Clone, Debug)]
pub(crate) struct PartLeaf {
    tissue: LeafTissue,
    /// Seen from the front and from the back.
    layers: [Layers; 2],
    /// How the light changes with the angle; `None` for the thesis's leaf.
    light: Option<TissueLight>,
    /// The most that the angle changes even light from before and from behind, on the front and on the back.
    most: [[f32; 2]; 2],
    /// Colour of the back, without the factor on the base colour.
    back: Option<Arc<RgbaImage>>,
    bump: Option<Arc<RgbaImage>>,
    thickness: Option<Arc<GrayImage>>,
    absorption: Option<Arc<GrayImage>>,
    /// What the colours are divided by, because they were measured through the tissue: for a mean leaf, front and back, light from
    /// before and from behind. `None`: divided by what each texel does.
    contained: Option<[[f32; 2]; 2]>,
    factor: Vec3,
}

impl PartLeaf {
    /// The leaves of `part` by `model`; `None` for wood, and where the standard model is enough.
    pub fn new(part: &PlantPart, model: LeafModel) -> Option<Self> {
        let material = &part.material;
        let tissue = match model {
            _ if part.kind == PartKind::Wood => None,
            LeafModel::Standard => None,
            LeafModel::Species => material.tissue,
            LeafModel::Layers | LeafModel::Published => Some(material.tissue.unwrap_or_default()),
        };
        let tissue = tissue?.sanitized();
        let published = model == LeafModel::Published;
        let textures = &material.leaf_textures;
        let [mut thickness, mut absorption] = [&textures.thickness, &textures.absorption].map(filled);
        if thickness.is_none() || absorption.is_none() {
            let sign = if published { Sign::Published } else { Sign::Dark };
            if let Some(derived) = thickness_and_absorption(material, Derivation { sign, high_pass: None }) {
                let [of_thickness, of_absorption] = derived.map(Arc::new);
                thickness.get_or_insert(of_thickness);
                absorption.get_or_insert(of_absorption);
            }
        }
        let front = Layers::new(&tissue, published);
        let layers = [front, front.reversed()];
        let mean = mean_optical_depth(&tissue, material, [thickness.as_deref(), absorption.as_deref()]);
        let light = (!published).then(|| TissueLight::of(&tissue, mean));
        let most = [true, false].map(|front| light.map_or([1.0; 2], |light| light.most(front)));
        let measured = if published { Measured::Nothing } else { tissue.measured };
        let contained = match measured {
            Measured::Texel => None,
            Measured::Leaf => Some(layers.map(|layers| [false, true].map(|behind| layers.perpendicular(mean, behind)))),
            Measured::Nothing => Some([[1.0; 2]; 2]),
        };
        Some(Self {
            tissue,
            layers,
            light,
            most,
            back: filled(&textures.back),
            bump: filled(&material.normal_texture),
            thickness,
            absorption,
            contained,
            factor: material.base_color,
        })
    }

    /// Whether the part is a closed volume.
    pub fn is_volume(&self) -> bool {
        self.tissue.volume
    }

    /// Thickness in metres at `uv`.
    pub fn thickness(&self, uv: Vec2) -> f32 {
        self.tissue.max_thickness * self.thickness.as_deref().map_or(EVEN, |image| value_of(image, uv))
    }

    /// Whether the optical depth of a texel changes its light.
    pub fn knows_texels(&self) -> bool {
        self.contained.is_some() || self.light.is_none()
    }

    /// Optical depth at `uv` of tissue that is `thickness` metres thick.
    pub fn optical_depth(&self, uv: Vec2, thickness: f32) -> f32 {
        let absorption = self.absorption.as_deref().map_or(EVEN, |image| value_of(image, uv));
        self.tissue.optical_depth(thickness / self.tissue.max_thickness, absorption)
    }

    /// A point of the front or the back, seen at the cosine `to_viewer`, 0..=1.
    pub fn view(&self, front: bool, optical_depth: f32, to_viewer: f32) -> LeafView {
        let layers = self.layers[usize::from(!front)];
        match &self.light {
            Some(light) => LeafView::slabs(layers, light.sides(front), to_viewer),
            None => LeafView::test_points(layers, optical_depth, to_viewer),
        }
    }

    /// The most that the angle changes even light from before and from behind.
    pub fn most(&self, front: bool) -> [f32; 2] {
        self.most[usize::from(!front)]
    }

    /// Linear colour of the back at `uv`; `None` where it is that of the front.
    pub fn back(&self, uv: Vec2) -> Option<Vec3> {
        self.back.as_deref().map(|image| self.factor * color_of(image, uv))
    }

    /// The normal in the frame of the texture, +Z away from the front; `None` without a bump texture.
    pub fn bump(&self, uv: Vec2) -> Option<Vec3> {
        let image = self.bump.as_deref()?;
        let normal = 2.0 * channels_of(image, uv) - 1.0;
        normal.try_normalize().filter(|normal| normal.z > 0.0)
    }

    /// Factors on the colours for light from before and from behind under perpendicular light: what the tissue does, over what the
    /// colours contain of it.
    pub fn perpendicular(&self, front: bool, optical_depth: f32) -> [f32; 2] {
        let Some(contained) = self.contained else { return [1.0; 2] };
        let side = usize::from(!front);
        [false, true].map(|behind| {
            let contained = contained[side][usize::from(behind)];
            if contained > 0.0 { self.layers[side].perpendicular(optical_depth, behind) / contained } else { 0.0 }
        })
    }
}
