//! Scenes: all that they refer to, read and built as for drawing, short of the bakes and the graphics device.

use std::{ops::Range, path::Path};

use super::{
    inventory,
    page::{Page, length, place},
    plant, terrain,
};
use crate::{
    app::AppError,
    assets::{
        ground::{build_drape, build_terrain},
        plants,
        stage::observer,
        trees::{StandPlan, WoodBeyond},
    },
    bake::plant_size,
    light::sun::{Observer, SunPosition},
    math::digits::grouped,
    plant::{PartKind, Plant, grow::GrowParameters},
    progress::Progress,
    scatter::{FIRST_SURROUNDING_INDEX, Inventory, PlantSize, Stand},
    scene::{self, PlantSource, Scene, Species, Trees},
    terrain::{Drape, Terrain},
};

/// A scene; or the rules of a grown species, which are RON too.
pub(super) fn describe_file(page: &mut Page, path: &Path) -> Result<(), AppError> {
    let scene = match Scene::read(path) {
        Ok(scene) => scene,
        Err(error) => {
            // A pipe was read to its end.
            let species = if super::is_pipe(path) { None } else { grown_species(path) };
            return match species {
                Some(species) => {
                    describe_species_file(page, path, &species);
                    Ok(())
                }
                None => Err(error.into()),
            };
        }
    };
    describe(page, &scene, path)
}

fn grown_species(path: &Path) -> Option<GrowParameters> {
    std::fs::read_to_string(path).ok().and_then(|text| GrowParameters::from_ron(&text).ok())
}

fn describe_species_file(page: &mut Page, path: &Path, species: &GrowParameters) {
    page.title(format!("{}: rules of a grown species", path.display()));
    page.inset(|page| {
        page.row("name", &species.name);
        page.row("height", format!("{:.1} m ± {:.1} m", species.height, species.height_variation));
        page.row("used by", "a scene's species: plant: Grown(form: File(\"...\"))");
    });
}

fn describe(page: &mut Page, scene: &Scene, path: &Path) -> Result<(), AppError> {
    let mut heard = Heard::default();
    let ground = build_terrain(&scene.terrain, &mut heard)?;
    let drape = scene.drape.as_ref().map(|drape| build_drape(drape, &ground, &mut heard)).transpose()?;
    let observer = observer(scene, &ground)?;
    let plan = plants::plan(scene)?;
    let mut individuals = Vec::with_capacity(plan.individuals.len());
    for individual in &plan.individuals {
        let (plant, warnings) = individual.build()?;
        heard.warnings.extend(warnings);
        individuals.push(plant);
    }
    let sizes: Vec<PlantSize> = individuals.iter().map(plant_size).collect();
    let mut planned = StandPlan::new(scene, &ground, WoodBeyond::Grows)?;
    planned.fit_surroundings(None);
    let surroundings = planned.surroundings();
    let stand = planned.build(&plan, &sizes, &mut heard)?;

    page.title(format!("{}: a scene", path.display()));
    page.inset(|page| {
        page.row("name", &scene.name);
        page.row("seed", scene.seed);
        describe_ground(page, scene, &ground);
        if let (Some(stated), Some(drape)) = (&scene.drape, &drape) {
            describe_drape(page, stated, &drape.drape, &ground);
        }
        for (species, variants) in scene.species.iter().zip(&plan.variants) {
            describe_species(page, species, variants, &individuals);
        }
        describe_trees(page, scene, &plan.variants, (&stand, surroundings), planned.inventory(), &heard.notes);
        describe_place(page, scene, &observer)?;
        describe_camera(page, scene);
        describe_quality(page, scene);
        for warning in &heard.warnings {
            page.row("note", warning);
        }
        Ok(())
    })
}

/// Keeps what a reader says.
#[derive(Default)]
struct Heard {
    warnings: Vec<String>,
    notes: Vec<String>,
}

impl Progress for Heard {
    fn begin(&mut self, _: &str, _: u64) {}

    fn advance(&mut self, _: u64) {}

    fn end(&mut self) {}

    fn warn(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
    }

    fn note(&mut self, message: &str) {
        self.notes.push(message.to_owned());
    }
}

fn describe_ground(page: &mut Page, scene: &Scene, ground: &Terrain) {
    let source = match &scene.terrain {
        scene::Ground::File(file) => format!("the file {}", file.path.display()),
        scene::Ground::Image(image) => format!("the image {}", image.path.display()),
        scene::Ground::Noise(noise) => format!("noise of seed {}", noise.seed),
        scene::Ground::Flat(_) => "a plane".to_owned(),
    };
    page.row("terrain", source);
    page.inset(|page| terrain::describe(page, ground));
}

fn describe_drape(page: &mut Page, stated: &scene::Drape, drape: &Drape, ground: &Terrain) {
    let tiles = match stated.tiles.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    page.row("photograph", format!("{}{tiles}", stated.path.display()));
    page.inset(|page| {
        let ((columns, rows), extent) = (drape.size(), drape.extent());
        page.row("texels", format!("{columns} x {rows} of {:.2} m", drape.texel()));
        let whole = ground.extent();
        let share = (extent.min(whole) / whole).element_product().min(1.0);
        page.row(
            "covers",
            format!("{} x {}, {:.0} % of the terrain", length(extent.x), length(extent.y), 100.0 * share),
        );
        if drape.is_mirrored() {
            page.row("beyond", "mirrored, as the terrain is");
        }
    });
}

