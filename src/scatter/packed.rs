//! A stand as the GPU reads it: 16 bytes a tree, trees sorted by square cells of ground.
//!
//! ```text
//! word 0  xz    u16 x | u16 z << 16         place inside the cell, 0..=65535 for 0..=cell size (WGSL unpack2x16unorm)
//! word 1  y     f32                         metres above the datum
//! word 2  cell  i16 ix | i16 iz << 16       cell (ix, iz) covers [ix s, (ix + 1) s) × [iz s, (iz + 1) s)
//! word 3  look  yaw 8 | scale 12 | variant 6 | tint 6    from the lowest bit up
//! ```
//!
//! An f32 position would have steps of 0.125 m at 2,000 km and needs 12 bytes; cells give the same step everywhere, and
//! the camera-relative position is `(cell - camera_cell) * s + place`, in which the large numbers cancel as integers.
//!
//! | value | coding | largest error |
//! |---|---|---|
//! | x, z | unorm 16 of the cell | s / 131070 (0.49 mm at 64 m) |
//! | y | f32 | 2⁻²⁴ of itself (0.24 mm at 4,096 m) |
//! | yaw | 256 steps a turn | π/256 rad (0.7°) |
//! | scale | 4096 steps from 1/16 to 16, even in the logarithm | 0.068 % |
//! | variant | 0..=63 | 0 |
//! | tint | -31..=31 | 1/62 |

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use rayon::prelude::*;

use super::ScatterError;
use super::stand::{MAX_SCALE, MIN_SCALE, Stand, Tree};

/// Side of a cell unless something else is wanted, metres; reaches to ±2,097,152 m.
pub const DEFAULT_CELL_SIZE: f64 = 64.0;

/// The most plant variants a packed stand can name.
pub const MAX_VARIANTS: usize = 64;

/// Largest height above or below the datum, metres: there f32 has steps of 8 mm.
pub const MAX_HEIGHT_M: f64 = 100_000.0;

/// Largest radius and height of a plant at scale 1, metres.
pub const MAX_PLANT_M: f32 = 1000.0;

/// Steps of a position along a cell's side.
pub const PLACE_STEPS: f32 = 65535.0;
/// Bits of the yaw, the lowest of [`PackedTree::look`].
pub const YAW_BITS: u32 = 8;
/// First bit of the scale.
pub const SCALE_SHIFT: u32 = YAW_BITS;
/// Bits of the scale.
pub const SCALE_BITS: u32 = 12;
/// First bit of the variant.
pub const VARIANT_SHIFT: u32 = SCALE_SHIFT + SCALE_BITS;
/// Bits of the variant.
pub const VARIANT_BITS: u32 = 6;
/// First bit of the tint.
pub const TINT_SHIFT: u32 = VARIANT_SHIFT + VARIANT_BITS;
/// Bits of the tint, two's complement: the uppermost.
pub const TINT_BITS: u32 = 32 - TINT_SHIFT;
/// Steps of the scale, even in the logarithm.
pub const SCALE_STEPS: f32 = ((1 << SCALE_BITS) - 1) as f32;
/// Binary logarithm of the smallest scale.
pub const LEAST_SCALE_LOG2: f32 = -4.0;
/// Binary logarithm of the largest scale over the smallest.
pub const SCALE_OCTAVES: f32 = 8.0;
/// Steps of the tint on either side of 0.
pub const TINT_STEPS: f32 = ((1 << (TINT_BITS - 1)) - 1) as f32;

/// The lowest `bits` bits.
const fn mask(bits: u32) -> u32 {
    (1 << bits) - 1
}

/// One tree; see the module for its bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PackedTree {
    /// Place inside the cell: x in the lower 16 bits, z in the upper.
    pub xz: u32,
    /// Height of the foot above the datum, metres.
    pub y: f32,
    /// The cell: ix in the lower 16 bits, iz in the upper, two's complement.
    pub cell: u32,
    /// Yaw, scale, variant, tint.
    pub look: u32,
}

