//! What a view or a cascade can see, in whole numbers.
//!
//! The compute pass of [`render::cull`](crate::render::cull) and the functions here must agree about every tree, on every
//! device. Floating point does not give that: a device may fuse a product and a sum, and its roots and exponentials are
//! its own. So all decisions are made in 32-bit integers, whose results are exact. `shaders/cull/volume.wgsl` has the same
//! functions under the same names.
//!
//! Positions count in steps of the trees' own coding ([`packed`](crate::scatter::packed)), relative to the volume's anchor.
//! For plane tests they are coarser, so that they lie within ±2¹⁸, with normals of 10 bits: sums stay below 2³¹. Every
//! rounding is towards what is seen: a volume sees all that it would see exactly, and a little more (at most 0.2 % of
//! the distance and four units beside its planes).

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, IVec2, Vec4Swizzles};

use super::{
    Frustum,
    cascades::{CascadeBox, LOWEST_SINE},
    clusters::{Cluster, Page, SIZE_STEPS, TreeSize},
    lists::Grouping,
};
use crate::{
    lod::{
        Levels, MAX_LEVELS,
        level_distance::{FACTOR_ONE, GREATEST_FACTOR, distance_factor},
    },
    scatter::{
        CellGrid, PackedTree,
        packed::{CELL_BITS, POSITION_STEPS, SCALE_BITS, SCALE_SHIFT, scale_of_code},
    },
};

/// The most planes of a volume: six of a cascade's box and four of the view that sees its shadows.
pub const MAX_PLANES: usize = 10;
/// Coordinates in plane tests lie within ± this.
pub const COORDINATE_LIMIT: i32 = 1 << 18;
/// Components of a normal lie within ± this.
const NORMAL_LIMIT: f64 = 1023.0;
/// What rounding of coordinates moves a plane at most: four units.
pub const PLANE_SLACK: i32 = 4096;
/// Factors on a drop below the light's horizon from which on a plane is not tested, and drops that count as endless.
const STEEPEST: f64 = 8192.0;
/// Units of a drop from which on it counts as endless.
pub const ENDLESS_DROP: i32 = 1 << 15;
/// Distances are compared after a shift that leaves at most this.
pub const RING_LIMIT: u32 = 32_000;
/// A coordinate beyond this is not squared: three squares fit into a word.
pub const SQUARE_LIMIT: u32 = 37_837;
/// A coordinate beyond this is not multiplied by a factor.
pub const FACTOR_LIMIT: u32 = 1 << 20;
/// Keys of clusters lie below this.
pub const KEYS: u32 = 4096;
/// The anchor's cell is within ± this of the stand's base.
const FARTHEST_CELL: i32 = 1 << 14;
/// Finest unit of plane tests, metres.
const FINEST_UNIT: f64 = 1.0 / 64.0;

/// A distance. `Ring` of `shaders/cull/volume.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Ring {
    /// Coordinates are shifted right by this before they are squared.
    pub shift: u32,
    /// What is nearer has a smaller sum of squares.
    pub square: u32,
}

impl Ring {
    /// A distance that nothing reaches.
    const NEVER: Self = Self { shift: 31, square: u32::MAX };

    /// The distance of `metres` as a whole number of shifted steps of `step` metres, after `round` (which may also move
    /// it).
    fn new(metres: f64, step: f64, round: fn(f64) -> f64) -> Self {
        let steps = metres.max(0.0) / step;
        let told = f64::from(RING_LIMIT) * f64::from(1u32 << 15);
        if steps.is_nan() || steps >= told {
            return Self::NEVER;
        }
        let mut shift = 0;
        while steps / f64::from(1u32 << shift) > f64::from(RING_LIMIT) {
            shift += 1;
        }
        let rounded = round(steps / f64::from(1u32 << shift)).max(0.0) as u64;
        Self { shift, square: u32::try_from(rounded * rounded).unwrap_or(u32::MAX) }
    }

