//! Which meshes of a file are the tree: not its simplified levels, not the hull against which a game collides, not the ground
//! on which it was photographed.

use glam::Vec3;
use gltf::json::{Root, Value, scene::Node};

use super::GltfOptions;
use super::error::{WarningKind, Warnings};
use super::nodes::Placement;
use crate::math;

/// Thickness over width up to which a mesh is flat.
const FLAT: f32 = 0.02;
/// Share of the plant's height, from its lowest point, in which ground lies.
const LOW: f32 = 0.1;

/// The words of a name, in lower case.
fn words(name: &str) -> Vec<String> {
    math::names::words(name, str::to_lowercase)
}

/// The level of detail that a name states: 2 of `Oak_LOD2`, `oak lod 2`, `LOD02_bark`.
pub(super) fn level(name: &str) -> Option<u32> {
    let words = words(name);
    words.iter().enumerate().find_map(|(at, word)| {
        let number = word.strip_prefix("lod")?;
        let number = if number.is_empty() { words.get(at + 1)?.as_str() } else { number };
        number.parse().ok().filter(|level| *level < 16)
    })
}

/// Whether a name is that of the picture of a tree for far away, the coarsest of its levels.
pub(super) fn is_billboard(name: &str) -> bool {
    words(name).iter().any(|word| ["billboard", "billboards", "impostor", "imposter"].contains(&word.as_str()))
}

/// Whether a name is that of a collision hull, as game engines write it: `UCX_oak`, `oak-col`, `Collider`.
pub(super) fn is_hull(name: &str) -> bool {
    let words = words(name);
    let prefix = words.first().is_some_and(|word| ["ucx", "ubx", "usp", "ucp", "mcdcx"].contains(&word.as_str()));
    let any = words.iter().any(|word| {
        [
            "collision",
            "collisions",
            "collider",
            "colliders",
            "colmesh",
            "colonly",
            "convcol",
            "convcolonly",
            "hitbox",
            "occluder",
            "navmesh",
            "physics",
        ]
        .contains(&word.as_str())
    });
    let last = words.len() > 1 && words.last().is_some_and(|word| ["col", "hull"].contains(&word.as_str()));
    prefix || any || last
}

/// Whether a name may be that of a ground plane; leaves have such names, too.
pub(super) fn may_be_ground(name: &str) -> bool {
    words(name).iter().any(|word| {
        [
            "ground",
            "groundplane",
            "plane",
            "floor",
            "terrain",
            "grid",
            "soil",
            "base",
            "shadowcatcher",
            "shadowplane",
            "pedestal",
        ]
        .contains(&word.as_str())
    })
}

/// Names of a placement: of its node, of the nodes above it, of its mesh.
pub(super) fn names<'a>(root: &'a Root, placement: &'a Placement) -> impl Iterator<Item = &'a str> {
    let node = |index: &usize| root.nodes.get(*index).and_then(|node| node.name.as_deref());
    let nodes = placement.path.iter().rev().filter_map(node);
    nodes.chain(root.meshes.get(placement.mesh).and_then(|mesh| mesh.name.as_deref()))
}

/// The nodes that MSFT_lod names as coarser levels of another one.
pub(super) fn coarser_nodes(root: &Root) -> Vec<usize> {
    let ids = |node: &Node| -> Vec<usize> {
        let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get("MSFT_lod"));
        let list = extension.and_then(|extension| extension.get("ids")).and_then(Value::as_array);
        list.into_iter().flatten().filter_map(|id| usize::try_from(id.as_u64()?).ok()).collect()
    };
    root.nodes.iter().flat_map(ids).collect()
}