impl PackedTree {
    /// Packs `tree`, the `place`-th of its stand, for cells of `cell_size` metres.
    ///
    /// # Errors
    /// [`ScatterError::Unpackable`] for a value outside of what the module's table can hold, or not a number.
    pub fn pack(tree: &Tree, place: usize, cell_size: f64) -> Result<Self, ScatterError> {
        let fail =
            |what, value: f64, remedy: String| Err(ScatterError::Unpackable { tree: place, what, value, remedy });
        let DVec3 { x, y, z } = tree.position;
        let axis = |value: f64| {
            let cell = (value / cell_size).floor();
            let inside = ((value / cell_size - cell) * f64::from(PLACE_STEPS)).round() as u32;
            (f64::from(i16::MIN)..=f64::from(i16::MAX))
                .contains(&cell)
                .then_some((cell as i16, inside.min(PLACE_STEPS as u32)))
        };
        let reach = || format!("stay within ±{} m or take larger cells", cell_size * f64::from(i16::MAX));
        let Some((ix, place_x)) = axis(x) else { return fail("x", x, reach()) };
        let Some((iz, place_z)) = axis(z) else { return fail("z", z, reach()) };
        if !(-MAX_HEIGHT_M..=MAX_HEIGHT_M).contains(&y) {
            return fail("y", y, format!("heights are within ±{MAX_HEIGHT_M} m of the datum"));
        }
        if !(MIN_SCALE..=MAX_SCALE).contains(&tree.scale) {
            return fail("scale", tree.scale.into(), format!("scales are {MIN_SCALE} to {MAX_SCALE}"));
        }
        if !tree.yaw.is_finite() {
            return fail("yaw", tree.yaw.into(), "give finite radians".to_owned());
        }
        if !(-1.0..=1.0).contains(&tree.tint) {
            return fail("tint", tree.tint.into(), "tints are -1 to 1".to_owned());
        }
        if usize::from(tree.variant) >= MAX_VARIANTS {
            return fail("variant", tree.variant.into(), format!("variants are 0 to {}", MAX_VARIANTS - 1));
        }
        let yaw = ((tree.yaw / TAU).rem_euclid(1.0) * (1 << YAW_BITS) as f32).round() as u32;
        let scale = ((tree.scale.log2() - LEAST_SCALE_LOG2) / SCALE_OCTAVES * SCALE_STEPS).round() as u32;
        let tint = (tree.tint * TINT_STEPS).round() as i32 as u32;
        Ok(Self {
            xz: place_x | place_z << 16,
            y: y as f32,
            cell: u32::from(ix as u16) | u32::from(iz as u16) << 16,
            look: yaw & mask(YAW_BITS)
                | (scale & mask(SCALE_BITS)) << SCALE_SHIFT
                | u32::from(tree.variant) << VARIANT_SHIFT
                | tint << TINT_SHIFT,
        })
    }

    /// The cell (ix, iz).
    pub fn cell_index(&self) -> (i16, i16) {
        (self.cell as u16 as i16, (self.cell >> 16) as u16 as i16)
    }

    /// Scene-local position of the foot, metres.
    pub fn position(&self, cell_size: f64) -> DVec3 {
        let (ix, iz) = self.cell_index();
        let axis = |cell: i16, place: u32| (f64::from(cell) + f64::from(place) / f64::from(PLACE_STEPS)) * cell_size;
        DVec3::new(axis(ix, self.xz & 0xFFFF), self.y.into(), axis(iz, self.xz >> 16))
    }

    /// Turn about the trunk, radians, 0 to 2π.
    pub fn yaw(&self) -> f32 {
        (self.look & mask(YAW_BITS)) as f32 * (TAU / (1 << YAW_BITS) as f32)
    }

    /// Factor on the plant's size.
    pub fn scale(&self) -> f32 {
        ((self.look >> SCALE_SHIFT & mask(SCALE_BITS)) as f32 * (SCALE_OCTAVES / SCALE_STEPS) + LEAST_SCALE_LOG2).exp2()
    }

    /// Which plant stands here.
    pub fn variant(&self) -> u16 {
        (self.look >> VARIANT_SHIFT & mask(VARIANT_BITS)) as u16
    }

    /// Deviation in colour, -1 to 1.
    pub fn tint(&self) -> f32 {
        // The tint is in the uppermost bits, so the arithmetic shift extends its sign.
        (self.look as i32 >> TINT_SHIFT) as f32 / TINT_STEPS
    }
}

/// Size of a plant at scale 1: an upright cylinder around its trunk's axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantSize {
    /// Height above the foot, metres.
    pub height: f32,
    /// Largest horizontal distance from the trunk's axis, metres.
    pub radius: f32,
}

impl PlantSize {
    /// Sizes below this, metres, count as this: a plant of nothing has a size too.
    pub const LEAST: f32 = 0.01;

    /// The size of a plant of this height and radius, metres; at least [`Self::LEAST`] each.
    pub fn new(height: f32, radius: f32) -> Self {
        Self { height: height.max(Self::LEAST), radius: radius.max(Self::LEAST) }
    }
}

/// A square of ground with the trees that stand on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Column: X of its western edge over the cell size.
    pub ix: i16,
    /// Row: Z of its northern edge over the cell size.
    pub iz: i16,
    /// Its first tree in [`PackedStand::trees`].
    pub first: u32,
    /// Number of its trees, > 0.
    pub count: u32,
    /// Smallest corner of the box around its trees, crowns included, scene-local metres.
    pub min: DVec3,
    /// Largest corner of that box.
    pub max: DVec3,
    /// Scale of its largest tree.
    pub max_scale: f32,
}

/// A stand for the GPU: trees sorted by cell, cells in Morton order (neighbours in the list are near on the ground).
#[derive(Clone, Debug, PartialEq)]
pub struct PackedStand {
    /// The trees, cell after cell, within a cell in the order of the stand.
    pub trees: Vec<PackedTree>,
    /// Each tree's [`Tree::index`], in the order of `trees`.
    pub indices: Vec<u32>,
    /// The cells that hold trees.
    pub cells: Vec<Cell>,
    /// Side of a cell, metres.
    pub cell_size: f64,
}

