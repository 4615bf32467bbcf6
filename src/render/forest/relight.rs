//! Another light for plants that are drawn already: what a bake gives anew is written over what the device holds, vertices
//! and pictures of crosses apart, and only those of the plants that changed. Meshes, textures, outlines, the stand and so
//! the shadow maps stay.
//!
//! Cost: 20 bytes a vertex written and their normals packed, and 1 MB a plant where its crosses changed (256 texels);
//! where lighting pictures come or go, 1 MB for each plant that has them.

use std::sync::Arc;

use bevy::render::{
    render_resource::PipelineCache,
    renderer::{RenderDevice, RenderQueue},
};

use super::{
    crosses::{CrossLight, upload_cross_light},
    layouts::ForestLayouts,
    parts::{PartLight, vertices},
    resources::GpuForest,
    transfer::{TransferLight, scattered_tint},
    uniforms::{PLANES, part_uniform, variants},
};
use crate::{
    bake::{BakedPlant, levels::cross::Cross},
    render::gpu,
};

/// Whether the plants are the same but for their light, so that [`relight`] leads from one to the other.
pub fn differ_in_light(old: &[BakedPlant], new: &[BakedPlant]) -> bool {
    let same = |(old, new): (&BakedPlant, &BakedPlant)| {
        Arc::ptr_eq(&old.plant, &new.plant)
            && Arc::ptr_eq(&old.shadow_proxy, &new.shadow_proxy)
            && (Arc::ptr_eq(&old.cross, &new.cross) || same_outline(&old.cross, &new.cross))
    };
    old.len() == new.len() && old.iter().zip(new).all(same)
}

/// Whether crosses have the same planes, colours and outlines. A bake under another light gives equal ones in other memory.
fn same_outline(old: &Cross, new: &Cross) -> bool {
    let sizes = |cross: &Cross| -> Vec<(u32, u32, usize)> {
        let chains = cross.textures.properties.iter();
        chains.map(|chain| (chain.width, chain.height, chain.levels.len())).collect()
    };
    old.planes == new.planes && sizes(old) == sizes(new) && old.textures.color == new.textures.color
}

/// Writes the light of `plants` over that of `known`, of which they [differ in light](differ_in_light) alone.
pub fn relight(
    known: &mut GpuForest,
    plants: &Arc<Vec<BakedPlant>>,
    layouts: &ForestLayouts,
    transfer: &mut TransferLight,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) {
    for (index, (old, new)) in known.plants.iter().zip(plants.iter()).enumerate() {
        if !Arc::ptr_eq(&old.lighting, &new.lighting) {
            let tint = scattered_tint(&new.plant.leaf_colors());
            for (number, (gpu_part, part)) in known.parts[index].iter_mut().zip(&new.plant.parts).enumerate() {
                let vertices = vertices(&part.mesh, &new.lighting, number);
                let uniform = part_uniform(&part.material, &new.lighting);
                queue.write_buffer(&gpu_part.model.vertices, 0, bytemuck::cast_slice(&vertices));
                queue.write_buffer(&gpu_part.uniform, 0, bytemuck::bytes_of(&uniform));
                let traced = new.lighting.transfer(number);
                let sun = known.forest.suns.get(index).copied().unwrap_or_default();
                gpu_part.light = PartLight::new(traced.map(|(settings, _)| settings), sun);
                gpu_part.transfer = traced.map(|part| transfer.bind_group(part, tint, sun, layouts, device, pipelines));
            }
        }
        if !Arc::ptr_eq(&old.cross, &new.cross) {
            for (plane, chain) in new.cross.textures.properties.iter().enumerate() {
                gpu::write_layer(queue, &known.cross_properties, (index * PLANES + plane) as u32, chain);
            }
        }
    }
    let has_lighting_pictures = |plant: &BakedPlant| !plant.cross.textures.light.is_empty();
    let mut crosses = known.plants.iter().zip(plants.iter()).filter(|(old, new)| !Arc::ptr_eq(&old.cross, &new.cross));
    if crosses.clone().any(|(old, new)| has_lighting_pictures(old) || has_lighting_pictures(new)) {
        // Plants that come and go among them move the layers of the others.
        known.cross_light = CrossLight::of(plants);
        known.cross_pictures = upload_cross_light(plants, layouts, device, queue, pipelines);
    }
    if crosses.next().is_some() {
        let variants = variants(plants, &known.sizes);
        queue.write_buffer(&known.variants, 0, bytemuck::cast_slice(&variants));
    }
    known.plants = plants.clone();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bake::{
            BakeSettings, bake_plant,
            lighting::{LightingSettings, implicit::ImplicitSettings},
        },
        plant::grow::{GrowParameters, grow},
    };

    #[test]
    fn a_bake_under_another_light_differs_in_light_alone() -> Result<(), Box<dyn std::error::Error>> {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000)?);
        let baked = |lighting| bake_plant(plant.clone(), &BakeSettings { lighting, ..BakeSettings::default() }, None).0;
        let local = [baked(LightingSettings::Local)];
        let fresh = [baked(LightingSettings::Expressive(ImplicitSettings::default()))];
        assert!(local[0].cross != fresh[0].cross && same_outline(&local[0].cross, &fresh[0].cross));
        let (lighting, cross) = (fresh[0].lighting.clone(), fresh[0].cross.clone());
        let lit = [BakedPlant { lighting, cross, ..local[0].clone() }];
        assert!(differ_in_light(&local, &lit));
        assert!(!differ_in_light(&local, &[&lit[..], &lit[..]].concat()));
        // Another proxy casts another shadow, other colours have another outline.
        assert!(!differ_in_light(&local, &fresh));
        let mut cross = (*lit[0].cross).clone();
        cross.textures.color[0].levels[0][3] ^= 0x80;
        let [lit] = lit;
        assert!(!differ_in_light(&local, &[BakedPlant { cross: Arc::new(cross), ..lit }]));
        Ok(())
    }
}