fn describe_species(page: &mut Page, species: &Species, variants: &Range<u16>, individuals: &[Plant]) {
    let (low, high) = species.height;
    page.row(
        "species",
        format!("{}: weight {}, {} to {} high", species.name, species.weight, length(low), length(high)),
    );
    page.inset(|page| {
        let plants: Vec<&Plant> =
            variants.clone().filter_map(|variant| individuals.get(usize::from(variant))).collect();
        match &species.plant {
            PlantSource::Grown(grown) => {
                let triangles = |kind: PartKind| {
                    let counts = plants.iter().map(|plant| plant.triangle_count(kind));
                    let (low, high) = counts.fold((usize::MAX, 0), |(low, high), n| (low.min(n), high.max(n)));
                    match low.cmp(&high) {
                        std::cmp::Ordering::Less => format!("{} to {}", grouped(low), grouped(high)),
                        _ => grouped(high),
                    }
                };
                page.row("individuals", format!("{} grown by rule, seed {} and on", plants.len(), grown.seed));
                page.row(
                    "triangles",
                    format!("{} of wood, {} of foliage each", triangles(PartKind::Wood), triangles(PartKind::Foliage)),
                );
            }
            PlantSource::Gltf(files) => {
                for (file, plant) in files.files.iter().zip(plants) {
                    page.row("individual", file.display());
                    page.inset(|page| plant::describe(page, plant, &[]));
                }
            }
        }
    });
}

fn describe_trees(
    page: &mut Page,
    scene: &Scene,
    variants: &[Range<u16>],
    (stand, surroundings): (&Stand, f64),
    inventory: Option<&Inventory>,
    notes: &[String],
) {
    let beyond = stand.trees.iter().filter(|tree| tree.index >= FIRST_SURROUNDING_INDEX).count();
    let inside = stand.trees.len() - beyond;
    match &scene.trees {
        Trees::None => {
            page.row("trees", "none");
            return;
        }
        Trees::Scattered(rules) => page.row(
            "trees",
            format!(
                "{} scattered by {:?}: {} stems per hectare requested, at least {} apart",
                grouped(inside),
                rules.sequence,
                rules.stems_per_hectare,
                length(rules.min_distance)
            ),
        ),
        Trees::Inventory(file) => {
            page.row("trees", format!("{} from the inventory {}", grouped(stand.trees.len()), file.path.display()));
        }
    }
    page.inset(|page| {
        if surroundings > 0.0 {
            page.row(
                "around them",
                format!("{} more, to {} beyond the terrain's data", grouped(beyond), length(surroundings)),
            );
        }
        for note in notes {
            page.row("density", note);
        }
        for (species, variants) in scene.species.iter().zip(variants) {
            let count = stand.trees.iter().filter(|tree| variants.contains(&tree.variant)).count();
            page.row("of species", format!("{}: {}", species.name, grouped(count)));
        }
        if let Some(inventory) = inventory {
            inventory::describe(page, inventory);
        }
    });
}

fn describe_place(page: &mut Page, scene: &Scene, observer: &Observer) -> Result<(), AppError> {
    page.row("place", place((observer.latitude_deg, observer.longitude_deg)));
    let sun = SunPosition::at(scene.place.time.utc(), observer)?;
    page.row(
        "time",
        format!(
            "{}: the sun is {:.1}° above the horizon, bearing {:.1}°",
            scene.place.time,
            sun.elevation.to_degrees(),
            sun.azimuth.to_degrees()
        ),
    );
    page.row("air", format!("visibility {}, moon {:?}", length(scene.place.visibility), scene.place.moon));
    Ok(())
}

fn describe_camera(page: &mut Page, scene: &Scene) {
    let (x, y, z) = scene.camera.start.position;
    let start = &scene.camera.start;
    page.row(
        "camera",
        format!(
            "{x} m east, {y} m above the ground, {z} m south; bearing {}°, pitch {}°, field of view {}°",
            start.yaw, start.pitch, scene.camera.field_of_view
        ),
    );
    match scene::Path::new(&scene.camera.path) {
        Some(path) => {
            page.row("flight", format!("{} keys from {} s to {} s", scene.camera.path.len(), path.start(), path.end()))
        }
        None => page.row("flight", "none"),
    }
}

fn describe_quality(page: &mut Page, scene: &Scene) {
    let quality = &scene.quality;
    page.row(
        "quality",
        format!(
            "full models to {}{}, billboards from there to {}; {} cascades of {} texels to {}; {} samples per pixel",
            length(quality.nearest_level_end()),
            if quality.tolerance.is_some() { " (in images of 1080 rows)" } else { "" },
            length(quality.view_distance),
            quality.cascades,
            quality.shadow_map_size,
            length(quality.shadow_distance),
            quality.msaa
        ),
    );
}