impl PackedStand {
    /// Packs `stand` into cells of `cell_size` metres (1 to 4096). `bounds` are those of the plants, by variant.
    ///
    /// # Errors
    /// [`ScatterError::Size`] for the cell size, [`ScatterError::TooManyVariants`] and [`ScatterError::PlantSize`] for
    /// the bounds, [`ScatterError::UnknownVariant`] and [`ScatterError::Unpackable`] for the first tree that cannot be
    /// packed, [`ScatterError::TooManyTrees`] beyond 2³² - 1 trees.
    pub fn new(stand: &Stand, cell_size: f64, bounds: &[PlantSize]) -> Result<Self, ScatterError> {
        if !(1.0..=4096.0).contains(&cell_size) {
            let remedy = format!("give 1 to 4096 m, such as {DEFAULT_CELL_SIZE}");
            return Err(ScatterError::Size { what: "the cell size", value: cell_size, remedy });
        }
        check_bounds(bounds)?;
        if u32::try_from(stand.trees.len()).is_err() {
            return Err(ScatterError::TooManyTrees { count: stand.trees.len() as f64, limit: u32::MAX });
        }
        let pack = |(place, tree): (usize, &Tree)| {
            if usize::from(tree.variant) >= bounds.len() {
                return Err(ScatterError::UnknownVariant { tree: place, variant: tree.variant, count: bounds.len() });
            }
            let packed = PackedTree::pack(tree, place, cell_size)?;
            let (ix, iz) = packed.cell_index();
            Ok((u64::from(morton(ix, iz)) << 32 | place as u64, packed))
        };
        let packed: Result<Vec<(u64, PackedTree)>, _> = stand.trees.par_iter().enumerate().map(pack).collect();
        let mut packed = match packed {
            Ok(packed) => packed,
            // Threads race for the error they report; the user gets the first one in order.
            Err(error) => {
                return Err(stand.trees.iter().enumerate().find_map(|tree| pack(tree).err()).unwrap_or(error));
            }
        };
        packed.par_sort_unstable_by_key(|&(key, _)| key);
        let indices = packed.iter().map(|&(key, _)| stand.trees[(key & 0xFFFF_FFFF) as usize].index).collect();
        let trees: Vec<PackedTree> = packed.into_iter().map(|(_, tree)| tree).collect();

        let mut starts = Vec::new();
        let mut first = 0;
        for group in trees.chunk_by(|a, b| a.cell == b.cell) {
            starts.push((first, group));
            first += group.len() as u32;
        }
        let cells = starts.par_iter().map(|&(first, group)| cell(first, group, cell_size, bounds)).collect();
        Ok(Self { trees, indices, cells, cell_size })
    }
}

/// Refuses bounds of too many variants, or that are not usable as lengths.
pub(super) fn check_bounds(bounds: &[PlantSize]) -> Result<(), ScatterError> {
    if bounds.len() > MAX_VARIANTS {
        return Err(ScatterError::TooManyVariants { count: bounds.len(), limit: MAX_VARIANTS });
    }
    for (variant, bound) in bounds.iter().enumerate() {
        for (what, value) in [("radius", bound.radius), ("height", bound.height)] {
            if !(0.0..=MAX_PLANT_M).contains(&value) {
                return Err(ScatterError::PlantSize { variant, what, value });
            }
        }
    }
    Ok(())
}

/// The cell of `group`, which is not empty. Boxes hold the trees as they are drawn, after rounding.
fn cell(first: u32, group: &[PackedTree], cell_size: f64, bounds: &[PlantSize]) -> Cell {
    let (mut min, mut max, mut max_scale) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0f32);
    for tree in group {
        let foot = tree.position(cell_size);
        let scale = f64::from(tree.scale());
        let bound = bounds[usize::from(tree.variant())];
        let (radius, height) = (f64::from(bound.radius) * scale, f64::from(bound.height) * scale);
        min = min.min(foot - DVec3::new(radius, 0.0, radius));
        max = max.max(foot + DVec3::new(radius, height, radius));
        max_scale = max_scale.max(tree.scale());
    }
    let (ix, iz) = group[0].cell_index();
    Cell { ix, iz, first, count: group.len() as u32, min, max, max_scale }
}

/// The bits of both coordinates, counted from -32768, in turn.
fn morton(ix: i16, iz: i16) -> u32 {
    let spread = |value: i16| {
        let mut bits = u32::from(value as u16 ^ 0x8000);
        bits = (bits | bits << 8) & 0x00FF_00FF;
        bits = (bits | bits << 4) & 0x0F0F_0F0F;
        bits = (bits | bits << 2) & 0x3333_3333;
        (bits | bits << 1) & 0x5555_5555
    };
    spread(ix) | spread(iz) << 1
}
