//! The settings of a scene that trade run time for error, by name: `quality.near_distance`, `lighting.bands`.
//!
//! The names are those of a scene file. Which there are follows from the reflected types, as in the settings panel of the
//! flight, so that a new field can be swept without a line here.

use std::collections::{BTreeMap, HashMap};

use bevy::reflect::{Access, PartialReflect, TypeRegistry};
use ron::extensions::Extensions;
use serde::de::DeserializeOwned;

use crate::{
    app::{
        fly::settings::fields::{Content, Edit, Edited, Field},
        parse_lighting, parse_style,
    },
    scene::{Lighting, Overrides, QualityLevel, Scene, SceneError, Transfer, nearest},
    style::Style,
};

/// Why a setting cannot be set.
#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    /// No setting has this name.
    #[error("there is no setting `{name}`{}; `canopy profile SCENE --list-settings` lists them", suggestion(.nearest))]
    Unknown {
        /// The name.
        name: String,
        /// The name that was probably meant.
        nearest: Option<String>,
    },
    /// A value that the setting cannot have.
    #[error("`{name}` cannot be `{value}`: {expected}")]
    Value {
        /// The setting.
        name: String,
        /// The value.
        value: String,
        /// What it can be.
        expected: String,
    },
    /// A value out of range.
    #[error("`{name}` = `{value}`: {source}")]
    Range {
        /// The setting.
        name: String,
        /// The value.
        value: String,
        /// The scene's own check.
        source: Box<SceneError>,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// A setting for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingInfo {
    /// Its name.
    pub name: String,
    /// Its value in the scene.
    pub value: String,
    /// What it can be.
    pub expected: String,
}

/// Which of a scene's values a name means.
enum Target {
    Levels,
    /// The style of the images.
    Style,
    /// A field of the quality.
    Quality(String),
    /// The lighting of these species as a whole, or a field of it.
    Lighting {
        species: Vec<usize>,
        field: Option<String>,
    },
}

/// The fields of a value, by name.
fn with_fields<T: PartialReflect + Clone, R>(value: &mut T, work: impl FnOnce(&mut Edited<'_>, Vec<Field>) -> R) -> R {
    let mut registry = TypeRegistry::new();
    registry.register_derived_types();
    let (initial, mut left) = (value.clone(), HashMap::new());
    let mut edited = Edited {
        name: "lighting",
        value,
        initial: &initial,
        automatic: None,
        hidden: &[],
        left: &mut left,
        registry: &registry,
    };
    let fields = edited.fields();
    work(&mut edited, fields)
}

/// The name of a field in its own value; `None` for the value as a whole.
fn name_of(field: &Field) -> Option<String> {
    field.path.0.iter().rev().find_map(|part| match &part.access {
        Access::Field(name) => Some(name.to_string()),
        _ => None,
    })
}

/// What a field can be.
fn expected(content: &Content) -> String {
    match content {
        Content::Number { whole, optional, range, .. } => {
            let kind = if *whole { "a whole number" } else { "a number" };
            let bounds = if range.low.is_finite() && range.high.is_finite() && range.high < 1e9 {
                format!(" from {} to {}", range.low, range.high)
            } else {
                String::new()
            };
            format!("{kind}{bounds}{}", if *optional { ", or automatic" } else { "" })
        }
        Content::Switch(_) => "true or false".to_owned(),
        Content::Choice { names, .. } => names.iter().map(|name| squeezed(name)).collect::<Vec<_>>().join(", "),
        Content::Text(_) => "this cannot be swept".to_owned(),
    }
}

/// The value of a number that is not set.
pub const AUTOMATIC: &str = "automatic";

fn current(content: &Content) -> String {
    match content {
        Content::Number { set: Some(value), .. } => value.to_string(),
        Content::Number { set: None, .. } => AUTOMATIC.to_owned(),
        Content::Switch(on) => on.to_string(),
        Content::Choice { selected, names } => names.get(*selected).map(|name| squeezed(name)).unwrap_or_default(),
        Content::Text(text) => text.clone(),
    }
}

/// A choice without regard to case and separators: `leaf shader`, `LeafShader` and `leaf-shader` are one.
fn squeezed(name: &str) -> String {
    name.chars().filter(|letter| !" -_".contains(*letter)).flat_map(char::to_lowercase).collect()
}

/// The scene's lightings, where it leaves them out the default one.
fn lighting(scene: &Scene, species: usize) -> Lighting {
    let own = scene.species.get(species).and_then(|species| species.lighting.clone());
    own.unwrap_or_else(|| Lighting::Transfer(Transfer::default()))
}

/// All settings of `scene`.
pub fn list(scene: &Scene) -> Vec<SettingInfo> {
    let mut found = Vec::new();
    let mut add = |prefix: &str, fields: Vec<Field>| {
        for field in fields {
            if matches!(field.content, Content::Text(_)) {
                continue;
            }
            let name = name_of(&field).map_or(prefix.to_owned(), |name| format!("{prefix}.{name}"));
            found.push(SettingInfo { name, value: current(&field.content), expected: expected(&field.content) });
        }
    };
    add("quality", with_fields(&mut scene.quality.clone(), |_, fields| fields));
    let several = scene.species.len() > 1;
    for (index, species) in scene.species.iter().enumerate() {
        let fields = with_fields(&mut lighting(scene, index), |_, fields| fields);
        if several {
            add(&format!("species.{}.lighting", species.name), fields.clone());
        }
        add("lighting", fields);
    }
    found.push(SettingInfo {
        name: "quality.levels".to_owned(),
        value: format!("{} levels", scene.quality.lod_levels().len()),
        expected: "levels as in a scene file: [(draw: \"model\", until: 60), (draw: \"cross\")]".to_owned(),
    });
    found.push(SettingInfo {
        name: "style".to_owned(),
        value: scene.style.name().to_owned(),
        expected: Style::NAMES.join(", "),
    });
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found.dedup_by(|a, b| a.name == b.name);
    found
}

/// The values that `scene` has of the settings in `names`, as they can be set. A lighting that differs between species has none.
pub fn values<'a>(scene: &Scene, names: impl IntoIterator<Item = &'a str>) -> BTreeMap<String, String> {
    let mut names = names.into_iter().peekable();
    // The list takes its time.
    let settings = if names.peek().is_some() { list(scene) } else { Vec::new() };
    let value = |name: &str| {
        if name == "quality.levels" {
            return Some(levels_to_ron(&scene.quality.levels));
        }
        let own = settings.iter().find(|setting| setting.name == name)?;
        let of_species = |other: &&SettingInfo| {
            other.name.strip_prefix("species.").is_some_and(|rest| rest.ends_with(&format!(".{name}")))
        };
        settings.iter().filter(of_species).all(|other| other.value == own.value).then(|| own.value.clone())
    };
    names.filter_map(|name| Some((name.to_owned(), value(name)?))).collect()
}

