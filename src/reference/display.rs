//! From radiance to files and to images for a screen.
//!
//! A reference is displayed as the renderer would display the same radiance: exposure, night vision, tone curve, sRGB
//! and dithering, in the renderer's order. The renderer applies night vision to each sample before averaging; here it
//! acts on the pixel's mean, which differs only at night and at edges.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{ExtendedColorType, ImageEncoder, codecs::openexr::OpenExrEncoder};

use super::checkpoint::write_whole;
use super::error::ReferenceError;
use super::film::Film;
use crate::light::{LightState, ScotopicTint};
use crate::math::color::srgb8;

/// A tone curve as a cube of colours over the logarithm of exposed radiance, as Bevy's `BlenderFilmic` is: the twin of
/// `sample_blender_filmic_lut` in Bevy 0.19's `tonemapping_shared.wgsl`.
#[derive(Clone, Debug, PartialEq)]
pub struct ToneTable {
    size: usize,
    /// Red changes fastest.
    texels: Vec<Vec3>,
}

/// Stops below and above middle grey that the table spans.
const STOPS: (f32, f32) = (-11.0, 12.0);
const MIDDLE_GREY: f32 = 0.18;

impl ToneTable {
    /// A table of `size`³ linear display colours (2 to 256 a side), red changing fastest, then green.
    ///
    /// # Errors
    /// [`ReferenceError::ToneTable`] for another number of texels; values that are not finite count as 0.
    pub fn new(size: usize, texels: Vec<Vec3>) -> Result<Self, ReferenceError> {
        if !(2..=256).contains(&size) || texels.len() != size * size * size {
            return Err(ReferenceError::ToneTable { size, texels: texels.len() });
        }
        let finite = |texel: Vec3| if texel.is_finite() { texel } else { Vec3::ZERO };
        Ok(Self { size, texels: texels.into_iter().map(finite).collect() })
    }

    /// Linear display colour of exposed radiance: trilinear, as a GPU samples it.
    pub fn map(&self, exposed: Vec3) -> Vec3 {
        let last = (self.size - 1) as f32;
        let stop = |value: f32| {
            // Bevy's own guard against the logarithm of zero.
            let value = value.max(0.0);
            let value = if value < 3.051_757e-5 { 1.525_878e-5 + value } else { value };
            let stops = (value / MIDDLE_GREY).log2().clamp(STOPS.0, STOPS.1);
            ((stops - STOPS.0) / (STOPS.1 - STOPS.0)).clamp(0.0, 1.0) * last
        };
        let at = exposed.map(stop);
        let low = at.map(|c| (c as usize).min(self.size - 2) as f32);
        let f = at - low;
        let texel = |r: usize, g: usize, b: usize| {
            let position = |axis: usize, step: usize| low[axis] as usize + step;
            self.texels[(position(2, b) * self.size + position(1, g)) * self.size + position(0, r)]
        };
        let row = |g: usize, b: usize| texel(0, g, b).lerp(texel(1, g, b), f.x);
        let layer = |b: usize| row(0, b).lerp(row(1, b), f.y);
        layer(0).lerp(layer(1), f.z)
    }
}

/// How radiance is converted to an image for a screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayTransform<'a> {
    /// From nits to display values.
    pub exposure: f32,
    /// Night vision.
    pub night: ScotopicTint,
    /// The tone curve; without one, values brighter than white are clipped.
    pub tone: Option<&'a ToneTable>,
    /// Whether Bevy's dithering against banding is applied, at most half a code of 255.
    pub dither: bool,
}

impl<'a> DisplayTransform<'a> {
    /// The renderer's conversion for the light `state`.
    pub fn of(state: &LightState, tone: Option<&'a ToneTable>) -> Self {
        Self { exposure: state.exposure, night: state.scotopic, tone, dither: true }
    }