    /// Whether a position (steps from the anchor, absolute values) is nearer after `factor` over [`FACTOR_ONE`].
    pub fn is_beyond(self, position: [u32; 3], factor: u32) -> bool {
        let [x, y, z] = position.map(|value| {
            let shifted = (value >> self.shift).min(FACTOR_LIMIT);
            (shifted * factor / FACTOR_ONE).min(SQUARE_LIMIT)
        });
        x * x + y * y + z * z < self.square
    }
}

/// A level in a volume. `LevelRange` of `shaders/cull/volume.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct LevelRange {
    /// It is drawn from here on.
    pub begin: Ring,
    /// It is drawn up to here.
    pub end: Ring,
    /// Index of its first group.
    pub first_group: u32,
    /// 1 if its trees are grouped by variant.
    pub by_variant: u32,
}

/// A plane of a volume: what is inside has `normal · p + offset + drop_factor × drop >= 0`. `VolumePlane` of
/// `shaders/cull/volume.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct VolumePlane {
    /// Within ±1023.
    pub normal: [i32; 3],
    /// In the units of the product.
    pub offset: i32,
    /// Per unit of the box's top above the lowest receiver: how far a shadow that falls reaches across the plane.
    pub drop_factor: i32,
}

/// What a view or a cascade can see of one page. `Volume` of `shaders/cull/volume.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Volume {
    /// Cell of the anchor, counted from the base of the stand's grid.
    pub anchor_cell: [i32; 2],
    /// Steps of the anchor inside its cell.
    pub anchor_step: [i32; 2],
    /// Height of the anchor in units of heights.
    pub anchor_y: i32,
    /// Units of heights per metre, a power of two.
    pub y_scale: f32,
    /// Steps are shifted right by this for plane tests.
    pub shift: u32,
    /// Units of plane tests per 1/16 m, times 1024: horizontally, and of heights.
    pub size_factor: [u32; 2],
    /// Units of plane tests per unit of heights, times 1024; 0: heights do not count in the distances of levels.
    pub height_factor: u32,
    /// Lowest receiver of a shadow, in units of heights from the anchor.
    pub lowest: i32,
    /// 1: a tree belongs to the first level whose range contains it only.
    pub first_level_only: u32,
    /// Bits of the levels that take clusters as a whole.
    pub whole_levels: u32,
    /// 1: clusters are sorted along `key_normal`; else by their distance from the anchor.
    pub along_light: u32,
    /// Direction to the light, in the units of a plane's normal.
    pub key_normal: [i32; 3],
    /// The greatest product with it.
    pub key_offset: i32,
    /// Shift from a product to a key.
    pub key_shift: u32,
    /// Number of `planes`.
    pub plane_count: u32,
    /// Number of `levels`.
    pub level_count: u32,
    /// Number of clusters of the page.
    pub cluster_count: u32,
    /// Number of variants.
    pub variant_count: u32,
    /// Trees beyond this are not drawn.
    pub limit: Ring,
    /// The levels.
    pub levels: [LevelRange; MAX_LEVELS],
    /// The planes.
    pub planes: [VolumePlane; MAX_PLANES],
}

/// The shadows that a view can see: a caster counts only if the volume that it shades is visible.
#[derive(Clone, Debug)]
pub struct SeenShadows<'a> {
    /// The camera in scene metres.
    pub camera: DVec3,
    /// Its frustum, relative to it.
    pub frustum: &'a Frustum,
    /// Lowest ground in scene metres: a shadow goes no farther down.
    pub lowest: f64,
    /// Maximum distance between a visible point and the position at which it samples the map, metres.
    pub margin: f64,
}

/// A box in the units of plane tests, and its extent on the ground in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    low: [i32; 3],
    high: [i32; 3],
}