/// Levels of detail as a scene file has them; `[]` where the quality's distances decide.
pub fn levels_to_ron(levels: &[QualityLevel]) -> String {
    let level =
        |level: &QualityLevel| format!("(draw: \"{}\", until: {}, fade: {})", level.draw, level.until, level.fade);
    format!("[{}]", levels.iter().map(level).collect::<Vec<_>>().join(", "))
}

/// Sets one setting in `scene`, and checks the scene.
///
/// # Errors
/// [`SettingError`]; the scene may have changed.
pub fn set(scene: &mut Scene, name: &str, value: &str) -> Result<(), SettingError> {
    let (name, value) = (name.trim(), value.trim());
    let wrong = |expected: String| SettingError::Value { name: name.to_owned(), value: value.to_owned(), expected };
    match target(scene, name)? {
        Target::Levels => scene.quality.levels = from_ron::<Vec<QualityLevel>>(value).map_err(wrong)?,
        Target::Style => {
            let style = parse_style(value).map_err(|_| wrong(Style::NAMES.join(", ")))?;
            Overrides { style: Some(style), ..Overrides::default() }.apply(scene);
        }
        Target::Quality(field) => {
            let known = edit(&mut scene.quality, &field, value).map_err(wrong)?;
            if !known {
                return Err(unknown(scene, name));
            }
        }
        Target::Lighting { species, field: None } => {
            let named = parse_lighting(value).ok();
            let written = || from_ron::<Lighting>(value);
            let kinds =
                "local, expressive, transfer, leaf-shader or harmonics, or as in a scene file: Transfer(bands: 3)";
            for index in species {
                let replaced = match &named {
                    // A species with this kind of lighting keeps its own values.
                    Some(lighting) => {
                        let alone = vec![scene.species[index].clone()];
                        let mut changed = Scene { species: alone, ..Scene::default() };
                        Overrides { lighting: Some(lighting.clone()), ..Overrides::default() }.apply(&mut changed);
                        changed.species.pop().and_then(|species| species.lighting)
                    }
                    None => Some(written().map_err(|_| wrong(kinds.to_owned()))?),
                };
                scene.species[index].lighting = replaced;
            }
        }
        Target::Lighting { species, field: Some(field) } => {
            let mut known = false;
            for index in species {
                let mut changed = lighting(scene, index);
                if edit(&mut changed, &field, value).map_err(wrong)? {
                    known = true;
                    scene.species[index].lighting = Some(changed);
                }
            }
            if !known {
                return Err(unknown(scene, name));
            }
        }
    }
    let range =
        |source| SettingError::Range { name: name.to_owned(), value: value.to_owned(), source: Box::new(source) };
    scene.validate().map_err(range)
}

