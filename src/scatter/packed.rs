//! A stand for the GPU: 16 bytes per tree, trees sorted by square cells of ground.
//!
//! ```text
//! word 0  xz    u16 x | u16 z << 16         position in the cell, 0..=65535 for 0..=cell size (WGSL unpack2x16unorm)
//! word 1  y     f32                         metres above the datum
//! word 2  cell  i14 ix | i14 iz << 14 | upper 4 bits of the variant << 28
//! word 3  look  yaw 8 | scale 12 | lower 6 bits of the variant | tint 6    from the lowest bit up
//! ```
//!
//! Cells are counted from the base cell of the stand's [`CellGrid`]: cell (ix, iz) of the grid covers
//! [(base + ix) s, (base + ix + 1) s) along X and the same along Z. So a stand can lie anywhere; it is at most
//! 2¹⁴ cells wide (1,048 km at 64 m).
//!
//! An f32 position would have steps of 0.125 m at 2,000 km and needs 12 bytes; cells give the same step everywhere, and
//! the camera-relative position is `(cell - camera_cell) * s + position`, in which the large numbers cancel as
//! integers.
//!
//! | value | coding | largest error |
//! |---|---|---|
//! | x, z | unorm 16 of the cell | s / 131070 (0.49 mm at 64 m) |
//! | y | f32 | 2⁻²⁴ of itself (0.24 mm at 4,096 m) |
//! | yaw | 256 steps per rotation | π/256 rad (0.7°) |
//! | scale | 4096 steps from 1/16 to 16, even in the logarithm | 0.068 % |
//! | variant | 0..=1023 | 0 |
//! | tint | -31..=31 | 1/62 |

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, IVec2};
use rayon::prelude::*;

use super::ScatterError;
use super::stand::{MAX_SCALE, MIN_SCALE, Stand, Tree};

/// Default side of a cell, metres; positions up to ±2,097,152 m are possible.
pub const DEFAULT_CELL_SIZE: f64 = 64.0;

/// The most plant variants a packed stand can name.
pub const MAX_VARIANTS: usize = 1 << (VARIANT_LOW_BITS + VARIANT_HIGH_BITS);

/// The most cells that a stand may span along one axis.
pub const MAX_CELLS: i32 = 1 << CELL_BITS;

/// Largest height above or below the datum, metres: there f32 has steps of 8 mm.
pub const MAX_HEIGHT_M: f64 = 100_000.0;

/// Largest radius and height of a plant at scale 1, metres.
pub const MAX_PLANT_M: f32 = 1000.0;

/// Steps of a position along a cell's side.
pub const POSITION_STEPS: f32 = 65535.0;
/// Bits of the yaw, the lowest of [`PackedTree::look`].
pub const YAW_BITS: u32 = 8;
/// First bit of the scale.
pub const SCALE_SHIFT: u32 = YAW_BITS;
/// Bits of the scale.
pub const SCALE_BITS: u32 = 12;
/// First of the variant's lower bits in [`PackedTree::look`].
pub const VARIANT_LOW_SHIFT: u32 = SCALE_SHIFT + SCALE_BITS;
/// Number of the variant's lower bits.
pub const VARIANT_LOW_BITS: u32 = 6;
/// First bit of the tint.
pub const TINT_SHIFT: u32 = VARIANT_LOW_SHIFT + VARIANT_LOW_BITS;
/// Bits of the tint, two's complement: the uppermost.
pub const TINT_BITS: u32 = 32 - TINT_SHIFT;
/// Bits of a cell's column, the lowest of [`PackedTree::cell`], and of its row, which follow; two's complement.
pub const CELL_BITS: u32 = 14;
/// First of the variant's upper bits in [`PackedTree::cell`].
pub const VARIANT_HIGH_SHIFT: u32 = 2 * CELL_BITS;
/// Number of the variant's upper bits.
pub const VARIANT_HIGH_BITS: u32 = 32 - VARIANT_HIGH_SHIFT;
/// Steps of the scale, even in the logarithm.
pub const SCALE_STEPS: f32 = ((1 << SCALE_BITS) - 1) as f32;
/// Binary logarithm of the smallest scale.
pub const LEAST_SCALE_LOG2: f32 = -4.0;
/// Binary logarithm of the largest scale over the smallest.
pub const SCALE_OCTAVES: f32 = 8.0;
/// Steps of the tint on either side of 0.
pub const TINT_STEPS: f32 = ((1 << (TINT_BITS - 1)) - 1) as f32;

/// The scale of a code, times 256: the same whole number on every device. Octaves are interpolated linearly, so it is up to
/// 6.2 % too large. Times the scale of the opposite code (`SCALE_STEPS - code`) it is about 1.
/// `shaders/forest/instance.wgsl` has the same function.
pub const fn scale_of_code(code: u32) -> u32 {
    // 1/4096 octaves, rounded up.
    let octaves = 8 * code + 8;
    ((4096 + (octaves & 4095)) << (octaves >> 12)) >> 8
}

/// The lowest `bits` bits.
const fn mask(bits: u32) -> u32 {
    (1 << bits) - 1
}

