//! Levels of detail of the drawn ground: a quadtree of tiles whose meshes morph into each other with distance
//! [Strugar 2009, "Continuous Distance-Dependent Level of Detail for Rendering Heightmaps", JGT 14(4)].
//!
//! **Meshes.** A tile of level `l` has `(N + 1)²` vertices, `N` = [`TILE_QUADS`], at the spacing
//! `s_l = finest_spacing * 2^l`. Tile `(ix, iz)` begins at `x = ix * N * s_l`, `z = iz * N * s_l` and goes east and
//! south; tiles cover the whole plane, the surroundings of the field included. Every quad is cut along the **diagonal
//! from its north-western to its south-eastern corner** ([`tile_indices`]). With one direction for all, the mesh of a
//! level refines the triangles of the next coarser one exactly, so a vertex knows the height it has there
//! (`parent_height`): its own at even indices, the mean of its two neighbours along the row, the column or the diagonal
//! at odd ones.
//!
//! **Morph**, in the shader as here ([`Tile::morph`]):
//!
//! ```text
//! D = max(distance(vertex.xz, camera.xz), clearance)         metres; clearance is what `select` returns
//! k = clamp((D - morph_start) / (morph_end - morph_start), 0, 1)
//! y = mix(height, parent_height, k)                          x and z stay
//! ```
//!
//! `clearance` is a lower bound of the distance from the camera to the ground. `D` therefore is never above the true
//! distance (so errors are never larger than planned), and it depends on x and z alone: both sides of an edge compute
//! the same `D` at the same position, whatever their level.
//!
//! **Ranges.** `e_l` is the vertical deviation of level `l`'s mesh from [`Terrain::height`] that the share
//! [`TileSettings::coverage`] of the ground does not exceed (all of it at 1), measured once over the terrain. A level
//! morphs into the next between
//!
//! ```text
//! start_l = max(e_(l+1) * focal_px / pixel_error + sqrt(2) s_l,   the next level's error is small enough
//!               2 start_(l-1),
//!               end_(l-1) + sqrt(2) N s_l)                        no cracks, see below
//! end_l   = 1.3 start_l
//! ```
//!
//! so that at every distance the error of the drawn mesh stays below `pixel_error` pixels (an angle of
//! `pixel_error / focal_px`). Nearer than `e_0 * focal_px / pixel_error` there is no finer level: choose
//! `finest_spacing` for that.
//!
//! **No cracks.** A tile of level `l` is split if its nearest `D` is below `end_(l-1)`. A split tile then lies wholly
//! before `start_l` (its diagonal is `sqrt(2) N s_l`), a whole one wholly behind `end_(l-1)`. Where a tile of level `l`
//! meets one of level `l - 1`, both hold on the common edge: the coarse side does not morph yet, the fine side has
//! become the coarse mesh. Tiles two levels apart cannot meet. What remains are T-junctions whose vertices lie on the
//! coarse edge up to rounding (1e-4 m): a skirt of a pixel or two around each tile covers them ([`skirt_indices`]).

mod deviation;
mod mesh;

use std::fmt;

use glam::{DVec2, DVec3};

use super::height_bounds::BoundsInMetres;
use super::{Terrain, TerrainError};

pub use mesh::{TileVertex, skirt_indices, tile_indices};

/// Quads along a side of a tile's mesh.
pub const TILE_QUADS: usize = 32;

/// Ratio of the end of a morph to its start.
const MORPH_STRETCH: f64 = 1.3;
/// The most levels a tree has: the coarsest tile is then 2^23 times as wide as the finest.
const MAX_LEVELS: usize = 24;
/// The coarsest level never morphs; its range begins here, in metres.
const NEVER: f64 = 1.0e12;
/// Cameras farther out (metres) are taken as standing here, so that tile coordinates fit i32.
const FARTHEST_CAMERA: f64 = 1.0e7;

/// The most by which the pixel error is raised for a bound of the number of tiles: the ranges change no more.
const LARGEST_FACTOR: f64 = 1_048_576.0;

/// Settings for the detail of the drawn ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileSettings {
    /// Distance of vertices at the finest level in metres, 0.01 to 10 000. Smaller follows the ground more
    /// closely right in front of the camera, and costs only there.
    pub finest_spacing: f64,
    /// Half the edge of the square around the camera in which the ground is drawn, in metres, above 0 to 1 000 000.
    pub max_distance: f64,
    /// Error of the drawn mesh in pixels, 0.05 to 100. Doubling it leaves about a quarter of the triangles on rough
    /// ground.
    pub pixel_error: f64,
    /// Fraction of the ground that keeps the pixel error, 0.5 to 1. At 1 the roughest spot of the whole terrain
    /// determines the distances for all of it, which is strict, and expensive for measured, noisy data.
    pub coverage: f64,
}

impl Default for TileSettings {
    fn default() -> Self {
        Self { finest_spacing: 2.0, max_distance: 30_000.0, pixel_error: 0.5, coverage: 0.99 }
    }
}