impl Bounds {
    /// Within the coordinates that products of planes hold.
    fn clamped(self) -> Self {
        let limit = COORDINATE_LIMIT;
        let clamp = |corner: [i32; 3]| corner.map(|value| value.clamp(-limit, limit));
        Self { low: clamp(self.low), high: clamp(self.high) }
    }

    /// What rounding may add to a plane's product with a corner of it, or take.
    fn slack(&self) -> i32 {
        let size: i32 = (0..3).map(|axis| self.low[axis].abs().max(self.high[axis].abs())).sum();
        (size >> 1) + PLANE_SLACK
    }
}

/// What is needed to build volumes: a page of a stand and the groups of its levels.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// The page.
    pub page: &'a Page,
    /// The grid of its stand.
    pub grid: CellGrid,
    /// One for each level.
    pub groupings: &'a [Grouping],
    /// Number of variants.
    pub variants: usize,
}

impl Volume {
    /// A volume around `anchor` (in the stand's own metres) in which plane tests reach `range` metres.
    fn around(anchor: DVec3, range: f64, drawn: &Drawn) -> (Self, f64, f64) {
        let grid = drawn.grid;
        let step = grid.size / f64::from(POSITION_STEPS);
        let cell = (anchor / grid.size).floor();
        let cells = IVec2::new(cell.x as i32, cell.z as i32).saturating_sub(grid.base);
        let near = cells.clamp(IVec2::splat(-FARTHEST_CELL), IVec2::splat(FARTHEST_CELL));
        let inside = |value: f64, cell: f64| ((value / grid.size - cell) * f64::from(POSITION_STEPS)) as i32;
        let mut shift = 0;
        let unit = |shift: u32| step * f64::from(1u32 << shift);
        while shift < 20 && (unit(shift) < FINEST_UNIT || range > unit(shift) * f64::from(COORDINATE_LIMIT - 64)) {
            shift += 1;
        }
        let unit = unit(shift);
        // The power of two next to the unit: multiplication by it is exact.
        let y_scale = (-unit.log2()).round().exp2();
        let factor = |unit: f64| (1024.0 / (f64::from(SIZE_STEPS) * unit)).ceil() as u32 + 1;
        let mut volume = Self {
            anchor_cell: near.to_array(),
            anchor_step: [inside(anchor.x, cell.x), inside(anchor.z, cell.z)],
            anchor_y: (anchor.y * y_scale).floor().clamp(-1e9, 1e9) as i32,
            y_scale: y_scale as f32,
            shift,
            size_factor: [factor(unit), factor(y_scale.recip())],
            level_count: drawn.groupings.len().min(MAX_LEVELS) as u32,
            cluster_count: drawn.page.clusters.len() as u32,
            variant_count: drawn.variants as u32,
            // From so far away nothing is seen, and steps would not fit into a word.
            limit: if near == cells { Ring::NEVER } else { Ring::default() },
            ..Self::default()
        };
        let mut group = 0;
        for (level, grouping) in volume.levels.iter_mut().zip(drawn.groupings) {
            level.first_group = group;
            level.by_variant = u32::from(*grouping == Grouping::ByVariant);
            group += grouping.groups(drawn.variants) as u32;
        }
        (volume, unit, y_scale.recip())
    }

    /// Adds the plane `normal · p + offset >= 0`, in metres from the anchor; `drop` is what a metre of drop adds. A plane
    /// that cannot be told in whole numbers is left out.
    fn bound(&mut self, normal: DVec3, offset: f64, drop: f64, unit: f64, y_unit: f64) {
        let units = normal * DVec3::new(unit, y_unit, unit);
        let scale = NORMAL_LIMIT / units.abs().max_element();
        let (normal, offset, drop) = (units * scale, (offset * scale).ceil(), (drop * y_unit * scale).ceil());
        let slot = self.planes.get_mut(self.plane_count as usize);
        let told = normal.is_finite() && (-3e8..=3e8).contains(&offset) && drop <= STEEPEST;
        if let Some(slot) = slot.filter(|_| told) {
            *slot = VolumePlane {
                normal: normal.round().as_ivec3().to_array(),
                offset: offset as i32,
                drop_factor: drop.max(0.0) as i32,
            };
            self.plane_count += 1;
        }
    }

