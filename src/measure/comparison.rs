//! All that is measured of one picture against another.

use serde::{Deserialize, Serialize};

use super::{AreaError, Mask, MeasureError, Picture, Summary, by_area, flip::flip};

/// Sides of the blocks whose means are compared by FLIP, in pixels.
pub const FILTERED: [usize; 3] = [4, 8, 16];

/// What a comparison takes into account.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonSettings<'a> {
    /// Pixels per degree of the visual field, 1 to 1000.
    pub pixels_per_degree: f32,
    /// The pixels that count; `None`: all.
    pub mask: Option<&'a Mask>,
    /// The reference from the first half of its samples, so that its noise is not taken for contrast.
    pub half: Option<&'a Picture>,
}

impl Default for ComparisonSettings<'_> {
    fn default() -> Self {
        Self { pixels_per_degree: super::flip::PIXELS_PER_DEGREE, mask: None, half: None }
    }
}

/// How far a picture is from its reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Number of pixels compared.
    pub pixels: usize,
    /// FLIP of these pixels.
    pub flip: Summary,
    /// FLIP after both were averaged over blocks of [`FILTERED`] pixels; `None` where none of these fits.
    pub filtered_flip: [Option<f64>; 3],
    /// Root mean square error of linear light over the three channels, in the pictures' unit.
    pub rmse: f64,
    /// The same as a fraction of the reference's own root mean square; `None` of a black one.
    pub relative_rmse: Option<f64>,
    /// Greatest error of a channel of linear light, in the pictures' unit.
    pub greatest_error: f64,
    /// By area.
    pub area: AreaError,
}

/// A comparison and the map of its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The measures.
    pub comparison: Comparison,
    /// FLIP of each pixel, masked or not, row by row from the top.
    pub map: Vec<f32>,
}

/// Compares `test` with `reference`.
///
/// # Errors
/// [`MeasureError`]: sizes that differ, a display beside a scene, a mask without pixels.
pub fn compare(reference: &Picture, test: &Picture, settings: &ComparisonSettings) -> Result<Compared, MeasureError> {
    let same = |first: (usize, usize), second: (usize, usize)| {
        if first == second { Ok(()) } else { Err(MeasureError::Sizes { first, second }) }
    };
    same(test.size(), reference.size())?;
    if let Some(mask) = settings.mask {
        same((mask.width, mask.height), reference.size())?;
    }
    if let Some(half) = settings.half {
        same(half.size(), reference.size())?;
        if half.light != reference.light {
            return Err(MeasureError::Lights);
        }
    }
    let map = flip(reference, test, settings.pixels_per_degree)?;
    let counts = |pixel: usize| settings.mask.is_none_or(|mask| mask.counts[pixel]);
    let counted: Vec<usize> = (0..map.len()).filter(|pixel| counts(*pixel)).collect();
    let errors: Vec<f64> = counted.iter().map(|pixel| f64::from(map[*pixel])).collect();
    let flip_errors = Summary::of(&errors).ok_or(MeasureError::NoPixels)?;

    let (mut squares, mut greatest, mut own_squares) = (0.0, 0.0f64, 0.0);
    for pixel in &counted {
        let (test, reference) = (test.pixels[*pixel].as_dvec3(), reference.pixels[*pixel].as_dvec3());
        squares += (test - reference).length_squared() / 3.0;
        greatest = greatest.max((test - reference).abs().max_element());
        own_squares += reference.length_squared() / 3.0;
    }
    let count = counted.len() as f64;
    let rmse = (squares / count).sqrt();
    let mut filtered_flip = [None; 3];
    for (slot, times) in filtered_flip.iter_mut().zip(FILTERED) {
        *slot = filtered(reference, test, settings, times)?;
    }
    Ok(Compared {
        comparison: Comparison {
            pixels: counted.len(),
            flip: flip_errors,
            filtered_flip,
            rmse,
            relative_rmse: (own_squares > 0.0).then(|| (squares / own_squares).sqrt()),
            greatest_error: greatest,
            area: by_area(reference, test, settings.mask, settings.half),
        },
        map,
    })
}

/// Mean FLIP of the means of `times`² pixels.
fn filtered(
    reference: &Picture,
    test: &Picture,
    settings: &ComparisonSettings,
    times: usize,
) -> Result<Option<f64>, MeasureError> {
    let (Some(reference), Some(test)) = (reference.averaged(times), test.averaged(times)) else { return Ok(None) };
    let mask = settings.mask.map(|mask| mask.averaged(times));
    let map = flip(&reference, &test, settings.pixels_per_degree)?;
    let counts = |pixel: usize| mask.as_ref().is_none_or(|mask| mask.counts[pixel]);
    let errors: Vec<f64> = (0..map.len()).filter(|pixel| counts(*pixel)).map(|pixel| f64::from(map[pixel])).collect();
    Ok(super::statistics::mean(&errors))
}

/// How much two neighbouring frames of a sequence differ, beside how much their references do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Mean FLIP between the frame and the one before.
    pub test: f64,
    /// Mean FLIP between their references.
    pub reference: f64,
    /// The share of pixels that change by more than 0.1 beyond the change of the reference: what pops or shimmers.
    pub popping: f64,
}

impl Change {
    /// The change that the reference does not have: negative where the frames change less.
    pub fn excess(&self) -> f64 {
        self.test - self.reference
    }
}

