//! Generator points of the foliage [Luft 2007, 3.1]: one a primitive at its centre of mass, or one a vertex [Luft 2006, 4.1],
//! or an even choice of them.
//!
//! The mass of a leaf card is the area that passes its alpha test: a seventh to a half of the card in the models that
//! were tried. With the area of whole cards, densities of different models would not be comparable.

use std::collections::{HashMap, HashSet};

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::partition;
use crate::plant::{PartKind, PlantMesh, PlantPart, geometry, surface::Surface};

/// A generator point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Generator {
    /// Centre of mass of its primitive, or its vertex; metres.
    pub position: Vec3,
    /// Leaf area that it represents, one side, square metres.
    pub area: f32,
    /// Number of primitives that it stands for; of vertices where those are the generators.
    pub primitives: f32,
}

/// The weight of a generator in the density field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, bevy::reflect::Reflect)]
pub enum Weighting {
    /// Each primitive has the weight 1, as published. A finer tessellation of the same leaves makes the crown darker.
    Primitives,
    /// The foliage's vertices are the generators and each counts 1 [Luft 2006, 4.1]. It depends on the tessellation as well,
    /// and leaves that share vertices count less. Of vertices in one place, as at a seam of the texture, one counts.
    Vertices,
    /// Each counts its leaf area over ρ² (and a constant), so that the sum is the leaf area index over one radius:
    /// in foliage of the leaf-area density u (1/m) it is u ρ. Neither the tessellation nor the plant's size matters,
    /// so the same τ and d_min suit any model.
    #[default]
    LeafArea,
}

/// Integral of the bump (1 - x²)² over the unit ball: 32 π / 105.
pub(super) const BUMP_VOLUME: f32 = 32.0 * std::f32::consts::PI / 105.0;

impl Weighting {
    /// Weight of `generator` in a field of radius ρ `radius` in metres; finite, 0 or more.
    pub fn weight(self, generator: &Generator, radius: f32) -> f32 {
        let weight = match self {
            Self::Primitives | Self::Vertices => generator.primitives,
            Self::LeafArea => generator.area / radius / radius / BUMP_VOLUME,
        };
        if weight.is_finite() { weight.max(0.0) } else { 0.0 }
    }
}

/// A generator for each valid triangle of `part`: indices in range, corners finite. Foliage has the area that passes
/// the alpha test, wood the leaf area that casts as much shade: half of its surface, as a round body shows a quarter of
/// its surface on average and a leaf half of its one side. A triangle without area and a duplicate of one, also one
/// that faces the other way, have a generator as well; by leaf area they weigh nothing.
pub fn generators(part: &PlantPart) -> Vec<Generator> {
    generators_of(part, &part.mesh)
}

/// As [`generators`], with the mesh of `part` moved to where `mesh` has it.
pub(super) fn generators_of(part: &PlantPart, mesh: &PlantMesh) -> Vec<Generator> {
    with_corners(part, mesh).into_iter().map(|(_, generator)| generator).collect()
}

/// A generator for each place at which `mesh`, that of `part`, has a vertex of a valid triangle, in the order of the
/// triangles. It has a third of the area of each triangle there, so that their sum is that of [`generators`].
pub(super) fn vertex_generators_of(part: &PlantPart, mesh: &PlantMesh) -> Vec<Generator> {
    let mut places = HashMap::new();
    let mut generators: Vec<Generator> = Vec::new();
    for (corners, triangle) in with_corners(part, mesh) {
        for position in corners.map(|corner| mesh.positions[corner]) {
            let index = *places.entry(place(position)).or_insert(generators.len());
            if index == generators.len() {
                generators.push(Generator { position, area: 0.0, primitives: 1.0 });
            }
            generators[index].area += triangle.area / 3.0;
        }
    }
    generators
}