/// The grid of cells of a packed stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellGrid {
    /// Side of a cell, metres.
    pub size: f64,
    /// The cell (column, row) from which packed trees count theirs.
    pub base: IVec2,
}

impl CellGrid {
    /// Cells of `size` metres counted from the one whose north-western corner is the origin.
    pub fn new(size: f64) -> Self {
        Self { size, base: IVec2::ZERO }
    }

    /// Column (or row) of the cell that holds the coordinate `value` in metres, counted from the origin, and where in
    /// it, 0..=1. `None` beyond ±2¹⁵ cells.
    fn locate(&self, value: f64) -> Option<(i32, f64)> {
        let cell = (value / self.size).floor();
        (f64::from(i16::MIN)..=f64::from(i16::MAX)).contains(&cell).then(|| (cell as i32, value / self.size - cell))
    }

    /// The grid whose base is the middle of the cells of `stand`. Trees without a cell do not count: packing refuses
    /// them.
    ///
    /// # Errors
    /// [`ScatterError::TooWide`] for a stand of more than [`MAX_CELLS`] cells along an axis.
    fn around(stand: &Stand, size: f64) -> Result<Self, ScatterError> {
        let mut grid = Self::new(size);
        let axes: [(&'static str, fn(&Tree) -> f64); 2] =
            [("X", |tree| tree.position.x), ("Z", |tree| tree.position.z)];
        for (axis, (what, coordinate)) in axes.into_iter().enumerate() {
            let cells = stand.trees.par_iter().filter_map(|tree| grid.locate(coordinate(tree)).map(|(cell, _)| cell));
            let ends = cells.map(|cell| (cell, cell)).reduce_with(|a, b| (a.0.min(b.0), a.1.max(b.1)));
            let Some((first, last)) = ends else { continue };
            let cells = last - first + 1;
            if cells > MAX_CELLS {
                let least = (f64::from(cells + 1) * size / f64::from(MAX_CELLS)).ceil();
                return Err(ScatterError::TooWide {
                    axis: what,
                    width: f64::from(cells) * size,
                    cell_size: size,
                    least,
                });
            }
            grid.base[axis] = (first + last + 1).div_euclid(2);
        }
        Ok(grid)
    }
}

/// One tree; see the module for its bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PackedTree {
    /// Position in the cell: x in the lower 16 bits, z in the upper.
    pub xz: u32,
    /// Height of the foot above the datum, metres.
    pub y: f32,
    /// The cell, counted from the grid's base, and the upper bits of the variant.
    pub cell: u32,
    /// Yaw, scale, lower bits of the variant, tint.
    pub look: u32,
}

impl PackedTree {
    /// Packs `tree`, whose position in its stand's list is `index`, for the cells of `grid`.
    ///
    /// # Errors
    /// [`ScatterError::Unpackable`] for a value outside of what the module's table can hold, or not a number.
    pub fn pack(tree: &Tree, index: usize, grid: &CellGrid) -> Result<Self, ScatterError> {
        let fail =
            |what, value: f64, remedy: String| Err(ScatterError::Unpackable { tree: index, what, value, remedy });
        let DVec3 { x, y, z } = tree.position;
        let axis = |value: f64, base: i32| {
            let (cell, share) = grid.locate(value)?;
            let inside = ((share * f64::from(POSITION_STEPS)).round() as u32).min(POSITION_STEPS as u32);
            let cell = cell.checked_sub(base).filter(|cell| (-MAX_CELLS / 2..MAX_CELLS / 2).contains(cell))?;
            Some((cell as u32 & mask(CELL_BITS), inside))
        };
        let reach = |base: i32| {
            let (middle, half) = (f64::from(base) * grid.size, f64::from(MAX_CELLS / 2 - 1) * grid.size);
            let (least, most) = (f64::from(i16::MIN) * grid.size, f64::from(i16::MAX) * grid.size);
            format!("stay within {} to {} m or take larger cells", least.max(middle - half), most.min(middle + half))
        };
        let Some((ix, step_x)) = axis(x, grid.base.x) else { return fail("x", x, reach(grid.base.x)) };
        let Some((iz, step_z)) = axis(z, grid.base.y) else { return fail("z", z, reach(grid.base.y)) };
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
        let variant = u32::from(tree.variant);
        Ok(Self {
            xz: step_x | step_z << 16,
            y: y as f32,
            cell: ix | iz << CELL_BITS | variant >> VARIANT_LOW_BITS << VARIANT_HIGH_SHIFT,
            look: yaw & mask(YAW_BITS)
                | (scale & mask(SCALE_BITS)) << SCALE_SHIFT
                | (variant & mask(VARIANT_LOW_BITS)) << VARIANT_LOW_SHIFT
                | tint << TINT_SHIFT,
        })
    }

    /// The cell (column, row), counted from the origin.
    pub fn cell_index(&self, grid: &CellGrid) -> (i32, i32) {
        // Two's complement: the arithmetic shift extends the sign.
        let signed = |first: u32| (self.cell << (32 - CELL_BITS - first)) as i32 >> (32 - CELL_BITS);
        (grid.base.x.wrapping_add(signed(0)), grid.base.y.wrapping_add(signed(CELL_BITS)))
    }

