//! Parses the values of command-line arguments.

use super::{Part, Selection};
use crate::{
    bake::lighting::{SunLight, implicit::ImplicitSettings},
    math::names,
    plant::LeafKind,
    scene::{Lighting, Pose, Transfer},
    style::{Palette, Paper, Style},
};

/// Why an argument is not what it should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArgumentError {
    /// Not `WIDTHxHEIGHT`.
    #[error("`{0}` is not a size (expected WIDTHxHEIGHT in pixels, each at least 1, as in 1280x720)")]
    Size(String),
    /// Not a kind of light.
    #[error("`{0}` is not a light (expected local, expressive, transfer, leaf-shader or harmonics)")]
    Lighting(String),
    /// Not a style.
    #[error("`{0}` is not a style; did you mean `{1}`? (expected photograph, watercolour, lines or toon)")]
    Style(String, &'static str),
    /// Not a palette.
    #[error("{0}")]
    Palette(String),
    /// Not a paper.
    #[error("`{0}` is not a paper; did you mean `{1}`? (expected hot-pressed, cold-pressed, rough, laid or canvas)")]
    Paper(String, &'static str),
    /// Not a kind of leaf.
    #[error("`{0}` is not a kind of leaf (expected one of {1})")]
    LeafKind(String, String),
    /// Not an exposure value.
    #[error("`{0}` is not an exposure value (expected EV at ISO 100 from -10 to 25, as in 12.5)")]
    Exposure(String),
    /// Not a number of samples.
    #[error("`{0}` is not a number of samples per pixel (expected 1, which is off, or 4)")]
    Samples(String),
    /// Not `x,y,z,yaw,pitch`.
    #[error(
        "`{0}` is not a camera (expected x,y,z,yaw,pitch: metres east, above the ground and south, then degrees, as in 0,20,0,90,-5)"
    )]
    Pose(String),
    /// A coordinate of a camera that is out of range.
    #[error("`{0}`: {1}")]
    PoseRange(String, &'static str),
    /// Not a time in seconds.
    #[error("`{0}` is not a time in seconds (expected a number from 0 up, as in 12.5s)")]
    Seconds(String),
    /// Not a piece of a sequence, or a part of samples.
    #[error("`{0}` is not one of several pieces (expected its number and how many there are, as in 2/8)")]
    Chunk(String),
    /// Not numbers of frames.
    #[error("`{0}` is not a list of frames (expected numbers and ranges, as in 10-19,30)")]
    Frames(String),
    /// Not a FLIP.
    #[error("`{0}` is not a FLIP (expected a number from 0 to 1, as in 0.05)")]
    Flip(String),
    /// Not a number of pixels per degree.
    #[error("`{0}` is not a number of pixels per degree (expected 1 to 1000, as in 67)")]
    PixelsPerDegree(String),
    /// Not a frame time.
    #[error("`{0}` is not a frame time (expected milliseconds above 0, as in 8ms)")]
    Milliseconds(String),
    /// Not a positive number.
    #[error("`{0}` is not a positive number (expected a number above 0, as in 25)")]
    Positive(String),
}

/// Reads `1280x720`: width and height in pixels, each from 1 to 4294967295 (the device's limit is checked later).
///
/// # Errors
/// [`ArgumentError::Size`].
pub fn parse_size(text: &str) -> Result<(u32, u32), ArgumentError> {
    let parts = text.trim().split_once(['x', 'X', '×']);
    let size = parts.and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    size.filter(|(width, height)| *width > 0 && *height > 0).ok_or_else(|| ArgumentError::Size(text.to_owned()))
}

