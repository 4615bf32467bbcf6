//! Panels beside and above each other in one picture, each with its caption.

use image::{Rgb, RgbImage, imageops};

use super::BesideError;
use crate::app::{AppError, RenderedImage, text::Writer};

/// Colour of what separates panels.
const GAP_COLOR: Rgb<u8> = Rgb([128; 3]);
/// Rows of a panel for each pixel between two panels.
const ROWS_PER_GAP: u32 = 180;
/// Least width of a gap in pixels.
const LEAST_GAP: u32 = 2;
/// Rows of a panel for each pixel of the height of letters.
const ROWS_PER_LETTER: f32 = 22.0;
/// Least and greatest height of letters in pixels.
const LETTERS: (f32, f32) = (11.0, 72.0);
/// Share of the picture that is seen through the plate of a caption: letters are white, and what is behind them may be too.
const PLATE_CLEARNESS: f32 = 0.3;
/// Letters of a caption that are read at all.
const MOST_LETTERS: usize = 200;
/// The longest side of a picture in pixels: that of most programs that show one.
const LONGEST_SIDE: u64 = 65_535;
/// The most pixels of a picture.
const MOST_PIXELS: u64 = 1 << 28;

/// How panels of one size lie in a picture.
pub struct Sheet {
    panel: (u32, u32),
    columns: u32,
    rows: u32,
    gap: u32,
    writer: Writer,
}

