//! A picture to be measured: linear light, of a display or of a scene.

use glam::Vec3;

use super::MeasureError;
use crate::math::{
    color::{LINEAR_OF_CODE, srgb8},
    luminance,
};

/// What the light of a picture is in proportion to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// What a display sends, 0 to 1: a picture in sRGB.
    Display,
    /// The radiance of a scene, 0 to any height, in any unit.
    Scene,
}

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels, at least 1.
    pub width: usize,
    /// Height in pixels, at least 1.
    pub height: usize,
    /// What its light is in proportion to.
    pub light: Light,
    /// Linear Rec. 709 colour, finite and not negative, row by row from the top.
    pub pixels: Vec<Vec3>,
}

impl Picture {
    /// A picture of linear light. What is not finite or negative in `pixels` becomes 0.
    ///
    /// # Errors
    /// [`MeasureError::Empty`] without pixels, [`MeasureError::Length`] for another number of pixels than
    /// `width * height`.
    pub fn new(width: usize, height: usize, light: Light, mut pixels: Vec<Vec3>) -> Result<Self, MeasureError> {
        if width == 0 || height == 0 {
            return Err(MeasureError::Empty);
        }
        if width.checked_mul(height) != Some(pixels.len()) {
            return Err(MeasureError::Length { width, height, pixels: pixels.len() });
        }
        for value in pixels.iter_mut().flat_map(|pixel| pixel.as_mut()) {
            *value = if value.is_finite() { value.max(0.0) } else { 0.0 };
        }
        Ok(Self { width, height, light, pixels })
    }

    /// A picture in sRGB, three bytes a pixel.
    ///
    /// # Errors
    /// Those of [`Picture::new`].
    pub fn from_srgb8(width: usize, height: usize, bytes: &[u8]) -> Result<Self, MeasureError> {
        let decode = |rgb: &[u8]| Vec3::from_array([0, 1, 2].map(|channel| LINEAR_OF_CODE[usize::from(rgb[channel])]));
        if !bytes.len().is_multiple_of(3) {
            return Err(MeasureError::Length { width, height, pixels: bytes.len() / 3 });
        }
        Self::new(width, height, Light::Display, bytes.chunks_exact(3).map(decode).collect())
    }

    /// The picture in sRGB, three bytes a pixel; light above 1 is clipped.
    pub fn to_srgb8(&self) -> Vec<u8> {
        self.pixels.iter().flat_map(|pixel| pixel.to_array().map(srgb8)).collect()
    }

    /// Luminance of each pixel.
    pub fn luminance(&self) -> Vec<f64> {
        self.pixels.iter().map(|pixel| f64::from(luminance(*pixel))).collect()
    }

    /// The means of `times`² pixels, as the picture looks from `times` as far away; a rest at the right and lower border
    /// is cut off. `None` where nothing would remain.
    pub fn averaged(&self, times: usize) -> Option<Self> {
        let times = times.max(1);
        let (width, height) = (self.width / times, self.height / times);
        if width == 0 || height == 0 {
            return None;
        }
        let mean = |index: usize| {
            let (x, y) = (index % width * times, index / width * times);
            let row = |row: usize| self.pixels[(y + row) * self.width + x..][..times].iter().sum::<Vec3>();
            (0..times).map(row).sum::<Vec3>() / (times * times) as f32
        };
        Some(Self { width, height, light: self.light, pixels: (0..width * height).map(mean).collect() })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}

/// The pixels that count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Whether a pixel counts, row by row from the top.
    pub counts: Vec<bool>,
}

impl Mask {
    /// The pixels of `picture` with a luminance of at least a half of white.
    pub fn of(picture: &Picture) -> Self {
        let counts = picture.pixels.iter().map(|pixel| luminance(*pixel) >= 0.5).collect();
        Self { width: picture.width, height: picture.height, counts }
    }

    /// Where all of `times`² pixels count.
    pub(super) fn averaged(&self, times: usize) -> Self {
        let (width, height) = (self.width / times, self.height / times);
        let all = |index: usize| {
            let (x, y) = (index % width * times, index / width * times);
            (y..y + times).all(|y| self.counts[y * self.width + x..][..times].iter().all(|counts| *counts))
        };
        Self { width, height, counts: (0..width * height).map(all).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_go_there_and_back() -> Result<(), MeasureError> {
        let bytes: Vec<u8> = (0..=255u8).flat_map(|code| [code, 255 - code, 7]).collect();
        assert_eq!(Picture::from_srgb8(64, 4, &bytes)?.to_srgb8(), bytes);
        Ok(())
    }

    #[test]
    fn what_is_no_picture_is_an_error_and_what_is_no_light_is_black() -> Result<(), MeasureError> {
        assert!(matches!(Picture::from_srgb8(0, 4, &[]), Err(MeasureError::Empty)));
        assert!(matches!(Picture::from_srgb8(2, 2, &[0; 9]), Err(MeasureError::Length { pixels: 3, .. })));
        assert!(Picture::from_srgb8(1, 1, &[0; 4]).is_err() && Picture::from_srgb8(usize::MAX, 2, &[0; 3]).is_err());
        let odd = Vec3::new(f32::NAN, -1.0, f32::INFINITY);
        assert_eq!(Picture::new(1, 1, Light::Scene, vec![odd])?.pixels, [Vec3::ZERO]);
        Ok(())
    }

    #[test]
    fn means_are_of_light() -> Result<(), MeasureError> {
        let black_and_white: Vec<u8> = (0..5 * 4).flat_map(|i| [if i % 5 % 2 == 0 { 0 } else { 255 }; 3]).collect();
        let picture = Picture::from_srgb8(5, 4, &black_and_white)?;
        let half = picture.averaged(2).ok_or(MeasureError::Empty)?;
        assert_eq!(half.size(), (2, 2));
        assert!(half.pixels.iter().all(|pixel| (pixel.x - 0.5).abs() < 1e-6));
        assert!(picture.averaged(5).is_none() && picture.averaged(0) == Some(picture.clone()));
        let mask = Mask::of(&picture);
        assert_eq!(mask.counts.iter().filter(|counts| **counts).count(), 8);
        assert_eq!(mask.averaged(2).counts, [false; 4]);
        Ok(())
    }
}
