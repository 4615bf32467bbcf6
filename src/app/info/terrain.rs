//! Terrains: files with a scale, and height images without one.

use std::path::Path;

use super::page::{Page, length, place};
use crate::{
    app::AppError,
    math::digits::grouped,
    terrain::{CoordinateSystem, GeoReference, ImageScale, ReadOptions, Terrain, Warning, read_terrain},
};

/// Samples whose slope is looked at, about.
const SLOPES: usize = 250_000;

pub(super) fn describe_file(page: &mut Page, path: &Path) -> Result<(), AppError> {
    let (terrain, warnings) = read_terrain(path, &ReadOptions::default())?;
    page.title(format!("{}: a terrain", path.display()));
    page.inset(|page| {
        describe(page, &terrain);
        let missing = warnings.iter().find_map(|warning| match warning {
            Warning::HolesFilled { filled, total } => Some((*filled, *total)),
            _ => None,
        });
        page.row(
            "no data",
            missing.map_or("in no sample".to_owned(), |(filled, total)| {
                format!(
                    "in {} of {} samples ({:.2} %), which are filled from the rim of their holes",
                    grouped(filled),
                    grouped(total),
                    100.0 * filled as f64 / total.max(1) as f64
                )
            }),
        );
        for warning in warnings.iter().filter(|warning| !matches!(warning, Warning::HolesFilled { .. })) {
            page.row("note", warning);
        }
    });
    Ok(())
}

/// A PNG has no metres: it is read as black 0 and white 1, a metre a sample, to know that it can be, and its greys.
pub(super) fn describe_image(page: &mut Page, path: &Path) -> Result<(), AppError> {
    let scale = ImageScale { spacing: 1.0, lowest: 0.0, highest: 1.0 };
    let (terrain, _) = read_terrain(path, &ReadOptions { image_scale: Some(scale), ..ReadOptions::default() })?;
    let field = terrain.field();
    let (low, high) = field.min_max();
    let grey = |share: f32| (f64::from(share) * 65535.0).round();
    page.title(format!("{}: a height image", path.display()));
    page.inset(|page| {
        page.row("samples", format!("{} x {}, 16-bit grey", field.columns(), field.rows()));
        page.row("greys", format!("{} to {} of 65535", grey(low), grey(high)));
        page.row("system", "none: an image contains neither a scale in metres nor a location on earth");
        page.row(
            "note",
            "state its scale in the scene: terrain: Image(path: \"...\", spacing: METRES BETWEEN PIXELS,\nlow: HEIGHT OF \
             BLACK, high: HEIGHT OF WHITE), and place: (latitude: ..., longitude: ...)",
        );
    });
    Ok(())
}

/// One terrain.
pub(super) fn describe(page: &mut Page, terrain: &Terrain) {
    let field = terrain.field();
    let (spacing, extent) = (field.spacing(), terrain.extent());
    page.row(
        "samples",
        format!(
            "{} x {} (west-east x north-south), {} x {} apart",
            field.columns(),
            field.rows(),
            length(spacing.x),
            length(spacing.y)
        ),
    );
    page.row("extent", format!("{} x {}", length(extent.x), length(extent.y)));
    let (low, high) = field.min_max();
    page.row("heights", format!("{low:.1} m to {high:.1} m above the datum"));
    let (mean, steepest) = slopes(terrain);
    page.row("slopes", format!("{mean:.1}° on average, {steepest:.1}° at most"));
    match terrain.reference() {
        Some(reference) => georeference(page, terrain, reference),
        None => page.row("system", "metres from the centre, without a location on earth"),
    }
}

fn georeference(page: &mut Page, terrain: &Terrain, reference: &GeoReference) {
    let system = match reference.system() {
        CoordinateSystem::Geographic => "degrees of longitude and latitude (taken as WGS84)".to_owned(),
        CoordinateSystem::Utm { zone, south } => {
            format!("UTM zone {zone} {}, metres", if south { "south" } else { "north" })
        }
        CoordinateSystem::WebMercator => "Web Mercator (EPSG:3857), its stretch undone".to_owned(),
        CoordinateSystem::Projected { epsg, metres_per_unit } => {
            let name = epsg.map_or("a projection without a number".to_owned(), |code| format!("EPSG:{code}"));
            format!("{name}, one unit is {metres_per_unit} m")
        }
        CoordinateSystem::Local => "local metres".to_owned(),
    };
    page.row("system", system);
    let half = terrain.extent() * 0.5;
    let (west_south, east_north) = (reference.to_file(-half.x, half.y), reference.to_file(half.x, -half.y));
    let digits = if reference.system() == CoordinateSystem::Geographic { 6 } else { 2 };
    page.row(
        "covers",
        format!(
            "west {:.digits$}, south {:.digits$}, east {:.digits$}, north {:.digits$}",
            west_south.x, west_south.y, east_north.x, east_north.y
        ),
    );
    match reference.latitude_longitude() {
        Some(centre) => {
            page.row("place", format!("{} (centre)", place(centre)));
            let grid = reference.grid_north().filter(|angle| angle.abs() >= 0.05);
            if let Some(angle) = grid {
                let side = if angle > 0.0 { "east" } else { "west" };
                page.row("north", format!("of the grid, {:.1}° {side} of true north: taken as north", angle.abs()));
            }
        }
        None => page.row("place", "unknown: a scene must state its latitude and longitude"),
    }
}

/// Mean and steepest slope at the samples, degrees.
fn slopes(terrain: &Terrain) -> (f64, f64) {
    let field = terrain.field();
    let step = (field.heights().len() as f64 / SLOPES as f64).sqrt().ceil().max(1.0) as usize;
    let (mut sum, mut count, mut steepest) = (0.0, 0u32, 0.0f64);
    for row in (0..field.rows()).step_by(step) {
        for column in (0..field.columns()).step_by(step) {
            let at = field.position(column, row);
            let slope = f64::from(terrain.slope(at.x, at.y)).to_degrees();
            sum += slope;
            count += 1;
            steepest = steepest.max(slope);
        }
    }
    (sum / f64::from(count.max(1)), steepest)
}