    /// sRGB of a pixel of this radiance in nits.
    fn code(&self, radiance: Vec3, column: u32, row: u32) -> [u8; 3] {
        let exposed = (self.night.apply(radiance) * self.exposure).min(Vec3::splat(6.0e4));
        let mut shown = self.tone.map_or(exposed, |table| table.map(exposed));
        if self.dither {
            // `screen_space_dither` of Bevy's tonemapping_shared.wgsl (Vlachos 2015), at the pixel's middle.
            let position = 171.0 * (column as f32 + 0.5) + 231.0 * (row as f32 + 0.5);
            let noise = Vec3::new(103.0, 71.0, 97.0).map(|period| (position / period).fract());
            let encoded = shown.max(Vec3::ZERO).map(|c| c.powf(1.0 / 2.2)) + (noise - 0.5) / 255.0;
            shown = encoded.max(Vec3::ZERO).map(|c| c.powf(2.2));
        }
        shown.to_array().map(srgb8)
    }
}

impl Film {
    /// The image as a screen shows it: sRGB, three bytes a pixel, row by row from the top.
    pub fn display(&self, transform: &DisplayTransform) -> Vec<u8> {
        let width = self.size().0 as usize;
        let code = |(at, radiance): (usize, Vec3)| transform.code(radiance, (at % width) as u32, (at / width) as u32);
        self.radiance().into_iter().enumerate().flat_map(code).collect()
    }

    /// Writes the mean radiance in nits (linear Rec. 709) as an OpenEXR file of three 32-bit channels.
    ///
    /// # Errors
    /// [`ReferenceError::Write`].
    pub fn save_exr(&self, path: &Path) -> Result<(), ReferenceError> {
        let (width, height) = self.size();
        let values: Vec<f32> = self.radiance().iter().flat_map(|radiance| radiance.to_array()).collect();
        let mut bytes = Cursor::new(Vec::new());
        OpenExrEncoder::new(&mut bytes)
            .write_image(bytemuck::cast_slice(&values), width, height, ExtendedColorType::Rgb32F)
            .map_err(|error| ReferenceError::Write { path: path.to_owned(), source: std::io::Error::other(error) })?;
        write_whole(path, bytes.get_ref())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table that shows each channel's position between the darkest and the brightest stop.
    fn table() -> ToneTable {
        let at = |i: usize| i as f32 / 3.0;
        let texels = (0..64).map(|i| Vec3::new(at(i % 4), at(i / 4 % 4), at(i / 16))).collect();
        ToneTable::new(4, texels).unwrap()
    }

    #[test]
    fn the_table_is_read_over_the_logarithm() {
        let table = table();
        let stops = |s: Vec3| s.map(|s| MIDDLE_GREY * s.exp2());
        for s in [Vec3::new(-11.0, 0.5, 12.0), Vec3::new(3.0, -7.0, 1.5)] {
            let expected = (s + 11.0) / 23.0;
            assert!((table.map(stops(s)) - expected).abs().max_element() < 1e-5, "{s}");
        }
        assert_eq!(table.map(Vec3::splat(1e9)), Vec3::ONE);
        for dark in [Vec3::ZERO, Vec3::splat(-1.0), Vec3::NAN] {
            assert!(table.map(dark).max_element() < 0.01, "{dark}");
        }
        assert!(ToneTable::new(4, vec![Vec3::ZERO; 63]).is_err());
        assert!(ToneTable::new(1, vec![Vec3::ZERO; 1]).is_err());
        assert!(ToneTable::new(usize::MAX, Vec::new()).is_err());
    }

    #[test]
    fn the_transform_exposes_and_the_dither_stays_within_a_code() {
        let night = ScotopicTint::for_illuminance(1e5, 0.85);
        let plain = DisplayTransform { exposure: 1e-4, night, tone: None, dither: false };
        assert_eq!(plain.code(Vec3::new(0.0, 2140.4, 1e9), 0, 0), [0, 127, 255]);
        let dithered = DisplayTransform { dither: true, ..plain };
        for column in 0..50 {
            let code = dithered.code(Vec3::splat(2140.4), column, 3);
            assert!(code.iter().all(|c| c.abs_diff(127) <= 1), "{code:?}");
        }
        assert_eq!(plain.code(Vec3::NAN, 0, 0), [0, 0, 0]);
    }
}
