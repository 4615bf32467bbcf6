//! Optical properties of a forest's leaves, averaged over their areas.

use std::f32::consts::PI;

use glam::Vec3;

use super::uniforms::layers_of;
use crate::{
    bake::BakedPlant, light::StandTrees, plant::LeafColors, render::bindings::uniforms::FOREST_LAYERS,
    scatter::PackedStand,
};

/// Sums over leaves, weighted by area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leaves {
    area: f32,
    reflected: Vec3,
    transmitted: Vec3,
    crown_width: f32,
    crown_length: f32,
    crown_fill: f32,
    /// Area in each of the first layers of foliage; what belongs to later ones is in the last.
    layers: [f32; FOREST_LAYERS],
}

impl Leaves {
    /// The sums of all trees of a stand of `plants`, by variant.
    pub fn of(stand: &PackedStand, plants: &[BakedPlant]) -> Self {
        let mut areas = vec![0.0; plants.len()];
        for tree in &stand.trees {
            if let Some(area) = areas.get_mut(usize::from(tree.variant())) {
                *area += tree.scale().powi(2);
            }
        }
        let colors: Vec<LeafColors> = plants.iter().map(|plant| plant.plant.leaf_colors()).collect();
        let layers = layers_of(colors.iter().map(|colors| colors.reflected));
        let of_plant = |(((plant, colors), layer), scaled): (((&BakedPlant, &LeafColors), u8), f32)| {
            let area = colors.area * scaled;
            let own = usize::from(layer).min(FOREST_LAYERS - 1);
            Self {
                layers: std::array::from_fn(|layer| if layer == own { area } else { 0.0 }),
                area,
                reflected: colors.reflected * area,
                transmitted: colors.transmitted * area,
                crown_width: plant.plant.crown_width() * area,
                crown_length: plant.plant.crown_length() * area,
                crown_fill: crown_fill(plant) * area,
            }
        };
        plants.iter().zip(&colors).zip(layers).zip(areas).map(of_plant).fold(Self::default(), Self::add)
    }

    /// The sums of two forests.
    pub fn add(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            reflected: self.reflected + other.reflected,
            transmitted: self.transmitted + other.transmitted,
            crown_width: self.crown_width + other.crown_width,
            crown_length: self.crown_length + other.crown_length,
            crown_fill: self.crown_fill + other.crown_fill,
            layers: std::array::from_fn(|layer| self.layers[layer] + other.layers[layer]),
        }
    }

    /// For each of the first layers of foliage, the fraction of the leaves' area in it and in those before it, 0..1. 1 without leaves.
    pub fn layers_up_to(self) -> [f32; FOREST_LAYERS] {
        let mut sum = 0.0;
        self.layers.map(|area| {
            sum += area;
            let share = sum / self.area;
            if share.is_finite() { share.min(1.0) } else { 1.0 }
        })
    }

    /// Means over the area; black without leaves.
    pub fn trees(self) -> StandTrees {
        if self.area > 0.0 && self.area.is_finite() {
            StandTrees {
                reflectance: self.reflected / self.area,
                transmittance: self.transmitted / self.area,
                crown_width: self.crown_width / self.area,
                crown_length: self.crown_length / self.area,
                crown_fill: self.crown_fill / self.area,
            }
        } else {
            StandTrees::BLACK
        }
    }
}

/// What leaves and branches hide of the ground that the plant covers, 0..=1; that of
/// [`StandTrees::BLACK`] for a plant without a cross.
fn crown_fill(plant: &BakedPlant) -> f32 {
    let area = PI * plant.plant.covered_radius().powi(2);
    match plant.cross() {
        Some(cross) if area > 0.0 => (cross.area_from_above() / area).min(1.0),
        _ => StandTrees::BLACK.crown_fill,
    }
}
