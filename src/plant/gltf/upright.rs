//! Which axis of a file points up.
//!
//! glTF demands y [glTF 2.0 specification, section 3.4]. Files that a program has written without turning them have z there,
//! and the tree lies on its side.

use std::collections::BTreeMap;

use glam::Vec3;

use super::error::{WarningKind, Warnings};
use super::material::Surface;
use super::nodes::Placement;
use super::{GltfOptions, Placed, UpAxis};
use crate::plant::{PartKind, PlantMesh};

/// Least and greatest corner of some parts; `None` if they have no vertices.
pub(super) fn bounds<'a>(placed: impl Iterator<Item = &'a Placed>) -> Option<(Vec3, Vec3)> {
    let mut positions = placed.flat_map(|placed| &placed.piece.mesh.positions);
    let first = *positions.next()?;
    Some(positions.fold((first, first), |(low, high), position| (low.min(*position), high.max(*position))))
}

/// Whether z is up: as the caller says, or because the tree stands on the plane z = 0 and lies around the plane y = 0.
pub(super) fn up_is_z(
    placed: &[Placed],
    surfaces: &BTreeMap<Option<usize>, Surface>,
    options: &GltfOptions,
    warnings: &mut Warnings,
) -> bool {
    if let Some(up) = options.up {
        return up == UpAxis::Z;
    }
    let Some((low, high)) = bounds(placed.iter()) else { return false };
    if stands_along_z(low, high) {
        let message = "the tree stands along z and is turned upright; the scene's `up: Z` says so without this warning, `up: Y` \
                       keeps it as it is";
        warnings.push(WarningKind::Repaired, "", message);
        return true;
    }
    if seems_to_lie(placed, surfaces) {
        let message = "the trunk lies along z: if the tree is modelled with z up, state `up: Z`";
        warnings.push(WarningKind::Missing, "", message);
    }
    false
}

/// Whether a tree between these corners stands on the plane z = 0, while a quarter of it and more would be below y = 0.
fn stands_along_z(low: Vec3, high: Vec3) -> bool {
    let size = high - low;
    let around_zero = low.y < -0.25 * size.y && high.y > 0.25 * size.y;
    around_zero && low.z > -0.06 * size.z && low.z < 0.06 * size.z && size.z > 0.6 * size.y.max(size.x)
}

/// Whether the end of the wood that is farthest from the leaves lies beside them in z, not below.
fn seems_to_lie(placed: &[Placed], surfaces: &BTreeMap<Option<usize>, Surface>) -> bool {
    let of = |kind: PartKind| {
        let is = move |placed: &&Placed| surfaces.get(&placed.material).is_some_and(|surface| surface.kind == kind);
        placed.iter().filter(is).flat_map(|placed| &placed.piece.mesh.positions)
    };
    let mean = |positions: &mut dyn Iterator<Item = Vec3>| {
        let (sum, count) = positions.fold((glam::DVec3::ZERO, 0.0), |(sum, n), p| (sum + p.as_dvec3(), n + 1.0));
        (count > 0.0).then(|| (sum / count).as_vec3())
    };
    let Some(leaves) = mean(&mut of(PartKind::Foliage).copied()) else { return false };
    let farthest = of(PartKind::Wood).map(|position| position.distance(leaves)).fold(0.0, f32::max);
    let far = |position: &&Vec3| position.distance(leaves) > 0.95 * farthest;
    let Some(end) = mean(&mut of(PartKind::Wood).filter(far).copied()) else { return false };
    let spread = of(PartKind::Wood).filter(far).map(|position| position.distance(end)).fold(0.0, f32::max);
    let along = leaves - end;
    // One end, not several branches around.
    spread < 0.3 * farthest && along.z > 3.0 * along.y.abs() && along.z > 3.0 * along.x.abs()
}

/// The most trees of a file that become individuals of their own: each is baked.
pub(super) const MOST_INDIVIDUALS: usize = 64;

/// The trees that a file holds side by side: branches of its nodes of about the same height that stand apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct SideBySide {
    /// What each is called, at least two; none for a file of one tree.
    pub names: Vec<String>,
    /// Whether each can be chosen by its name.
    pub can_be_chosen: bool,
}

