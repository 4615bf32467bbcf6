//! Meshes with fewer triangles that are lit by the bake of the plant that they stand for.
//!
//! A vertex of such a mesh names a vertex of the plant, whose normal, ambient occlusion and radiance transfer it takes.
//! So a reduced plant is drawn by the renderer of full models, and needs no light of its own.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::bake::lighting::BakedLighting;
use crate::bake::{BakedLevel, BakedPlant};
use crate::plant::{Plant, PlantMesh, PlantPart};

/// One part of a plant with fewer triangles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReducedPart {
    /// The triangles; may be none.
    pub mesh: PlantMesh,
    /// For each vertex the vertex of the plant's part whose light it takes.
    pub sources: Vec<u32>,
}

/// The parts of a plant with fewer triangles, in the plant's order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReducedPlant {
    /// One for each part.
    pub parts: Vec<ReducedPart>,
}

impl ReducedPlant {
    /// Whether the meshes are valid, and their sources are vertices of `plant`.
    pub fn fits(&self, plant: &Plant) -> bool {
        let fits = |(reduced, part): (&ReducedPart, &PlantPart)| {
            let vertices = part.mesh.positions.len();
            reduced.mesh.is_whole()
                && reduced.sources.len() == reduced.mesh.positions.len()
                && reduced.sources.iter().all(|&source| (source as usize) < vertices)
        };
        self.parts.len() == plant.parts.len() && self.parts.iter().zip(&plant.parts).all(fits)
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|part| part.mesh.triangles.len()).sum()
    }

    /// The meshes with the materials of `plant`.
    pub fn plant(&self, plant: &Plant) -> Plant {
        let part = |(part, reduced): (&PlantPart, &ReducedPart)| PlantPart {
            kind: part.kind,
            mesh: reduced.mesh.clone(),
            material: part.material.clone(),
        };
        Plant { name: plant.name.clone(), parts: plant.parts.iter().zip(&self.parts).map(part).collect() }
    }

    /// A plant to be drawn as a full model: the meshes with the light and the textures of `baked`. They also cast its
    /// shadow.
    pub fn baked(&self, baked: &BakedPlant) -> BakedPlant {
        let sources: Vec<&[u32]> = self.parts.iter().map(|part| part.sources.as_slice()).collect();
        let meshes = self.parts.iter().map(|part| part.mesh.clone()).collect();
        BakedPlant {
            plant: Arc::new(self.plant(&baked.plant)),
            lighting: Arc::new(gathered(&baked.lighting, &sources)),
            levels: vec![BakedLevel::ShadowProxy(Arc::new(meshes))],
            textures: baked.textures.clone(),
        }
    }
}

/// The light of a plant whose vertices take that of the `sources`, part by part.
fn gathered(lighting: &BakedLighting, sources: &[&[u32]]) -> BakedLighting {
    let mut lighting = lighting.clone();
    match &mut lighting {
        BakedLighting::Local => {}
        BakedLighting::Expressive(light) => {
            for (normals, sources) in light.normals.iter_mut().zip(sources) {
                *normals = gather(normals, sources, 1);
            }
            for (ambient, sources) in light.ambient.iter_mut().zip(sources) {
                *ambient = gather(ambient, sources, 1);
            }
        }
        BakedLighting::Transfer(light) => {
            for (ambient, sources) in light.ambient.iter_mut().zip(sources) {
                *ambient = gather(ambient, sources, 1);
            }
            for (part, sources) in light.packed.parts.iter_mut().zip(sources) {
                let vertices = part.bytes.len().checked_div(part.vertex_bytes).unwrap_or(0);
                let stride = part.indirect_sun.len().checked_div(vertices).unwrap_or(0);
                part.bytes = gather(&part.bytes, sources, part.vertex_bytes);
                part.indirect_sun = gather(&part.indirect_sun, sources, stride);
            }
        }
    }
    lighting
}

/// The values of `sources`, `stride` of each; none where `values` is empty, the default where one is missing.
fn gather<T: Copy + Default>(values: &[T], sources: &[u32], stride: usize) -> Vec<T> {
    if values.is_empty() {
        return Vec::new();
    }
    let of = |&source: &u32| {
        let first = source as usize * stride;
        (first..first + stride).map(|at| values.get(at).copied().unwrap_or_default())
    };
    sources.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::lighting::{LightingSettings, transfer::TransferSettings};
    use crate::bake::{BakeSettings, bake_plant};
    use crate::plant::grow::{GrowParameters, grow};

    #[test]
    fn a_vertex_takes_the_light_of_its_source() -> Result<(), Box<dyn std::error::Error>> {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000)?);
        let transfer = TransferSettings { rays: 64, ..TransferSettings::default() };
        for lighting in [LightingSettings::Local, LightingSettings::Transfer(transfer)] {
            let settings = BakeSettings { lighting, ..BakeSettings::default() };
            let (baked, _) = bake_plant(plant.clone(), &settings, None);
            // Every vertex in reverse order.
            let part = |part: &PlantPart| {
                let count = part.mesh.positions.len() as u32;
                let mesh = PlantMesh {
                    positions: part.mesh.positions.iter().rev().copied().collect(),
                    normals: part.mesh.normals.iter().rev().copied().collect(),
                    uvs: part.mesh.uvs.iter().rev().copied().collect(),
                    triangles: part.mesh.triangles.iter().map(|t| t.map(|corner| count - 1 - corner)).collect(),
                };
                ReducedPart { mesh, sources: (0..count).rev().collect() }
            };
            let reversed = ReducedPlant { parts: plant.parts.iter().map(part).collect() };
            assert!(reversed.fits(&plant));
            let drawn = reversed.baked(&baked);
            assert!(drawn.lighting.fits(&drawn.plant));
            for (index, part) in plant.parts.iter().enumerate() {
                let last = part.mesh.positions.len() - 1;
                assert_eq!(drawn.lighting.ambient(index).first(), baked.lighting.ambient(index).get(last));
                let first = |plant: &BakedPlant, vertex: usize| {
                    let (_, part) = plant.lighting.transfer(index)?;
                    Some(part.bytes[vertex * part.vertex_bytes..][..part.vertex_bytes].to_vec())
                };
                assert_eq!(first(&drawn, 0), first(&baked, last));
            }
            let mut broken = reversed;
            broken.parts[0].sources[0] = u32::MAX;
            assert!(!broken.fits(&plant));
            // Nothing is read out of range.
            let _ = broken.baked(&baked);
        }
        Ok(())
    }
}
