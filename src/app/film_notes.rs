//! What a film on disk needs besides its samples to become an image.

use serde::{Deserialize, Serialize};

use super::{AppError, RenderedImage, notes::SCENE, tone::tone_table};
use crate::{
    light::ScotopicTint,
    reference::{DisplayTransform, Film},
};

/// How a film is shown, and what it is of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmNotes {
    /// Samples per pixel of the whole image.
    pub total: u32,
    /// From nits to display values.
    pub exposure: f32,
    /// Night vision.
    pub night: ScotopicTint,
    /// The text of a PNG: keyword and value.
    pub text: Vec<(String, String)>,
}

impl FilmNotes {
    /// The bytes to keep.
    pub fn to_bytes(&self) -> Vec<u8> {
        // Numbers, strings and lists of them can always be written.
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// Reads them back; `None` for bytes that are none.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        serde_json::from_slice(bytes).ok()
    }

    /// Whether both are of one image. The name of the scene's file, which has no influence on it, may differ.
    pub fn is_of_same_image(&self, other: &Self) -> bool {
        let bare = |notes: &Self| {
            let mut bare = notes.clone();
            bare.text.retain(|(keyword, _)| keyword != SCENE);
            bare
        };
        bare(self) == bare(other)
    }

    /// `film` as a screen shows it.
    ///
    /// # Errors
    /// [`AppError::Reference`].
    pub fn image(&self, film: &Film) -> Result<RenderedImage, AppError> {
        let table = tone_table()?;
        let tone = Some(&table);
        let transform = DisplayTransform { exposure: self.exposure, night: self.night, tone, dither: true };
        let (width, height) = film.size();
        Ok(RenderedImage { width, height, pixels: film.display(&transform) })
    }

    /// The text of a PNG of `samples` samples a pixel.
    pub fn text_of(&self, samples: u32) -> Vec<(&str, String)> {
        let own = self.text.iter().map(|(keyword, value)| (keyword.as_str(), value.clone()));
        own.chain([("Samples", samples.to_string())]).collect()
    }
}
