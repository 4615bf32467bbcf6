//! Pigments: a palette is a small RON file. Those of `assets/palettes` ship with the program.
//!
//! Colours are written as they look on white paper, `"#rrggbb"` in sRGB; a ramp is a list of `(light, colour, alpha)` from the
//! dark side (light 0) to the bright one (1), and its alpha is how much pigment there is.

use std::path::Path;

use glam::Vec3;
use serde::{Deserialize, Deserializer, de};

use super::ramp::{Ramp, color_of_hex};
use crate::math::names::nearest;

/// A linear colour that a file writes as `"#rrggbb"`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hex(pub Vec3);

impl<'de> Deserialize<'de> for Hex {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        color_of_hex(&text)
            .map(Self)
            .ok_or_else(|| de::Error::custom(format!("`{text}` is no colour (expected \"#rrggbb\")")))
    }
}

/// The pigments of a picture.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Palette {
    /// Colour of the paper.
    pub paper: Hex,
    /// Added to every layer, weighted by its alpha: cool to warm, for example. Default: nothing.
    #[serde(default)]
    pub hue: Ramp,
    /// From the horizon (0) to the zenith (1).
    pub sky: Ramp,
    /// The ground.
    pub ground: Ramp,
    /// Trunks and branches.
    pub wood: Ramp,
    /// Foliage: one ramp for each group of plants; they repeat.
    pub foliage: Vec<Ramp>,
    /// How far the foliage takes on the colour of the scene's own leaves, 0 to 1. Default 0.
    #[serde(default)]
    pub scene: f32,
    /// The layer of shadows, over how far they lie in the distance (0 near, 1 far).
    pub shadow: Ramp,
    /// Dabs of foliage: dark, medium and bright ones.
    pub dabs: [Ramp; 3],
    /// The colour into which distance fades.
    pub distance: Hex,
    /// Pencil and pen.
    pub ink: Hex,
    /// Glaze of the night.
    pub night: Hex,
}

/// Why a palette cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PaletteError {
    /// No palette of this name.
    #[error("there is no palette `{name}`; did you mean `{nearest}`? (known: {}; or the path of a .ron file)", names())]
    Unknown {
        /// The name.
        name: String,
        /// The nearest known one.
        nearest: &'static str,
    },
    /// A file that cannot be read.
    #[error("{file}: {source}; check the path and its permissions")]
    Read {
        /// The file.
        file: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file that is no palette.
    #[error("{file}:{message}; assets/palettes has examples")]
    Malformed {
        /// The file.
        file: String,
        /// Line, column, and what is wrong.
        message: String,
    },
}

macro_rules! built_in {
    ($($name:literal),+ $(,)?) => {
        /// Names and texts of the palettes that ship with the program.
        pub const BUILT_IN: [(&str, &str); [$($name),+].len()] =
            [$(($name, include_str!(concat!("../../assets/palettes/", $name, ".ron")))),+];
        /// Names of the palettes that ship with the program.
        pub const NAMES: &[&str] = &[$($name),+];
    };
}

built_in!("natural", "sepia", "cool-to-warm", "autumn", "indigo", "botanical");

fn names() -> String {
    NAMES.join(", ")
}

impl Palette {
    /// Whether `name` is the path of a file rather than the name of a palette of the program.
    pub fn is_file(name: &str) -> bool {
        Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron"))
    }

    /// The palette of the program that is called `name`.
    ///
    /// # Errors
    /// [`PaletteError::Unknown`] with the nearest name.
    pub fn named(name: &str) -> Result<Self, PaletteError> {
        match BUILT_IN.iter().find(|(known, _)| *known == name.trim()) {
            Some((known, text)) => Self::parse(text, known),
            None => Err(PaletteError::Unknown {
                name: name.to_owned(),
                nearest: nearest(name, NAMES.iter().copied()).unwrap_or("natural"),
            }),
        }
    }

    /// The palette called `name`, or that of the file at the path `name` if that ends in `.ron`.
    ///
    /// # Errors
    /// [`PaletteError`].
    pub fn load(name: &str) -> Result<Self, PaletteError> {
        if !Self::is_file(name) {
            return Self::named(name);
        }
        let text =
            std::fs::read_to_string(name).map_err(|source| PaletteError::Read { file: name.to_owned(), source })?;
        Self::parse(&text, name)
    }

    /// The palette of a file's text; `file` names it in messages.
    ///
    /// # Errors
    /// [`PaletteError::Malformed`].
    pub fn parse(text: &str, file: &str) -> Result<Self, PaletteError> {
        let malformed = |message: String| PaletteError::Malformed { file: file.to_owned(), message };
        let palette: Self = ron::from_str(text.strip_prefix('\u{feff}').unwrap_or(text))
            .map_err(|error| malformed(format!("{}: {}", error.span.start, error.code)))?;
        if palette.foliage.is_empty() {
            return Err(malformed(" `foliage` has no ramp; write at least one".to_owned()));
        }
        if !(0.0..=1.0).contains(&palette.scene) {
            return Err(malformed(format!(" `scene` is {}; write a value from 0 to 1", palette.scene)));
        }
        Ok(palette)
    }

    /// The ramp of the foliage's group `group`.
    pub fn foliage_of(&self, group: usize) -> &Ramp {
        static NONE: std::sync::LazyLock<Ramp> = std::sync::LazyLock::new(Ramp::default);
        self.foliage.get(group % self.foliage.len().max(1)).unwrap_or(&NONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_palettes_of_the_program_can_be_read_and_differ() -> Result<(), PaletteError> {
        let palettes = BUILT_IN.map(|(name, _)| Palette::named(name));
        let palettes: Vec<_> = palettes.into_iter().collect::<Result<_, _>>()?;
        for (i, palette) in palettes.iter().enumerate() {
            assert!(palettes.iter().skip(i + 1).all(|other| other != palette));
            // The paper is the lightest of all.
            let paper = crate::math::luminance(palette.paper.0);
            let lightest = palette.ground.at(1.0).truncate();
            assert!(paper > 0.7 && crate::math::luminance(lightest) < paper);
            assert_eq!(palette.foliage_of(palette.foliage.len()), palette.foliage_of(0));
        }
        Ok(())
    }

    #[test]
    fn a_wrong_name_has_a_suggestion_and_a_wrong_file_a_place() {
        assert!(Palette::named("sepai").is_err_and(|error| error.to_string().contains("did you mean `sepia`")));
        assert!(Palette::load("none.ron").is_err_and(|error| error.to_string().starts_with("none.ron: ")));
        let text = BUILT_IN[0].1;
        let wrong = Palette::parse(&text.replacen("\"#", "\"", 1), "my.ron").map(|_| ()).expect_err("no colour");
        assert!(wrong.to_string().starts_with("my.ron:") && wrong.to_string().contains("#rrggbb"), "{wrong}");
        assert!(Palette::parse("(", "my.ron").is_err() && Palette::parse("", "my.ron").is_err());
        assert!(Palette::is_file("a/b.RON") && !Palette::is_file("sepia"));
    }
}
