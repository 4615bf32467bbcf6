//! The built-in representations, one file each.

mod cloud;
mod cross;
mod model;
mod not_baked;
mod reduced;

use std::sync::Arc;

use super::representation::LevelRenderer;
use crate::render::shaders::CanopyShaders;

/// All built-in representations.
pub fn built_in(shaders: &CanopyShaders) -> [Arc<dyn LevelRenderer>; 5] {
    [
        Arc::new(model::ModelRenderer::new(shaders)),
        Arc::new(reduced::ReducedRenderer::thinned(shaders)),
        Arc::new(reduced::ReducedRenderer::crown_surface(shaders)),
        Arc::new(cloud::CloudRenderer::new(shaders)),
        Arc::new(cross::CrossRenderer::new(shaders)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bake::{
            BakeSettings, BakedLevel, BakedPlant, bake_plant,
            lighting::{LightingSettings, implicit::ImplicitSettings},
        },
        plant::grow::{GrowParameters, grow},
    };

    #[test]
    fn a_bake_under_another_light_has_the_same_shape_and_another_proxy_or_outline_has_not()
    -> Result<(), Box<dyn std::error::Error>> {
        let same_shape = |old: &BakedPlant, new: &BakedPlant| {
            built_in(&CanopyShaders::default()).iter().all(|renderer| renderer.same_shape(old, new))
        };
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000)?);
        let baked = |lighting| bake_plant(plant.clone(), &BakeSettings { lighting, ..BakeSettings::default() }, None).0;
        let local = baked(LightingSettings::Local);
        let fresh = baked(LightingSettings::Expressive(ImplicitSettings::default()));
        let fresh_cross = fresh.cross().ok_or("no cross")?;
        let lit = BakedPlant { lighting: fresh.lighting.clone(), ..local.clone() };
        let lit = lit.with_level(BakedLevel::Cross(fresh_cross.clone()));
        assert!(local.cross() != lit.cross() && same_shape(&local, &lit));
        // A fresh proxy casts another shadow, other colours have another outline.
        assert!(!same_shape(&local, &fresh));
        let mut cross = (**fresh_cross).clone();
        cross.textures.color[0].texels.levels[0][3] ^= 0x80;
        assert!(!same_shape(&local, &lit.clone().with_level(BakedLevel::Cross(Arc::new(cross)))));
        // Nor have a plant with a level and one without.
        assert!(!same_shape(&local, &BakedPlant { levels: Vec::new(), ..local.clone() }));
        Ok(())
    }

    #[test]
    fn a_level_without_a_bake_is_told_with_the_plants_and_the_remedy() {
        let thinned = reduced::ReducedRenderer::thinned(&CanopyShaders::default());
        let plant = |name: String| BakedPlant {
            plant: Arc::new(crate::plant::Plant { name, parts: Vec::new() }),
            lighting: Arc::new(crate::bake::lighting::BakedLighting::Local),
            levels: Vec::new(),
            textures: Arc::default(),
        };
        let baked = plant("pine".into()).with_level(BakedLevel::Thinned(Arc::default()));
        assert_eq!(not_baked::not_baked(std::slice::from_ref(&baked), &thinned), None);
        let told = not_baked::not_baked(&[baked.clone(), plant("oak".into())], &thinned).unwrap_or_default();
        let remedy = "list `Representation::THINNED` in `BakeSettings::representations`";
        assert_eq!(told, format!("`oak` not drawn as simplified models, because none were baked: {remedy}"));
        let many: Vec<BakedPlant> = (0..7).map(|index| plant(format!("oak {index}"))).collect();
        let told = not_baked::not_baked(&many, &thinned).unwrap_or_default();
        assert!(told.contains("`oak 4` and 2 more not drawn") && !told.contains("oak 5"), "{told}");
    }
}
