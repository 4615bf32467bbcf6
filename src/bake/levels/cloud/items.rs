//! The pieces of a plant that are assigned to planes as a whole: leaves, twigs, single triangles of large pieces.

use glam::{Mat3, Vec3};

use crate::plant::geometry;
use crate::plant::{PartKind, Plant, PlantMesh};

/// A piece of a plant. It keeps to one plane, so that no leaf is torn.
#[derive(Clone, Debug)]
pub(super) struct Item {
    /// Index of its part.
    pub part: u32,
    /// Indices of its triangles.
    pub triangles: Vec<u32>,
    /// Centre of its area.
    pub center: Vec3,
    /// Unit normal, the mean over its area with the sign of its first triangle.
    pub normal: Vec3,
    /// Area of one side, square metres; above 0.
    pub area: f32,
    /// Second moment of its area about the centre over the area, square metres.
    pub spread: Mat3,
}

/// A piece that is larger than this fraction of the plant is taken apart.
const LARGEST: f32 = 0.12;

/// The pieces of the foliage, and of those triangles of wood that `wood` lists part by part, in a fixed order. Pieces
/// without area are left out.
pub(super) fn items(plant: &Plant, wood: &[Vec<u32>]) -> Vec<Item> {
    let size = plant.bounds().map_or(0.0, |bounds| bounds.size().length());
    let mut all = Vec::new();
    for (index, part) in plant.parts.iter().enumerate() {
        let elements = geometry::elements(&part.mesh);
        let wanted = wood.get(index).map_or(&[][..], Vec::as_slice);
        for element in elements {
            if part.kind == PartKind::Wood && element.triangles.first().is_none_or(|t| wanted.binary_search(t).is_err())
            {
                continue;
            }
            let item = item(index, &part.mesh, element.triangles);
            if extent(&item) > LARGEST * size {
                let single = |&triangle: &u32| self::item(index, &part.mesh, vec![triangle]);
                all.extend(item.triangles.iter().map(single).filter(|item| item.area > 0.0));
            } else if item.area > 0.0 {
                all.push(item);
            }
        }
    }
    all
}

/// About the length of a piece, metres.
fn extent(item: &Item) -> f32 {
    let trace = item.spread.x_axis.x + item.spread.y_axis.y + item.spread.z_axis.z;
    (12.0 * trace).max(0.0).sqrt()
}

fn item(part: usize, mesh: &PlantMesh, triangles: Vec<u32>) -> Item {
    let corners = |triangle: &u32| mesh.triangles[*triangle as usize].map(|corner| mesh.positions[corner as usize]);
    let (mut area, mut moment, mut normal) = (0.0f32, Vec3::ZERO, Vec3::ZERO);
    for [a, b, c] in triangles.iter().map(corners) {
        let cross = 0.5 * (b - a).cross(c - a);
        let own = cross.length();
        if own.is_finite() {
            area += own;
            moment += own * (a + b + c) / 3.0;
            normal += if cross.dot(normal) < 0.0 { -cross } else { cross };
        }
    }
    let center = if area > 0.0 { moment / area } else { Vec3::ZERO };
    let mut spread = Mat3::ZERO;
    for corners in triangles.iter().map(corners) {
        let own = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        // The second moment of a triangle: nine times that of its centre and once that of each corner, over twelve.
        let about = corners.map(|corner| corner - center);
        let middle = (about[0] + about[1] + about[2]) / 3.0;
        let sum = about.iter().map(|corner| outer(*corner)).fold(9.0 * outer(middle), |sum, moment| sum + moment);
        if own.is_finite() {
            spread += own / 12.0 * sum;
        }
    }
    if area > 0.0 {
        spread *= 1.0 / area;
    }
    Item { part: part as u32, triangles, center, normal: normal.normalize_or(Vec3::Y), area, spread }
}

/// The product of a vector with itself, a symmetric matrix.
pub(super) fn outer(vector: Vec3) -> Mat3 {
    Mat3::from_cols(vector.x * vector, vector.y * vector, vector.z * vector)
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::plant::{PlantMaterial, PlantPart};

    #[test]
    fn a_card_has_its_area_normal_and_spread() {
        let positions = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 3.0));
        let mesh = PlantMesh {
            positions: positions.to_vec(),
            normals: vec![Vec3::Z; 4],
            uvs: vec![Vec2::ZERO; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let part = PlantPart { kind: PartKind::Foliage, mesh, material: PlantMaterial::default() };
        let plant = Plant { name: String::new(), parts: vec![part] };
        // The card is the whole plant, so it is taken apart.
        assert_eq!(items(&plant, &[]).len(), 2);
        let item = item(0, &plant.parts[0].mesh, vec![0, 1]);
        assert!((item.area - 2.0).abs() < 1e-6 && item.normal == Vec3::Z);
        assert!(item.center.distance(Vec3::new(1.0, 0.5, 3.0)) < 1e-6);
        let expected = [4.0 / 12.0, 1.0 / 12.0, 0.0];
        let found = [item.spread.x_axis.x, item.spread.y_axis.y, item.spread.z_axis.z];
        assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5), "{found:?}");
    }
}
