//! Images on disk: one file, or the files of a folder or a pattern.

use std::{
    collections::BTreeMap,
    io::Cursor,
    path::{Path, PathBuf},
};

use glam::Vec3;
use image::{DynamicImage, ImageFormat, ImageReader};

use super::error::CompareError;
use crate::{
    files,
    math::srgb_to_linear,
    measure::{Light, Picture},
};

/// Reads an image: a display's from PNG or JPEG (alpha has no effect), a scene's radiance from OpenEXR. What it is follows
/// from its content, not its name. Negative light, which OpenEXR can hold, counts as none.
///
/// # Errors
/// [`CompareError::Read`], [`CompareError::NotFinite`].
pub fn read(path: &Path) -> Result<Picture, CompareError> {
    let failed = |why: String| CompareError::Read { path: path.to_owned(), why };
    let bytes = files::read_ordinary(path).map_err(|error| failed(error.to_string()))?;
    let reader =
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| failed(error.to_string()))?;
    let Some(format) = reader.format() else { return Err(failed("this is not an image".to_owned())) };
    let image = reader.decode().map_err(|error| failed(error.to_string()))?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let picture = match (format, image) {
        (ImageFormat::OpenExr, image) => {
            let light = colors(&image.into_rgb32f(), |light| light);
            check_finite(path, width, &light)?;
            Picture::new(width, height, Light::Scene, light)
        }
        (
            _,
            image @ (DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_)),
        ) => Picture::from_srgb8(width, height, &image.into_rgb8()),
        (_, image) => Picture::new(width, height, Light::Display, colors(&image.into_rgb32f(), srgb_to_linear)),
    };
    picture.map_err(|error| failed(error.to_string()))
}

/// A picture takes what is not finite as black, which would look like a good match of a dark reference.
fn check_finite(path: &Path, width: usize, light: &[Vec3]) -> Result<(), CompareError> {
    let mut wrong = light.iter().enumerate().filter(|(_, pixel)| !pixel.is_finite());
    let Some((first, _)) = wrong.next() else { return Ok(()) };
    Err(CompareError::NotFinite {
        path: path.to_owned(),
        count: 1 + wrong.count(),
        total: light.len(),
        column: first % width,
        row: first / width,
    })
}

fn colors(values: &[f32], decode: fn(f32) -> f32) -> Vec<Vec3> {
    values.chunks_exact(3).map(|rgb| Vec3::new(decode(rgb[0]), decode(rgb[1]), decode(rgb[2]))).collect()
}

/// One image or a sequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Images {
    /// One file.
    One(PathBuf),
    /// Files by the name of their frame, in order.
    Many(Vec<(String, PathBuf)>),
}

impl Images {
    /// What `path` names: a folder with images, a pattern (`out/flight-*.png`), or a file.
    ///
    /// # Errors
    /// [`CompareError::NoImages`], [`CompareError::Pattern`], [`CompareError::Read`].
    pub fn at(path: &Path) -> Result<Self, CompareError> {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let (folder, pattern) = if path.is_dir() {
            (path, None)
        } else if path.is_file() || !path.to_string_lossy().contains('*') {
            return Ok(Self::One(path.to_owned()));
        } else {
            let (before, after) = name.split_once('*').ok_or_else(|| CompareError::Pattern(path.to_owned()))?;
            let folder = path.parent().unwrap_or(Path::new(""));
            if after.contains('*') || folder.to_string_lossy().contains('*') {
                return Err(CompareError::Pattern(path.to_owned()));
            }
            (
                if folder.as_os_str().is_empty() { Path::new(".") } else { folder },
                Some((before.to_owned(), after.to_owned())),
            )
        };
        let failed = |error: std::io::Error| CompareError::Read { path: folder.to_owned(), why: error.to_string() };
        let mut found: BTreeMap<(usize, String), PathBuf> = BTreeMap::new();
        for entry in std::fs::read_dir(folder).map_err(failed)? {
            let file = entry.map_err(failed)?.path();
            let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let frame = match &pattern {
                Some((before, after)) => {
                    name.strip_prefix(before).and_then(|rest| rest.strip_suffix(after)).map(str::to_owned)
                }
                None => {
                    is_image(&file).then(|| file.file_stem().map(|stem| stem.to_string_lossy().into_owned())).flatten()
                }
            };
            if let Some(frame) = frame.filter(|_| file.is_file()) {
                // Frame 10 comes after frame 9, with or without leading zeros.
                found.insert((frame.len(), frame), file);
            }
        }
        if found.is_empty() {
            return Err(CompareError::NoImages(path.to_owned()));
        }
        Ok(Self::Many(found.into_iter().map(|((_, frame), file)| (frame, file)).collect()))
    }

