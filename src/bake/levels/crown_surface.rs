//! The foliage as the implicit surface of its leaves [Luft 2006, 4.1; Luft 2007, 2.3], beside the plant's own wood: the shape that
//! watercolours paint, without the leaves.
//!
//! The surface is simplified to a share of the foliage's triangles, that of the finer tree of [Luft 2006, table 1] by default. It has the normals of
//! the density field, the ambient term of the leaves nearest to each vertex, and the mean colour of all leaves. Photographs light
//! it as [Luft 2007] lights realigned leaves; styles have their own light.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::BakedLevel;
use crate::bake::BakedPlant;
use crate::bake::lighting::implicit::foliage_normals::nearest_vertices;
use crate::bake::lighting::implicit::{AmbientField, FINE_SHARE, ImplicitSettings, bake_implicit, relative_radius};
use crate::bake::lighting::{BakedLighting, ExpressiveLighting};
use crate::bake::textures::PlantTextures;
use crate::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};

/// Settings of crown surfaces. Values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrownSurfaceSettings {
    /// Triangles as a fraction of the foliage's, 0..=1: [`FINE_SHARE`] is the finer tree of [Luft 2006, table 1], `COARSE_SHARE` the
    /// coarser one.
    pub share: f32,
    /// Radius of the leaves' density as a fraction of the plant's longest extent, 0..=1. Smaller: gaps between twigs stay open. The
    /// finer tree of [Luft 2006, table 1] has 0.05, the coarser one 0.075. Where leaves are sparse it is larger: half as much again as the mean
    /// distance between neighbours.
    pub radius: f32,
}

/// The least radius in mean distances between neighbouring leaves: with less, a surface is single leaves.
const LEAST_SPACINGS: f32 = 1.5;

impl Default for CrownSurfaceSettings {
    fn default() -> Self {
        Self { share: FINE_SHARE, radius: 0.05 }
    }
}

impl CrownSurfaceSettings {
    /// The settings with every value clamped to its range; a value that is not finite becomes the default.
    pub fn sanitized(self) -> Self {
        let (default, or) = (Self::default(), |value: f32, or: f32| if value.is_finite() { value } else { or });
        let (share, radius) = (or(self.share, default.share), or(self.radius, default.radius));
        Self { share: share.clamp(0.0, 1.0), radius: radius.clamp(0.0, 1.0) }
    }
}

/// The surface of a crown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CrownSurface {
    /// Closed, with unit normals that point outwards; empty for a plant without foliage or without a surface.
    pub mesh: PlantMesh,
    /// Ambient term of each vertex, 0..=1.
    pub ambient: Vec<f32>,
    /// Mean linear colour of the leaves.
    pub color: Vec3,
}

impl CrownSurface {
    /// Whether the mesh is valid and all values are in their ranges.
    pub fn is_whole(&self) -> bool {
        self.mesh.is_whole()
            && self.ambient.len() == self.mesh.positions.len()
            && self.ambient.iter().all(|ambient| (0.0..=1.0).contains(ambient))
            && self.color.is_finite()
    }

    /// A plant to be drawn as a full model: the wood of `baked`, and the surface. They also cast its shadow.
    pub fn baked(&self, baked: &BakedPlant) -> BakedPlant {
        let of = |index: usize| baked.textures.0.get(index).cloned().unwrap_or_default();
        let wood = baked.plant.parts.iter().enumerate().filter(|(_, part)| part.kind == PartKind::Wood);
        let (mut parts, mut normals, mut ambient, mut textures) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (index, part) in wood {
            let known = baked.lighting.ambient(index);
            let whole = known.len() == part.mesh.positions.len();
            ambient.push(if whole { known.to_vec() } else { vec![1.0; part.mesh.positions.len()] });
            normals.push(part.mesh.normals.clone());
            textures.push(of(index));
            parts.push(part.clone());
        }
        let material = PlantMaterial { name: "crown".to_owned(), base_color: self.color, ..PlantMaterial::default() };
        parts.push(PlantPart { kind: PartKind::Foliage, mesh: self.mesh.clone(), material });
        normals.push(self.mesh.normals.clone());
        ambient.push(self.ambient.clone());
        textures.push(Default::default());
        let meshes = parts.iter().map(|part: &PlantPart| part.mesh.clone()).collect();
        let ambient_field = AmbientField::Depth;
        let lighting = ExpressiveLighting { normals, ambient, no_surface: None, ambient_field, together: false };
        BakedPlant {
            plant: Arc::new(Plant { name: baked.plant.name.clone(), parts }),
            lighting: Arc::new(BakedLighting::Expressive(lighting)),
            levels: vec![BakedLevel::ShadowProxy(Arc::new(meshes))],
            textures: Arc::new(PlantTextures(textures)),
        }
    }
}

