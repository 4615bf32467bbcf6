//! `canopy bake`: makes all levels of detail of a plant, and shows them on a contact sheet; or bakes the plants of a scene.

mod levels;
mod of_scene;
mod sheet;
mod studio;

use std::{ops::Add, path::Path, sync::Arc, time::Instant};

pub use levels::{LevelBytes, LevelFacts, facts, mesh_bytes};
pub use of_scene::bake_scene;
pub use studio::{Side, Studio};

use self::sheet::Row;
use super::{AppError, BakeOptions, RenderedImage};
use crate::{
    bake::{
        BakeSettings, BakeSource, BakedPlant, bake_plant,
        cache::Cache,
        levels::{LevelSet, cloud::CloudSettings},
        lighting::LightingSettings,
    },
    components::Sun,
    files,
    lod::Representation,
    measure::{Cutout, LevelError},
    plant::gltf::{GltfOptions, load_plant},
    progress::Progress,
    scene::Lighting,
};

/// Pixels along a side of the sheet's images.
const CELL: u32 = 384;
/// Pixels of the full model for each of the sheet's, along a side.
const TRUTH: u32 = 4;
/// Halvings of the size in which the levels are measured too.
const HALVINGS: usize = 4;
/// How far coverage, light and contrast of a level may be from those of the full model where it is drawn.
const TOLERANCE: [f64; 3] = [0.05, 0.05, 0.15];

/// Makes all levels of the plant of `options` and writes their contact sheet.
///
/// # Errors
/// [`AppError`]; an existing file stays as it is. [`AppError::Interrupted`] where `progress` is cancelled, between images.
pub fn bake(options: &BakeOptions, progress: &mut dyn Progress) -> Result<(), AppError> {
    check_kind(&options.plant)?;
    files::check_writable(&options.out).map_err(|source| AppError::Write { path: options.out.clone(), source })?;
    let (plant, warnings) = load_plant(&options.plant, &GltfOptions::default())?;
    for warning in warnings {
        progress.warn(&format!("{}: {warning}", options.plant.display()));
    }
    let settings = BakeSettings {
        representations: LevelSet::all(),
        lighting: options.lighting.as_ref().map_or_else(LightingSettings::default, Lighting::settings),
        cloud: CloudSettings { planes: options.planes, ..CloudSettings::default() },
        ..BakeSettings::default()
    };
    let started = Instant::now();
    progress.begin("Levels of detail", 0);
    let (plant, source) = bake_plant(Arc::new(plant), &settings, Cache::of_user().as_ref());
    progress.end();
    if let BakeSource::Fresh { warning: Some(warning) } = &source {
        progress.warn(&warning.to_string());
    }
    let from = if matches!(source, BakeSource::Cache) { "read from the cache" } else { "baked" };
    progress.note(&format!("levels {from}: {:.2} s", started.elapsed().as_secs_f64()));

    let facts = facts(&plant);
    let sun = Sun::default();
    let steps = (Side::ALL.len() * (1 + facts.len() * (HALVINGS + 1))) as u64;
    progress.begin("Images", steps);
    let mut truth = Vec::with_capacity(Side::ALL.len());
    let mut studio = Studio::new(plant.clone(), CELL * TRUTH, options.adapter.as_deref(), 4)?;
    studio.show(Some(Representation::MODEL))?;
    for side in Side::ALL {
        truth.push(studio.cutout(side, &sun, 1.0)?.averaged(TRUTH as usize));
        step(progress)?;
    }
    drop(studio);
    let mut studio = Studio::new(plant.clone(), CELL, options.adapter.as_deref(), options.msaa.unwrap_or(4))?;
    let mut rows = Vec::with_capacity(facts.len());
    for facts in facts {
        rows.push(row(facts, &mut studio, &truth, &sun, progress)?);
    }
    progress.end();
    write(options, &plant, &rows)
}

fn check_kind(path: &Path) -> Result<(), AppError> {
    let known = crate::files::ends_in(path, &["glb", "gltf"]);
    if known { Ok(()) } else { Err(AppError::NoPlant { path: path.to_owned() }) }
}

fn step(progress: &mut dyn Progress) -> Result<(), AppError> {
    progress.advance(1);
    if progress.is_cancelled() {
        return Err(AppError::Interrupted(
            "the contact sheet was not written; its levels stay in the cache".to_owned(),
        ));
    }
    Ok(())
}

/// The images and errors of one level.
fn row(
    facts: LevelFacts,
    studio: &mut Studio,
    truth: &[Cutout],
    sun: &Sun,
    progress: &mut dyn Progress,
) -> Result<Row, AppError> {
    studio.show(Some(facts.representation))?;
    let (mut sides, mut small, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for halving in 0..=HALVINGS {
        let zoom = 1usize << halving;
        let size = CELL as usize / zoom;
        let mut of_sides = Vec::with_capacity(truth.len());
        for (side, truth) in Side::ALL.into_iter().zip(truth) {
            let image = studio.cutout(side, sun, zoom as f64)?.middle(size, size);
            of_sides.push(image.error(&truth.averaged(zoom)));
            match (halving, side) {
                (0, _) => sides.push(image),
                (_, Side::South) => small.push(image),
                _ => {}
            }
            step(progress)?;
        }
        errors.push((size, LevelError::mean(&of_sides)));
    }
    Ok(Row { facts, sides, small, errors })
}

fn write(options: &BakeOptions, plant: &BakedPlant, rows: &[Row]) -> Result<(), AppError> {
    let name = options.plant.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let size = plant.size();
    let subtitle = format!(
        "{:.1} m high, {:.1} m wide; sun high in the south",
        size.height,
        plant.plant.bounds().map_or(0.0, |bounds| bounds.size().x.max(bounds.size().z))
    );
    let total = rows.iter().skip(1).map(|row| row.facts.bytes).fold(LevelBytes::default(), Add::add);
    let chosen = format!("{}.   All levels behind the model: {total}", chosen(rows));
    let legend = "error: root mean square of linear light, relative to the full model's mean; cover, light, contrast: \
                  area, mean luminance and deviation in 8 × 8 pixels as fractions of the full model's with 64 samples a \
                  pixel; mean of the five sides";
    let sheet = sheet::draw(rows, CELL, &name, &subtitle, [&chosen, legend])?;
    let image = RenderedImage { width: sheet.width(), height: sheet.height(), pixels: sheet.into_raw() };
    image.save(&options.out, &[("Title", name), ("Software", format!("canopy {}", env!("CARGO_PKG_VERSION")))])
}

/// For each size the level with the fewest triangles that is near enough to the model, in words.
fn chosen(rows: &[Row]) -> String {
    let near = |error: &LevelError| {
        let distances = [error.coverage, error.luminance, error.contrast].map(|ratio| (ratio - 1.0).abs());
        distances.iter().zip(TOLERANCE).all(|(distance, tolerance)| *distance <= tolerance)
    };
    let sizes = rows.first().map_or(&[][..], |row| row.errors.as_slice());
    let choice = |(index, (size, _)): (usize, &(usize, LevelError))| {
        let fits = |row: &&Row| row.errors.get(index).is_some_and(|(_, error)| near(error));
        let best = rows.iter().filter(fits).min_by_key(|row| row.facts.triangles).or(rows.first());
        format!("{size} px {}", best.map_or("", |row| row.facts.representation.name()))
    };
    let list: Vec<String> = sizes.iter().enumerate().map(choice).collect();
    format!("Fewest triangles within 5 % of cover and light and 15 % of contrast: {}", list.join(", "))
}