fn unknown(scene: &Scene, name: &str) -> SettingError {
    let settings = list(scene);
    let names: Vec<&str> = settings.iter().map(|setting| setting.name.as_str()).collect();
    // `near_distance` or `lod.near_distance` for `quality.near_distance`, `shadow.map_size` for `quality.shadow_map_size`.
    let ending = |wanted: &str| names.iter().find(|known| last_part(known) == wanted).copied();
    let endings: Vec<&str> = names.iter().map(|known| last_part(known)).collect();
    let nearest = ending(last_part(name))
        .or_else(|| ending(&name.replace('.', "_")))
        .or_else(|| nearest(name, &names))
        .or_else(|| ending(nearest(last_part(name), &endings)?))
        .map(str::to_owned);
    SettingError::Unknown { name: name.to_owned(), nearest }
}

/// What is behind the last dot of a name.
fn last_part(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

fn target(scene: &Scene, name: &str) -> Result<Target, SettingError> {
    let all = || (0..scene.species.len()).collect::<Vec<_>>();
    if name == "quality.levels" {
        return Ok(Target::Levels);
    }
    if name == "style" {
        return Ok(Target::Style);
    }
    if let Some(field) = name.strip_prefix("quality.") {
        return Ok(Target::Quality(field.to_owned()));
    }
    if !scene.species.is_empty() {
        if name == "lighting" {
            return Ok(Target::Lighting { species: all(), field: None });
        }
        if let Some(field) = name.strip_prefix("lighting.") {
            return Ok(Target::Lighting { species: all(), field: Some(field.to_owned()) });
        }
    }
    for (index, species) in scene.species.iter().enumerate() {
        let prefix = format!("species.{}.lighting", species.name);
        match name.strip_prefix(&prefix) {
            Some("") => return Ok(Target::Lighting { species: vec![index], field: None }),
            Some(rest) => {
                if let Some(field) = rest.strip_prefix('.') {
                    return Ok(Target::Lighting { species: vec![index], field: Some(field.to_owned()) });
                }
            }
            None => {}
        }
    }
    Err(unknown(scene, name))
}

fn from_ron<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let options = ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES);
    options.from_str(text).map_err(|error| error.to_string())
}