    /// Sorts clusters from the light in `direction` (unit) outwards; the farthest is `range` metres from the anchor.
    fn sort_along(&mut self, direction: DVec3, unit: f64, y_unit: f64, range: f64) {
        let units = direction * DVec3::new(unit, y_unit, unit);
        let scale = NORMAL_LIMIT / units.abs().max_element().max(1e-9);
        self.along_light = 1;
        self.key_normal = (units * scale).round().as_ivec3().to_array();
        self.key_offset = (range * scale).clamp(0.0, 5e8) as i32;
        self.key_shift = (2 * self.key_offset as u32 / KEYS).checked_ilog2().map_or(0, |bits| bits + 1);
    }

    /// What a camera at `camera` (in the stand's own metres) sees. `frustum` is relative to it; trees beyond
    /// `view_distance` metres are left out.
    pub fn view(drawn: &Drawn, camera: DVec3, frustum: &Frustum, levels: &Levels, view_distance: f32) -> Self {
        let step = drawn.grid.size / f64::from(POSITION_STEPS);
        let farthest = (drawn.page.min - camera).abs().max((drawn.page.max - camera).abs()).length();
        let range = farthest.min(f64::from(view_distance) + (drawn.page.max - drawn.page.min).y);
        let (mut volume, unit, y_unit) = Self::around(camera, range, drawn);
        if volume.limit == Ring::NEVER {
            volume.limit = Ring::new(view_distance.into(), step, f64::round);
        }
        volume.height_factor = (1024.0 * y_unit / unit).round() as u32;
        // What rounding of heights, and of coordinates before and after the factor, moves a distance at most.
        let slack = f64::from(GREATEST_FACTOR / FACTOR_ONE) * (unit + y_unit);
        for (index, level) in volume.levels.iter_mut().enumerate().take(drawn.groupings.len()) {
            // A tree near the end of a band is listed if in doubt; its alpha test decides.
            level.begin = levels.fade_in(index).map_or(Ring::default(), |fade| {
                Ring::new(f64::from(fade.start) - slack, step, |steps| steps.floor() - 4.0)
            });
            level.end = levels
                .fade_out(index)
                .map_or(Ring::NEVER, |fade| Ring::new(f64::from(fade.end) + slack, step, |steps| steps.ceil() + 1.0));
            if level.by_variant == 0 {
                volume.whole_levels |= 1 << index;
            }
        }
        for plane in frustum.planes() {
            volume.bound(plane.xyz().as_dvec3(), plane.w.into(), 0.0, unit, y_unit);
        }
        volume
    }

    /// The casters of a cascade whose box lies in scene metres; `origin` is the stand's own origin there.
    ///
    /// `casting` has a range of distances from the box's centre, metres, for each level: a tree casts in the first level
    /// whose range contains it, and not at all if there is none. With `seen`, casters whose shadow is visible in no pixel
    /// of the view are left out.
    pub fn cascade(
        drawn: &Drawn,
        origin: DVec3,
        cascade: &CascadeBox,
        casting: &[Range<f64>],
        seen: Option<&SeenShadows>,
    ) -> Self {
        let frame = super::cascades::light_frame(cascade.direction);
        let CascadeBox { half_width, half_depth, distance_to_light, .. } = *cascade;
        let range = half_width * 2f64.sqrt() + half_depth.max(distance_to_light);
        let (mut volume, unit, y_unit) = Self::around(cascade.center - origin, range, drawn);
        volume.cast(drawn, casting);
        for (normal, reach) in [
            (frame.x_axis, half_width),
            (-frame.x_axis, half_width),
            (frame.y_axis, half_width),
            (-frame.y_axis, half_width),
            (frame.z_axis, half_depth),
            (-frame.z_axis, distance_to_light),
        ] {
            volume.bound(normal, reach, 0.0, unit, y_unit);
        }
        if let Some(seen) = seen {
            let below = (seen.lowest - cascade.center.y - seen.margin) / y_unit;
            volume.lowest = below.floor().max(-f64::from(COORDINATE_LIMIT)).min(f64::from(COORDINATE_LIMIT)) as i32 - 1;
            let direction = cascade.direction;
            for plane in seen.frustum.planes() {
                let normal = plane.xyz().as_dvec3();
                let offset = f64::from(plane.w) + normal.dot(cascade.center - seen.camera) + seen.margin;
                let drop = -normal.dot(direction) / direction.y.max(LOWEST_SINE);
                volume.bound(normal, offset, drop, unit, y_unit);
            }
        }
        volume.sort_along(cascade.direction, unit, y_unit, range);
        volume
    }