/// Keeps the placements that are the tree, by the caller's lists and by their names; says which are left out.
pub(super) fn keep_tree(
    root: &Root,
    placements: Vec<Placement>,
    options: &GltfOptions,
    warnings: &mut Warnings,
) -> Vec<Placement> {
    let listed = |placement: &Placement, list: &[String]| {
        names(root, placement).any(|name| list.iter().any(|listed| listed == name))
    };
    let known = |name: &&String| {
        let named = |other: Option<&String>| other == Some(*name);
        root.nodes.iter().any(|node| named(node.name.as_ref()))
            || root.meshes.iter().any(|mesh| named(mesh.name.as_ref()))
            || root.materials.iter().any(|material| named(material.name.as_ref()))
    };
    for name in options.node.iter().chain(&options.ignore).filter(|name| !known(name)) {
        let message = format!("the options name '{name}', and no node, mesh or material has that name");
        warnings.push(WarningKind::Missing, "/nodes", message);
    }
    let mut kept = placements;
    if !options.node.is_empty() {
        kept.retain(|placement| listed(placement, &options.node));
    }
    kept.retain(|placement| !listed(placement, &options.ignore));

    let hull = |placement: &Placement| {
        let node = placement.path.last().and_then(|node| root.nodes.get(*node)).and_then(|node| node.name.as_deref());
        let mesh = root.meshes.get(placement.mesh).and_then(|mesh| mesh.name.as_deref());
        node.into_iter().chain(mesh).any(is_hull)
    };
    // Where everything is a hull or a coarse level, that is the tree.
    if kept.iter().any(|placement| !hull(placement)) {
        let hulls: Vec<String> = kept.iter().filter(|placement| hull(placement)).map(|p| label(root, p)).collect();
        kept.retain(|placement| !hull(placement));
        if !hulls.is_empty() {
            let message = format!("collision hulls, which are not drawn: {}", shortened(&hulls));
            warnings.push(WarningKind::Ignored, "/nodes", message);
        }
    }
    let finest = kept.iter().filter_map(|placement| names(root, placement).find_map(level)).min();
    let coarser = |placement: &Placement| {
        let numbered = names(root, placement).find_map(level).zip(finest).is_some_and(|(level, finest)| level > finest);
        numbered || names(root, placement).any(is_billboard)
    };
    let coarse: Vec<String> = kept.iter().filter(|placement| coarser(placement)).map(|p| label(root, p)).collect();
    if !coarse.is_empty() && coarse.len() < kept.len() {
        kept.retain(|placement| !coarser(placement));
        let message = format!("coarser levels of detail, which are not drawn: {}", shortened(&coarse));
        warnings.push(WarningKind::Ignored, "/nodes", message);
    }
    kept
}

/// A placement in messages.
pub(super) fn label(root: &Root, placement: &Placement) -> String {
    names(root, placement).next().map_or_else(|| format!("node {}", placement.node), str::to_owned)
}

/// Some names of a list, for a message.
pub(super) fn shortened(names: &[String]) -> String {
    const LISTED: usize = 5;
    let mut text = names.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
    if names.len() > LISTED {
        text.push_str(&format!(" and {} more", names.len() - LISTED));
    }
    text
}

/// Whether a mesh with these corners is ground below a plant from `low` to `high`: flat, low, and as wide as it or wider.
pub(super) fn is_ground((least, most): (Vec3, Vec3), (low, high): (Vec3, Vec3), up_is_z: bool) -> bool {
    let turned = |v: Vec3| if up_is_z { Vec3::new(v.x, v.z, v.y) } else { v };
    let (least, most, low, high) = (turned(least), turned(most), turned(low), turned(high));
    let size = most - least;
    let width = size.x.min(size.z);
    let height = high.y - low.y;
    size.y <= FLAT * width.max(f32::MIN_POSITIVE) && most.y <= low.y + LOW * height && width >= 0.2 * height
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_read_from_names() {
        for (name, expected) in [
            ("Oak_LOD0", Some(0)),
            ("oak-lod2", Some(2)),
            ("LOD01_bark", Some(1)),
            ("Oak LOD 3", Some(3)),
            ("OakLod1", Some(1)),
            ("lodge", None),
            ("Oak.001", None),
            ("melody", None),
        ] {
            assert_eq!(level(name), expected, "{name}");
        }
    }

    #[test]
    fn hulls_and_ground_have_names() {
        for name in ["UCX_Oak_01", "oak-col", "Oak_Collision", "oak-convcolonly", "Collider", "tree_hull"] {
            assert!(is_hull(name), "{name}");
        }
        for name in ["Oak", "column", "color", "hull", "trunk"] {
            assert!(!is_hull(name), "{name}");
        }
        assert!(may_be_ground("Plane.001") && may_be_ground("GroundPlane") && !may_be_ground("Planetree"));
        let tree = (Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, 10.0, 3.0));
        let plane = (Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 0.0, 5.0));
        let leaf = (Vec3::new(0.0, 5.0, 0.0), Vec3::new(3.0, 5.0, 3.0));
        assert!(is_ground(plane, tree, false) && !is_ground(leaf, tree, false) && !is_ground(tree, tree, false));
    }
}
