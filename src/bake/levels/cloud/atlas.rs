//! The planes of a cloud as rectangles, and their texture atlas.
//!
//! All planes have the same number of texels per metre, as many as fit into the atlas. A rectangle is the smallest
//! around its pieces among those at a multiple of three degrees, lies with its longer side across, and keeps a few
//! transparent texels around it, so that the first mips do not mix neighbours.

use std::f32::consts::FRAC_PI_2;

use glam::{Quat, UVec2, Vec2, Vec3};

use super::{CloudPlane, cluster::Cluster, items::Item};
use crate::bake::levels::rasterize::PlacedTriangle;
use crate::plant::{PartKind, Plant};

/// Transparent texels around a rectangle.
const GUTTER: u32 = 4;
/// Rectangles with their gutters start and end at multiples of this many texels.
const ALIGNMENT: u32 = 8;

/// How leaves are laid into their planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Flattening {
    /// Linear factor on leaves about their centres.
    pub scale: f32,
    /// How far they turn into the plane: 0 projects them, 1 lays them flat.
    pub turn: f32,
}

/// A plane with the triangles that it shows.
pub(super) struct Sheet {
    pub center: Vec3,
    /// Half extents, metres; at right angles to each other and to the normal. The first is the longer one.
    pub u: Vec3,
    pub v: Vec3,
    /// Unit normal, away from the crown's centre; right-handed with u and v.
    pub normal: Vec3,
    pub triangles: Vec<PlacedTriangle>,
}

/// The sheet of a cluster. `crown` is the centre of the plant.
pub(super) fn sheet(plant: &Plant, items: &[Item], cluster: &Cluster, crown: Vec3, flat: Flattening) -> Sheet {
    let outward = cluster.normal.dot(cluster.center - crown) >= 0.0;
    let normal = if outward { cluster.normal } else { -cluster.normal };
    let (right, up) = normal.any_orthonormal_pair();
    let mut triangles = Vec::new();
    for item in cluster.items.iter().map(|&index| &items[index as usize]) {
        let part = &plant.parts[item.part as usize];
        let (scale, turn) = match part.kind {
            PartKind::Foliage => (flat.scale, turned(item.normal, normal, flat.turn)),
            PartKind::Wood => (1.0, Quat::IDENTITY),
        };
        let place = |position: Vec3| item.center + turn * (scale * (position - item.center));
        triangles.extend(item.triangles.iter().map(|&triangle| {
            let corners = part.mesh.triangles[triangle as usize].map(|corner| part.mesh.positions[corner as usize]);
            PlacedTriangle { part: item.part, triangle, corners: corners.map(place) }
        }));
    }
    let points: Vec<Vec2> = triangles
        .iter()
        .flat_map(|triangle| triangle.corners)
        .map(|corner| corner - cluster.center)
        .map(|offset| Vec2::new(offset.dot(right), offset.dot(up)))
        .collect();
    let (axis, low, high) = smallest_rectangle(&points);
    let across = axis.x * right + axis.y * up;
    // Right-handed with the normal.
    let along = normal.cross(across);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let center = cluster.center + middle.x * across + middle.y * along;
    Sheet { center, u: half.x * across, v: half.y * along, normal, triangles }
}

/// The rotation that turns a leaf's normal by the share `turn` of the way to `normal`, or to its opposite.
fn turned(own: Vec3, normal: Vec3, turn: f32) -> Quat {
    let target = if own.dot(normal) < 0.0 { -normal } else { normal };
    Quat::IDENTITY.slerp(Quat::from_rotation_arc(own, target), turn)
}

/// The direction of the longer side of the smallest rectangle around `points`, and its smallest and greatest
/// coordinates along that direction and the one a quarter turn to the left.
fn smallest_rectangle(points: &[Vec2]) -> (Vec2, Vec2, Vec2) {
    const ANGLES: u32 = 30;
    let mut best = (f32::INFINITY, (Vec2::X, Vec2::ZERO, Vec2::ZERO));
    for step in 0..ANGLES {
        let axis = Vec2::from_angle(FRAC_PI_2 * step as f32 / ANGLES as f32);
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for point in points {
            let at = Vec2::new(point.dot(axis), point.dot(axis.perp()));
            (low, high) = (low.min(at), high.max(at));
        }
        let size = high - low;
        let area = size.x * size.y;
        if area < best.0 {
            let lying = (axis, low, high);
            // A quarter turn: the second coordinate becomes the first, and the first the second with the other sign.
            let upright = (axis.perp(), Vec2::new(low.y, -high.x), Vec2::new(high.y, -low.x));
            best = (area, if size.x >= size.y { lying } else { upright });
        }
    }
    best.1
}

/// A rectangle of the atlas in texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    /// Its upper left texel.
    pub corner: UVec2,
    /// Its size, without the gutter.
    pub size: UVec2,
}

