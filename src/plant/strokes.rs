//! Strokes that are drawn by hand on one leaf, and are seen on every leaf that shares its texture [Luft 2006, 4.4].
//!
//! They are a small RON file in texture coordinates: u to the right, v down, 0 to 1 over the image of the leaf.
//!
//! ```ron
//! (
//!     materials: ["petal"],
//!     strokes: [
//!         (points: [(0.50, 0.95), (0.48, 0.60), (0.50, 0.10)], width: (0.02, 0.004)),
//!         (points: [(0.30, 0.50), (0.45, 0.55)], kind: Shade),
//!     ],
//! )
//! ```
//!
//! Photographs do not show them.

use std::path::Path;

use glam::Vec2;
use image::{Rgba, RgbaImage};
use serde::Deserialize;

use super::PlantPart;
use super::texture::linear_mips;
use crate::math::MipChain;
use crate::math::color::unorm8;

/// Texels along a side of the texture that strokes become, where a file says nothing.
const RESOLUTION: u32 = 512;
/// Texels along a side that a file may ask for.
const RESOLUTIONS: std::ops::RangeInclusive<u32> = 16..=4096;
/// Straight pieces between two points of a stroke.
const PIECES: usize = 12;
/// The most points of a file.
const MOST_POINTS: usize = 100_000;
/// The most texels that the strokes of a file visit: 120 for each texel of the largest texture.
const MOST_TEXELS: f64 = 2e9;

/// When a stroke is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum StrokeKind {
    /// In light and in shade.
    #[default]
    Drawn,
    /// In shade alone: hatching.
    Shade,
}

/// A smooth line through points.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// Points in texture coordinates. One is a dot. What lies outside of 0 to 1 is cut off.
    pub points: Vec<(f32, f32)>,
    /// Width at the first and at the last point, as a fraction of the texture, 0 to 1. Default (0.012, 0.004).
    #[serde(default = "usual_width")]
    pub width: (f32, f32),
    /// How dark it is, 0 to 1. Default 1.
    #[serde(default = "whole")]
    pub strength: f32,
    /// When it is seen. Default `Drawn`.
    #[serde(default)]
    pub kind: StrokeKind,
}

fn usual_width() -> (f32, f32) {
    (0.012, 0.004)
}

fn whole() -> f32 {
    1.0
}

fn usual_resolution() -> u32 {
    RESOLUTION
}

/// The strokes of leaves with one texture.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafStrokes {
    /// Names of the materials that have them; capital letters do not count. Default: all foliage.
    #[serde(default)]
    pub materials: Vec<String>,
    /// Texels along a side of their texture, 16 to 4096. Default 512.
    #[serde(default = "usual_resolution")]
    pub resolution: u32,
    /// The strokes, in any order.
    pub strokes: Vec<Stroke>,
}

/// Why strokes cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StrokesError {
    /// A file that cannot be read.
    #[error("{file}: {source}; check the path and its permissions")]
    Read {
        /// The file.
        file: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file that holds no strokes.
    #[error("{file}:{message}")]
    Malformed {
        /// The file.
        file: String,
        /// Place, what is wrong, and the remedy.
        message: String,
    },
}

impl LeafStrokes {
    /// The strokes of the file at `path`.
    ///
    /// # Errors
    /// [`StrokesError`].
    pub fn read(path: &Path) -> Result<Self, StrokesError> {
        let file = path.display().to_string();
        match std::fs::read_to_string(path) {
            Ok(text) => Self::parse(&text, &file),
            Err(source) => Err(StrokesError::Read { file, source }),
        }
    }

    /// The strokes of a file's text; `file` names it in messages.
    ///
    /// # Errors
    /// [`StrokesError::Malformed`].
    pub fn parse(text: &str, file: &str) -> Result<Self, StrokesError> {
        let malformed = |message: String| StrokesError::Malformed { file: file.to_owned(), message };
        let sheet: Self = ron::from_str(text.strip_prefix('\u{feff}').unwrap_or(text))
            .map_err(|error| malformed(format!("{}: {}", error.span.start, error.code)))?;
        sheet.check().map_err(|what| malformed(format!(" {what}")))?;
        Ok(sheet)
    }

