//! From the coordinates of an inventory to positions on the terrain.

use glam::{DVec2, DVec3};

use super::StageError;
use crate::{
    scatter::{Area, Coordinates, Inventory, InventoryOptions, read_inventory},
    scene::{Anchor, InventoryTrees, Scene},
    terrain::{CoordinateSystem, GeoReference, SystemMap, Terrain},
};

/// How coordinates become positions.
#[derive(Debug)]
pub struct Placement {
    map: Map,
    /// What had to be assumed.
    pub note: Option<String>,
}

#[derive(Debug)]
enum Map {
    /// Metres from this point of the file.
    Metres { origin: DVec2 },
    /// Degrees, laid out flat around this reference.
    Degrees(GeoReference),
    /// The terrain file's own coordinates.
    File,
    /// Coordinates of another system than the terrain's.
    Across { from: SystemMap, to: SystemMap },
}

/// Reads the inventory of a scene: of a table with two kinds of positions the one that fits the terrain.
///
/// # Errors
/// Those of [`read_inventory`] and [`StageError::NoReference`].
pub fn read_and_place(
    scene: &Scene,
    trees: &InventoryTrees,
    terrain: &Terrain,
) -> Result<(Inventory, Placement), StageError> {
    let read = |positions: Option<Coordinates>| {
        let options = InventoryOptions {
            dbh_unit: trees.dbh_unit,
            height_unit: trees.height_unit,
            positions,
            year: trees.year,
            variant: trees.variant.as_deref(),
            layer: trees.layer.as_deref(),
            strict: trees.strict,
        };
        read_inventory(&trees.path, options)
    };
    let system = terrain.reference().map(GeoReference::system);
    let in_degrees = trees.anchor == Anchor::Terrain && system == Some(CoordinateSystem::Geographic);
    let inventory = read(in_degrees.then_some(Coordinates::Geographic))?;
    let placed = Placement::new(scene, trees, &inventory, terrain);
    let most = |placement: &Placement, inventory: &Inventory| {
        2 * placement.extent(inventory, terrain).1 > inventory.rows.len()
    };
    // A table may have its metres in another system than the terrain, and degrees beside them.
    let poor = placed.as_ref().map_or(true, |placement| !most(placement, &inventory));
    if poor && trees.anchor == Anchor::Terrain && inventory.coordinates == Coordinates::Planar {
        let other = read(Some(Coordinates::Geographic))?;
        if other.coordinates == Coordinates::Geographic
            && let Ok(mut placement) = Placement::new(scene, trees, &other, terrain)
            && most(&placement, &other)
        {
            let note = "the positions are taken from the table's degrees: its metres are not those of the terrain";
            placement.note.get_or_insert_with(|| note.to_owned());
            return Ok((other, placement));
        }
    }
    Ok((inventory, placed?))
}

impl Placement {
    fn new(
        scene: &Scene,
        trees: &InventoryTrees,
        inventory: &Inventory,
        terrain: &Terrain,
    ) -> Result<Self, StageError> {
        let plain = |map: Map| Ok(Self { map, note: None });
        let refused = |problem| Err(StageError::NoReference { path: trees.path.clone(), problem });
        let span = span(inventory);
        let reference = terrain.reference();
        let place = reference.and_then(GeoReference::latitude_longitude);
        let across = |from: CoordinateSystem| {
            Some(Map::Across { from: SystemMap::new(from)?, to: SystemMap::new(reference?.system())? })
        };
        // A system that the scene or the file states, where the terrain has another one.
        let named = inventory.epsg.and_then(CoordinateSystem::from_epsg);
        let described = || inventory.wkt.as_deref().and_then(CoordinateSystem::from_wkt);
        let stated = trees.coordinates.or(named).or_else(described);
        if let Some(system) = stated
            && inventory.coordinates == Coordinates::Planar
            && (trees.coordinates.is_some() || trees.anchor == Anchor::Terrain)
            && reference.is_some_and(|reference| reference.system() != system)
        {
            return match across(system) {
                Some(map) => plain(map),
                None => refused("it is not known where on earth its coordinate system or that of the terrain lies"),
            };
        }
        match (inventory.coordinates, trees.anchor) {
            (Coordinates::Geographic, Anchor::StandCentre) => {
                match GeoReference::new(CoordinateSystem::Geographic, 0.5 * (span.0 + span.1)) {
                    Ok(centre) => plain(Map::Degrees(centre)),
                    Err(_) => refused("its positions are degrees too near to a pole"),
                }
            }
            (Coordinates::Geographic, _) if place.is_some() => match across(CoordinateSystem::Geographic) {
                Some(map) => plain(map),
                None => refused("its positions are degrees, and it is not known where on earth the terrain lies"),
            },
            (Coordinates::Geographic, _) => {
                // A terrain without a system lies where the scene says.
                let stated = scene.place.longitude.zip(scene.place.latitude);
                let centre = stated.and_then(|(longitude, latitude)| {
                    GeoReference::new(CoordinateSystem::Geographic, DVec2::new(longitude, latitude)).ok()
                });
                let Some(centre) = centre else {
                    return refused("its positions are degrees, and it is not known where on earth the terrain lies");
                };
                let note =
                    "positions in degrees are laid out around the scene's `place`, taken as the terrain's centre";
                Ok(Self { map: Map::Degrees(centre), note: Some(note.to_owned()) })
            }
            (Coordinates::Planar, Anchor::Terrain) => match reference.map(GeoReference::system) {
                Some(CoordinateSystem::Geographic) => {
                    let Some((latitude, longitude)) = place else {
                        return refused("its positions are metres, and the terrain's are degrees");
                    };
                    let zone = (((longitude + 180.0) / 6.0).floor() as i64).rem_euclid(60) as u8 + 1;
                    let Some(map) = across(CoordinateSystem::Utm { zone, south: latitude < 0.0 }) else {
                        return refused("its positions are metres, and the terrain's are degrees");
                    };
                    let placement = Self {
                        map,
                        note: Some(format!(
                            "its metres are taken as those of UTM zone {zone}, because the terrain is in degrees there"
                        )),
                    };
                    if placement.extent(inventory, terrain).1 == 0 {
                        return refused(
                            "its positions are metres, the terrain's are degrees, and they do not lie on it as metres of its \
                             UTM zone either",
                        );
                    }
                    Ok(placement)
                }
                Some(_) => plain(Map::File),
                None => refused("`anchor: Terrain` needs a terrain file with coordinates"),
            },
            (Coordinates::Planar, anchor) => {
                let origin = anchor.origin(span, terrain.extent()).unwrap_or(DVec2::ZERO);
                plain(Map::Metres { origin })
            }
        }
    }