    /// The casters of a light whose view is bounded by `frustum`, which is relative to `anchor` (in the stand's own
    /// metres) and unbounded along the light. `casting` counts from the anchor.
    pub fn light_view(
        drawn: &Drawn,
        anchor: DVec3,
        frustum: &Frustum,
        direction: DVec3,
        casting: &[Range<f64>],
    ) -> Self {
        let range = (drawn.page.min - anchor).abs().max((drawn.page.max - anchor).abs()).length();
        let (mut volume, unit, y_unit) = Self::around(anchor, range, drawn);
        volume.cast(drawn, casting);
        for plane in frustum.planes() {
            volume.bound(plane.xyz().as_dvec3(), plane.w.into(), 0.0, unit, y_unit);
        }
        volume.sort_along(direction, unit, y_unit, range);
        volume
    }

    fn cast(&mut self, drawn: &Drawn, casting: &[Range<f64>]) {
        let step = drawn.grid.size / f64::from(POSITION_STEPS);
        self.first_level_only = 1;
        for (level, range) in self.levels.iter_mut().zip(casting) {
            level.begin = Ring::new(range.start, step, f64::round);
            level.end = Ring::new(range.end, step, f64::round);
        }
    }

    /// Corners of a cluster's box on the ground in steps from the anchor.
    fn ground_box(&self, cluster: &Cluster) -> [[i32; 2]; 2] {
        let corner = |axis: usize, side: [i32; 2]| {
            let cell = signed_cell(cluster.cell, axis) - self.anchor_cell[axis];
            cell.wrapping_mul(POSITION_STEPS as i32).wrapping_add(side[axis] - self.anchor_step[axis])
        };
        [[corner(0, cluster.low), corner(1, cluster.low)], [corner(0, cluster.high), corner(1, cluster.high)]]
    }

    /// A height in its units, relative to the anchor.
    fn height(&self, metres: f32) -> i32 {
        // A product with a power of two is exact.
        ((metres * self.y_scale).floor() as i32).wrapping_sub(self.anchor_y)
    }

    /// The box of a cluster.
    fn cluster_bounds(&self, cluster: &Cluster) -> Bounds {
        let [low, high] = self.ground_box(cluster);
        Bounds {
            low: [low[0] >> self.shift, self.height(cluster.bottom), low[1] >> self.shift],
            high: [(high[0] >> self.shift) + 1, self.height(cluster.top) + 1, (high[1] >> self.shift) + 1],
        }
    }

    /// A tree's foot on the ground in steps from the anchor.
    fn ground_position(&self, tree: &PackedTree) -> [i32; 2] {
        let at = [tree.xz & 0xFFFF, tree.xz >> 16];
        [0, 1].map(|axis: usize| {
            let cell = signed_cell(tree.cell, axis) - self.anchor_cell[axis];
            cell.wrapping_mul(POSITION_STEPS as i32).wrapping_add(at[axis] as i32 - self.anchor_step[axis])
        })
    }

