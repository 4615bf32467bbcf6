//! Points sorted into compact groups of equal size, and the tree of boxes above the groups.
//!
//! A median split along the longest side, again and again, as in a k-d tree [Bentley 1975]: unlike the cells of a
//! grid every group is full whatever the density, and its box is as tight as its points. The tree is stored depth
//! first with the index of the node that follows a subtree, so that it is walked without a stack.
//!
//! Points that are not finite are in no group. The result depends on the points alone, not on the number of threads.

use glam::{Vec3, Vec3A};

/// A box that need not hold anything.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aabb {
    pub min: Vec3A,
    pub max: Vec3A,
}

impl Aabb {
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    /// The box around `points`.
    pub fn around(points: impl Iterator<Item = Vec3>) -> Self {
        points.map(Vec3A::from).fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    pub fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub fn center(&self) -> Vec3A {
        0.5 * self.min + 0.5 * self.max
    }

    pub fn size(&self) -> Vec3A {
        self.max - self.min
    }

    /// Squares of the least and the greatest distance between a point of one box and a point of the other.
    pub fn distances_squared(&self, other: &Self) -> (f32, f32) {
        let (below, above) = (other.min - self.max, self.min - other.max);
        let near = below.max(above).max(Vec3A::ZERO);
        // The farthest two points lie on opposite sides.
        let far = (-below).max(-above);
        (near.length_squared(), far.length_squared())
    }
}

/// One node of the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub bounds: Aabb,
    /// The node to go on with where this one's subtree is skipped.
    pub next: u32,
    /// The group of a leaf; [`Node::INNER`] for others, whose first child follows at once.
    pub group: u32,
}

impl Node {
    pub const INNER: u32 = u32::MAX;
}

/// The finite ones of `points` with their places, in an order in which each run of `size` is compact.
pub(super) fn compact_order(points: &[Vec3], size: usize) -> Vec<(Vec3, u32)> {
    let mut order: Vec<(Vec3, u32)> = points
        .iter()
        .enumerate()
        .take(u32::MAX as usize)
        .filter(|(_, point)| point.is_finite())
        .map(|(index, &point)| (point, index as u32))
        .collect();
    sort(&mut order, size.max(1));
    order
}

fn sort(points: &mut [(Vec3, u32)], size: usize) {
    /// Fewer points are not worth a second thread.
    const ALONE: usize = 4096;
    if points.len() <= size {
        points.sort_unstable_by_key(|(_, index)| *index);
        return;
    }
    let middle = first_half(points.len(), size);
    split_at(points, middle);
    let (left, right) = points.split_at_mut(middle);
    if left.len() > ALONE {
        rayon::join(|| sort(left, size), || sort(right, size));
    } else {
        sort(left, size);
        sort(right, size);
    }
}

/// How many of `count` points go into the first half: whole groups, so that only the last one may be short.
fn first_half(count: usize, size: usize) -> usize {
    count.div_ceil(size).div_ceil(2) * size
}

/// Moves the `middle` points that are first along the longest side of their box to the front. Equal coordinates are
/// told apart by index, so the halves are the same however the points came.
pub(super) fn split_at(points: &mut [(Vec3, u32)], middle: usize) {
    let size = Aabb::around(points.iter().map(|(point, _)| *point)).size();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    if (1..points.len()).contains(&middle) {
        points.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    }
}

/// The tree of boxes over the groups of `order`, a result of [`compact_order`] with the same `size`. The root is the
/// first node; no points, no nodes.
pub(super) fn tree(order: &[(Vec3, u32)], size: usize) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(2 * order.len().div_ceil(size));
    if !order.is_empty() {
        grow(order, 0, size, &mut nodes);
    }
    nodes
}

fn grow(points: &[(Vec3, u32)], first_group: usize, size: usize, nodes: &mut Vec<Node>) -> Aabb {
    let at = nodes.len();
    nodes.push(Node { bounds: Aabb::EMPTY, next: 0, group: Node::INNER });
    let bounds = if points.len() <= size {
        nodes[at].group = first_group as u32;
        Aabb::around(points.iter().map(|(point, _)| *point))
    } else {
        let (left, right) = points.split_at(first_half(points.len(), size));
        let left_bounds = grow(left, first_group, size, nodes);
        left_bounds.join(grow(right, first_group + left.len() / size, size, nodes))
    };
    nodes[at].bounds = bounds;
    nodes[at].next = nodes.len() as u32;
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_hold_every_finite_point_once_and_boxes_hold_their_groups() {
        let mut points: Vec<Vec3> = (0..1003u32)
            .map(|i| Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 71 % 89) as f32))
            .collect();
        points[5] = Vec3::NAN;
        points.extend([Vec3::ONE; 40]);
        let order = compact_order(&points, 8);
        let mut slots: Vec<u32> = order.iter().map(|(_, index)| *index).collect();
        slots.sort_unstable();
        assert_eq!(slots, (0..1043).filter(|i| *i != 5).collect::<Vec<u32>>());
        let nodes = tree(&order, 8);
        let groups: Vec<u32> = nodes.iter().filter(|n| n.group != Node::INNER).map(|n| n.group).collect();
        assert_eq!(groups, (0..order.len().div_ceil(8) as u32).collect::<Vec<_>>());
        for node in nodes.iter().filter(|n| n.group != Node::INNER) {
            for (point, _) in order.chunks(8).nth(node.group as usize).into_iter().flatten() {
                let p = Vec3A::from(*point);
                assert!(p.cmpge(node.bounds.min).all() && p.cmple(node.bounds.max).all());
            }
        }
    }

    #[test]
    fn box_distances() {
        let unit = Aabb { min: Vec3A::ZERO, max: Vec3A::ONE };
        let other = Aabb { min: Vec3A::new(3.0, 0.5, 0.0), max: Vec3A::new(4.0, 2.0, 1.0) };
        let (near, far) = unit.distances_squared(&other);
        assert_eq!((near, far), (4.0, 16.0 + 4.0 + 1.0));
        assert_eq!(unit.distances_squared(&unit), (0.0, 3.0));
    }
}