/// One tile to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Level of detail, 0 is the finest.
    pub level: u32,
    /// Column of the tile among those of its level: it begins at `x = ix * width`.
    pub ix: i32,
    /// Row of the tile among those of its level: it begins at `z = iz * width`.
    pub iz: i32,
    /// Distance `D` at which vertices begin to move to their `parent_height`, in metres.
    pub morph_start: f32,
    /// Distance `D` at which they arrive there, in metres; above `morph_start`.
    pub morph_end: f32,
}

impl Tile {
    /// The weight of `parent_height` at a vertex at local position `vertex` (x east, y south, metres): 0 to 1. This is
    /// the formula of the module's head, in f64.
    pub fn morph(&self, vertex: DVec2, camera: DVec3, clearance: f64) -> f64 {
        let distance = vertex.distance(DVec2::new(camera.x, camera.z)).max(clearance);
        let (start, end) = (f64::from(self.morph_start), f64::from(self.morph_end));
        ((distance - start) / (end - start)).clamp(0.0, 1.0)
    }
}

/// The distances over which a level morphs into the next coarser one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MorphRange {
    /// Distance `D` in metres where the morph begins.
    pub start: f64,
    /// Distance `D` in metres where it is complete.
    pub end: f64,
}

/// The levels of detail of one terrain.
#[derive(Clone)]
pub struct TileTree {
    settings: TileSettings,
    deviations: Vec<f64>,
    bounds: BoundsInMetres,
}

impl fmt::Debug for TileTree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TileTree")
            .field("settings", &self.settings)
            .field("deviations", &self.deviations)
            .finish_non_exhaustive()
    }
}

/// A node of the quadtree while tiles are chosen.
#[derive(Clone, Copy)]
struct Node {
    level: usize,
    ix: i32,
    iz: i32,
}

impl TileTree {
    /// Measures the error of every level; 10 to 150 ms, deterministic.
    ///
    /// # Errors
    /// A setting outside the range its field names.
    pub fn new(terrain: &Terrain, settings: &TileSettings) -> Result<Self, TerrainError> {
        for (name, value, low, high, range) in [
            ("the finest spacing of the tiles", settings.finest_spacing, 0.01, 1.0e4, "0.01 m to 10000 m"),
            ("the distance the tiles reach", settings.max_distance, 1.0e-3, 1.0e6, "above 0 m to 1000000 m"),
            ("the pixel error of the tiles", settings.pixel_error, 0.05, 100.0, "0.05 to 100 pixels"),
            ("the coverage of the pixel error", settings.coverage, 0.5, 1.0, "0.5 to 1"),
        ] {
            if !(low..=high).contains(&value) {
                return Err(TerrainError::BadParameter { name, value, range });
            }
        }
        // The coarsest tile reaches from the camera to the end of the square: at most 3x3 of them cover it.
        let finest_width = settings.finest_spacing * TILE_QUADS as f64;
        let doublings = (settings.max_distance / finest_width).log2().ceil().max(0.0) as usize;
        let levels = (doublings + 1).min(MAX_LEVELS);
        let spacings = (0..levels).map(|level| settings.finest_spacing * (level as f64).exp2());
        let deviations = deviation::of_levels(terrain, spacings, settings.coverage);
        Ok(Self { settings: *settings, deviations, bounds: terrain.shared_bounds() })
    }

    /// Number of levels, 1 to 24.
    pub fn levels(&self) -> usize {
        self.deviations.len()
    }

    /// Distance of neighbouring vertices of a level in metres.
    pub fn spacing(&self, level: u32) -> f64 {
        self.settings.finest_spacing * f64::from(level).exp2()
    }

    /// Width of a level's tiles in metres.
    pub fn tile_width(&self, level: u32) -> f64 {
        self.spacing(level) * TILE_QUADS as f64
    }

    /// North-western corner of a tile in the local frame (x east, y south, metres).
    pub fn tile_origin(&self, level: u32, ix: i32, iz: i32) -> DVec2 {
        DVec2::new(f64::from(ix), f64::from(iz)) * self.tile_width(level)
    }

    /// Lowest and highest point of the ground over a tile in metres, for its bounding box.
    pub fn tile_heights(&self, level: u32, ix: i32, iz: i32) -> (f32, f32) {
        let origin = self.tile_origin(level, ix, iz);
        self.bounds.over(origin, origin + self.tile_width(level))
    }

    /// The vertical deviation of each level's mesh from the ground in metres (see the module's head), finest level
    /// first, never falling.
    pub fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    /// The morph of each level, finest first, for a camera whose focal length is `focal_px` pixels
    /// (`height_px / (2 tan(fov_y / 2))`).
    pub fn morph_ranges(&self, focal_px: f64) -> Vec<MorphRange> {
        let focal_px = if focal_px.is_finite() { focal_px.clamp(1.0, 1.0e6) } else { 1.0e6 };
        let per_metre = focal_px / self.settings.pixel_error;
        let mut ranges: Vec<MorphRange> = Vec::with_capacity(self.levels());
        for level in 0..self.levels() {
            let spacing = self.spacing(level as u32);
            let mut start = match self.deviations.get(level + 1) {
                Some(next) => (next * per_metre + spacing * std::f64::consts::SQRT_2).min(NEVER),
                None => NEVER,
            };
            if let Some(finer) = ranges.last() {
                let diagonal = spacing * TILE_QUADS as f64 * std::f64::consts::SQRT_2;
                start = start.max(2.0 * finer.start).max(finer.end + diagonal);
            }
            ranges.push(MorphRange { start, end: MORPH_STRETCH * start });
        }
        ranges
    }