    fn check(&self) -> Result<(), String> {
        if !RESOLUTIONS.contains(&self.resolution) {
            return Err(format!("`resolution` is {}; write 16 to 4096", self.resolution));
        }
        let points: usize = self.strokes.iter().map(|stroke| stroke.points.len()).sum();
        if points > MOST_POINTS {
            return Err(format!("the strokes have {points} points; write {MOST_POINTS} at most"));
        }
        for (number, stroke) in self.strokes.iter().enumerate() {
            if stroke.points.is_empty() {
                return Err(format!("`strokes[{number}].points` is empty; write at least one point"));
            }
            if let Some(at) = stroke.points.iter().position(|&(u, v)| !(u.abs() <= 1e6 && v.abs() <= 1e6)) {
                return Err(format!("`strokes[{number}].points[{at}]` is no place; write two numbers from 0 to 1"));
            }
            let numbers = [("width", stroke.width.0), ("width", stroke.width.1), ("strength", stroke.strength)];
            if let Some((name, value)) = numbers.into_iter().find(|(_, value)| !(0.0..=1.0).contains(value)) {
                return Err(format!("`strokes[{number}].{name}` is {value}; write a value from 0 to 1"));
            }
        }
        let texels: f64 = self.strokes.iter().map(|stroke| stroke.work(self.resolution)).sum();
        if texels > MOST_TEXELS {
            return Err(format!(
                "the strokes would visit {texels:.1e} texels at `resolution: {}`; {MOST_TEXELS:.0e} at most: write fewer points, \
                 narrower strokes, or a lower resolution",
                self.resolution
            ));
        }
        Ok(())
    }

    /// What a user should know of the points that lie outside of the leaf's image.
    pub fn warning(&self) -> Option<String> {
        let points = || self.strokes.iter().flat_map(|stroke| &stroke.points);
        let outside = points().filter(|(u, v)| !(0.0..=1.0).contains(u) || !(0.0..=1.0).contains(v)).count();
        let all = points().count();
        (outside > 0).then(|| {
            format!("{outside} of {all} points of strokes lie outside of the leaf's image (0 to 1) and are cut off")
        })
    }

    /// Whether `part` has these strokes.
    pub fn are_on(&self, part: &PlantPart) -> bool {
        let name = part.material.name.to_lowercase();
        let named = |material: &String| name == material.to_lowercase();
        part.kind == super::PartKind::Foliage && (self.materials.is_empty() || self.materials.iter().any(named))
    }

    /// The strokes as a texture with mips: strokes of [`StrokeKind::Drawn`] in red, of [`StrokeKind::Shade`] in green.
    pub fn texture(&self) -> MipChain {
        let side = self.resolution.clamp(*RESOLUTIONS.start(), *RESOLUTIONS.end());
        let mut image = RgbaImage::from_pixel(side, side, Rgba([0, 0, 0, 255]));
        for stroke in &self.strokes {
            stroke.draw(&mut image);
        }
        linear_mips(&image)
    }
}

/// A point of the smooth line, and half the line's width there; texels.
#[derive(Clone, Copy)]
struct Sample {
    at: Vec2,
    half: f32,
}

/// The columns and rows of a texture with `side` texels that a piece of a line reaches.
fn reached(from: Sample, to: Sample, side: f32) -> [std::ops::Range<u32>; 2] {
    // Half a texel on either side of the edge.
    let reach = from.half.max(to.half) + 1.0;
    let low = (from.at.min(to.at) - reach).clamp(Vec2::ZERO, Vec2::splat(side));
    let high = (from.at.max(to.at) + reach).clamp(Vec2::ZERO, Vec2::splat(side)).ceil();
    [low.x as u32..high.x as u32, low.y as u32..high.y as u32]
}

