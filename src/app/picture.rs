//! Pictures on disk: PNG with the settings that made it in its text chunks.

use std::{
    fs,
    io::{BufWriter, Write},
    path::Path,
};

use super::error::AppError;

/// A rendered picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// sRGB, three bytes a pixel, row by row from the top.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// Writes the picture as PNG. `notes` are pairs of keyword (Latin-1, 1 to 79 characters) and text.
    ///
    /// The file appears whole or not at all: it is written under a temporary name beside its place, then renamed.
    ///
    /// # Errors
    /// [`AppError::Write`].
    pub fn save(&self, path: &Path, notes: &[(&str, String)]) -> Result<(), AppError> {
        let failed = |source| AppError::Write { path: path.to_owned(), source };
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        fs::create_dir_all(folder).map_err(failed)?;
        let file = tempfile::Builder::new().prefix(".canopy-").suffix(".tmp").tempfile_in(folder).map_err(failed)?;
        let mut writer = BufWriter::new(file);
        self.encode(&mut writer, notes).map_err(|error| failed(std::io::Error::other(error)))?;
        let file = writer.into_inner().map_err(|error| failed(error.into_error()))?;
        readable_by_all(file.as_file()).map_err(failed)?;
        file.persist(path).map_err(|error| failed(error.error))?;
        Ok(())
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

/// A temporary file is its owner's alone; a picture is like any other file.
#[cfg(unix)]
fn readable_by_all(file: &fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_all(_: &fs::File) -> std::io::Result<()> {
    Ok(())
}