/// Reads the name of a light: `local`, `expressive` or `transfer`, with all its default values, or `leaf-shader` or
/// `harmonics`: transfer with the sun by [`SunLight::LeafShader`] or [`SunLight::Harmonics`].
///
/// # Errors
/// [`ArgumentError::Lighting`].
pub fn parse_lighting(text: &str) -> Result<Lighting, ArgumentError> {
    match text.trim() {
        "local" => Ok(Lighting::Local),
        "transfer" => Ok(Lighting::Transfer(Transfer::default())),
        "leaf-shader" => Ok(Lighting::Transfer(Transfer { sun: SunLight::LeafShader, ..Transfer::default() })),
        "harmonics" => Ok(Lighting::Transfer(Transfer { sun: SunLight::Harmonics, ..Transfer::default() })),
        "expressive" => Ok(Lighting::Expressive(ImplicitSettings::default())),
        _ => Err(ArgumentError::Lighting(text.to_owned())),
    }
}

/// Reads the name of a style, with all its default values.
///
/// # Errors
/// [`ArgumentError::Style`].
pub fn parse_style(text: &str) -> Result<Style, ArgumentError> {
    let nearest = || names::nearest(text, Style::NAMES).unwrap_or_default();
    Style::named(text).ok_or_else(|| ArgumentError::Style(text.to_owned(), nearest()))
}

/// Reads the name of a palette of the program, or the path of a palette's file, which is read later.
///
/// # Errors
/// [`ArgumentError::Palette`].
pub fn parse_palette(text: &str) -> Result<String, ArgumentError> {
    if !Palette::is_file(text) {
        Palette::named(text).map_err(|error| ArgumentError::Palette(error.to_string()))?;
    }
    Ok(text.trim().to_owned())
}

/// Reads the name of a paper.
///
/// # Errors
/// [`ArgumentError::Paper`].
pub fn parse_paper(text: &str) -> Result<String, ArgumentError> {
    let nearest = || names::nearest(text, Paper::ALL.map(Paper::name)).unwrap_or_default();
    let paper = Paper::named(text).ok_or_else(|| ArgumentError::Paper(text.to_owned(), nearest()))?;
    Ok(paper.name().to_owned())
}

/// Reads the name of a kind of leaf: `thin`, `leathery`, ..., `autumn-red`.
///
/// # Errors
/// [`ArgumentError::LeafKind`].
pub fn parse_leaf_kind(text: &str) -> Result<LeafKind, ArgumentError> {
    let all = LeafKind::ALL.map(|kind| (names::words(&format!("{kind:?}"), str::to_lowercase).join("-"), kind));
    let wanted = text.trim().to_lowercase();
    let found = all.iter().find(|(name, _)| *name == wanted).map(|(_, kind)| *kind);
    found.ok_or_else(|| {
        let known = all.map(|(name, _)| name).join(", ");
        ArgumentError::LeafKind(text.to_owned(), known)
    })
}

/// Reads the number of samples per pixel: 1 or 4, which every device supports.
///
/// # Errors
/// [`ArgumentError::Samples`].
pub fn parse_samples(text: &str) -> Result<u32, ArgumentError> {
    match text.trim() {
        "1" => Ok(1),
        "4" => Ok(4),
        _ => Err(ArgumentError::Samples(text.to_owned())),
    }
}

/// Reads `x,y,z,yaw,pitch` as [`Pose`] states them: metres east, above the ground and south; degrees.
///
/// # Errors
/// [`ArgumentError::Pose`] or [`ArgumentError::PoseRange`].
pub fn parse_pose(text: &str) -> Result<Pose, ArgumentError> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let numbers = numbers.unwrap_or_default();
    let &[x, y, z, yaw, pitch] = numbers.as_slice() else { return Err(ArgumentError::Pose(text.to_owned())) };
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err(ArgumentError::Pose(text.to_owned()));
    }
    let range = |message| Err(ArgumentError::PoseRange(text.to_owned(), message));
    if !(-1e7..=1e7).contains(&x) || !(-1e7..=1e7).contains(&z) {
        return range("x and z are metres from the terrain's centre, at most 10000000 away");
    }
    if !(0.0..=1e5).contains(&y) {
        return range("y is the height above the ground in metres, 0 to 100000");
    }
    if yaw.abs() > 36_000.0 {
        return range("yaw is a compass bearing in degrees, 0 to 360");
    }
    if pitch.abs() > 90.0 {
        return range("pitch is in degrees above the horizon, -90 to 90");
    }
    Ok(Pose { position: (x, y, z), yaw, pitch })
}

