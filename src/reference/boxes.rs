//! A tree of boxes over the instances of a scene.
//!
//! One instance a leaf, split by the surface area heuristic over 16 bins (Wald 2007, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies"). Corners are f32 relative to the middle of all boxes, rounded outwards; rays stay f64,
//! so that neither a camera nor a scene far from the origin loses a box.

use glam::{DVec3, Vec3};

use super::camera::WorldRay;

/// Bins along an axis.
const BINS: usize = 16;

/// A box in scene metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WorldBox {
    pub min: DVec3,
    pub max: DVec3,
}

/// 32 bytes. The left child follows its parent; `link` is the right one, or, with the highest bit, the item of a leaf.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: Vec3,
    link: u32,
    max: Vec3,
    _pad: u32,
}

const LEAF: u32 = 1 << 31;

/// Depth from which groups are halved as they come: what no heuristic splits well stays within [`STACK`].
const STEEP: u32 = 60;

/// Nodes that can wait in a walk, above [`STEEP`] and the 30 halvings of [`MOST_ITEMS`].
const STACK: usize = 96;

/// The most items.
pub(crate) const MOST_ITEMS: usize = 1 << 30;

/// The tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoxTree {
    middle: DVec3,
    nodes: Vec<Node>,
}

impl BoxTree {
    /// A tree over `boxes` (finite, at most [`MOST_ITEMS`]).
    pub fn new(boxes: &[WorldBox]) -> Self {
        let all = boxes
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), b| (low.min(b.min), high.max(b.max)));
        let middle = if boxes.is_empty() { DVec3::ZERO } else { 0.5 * (all.0 + all.1) };
        let mut items: Vec<Item> = boxes
            .iter()
            .enumerate()
            .map(|(index, b)| Item {
                min: (b.min - middle).as_vec3().map(f32::next_down),
                max: (b.max - middle).as_vec3().map(f32::next_up),
                index: index as u32,
            })
            .collect();
        let mut nodes = Vec::with_capacity(2 * items.len());
        // Ranges that still have no node, their depth, and the parent whose right child they are.
        let mut waiting = vec![(0, items.len(), 0, None)];
        while let Some((first, end, depth, parent)) = waiting.pop() {
            let here = nodes.len() as u32;
            if let Some(parent) = parent {
                let parent: &mut Node = &mut nodes[parent as usize];
                parent.link = here;
            }
            let Some(range) = items.get_mut(first..end).filter(|range| !range.is_empty()) else { continue };
            let (min, max) = around(range);
            if let [item] = range {
                nodes.push(Node { min, max, link: LEAF | item.index, _pad: 0 });
            } else {
                let left = if depth < STEEP { split(range) } else { range.len() / 2 };
                nodes.push(Node { min, max, link: 0, _pad: 0 });
                waiting.push((first + left, end, depth + 1, Some(here)));
                waiting.push((first, first + left, depth + 1, None));
            }
        }
        Self { middle, nodes }
    }

    /// Calls `visit` for the items whose boxes the ray meets, roughly from near to far, with the distance at which it
    /// enters the box (at least 0). `visit` returns the ray's new maximum distance; below 0 ends the walk.
    pub fn walk(&self, ray: &WorldRay, mut visit: impl FnMut(usize, f64, f64) -> f64) {
        let origin = ray.origin - self.middle;
        // A component of zero becomes one that is too small to matter, so that no 0 × ∞ arises.
        let inverse = ray.direction.map(|d| if d.abs() > 1e-150 { 1.0 / d } else { 1e150f64.copysign(d) });
        let enter = |node: &Node, max_distance: f64| {
            let low = (node.min.as_dvec3() - origin) * inverse;
            let high = (node.max.as_dvec3() - origin) * inverse;
            let near = low.min(high).max_element().max(0.0);
            let far = low.max(high).min_element().min(max_distance);
            (near <= far).then_some(near)
        };
        let mut max_distance = ray.t_max;
        let Some(start) = self.nodes.first().and_then(|root| enter(root, max_distance)) else { return };
        let mut stack = [(0u32, start); STACK];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (index, near) = stack[waiting];
            if near > max_distance {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.link & LEAF != 0 {
                max_distance = visit((node.link & !LEAF) as usize, near, max_distance);
                if max_distance < 0.0 {
                    return;
                }
                continue;
            }
            let left = enter(&self.nodes[index as usize + 1], max_distance).map(|t| (index + 1, t));
            let right = enter(&self.nodes[node.link as usize], max_distance).map(|t| (node.link, t));
            match (left, right) {
                (Some(a), Some(b)) => {
                    let (near, far) = if a.1 <= b.1 { (a, b) } else { (b, a) };
                    (stack[waiting], stack[waiting + 1]) = (far, near);
                    waiting += 2;
                }
                (one, other) => {
                    if let Some(only) = one.or(other) {
                        stack[waiting] = only;
                        waiting += 1;
                    }
                }
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Item {
    min: Vec3,
    max: Vec3,
    index: u32,
}

impl Item {
    fn centre(&self, axis: usize) -> f32 {
        0.5 * (self.min[axis] + self.max[axis])
    }
}

fn around(items: &[Item]) -> (Vec3, Vec3) {
    items.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), i| (min.min(i.min), max.max(i.max)))
}

fn half_area((min, max): (Vec3, Vec3)) -> f32 {
    let size = (max - min).max(Vec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Orders `items` (two or more) into two groups and returns the size of the first, which neither is empty nor all.
fn split(items: &mut [Item]) -> usize {
    let centres = items.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), item| {
        let centre = 0.5 * (item.min + item.max);
        (low.min(centre), high.max(centre))
    });
    let size = centres.1 - centres.0;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.z > size.y) + 1 };
    let bin = |item: &Item| (((item.centre(axis) - centres.0[axis]) / size[axis] * BINS as f32) as usize).min(BINS - 1);
    let nothing = (0, (Vec3::INFINITY, Vec3::NEG_INFINITY));
    let mut bins = [nothing; BINS];
    for item in items.iter() {
        let (count, (min, max)) = &mut bins[bin(item)];
        (*count, *min, *max) = (*count + 1, min.min(item.min), max.max(item.max));
    }
    let join = |a: (usize, (Vec3, Vec3)), b: (usize, (Vec3, Vec3))| (a.0 + b.0, (a.1.0.min(b.1.0), a.1.1.max(b.1.1)));
    let cost = |group: (usize, (Vec3, Vec3))| group.0 as f32 * half_area(group.1);
    let best = (1..BINS)
        .filter_map(|cut| {
            let left = bins[..cut].iter().copied().fold(nothing, join);
            let right = bins[cut..].iter().copied().fold(nothing, join);
            (left.0 > 0 && right.0 > 0).then(|| (cost(left) + cost(right), cut))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let count = best.map_or(0, |(_, cut)| {
        let (mut count, mut rest) = (0, Vec::new());
        // A stable partition, so that the tree is the same everywhere.
        for slot in 0..items.len() {
            if bin(&items[slot]) < cut {
                items[count] = items[slot];
                count += 1;
            } else {
                rest.push(items[slot]);
            }
        }
        items[count..].copy_from_slice(&rest);
        count
    });
    // All centres at one position, or none that can be compared: split by order.
    if count == 0 || count == items.len() { items.len() / 2 } else { count }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::PathSampler;

    fn boxes(count: u32, offset: DVec3) -> Vec<WorldBox> {
        (0..count)
            .map(|index| {
                let mut sampler = PathSampler::new(1, 0, index);
                let (a, b) = (sampler.pair().as_dvec2(), sampler.pair().as_dvec2());
                let min = offset + DVec3::new(a.x, b.x * 0.1, a.y) * 1000.0;
                WorldBox { min, max: min + DVec3::splat(1.0 + 20.0 * b.y) }
            })
            .collect()
    }

    fn hits(b: &WorldBox, ray: &WorldRay) -> bool {
        let (low, high) = ((b.min - ray.origin) / ray.direction, (b.max - ray.origin) / ray.direction);
        let near = low.min(high).max_element().max(0.0);
        near <= low.max(high).min_element().min(ray.t_max)
    }

    #[test]
    fn no_box_on_the_ray_is_missed_near_or_far_from_the_origin() {
        for offset in [DVec3::ZERO, DVec3::new(1.0e6, 300.0, -2.0e6)] {
            let boxes = boxes(500, offset);
            let tree = BoxTree::new(&boxes);
            for index in 0..200 {
                let mut sampler = PathSampler::new(2, 1, index);
                let (a, b) = (sampler.pair().as_dvec2(), sampler.pair().as_dvec2());
                let origin = offset + DVec3::new(a.x * 1000.0, 200.0 * b.x, a.y * 1000.0);
                let direction = DVec3::new(b.y - 0.5, a.x - 0.6, b.x - 0.5).normalize();
                let ray = WorldRay {
                    t_max: if index % 2 == 0 { 300.0 } else { f64::INFINITY },
                    ..WorldRay::new(origin, direction)
                };
                let mut seen = Vec::new();
                tree.walk(&ray, |item, _, max_distance| {
                    seen.push(item);
                    max_distance
                });
                for (item, b) in boxes.iter().enumerate() {
                    assert!(!hits(b, &ray) || seen.contains(&item), "box {item}, ray {index}");
                }
                assert!(seen.len() < 120);
            }
        }
    }

    #[test]
    fn degenerate_boxes_and_level_rays_are_found() {
        let flat = WorldBox { min: DVec3::ZERO, max: DVec3::new(1.0, 0.0, 1.0) };
        let tree = BoxTree::new(&[flat; 9]);
        let mut seen = 0;
        tree.walk(&WorldRay::new(DVec3::new(-1.0, 0.0, 0.5), DVec3::X), |_, near, max_distance| {
            assert!((near - 1.0).abs() < 1e-6);
            seen += 1;
            max_distance
        });
        assert_eq!(seen, 9);
        BoxTree::new(&[]).walk(&WorldRay::new(DVec3::ZERO, DVec3::X), |_, _, max_distance| max_distance);
    }
}