    /// The position of a tree, whose height above the datum is 0; not finite where there is none.
    pub fn local(&self, terrain: &Terrain, x: f64, y: f64) -> DVec3 {
        let on_ground = |place: DVec2| DVec3::new(place.x, 0.0, place.y);
        match &self.map {
            // The file's y points north, the scene's z south.
            Map::Metres { origin } => on_ground(DVec2::new(x - origin.x, origin.y - y)),
            Map::Degrees(reference) => on_ground(reference.to_local(x, y)),
            Map::File => terrain.reference().map_or(DVec3::NAN, |reference| on_ground(reference.to_local(x, y))),
            Map::Across { from, to } => terrain
                .reference()
                .and_then(|reference| {
                    let (latitude, longitude) = from.to_earth(DVec2::new(x, y))?;
                    let file = to.coordinates_of(longitude, latitude)?;
                    Some(reference.to_local(file.x, file.y))
                })
                .map_or(DVec3::NAN, on_ground),
        }
    }

    /// The rectangle around all trees, and the number of those on the terrain.
    pub fn extent(&self, inventory: &Inventory, terrain: &Terrain) -> (Area, usize) {
        let (mut low, mut high, mut count) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0);
        for row in &inventory.rows {
            let place = self.local(terrain, row.x, row.y);
            let place = DVec2::new(place.x, place.z);
            if place.is_finite() {
                (low, high) = (low.min(place), high.max(place));
                count += usize::from(terrain.contains(place.x, place.y));
            }
        }
        (Area { min: low, max: high }, count)
    }
}

/// Least and greatest coordinates, of several surveys or variants those of all of them.
fn span(inventory: &Inventory) -> (DVec2, DVec2) {
    inventory.extent.unwrap_or_else(|| {
        inventory.rows.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), row| {
            let at = DVec2::new(row.x, row.y);
            (low.min(at), high.max(at))
        })
    })
}

/// The anchors other than its own with which nine of ten trees would stand on the terrain.
pub fn fitting_anchors(scene: &Scene, trees: &InventoryTrees, inventory: &Inventory, terrain: &Terrain) -> Vec<Anchor> {
    let fits = |anchor: &Anchor| {
        let other = InventoryTrees { anchor: *anchor, ..trees.clone() };
        *anchor != trees.anchor
            && Placement::new(scene, &other, inventory, terrain)
                .is_ok_and(|placement| 10 * placement.extent(inventory, terrain).1 >= 9 * inventory.rows.len())
    };
    Anchor::ALL.into_iter().filter(fits).collect()
}

/// Whether the trees would stand on the terrain if x and y of their file were exchanged.
fn fits_exchanged(placement: &Placement, inventory: &Inventory, terrain: &Terrain) -> bool {
    let inside = inventory.rows.iter().filter(|row| {
        let place = placement.local(terrain, row.y, row.x);
        place.is_finite() && terrain.contains(place.x, place.z)
    });
    !inventory.rows.is_empty() && 10 * inside.count() >= 9 * inventory.rows.len()
}

/// What the inventory and the terrain cover in the coordinates of their files, for messages.
pub fn file_extents(placement: &Placement, inventory: &Inventory, terrain: &Terrain) -> Option<String> {
    let reference = terrain.reference()?;
    let half = 0.5 * terrain.extent();
    let (low, high) = (reference.to_file(-half.x, half.y), reference.to_file(half.x, -half.y));
    let (least, most) = span(inventory);
    let digits = |degrees: bool| if degrees { 5 } else { 0 };
    let file = digits(reference.system() == CoordinateSystem::Geographic);
    let table = digits(inventory.coordinates == Coordinates::Geographic);
    let exchanged = if fits_exchanged(placement, inventory, terrain) {
        "; they would stand on it if x and y were exchanged: look at the names of the columns"
    } else {
        ""
    };
    Some(format!(
        " (in the files' own coordinates: trees x {:.table$} to {:.table$}, y {:.table$} to {:.table$}; terrain x {:.file$} to \
         {:.file$}, y {:.file$} to {:.file$}{exchanged})",
        least.x, most.x, least.y, most.y, low.x, high.x, low.y, high.y
    ))
}
