//! The lighting of a species' leaves during the flight: that of the scene and the user's changes, baked in the
//! background. None of it goes into the cache of bakes.

use std::{
    collections::HashMap,
    ops::{DerefMut, Range},
    sync::Arc,
    time::Instant,
};

use bevy::reflect::{PartialReflect, TypeRegistry};

use super::{
    fields::Edited,
    rebake::{self, Baked, Content, Rebake, Step},
};
use crate::{
    assets::{Stage, background::Background, plants},
    bake::{
        BakedLevel, BakedPlant,
        lighting::{LightingSettings, SunLight, implicit::ImplicitParameters},
    },
    render::components::Forest,
    scene::{Lighting, Transfer},
};

/// Fields that have no effect on what is drawn, or none on a single plant.
const HIDDEN: [&str; 3] = ["surface", "surface_share", "together"];

/// A species and the results of its bakes.
pub struct SpeciesLight {
    /// Its name.
    pub name: String,
    /// Indices of its variants.
    variants: Range<usize>,
    /// The lighting of the scene, and its bakes.
    scene: Lighting,
    own: Vec<BakedPlant>,
    lighting: Lighting,
    left: HashMap<(String, String), Box<dyn PartialReflect>>,
    rebake: Rebake,
    /// Parameters of the last bake of its first individual.
    values: Option<ImplicitParameters>,
    values_work: Option<Background<ImplicitParameters>>,
    /// Per individual: why it uses its leaves' own normals, if it does.
    no_surface: Vec<Option<String>>,
    /// Seconds from the change to the upload of each step of all individuals.
    times: [Option<f64>; 3],
    failure: Option<String>,
    /// Whether the scene's own bakes are to be shown again.
    restores: bool,
}

impl SpeciesLight {
    /// The species of `stage`. The lighting of plants that are lit together with their neighbours cannot be baked per
    /// plant, so these are left out.
    pub fn of_stage(stage: &Stage) -> Vec<Self> {
        let alone = stage.scene.species.iter().zip(&stage.variants).filter(|(species, _)| !species.is_lit_together());
        let light = alone.map(|(species, variants)| {
            let variants = usize::from(variants.start)..usize::from(variants.end);
            let own = stage.plants.get(variants.clone()).unwrap_or_default().to_vec();
            let uprights = own.iter().find_map(BakedPlant::cross).map_or(1, |cross| cross.uprights().len() as u32);
            let cross = plants::bake_settings(&stage.scene.quality, LightingSettings::Local, uprights).cross;
            let scene = species.lighting.clone().unwrap_or(Lighting::Transfer(Transfer::default()));
            Self {
                name: species.name.clone(),
                variants,
                lighting: scene.clone(),
                scene,
                left: HashMap::new(),
                rebake: Rebake::new(own.iter().map(|plant| plant.plant.clone()).collect(), cross),
                values: None,
                values_work: None,
                no_surface: own.iter().map(|plant| plant.lighting.warning()).collect(),
                times: [None; 3],
                failure: None,
                restores: false,
                own,
            }
        });
        light.collect()
    }

    /// What can be edited of its lighting. Call [`apply`](Self::apply) after a change.
    pub fn edited<'a>(&'a mut self, registry: &'a TypeRegistry) -> Edited<'a> {
        Edited {
            name: "lighting",
            value: &mut self.lighting,
            initial: &self.scene,
            automatic: Some(self.values.as_ref().map(|values| values.as_partial_reflect())),
            hidden: &HIDDEN,
            left: &mut self.left,
            registry,
        }
    }

    /// Bakes the current lighting, or shows the scene's own again.
    pub fn apply(&mut self, now: Instant) {
        (self.times, self.failure) = ([None; 3], None);
        if self.lighting == self.scene {
            self.rebake.cancel();
            self.restores = true;
            self.values = None;
            self.no_surface = self.own.iter().map(|plant| plant.lighting.warning()).collect();
            self.request_values();
        } else {
            self.rebake.request(self.lighting.settings(), now);
        }
    }

