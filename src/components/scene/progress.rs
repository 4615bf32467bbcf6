//! How far the build of a scene has come.

use bevy::{
    ecs::{component::Component, reflect::ReflectComponent},
    prelude::ReflectDefault,
    reflect::Reflect,
};

/// State of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
pub enum SceneState {
    /// It is being built.
    #[default]
    Building,
    /// It is shown.
    Ready,
    /// It cannot be shown; [`SceneFailed`](super::SceneFailed) says why. An earlier scene stays in the world.
    Failed,
}

/// Progress of a [`CanopyScene`](super::CanopyScene), on the same entity. It changes at most once a frame; Bevy's
/// change detection works on it.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct SceneProgress {
    /// State of the scene.
    pub state: SceneState,
    /// Name of the current or last step: "Terrain", "Plants", "Trees" ...; empty before the first.
    pub step: String,
    /// Parts of the step that are done, for instance plants.
    pub done: u64,
    /// Number of parts of the step; 0 if it is unknown.
    pub total: u64,
    /// What was loaded, from where, and how long it took, a line each.
    pub notes: Vec<String>,
    /// Problems that do not prevent the scene from being shown: a missing texture, holes in a terrain.
    pub warnings: Vec<String>,
}

impl SceneProgress {
    /// Fraction of the step that is done, 0..=1; `None` if it is unknown.
    pub fn share(&self) -> Option<f32> {
        (self.total > 0).then(|| self.done.min(self.total) as f32 / self.total as f32)
    }

    /// Applies an event of the build.
    pub(super) fn apply(&mut self, event: BuildEvent) {
        match event {
            BuildEvent::Begin(step, total) => (self.step, self.done, self.total) = (step, 0, total),
            BuildEvent::Advance(steps) => self.done = self.done.saturating_add(steps),
            BuildEvent::End => self.done = self.total,
            BuildEvent::Note(note) => self.notes.push(note),
            BuildEvent::Warning(warning) => self.warnings.push(warning),
        }
    }
}

/// What the build of a scene reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BuildEvent {
    /// A step begins: its name and its number of parts.
    Begin(String, u64),
    /// Further parts are done.
    Advance(u64),
    /// The step is over.
    End,
    /// See [`SceneProgress::notes`].
    Note(String),
    /// See [`SceneProgress::warnings`].
    Warning(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_counted_and_lines_kept() {
        let mut progress = SceneProgress::default();
        assert_eq!(progress.share(), None);
        progress.apply(BuildEvent::Begin("Plants".to_owned(), 4));
        assert_eq!(progress.share(), Some(0.0));
        progress.apply(BuildEvent::Advance(3));
        progress.apply(BuildEvent::Warning("w".to_owned()));
        assert_eq!((progress.step.as_str(), progress.done, progress.share()), ("Plants", 3, Some(0.75)));
        progress.apply(BuildEvent::Advance(u64::MAX));
        assert_eq!(progress.share(), Some(1.0));
        progress.apply(BuildEvent::End);
        progress.apply(BuildEvent::Note("n".to_owned()));
        assert_eq!((progress.done, progress.total), (4, 4));
        progress.apply(BuildEvent::Begin("Trees".to_owned(), 0));
        assert_eq!((progress.done, progress.share()), (0, None));
        assert_eq!((progress.notes, progress.warnings), (vec!["n".to_owned()], vec!["w".to_owned()]));
    }
}
