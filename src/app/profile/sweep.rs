//! The points of a profile: the scene as written, and what the sweeps make of it.

use super::{contestant::Peer, error::ProfileError, settings};
use crate::{
    scene::{QualityLevel, Scene},
    style::Style,
};

/// The most points of a profile; more are a typing error.
const MOST_POINTS: usize = 1_000;

/// Names of what is compared with the settings.
const CONTROL: &str = "control";
const RENDERER: &str = "renderer";

/// Values of one setting: `quality.near_distance=20,60,120`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sweep {
    /// The setting.
    pub name: String,
    /// Its values, at least one.
    pub values: Vec<String>,
}

impl std::str::FromStr for Sweep {
    type Err = String;

    /// Reads `NAME=VALUE,VALUE`. Commas within brackets or quotes belong to the value.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, values) = text.split_once('=').ok_or_else(|| {
            format!("`{text}` is not a sweep (expected NAME=VALUE,VALUE as in quality.near_distance=20,60)")
        })?;
        let values = split(values);
        if name.trim().is_empty() || values.is_empty() {
            return Err(format!(
                "the sweep `{text}` is empty (expected NAME=VALUE,VALUE as in quality.near_distance=20,60)"
            ));
        }
        if values.iter().any(String::is_empty) {
            return Err(format!("a value of the sweep `{text}` is empty; write a value between two commas"));
        }
        Ok(Self { name: name.trim().to_owned(), values })
    }
}