/// Equal for positions that are the same place.
fn place(position: Vec3) -> [u32; 3] {
    // Adding zero turns -0.0 into 0.0.
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Valid triangles as corners, each with its generator.
fn with_corners(part: &PlantPart, mesh: &PlantMesh) -> Vec<([usize; 3], Generator)> {
    let surface = Surface::new(part);
    let mut seen = HashSet::new();
    let mut is_first = |corners: [usize; 3]| {
        let mut places = corners.map(|corner| place(mesh.positions[corner]));
        places.sort_unstable();
        seen.insert(places)
    };
    let triangles: Vec<([usize; 3], bool)> =
        geometry::triangles(mesh).map(|(_, corners)| (corners, is_first(corners))).collect();
    let of_triangle = |(corners, first): &([usize; 3], bool)| {
        let (share, [a, b, c]) = match part.kind {
            _ if !first => (0.0, [1.0 / 3.0; 3]),
            PartKind::Wood => (0.5, [1.0 / 3.0; 3]),
            PartKind::Foliage => covered(&surface, corners.map(|corner| mesh.uvs[corner])),
        };
        let [p, q, r] = corners.map(|corner| mesh.positions[corner]);
        let area = share * geometry::area(mesh, *corners);
        (*corners, Generator { position: a * p + b * q + c * r, area, primitives: 1.0 })
    };
    triangles.par_iter().map(of_triangle).filter(|(_, generator)| generator.position.is_finite()).collect()
}

/// Fraction of a triangle with these texture coordinates that passes the alpha test, and the centre of that part as
/// weights of the corners (the middle if nothing passes).
fn covered(surface: &Surface, [a, b, c]: [Vec2; 3]) -> (f32, [f32; 3]) {
    /// Rows of samples; there are as many samples as its square.
    const ROWS: usize = 8;
    const MIDDLE: [f32; 3] = [1.0 / 3.0; 3];
    if !surface.is_tested() {
        return (1.0, MIDDLE);
    }
    let (mut count, mut sum) = (0.0, Vec2::ZERO);
    for row in 0..ROWS {
        // Small triangles that stand on their base, and between them those that stand on their tip.
        for column in 0..2 * (ROWS - row) - 1 {
            let third = (1 + column % 2) as f32 / 3.0;
            let at = (Vec2::new((column / 2) as f32, row as f32) + third) / ROWS as f32;
            if surface.passes(a + at.x * (b - a) + at.y * (c - a)) {
                count += 1.0;
                sum += at;
            }
        }
    }
    let center = if count > 0.0 { sum / count } else { Vec2::splat(1.0 / 3.0) };
    (count / (ROWS * ROWS) as f32, [1.0 - center.x - center.y, center.x, center.y])
}

/// A fraction (0..=1) of the generators, at least one, chosen evenly over the crown. Medians cut the crown into as many
/// compact groups of equal number as generators are wanted. One generator at the centre of area of each group
/// represents the whole group, with its total area and number. So sums keep their level, and neither τ nor d_min needs
/// a factor. (The publication picks primitives at random; a centre of mass has an error of second order in the group's
/// size only.) In the order of the groups; a fraction that is not below 1, or NaN, returns all of them, in their order.
pub fn even_share(generators: &[Generator], share: f32) -> Vec<Generator> {
    let wanted = (f64::from(share.max(0.0)) * generators.len() as f64).ceil() as usize;
    if share.is_nan() || wanted >= generators.len() {
        return generators.to_vec();
    }
    let mut points: Vec<(Vec3, u32)> =
        generators.iter().enumerate().map(|(index, generator)| (generator.position, index as u32)).collect();
    choose(&mut points, generators, wanted.max(1))
}

fn choose(points: &mut [(Vec3, u32)], generators: &[Generator], wanted: usize) -> Vec<Generator> {
    /// Fewer points are not worth a second thread.
    const ALONE: usize = 4096;
    if wanted <= 1 {
        return stand_in(points, generators).into_iter().collect();
    }
    let first = wanted / 2;
    let middle = (points.len() as u64 * first as u64 / wanted as u64) as usize;
    partition::split_at(points, middle);
    let (left, right) = points.split_at_mut(middle);
    let (mut chosen, more) = if left.len() > ALONE {
        rayon::join(|| choose(left, generators, first), || choose(right, generators, wanted - first))
    } else {
        (choose(left, generators, first), choose(right, generators, wanted - first))
    };
    chosen.extend(more);
    chosen
}

fn stand_in(points: &mut [(Vec3, u32)], generators: &[Generator]) -> Option<Generator> {
    // The sums are taken in the order of the indices: they must not depend on how the selection left the group.
    points.sort_unstable_by_key(|(_, index)| *index);
    let all = || points.iter().map(|(_, index)| &generators[*index as usize]);
    let area: f32 = all().map(|generator| generator.area).sum();
    let primitives: f32 = all().map(|generator| generator.primitives).sum();
    let weight =
        |generator: &Generator| if area > 0.0 { generator.area / area } else { generator.primitives / primitives };
    let anchor = points.first()?.0;
    let center: Vec3 = anchor + all().map(|g| weight(g) * (g.position - anchor)).sum::<Vec3>();
    Some(Generator { position: center, area, primitives })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use image::{Rgba, RgbaImage};

    use super::*;
    use crate::plant::PlantMaterial;

    #[test]
    fn an_even_share_keeps_area_and_number_and_is_spread() {
        let all: Vec<Generator> = (0..4096u32)
            .map(|i| Generator {
                position: Vec3::new((i % 16) as f32, (i / 16 % 16) as f32, (i / 256) as f32),
                area: 0.5 + (i % 3) as f32,
                primitives: 1.0,
            })
            .collect();
        let few = even_share(&all, 0.1);
        assert_eq!(few.len(), 410);
        let sum = |list: &[Generator]| list.iter().map(|g| f64::from(g.area)).sum::<f64>();
        assert!((sum(&few) / sum(&all) - 1.0).abs() < 1e-6);
        assert_eq!(few.iter().map(|g| g.primitives).sum::<f32>(), 4096.0);
        for octant in 0..8u32 {
            let low = Vec3::new((octant & 1) as f32, (octant >> 1 & 1) as f32, (octant >> 2) as f32) * 8.0;
            let inside = |g: &&Generator| g.position.cmpge(low).all() && g.position.cmplt(low + 8.0).all();
            assert!(few.iter().filter(inside).count().abs_diff(51) <= 8);
        }
        assert_eq!(even_share(&all, 0.0).len(), 1);
        assert_eq!(even_share(&all, f32::NAN), all);
        assert_eq!(even_share(&all, 1.0), all);
        assert!(even_share(&[], 0.5).is_empty());
    }

    #[test]
    fn a_card_counts_what_its_alpha_leaves_of_it() {
        let image = |alpha: [u8; 2]| RgbaImage::from_fn(64, 64, |x, _| Rgba([0, 0, 0, alpha[usize::from(x >= 32)]]));
        let card = |kind: PartKind, alpha: [u8; 2]| PlantPart {
            kind,
            mesh: PlantMesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
                normals: vec![Vec3::Z; 4],
                uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
            },
            material: PlantMaterial { base_color_texture: Some(Arc::new(image(alpha))), ..Default::default() },
        };
        let half = generators(&card(PartKind::Foliage, [255, 0]));
        let area: f32 = half.iter().map(|g| g.area).sum();
        let moment: f32 = half.iter().map(|g| g.area * g.position.x).sum();
        assert!((area - 0.5).abs() < 0.03 && (moment / area - 0.25).abs() < 0.03, "{area} {moment}");
        let nothing = generators(&card(PartKind::Foliage, [0, 0]));
        assert!(nothing.len() == 2 && nothing.iter().all(|g| g.area == 0.0 && g.position.is_finite()));
        let wood: f32 = generators(&card(PartKind::Wood, [0, 0])).iter().map(|g| g.area).sum();
        assert_eq!(wood, 0.5);
    }

    #[test]
    fn vertices_count_once_a_place_and_share_the_area() {
        // Two leaves that touch in a corner; the second one has a seam, a vertex that nothing uses and one that is no place.
        let o = Vec3::ZERO;
        let mesh = PlantMesh {
            positions: vec![o, Vec3::X, Vec3::Y, -o, -Vec3::X, -Vec3::Y, -Vec3::X, -Vec3::ONE, Vec3::ONE, Vec3::NAN],
            normals: vec![Vec3::Z; 10],
            uvs: vec![Vec2::ZERO; 10],
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 5], [0, 1, 9]],
        };
        let part = PlantPart { kind: PartKind::Foliage, mesh: mesh.clone(), material: PlantMaterial::default() };
        let found = vertex_generators_of(&part, &mesh);
        let positions: Vec<Vec3> = found.iter().map(|generator| generator.position).collect();
        assert_eq!(positions, [o, Vec3::X, Vec3::Y, -Vec3::X, -Vec3::Y, -Vec3::ONE]);
        let sum = |list: &[Generator]| list.iter().map(|generator| generator.area).sum::<f32>();
        assert!((sum(&found) - sum(&generators(&part))).abs() < 1e-6 && sum(&found) > 1.0);
        assert!(found.iter().all(|generator| Weighting::Vertices.weight(generator, 0.3) == 1.0));
        assert_eq!(even_share(&found, 0.1)[0].primitives, 6.0);
    }

    #[test]
    fn the_weight_by_area_knows_neither_size_nor_tessellation() {
        let leaf = |area: f32| Generator { position: Vec3::ZERO, area, primitives: 1.0 };
        let whole = Weighting::LeafArea.weight(&leaf(0.02), 0.5);
        assert!((Weighting::LeafArea.weight(&leaf(0.005), 0.5) * 4.0 - whole).abs() < 1e-7);
        assert!((Weighting::LeafArea.weight(&leaf(2.0e4), 500.0) - whole).abs() < 1e-7);
        assert_eq!(Weighting::Primitives.weight(&leaf(0.02), 0.5), 1.0);
        assert_eq!(Weighting::LeafArea.weight(&leaf(1.0), 0.0), 0.0);
    }
}
