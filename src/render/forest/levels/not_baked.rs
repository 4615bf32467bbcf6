//! What the user is told of plants that have no bake of a level.

use std::{
    collections::BTreeSet,
    sync::{Mutex, PoisonError},
};

use bevy::log::error;

use crate::{bake::BakedPlant, render::forest::representation::LevelRenderer};

/// The most plants that a message names.
const MOST_NAMES: usize = 5;

/// What the user is told where `renderer` draws some of `plants` not at all, because no bake of theirs has its level.
pub(super) fn not_baked(plants: &[BakedPlant], renderer: &dyn LevelRenderer) -> Option<String> {
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
pub(super) fn tell_not_baked(plants: &[BakedPlant], renderer: &dyn LevelRenderer) {
    static TOLD: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if let Some(message) = not_baked(plants, renderer)
        && TOLD.lock().unwrap_or_else(PoisonError::into_inner).insert(message.clone())
    {
        error!("{message}");
    }
}