    /// The box of a tree of `size` whose foot is at `position`.
    fn tree_bounds(&self, tree: &PackedTree, size: TreeSize, position: [i32; 2]) -> Bounds {
        let scale = scale_bound(tree.look);
        let units = |steps: u32, factor: u32| (((((steps * scale) >> 8) + 1) * factor) >> 10) as i32 + 1;
        let (radius, height) = (units(size.radius, self.size_factor[0]), units(size.height, self.size_factor[1]));
        let [x, z] = position.map(|value| value >> self.shift);
        let y = self.height(tree.y);
        Bounds { low: [x - radius, y, z - radius], high: [x + 1 + radius, y + 1 + height, z + 1 + radius] }
    }

    /// Whether anything in a box may be inside.
    fn sees(&self, bounds: &Bounds) -> bool {
        let limit = COORDINATE_LIMIT;
        let outside = (0..3).any(|axis| bounds.low[axis] > limit || bounds.high[axis] < -limit);
        let inside = bounds.clamped();
        let (Bounds { low, high }, slack) = (inside, inside.slack());
        let drop = (high[1] - self.lowest).max(0);
        let inside = self.planes.iter().take(self.plane_count as usize).all(|plane| {
            let product: i32 = (0..3).map(|axis| farthest(plane.normal[axis], low[axis], high[axis])).sum();
            let endless = plane.drop_factor > 0 && drop >= ENDLESS_DROP;
            endless || product + plane.offset + slack + plane.drop_factor * drop.min(ENDLESS_DROP) >= 0
        });
        !outside && inside
    }

    /// Whether a plane may cut a box.
    fn cuts(&self, bounds: &Bounds) -> bool {
        let inside = bounds.clamped();
        let (Bounds { low, high }, slack) = (inside, inside.slack());
        self.planes.iter().take(self.plane_count as usize).any(|plane| {
            let product: i32 = (0..3).map(|axis| -farthest(-plane.normal[axis], low[axis], high[axis])).sum();
            product + plane.offset - slack < 0
        })
    }

    /// A difference of heights in steps, if heights count.
    fn height_steps(&self, units: u32) -> u32 {
        let coarse = (units.min(COORDINATE_LIMIT as u32) * self.height_factor) >> 10;
        coarse.min((i32::MAX as u32) >> self.shift) << self.shift
    }

    /// The levels in which a tree at `position` (steps from the anchor, absolute values) is drawn, as bits; `factor` is
    /// its [`distance_factor`].
    fn levels_at(&self, position: [u32; 3], factor: u32) -> u32 {
        let mut bits = 0u32;
        for (index, level) in self.levels.iter().enumerate().take(self.level_count as usize) {
            if !level.begin.is_beyond(position, factor) && level.end.is_beyond(position, factor) {
                bits |= 1 << index;
            }
        }
        if self.first_level_only == 1 { bits & bits.wrapping_neg() } else { bits }
    }

    /// The levels in which a tree of `size` is drawn, as bits; none if it is not seen.
    pub fn levels_of_tree(&self, tree: &PackedTree, size: TreeSize) -> u32 {
        let position = self.ground_position(tree);
        let [x, z] = position.map(i32::unsigned_abs);
        if !self.limit.is_beyond([x, 0, z], FACTOR_ONE) || !self.sees(&self.tree_bounds(tree, size, position)) {
            return 0;
        }
        let y = self.height_steps(self.height(tree.y).unsigned_abs());
        self.levels_at([x, y, z], distance_factor(tree, size.inverse_height))
    }

