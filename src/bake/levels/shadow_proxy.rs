//! The shadow proxy: a lighter model that looks the same from afar, with fewer and larger leaf cards and only thick
//! wood.
//!
//! Stochastic simplification [Cook, Halstead, Planck & Ryu 2007, "Stochastic Simplification of Aggregate Detail"]: it
//! keeps an evenly chosen subset of many similar elements (their section 3.1) and enlarges them so that the total area
//! stays the same (3.2). An element is a connected piece of foliage, a card. The order in which elements are dropped
//! does not depend on the target, so the elements of a smaller model are a subset of those of a larger one.
//!
//! Equal area does not mean equal *projected* area: cards grow in clumps along twigs; enlarged ones extend beyond their
//! clump and overlap less. So the scale is corrected until the area of the outline, rasterised from several directions,
//! equals that of the full model.
//!
//! Limits: an element is kept or dropped as a whole, so foliage of one single connected surface, or a trunk that is
//! welded to all its branches, is not simplified; the result may then have more triangles than the target.

use glam::Vec3;

use super::rasterize::{View, projected_area};
use crate::math::hash::mix32;
use crate::plant::geometry::{self, Element};
use crate::plant::{PartKind, Plant, PlantMesh, PlantPart};

/// A lighter model that casts the near sun shadow: the meshes of [`simplify_foliage`], one per part in the plant's
/// order (a part that lost all its triangles has an empty mesh).
pub fn shadow_proxy(plant: &Plant, triangle_target: usize) -> Vec<PlantMesh> {
    simplify_foliage(plant, triangle_target).parts.into_iter().map(|part| part.mesh).collect()
}

/// A model of about `triangle_target` triangles (wood and foliage together, shared out as in the original) with the
/// projected area of the full one. Parts, materials and their order stay. A target at or above the plant's own count
/// returns the plant itself. A part with foliage keeps at least one element, a part with wood its thickest branch.
pub fn simplify_foliage(plant: &Plant, triangle_target: usize) -> Plant {
    let total: usize = plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    if triangle_target >= total {
        return plant.clone();
    }
    let Some(bounds) = plant.bounds() else { return plant.clone() };
    let elements: Vec<Vec<Element>> = plant.parts.iter().map(|part| geometry::elements(&part.mesh)).collect();

    // Wood first: triangles that it has to keep are taken from the foliage's share, so that the total is right.
    let share = |part: &PlantPart| (triangle_target as f64 * part.mesh.triangles.len() as f64 / total as f64) as usize;
    let mut kept: Vec<Vec<u32>> = vec![Vec::new(); plant.parts.len()];
    for (index, part) in plant.parts.iter().enumerate().filter(|(_, part)| part.kind == PartKind::Wood) {
        kept[index] = stoutest(part, &elements[index], share(part));
    }
    let count = |index: usize, kept: &[u32]| -> usize {
        kept.iter().map(|&element| elements[index][element as usize].triangles.len()).sum()
    };
    let wood: usize = kept.iter().enumerate().map(|(index, kept)| count(index, kept)).sum();
    let leaves = plant.triangle_count(PartKind::Foliage);
    for (index, part) in plant.parts.iter().enumerate().filter(|(_, part)| part.kind == PartKind::Foliage) {
        let remaining = triangle_target.saturating_sub(wood) as f64;
        let target = (remaining * part.mesh.triangles.len() as f64 / leaves.max(1) as f64) as usize;
        kept[index] = evenly_chosen(&elements[index], bounds.min, bounds.size().max_element(), target);
    }

    let build = |correction: f32| Plant {
        name: plant.name.clone(),
        parts: plant
            .parts
            .iter()
            .enumerate()
            .map(|(index, part)| {
                let scale = match part.kind {
                    PartKind::Wood => 1.0,
                    PartKind::Foliage => correction * area_keeping_scale(&elements[index], &kept[index]),
                };
                let (mesh, _) = extract(&part.mesh, &elements[index], &kept[index], scale);
                PlantPart { kind: part.kind, mesh, material: part.material.clone() }
            })
            .collect(),
    };
    calibrate(plant, build, |model| model)
}