/// Edits the field `name` of `value`; `false` if there is none. The error says what it can be.
fn edit<T: PartialReflect + Clone>(value: &mut T, name: &str, text: &str) -> Result<bool, String> {
    with_fields(value, |edited, fields| {
        let Some(field) = fields.iter().find(|field| name_of(field).as_deref() == Some(name)) else { return Ok(false) };
        let change = match &field.content {
            Content::Number { optional: true, .. } if text.eq_ignore_ascii_case("automatic") => Some(Edit::Automatic),
            Content::Number { whole, .. } => {
                let number = text.parse().ok().filter(|number: &f64| number.is_finite());
                let number = number.filter(|number| !whole || (number.fract() == 0.0 && *number >= 0.0));
                number.map(Edit::Number)
            }
            Content::Switch(_) => text.parse().ok().map(Edit::Switch),
            Content::Choice { names, .. } => {
                names.iter().position(|known| squeezed(known) == squeezed(text)).map(Edit::Choose)
            }
            Content::Text(_) => None,
        };
        let Some(change) = change else { return Err(format!("expected {}", expected(&field.content))) };
        edited.edit(field, &change);
        Ok(true)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        let text = "(terrain: Flat(size: 100), place: (latitude: 47, longitude: 9), species: [(name: \"a\", plant: Grown(), \
                    lighting: Expressive(radius: 0.5)), (name: \"b\", plant: Grown())])";
        Scene::parse(text, "s.ron".as_ref()).unwrap()
    }

    fn after(name: &str, value: &str) -> Result<Scene, String> {
        let mut scene = scene();
        set(&mut scene, name, value).map_err(|error| error.to_string())?;
        Ok(scene)
    }

    #[test]
    fn settings_have_the_names_of_scene_files() -> Result<(), String> {
        assert_eq!(after("quality.near_distance", "12.5")?.quality.near_distance, 12.5);
        assert_eq!(after("quality.msaa", "1")?.quality.msaa, 1);
        let levels = after("quality.levels", "[(draw: \"model\", until: 9, fade: 2), (draw: \"cloud\")]")?;
        assert_eq!(levels.quality.levels.len(), 2);
        let transfer = after("lighting", "transfer")?;
        assert!(transfer.species.iter().all(|species| matches!(species.lighting, Some(Lighting::Transfer(_)))));
        // A species of this kind keeps its own values.
        let expressive = after("lighting", "expressive")?;
        assert!(matches!(&expressive.species[0].lighting, Some(Lighting::Expressive(own)) if own.radius == Some(0.5)));
        let written = after("species.b.lighting", "Transfer(bands: 2)")?;
        assert!(matches!(&written.species[1].lighting, Some(Lighting::Transfer(own)) if own.bands == 2));
        // A field that only one of the kinds has.
        let bands = after("lighting.bands", "6")?;
        assert!(matches!(&bands.species[1].lighting, Some(Lighting::Transfer(own)) if own.bands == 6));
        assert_eq!(bands.species[0], scene().species[0]);
        assert!(
            matches!(&after("lighting.sun", "leaf-shader")?.species[1].lighting, Some(Lighting::Transfer(own)) if own.sun == crate::bake::lighting::SunLight::LeafShader)
        );
        assert!(
            matches!(&after("lighting.radius", "automatic")?.species[0].lighting, Some(Lighting::Expressive(own)) if own.radius.is_none())
        );
        Ok(())
    }

    #[test]
    fn what_cannot_be_set_is_said_with_what_can() {
        for (name, value, words) in [
            ("quality.near_distanc", "1", "did you mean `quality.near_distance`?"),
            ("near_distance", "1", "did you mean `quality.near_distance`?"),
            // Once these were told no name at all.
            ("shadow.map_size", "512", "did you mean `quality.shadow_map_size`?"),
            ("lod.tolerance", "1", "did you mean `quality.tolerance`?"),
            ("lod.toleranse", "1", "did you mean `quality.tolerance`?"),
            ("lighting.band", "1", "did you mean `lighting.bands`?"),
            ("species.c.lighting", "local", "there is no setting"),
            ("quality.msaa", "1.5", "expected a whole number"),
            ("quality.cascades", "-1", "expected a whole number"),
            ("quality.msaa", "2", "write 1 (off) or 4"),
            ("quality.near_distance", "NaN", "expected a number"),
            ("quality.shadow_map_size", "1000", "write 256, 512"),
            ("quality.levels", "9", "cannot be `9`"),
            ("quality.levels", "[(draw: \"tree\")]", "write \"model\""),
            ("lighting", "bright", "local, expressive, transfer"),
            ("lighting.sun", "moon", "combined"),
            ("lighting.bands", "9", "2 to 6"),
            ("", "", "there is no setting"),
        ] {
            let message = after(name, value).err().unwrap_or_default();
            assert!(message.contains(words), "{name} = {value}: {message}");
        }
    }

    #[test]
    fn values_of_a_scene_can_be_set_and_species_that_differ_have_none() -> Result<(), SettingError> {
        let mut scene = scene();
        set(&mut scene, "quality.levels", "[(draw: \"model\", until: 9, fade: 2), (draw: \"cloud\")]")?;
        let found = values(&scene, ["quality.msaa", "quality.levels", "lighting", "style", "control"]);
        assert_eq!(found.keys().collect::<Vec<_>>(), ["quality.levels", "quality.msaa", "style"], "{found:?}");
        assert_eq!(found["quality.msaa"], scene.quality.msaa.to_string());
        for (name, value) in &found {
            let mut again = scene.clone();
            set(&mut again, name, value)?;
            assert_eq!(again.quality, scene.quality, "{name} = {value}");
        }
        assert_eq!(levels_to_ron(&[]), "[]");
        Ok(())
    }

    #[test]
    fn the_list_has_every_setting_once_and_each_can_be_set_to_its_own_value() {
        let settings = list(&scene());
        let names: Vec<&str> = settings.iter().map(|setting| setting.name.as_str()).collect();
        for name in
            ["quality.levels", "quality.terrain_error", "lighting", "lighting.rays", "species.a.lighting.radius"]
        {
            assert_eq!(names.iter().filter(|known| **known == name).count(), 1, "{name} in {names:?}");
        }
        for setting in settings.iter().filter(|setting| setting.name != "quality.levels") {
            let result = after(&setting.name, &setting.value);
            assert!(result.is_ok(), "{} = {}: {result:?}", setting.name, setting.value);
        }
    }
}