/// Makes the surface of `plant`. The result does not depend on the number of threads.
pub fn bake_crown_surface(plant: &Plant, settings: &CrownSurfaceSettings) -> CrownSurface {
    let CrownSurfaceSettings { share, radius } = settings.sanitized();
    let colors = plant.leaf_colors();
    let color = colors.reflected.clamp(Vec3::ZERO, Vec3::ONE);
    let radius = Some(relative_radius(plant, radius, LEAST_SPACINGS));
    let implicit = ImplicitSettings { surface_share: Some(share), radius, ..ImplicitSettings::default() };
    let baked = bake_implicit(plant, &implicit);
    let Some(surface) = baked.surface else { return CrownSurface { color, ..CrownSurface::default() } };
    let foliage = plant.parts.iter().zip(&baked.ambient).filter(|(part, _)| part.kind == PartKind::Foliage);
    let (points, terms): (Vec<Vec3>, Vec<f32>) = foliage
        .flat_map(|(part, ambient)| part.mesh.positions.iter().copied().zip(ambient.iter().copied()))
        .filter(|(position, _)| position.is_finite())
        .unzip();
    let ambient = nearest_vertices(&surface.positions, &points)
        .into_iter()
        .map(|leaf| leaf.and_then(|leaf| terms.get(leaf as usize)).map_or(1.0, |term| term.clamp(0.0, 1.0)))
        .collect();
    let uvs = vec![Vec2::splat(0.5); surface.positions.len()];
    let mesh = PlantMesh { positions: surface.positions, normals: surface.normals, uvs, triangles: surface.triangles };
    CrownSurface { mesh, ambient, color }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::lighting::implicit::COARSE_SHARE;
    use crate::bake::{BakeSettings, bake_plant};
    use crate::plant::grow::{GrowParameters, grow};

    #[test]
    fn a_crown_becomes_a_closed_surface_with_the_published_share_of_triangles() -> Result<(), Box<dyn std::error::Error>>
    {
        for parameters in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
            let plant = grow(&parameters, 1, 12_000)?;
            let leaves = plant.triangle_count(PartKind::Foliage) as f32;
            // [Luft 2006, table 1].
            for (share, within) in [(COARSE_SHARE, 0.003), (FINE_SHARE, 0.005)] {
                let surface =
                    bake_crown_surface(&plant, &CrownSurfaceSettings { share, ..CrownSurfaceSettings::default() });
                assert!(surface.is_whole() && surface.mesh.is_closed());
                let reached = surface.mesh.triangles.len() as f32 / leaves;
                assert!((reached - share).abs() <= within, "{}: {reached} of {share}", plant.name);
                assert!(surface.mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3));
            }
        }
        Ok(())
    }

    #[test]
    fn it_is_drawn_with_the_wood_of_its_plant() -> Result<(), Box<dyn std::error::Error>> {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 6000)?);
        let (baked, _) = bake_plant(plant.clone(), &BakeSettings::default(), None);
        let surface = bake_crown_surface(&plant, &CrownSurfaceSettings::default());
        let drawn = surface.baked(&baked);
        assert!(drawn.lighting.fits(&drawn.plant) && drawn.lighting.is_realigned());
        assert_eq!(drawn.textures.0.len(), drawn.plant.parts.len());
        assert_eq!(drawn.plant.triangle_count(PartKind::Wood), plant.triangle_count(PartKind::Wood));
        assert_eq!(drawn.plant.triangle_count(PartKind::Foliage), surface.mesh.triangles.len());
        Ok(())
    }

    #[test]
    fn what_has_no_surface_has_none() {
        let nothing =
            bake_crown_surface(&Plant::default(), &CrownSurfaceSettings { share: f32::NAN, radius: f32::NAN });
        assert_eq!(nothing, CrownSurface::default());
        assert!(nothing.is_whole());
    }
}
