//! Optical properties of a forest's leaves, averaged over their areas.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{bake::BakedPlant, light::StandTrees, scatter::PackedStand};

/// Sums over leaves, weighted by area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leaves {
    area: f32,
    reflected: Vec3,
    transmitted: Vec3,
    crown_width: f32,
    crown_length: f32,
    crown_fill: f32,
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
        let of_plant = |(plant, scaled): (&BakedPlant, f32)| {
            let colors = plant.plant.leaf_colors();
            let area = colors.area * scaled;
            Self {
                area,
                reflected: colors.reflected * area,
                transmitted: colors.transmitted * area,
                crown_width: plant.plant.crown_width() * area,
                crown_length: plant.plant.crown_length() * area,
                crown_fill: crown_fill(plant) * area,
            }
        };
        plants.iter().zip(areas).map(of_plant).fold(Self::default(), Self::add)
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
        }
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
