//! Images against references: what `canopy compare` does.

mod error;
mod images;
mod report;

use std::path::{Path, PathBuf};

pub use error::CompareError;
pub use images::read as read_image;
pub use report::{COMPARE_VERSION, CompareReport, FrameComparison};
pub(in crate::app) use report::{aligned, figure};

use self::images::Images;
use super::{error::AppError, rendered_image::RenderedImage};
use crate::{
    measure::{ComparisonSettings, Mask, Picture, change, compare as compare_pictures, magma},
    progress::Progress,
};

/// What to compare, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareOptions {
    /// The image, or the folder or pattern of images, to judge.
    pub test: PathBuf,
    /// What it should look like.
    pub reference: PathBuf,
    /// Pixels per degree of the visual field, 1 to 1000.
    pub pixels_per_degree: f32,
    /// An image that is white where pixels count; `None`: all count.
    pub mask: Option<PathBuf>,
    /// The reference from the first half of its samples, to take its noise out of the contrast.
    pub half: Option<PathBuf>,
    /// Where to write the map of errors: a `.png`, or a folder for a sequence.
    pub map: Option<PathBuf>,
}

/// Compares images.
///
/// # Errors
/// [`AppError::Compare`]: files that are no images or do not fit together, a map that cannot be written.
/// [`AppError::Interrupted`].
pub fn compare(options: &CompareOptions, progress: &mut dyn Progress) -> Result<CompareReport, AppError> {
    let (test, reference) = (Images::at(&options.test)?, Images::at(&options.reference)?);
    let half = options.half.as_deref().map(Images::at).transpose()?;
    let frames = frames(options, &test, &reference, half.as_ref())?;
    let mask = options.mask.as_deref().map(read_image).transpose()?.map(|picture| Mask::of(&picture));
    let is_sequence = matches!(test, Images::Many(_));

    progress.begin("Images", frames.len() as u64);
    let mut report = CompareReport::new(options);
    let mut before: Option<(Picture, Picture)> = None;
    for frame in &frames {
        if progress.is_cancelled() {
            let (done, total) = (report.frames.len(), frames.len());
            return Err(AppError::Interrupted(format!("{done} of {total} images were compared; nothing was reported")));
        }
        let pair = (read_image(&frame.test)?, read_image(&frame.reference)?);
        let half = frame.half.as_deref().map(read_image).transpose()?;
        let settings = ComparisonSettings {
            pixels_per_degree: options.pixels_per_degree,
            mask: mask.as_ref(),
            half: half.as_ref(),
        };
        let failed = |source| {
            let (test, reference) = (frame.test.clone(), frame.reference.clone());
            CompareError::Measure { test, reference, source }
        };
        check_size(&pair, mask.as_ref(), options, frame)?;
        let compared = compare_pictures(&pair.1, &pair.0, &settings).map_err(failed)?;
        let change = match &before {
            Some((test, reference)) => Some(change([test, &pair.0], [reference, &pair.1], &settings).map_err(failed)?),
            None => None,
        };
        if let Some(out) = &options.map {
            let file = if is_sequence { out.join(format!("{}.png", frame.name)) } else { out.clone() };
            save_map(&compared.map, pair.1.size(), &file).map_err(of_map)?;
            report.maps.push(file);
        }
        report.add(&frame.name, &pair.1, compared.comparison, change);
        before = is_sequence.then_some(pair);
        progress.advance(1);
    }
    progress.end();
    Ok(report)
}

/// The error of a map: this command has no --out.
fn of_map(error: AppError) -> AppError {
    match error {
        AppError::Write { path, source } => CompareError::Map { path, source }.into(),
        other => other,
    }
}

/// The files of one comparison.
struct Frame {
    name: String,
    test: PathBuf,
    reference: PathBuf,
    half: Option<PathBuf>,
}

/// The frames of the test with their references.
fn frames(
    options: &CompareOptions,
    test: &Images,
    reference: &Images,
    half: Option<&Images>,
) -> Result<Vec<Frame>, CompareError> {
    let frames = match test {
        Images::One(file) => vec![(file.display().to_string(), file.clone())],
        Images::Many(frames) => frames.clone(),
    };
    let others = [(Some(reference), Some(&options.reference)), (half, options.half.as_ref())];
    for (images, path) in others {
        let (Some(images), Some(path)) = (images, path) else { continue };
        match (test, images) {
            (Images::One(single), Images::Many(_)) => {
                return Err(CompareError::Kinds { sequence: path.clone(), single: single.clone() });
            }
            (Images::Many(_), Images::One(single)) => {
                return Err(CompareError::Kinds { sequence: options.test.clone(), single: single.clone() });
            }
            _ => {}
        }
        let lacks = |(name, _): &&(String, PathBuf)| images.frame(name).is_none();
        let missing: Vec<String> = frames.iter().filter(lacks).map(|(name, _)| name.clone()).collect();
        if !missing.is_empty() {
            let total = frames.len();
            return Err(CompareError::Missing { test: options.test.clone(), reference: path.clone(), missing, total });
        }
    }
    let frame = |(name, file): (String, PathBuf)| {
        let half = half.and_then(|half| half.frame(&name)).map(Path::to_owned);
        Some(Frame { reference: reference.frame(&name)?.to_owned(), half, name, test: file })
    };
    Ok(frames.into_iter().filter_map(frame).collect())
}

/// A mask of another size is reported under its own name.
fn check_size(
    (test, reference): &(Picture, Picture),
    mask: Option<&Mask>,
    options: &CompareOptions,
    frame: &Frame,
) -> Result<(), CompareError> {
    let (Some(mask), Some(path)) = (mask, &options.mask) else { return Ok(()) };
    let size = (mask.width, mask.height);
    if size == reference.size() || test.size() != reference.size() {
        return Ok(());
    }
    let source = crate::measure::MeasureError::Sizes { first: size, second: reference.size() };
    Err(CompareError::Measure { test: path.clone(), reference: frame.reference.clone(), source })
}

/// Writes a map of errors in the colours of magma: black is no difference, pale yellow the largest.
///
/// # Errors
/// [`AppError::Write`].
pub fn save_map(map: &[f32], (width, height): (usize, usize), path: &Path) -> Result<(), AppError> {
    let pixels = map.iter().flat_map(|error| magma(*error)).collect();
    RenderedImage { width: width as u32, height: height as u32, pixels }.save(path, &[])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The remedy once named --out, which this command does not have.
    #[test]
    fn a_map_that_cannot_be_written_names_its_option() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let image = folder.path().join("a.png");
        image::RgbImage::new(16, 16).save(&image)?;
        let options = CompareOptions {
            test: image.clone(),
            reference: image.clone(),
            pixels_per_degree: 67.0,
            mask: None,
            half: None,
            map: Some(image.join("map.png")),
        };
        let message = compare(&options, &mut crate::progress::Silent).err().map(|error| error.to_string());
        assert!(
            message.is_some_and(|text| text.contains("map.png") && text.contains("--map") && !text.contains("--out"))
        );
        Ok(())
    }
}