impl Sheet {
    /// For `count` panels of this width and height in pixels, in rows of `columns`.
    ///
    /// # Errors
    /// [`BesideError::TooLarge`], and [`AppError::Render`] without a font.
    pub fn new(panel: (u32, u32), count: usize, columns: usize) -> Result<Self, AppError> {
        let rows = count.div_ceil(columns.max(1));
        let gap = (panel.1 / ROWS_PER_GAP).max(LEAST_GAP);
        let side = |length: u32, count: usize| {
            let (step, count) = (u64::from(length) + u64::from(gap), count as u64);
            count.saturating_mul(step).saturating_sub(gap.into())
        };
        let (width, height) = (side(panel.0, columns), side(panel.1, rows));
        if width.max(height) > LONGEST_SIDE || width.saturating_mul(height) > MOST_PIXELS {
            return Err(BesideError::TooLarge { columns, rows, width, height }.into());
        }
        Ok(Self { panel, columns: columns as u32, rows: rows as u32, gap, writer: Writer::new()? })
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> (u32, u32) {
        let side = |length: u32, count: u32| count * (length + self.gap) - self.gap;
        (side(self.panel.0, self.columns), side(self.panel.1, self.rows))
    }

    /// The picture of `panels`, row by row, each with its caption.
    pub fn join<'a>(&self, panels: impl Iterator<Item = (RenderedImage, &'a str)>) -> RenderedImage {
        let (width, height) = self.size();
        let mut whole = RgbImage::from_pixel(width, height, GAP_COLOR);
        for ((image, caption), number) in panels.zip(0u32..) {
            let Some(mut panel) = RgbImage::from_raw(image.width, image.height, image.pixels) else { continue };
            self.caption(&mut panel, caption);
            let (column, row) = (number % self.columns.max(1), number / self.columns.max(1));
            let at = |length: u32, count: u32| i64::from(count) * i64::from(length + self.gap);
            imageops::replace(&mut whole, &panel, at(self.panel.0, column), at(self.panel.1, row));
        }
        RenderedImage { width, height, pixels: whole.into_raw() }
    }

    /// Writes `text` into the upper left corner, on a dark plate.
    fn caption(&self, panel: &mut RgbImage, text: &str) {
        let size = (panel.height() as f32 / ROWS_PER_LETTER).clamp(LETTERS.0, LETTERS.1);
        let (margin, padding) = ((0.6 * size).round(), (0.4 * size).round());
        let room = panel.width() as f32 - 2.0 * (margin + padding);
        let line = self.fitting(text, size, room);
        if line.is_empty() {
            return;
        }
        let plate = (self.writer.width(size, &line).ceil() + 2.0 * padding, (size + 1.2 * padding).round());
        for y in (margin as u32)..((margin + plate.1) as u32).min(panel.height()) {
            for x in (margin as u32)..((margin + plate.0) as u32).min(panel.width()) {
                let Rgb(under) = panel.get_pixel_mut(x, y);
                *under = under.map(|channel| (PLATE_CLEARNESS * f32::from(channel)) as u8);
            }
        }
        self.writer.write(panel, (margin + padding, margin + 0.6 * padding), size, [255; 3], &line);
    }

    /// `text` as far as it fits into `room` pixels, with an ellipsis where it does not.
    fn fitting(&self, text: &str, size: f32, room: f32) -> String {
        let mut letters: Vec<char> = text.chars().take(MOST_LETTERS).collect();
        let mut line: String = letters.iter().collect();
        while !letters.is_empty() && self.writer.width(size, &line) > room {
            letters.pop();
            line = letters.iter().chain(&['…']).collect();
        }
        if letters.is_empty() { String::new() } else { line }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Outcome = Result<(), AppError>;

    fn plain((width, height): (u32, u32), color: [u8; 3]) -> RenderedImage {
        RenderedImage { width, height, pixels: color.repeat((width * height) as usize) }
    }

    fn pixel(image: &RenderedImage, x: u32, y: u32) -> [u8; 3] {
        let at = 3 * (y * image.width + x) as usize;
        [image.pixels[at], image.pixels[at + 1], image.pixels[at + 2]]
    }

    #[test]
    fn panels_lie_row_by_row_with_gaps_between_them() -> Outcome {
        let (panel, colors) = ((40, 30), [[200, 0, 0], [0, 200, 0], [0, 0, 200], [90, 90, 0], [0, 90, 90], [9, 9, 9]]);
        let sheet = Sheet::new(panel, colors.len(), 3)?;
        assert_eq!(sheet.size(), (3 * 40 + 2 * 2, 2 * 30 + 2));
        let whole = sheet.join(colors.iter().map(|color| (plain(panel, *color), "")));
        assert_eq!((whole.width, whole.height), sheet.size());
        for y in 0..whole.height {
            for x in 0..whole.width {
                let (column, row) = (x / 42, y / 32);
                let expected =
                    if x % 42 >= 40 || y % 32 >= 30 { [128; 3] } else { colors[(3 * row + column) as usize] };
                assert_eq!(pixel(&whole, x, y), expected, "{x}, {y}");
            }
        }
        Ok(())
    }

    #[test]
    fn captions_are_legible_on_dark_and_bright_and_stay_in_their_panels() -> Outcome {
        let panel = (96, 54);
        let sheet = Sheet::new(panel, 2, 2)?;
        for color in [[0; 3], [255; 3], [60, 120, 40]] {
            let panels = || [plain(panel, color), plain(panel, color)].into_iter();
            let with = sheet.join(panels().zip(["2010", "a felling with a name that is far too long"]));
            let without = sheet.join(panels().zip(["", ""]));
            let changed: Vec<(u32, u32)> = (0..with.width * with.height)
                .map(|index| (index % with.width, index / with.width))
                .filter(|&(x, y)| pixel(&with, x, y) != pixel(&without, x, y))
                .collect();
            assert!(changed.iter().all(|&(_, y)| y < 30), "in the upper part alone");
            assert!(changed.iter().all(|&(x, _)| x % 98 < 96), "not on the gap");
            assert!(changed.iter().all(|&(x, _)| !(60..=90).contains(&x)), "a short one is short");
            assert!(changed.iter().any(|&(x, _)| x >= 98), "both have one");
            // The letters are white, and the plate around them is at least four times darker in linear light.
            let levels: Vec<u8> = changed.iter().map(|&(x, y)| pixel(&with, x, y)[1]).collect();
            let brightest = levels.iter().max().copied().unwrap_or(0);
            let plate = color.map(|channel| (PLATE_CLEARNESS * f32::from(channel)) as u8)[1];
            assert!(brightest > 180 && plate <= 77, "{brightest} on {plate}");
            assert!(color == [0; 3] || levels.iter().filter(|level| **level == plate).count() > 100);
        }
        Ok(())
    }

    #[test]
    fn a_caption_without_room_is_left_out() -> Outcome {
        for panel in [(1, 1), (16, 9), (20, 400)] {
            let sheet = Sheet::new(panel, 1, 1)?;
            let image = plain(panel, [50; 3]);
            assert!(sheet.join([(image.clone(), "2010")].into_iter()) == image, "{panel:?}");
        }
        Ok(())
    }

    #[test]
    fn pictures_that_nothing_can_show_are_refused() {
        for (panel, count, columns) in [((16_384, 100), 5, 5), ((10, 16_384), 8, 2), ((16_384, 16_384), 2, 2)] {
            let error = Sheet::new(panel, count, columns).map_or_else(|error| error.to_string(), |_| String::new());
            assert!(error.contains("choose a smaller --size"), "{panel:?}: {error}");
        }
        assert!(Sheet::new((u32::MAX, u32::MAX), 2, 2).is_err());
    }
}
