//! Which trees a view draws, and with which representation.

use glam::{DVec3, Vec3};

use super::{
    Frustum,
    lists::{DrawLists, Grouping, ListBuilder},
};
use crate::{
    lod::Levels,
    scatter::{Cell, PackedStand, PlantSize},
};

/// The nearest and the farthest horizontal distance from `point` to a cell.
fn flat_distances(cell: &Cell, point: DVec3) -> (f64, f64) {
    let low = glam::DVec2::new(cell.min.x - point.x, cell.min.z - point.z);
    let high = glam::DVec2::new(cell.max.x - point.x, cell.max.z - point.z);
    (low.max(-high).max(glam::DVec2::ZERO).length(), low.abs().max(high.abs()).length())
}

/// Lists for a camera at `camera`, in the stand's own metres.
///
/// `frustum` is relative to the camera; trees beyond `view_distance` metres are left out. `groupings` has one entry for
/// each of the `levels`.
pub fn cull_view(
    stand: &PackedStand,
    sizes: &[PlantSize],
    camera: DVec3,
    frustum: &Frustum,
    levels: &Levels,
    groupings: &[Grouping],
    view_distance: f32,
) -> DrawLists {
    let mut cells: Vec<(f64, f64, usize)> = stand
        .cells
        .iter()
        .enumerate()
        .filter_map(|(index, cell)| {
            let (near, far) = flat_distances(cell, camera);
            let seen = near <= f64::from(view_distance)
                && frustum.sees_box((cell.min - camera).as_vec3(), (cell.max - camera).as_vec3());
            seen.then_some((near, far, index))
        })
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));

    let mut lists = ListBuilder::new(groupings, sizes.len());
    for (near, far, index) in cells {
        let cell = &stand.cells[index];
        let trees = cell.first..cell.first + cell.count;
        // A cell that lies in one level as a whole is taken as a whole, where its trees need not be told apart.
        let sole = levels.sole_level(near, far).filter(|&level| groupings.get(level) == Some(&Grouping::Together));
        if let Some(list) = sole.filter(|_| far <= f64::from(view_distance)).and_then(|level| lists.list(level, 0)) {
            list.extend(trees);
            continue;
        }
        for tree in trees {
            let Some(packed) = stand.trees.get(tree as usize) else { continue };
            let relative = (packed.position(&stand.grid) - camera).as_vec3();
            let distance = glam::Vec2::new(relative.x, relative.z).length();
            if distance > view_distance {
                continue;
            }
            let variant = packed.variant() as usize;
            let Some(size) = sizes.get(variant) else { continue };
            let scale = packed.scale();
            let half = 0.5 * size.height * scale;
            let radius = half.hypot(size.radius * scale);
            if !frustum.sees_sphere(relative + Vec3::Y * half, radius) {
                continue;
            }
            for level in (0..levels.len()).filter(|&level| levels.draws(level, distance)) {
                if let Some(list) = lists.list(level, variant) {
                    list.push(tree);
                }
            }
        }
    }
    DrawLists::assemble(lists.into_lists())
}
