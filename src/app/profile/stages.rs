//! Built scenes, shared by settings that differ only in how they are drawn.

use std::sync::Arc;

use crate::{
    app::{AppError, interrupt},
    assets::{Stage, StageError},
    lod::Representation,
    progress::Progress,
    render::components::CanopyStyle,
    scene::{Quality, QualityLevel, Scene},
    style::Style,
};

/// The scenes that were built.
pub struct Stages {
    /// Names of the representations that any of the settings draws.
    representations: Vec<&'static str>,
    /// The most trees that the device holds.
    most_trees: Option<usize>,
    built: Vec<(Scene, Arc<Stage>)>,
}

impl Stages {
    /// For these scenes.
    pub fn new<'a>(scenes: impl Iterator<Item = &'a Scene>, most_trees: Option<usize>) -> Self {
        let mut representations: Vec<&'static str> = Vec::new();
        for scene in scenes {
            for drawn in scene.quality.lod_levels().representations() {
                if !representations.contains(&drawn.name()) {
                    representations.push(drawn.name());
                }
            }
        }
        Self { representations, most_trees, built: Vec::new() }
    }

    /// `scene` with what has no effect on a build as it is by default, and all levels of detail that any of the settings
    /// draws.
    fn built_as(&self, scene: &Scene) -> Scene {
        let known =
            |name: &&&'static str| **name != Representation::MODEL.name() && **name != Representation::CROSS.name();
        // Full models and crosses are always baked.
        let further: Vec<&&'static str> = self.representations.iter().filter(known).collect();
        let level = |(index, name): (usize, &&&'static str)| QualityLevel {
            draw: (**name).to_owned(),
            until: 2.0 * index as f64,
            fade: 1.0,
        };
        let default = Quality::default();
        let quality = Quality {
            levels: further.iter().enumerate().map(level).collect(),
            cross_resolution: scene.quality.cross_resolution,
            cross_planes: scene.quality.cross_planes,
            view_distance: scene.quality.view_distance,
            ..default
        };
        Scene { quality, style: Style::Photograph, ..scene.clone() }
    }

    /// The stage of `scene`. It shares terrain, trees and plants with those that were built before where it can.
    ///
    /// # Errors
    /// [`AppError::Stage`], [`AppError::Interrupted`].
    pub fn stage(&mut self, scene: &Scene, progress: &mut dyn Progress) -> Result<Stage, AppError> {
        let wanted = self.built_as(scene);
        let known = self.built.iter().find(|(known, _)| *known == wanted).map(|(_, stage)| stage.clone());
        let stage = match known {
            Some(stage) => stage,
            None => {
                let stage = Stage::build_within(&wanted, self.most_trees, progress).map_err(interrupt::building)?;
                let stage = Arc::new(stage);
                self.built.push((wanted, stage.clone()));
                stage
            }
        };
        Ok(Stage {
            terrain: stage.terrain.clone(),
            drape: stage.drape.clone(),
            stand: stage.stand.clone(),
            plants: stage.plants.clone(),
            variants: stage.variants.clone(),
            suns: stage.suns.clone(),
            cover: stage.cover.clone(),
            surroundings: stage.surroundings,
            observer: stage.observer,
            scene: scene.clone(),
            surveys: stage.surveys.clone(),
            style: CanopyStyle::new(scene.style.clone()).map_err(StageError::from)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::levels::texture::Compression;

    #[test]
    fn settings_that_are_only_drawn_share_a_build_and_others_do_not() {
        let scene = Scene::default();
        let with = |change: fn(&mut Scene)| {
            let mut changed = scene.clone();
            change(&mut changed);
            changed
        };
        let cloud = with(|scene| {
            scene.quality.levels = vec![QualityLevel { draw: "cloud".to_owned(), until: 0.0, fade: 1.0 }];
        });
        let stages = Stages::new([&scene, &cloud].into_iter(), None);
        let built = stages.built_as(&scene);
        assert!(built.validate().is_ok() && built.quality.levels.len() == 1);
        let drawn: [fn(&mut Scene); 5] = [
            |scene| scene.quality.near_distance = 5.0,
            |scene| scene.quality.shadow_map_size = 256,
            |scene| scene.quality.msaa = 1,
            |scene| scene.quality.texture_compression = Compression::Never,
            |scene| scene.quality.terrain_error = 4.0,
        ];
        assert!(drawn.into_iter().all(|change| stages.built_as(&with(change)) == built));
        let baked: [fn(&mut Scene); 4] = [
            |scene| scene.quality.cross_planes = 2,
            |scene| scene.quality.cross_resolution = 64,
            |scene| scene.quality.view_distance = 500.0,
            |scene| scene.seed = 2,
        ];
        assert!(baked.into_iter().all(|change| stages.built_as(&with(change)) != built));
    }
}
