//! The contact sheet: a row for each level of detail, a column for each side.

use glam::Vec3;
use image::{Rgb, RgbImage};

use super::{levels::LevelFacts, studio::Side};
use crate::{
    app::{AppError, text::Writer},
    math::{digits::grouped, linear_to_srgb},
    measure::{Cutout, LevelError},
};

/// A level as the sheet shows it.
pub struct Row {
    /// What it is made of.
    pub facts: LevelFacts,
    /// Its images, one for each of [`Side::ALL`].
    pub sides: Vec<Cutout>,
    /// The first side in smaller sizes.
    pub small: Vec<Cutout>,
    /// Size in pixels and mean error over all sides.
    pub errors: Vec<(usize, LevelError)>,
}

/// Pixels between images.
const GAP: u32 = 12;
/// Width of the column of text.
const TEXT: u32 = 330;
/// Height of the title.
const TITLE: u32 = 104;
/// Height of the last lines.
const FOOT: u32 = 76;
/// Linear light of the paper behind the trees.
const PAPER: Vec3 = Vec3::new(0.80, 0.84, 0.88);
/// Mean linear luminance that the full model is shown with.
const SHOWN: f64 = 0.13;
const INK: [u8; 3] = [32, 38, 44];
const FAINT: [u8; 3] = [96, 104, 112];

/// Draws the sheet. `cell` are the pixels along a side of the images; `title` and `subtitle` name the plant; `chosen`
/// is its last line.
///
/// # Errors
/// [`AppError::Render`] if the font cannot be read.
pub fn draw(rows: &[Row], cell: u32, title: &str, subtitle: &str, foot: [&str; 2]) -> Result<RgbImage, AppError> {
    let writer = Writer::new()?;
    let sides = Side::ALL.len() as u32;
    let small = cell / 2;
    let width = GAP + TEXT + sides * (cell + GAP) + small + 2 * GAP;
    let height = TITLE + rows.len() as u32 * (cell + GAP) + FOOT;
    let mut sheet = RgbImage::from_pixel(width, height, Rgb([244, 246, 248]));
    writer.write(&mut sheet, (2.0 * GAP as f32, 16.0), 40.0, INK, title);
    writer.write(&mut sheet, (2.0 * GAP as f32, 62.0), 22.0, FAINT, subtitle);
    for (column, side) in Side::ALL.iter().enumerate() {
        let left = GAP + TEXT + column as u32 * (cell + GAP);
        centred(&writer, &mut sheet, (left, cell), 66.0, side.name());
    }
    centred(&writer, &mut sheet, (GAP + TEXT + sides * (cell + GAP), small), 66.0, "as far trees");
    let light = rows.first().and_then(|row| row.sides.first()).map_or(0.0, Cutout::mean_luminance);
    let scale = if light > 0.0 { (SHOWN / light) as f32 } else { 1.0 };
    for (index, row) in rows.iter().enumerate() {
        let top = TITLE + index as u32 * (cell + GAP);
        write_facts(&writer, &mut sheet, top, row);
        for (column, image) in row.sides.iter().enumerate() {
            let left = GAP + TEXT + column as u32 * (cell + GAP);
            paper(&mut sheet, (left, top), (cell, cell));
            place(&mut sheet, (left, top), image, scale);
        }
        let left = GAP + TEXT + sides * (cell + GAP);
        paper(&mut sheet, (left, top), (small, cell));
        let mut at = top;
        for image in &row.small {
            let inset = small.saturating_sub(image.width as u32) / 2;
            place(&mut sheet, (left + inset, at), image, scale);
            at += image.height as u32;
        }
    }
    let bottom = height - FOOT;
    writer.write(&mut sheet, (2.0 * GAP as f32, bottom as f32 + 4.0), 21.0, INK, foot[0]);
    writer.write(&mut sheet, (2.0 * GAP as f32, bottom as f32 + 34.0), 18.0, FAINT, foot[1]);
    Ok(sheet)
}

fn centred(writer: &Writer, sheet: &mut RgbImage, (left, width): (u32, u32), top: f32, line: &str) {
    let start = left as f32 + 0.5 * (width as f32 - writer.width(20.0, line));
    writer.write(sheet, (start, top), 20.0, FAINT, line);
}

fn write_facts(writer: &Writer, sheet: &mut RgbImage, top: u32, row: &Row) {
    let left = 2.0 * GAP as f32;
    let mut y = top as f32 + 4.0;
    let facts = &row.facts;
    writer.write(sheet, (left, y), 28.0, INK, facts.title);
    y += 38.0;
    let mut line = |text: &str, color: [u8; 3]| {
        writer.write(sheet, (left, y), 19.0, color, text);
        y += 24.0;
    };
    line(&format!("{} triangles, {}", grouped(facts.triangles), facts.bytes), INK);
    if let Some(deviation) = facts.deviation.filter(|deviation| *deviation > 0.0) {
        line(&format!("deviation {deviation:.2} m"), INK);
    }
    for note in &facts.notes {
        line(note, FAINT);
    }
    y += 8.0;
    writer.write(sheet, (left, y), 16.0, FAINT, "pixels   error   cover   light   contrast");
    y += 21.0;
    for (size, error) in &row.errors {
        let values = [
            (0.0, size.to_string()),
            (58.0, format!("{:.2}", error.rmse)),
            (108.0, format!("{:.2}", error.coverage)),
            (160.0, format!("{:.2}", error.luminance)),
            (212.0, format!("{:.2}", error.contrast)),
        ];
        for (offset, value) in values {
            writer.write(sheet, (left + offset, y), 17.0, INK, &value);
        }
        y += 21.0;
    }
}

fn paper(sheet: &mut RgbImage, (left, top): (u32, u32), (width, height): (u32, u32)) {
    let color = code(PAPER);
    for y in top..(top + height).min(sheet.height()) {
        for x in left..(left + width).min(sheet.width()) {
            sheet.put_pixel(x, y, color);
        }
    }
}

fn place(sheet: &mut RgbImage, (left, top): (u32, u32), image: &Cutout, scale: f32) {
    for (index, pixel) in image.pixels.iter().enumerate() {
        let (x, y) = (left + (index % image.width) as u32, top + (index / image.width) as u32);
        if x < sheet.width() && y < sheet.height() {
            sheet.put_pixel(x, y, code(scale * pixel.truncate() + (1.0 - pixel.w) * PAPER));
        }
    }
}

fn code(linear: Vec3) -> Rgb<u8> {
    Rgb(linear.to_array().map(|value| (255.0 * linear_to_srgb(value.clamp(0.0, 1.0))).round() as u8))
}
