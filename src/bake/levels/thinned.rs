//! Simplified model: fewer and larger leaves, and wood of few sides [Cook, Halstead, Planck & Ryu 2007, "Stochastic
//! Simplification of Aggregate Detail"].
//!
//! Leaves vanish in a fixed order, the one of [shadow proxies](super::shadow_proxy): every beginning of it is spread
//! evenly over the crown, so a smaller model's leaves are a subset of a larger one's. Those that remain are enlarged
//! until the model covers as much as the plant, in the mean over five directions. Branches become cylinders
//! (`tubes.rs`), and the thinnest vanish. What remains keeps the light of the plant, vertex by vertex.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::reduced::{ReducedPart, ReducedPlant};
use super::shadow_proxy::{area_keeping_scale, calibrate, evenly_chosen, extract};
use super::tubes::{self, TubeSettings};
use crate::plant::geometry::{self, Element};
use crate::plant::{PartKind, Plant, PlantPart};

/// Settings of simplified models. Values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThinnedSettings {
    /// Triangles as a fraction of the plant's, 0..=1; a part keeps at least a leaf or a branch.
    pub share: f32,
    /// Sides of the trunk, 3..=32. Thinner branches have fewer.
    pub sides: u32,
}

impl Default for ThinnedSettings {
    fn default() -> Self {
        Self { share: 0.15, sides: 8 }
    }
}

impl ThinnedSettings {
    /// The settings with every value clamped to its range; a value that is not finite becomes the default.
    pub fn sanitized(self) -> Self {
        let share = if self.share.is_finite() { self.share } else { Self::default().share };
        Self { share: share.clamp(0.0, 1.0), sides: self.sides.clamp(3, 32) }
    }
}

/// Makes the simplified model of `plant`. The result does not depend on the number of threads.
pub fn bake_thinned(plant: &Plant, settings: &ThinnedSettings) -> ReducedPlant {
    let settings = settings.sanitized();
    let bounds = plant.bounds();
    let (origin, extent) = bounds.map_or((Vec3::ZERO, 1.0), |bounds| (bounds.min, bounds.size().max_element()));
    let tubes = TubeSettings { sides: settings.sides as usize, tolerance: 0.25 };
    let target = |part: &PlantPart| (f64::from(settings.share) * part.mesh.triangles.len() as f64) as usize;
    // Wood as it is drawn, foliage as the leaves that are kept.
    let parts: Vec<Kept> = plant
        .parts
        .par_iter()
        .map(|part| match part.kind {
            PartKind::Wood => {
                let branches = tubes::branches(&part.mesh);
                Kept::Wood(tubes::reduce(&part.mesh, &branches, &tubes, target(part)).0)
            }
            PartKind::Foliage => {
                let elements = geometry::elements(&part.mesh);
                let kept = evenly_chosen(&elements, origin, extent, target(part));
                Kept::Foliage { elements, kept }
            }
        })
        .collect();
    let build = |correction: f32| {
        let part = |(part, kept): (&PlantPart, &Kept)| match kept {
            Kept::Wood(reduced) => reduced.clone(),
            Kept::Foliage { elements, kept } => {
                let scale = correction * area_keeping_scale(elements, kept);
                let (mesh, sources) = extract(&part.mesh, elements, kept, scale);
                ReducedPart { mesh, sources }
            }
        };
        let reduced = ReducedPlant { parts: plant.parts.iter().zip(&parts).map(part).collect() };
        let drawn = reduced.plant(plant);
        (reduced, drawn)
    };
    if plant.triangle_count(PartKind::Foliage) == 0 {
        return build(1.0).0;
    }
    calibrate(plant, build, |(_, drawn)| drawn).0
}

enum Kept {
    Wood(ReducedPart),
    Foliage { elements: Vec<Element>, kept: Vec<u32> },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::levels::rasterize::{View, projected_area};
    use crate::plant::grow::{GrowParameters, grow};

    #[test]
    fn a_thinned_tree_has_fewer_triangles_and_covers_as_much() -> Result<(), Box<dyn std::error::Error>> {
        let plant = grow(&GrowParameters::broadleaf(), 1, 6000)?;
        let bounds = plant.bounds().ok_or("no bounds")?;
        let triangles = plant.parts.iter().map(|part| part.mesh.triangles.len()).sum::<usize>();
        let thinned = |share| bake_thinned(&plant, &ThinnedSettings { share, ..ThinnedSettings::default() });
        for share in [0.4, 0.1] {
            let reduced = thinned(share);
            assert!(reduced.fits(&plant));
            let count = reduced.triangles() as f32 / triangles as f32;
            assert!((0.7 * share..1.1 * share).contains(&count), "{count} for {share}");
            let view = View::framing(bounds, Vec3::new(0.6, 0.2, 0.77).normalize());
            let wide = View { right: 1.3 * view.right, up: 1.3 * view.up, ..view };
            let ratio = projected_area(&reduced.plant(&plant), &wide, 300) / projected_area(&plant, &wide, 300);
            assert!((ratio - 1.0).abs() < 0.08, "{ratio} for {share}");
        }
        // A smaller model's leaves are among a larger one's.
        let foliage = plant.parts.iter().position(|part| part.kind == PartKind::Foliage).ok_or("no foliage")?;
        let (few, many) = (thinned(0.1), thinned(0.4));
        let known: std::collections::BTreeSet<u32> = many.parts[foliage].sources.iter().copied().collect();
        assert!(few.parts[foliage].sources.iter().all(|source| known.contains(source)));
        Ok(())
    }

    #[test]
    fn nothing_stays_nothing() {
        let empty = bake_thinned(&Plant::default(), &ThinnedSettings { share: f32::NAN, sides: 0 });
        assert_eq!(empty, ReducedPlant::default());
    }
}
