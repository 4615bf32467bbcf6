//! `canopy bake SCENE`: fills the cache with the plants of a scene, so that other calls, or other machines that share it, find
//! them there.

use crate::{
    app::{AppError, interrupt},
    assets::Stage,
    progress::Progress,
    scene::{Overrides, SceneSource},
};

/// Bakes all plants of a scene into the user's cache; returns how many there are. Those that are there already are kept.
///
/// # Errors
/// [`AppError::Scene`], [`AppError::Stage`], [`AppError::Interrupted`].
pub fn bake_scene(source: &SceneSource, overrides: &Overrides, progress: &mut dyn Progress) -> Result<usize, AppError> {
    let scene = overrides.applied(source.read()?);
    let stage = Stage::build(&scene, progress).map_err(interrupt::building)?;
    Ok(stage.plants.len())
}