    /// Scene-local position of the foot, metres.
    pub fn position(&self, grid: &CellGrid) -> DVec3 {
        let (ix, iz) = self.cell_index(grid);
        let axis = |cell: i32, step: u32| (f64::from(cell) + f64::from(step) / f64::from(POSITION_STEPS)) * grid.size;
        DVec3::new(axis(ix, self.xz & 0xFFFF), self.y.into(), axis(iz, self.xz >> 16))
    }

    /// Yaw about the trunk, radians, 0 to 2π.
    pub fn yaw(&self) -> f32 {
        (self.look & mask(YAW_BITS)) as f32 * (TAU / (1 << YAW_BITS) as f32)
    }

    /// Factor on the plant's size.
    pub fn scale(&self) -> f32 {
        ((self.look >> SCALE_SHIFT & mask(SCALE_BITS)) as f32 * (SCALE_OCTAVES / SCALE_STEPS) + LEAST_SCALE_LOG2).exp2()
    }

    /// Index of its plant.
    pub fn variant(&self) -> u16 {
        let high = self.cell >> VARIANT_HIGH_SHIFT;
        (self.look >> VARIANT_LOW_SHIFT & mask(VARIANT_LOW_BITS) | high << VARIANT_LOW_BITS) as u16
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
    pub ix: i32,
    /// Row: Z of its northern edge over the cell size.
    pub iz: i32,
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
    /// Where the cells lie.
    pub grid: CellGrid,
}

impl PackedStand {
    /// Packs `stand` into cells of `cell_size` metres (1 to 4096). `bounds` are those of the plants, by variant.
    ///
    /// # Errors
    /// [`ScatterError::Size`] for the cell size, [`ScatterError::TooManyVariants`] and [`ScatterError::PlantSize`] for
    /// the bounds, [`ScatterError::UnknownVariant`] and [`ScatterError::Unpackable`] for the first tree that cannot be
    /// packed, [`ScatterError::TooWide`] for trees that lie too far apart for the cells, [`ScatterError::TooManyTrees`]
    /// beyond 2³² - 1 trees.
    pub fn new(stand: &Stand, cell_size: f64, bounds: &[PlantSize]) -> Result<Self, ScatterError> {
        if !(1.0..=4096.0).contains(&cell_size) {
            let remedy = format!("give 1 to 4096 m, such as {DEFAULT_CELL_SIZE}");
            return Err(ScatterError::Size { what: "the cell size", value: cell_size, remedy });
        }
        check_bounds(bounds)?;
        if u32::try_from(stand.trees.len()).is_err() {
            return Err(ScatterError::TooManyTrees { count: stand.trees.len() as f64, limit: u32::MAX });
        }
        let grid = CellGrid::around(stand, cell_size)?;
        let pack = |(index, tree): (usize, &Tree)| {
            if usize::from(tree.variant) >= bounds.len() {
                return Err(ScatterError::UnknownVariant { tree: index, variant: tree.variant, count: bounds.len() });
            }
            let packed = PackedTree::pack(tree, index, &grid)?;
            let (ix, iz) = packed.cell_index(&grid);
            Ok((u64::from(morton(ix, iz)) << 32 | index as u64, packed))
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
        for group in trees.chunk_by(|a, b| a.cell_index(&grid) == b.cell_index(&grid)) {
            starts.push((first, group));
            first += group.len() as u32;
        }
        let cells = starts.par_iter().map(|&(first, group)| cell(first, group, &grid, bounds)).collect();
        Ok(Self { trees, indices, cells, grid })
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
fn cell(first: u32, group: &[PackedTree], grid: &CellGrid, bounds: &[PlantSize]) -> Cell {
    let (mut min, mut max, mut max_scale) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0f32);
    for tree in group {
        let foot = tree.position(grid);
        let scale = f64::from(tree.scale());
        let bound = bounds[usize::from(tree.variant())];
        let (radius, height) = (f64::from(bound.radius) * scale, f64::from(bound.height) * scale);
        min = min.min(foot - DVec3::new(radius, 0.0, radius));
        max = max.max(foot + DVec3::new(radius, height, radius));
        max_scale = max_scale.max(tree.scale());
    }
    let (ix, iz) = group[0].cell_index(grid);
    Cell { ix, iz, first, count: group.len() as u32, min, max, max_scale }
}

/// The bits of both coordinates, counted from -32768, interleaved.
fn morton(ix: i32, iz: i32) -> u32 {
    let spread = |value: i32| {
        let mut bits = u32::from(value as u16 ^ 0x8000);
        bits = (bits | bits << 8) & 0x00FF_00FF;
        bits = (bits | bits << 4) & 0x0F0F_0F0F;
        bits = (bits | bits << 2) & 0x3333_3333;
        (bits | bits << 1) & 0x5555_5555
    };
    spread(ix) | spread(iz) << 1
}