/// Pairs of samples between which a straight piece is drawn; one sample is a dot.
fn pieces(samples: &[Sample]) -> impl Iterator<Item = (Sample, Sample)> + '_ {
    let dot = samples.first().filter(|_| samples.len() == 1).map(|&dot| (dot, dot));
    dot.into_iter().chain(samples.windows(2).map(|pair| (pair[0], pair[1])))
}

impl Stroke {
    /// The texels that [`draw`](Self::draw) visits.
    fn work(&self, side: u32) -> f64 {
        let area =
            |(from, to)| reached(from, to, side as f32).map(|texels| texels.len() as f64).iter().product::<f64>();
        pieces(&self.samples(side as f32)).map(area).sum()
    }

    fn draw(&self, image: &mut RgbaImage) {
        let side = image.width() as f32;
        let channel = match self.kind {
            StrokeKind::Drawn => 0,
            StrokeKind::Shade => 1,
        };
        for (from, to) in pieces(&self.samples(side)) {
            let [columns, rows] = reached(from, to, side);
            for y in rows {
                for x in columns.clone() {
                    let texel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                    let along = to.at - from.at;
                    let t = ((texel - from.at).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
                    let distance = texel.distance(from.at + t * along);
                    let half = from.half + t * (to.half - from.half);
                    // A line narrower than a texel is fainter, not wider.
                    let covered = (half + 0.5 - distance).clamp(0.0, (2.0 * half).clamp(0.0, 1.0));
                    let texel = &mut image.get_pixel_mut(x, y).0[channel];
                    *texel = (*texel).max(unorm8(covered * self.strength));
                }
            }
        }
    }

    /// The line through the points [Catmull & Rom 1974].
    fn samples(&self, side: f32) -> Vec<Sample> {
        let points: Vec<Vec2> = self.points.iter().map(|&(u, v)| side * Vec2::new(u, v)).collect();
        let spans = points.len().saturating_sub(1);
        let point = |index: usize| points[index.min(points.len() - 1)];
        let half = |t: f32| 0.5 * side * (self.width.0 + t * (self.width.1 - self.width.0));
        if spans == 0 {
            return points.first().map(|&at| Sample { at, half: half(0.0) }).into_iter().collect();
        }
        let sample = |index: usize| {
            let (span, t) = ((index / PIECES).min(spans - 1), index - (index / PIECES).min(spans - 1) * PIECES);
            let t = t as f32 / PIECES as f32;
            let [a, b, c, d] = [point(span.saturating_sub(1)), point(span), point(span + 1), point(span + 2)];
            let at = 0.5
                * (2.0 * b
                    + (c - a) * t
                    + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
                    + (3.0 * b - a - 3.0 * c + d) * t * t * t);
            Sample { at, half: half(index as f32 / (spans * PIECES) as f32) }
        };
        (0..=spans * PIECES).map(sample).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{PartKind, PlantMaterial, PlantMesh};

    fn sheet(text: &str) -> LeafStrokes {
        LeafStrokes::parse(text, "a.ron").expect("strokes")
    }

    /// Ink of a channel at level 0, in texels.
    fn ink(texture: &MipChain, channel: usize) -> f32 {
        texture.levels[0].chunks_exact(4).map(|texel| f32::from(texel[channel]) / 255.0).sum()
    }

    #[test]
    fn a_line_has_its_length_times_its_width_of_ink_at_every_resolution() {
        for resolution in [128, 512] {
            // Of width 0.02, from 0.2 to 0.8, with two round ends.
            let line = sheet(&format!(
                "(resolution: {resolution}, strokes: [(points: [(0.2, 0.4), (0.5, 0.4), (0.8, 0.4)], width: (0.02, 0.02))])"
            ));
            let texture = line.texture();
            assert!(texture.is_whole());
            let area = ink(&texture, 0) / (resolution * resolution) as f32;
            let exact = 0.6 * 0.02 + std::f32::consts::PI * 1e-4;
            assert!((area / exact - 1.0).abs() < 0.03, "{resolution}: {area} of {exact}");
            assert_eq!(ink(&texture, 1), 0.0);
            // The mips keep the ink.
            let last = texture.levels.last().expect("a level");
            assert!((f32::from(last[0]) / 255.0 - area).abs() < 0.004);
        }
    }

    #[test]
    fn hatching_has_a_channel_of_its_own_and_a_thin_line_is_faint() {
        let both = sheet(
            "(strokes: [(points: [(0.1, 0.1), (0.9, 0.1)], kind: Shade, strength: 0.5), \
             (points: [(0.1, 0.5), (0.9, 0.5)], width: (0.0005, 0.0005))])",
        );
        let texture = both.texture();
        let most = |channel: usize| texture.levels[0].chunks_exact(4).map(|texel| texel[channel]).max();
        assert_eq!(most(1), Some(128));
        assert!((10..100).contains(&most(0).unwrap_or(0)), "{:?}", most(0));
    }

    #[test]
    fn points_outside_are_cut_off_and_told() {
        let out = sheet("(strokes: [(points: [(-3.0, 0.5), (2.0, 0.5)]), (points: [(7.0, 7.0)])])");
        assert!(out.warning().is_some_and(|what| what.starts_with("3 of 3 points")));
        assert!(ink(&out.texture(), 0) > 100.0);
        assert_eq!(sheet("(strokes: [(points: [(0.0, 1.0)])])").warning(), None);
        assert_eq!(ink(&sheet("(strokes: [])").texture(), 0), 0.0);
    }

    #[test]
    fn what_is_no_stroke_is_refused_with_its_place() {
        for (text, part) in [
            ("", "a.ron:1:1"),
            ("(strokes: [(points: [])])", "`strokes[0].points` is empty"),
            ("(strokes: [(points: [(NaN, 0.0)])])", "`strokes[0].points[0]` is no place"),
            ("(strokes: [(points: [(0.0, 0.0)], width: (2.0, 0.0))])", "`strokes[0].width` is 2"),
            ("(strokes: [(points: [(0.0, 0.0)], strength: -1.0)])", "`strokes[0].strength` is -1"),
            ("(strokes: [], resolution: 1000000)", "`resolution` is 1000000"),
            ("(strokes: [(points: [(0.0, 0.0)], color: 3)])", "color"),
        ] {
            let error = LeafStrokes::parse(text, "a.ron").map(|_| ()).expect_err(text).to_string();
            assert!(error.starts_with("a.ron:") && error.contains(part), "{error}");
        }
        assert!(LeafStrokes::read(Path::new("none.strokes.ron")).is_err());
        // Hours of work are refused before they begin.
        let points: String = (0..1000).map(|index| format!("(0.5, {}),", 0.001 * f64::from(index))).collect();
        let wide =
            |resolution| format!("(resolution: {resolution}, strokes: [(points: [{points}], width: (1.0, 1.0))])");
        let error = LeafStrokes::parse(&wide(4096), "a.ron").map(|_| ()).expect_err("too much").to_string();
        assert!(error.contains("`resolution: 4096`") && error.contains("write fewer points"), "{error}");
        assert!(LeafStrokes::parse(&wide(64), "a.ron").is_ok());
    }

    #[test]
    fn strokes_are_on_the_foliage_that_they_name() {
        let part = |kind, name: &str| PlantPart {
            kind,
            mesh: PlantMesh::default(),
            material: PlantMaterial { name: name.to_owned(), ..PlantMaterial::default() },
        };
        let named = sheet("(materials: [\"Yellow_Petals\"], strokes: [])");
        assert!(
            named.are_on(&part(PartKind::Foliage, "yellow_petals")) && !named.are_on(&part(PartKind::Foliage, "leaf"))
        );
        assert!(!named.are_on(&part(PartKind::Wood, "yellow_petals")));
        assert!(sheet("(strokes: [])").are_on(&part(PartKind::Foliage, "")));
    }
}
