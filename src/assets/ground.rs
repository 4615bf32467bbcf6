//! The ground of a scene: from a file, an image, noise, or flat.

use std::path::Path;
use std::sync::Arc;

use glam::DVec2;

use super::StageError;
use crate::{
    progress::Progress,
    render::components::GroundDrape,
    scene,
    terrain::{
        HeightField, NoiseKind, NoiseTerrain, ReadOptions, Surroundings, Terrain, read_drape, read_terrain,
        read_terrain_tiles,
    },
};

/// Builds the ground of a scene; decisions of the readers become warnings.
///
/// # Errors
/// [`StageError::Terrain`].
pub fn build_terrain(ground: &scene::Ground, progress: &mut dyn Progress) -> Result<Terrain, StageError> {
    let surroundings = Surroundings::Mirror;
    let read = |path: &Path, options: ReadOptions, progress: &mut dyn Progress| -> Result<Terrain, StageError> {
        let (terrain, warnings) = read_terrain(path, &options)?;
        for warning in warnings {
            progress.warn(&format!("{}: {warning}", path.display()));
        }
        Ok(terrain)
    };
    Ok(match ground {
        scene::Ground::File(file) => {
            let options = ReadOptions {
                crop: file.crop,
                coordinate_system: file.coordinates,
                surroundings: file.surroundings,
                ..ReadOptions::default()
            };
            let terrain = if file.tiles.is_empty() {
                read(&file.path, options, progress)?
            } else {
                let (terrain, warnings) = read_terrain_tiles(&file.files(), &options)?;
                for warning in warnings {
                    progress.warn(&format!("{} and {} tiles: {warning}", file.path.display(), file.tiles.len()));
                }
                terrain
            };
            exaggerated(terrain, file.exaggeration)?
        }
        scene::Ground::Image(image) => {
            let options = ReadOptions { image_scale: Some(image.scale()), surroundings, ..ReadOptions::default() };
            read(&image.path, options, progress)?
        }
        scene::Ground::Noise(noise) => {
            let spacing = noise.spacing_m();
            let samples = ((noise.size / spacing).round() as usize + 1).max(2);
            let field = NoiseTerrain {
                columns: samples,
                rows: samples,
                spacing: noise.size / (samples - 1) as f64,
                seed: noise.seed,
                kind: if noise.ridged { NoiseKind::Ridged } else { NoiseKind::Rolling },
                octaves: noise.octaves as usize,
                amplitude: noise.amplitude,
                wavelength: noise.wavelength,
                persistence: noise.roughness,
                base: noise.base,
            }
            .height_field()?;
            Terrain::new(field, None, surroundings)
        }
        scene::Ground::Flat(flat) => {
            let field = HeightField::new(2, 2, DVec2::splat(flat.size), vec![0.0; 4])?;
            Terrain::new(field, None, surroundings)
        }
    })
}

/// Reads the photograph over the ground of a scene; decisions of the readers become warnings.
///
/// # Errors
/// [`StageError::Terrain`].
pub fn build_drape(
    drape: &scene::Drape,
    terrain: &Terrain,
    progress: &mut dyn Progress,
) -> Result<GroundDrape, StageError> {
    let (read, warnings) = read_drape(&drape.files(), drape.coordinates, terrain)?;
    for warning in warnings {
        progress.warn(&warning.to_string());
    }
    Ok(GroundDrape { drape: Arc::new(read), brightness: drape.brightness as f32 })
}

fn exaggerated(terrain: Terrain, factor: f64) -> Result<Terrain, StageError> {
    if factor == 1.0 {
        return Ok(terrain);
    }
    let field = terrain.field();
    let heights = field.heights().iter().map(|height| (f64::from(*height) * factor) as f32).collect();
    let field = HeightField::new(field.columns(), field.rows(), field.spacing(), heights)?;
    Ok(Terrain::new(field, terrain.reference().cloned(), terrain.surroundings()))
}