    /// Requests the automatic values, if they are not known yet. A running bake will return them.
    pub fn request_values(&mut self) {
        if self.values.is_none() && self.values_work.is_none() && self.rebake.progress().is_none() {
            let plant = self.own.first().map(|plant| plant.plant.clone());
            self.values_work = plant.and_then(|plant| rebake::automatic_values(plant, &self.lighting.settings()));
        }
    }

    /// Shows in `forest` what was baked or restored since the last call. An unchanged forest is not touched.
    pub fn update(&mut self, forest: &mut impl DerefMut<Target = Forest>, now: Instant) {
        if let Some(result) = self.values_work.as_ref().and_then(Background::finished) {
            self.values_work = None;
            self.values = self.values.or(result.ok());
        }
        if std::mem::take(&mut self.restores) {
            show(forest, &self.variants, self.scene.sun(), |plants| plants.clone_from_slice(&self.own));
        }
        match self.rebake.poll(now) {
            Ok(Some(baked)) => self.take(baked, forest),
            Ok(None) => {}
            Err(error) => self.failure = Some(error.to_string()),
        }
    }

    fn take(&mut self, baked: Baked, forest: &mut Forest) {
        let Baked { step, plant: index, requested, content } = baked;
        if let Content::Light(lighting, values) = &content {
            self.values = if index == 0 { *values } else { self.values };
            if let Some(slot) = self.no_surface.get_mut(index) {
                *slot = lighting.warning();
            }
        }
        show(forest, &self.variants, self.lighting.sun(), |plants| match (plants.get_mut(index), content) {
            (Some(plant), Content::Light(lighting, _)) => plant.lighting = lighting,
            (Some(plant), Content::Cross(cross)) => plant.set_level(BakedLevel::Cross(cross)),
            (None, _) => {}
        });
        if index + 1 == self.variants.len() {
            let seconds = requested.map(|requested| requested.elapsed().as_secs_f64());
            self.times[step as usize] = seconds.or(self.times[step as usize]);
        }
    }

    /// Whether something is still being baked.
    #[cfg(test)]
    pub(super) fn is_busy(&self) -> bool {
        self.rebake.progress().is_some() || self.values_work.is_some()
    }

    /// What is being baked, and how long the last change took.
    pub fn state(&self) -> String {
        let now = match self.rebake.progress() {
            Some((step, done, all)) => format!("{} ({done} of {all}) ...", step.name()),
            None => "up to date".to_owned(),
        };
        let times = Step::ALL.iter().zip(self.times);
        let times = times.filter_map(|(step, time)| Some(format!("{} {:.2} s", step.name(), time?)));
        std::iter::once(now).chain(times).collect::<Vec<_>>().join("; ")
    }

    /// Why nothing could be baked, and why individuals use their leaves' own normals: the reason of the first one, and
    /// how many they are.
    pub fn warnings(&self) -> Vec<String> {
        let reasons: Vec<&String> = self.no_surface.iter().flatten().collect();
        let note = reasons.first().map(|first| match self.no_surface.len() {
            0 | 1 => (*first).clone(),
            all => format!("{} of {all} plants: {first}", reasons.len()),
        });
        self.failure.iter().cloned().chain(note).collect()
    }

    /// The lighting in a scene file's words, if it is not the scene's own.
    pub fn changed(&self) -> Option<String> {
        (self.lighting != self.scene).then(|| self.lighting.to_ron())
    }

    /// The lighting, ready to be pasted into the species' entry in a scene file.
    pub fn snippet(&self) -> String {
        // A line break in a name must not end the comment.
        format!("// species {:?}\nlighting: {},\n", self.name, self.lighting.to_ron())
    }
}

/// Replaces the plants of `variants` in `forest`, and how the sun lights them.
fn show(forest: &mut Forest, variants: &Range<usize>, sun: SunLight, edit: impl FnOnce(&mut [BakedPlant])) {
    let mut plants = forest.plants.to_vec();
    if let Some(plants) = plants.get_mut(variants.clone()) {
        edit(plants);
    }
    forest.plants = Arc::new(plants);
    if forest.suns.get(variants.clone()).is_some_and(|suns| suns.iter().any(|old| *old != sun)) {
        let mut suns = forest.suns.to_vec();
        suns[variants.clone()].fill(sun);
        forest.suns = suns.into();
    }
}