    /// What is known of a cluster without a look at its trees.
    pub fn look_at(&self, cluster: &Cluster) -> ClusterLook {
        let [low, high] = self.ground_box(cluster);
        let near = [0, 1].map(|axis: usize| low[axis].max(-high[axis]).max(0) as u32);
        let far = [0, 1].map(|axis: usize| low[axis].unsigned_abs().max(high[axis].unsigned_abs()));
        let bounds = self.cluster_bounds(cluster);
        if !self.limit.is_beyond([near[0], 0, near[1]], FACTOR_ONE) || !self.sees(&bounds) {
            return ClusterLook::Hidden;
        }
        let (bottom, top) = (bounds.low[1], bounds.high[1]);
        let nearest = [near[0], self.height_steps(bottom.max(top.wrapping_neg()).max(0) as u32), near[1]];
        let farthest = [far[0], self.height_steps(bottom.unsigned_abs().max(top.unsigned_abs())), far[1]];
        let [least, most] = cluster.factors;
        let (mut possible, mut certain) = (0u32, 0u32);
        for (index, level) in self.levels.iter().enumerate().take(self.level_count as usize) {
            if !level.begin.is_beyond(farthest, most) && level.end.is_beyond(nearest, least) {
                possible |= 1 << index;
            }
            if !level.begin.is_beyond(nearest, least) && level.end.is_beyond(farthest, most) {
                certain |= 1 << index;
            }
        }
        let whole = certain & self.whole_levels;
        let key = self.key(&bounds, near);
        if possible == 0 {
            ClusterLook::Hidden
        } else if self.limit.is_beyond([far[0], 0, far[1]], FACTOR_ONE) && whole == possible && whole.is_power_of_two()
        {
            ClusterLook::Whole { key, level: whole.trailing_zeros() }
        } else {
            ClusterLook::Mixed { key }
        }
    }

    /// A cluster's key: less is drawn earlier. In views, those that no plane cuts come first: where one triangle is clipped, software
    /// rasterisers draw some hundreds before and after it slowly too.
    fn key(&self, bounds: &Bounds, near: [u32; 2]) -> u32 {
        if self.along_light == 1 {
            let limit = COORDINATE_LIMIT;
            let reach: i32 = (0..3)
                .map(|axis| {
                    let side = |value: i32| value.clamp(-limit, limit);
                    farthest(self.key_normal[axis], side(bounds.low[axis]), side(bounds.high[axis]))
                })
                .sum();
            return ((self.key_offset - reach).max(0) as u32 >> self.key_shift).min(KEYS - 1);
        }
        let [x, z] = near.map(|value| (value >> self.limit_shift()).min(SQUARE_LIMIT));
        let square = (x * x + z * z) | 1;
        // A floating-point number with 6 bits of a fraction: as fine as 0.8 % of the distance.
        let exponent = square.ilog2();
        u32::from(self.cuts(bounds)) << 11 | exponent << 6 | (square << (31 - exponent)) >> 25 & 0x3F
    }

    /// The shift at which distances are compared to sort by them.
    fn limit_shift(&self) -> u32 {
        // A coordinate in plane tests has 18 bits, a squared one 15.
        self.shift + 3
    }
}

/// The greatest product of a component of a normal with a coordinate between `low` and `high`.
fn farthest(normal: i32, low: i32, high: i32) -> i32 {
    normal * if normal >= 0 { high } else { low }
}

/// Column (axis 0) or row (1) of a cell, counted from the grid's base.
fn signed_cell(cell: u32, axis: usize) -> i32 {
    let first = CELL_BITS * axis as u32;
    (cell << (32 - CELL_BITS - first)) as i32 >> (32 - CELL_BITS)
}

/// An upper bound of a tree's scale, times 256: at most 6.2 % above it.
fn scale_bound(look: u32) -> u32 {
    scale_of_code(look >> SCALE_SHIFT & ((1 << SCALE_BITS) - 1)) + 1
}

/// What is known of a cluster without a look at its trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClusterLook {
    /// No tree of it is drawn.
    Hidden,
    /// All its trees are drawn in one level.
    Whole {
        /// Clusters of smaller keys are drawn earlier.
        key: u32,
        /// The level.
        level: u32,
    },
    /// Its trees are looked at one by one.
    Mixed {
        /// Clusters of smaller keys are drawn earlier.
        key: u32,
    },
}