/// FLIP beyond that of the reference at which a pixel counts as popping.
const POP: f32 = 0.1;

/// The change between two frames, `[before, now]` of the test and of the reference.
///
/// # Errors
/// Those of [`flip`](super::flip()).
pub fn change(
    test: [&Picture; 2],
    reference: [&Picture; 2],
    settings: &ComparisonSettings,
) -> Result<Change, MeasureError> {
    if test[1].size() != reference[1].size() {
        return Err(MeasureError::Sizes { first: test[1].size(), second: reference[1].size() });
    }
    let [ours, theirs] = [test, reference].map(|[before, now]| flip(before, now, settings.pixels_per_degree));
    let (ours, theirs) = (ours?, theirs?);
    let counts = |pixel: &usize| settings.mask.is_none_or(|mask| mask.counts.get(*pixel) == Some(&true));
    let counted: Vec<usize> = (0..ours.len()).filter(counts).collect();
    let mean = |map: &[f32]| counted.iter().map(|pixel| f64::from(map[*pixel])).sum::<f64>() / counted.len() as f64;
    if counted.is_empty() {
        return Err(MeasureError::NoPixels);
    }
    let pops = counted.iter().filter(|pixel| ours[**pixel] - theirs[**pixel] > POP).count();
    Ok(Change { test: mean(&ours), reference: mean(&theirs), popping: pops as f64 / counted.len() as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Light;

    fn pattern(width: usize, shift: usize, bright: u8) -> Picture {
        let pixel = |i: usize| {
            if ((i % width + shift) / 8 + i / width / 8).is_multiple_of(2) { [40, 90, 30] } else { [bright; 3] }
        };
        Picture::from_srgb8(width, 48, &(0..width * 48).flat_map(pixel).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn the_same_has_no_error_and_a_comparison_fails_where_it_should() -> Result<(), MeasureError> {
        let truth = pattern(64, 0, 200);
        let none = compare(&truth, &truth, &ComparisonSettings::default())?.comparison;
        assert!(none.flip.maximum == 0.0 && none.rmse == 0.0 && none.greatest_error == 0.0);
        assert_eq!((none.area.contrast_ratio, none.area.luminance_ratio, none.pixels), (None, Some(1.0), 64 * 48));
        let shifted = compare(&truth, &pattern(64, 4, 200), &ComparisonSettings::default())?.comparison;
        assert!(shifted.flip.mean > 0.1 && shifted.rmse > 0.1, "{shifted:?}");
        assert!(shifted.filtered_flip.iter().all(Option::is_some));
        // In blocks of 16 pixels there is as much of either.
        assert!(shifted.filtered_flip[2].unwrap() < 0.2 * shifted.flip.mean, "{shifted:?}");
        let brighter = compare(&truth, &pattern(64, 0, 255), &ComparisonSettings::default())?.comparison;
        assert!(brighter.area.luminance_ratio.unwrap() > 1.3);
        Ok(())
    }

    #[test]
    fn sizes_and_lights_must_agree_and_masks_leave_something() {
        let (wide, narrow) = (pattern(64, 0, 200), pattern(32, 0, 200));
        let error = compare(&wide, &narrow, &ComparisonSettings::default()).unwrap_err();
        assert_eq!(error.to_string(), "the sizes differ: 32x48 and 64x48 pixels");
        let scene = Picture { light: Light::Scene, ..wide.clone() };
        assert_eq!(compare(&wide, &scene, &ComparisonSettings::default()), Err(MeasureError::Lights));
        let empty = Mask { width: 64, height: 48, counts: vec![false; 64 * 48] };
        let settings = ComparisonSettings { mask: Some(&empty), ..ComparisonSettings::default() };
        assert_eq!(compare(&wide, &wide, &settings), Err(MeasureError::NoPixels));
        let near = ComparisonSettings { pixels_per_degree: f32::NAN, ..ComparisonSettings::default() };
        assert!(matches!(compare(&wide, &wide, &near), Err(MeasureError::PixelsPerDegree(_))));
    }

    #[test]
    fn a_picture_of_one_pixel_is_compared() -> Result<(), MeasureError> {
        for light in [Light::Display, Light::Scene] {
            let [black, white] = [0.0, 1.0].map(|l| Picture::new(1, 1, light, vec![glam::Vec3::splat(l)]));
            let compared = compare(&black?, &white?, &ComparisonSettings::default())?.comparison;
            assert!(compared.flip.mean > 0.0 && compared.filtered_flip == [None; 3], "{compared:?}");
        }
        Ok(())
    }

    #[test]
    fn what_pops_is_told_from_what_moves() -> Result<(), MeasureError> {
        let frames = [pattern(64, 0, 200), pattern(64, 3, 200)];
        let still = [&frames[0], &frames[0]];
        let moving = [&frames[0], &frames[1]];
        let settings = ComparisonSettings::default();
        let as_reference = change(moving, moving, &settings)?;
        assert!(as_reference.excess() == 0.0 && as_reference.popping == 0.0 && as_reference.test > 0.0);
        let pops = change(moving, still, &settings)?;
        assert!(pops.reference == 0.0 && pops.popping > 0.05 && pops.excess() > 0.0, "{pops:?}");
        Ok(())
    }
}
