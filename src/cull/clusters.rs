//! Clusters: the boxes that culling looks at before it looks at single trees.
//!
//! A cluster is a run of at most [`CLUSTER_TREES`] trees of one cell. Their number is bounded, so that one thread of the
//! device can look at all of them. A page is a part of a stand whose trees fit into one storage buffer.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::{
    lod::level_distance::{GREATEST_FACTOR, LEAST_FACTOR, distance_factor, inverse_height},
    scatter::{
        CellGrid, PackedStand, PackedTree, PlantSize,
        packed::{CELL_BITS, POSITION_STEPS},
    },
};

/// The most trees of a cluster.
pub const CLUSTER_TREES: usize = 64;

/// The most clusters of a page: the compute pass sorts them by a word that holds a cluster and its key.
pub const MOST_CLUSTERS: usize = (1 << CLUSTER_BITS) - 1;

/// Bits of a cluster's index; the other bits of a word are its key.
pub const CLUSTER_BITS: u32 = 20;

/// Parts of a metre in which [`TreeSize`] counts.
pub const SIZE_STEPS: f32 = 16.0;

/// Largest size of a plant at scale 1, in the same steps: a kilometre and a little.
const LARGEST_SIZE: f32 = 16_384.0;

/// Limit of a box's corner, relative to its cell's corner, in steps of a position.
const FARTHEST_CORNER: f64 = (1 << 28) as f64;

/// A run of trees of one cell, and the box around them, crowns included. `Cluster` of `shaders/cull/volume.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Cluster {
    /// Column and row of the cell, packed as in [`PackedTree::cell`].
    pub cell: u32,
    /// Its first tree, counted from the page's first.
    pub first: u32,
    /// Number of its trees, 1 to [`CLUSTER_TREES`].
    pub count: u32,
    /// Western and northern edge of the box in steps of a position, counted from the cell's corner.
    pub low: [i32; 2],
    /// Eastern and southern edge.
    pub high: [i32; 2],
    /// Lowest foot, metres above the datum.
    pub bottom: f32,
    /// Highest top, metres above the datum.
    pub top: f32,
    /// Least and greatest [`distance_factor`] of its trees.
    pub factors: [u32; 2],
}

/// Size of a plant at scale 1 in steps of 1/[`SIZE_STEPS`] m, rounded up.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct TreeSize {
    /// Largest horizontal distance from the trunk's axis.
    pub radius: u32,
    /// Height above the foot.
    pub height: u32,
    /// Its [`inverse_height`].
    pub inverse_height: u32,
}

impl From<&PlantSize> for TreeSize {
    fn from(size: &PlantSize) -> Self {
        let steps = |metres: f32| (metres * SIZE_STEPS).ceil().clamp(0.0, LARGEST_SIZE) as u32;
        Self { radius: steps(size.radius), height: steps(size.height), inverse_height: inverse_height(size.height) }
    }
}

/// A part of a stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Its trees, as indices into [`PackedStand::trees`].
    pub trees: Range<usize>,
    /// Its clusters, in the order of the trees.
    pub clusters: Vec<Cluster>,
    /// Smallest corner of the box around its trees, in the stand's own metres.
    pub min: DVec3,
    /// Largest corner of that box.
    pub max: DVec3,
}

/// Splits `stand` into pages of at most `most_trees` trees (at least one cluster each) and [`MOST_CLUSTERS`] clusters.
/// `sizes` are those of the plants, by variant.
pub fn pages(stand: &PackedStand, sizes: &[PlantSize], most_trees: usize) -> Vec<Page> {
    let most_trees = most_trees.max(CLUSTER_TREES);
    let mut pages: Vec<Page> = Vec::new();
    for cell in &stand.cells {
        let all = cell.first as usize..cell.first as usize + cell.count as usize;
        let Some(trees) = stand.trees.get(all.clone()) else { continue };
        for (index, group) in trees.chunks(CLUSTER_TREES).enumerate() {
            let first = all.start + index * CLUSTER_TREES;
            let fits =
                |page: &Page| page.trees.len() + group.len() <= most_trees && page.clusters.len() < MOST_CLUSTERS;
            if !pages.last().is_some_and(fits) {
                let empty = DVec3::INFINITY;
                pages.push(Page { trees: first..first, clusters: Vec::new(), min: empty, max: -empty });
            }
            let Some(page) = pages.last_mut() else { continue };
            page.clusters.push(cluster(group, (first - page.trees.start) as u32, &stand.grid, sizes));
            page.trees.end = first + group.len();
            page.min = page.min.min(cell.min);
            page.max = page.max.max(cell.max);
        }
    }
    pages
}

/// The cluster of `group`, whose trees stand in one cell.
fn cluster(group: &[PackedTree], first: u32, grid: &CellGrid, sizes: &[PlantSize]) -> Cluster {
    let step = grid.size / f64::from(POSITION_STEPS);
    let mut cluster = Cluster {
        cell: group.first().map_or(0, |tree| tree.cell & ((1 << (2 * CELL_BITS)) - 1)),
        first,
        count: group.len() as u32,
        low: [i32::MAX; 2],
        high: [i32::MIN; 2],
        bottom: f32::INFINITY,
        top: f32::NEG_INFINITY,
        factors: [GREATEST_FACTOR, LEAST_FACTOR],
    };
    for tree in group {
        let scale = f64::from(tree.scale());
        let size = sizes.get(usize::from(tree.variant())).copied().unwrap_or_default();
        let radius = f64::from(size.radius) * scale / step;
        for (axis, at) in [tree.xz & 0xFFFF, tree.xz >> 16].into_iter().enumerate() {
            let corner = |value: f64| value.clamp(-FARTHEST_CORNER, FARTHEST_CORNER) as i32;
            cluster.low[axis] = cluster.low[axis].min(corner((f64::from(at) - radius).floor()));
            cluster.high[axis] = cluster.high[axis].max(corner((f64::from(at) + radius).ceil()));
        }
        let factor = distance_factor(tree, inverse_height(size.height));
        cluster.factors = [cluster.factors[0].min(factor), cluster.factors[1].max(factor)];
        cluster.bottom = cluster.bottom.min(tree.y);
        cluster.top = cluster.top.max(((f64::from(tree.y) + f64::from(size.height) * scale) as f32).next_up());
    }
    cluster
}