/// `text` at the commas that no bracket and no quote encloses; nothing if it is blank.
fn split(text: &str) -> Vec<String> {
    if text.trim().is_empty() {
        return Vec::new();
    }
    let (mut depth, mut quoted) = (0usize, false);
    let mut parts = vec![String::new()];
    for letter in text.chars() {
        match letter {
            '"' => quoted = !quoted,
            '(' | '[' if !quoted => depth += 1,
            ')' | ']' if !quoted => depth = depth.saturating_sub(1),
            ',' if !quoted && depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(part) = parts.last_mut() {
            part.push(letter);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}

/// One combination of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// What it sets, in the order of the sweeps; nothing for the scene as written.
    pub settings: Vec<(String, String)>,
    /// The scene with these settings.
    pub scene: Scene,
    /// Who draws it, if it is not Canopy.
    pub peer: Option<Peer>,
}

impl Point {
    /// The scene as written a second time: how far its time is from the first's tells what a difference of settings is worth.
    pub fn again(scene: &Scene) -> Self {
        let settings = vec![(CONTROL.to_owned(), "as written".to_owned())];
        Self { settings, scene: scene.clone(), peer: None }
    }

    /// The scene as `peer` draws it.
    pub fn of_peer(scene: &Scene, peer: Peer) -> Self {
        let scene = Scene { style: Style::Photograph, ..scene.clone() };
        Self { settings: vec![(RENDERER.to_owned(), "stock Bevy".to_owned())], scene, peer: Some(peer) }
    }

    /// Whether it is no setting of this renderer, but the control or a peer.
    pub fn is_unranked(&self) -> bool {
        self.peer.is_some() || self.settings.iter().any(|(name, _)| name == CONTROL)
    }

    /// Its settings for people.
    pub fn label(&self) -> String {
        match self.settings.as_slice() {
            [(name, _)] if name == CONTROL => return "as written, again".to_owned(),
            [(name, value)] if name == RENDERER => return value.clone(),
            _ => {}
        }
        if self.settings.is_empty() {
            return "as written".to_owned();
        }
        let words = |(name, value): &(String, String)| {
            let value = if name == "quality.levels" { self.levels() } else { value.clone() };
            format!("{}={value}", name.strip_prefix("quality.").unwrap_or(name))
        };
        self.settings.iter().map(words).collect::<Vec<_>>().join(", ")
    }

    /// The levels of detail in short: `model 40, cross`.
    fn levels(&self) -> String {
        let levels = &self.scene.quality.levels;
        let level = |(index, level): (usize, &QualityLevel)| match index + 1 == levels.len() {
            true => level.draw.clone(),
            false => format!("{} {} m", level.draw, level.until),
        };
        format!("({})", levels.iter().enumerate().map(level).collect::<Vec<_>>().join(", "))
    }
}

/// How several sweeps go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Combination {
    /// Every value of one with every value of the others.
    #[default]
    All,
    /// One setting at a time, the others as written.
    Each,
}

/// Whether each setting has one sweep.
///
/// # Errors
/// [`ProfileError::SweptTwice`].
pub fn check_names(sweeps: &[Sweep]) -> Result<(), ProfileError> {
    let twice = |(number, sweep): &(usize, &Sweep)| sweeps.iter().take(*number).any(|before| before.name == sweep.name);
    match sweeps.iter().enumerate().find(twice) {
        Some((_, sweep)) => Err(ProfileError::SweptTwice(sweep.name.clone())),
        None => Ok(()),
    }
}

/// The points of `sweeps`: the scene as written first, and none twice.
///
/// # Errors
/// [`ProfileError::SweptTwice`], [`ProfileError::Setting`], [`ProfileError::TooManyPoints`].
pub fn points(scene: &Scene, sweeps: &[Sweep], combination: Combination) -> Result<Vec<Point>, ProfileError> {
    check_names(sweeps)?;
    let mut combined: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for sweep in sweeps {
        let pairs = || sweep.values.iter().map(|value| (sweep.name.clone(), value.clone()));
        match combination {
            Combination::Each => combined.extend(pairs().map(|pair| vec![pair])),
            Combination::All => {
                if combined.len().saturating_mul(sweep.values.len()) > MOST_POINTS {
                    return Err(ProfileError::TooManyPoints { most: MOST_POINTS });
                }
                let with = |before: &Vec<(String, String)>| {
                    let before = before.clone();
                    pairs().map(move |pair| before.iter().cloned().chain([pair]).collect()).collect::<Vec<_>>()
                };
                combined = combined.iter().flat_map(with).collect();
            }
        }
    }
    let mut points = vec![Point { settings: Vec::new(), scene: scene.clone(), peer: None }];
    for settings in combined.into_iter().filter(|settings| !settings.is_empty()) {
        let mut changed = scene.clone();
        for (name, value) in &settings {
            settings::set(&mut changed, name, value)?;
        }
        if points.iter().all(|point| point.scene != changed) {
            points.push(Point { settings, scene: changed, peer: None });
        }
    }
    if points.len() > MOST_POINTS {
        return Err(ProfileError::TooManyPoints { most: MOST_POINTS });
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(text: &str) -> Sweep {
        text.parse().unwrap()
    }

    #[test]
    fn sweeps_are_read() {
        assert_eq!(sweep("a.b= 1, 2").values, ["1", "2"]);
        let levels = sweep("quality.levels=[(draw: \"a,b\", until: 1), (draw: \"c\")],[]");
        assert_eq!(levels.values, ["[(draw: \"a,b\", until: 1), (draw: \"c\")]", "[]"]);
        for wrong in ["a", "a=", "=1", "a=1,,2", "a=1,", ""] {
            assert!(wrong.parse::<Sweep>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn points_are_the_scene_as_written_and_all_combinations_none_twice() {
        let scene = Scene::default();
        let sweeps = [sweep("quality.near_distance=20,60"), sweep("quality.msaa=1,4")];
        let labels = |combination| -> Vec<String> {
            points(&scene, &sweeps, combination).unwrap().iter().map(Point::label).collect()
        };
        let all = ["as written", "near_distance=20, msaa=1", "near_distance=20, msaa=4", "near_distance=60, msaa=1"];
        assert_eq!(labels(Combination::All), all);
        assert_eq!(labels(Combination::Each), ["as written", "near_distance=20", "msaa=1"]);
        let levels = [sweep("quality.levels=[(draw: \"model\", until: 40), (draw: \"cross\")]")];
        let found = points(&scene, &levels, Combination::All).unwrap();
        assert_eq!(found[1].label(), "levels=(model 40 m, cross)");
        // Of two sweeps of one setting the second one's values once replaced the first one's without a word.
        let twice = [sweep("quality.msaa=1"), sweep("quality.msaa=4")];
        for combination in [Combination::All, Combination::Each] {
            let message = points(&scene, &twice, combination).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(message.starts_with("`quality.msaa` is swept twice; write all its values in one"), "{message}");
        }
        let cube = ["near_distance", "shadow_distance", "terrain_error"]
            .map(|name| sweep(&format!("quality.{name}={}", vec!["1"; 40].join(","))));
        assert!(matches!(points(&scene, &cube, Combination::All), Err(ProfileError::TooManyPoints { .. })));
        assert!(matches!(points(&scene, &[sweep("no=1")], Combination::All), Err(ProfileError::Setting(_))));
    }
}