    /// The file of a frame; for one image that image.
    pub fn frame(&self, name: &str) -> Option<&Path> {
        match self {
            Self::One(file) => Some(file),
            Self::Many(frames) => frames.iter().find(|(frame, _)| frame == name).map(|(_, file)| file.as_path()),
        }
    }
}

fn is_image(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| ["png", "exr", "jpg", "jpeg"].iter().any(|known| ending == *known))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    #[test]
    fn images_are_read_by_their_content() -> Outcome {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        let gradient = |x: u32, y: u32| image::Rgb([(x * 40) as u8, (y * 60) as u8, 9]);
        image::RgbImage::from_fn(6, 4, gradient).save(at("a.png"))?;
        image::ImageBuffer::from_fn(6, 4, |x, y| image::Rgb(gradient(x, y).0.map(|code| u16::from(code) * 257)))
            .save(at("b.png"))?;
        let radiance = |x: u32, y: u32| image::Rgb([x as f32 * 900.0, y as f32, 0.5]);
        image::Rgb32FImage::from_fn(6, 4, radiance).save(at("c.exr"))?;
        std::fs::copy(at("c.exr"), at("d.png"))?;
        let (eight, sixteen) = (read(&at("a.png"))?, read(&at("b.png"))?);
        assert!(eight.light == Light::Display && eight.size() == (6, 4));
        assert!(eight.pixels.iter().zip(&sixteen.pixels).all(|(a, b)| a.abs_diff_eq(*b, 1e-6)));
        assert_eq!(read(&at("d.png"))?, read(&at("c.exr"))?);
        assert_eq!(read(&at("c.exr"))?.pixels[5], Vec3::new(4500.0, 0.0, 0.5));
        std::fs::write(at("e.png"), "no image")?;
        for wrong in ["e.png", "none.png", "."] {
            let message = read(&at(wrong)).map_err(|error| error.to_string());
            assert!(message.is_err_and(|message| message.contains(folder.path().to_str().unwrap())), "{wrong}");
        }
        Ok(())
    }

    /// An image of nothing but NaN once had a FLIP of 0 against a black one, and passed every limit.
    #[test]
    fn what_is_not_finite_is_refused_with_its_place_and_negative_light_is_none() -> Outcome {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.exr");
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let light = |x: u32, y: u32| if (x + 6 * y) >= 19 { [1.0, wrong, 1.0] } else { [0.5; 3] };
            image::Rgb32FImage::from_fn(6, 4, |x, y| image::Rgb(light(x, y))).save(&path)?;
            let message = read(&path).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(message.contains("a.exr: 5 of 24 pixels are not finite"), "{message}");
            assert!(message.contains("column 1 of row 3"), "{message}");
        }
        image::Rgb32FImage::from_pixel(2, 1, image::Rgb([-1.0, 2.0, 0.0])).save(&path)?;
        assert_eq!(read(&path)?.pixels, [Vec3::new(0.0, 2.0, 0.0); 2]);
        Ok(())
    }

    #[test]
    fn sequences_are_folders_and_patterns() -> Outcome {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        for name in ["f-9.png", "f-10.png", "g.txt", "f-8.exr"] {
            std::fs::write(at(name), "")?;
        }
        let names = |images: Images| match images {
            Images::Many(frames) => frames.into_iter().map(|(name, _)| name).collect(),
            Images::One(file) => vec![file.display().to_string()],
        };
        assert_eq!(names(Images::at(folder.path())?), ["f-8", "f-9", "f-10"]);
        assert_eq!(names(Images::at(&at("f-*.png"))?), ["9", "10"]);
        assert!(matches!(Images::at(&at("x-*.png")), Err(CompareError::NoImages(_))));
        assert!(matches!(Images::at(&at("*-*.png")), Err(CompareError::Pattern(_))));
        assert!(matches!(Images::at(&at("no-such.png"))?, Images::One(_)));
        Ok(())
    }
}