/// Finds the scale with which what `build` makes, `drawn` as a plant, has the projected area of `plant` in the mean over
/// five directions.
pub(super) fn calibrate<T>(plant: &Plant, build: impl Fn(f32) -> T, drawn: impl Fn(&T) -> &Plant) -> T {
    const RESOLUTION: u32 = 320;
    const STEPS: usize = 4;
    const GOOD_ENOUGH: f32 = 0.01;
    // Larger cards reach over the box, so the frame is wider than the plant.
    let Some(bounds) = plant.bounds() else { return build(1.0) };
    let views =
        [Vec3::X, Vec3::Z, Vec3::Y, Vec3::new(1.0, 1.0, 1.0).normalize(), Vec3::new(-1.0, 0.5, 1.0).normalize()].map(
            |toward| {
                let view = View::framing(bounds, toward);
                View { right: 1.25 * view.right, up: 1.25 * view.up, ..view }
            },
        );
    let seen = |model: &Plant| -> f32 { views.iter().map(|view| projected_area(model, view, RESOLUTION)).sum() };
    let wanted = seen(plant);
    if wanted <= 0.0 {
        return build(1.0);
    }
    // Scale against relative area: fixed-point steps with the slope of the last two models, clamped, because a dense
    // crown's outline hardly reacts and a sparse one's grows with the square.
    let mut best = (f32::INFINITY, build(1.0));
    let (mut scale, mut last) = (1.0f32, None::<(f32, f32)>);
    for _ in 0..STEPS {
        let model = build(scale);
        let excess = seen(drawn(&model)) / wanted - 1.0;
        if excess.abs() < best.0 {
            best = (excess.abs(), model);
        }
        if excess.abs() < GOOD_ENOUGH {
            break;
        }
        let slope = last.map_or(1.0, |(s, e)| (excess - e) / (scale - s));
        let slope = if slope.is_finite() { slope.clamp(0.25, 2.0) } else { 1.0 };
        last = Some((scale, excess));
        scale = (scale - excess / slope).clamp(0.5, 2.0);
    }
    best.1
}

/// The branches that give the most area a triangle, as long as the target lasts; at least one. Area a triangle grows
/// with a branch's radius, so twigs go first.
fn stoutest(part: &PlantPart, elements: &[Element], target: usize) -> Vec<u32> {
    let yield_of = |index: &u32| {
        let element = &elements[*index as usize];
        element.area / element.triangles.len() as f32
    };
    let mut order: Vec<u32> = (0..elements.len() as u32).collect();
    order.sort_by(|a, b| yield_of(b).total_cmp(&yield_of(a)).then(a.cmp(b)));
    take_up_to(part.mesh.triangles.len().min(target), elements, order)
}

/// An even choice over the crown: elements are sorted along a space-filling curve through coarse cells (at random
/// within a cell, so that no orientation that a cell's cards alternate in is preferred) and taken in the order of the
/// radical inverse of their rank, whose every beginning is spread evenly.
pub(super) fn evenly_chosen(elements: &[Element], origin: Vec3, extent: f32, target: usize) -> Vec<u32> {
    const CELLS: f32 = 32.0;
    let mut curve: Vec<(u32, u32, u32)> = elements
        .iter()
        .enumerate()
        .map(|(index, element)| {
            let cell = ((element.center - origin) / extent * CELLS).clamp(Vec3::ZERO, Vec3::splat(CELLS - 1.0));
            let cell = cell.as_uvec3();
            (interleave(cell.x) | interleave(cell.y) << 1 | interleave(cell.z) << 2, mix32(index as u32), index as u32)
        })
        .collect();
    curve.sort_unstable();
    let mut order: Vec<(u32, u32)> =
        curve.iter().enumerate().map(|(rank, &(_, _, index))| ((rank as u32).reverse_bits(), index)).collect();
    order.sort_unstable();
    take_up_to(target, elements, order.into_iter().map(|(_, index)| index))
}