    /// Chooses the tiles to draw from `camera` (local x, height, local z; metres) into `out` (cleared first), nearest
    /// first, always in the same order. `visible` says whether a box (lower and upper corner: x, height, z) may be
    /// seen; it is asked for coarse boxes before the finer ones inside them.
    ///
    /// Returns the clearance that the morph needs: a lower bound of the distance from the camera to the ground, in
    /// metres. About 0.3 us a tile.
    pub fn select(
        &self,
        camera: DVec3,
        focal_px: f64,
        visible: impl Fn(DVec3, DVec3) -> bool,
        out: &mut Vec<Tile>,
    ) -> f64 {
        out.clear();
        let reach = |value: f64| if value.is_finite() { value.clamp(-FARTHEST_CAMERA, FARTHEST_CAMERA) } else { 0.0 };
        let camera = DVec3::new(reach(camera.x), reach(camera.y), reach(camera.z));
        let ground = DVec2::new(camera.x, camera.z);
        let clearance = self.clearance(camera);
        let ranges = self.morph_ranges(focal_px);
        let (square_min, square_max) = (ground - self.settings.max_distance, ground + self.settings.max_distance);

        let top = self.levels() - 1;
        let top_width = self.tile_width(top as u32);
        let first = (square_min / top_width).floor();
        let last = (square_max / top_width).ceil();
        let mut open = Vec::new();
        for iz in first.y as i32..last.y as i32 {
            for ix in first.x as i32..last.x as i32 {
                open.push(Node { level: top, ix, iz });
            }
        }
        let mut chosen = Vec::new();
        while let Some(node) = open.pop() {
            let width = self.tile_width(node.level as u32);
            let min = self.tile_origin(node.level as u32, node.ix, node.iz);
            let max = min + width;
            if min.cmpgt(square_max).any() || max.cmplt(square_min).any() {
                continue;
            }
            let (low, high) = self.bounds.over(min, max);
            if !visible(DVec3::new(min.x, f64::from(low), min.y), DVec3::new(max.x, f64::from(high), max.y)) {
                continue;
            }
            let nearest = ground.clamp(min, max).distance(ground);
            if node.level > 0 && nearest.max(clearance) < ranges[node.level - 1].end {
                for (dx, dz) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    open.push(Node { level: node.level - 1, ix: 2 * node.ix + dx, iz: 2 * node.iz + dz });
                }
            } else {
                chosen.push((nearest, node));
            }
        }
        chosen.sort_by(|(a, p), (b, q)| a.total_cmp(b).then((p.level, p.iz, p.ix).cmp(&(q.level, q.iz, q.ix))));
        out.extend(chosen.iter().map(|(_, node)| Tile {
            level: node.level as u32,
            ix: node.ix,
            iz: node.iz,
            morph_start: ranges[node.level].start as f32,
            morph_end: ranges[node.level].end as f32,
        }));
        clearance
    }

    /// As [`select`](Self::select), with at most `most` tiles: where the pixel error would need more, it is doubled until
    /// they suffice, so that coarser tiles cover the ground. Returns the clearance, and the factor on the pixel error.
    ///
    /// No error is large enough for less than a few dozen tiles a level: then the nearest `most` are left.
    pub fn select_at_most(
        &self,
        most: usize,
        camera: DVec3,
        focal_px: f64,
        visible: impl Fn(DVec3, DVec3) -> bool,
        out: &mut Vec<Tile>,
    ) -> (f64, f64) {
        let mut factor = 1.0;
        loop {
            let clearance = self.select(camera, focal_px / factor, &visible, out);
            if out.len() <= most || factor >= LARGEST_FACTOR {
                out.truncate(most);
                return (clearance, factor);
            }
            factor *= 2.0;
        }
    }

    /// The vertices of a tile, row by row from the north, each row from the west: `(N + 1)²` of them; x and z follow
    /// from [`TileTree::tile_origin`] and [`TileTree::spacing`]. About 50 us.
    pub fn tile_vertices(&self, terrain: &Terrain, level: u32, ix: i32, iz: i32) -> Vec<TileVertex> {
        mesh::vertices(terrain, self.tile_origin(level, ix, iz), self.spacing(level))
    }

    /// A lower bound of the distance from a point to the ground: the largest `r` so that all ground within a square of
    /// half width `r` lies `r` or more below the point. Ground outside the square is `r` away anyway. 0 under ground.
    fn clearance(&self, camera: DVec3) -> f64 {
        let ground = DVec2::new(camera.x, camera.z);
        let above = |radius: f64| camera.y - f64::from(self.bounds.over(ground - radius, ground + radius).1);
        let (mut low, mut high) = (0.0, above(0.0).max(0.0));
        // Twelve halvings leave an uncertainty of 1/4096 of the height, on the safe side.
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if middle <= above(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}
