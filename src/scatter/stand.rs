//! The types of the room: a tree, a stand of them, the ground below and the area around.

use glam::{DVec2, DVec3};
use serde::Deserialize;

/// Smallest scale of a tree, as a factor on its plant. Set by the logarithmic 12 bits of [`super::PackedTree`].
pub const MIN_SCALE: f32 = 1.0 / 16.0;

/// Largest scale of a tree, as a factor on its plant.
pub const MAX_SCALE: f32 = 16.0;

/// Largest absolute X or Z of a rule's area, metres: just inside what 64 m cells address (±2,097,152 m).
pub const MAX_COORDINATE_M: f64 = 2_000_000.0;

/// Steepest ground that the sink of a trunk follows, radians (about 80°); beyond, the sink grows no more.
const MAX_SINK_SLOPE: f32 = 1.4;

/// What trees stand on. `x` and `z` are scene-local metres.
pub trait Ground: Sync {
    /// Height above the datum, metres. A height that is not finite means that there is no ground: no tree stands there.
    fn height(&self, x: f64, z: f64) -> f64;

    /// Angle between the ground's normal and the vertical, radians, 0 (level) to π/2.
    fn slope(&self, x: f64, z: f64) -> f32;

    /// Whether the ground is known here. No tree stands where it is not.
    fn contains(&self, _x: f64, _z: f64) -> bool {
        true
    }
}

impl<G: Ground + ?Sized> Ground for &G {
    fn height(&self, x: f64, z: f64) -> f64 {
        (**self).height(x, z)
    }

    fn slope(&self, x: f64, z: f64) -> f32 {
        (**self).slope(x, z)
    }

    fn contains(&self, x: f64, z: f64) -> bool {
        (**self).contains(x, z)
    }
}

/// A rectangle on the ground, scene-local metres; `x` of the vectors is X (east), `y` is Z (south).
///
/// A scene file writes its sides, `(west: -100, south: -90, east: 80, north: 70)`: see
/// [`from_sides`](Self::from_sides).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, bevy::reflect::Reflect)]
#[serde(from = "Sides")]
pub struct Area {
    /// Smallest X and Z.
    pub min: DVec2,
    /// Largest X and Z.
    pub max: DVec2,
}

/// An area as a scene file writes it.
#[derive(Deserialize)]
#[serde(rename = "Area", deny_unknown_fields)]
struct Sides {
    west: f64,
    south: f64,
    east: f64,
    north: f64,
}

impl From<Sides> for Area {
    fn from(sides: Sides) -> Self {
        Self::from_sides(sides.west, sides.south, sides.east, sides.north)
    }
}

impl Area {
    /// The rectangle between these sides: metres from the terrain's centre, east and north positive.
    pub fn from_sides(west: f64, south: f64, east: f64, north: f64) -> Self {
        Self { min: DVec2::new(west, -north), max: DVec2::new(east, -south) }
    }

    /// West, south, east and north side: metres from the terrain's centre, east and north positive.
    pub fn sides(&self) -> [f64; 4] {
        [self.min.x, -self.max.y, self.max.x, -self.min.y]
    }

    /// The rectangle of `size` metres around `center`.
    pub fn centered(center: DVec2, size: DVec2) -> Self {
        Self { min: center - 0.5 * size, max: center + 0.5 * size }
    }

    /// Width (X) and depth (Z), metres.
    pub fn size(&self) -> DVec2 {
        self.max - self.min
    }

    /// Hectares (10,000 m²).
    pub fn hectares(&self) -> f64 {
        let size = self.size();
        size.x * size.y / 10_000.0
    }

    /// Whether a point (X, Z) is inside; both edges belong to the area.
    pub fn contains(&self, point: DVec2) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }
}

/// One tree of a stand.
#[derive(Clone, Copy, Debug, PartialEq, bevy::reflect::Reflect)]
pub struct Tree {
    /// The foot of the trunk: on the ground, or a little below it on a slope (see `sink`). Scene-local metres.
    pub position: DVec3,
    /// Turn about the trunk, radians, 0 to 2π, counter-clockwise seen from above.
    pub yaw: f32,
    /// Factor on the plant's size, [`MIN_SCALE`] to [`MAX_SCALE`].
    pub scale: f32,
    /// Which plant stands here.
    pub variant: u16,
    /// The individual's deviation in colour, -1 to 1.
    pub tint: f32,
    /// What the tree is known by: the index of its point in the sequence, or of its row in the inventory.
    pub index: u32,
}

/// Trees in the order of their [`Tree::index`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stand {
    /// The trees.
    pub trees: Vec<Tree>,
}

impl Stand {
    /// The rectangle around all feet, or `None` for an empty stand.
    pub fn area(&self) -> Option<Area> {
        let mut feet = self.trees.iter().map(|tree| tree.position.xz_plane());
        let first = feet.next()?;
        Some(feet.fold(Area { min: first, max: first }, |area, p| Area { min: area.min.min(p), max: area.max.max(p) }))
    }
}

/// Projection to the ground plane.
pub(super) trait XzPlane {
    /// X and Z.
    fn xz_plane(&self) -> DVec2;
}

impl XzPlane for DVec3 {
    fn xz_plane(&self) -> DVec2 {
        DVec2::new(self.x, self.z)
    }
}

/// How far a trunk's foot is put below the ground's height at its axis, metres: `radius * tan(slope)`.
///
/// On ground of that slope the downhill edge of a trunk of `radius` metres is that much lower than its axis; sunk by
/// it, the trunk's whole rim is at or below the ground. Slopes beyond 80° count as 80°.
pub(super) fn sink(radius: f32, slope: f32) -> f64 {
    f64::from(radius) * f64::from(slope.clamp(0.0, MAX_SINK_SLOPE)).tan()
}