impl SideBySide {
    /// Warns that they are one plant here.
    pub fn mention(&self, warnings: &mut Warnings) {
        let Some(first) = self.names.first() else { return };
        let remedy = if self.names.len() > MOST_INDIVIDUALS {
            format!("more than {MOST_INDIVIDUALS} are drawn as one plant: choose some with `node: [\"{first}\"]`")
        } else if self.can_be_chosen {
            format!("a scene makes each an individual; here they are one plant: choose one with `node: [\"{first}\"]`")
        } else {
            "they are drawn as one plant: give each a node with a name of its own".to_owned()
        };
        let (count, names) = (self.names.len(), super::roles::shortened(&self.names));
        let message = format!("the file seems to hold {count} trees side by side ({names}); {remedy}");
        warnings.push(WarningKind::Missing, "/nodes", message);
    }
}

/// The trees of a file, if there are several.
pub(super) fn side_by_side(root: &gltf::json::Root, placements: &[Placement], placed: &[Placed]) -> SideBySide {
    // The first level at which the nodes part.
    let depth = (0..4).find(|depth| {
        let mut nodes = placements.iter().map(|placement| placement.path.get(*depth));
        let first = nodes.next().flatten();
        first.is_some() && nodes.any(|node| node != first)
    });
    let Some(depth) = depth else { return SideBySide::default() };
    let mut groups: BTreeMap<usize, (Vec3, Vec3)> = BTreeMap::new();
    for placed in placed {
        let node = placements.get(placed.placement).and_then(|placement| placement.path.get(depth));
        if let Some((node, (low, high))) = node.zip(bounds(std::iter::once(placed))) {
            let group = groups.entry(*node).or_insert((low, high));
            *group = (group.0.min(low), group.1.max(high));
        }
    }
    let tallest = groups.values().map(|(low, high)| high.y - low.y).fold(0.0, f32::max);
    let foot = groups.values().map(|(low, _)| low.y).fold(f32::INFINITY, f32::min);
    let trees: Vec<(usize, (Vec3, Vec3))> = groups
        .into_iter()
        .filter(|(_, (low, high))| high.y - low.y > 0.4 * tallest && low.y - foot < 0.1 * tallest)
        .collect();
    // Trees side by side stand farther apart than a third of their width.
    let apart = |a: &(Vec3, Vec3), b: &(Vec3, Vec3)| {
        let (middle, width) = (0.5 * (a.0 + a.1) - 0.5 * (b.0 + b.1), 0.5 * ((a.1 - a.0) + (b.1 - b.0)));
        middle.x.abs() > 0.7 * width.x || middle.z.abs() > 0.7 * width.z
    };
    let all_apart = trees.iter().enumerate().all(|(at, (_, a))| trees.iter().skip(at + 1).all(|(_, b)| apart(a, b)));
    if trees.len() < 2 || !all_apart {
        return SideBySide::default();
    }
    let name = |node: usize| root.nodes.get(node).and_then(|node| node.name.as_deref()).filter(|name| !name.is_empty());
    // `node:` takes nodes and meshes of a name, and all below them.
    let chooses_this_alone = |node: usize, name: &str| {
        let of_name = |placement: &&Placement| super::roles::names(root, placement).any(|other| other == name);
        placements.iter().filter(of_name).all(|placement| placement.path.get(depth) == Some(&node))
    };
    SideBySide {
        can_be_chosen: trees.iter().all(|(node, _)| name(*node).is_some_and(|name| chooses_this_alone(*node, name))),
        names: trees
            .iter()
            .map(|(node, _)| name(*node).map_or_else(|| format!("node {node}"), str::to_owned))
            .collect(),
    }
}

/// Turns a mesh with z up: what was up along z is up along y, to the east stays to the east.
pub(super) fn turn(mesh: &mut PlantMesh) {
    for vector in mesh.positions.iter_mut().chain(&mut mesh.normals) {
        *vector = Vec3::new(vector.x, vector.z, -vector.y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_along_z_are_known() {
        assert!(stands_along_z(Vec3::new(-2.7, -2.9, 0.0), Vec3::new(6.4, 2.9, 10.1)));
        assert!(stands_along_z(Vec3::new(-3.0, -3.0, -0.2), Vec3::new(3.0, 3.0, 5.0)));
        // Upright, with roots; centred on the origin; a bush; a flat picture.
        assert!(!stands_along_z(Vec3::new(-3.0, -0.3, -3.0), Vec3::new(3.0, 10.0, 3.0)));
        assert!(!stands_along_z(Vec3::new(-3.0, -5.0, -3.0), Vec3::new(3.0, 5.0, 3.0)));
        assert!(!stands_along_z(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 1.0, 1.0)));
        assert!(!stands_along_z(Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0)));
    }
}
