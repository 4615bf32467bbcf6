//! How far a scene is, for whoever looks.

use bevy::{
    ecs::{component::Component, reflect::ReflectComponent},
    prelude::ReflectDefault,
    reflect::Reflect,
};

/// Where a scene stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
pub enum SceneState {
    /// It is being built.
    #[default]
    Building,
    /// It is shown.
    Ready,
    /// It cannot be shown; [`SceneFailed`](super::SceneFailed) says why. An earlier one stays.
    Failed,
}

/// How far a [`CanopyScene`](super::CanopyScene) is, on the same entity. It changes at most once a frame, and Bevy's change
/// detection holds.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct SceneProgress {
    /// Where it stands.
    pub state: SceneState,
    /// Name of the step that it is at, or ended with: "Terrain", "Plants", "Trees" ...; empty before the first.
    pub step: String,
    /// Parts of the step that are done, of plants for instance.
    pub done: u64,
    /// All parts of the step; 0 where their number is unknown.
    pub total: u64,
    /// What was loaded, from where, and how long it took, a line each.
    pub notes: Vec<String>,
    /// What its author ought to know though it can be shown: a missing texture, holes in a terrain.
    pub warnings: Vec<String>,
}

impl SceneProgress {
    /// Share of the step that is done, 0..=1; `None` where it is unknown.
    pub fn share(&self) -> Option<f32> {
        (self.total > 0).then(|| self.done.min(self.total) as f32 / self.total as f32)
    }

    /// Takes in what the builder said.
    pub(super) fn hear(&mut self, said: Said) {
        match said {
            Said::Begin(step, total) => (self.step, self.done, self.total) = (step, 0, total),
            Said::Advance(steps) => self.done = self.done.saturating_add(steps),
            Said::End => self.done = self.total,
            Said::Note(note) => self.notes.push(note),
            Said::Warning(warning) => self.warnings.push(warning),
        }
    }
}

/// What the builder says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Said {
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
        progress.hear(Said::Begin("Plants".to_owned(), 4));
        assert_eq!(progress.share(), Some(0.0));
        progress.hear(Said::Advance(3));
        progress.hear(Said::Warning("w".to_owned()));
        assert_eq!((progress.step.as_str(), progress.done, progress.share()), ("Plants", 3, Some(0.75)));
        progress.hear(Said::Advance(u64::MAX));
        assert_eq!(progress.share(), Some(1.0));
        progress.hear(Said::End);
        progress.hear(Said::Note("n".to_owned()));
        assert_eq!((progress.done, progress.total), (4, 4));
        progress.hear(Said::Begin("Trees".to_owned(), 0));
        assert_eq!((progress.done, progress.share()), (0, None));
        assert_eq!((progress.notes, progress.warnings), (vec!["n".to_owned()], vec!["w".to_owned()]));
    }
}