/// Reads a time in seconds that is not negative, with or without an `s` behind it.
///
/// # Errors
/// [`ArgumentError::Seconds`].
pub fn parse_seconds(text: &str) -> Result<f64, ArgumentError> {
    let trimmed = text.trim();
    let number = trimmed.strip_suffix('s').unwrap_or(trimmed).trim_end().parse().ok();
    number.filter(|seconds: &f64| seconds.is_finite() && *seconds >= 0.0).ok_or(ArgumentError::Seconds(text.to_owned()))
}

/// Reads an exposure value at ISO 100, -10 to 25.
///
/// # Errors
/// [`ArgumentError::Exposure`].
pub fn parse_exposure(text: &str) -> Result<f64, ArgumentError> {
    let number = text.trim().parse().ok();
    number.filter(|ev: &f64| (-10.0..=25.0).contains(ev)).ok_or(ArgumentError::Exposure(text.to_owned()))
}

/// Reads `2/8`: the number of a piece, from 1, and how many there are. Whether it is one of them is checked with the
/// sequence.
///
/// # Errors
/// [`ArgumentError::Chunk`].
pub fn parse_chunk(text: &str) -> Result<Selection, ArgumentError> {
    parse_part(text).map(|Part { number, of }| Selection::Chunk { number, of })
}

/// Reads `2/8`: one of several parts of the samples, or of the settings of a profile. Whether it is one of them is checked where they are
/// cut ([`Part::check`]).
///
/// # Errors
/// [`ArgumentError::Chunk`].
pub fn parse_part(text: &str) -> Result<Part, ArgumentError> {
    let parts =
        text.split_once('/').and_then(|(number, of)| Some((number.trim().parse().ok()?, of.trim().parse().ok()?)));
    let part = parts.filter(|(_, of): &(u32, u32)| *of > 0);
    part.map(|(number, of)| Part { number, of }).ok_or_else(|| ArgumentError::Chunk(text.to_owned()))
}

/// Reads `10-19,30`: numbers of frames and ranges of them, both ends included.
///
/// # Errors
/// [`ArgumentError::Frames`].
pub fn parse_frames(text: &str) -> Result<Selection, ArgumentError> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let range: (u32, u32) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        (range.0 <= range.1).then_some(range)
    };
    let ranges: Option<Vec<(u32, u32)>> = text.split(',').map(range).collect();
    ranges.map(Selection::Only).ok_or_else(|| ArgumentError::Frames(text.to_owned()))
}

/// Reads a FLIP, 0 to 1.
///
/// # Errors
/// [`ArgumentError::Flip`].
pub fn parse_flip(text: &str) -> Result<f64, ArgumentError> {
    let number = text.trim().parse().ok();
    number.filter(|flip: &f64| (0.0..=1.0).contains(flip)).ok_or(ArgumentError::Flip(text.to_owned()))
}

/// Reads a number of pixels per degree of the visual field, 1 to 1000.
///
/// # Errors
/// [`ArgumentError::PixelsPerDegree`].
pub fn parse_pixels_per_degree(text: &str) -> Result<f32, ArgumentError> {
    let number = text.trim().parse().ok();
    number.filter(|number: &f32| (1.0..=1000.0).contains(number)).ok_or(ArgumentError::PixelsPerDegree(text.to_owned()))
}

/// Reads milliseconds above 0, with or without an `ms` behind them.
///
/// # Errors
/// [`ArgumentError::Milliseconds`].
pub fn parse_milliseconds(text: &str) -> Result<f64, ArgumentError> {
    let trimmed = text.trim();
    let number = trimmed.strip_suffix("ms").unwrap_or(trimmed).trim_end();
    parse_positive(number).map_err(|_| ArgumentError::Milliseconds(text.to_owned()))
}