/// Takes elements in the given order while their triangles fit into `target`, at least the first; ascending.
fn take_up_to(target: usize, elements: &[Element], order: impl IntoIterator<Item = u32>) -> Vec<u32> {
    let mut left = target;
    let mut taken = Vec::new();
    for index in order {
        let size = elements[index as usize].triangles.len();
        if size > left && !taken.is_empty() {
            break;
        }
        left = left.saturating_sub(size);
        taken.push(index);
    }
    taken.sort_unstable();
    taken
}

/// Linear factor by which the kept elements grow to the area of all.
pub(super) fn area_keeping_scale(elements: &[Element], kept: &[u32]) -> f32 {
    let all: f64 = elements.iter().map(|element| f64::from(element.area)).sum();
    let rest: f64 = kept.iter().map(|&index| f64::from(elements[index as usize].area)).sum();
    let scale = (all / rest).sqrt() as f32;
    if scale.is_finite() { scale } else { 1.0 }
}

/// The mesh of the kept elements, each scaled about its centre, and for each of its vertices that of the whole mesh.
pub(super) fn extract(mesh: &PlantMesh, elements: &[Element], kept: &[u32], scale: f32) -> (PlantMesh, Vec<u32>) {
    let mut out = PlantMesh::default();
    let mut sources = Vec::new();
    let mut slots = vec![u32::MAX; mesh.positions.len()];
    for &index in kept {
        let element = &elements[index as usize];
        // A vertex that two elements share is moved with each: so places are forgotten from element to element.
        let corners = || element.triangles.iter().flat_map(|&t| mesh.triangles[t as usize]);
        corners().for_each(|corner| slots[corner as usize] = u32::MAX);
        for &triangle in &element.triangles {
            let moved = mesh.triangles[triangle as usize].map(|corner| {
                let from = corner as usize;
                if slots[from] == u32::MAX {
                    slots[from] = out.positions.len() as u32;
                    out.positions.push(element.center + scale * (mesh.positions[from] - element.center));
                    out.normals.push(mesh.normals[from]);
                    out.uvs.push(mesh.uvs[from]);
                    sources.push(corner);
                }
                slots[from]
            });
            out.triangles.push(moved);
        }
    }
    (out, sources)
}

/// Spreads the lowest ten bits of `bits` to every third bit.
fn interleave(bits: u32) -> u32 {
    let mut x = bits & 0x3ff;
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_interleaved() {
        assert_eq!(interleave(0b1_0110), 0b1_000_001_001_000);
        assert_eq!(interleave(0x3ff), 0x0924_9249);
    }

    #[test]
    fn the_choice_is_even_and_a_smaller_one_is_part_of_a_larger() {
        // Cards on a lattice of 16 x 16 x 4, two per lattice point.
        let elements: Vec<Element> = (0..2048u32)
            .map(|i| {
                let slot = i / 2;
                let center = Vec3::new((slot % 16) as f32, (slot / 16 % 16) as f32, (slot / 256) as f32);
                Element { triangles: vec![2 * i, 2 * i + 1], area: 1.0, center }
            })
            .collect();
        let choose = |target| evenly_chosen(&elements, Vec3::ZERO, 16.0, target);
        let (few, more) = (choose(512), choose(1024));
        assert_eq!((few.len(), more.len()), (256, 512));
        assert!(few.iter().all(|index| more.binary_search(index).is_ok()));
        // Each quarter of the crown has a quarter of the cards, and both cards of the places are chosen alike.
        for (x, y) in [(0.0, 0.0), (8.0, 0.0), (0.0, 8.0), (8.0, 8.0)] {
            let inside = few.iter().filter(|&&index| {
                let c = elements[index as usize].center;
                (x..x + 8.0).contains(&c.x) && (y..y + 8.0).contains(&c.y)
            });
            assert!(inside.count().abs_diff(64) <= 6);
        }
        assert!(few.iter().filter(|&&index| index % 2 == 0).count().abs_diff(128) < 40);
    }
}
