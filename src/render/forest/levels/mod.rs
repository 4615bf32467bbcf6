//! The built-in representations, one file each.

mod cloud;
mod cross;
mod model;
mod reduced;

use std::{
    collections::BTreeSet,
    sync::{Arc, Mutex, PoisonError},
};

use bevy::log::error;

use super::representation::LevelRenderer;
use crate::{bake::BakedPlant, render::shaders::CanopyShaders};

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

/// The most plants that a message names.
const MOST_NAMES: usize = 5;

/// What the user is told where `renderer` draws some of `plants` not at all, because no bake of theirs has its level.
fn not_baked(plants: &[BakedPlant], renderer: &dyn LevelRenderer) -> Option<String> {
    let representation = renderer.representation();
    let without = plants.iter().filter(|plant| plant.level(representation).is_none());
    let names: Vec<String> = without.map(|plant| format!("`{}`", plant.plant.name)).collect();
    let others = match names.len().saturating_sub(MOST_NAMES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let (label, constant) = (renderer.label(), representation.name().to_uppercase());
    (!names.is_empty()).then(|| {
        format!(
            "{}{others} not drawn as {label}, because none were baked: list `Representation::{constant}` in \
             `BakeSettings::representations`",
            names[..names.len().min(MOST_NAMES)].join(", ")
        )
    })
}

/// Tells the user of [`not_baked`], of the same plants once.
fn tell_not_baked(plants: &[BakedPlant], renderer: &dyn LevelRenderer) {
    static TOLD: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if let Some(message) = not_baked(plants, renderer)
        && TOLD.lock().unwrap_or_else(PoisonError::into_inner).insert(message.clone())
    {
        error!("{message}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bake::{
            BakeSettings, BakedLevel, bake_plant,
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
        cross.textures.color[0].levels[0][3] ^= 0x80;
        assert!(!same_shape(&local, &lit.clone().with_level(BakedLevel::Cross(Arc::new(cross)))));
        // Nor have a plant with a level and one without.
        assert!(!same_shape(&local, &BakedPlant { levels: Vec::new(), ..local.clone() }));
        Ok(())
    }

    #[test]
    fn a_level_without_a_bake_is_told_with_the_plants_and_the_remedy() {
        let [_, thinned, ..] = built_in(&CanopyShaders::default());
        let plant = |name: String| BakedPlant {
            plant: Arc::new(crate::plant::Plant { name, parts: Vec::new() }),
            lighting: Arc::new(crate::bake::lighting::BakedLighting::Local),
            levels: Vec::new(),
            textures: Arc::default(),
        };
        let baked = plant("pine".into()).with_level(BakedLevel::Thinned(Arc::default()));
        assert_eq!(not_baked(std::slice::from_ref(&baked), &*thinned), None);
        let told = not_baked(&[baked.clone(), plant("oak".into())], &*thinned).unwrap_or_default();
        let remedy = "list `Representation::THINNED` in `BakeSettings::representations`";
        assert_eq!(told, format!("`oak` not drawn as simplified models, because none were baked: {remedy}"));
        let many: Vec<BakedPlant> = (0..7).map(|index| plant(format!("oak {index}"))).collect();
        let told = not_baked(&many, &*thinned).unwrap_or_default();
        assert!(told.contains("`oak 4` and 2 more not drawn") && !told.contains("oak 5"), "{told}");
    }
}
