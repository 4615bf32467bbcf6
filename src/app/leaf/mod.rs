//! `canopy leaf`: the textures of a leaf, those that are missing derived from the others, and a sheet that shows it in the
//! light [Franzke 2005, 3.2.2, figure 3.8].

mod document;
mod sheet;
mod sources;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{DynamicImage, GrayImage, RgbaImage};

use super::{AppError, RenderedImage};
use crate::{
    files,
    plant::{
        LeafKind, LeafTissue, PlantMaterial,
        leaf_textures::{self, Derivation, Sign},
    },
    progress::Progress,
};

/// Everything about the textures of a leaf.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafOptions {
    /// The front, an image with the outline in its alpha; or a plant (.glb, .gltf), of which the first material of foliage is
    /// taken, or that which `material` names.
    pub file: PathBuf,
    /// The folder to write to.
    pub out: PathBuf,
    /// The material of a plant's file.
    pub material: Option<String>,
    /// Images of the back, of the light that comes through, of thickness, absorption and normals; each takes the place of what
    /// the file says.
    pub given: LeafImages,
    /// What decides how much light comes through where no texture says so.
    pub kind: LeafKind,
    /// Thickness in metres where the texture is 1; `None` is that of the file, or the usual one.
    pub max_thickness: Option<f32>,
    /// Width of the leaf on the sheet, metres.
    pub width: f32,
    /// Whether the absorption is derived as the thesis prints it: bright absorbs.
    pub published: bool,
    /// Blur of the high-pass filter on a derived thickness, as a fraction of the texture's longer side; `None`: no filter.
    pub high_pass: Option<f32>,
    /// Samples per pixel of the sheet's images, at least 1.
    pub samples: u32,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
}

/// Files with the textures of a leaf.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeafImages {
    /// What the back reflects.
    pub back: Option<PathBuf>,
    /// What comes through.
    pub transmission: Option<PathBuf>,
    /// Thickness, 0..1.
    pub thickness: Option<PathBuf>,
    /// Absorption, 0..1.
    pub absorption: Option<PathBuf>,
    /// Tangent-space normals.
    pub bump: Option<PathBuf>,
}

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeafReport {
    /// Where each texture comes from, a line each.
    pub lines: Vec<String>,
    /// The files.
    pub files: Vec<PathBuf>,
}

/// Height of the bump that is derived from the front, over the width of its texture.
const BUMP: f32 = 0.01;

/// Writes the textures of a leaf, a plant of one leaf that has them (`leaf.gltf`), and a sheet (`sheet.png`).
///
/// # Errors
/// [`AppError`] for files that cannot be read or written; [`AppError::Interrupted`] where `progress` is cancelled.
pub fn leaf(options: &LeafOptions, progress: &mut dyn Progress) -> Result<LeafReport, AppError> {
    std::fs::create_dir_all(&options.out).map_err(|source| AppError::Write { path: options.out.clone(), source })?;
    let mut material = sources::material(options, progress)?;
    let mut report = LeafReport::default();
    complete(&mut material, options, &mut report.lines);

    let mut names = Vec::new();
    for (name, image) in textures(&material) {
        let Some(image) = image else { continue };
        let path = options.out.join(format!("{name}.png"));
        write_image(&path, &image)?;
        names.push(name);
        report.files.push(path);
    }
    let shape =
        material.base_color_texture.as_ref().map_or(1.0, |image| image.height() as f32 / image.width().max(1) as f32);
    let path = options.out.join("leaf.gltf");
    let (text, buffer) = document::document(&material, &names, [options.width, options.width * shape]);
    let beside = options.out.join(document::BUFFER);
    write(&beside, &buffer)?;
    write(&path, text.as_bytes())?;
    report.files.extend([beside, path]);

    let sheet = sheet::draw(&material, options, shape, &report.lines, progress)?;
    let path = options.out.join("sheet.png");
    let title = options.file.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let image = RenderedImage { width: sheet.width(), height: sheet.height(), pixels: sheet.into_raw() };
    image.save(&path, &[("Title", title), ("Software", format!("canopy {}", env!("CARGO_PKG_VERSION")))])?;
    report.files.push(path);
    Ok(report)
}

/// The textures of a leaf by the names of their files.
fn textures(material: &PlantMaterial) -> [(&'static str, Option<DynamicImage>); 6] {
    let color =
        |image: &Option<Arc<RgbaImage>>| image.as_ref().map(|image| DynamicImage::ImageRgba8((**image).clone()));
    let grey = |image: &Option<Arc<GrayImage>>| image.as_ref().map(|image| DynamicImage::ImageLuma8((**image).clone()));
    let textures = &material.leaf_textures;
    [
        ("front", color(&material.base_color_texture)),
        ("back", color(&textures.back)),
        ("transmission", color(&textures.transmission)),
        ("thickness", grey(&textures.thickness)),
        ("absorption", grey(&textures.absorption)),
        ("bump", color(&material.normal_texture)),
    ]
}

/// Derives what is missing; `lines` say so.
fn complete(material: &mut PlantMaterial, options: &LeafOptions, lines: &mut Vec<String>) {
    let sign = if options.published { Sign::Published } else { Sign::Dark };
    let derivation = Derivation { sign, high_pass: options.high_pass };
    let mut from = |name: &str, given: bool, source: &str| {
        lines.push(format!("{name}: {}", if given { "given" } else { source }));
    };
    from("front", material.base_color_texture.is_some(), "one colour, without an outline");
    from("back", material.leaf_textures.back.is_some(), "guessed: the front, paler by 0.3 of its luminance");
    let kind = format!("derived from the front for a {} leaf", format!("{:?}", options.kind).to_lowercase());
    from("transmission", material.leaf_textures.transmission.is_some(), &kind);
    let from_transmission = "derived from the transmission: dark is thick";
    from("thickness", material.leaf_textures.thickness.is_some(), from_transmission);
    let absorbing = match sign {
        Sign::Dark => "derived from the transmission: dark absorbs",
        Sign::Published => "derived from the transmission: bright absorbs, as published",
    };
    from("absorption", material.leaf_textures.absorption.is_some(), absorbing);
    from("bump", material.normal_texture.is_some(), "derived from the front: bright is high");

    if material.leaf_textures.back.is_none() {
        material.leaf_textures.back = leaf_textures::back_of(material).map(Arc::new);
    }
    if material.normal_texture.is_none() {
        material.normal_texture = leaf_textures::bump_of(material, BUMP).map(Arc::new);
    }
    let given = material.leaf_textures.measured();
    if material.leaf_textures.transmission.is_none() {
        material.leaf_textures.transmission = leaf_textures::transmission_of(material).map(Arc::new);
    }
    if let Some([thickness, absorption]) = leaf_textures::thickness_and_absorption(material, derivation) {
        material.leaf_textures.thickness.get_or_insert_with(|| Arc::new(thickness));
        material.leaf_textures.absorption.get_or_insert_with(|| Arc::new(absorption));
    }
    let tissue = material.tissue.unwrap_or(LeafTissue { measured: given, ..LeafTissue::default() });
    let max_thickness = options.max_thickness.unwrap_or(tissue.max_thickness);
    material.tissue = Some(LeafTissue { max_thickness, ..tissue }.sanitized());
}

fn write_image(path: &Path, image: &DynamicImage) -> Result<(), AppError> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| AppError::Write { path: path.to_owned(), source: std::io::Error::other(error) })?;
    write(path, bytes.get_ref())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), AppError> {
    files::write_whole(path, |writer| writer.write_all(bytes))
        .map_err(|source| AppError::Write { path: path.to_owned(), source })
}