/// Reads a finite number above 0.
///
/// # Errors
/// [`ArgumentError::Positive`].
pub fn parse_positive(text: &str) -> Result<f64, ArgumentError> {
    let number = text.trim().parse().ok();
    number.filter(|number: &f64| number.is_finite() && *number > 0.0).ok_or(ArgumentError::Positive(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("1280x720"), Ok((1280, 720)));
        assert_eq!(parse_size("1X1"), Ok((1, 1)));
        for wrong in ["0x0", "1280", "x", "-1x5", "1280x0", "99999999999x1", "1.5x2", ""] {
            assert_eq!(parse_size(wrong), Err(ArgumentError::Size(wrong.to_owned())));
        }
    }

    #[test]
    fn styles_palettes_and_papers() {
        assert_eq!(parse_style("watercolor"), parse_style("watercolour"));
        let message =
            |result: Result<String, ArgumentError>| result.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(parse_style("line").is_err_and(|error| error.to_string().contains("did you mean `lines`")));
        assert!(message(parse_palette("sepai")).contains("did you mean `sepia`") && parse_palette("mine.ron").is_ok());
        assert!(message(parse_paper("ruogh")).contains("did you mean `rough`") && parse_paper("laid").is_ok());
    }

    #[test]
    fn poses() {
        let pose = Pose { position: (-10.5, 2.0, 30.0), yaw: 270.0, pitch: -5.0 };
        assert_eq!(parse_pose("-10.5, 2, 30,270,-5"), Ok(pose));
        for wrong in ["", "1,2,3", "1,2,3,4,5,6", "a,2,3,4,5", "NaN,2,3,4,5", "inf,2,3,4,5", "1,-2,3,4,5", "1,2,3,4,91"]
        {
            assert!(parse_pose(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn seconds_and_rates() {
        assert_eq!(parse_seconds("12.5s"), Ok(12.5));
        assert_eq!(parse_seconds("0"), Ok(0.0));
        assert!(parse_seconds("-1s").is_err() && parse_seconds("inf").is_err() && parse_seconds("s").is_err());
        assert_eq!(parse_positive("25"), Ok(25.0));
        assert!(parse_positive("0").is_err() && parse_positive("NaN").is_err());
        assert_eq!((parse_milliseconds("8.5ms"), parse_milliseconds("8")), (Ok(8.5), Ok(8.0)));
        assert!(["", "ms", "8s", "0", "-1ms"].iter().all(|wrong| parse_milliseconds(wrong).is_err()));
        assert_eq!(parse_chunk("2/8"), Ok(Selection::Chunk { number: 2, of: 8 }));
        // Those that there are not were once a usage error of profiles and traces, and an error of renders.
        for (number, of) in [(2, 8), (3, 2), (0, 2)] {
            let text = format!("{number}/{of}");
            assert_eq!(parse_part(&text), Ok(Part { number, of }));
            assert_eq!(parse_chunk(&text), Ok(Selection::Chunk { number, of }));
        }
        assert_eq!(parse_frames("10-19, 30"), Ok(Selection::Only(vec![(10, 19), (30, 30)])));
        assert!(["", "1", "1/0", "a/2", "-1/2"].iter().all(|wrong| parse_chunk(wrong).is_err()));
        assert!(["", "a", "5-3", "1,,2", "1-"].iter().all(|wrong| parse_frames(wrong).is_err()));
        assert_eq!((parse_flip("0.05"), parse_pixels_per_degree("67")), (Ok(0.05), Ok(67.0)));
        assert!(parse_flip("2").is_err() && parse_flip("NaN").is_err() && parse_pixels_per_degree("0").is_err());
        assert_eq!(parse_exposure("-3.5"), Ok(-3.5));
        assert!(parse_exposure("26").is_err() && parse_exposure("NaN").is_err() && parse_exposure("").is_err());
    }
}
