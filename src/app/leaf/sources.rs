//! The material of a leaf, from an image or from a plant, with the textures that the user gives.

use std::path::Path;
use std::sync::Arc;

use image::{GrayImage, RgbaImage};

use super::LeafOptions;
use crate::{
    app::AppError,
    plant::{
        Gloss, PartKind, PlantMaterial,
        gltf::{GltfOptions, load_plant},
    },
    progress::Progress,
};

/// The material of `options`, as far as it is given.
///
/// # Errors
/// [`AppError`] for files that cannot be read.
pub fn material(options: &LeafOptions, progress: &mut dyn Progress) -> Result<PlantMaterial, AppError> {
    let mut material =
        if is_plant(&options.file) { of_plant(options, progress)? } else { of_image(options, progress)? };
    let given = &options.given;
    if let Some(path) = &given.back {
        material.leaf_textures.back = Some(Arc::new(read(path)?));
    }
    if let Some(path) = &given.transmission {
        material.set_transmission(Arc::new(read(path)?));
    }
    if let Some(path) = &given.thickness {
        material.leaf_textures.thickness = Some(Arc::new(read_grey(path)?));
    }
    if let Some(path) = &given.absorption {
        material.leaf_textures.absorption = Some(Arc::new(read_grey(path)?));
    }
    if let Some(path) = &given.bump {
        material.normal_texture = Some(Arc::new(read(path)?));
    }
    Ok(material)
}

fn is_plant(path: &Path) -> bool {
    crate::files::ends_in(path, &["glb", "gltf"])
}

fn of_image(options: &LeafOptions, progress: &mut dyn Progress) -> Result<PlantMaterial, AppError> {
    let front = read(&options.file)?;
    if front.pixels().all(|texel| texel[3] == 255) {
        let file = options.file.display();
        progress.warn(&format!("{file}: has no transparent texels, so the leaf has no outline: save it with alpha"));
    }
    Ok(PlantMaterial {
        base_color_texture: Some(Arc::new(front)),
        transmission: options.kind.transmission(),
        gloss: Gloss::LEAF,
        ..PlantMaterial::default()
    })
}

fn of_plant(options: &LeafOptions, progress: &mut dyn Progress) -> Result<PlantMaterial, AppError> {
    let gltf = GltfOptions {
        leaf: options.kind,
        foliage_materials: options.material.iter().cloned().collect(),
        ..GltfOptions::default()
    };
    let (plant, warnings) = load_plant(&options.file, &gltf)?;
    for warning in warnings {
        progress.warn(&format!("{}: {warning}", options.file.display()));
    }
    let leaves = || plant.parts.iter().filter(|part| part.kind == PartKind::Foliage);
    let named = options.material.as_ref();
    let found = leaves().find(|part| named.is_none_or(|name| part.material.name == **name));
    found.map(|part| part.material.clone()).ok_or_else(|| {
        let names: Vec<&str> = leaves().map(|part| part.material.name.as_str()).collect();
        AppError::NoLeaf { path: options.file.clone(), names: names.join(", ") }
    })
}

fn read(path: &Path) -> Result<RgbaImage, AppError> {
    Ok(open(path)?.into_rgba8())
}

fn read_grey(path: &Path) -> Result<GrayImage, AppError> {
    Ok(open(path)?.into_luma8())
}

fn open(path: &Path) -> Result<image::DynamicImage, AppError> {
    let unreadable = |what: String| AppError::LeafImage { path: path.to_owned(), what };
    let reader = image::ImageReader::open(path).map_err(|error| unreadable(error.to_string()))?;
    let reader = reader.with_guessed_format().map_err(|error| unreadable(error.to_string()))?;
    let image = reader.decode().map_err(|error| unreadable(error.to_string()))?;
    if image.width() == 0 || image.height() == 0 {
        return Err(unreadable("it has no texels".to_owned()));
    }
    Ok(image)
}
