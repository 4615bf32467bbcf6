//! Text in images, in egui's own font.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont};
use image::{Rgb, RgbImage};

use crate::app::AppError;

/// A font that writes into images.
pub struct Writer {
    font: FontRef<'static>,
}

impl Writer {
    /// The font of the program's panels.
    ///
    /// # Errors
    /// [`AppError::Render`] if it cannot be read.
    pub fn new() -> Result<Self, AppError> {
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT);
        font.map(|font| Self { font }).map_err(|error| AppError::Render(format!("the font cannot be read: {error}")))
    }

    /// Writes a line whose upper left corner is at `corner`, with letters of `size` pixels.
    pub fn write(&self, image: &mut RgbImage, corner: (f32, f32), size: f32, color: [u8; 3], line: &str) {
        let font = self.font.as_scaled(PxScale::from(size));
        let baseline = corner.1 + font.ascent();
        let mut at = corner.0;
        let mut last = None;
        for letter in line.chars() {
            let mut glyph = font.scaled_glyph(letter);
            if let Some(last) = last {
                at += font.kern(last, glyph.id);
            }
            glyph.position = ab_glyph::point(at, baseline);
            at += font.h_advance(glyph.id);
            last = Some(glyph.id);
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let bounds = outline.px_bounds();
            outline.draw(|x, y, share| {
                let (x, y) = (bounds.min.x as i64 + i64::from(x), bounds.min.y as i64 + i64::from(y));
                let inside = (0..i64::from(image.width())).contains(&x) && (0..i64::from(image.height())).contains(&y);
                if inside {
                    let Rgb(under) = image.get_pixel_mut(x as u32, y as u32);
                    for (channel, wanted) in under.iter_mut().zip(color) {
                        let mixed = f32::from(*channel) + share.min(1.0) * (f32::from(wanted) - f32::from(*channel));
                        *channel = mixed.round() as u8;
                    }
                }
            });
        }
    }

    /// Width of a line in pixels.
    pub fn width(&self, size: f32, line: &str) -> f32 {
        let font = self.font.as_scaled(PxScale::from(size));
        line.chars().map(|letter| font.h_advance(font.glyph_id(letter))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_written_where_it_belongs() -> Result<(), AppError> {
        let writer = Writer::new()?;
        let mut image = RgbImage::from_pixel(120, 40, Rgb([255; 3]));
        writer.write(&mut image, (10.0, 5.0), 20.0, [0; 3], "oak 19.7 m");
        let dark: Vec<(u32, u32)> =
            image.enumerate_pixels().filter(|(_, _, pixel)| pixel.0[0] < 128).map(|(x, y, _)| (x, y)).collect();
        let end = 10.0 + writer.width(20.0, "oak 19.7 m");
        assert!(dark.len() > 100);
        assert!(dark.iter().all(|&(x, y)| x >= 9 && (x as f32) < end + 2.0 && (5..30).contains(&y)));
        // What lies outside is cut off.
        writer.write(&mut image, (110.0, -8.0), 20.0, [0; 3], "oak");
        Ok(())
    }
}