/// The cells of `sheets` in a square atlas of `edge` texels, with as many texels per metre as fit.
pub(super) fn pack(sheets: &[Sheet], edge: u32) -> Vec<Cell> {
    let area: f32 = sheets.iter().map(|sheet| 4.0 * sheet.u.length() * sheet.v.length()).sum();
    let most = (edge as f32).powi(2) / area.max(1e-12);
    // Between nothing, which always fits or nearly so, and a full atlas.
    let (mut low, mut high) = (0.0f32, most.sqrt());
    let mut found = None;
    for _ in 0..16 {
        let density = 0.5 * (low + high);
        match shelves(sheets, edge, density) {
            Some(cells) => {
                found = Some(cells);
                low = density;
            }
            None => high = density,
        }
    }
    // More planes than cells: those that find no room show a texel of their own at the same place.
    found.or_else(|| shelves(sheets, edge, 0.0)).unwrap_or_else(|| {
        let cell = Cell { corner: UVec2::splat(GUTTER), size: UVec2::ONE };
        vec![cell; sheets.len()]
    })
}

/// Rows of cells, the highest first; `None` if they do not fit.
fn shelves(sheets: &[Sheet], edge: u32, density: f32) -> Option<Vec<Cell>> {
    let texels = |half: Vec3| ((2.0 * half.length() * density).ceil() as u32).max(1);
    let sizes: Vec<UVec2> = sheets.iter().map(|sheet| UVec2::new(texels(sheet.u), texels(sheet.v))).collect();
    let outer = |size: UVec2| {
        let with_gutter = size + 2 * GUTTER;
        UVec2::new(with_gutter.x.next_multiple_of(ALIGNMENT), with_gutter.y.next_multiple_of(ALIGNMENT))
    };
    let mut order: Vec<usize> = (0..sheets.len()).collect();
    order.sort_by_key(|&index| (std::cmp::Reverse((outer(sizes[index]).y, sizes[index].x)), index));
    let mut cells = vec![Cell { corner: UVec2::ZERO, size: UVec2::ONE }; sheets.len()];
    // Rows with their top, height and used width.
    let mut rows: Vec<(u32, u32, u32)> = Vec::new();
    let mut bottom = 0;
    for index in order {
        let size = outer(sizes[index]);
        let row = rows.iter().position(|(_, height, used)| *height >= size.y && used + size.x <= edge);
        let row = match row {
            Some(row) => row,
            None if size.x <= edge && bottom + size.y <= edge => {
                rows.push((bottom, size.y, 0));
                bottom += size.y;
                rows.len() - 1
            }
            None => return None,
        };
        cells[index] = Cell { corner: UVec2::new(rows[row].2, rows[row].0) + GUTTER, size: sizes[index] };
        rows[row].2 += size.x;
    }
    Some(cells)
}

/// The plane of a sheet that shows `cell`.
pub(super) fn plane(sheet: &Sheet, cell: &Cell, edge: u32) -> CloudPlane {
    let (low, high) = (cell.corner.as_vec2() / edge as f32, (cell.corner + cell.size).as_vec2() / edge as f32);
    let Sheet { center, u, v, normal, .. } = *sheet;
    CloudPlane { center, u, v, normal, texture_min: low, texture_max: high }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet_of(width: f32, height: f32) -> Sheet {
        let (u, v) = (0.5 * width * Vec3::X, 0.5 * height * Vec3::Y);
        Sheet { center: Vec3::ZERO, u, v, normal: Vec3::Z, triangles: Vec::new() }
    }

    #[test]
    fn the_rectangle_is_the_smallest_and_lies_across() {
        // 4 by 1, turned by 60 degrees.
        let axis = Vec2::from_angle(60f32.to_radians());
        let corner = |x: f32, y: f32| x * axis + y * axis.perp() + Vec2::new(3.0, -1.0);
        let (found, low, high) =
            smallest_rectangle(&[corner(0.0, 0.0), corner(4.0, 0.0), corner(4.0, 1.0), corner(0.0, 1.0)]);
        assert!(found.dot(axis).abs() > 0.999, "{found}");
        let size = high - low;
        assert!((size - Vec2::new(4.0, 1.0)).length() < 0.05, "{size}");
        let middle = 0.5 * (low + high);
        assert!((middle.x * found + middle.y * found.perp() - corner(2.0, 0.5)).length() < 1e-3);
    }

    #[test]
    fn cells_fill_the_atlas_and_do_not_touch() {
        let sheets: Vec<Sheet> =
            (0..90).map(|i| sheet_of(1.0 + 0.1 * (i % 13) as f32, 0.5 + 0.05 * (i % 7) as f32)).collect();
        let cells = pack(&sheets, 512);
        let used: u32 = cells.iter().map(|cell| cell.size.x * cell.size.y).sum();
        assert!(f64::from(used) > 0.4 * 512.0 * 512.0, "{used}");
        for (i, a) in cells.iter().enumerate() {
            assert!((a.corner + a.size + GUTTER).max_element() <= 512 && a.corner.min_element() >= GUTTER);
            for b in &cells[..i] {
                let (gap_a, gap_b) = (a.corner + a.size + GUTTER, b.corner + b.size + GUTTER);
                let apart =
                    gap_a.x <= b.corner.x || gap_b.x <= a.corner.x || gap_a.y <= b.corner.y || gap_b.y <= a.corner.y;
                assert!(apart, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn planes_without_extent_and_too_many_of_them_find_a_place() {
        for count in [0, 1, 10_000] {
            let sheets: Vec<Sheet> = (0..count).map(|_| sheet_of(0.0, 0.0)).collect();
            let cells = pack(&sheets, 64);
            assert_eq!(cells.len(), count);
            assert!(cells.iter().all(|cell| (cell.corner + cell.size).max_element() <= 64));
        }
    }
}
