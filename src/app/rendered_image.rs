//! Rendered images on disk: PNG, with the settings that reproduce it in its text chunks.

use std::{fs::File, io::BufReader, io::Write, path::Path};

use super::{error::AppError, notes::SCENE};
use crate::files::write_whole;

/// A rendered image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderedImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// sRGB, three bytes per pixel, row by row from the top.
    pub pixels: Vec<u8>,
}

impl RenderedImage {
    /// Writes the image as PNG. `notes` are pairs of keyword (Latin-1, 1 to 79 characters) and text.
    ///
    /// The file appears whole or not at all: it is written under a temporary name in the same folder, then renamed.
    ///
    /// # Errors
    /// [`AppError::Write`].
    pub fn save(&self, path: &Path, notes: &[(&str, String)]) -> Result<(), AppError> {
        write_whole(path, |writer| self.encode(writer, notes).map_err(std::io::Error::other))
            .map_err(|source| AppError::Write { path: path.to_owned(), source })
    }

    /// Whether `path` is a finished image of this size (width and height in pixels) with exactly these notes, but for the name of the
    /// scene's file. It is decoded, so that half a file is none.
    pub fn is_stored(path: &Path, size: (u32, u32), notes: &[(&str, String)]) -> bool {
        let ordinary = std::fs::metadata(path).is_ok_and(|found| found.is_file());
        let Some(file) = ordinary.then(|| File::open(path).ok()).flatten() else { return false };
        let Ok(mut reader) = png::Decoder::new(BufReader::new(file)).read_info() else { return false };
        let info = reader.info();
        let stored = info.utf8_text.iter().map(|chunk| (chunk.keyword.as_str(), chunk.get_text().ok()));
        let wanted = notes.iter().map(|(keyword, text)| (*keyword, Some(text.clone())));
        let [stored, wanted] = [stored.collect::<Vec<_>>(), wanted.collect()].map(|mut notes| {
            notes.retain(|(keyword, _)| *keyword != SCENE);
            notes
        });
        if (info.width, info.height) != size || stored != wanted {
            return false;
        }
        let Some(bytes) = reader.output_buffer_size() else { return false };
        reader.next_frame(&mut vec![0; bytes]).is_ok() && reader.finish().is_ok()
    }

    fn encode(&self, writer: impl Write, notes: &[(&str, String)]) -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(writer, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(png::Compression::Fast);
        for (keyword, text) in notes {
            encoder.add_itxt_chunk((*keyword).to_owned(), text.clone())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_stored_with_its_size_and_notes() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.png");
        let image = RenderedImage { width: 2, height: 1, pixels: vec![7; 6] };
        let notes = [("Title", "a wood".to_owned()), ("Seed", "1".to_owned())];
        assert!(!RenderedImage::is_stored(&path, (2, 1), &notes));
        image.save(&path, &notes)?;
        assert!(RenderedImage::is_stored(&path, (2, 1), &notes));
        assert!(
            !RenderedImage::is_stored(&path, (1, 2), &notes) && !RenderedImage::is_stored(&path, (2, 1), &notes[..1])
        );
        let other = [("Title", "a wood".to_owned()), ("Seed", "2".to_owned())];
        assert!(!RenderedImage::is_stored(&path, (2, 1), &other));
        // A file that was cut off once counted as finished, since its notes come first.
        let bytes = std::fs::read(&path)?;
        for length in [bytes.len() - 1, bytes.len() - 12, bytes.len() - 20, bytes.len() / 2] {
            std::fs::write(&path, &bytes[..length])?;
            assert!(!RenderedImage::is_stored(&path, (2, 1), &notes), "{length} of {} bytes", bytes.len());
        }
        // The same scene by another path is the same scene.
        let of = |scene: &str| [("Title", "a wood".to_owned()), (SCENE, scene.to_owned())];
        image.save(&path, &of("wood.ron"))?;
        assert!(RenderedImage::is_stored(&path, (2, 1), &of("/home/me/wood.ron")));
        std::fs::write(&path, b"no image")?;
        assert!(
            !RenderedImage::is_stored(&path, (2, 1), &notes)
                && !RenderedImage::is_stored(folder.path(), (2, 1), &notes)
        );
        Ok(())
    }
}
