//! The wood: a tube around every stem, as round and as smooth as the triangles allow.
//!
//! One number, the resolution, determines how many sides a tube has, how closely its rings follow the axis, and which
//! thin stems are omitted. It is found by bisection, so that the wood just stays within its number of triangles.
//!
//! ```text
//! ring ── ring ── ring ── tip     2·sides triangles between rings, sides at the tip; the first and last vertex of a
//!  |       |       |     /        ring coincide (the seam of the texture), so there are sides + 1 of them
//! ```

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::parameters::GrowParameters;
use super::skeleton::{Node, Skeleton, Stem};
use crate::plant::PlantMesh;

/// Steps of the bisection, after which the resolution is known to a millionth of its range.
const STEPS: u32 = 22;
/// The range of resolutions. At 1, a trunk of 25 cm radius has 16 sides, and stems thinner than 3 mm are omitted.
const RESOLUTIONS: (f32, f32) = (0.02, 6.0);

/// Builds the wood with at most `budget` triangles. There is always a trunk, which needs a few dozen.
pub(super) fn mesh(skeleton: &Skeleton, species: &GrowParameters, budget: usize) -> PlantMesh {
    let triangles = |resolution: f32| -> usize {
        skeleton
            .stems
            .iter()
            .enumerate()
            .filter_map(|(i, stem)| Tube::fit(stem, i == 0, resolution))
            .map(|t| t.triangles())
            .sum()
    };
    let (mut low, mut high) = RESOLUTIONS;
    for _ in 0..STEPS {
        let middle = (low * high).sqrt();
        if triangles(middle) <= budget {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut mesh = PlantMesh::default();
    for (index, stem) in skeleton.stems.iter().enumerate() {
        if let Some(tube) = Tube::fit(stem, index == 0, low) {
            tube.build(species, &mut mesh);
        }
    }
    mesh
}

/// The tube of a stem: its sides, and which of the nodes have rings.
struct Tube<'a> {
    level: usize,
    nodes: Vec<&'a Node>,
    sides: usize,
}

impl<'a> Tube<'a> {
    /// Chooses sides and rings; `None` for a stem that is too thin to draw.
    fn fit(stem: &'a Stem, is_trunk: bool, resolution: f32) -> Option<Self> {
        let thickest = stem.nodes.iter().fold(0.0f32, |r, node| r.max(node.radius));
        if !is_trunk && thickest < 0.003 / (resolution * resolution) {
            return None;
        }
        // The trunk is seen from near, and has lobes, so it is finer.
        let (finer, most) = if is_trunk { (1.5, 36.0) } else { (1.0, 20.0) };
        let sides = 2.6 + 27.0 * finer * resolution.min(1.5) * thickest.sqrt();
        let sides = sides.round().clamp(3.0, most) as usize;
        // Maximum deviation of the axis from the chord, and of the radius from its line, as a fraction of the radius.
        let tolerance = if is_trunk { 0.02 } else { 0.12 } / resolution;
        let mut nodes = vec![&stem.nodes[0]];
        let mut from = 0;
        for to in 2..stem.nodes.len() {
            let (a, b) = (&stem.nodes[from], &stem.nodes[to]);
            let is_close = stem.nodes[from + 1..to].iter().all(|node| {
                let t = (node.distance - a.distance) / (b.distance - a.distance).max(1e-6);
                let (radius, position) = (a.radius + (b.radius - a.radius) * t, a.position.lerp(b.position, t));
                (radius - node.radius).abs() + position.distance(node.position) < tolerance * node.radius
            });
            if !is_close {
                from = to - 1;
                nodes.push(&stem.nodes[from]);
            }
        }
        nodes.push(&stem.nodes[stem.nodes.len() - 1]);
        Some(Self { level: stem.level, nodes, sides })
    }

    fn triangles(&self) -> usize {
        self.sides * (2 * (self.nodes.len() - 2) + 1)
    }

    fn build(&self, species: &GrowParameters, mesh: &mut PlantMesh) {
        let nodes = &self.nodes;
        let count = nodes.len();
        let tangents: Vec<Vec3> = (0..count)
            .map(|i| {
                let before = nodes[i].position - nodes[i.saturating_sub(1)].position;
                let after = nodes[(i + 1).min(count - 1)].position - nodes[i].position;
                (before.normalize_or_zero() + after.normalize_or_zero()).normalize_or(Vec3::Y)
            })
            .collect();
        // The texture repeats a whole number of times around, so that its edges meet at the seam.
        let base = nodes.iter().find(|node| node.distance >= 0.0).map_or(nodes[0].radius, |node| {
            node.radius / (1.0 + if self.level == 0 && node.distance == 0.0 { species.flare } else { 0.0 })
        });
        let repeats = (TAU * base / species.bark.tile).round().max(1.0);
        // Each wave around the foot needs at least three sides.
        let lobes = if self.level == 0 && self.sides as u32 >= 3 * species.lobes { species.lobes as f32 } else { 0.0 };

        let mut side = tangents[0].any_orthonormal_vector();
        let mut v = 0.0;
        let mut previous_ring = 0u32;
        for (i, node) in nodes.iter().enumerate() {
            // The frame with the least rotation (parallel transport).
            side = (side - tangents[i] * side.dot(tangents[i])).normalize_or(tangents[i].any_orthonormal_vector());
            let across = tangents[i].cross(side);
            let (before, after) = (nodes[i.saturating_sub(1)], nodes[(i + 1).min(count - 1)]);
            let slope = (after.radius - before.radius) / (after.distance - before.distance).max(1e-4);
            if i > 0 {
                // The texture has the same scale along the stem as around it at this girth. Near the tip, the girth
                // counts as at least a quarter of that at the base.
                let girth = TAU * (0.5 * (before.radius + node.radius)).max(0.25 * base);
                v += (node.distance - before.distance) * repeats / (2.0 * girth);
            }
            let ring = mesh.positions.len() as u32;
            let is_tip = i + 1 == count;
            for k in 0..=self.sides {
                // At the tip each side has its own vertex in its middle, so that the sides keep their own normals.
                let turn = (k as f32 + if is_tip { 0.5 } else { 0.0 }) / self.sides as f32;
                let angle = TAU * (turn % 1.0);
                let radial = side * angle.cos() + across * angle.sin();
                let wave = 1.0 + node.lobe * (lobes * angle).cos() * if lobes > 0.0 { 1.0 } else { 0.0 };
                // Around a lobe the normal is rotated from the radial direction by the derivative of the radius.
                let lean = node.lobe * lobes * (lobes * angle).sin() / wave;
                let around = across * angle.cos() - side * angle.sin();
                mesh.positions.push(node.position + radial * (node.radius * wave));
                mesh.normals.push((radial + around * lean - tangents[i] * slope).normalize_or(radial));
                mesh.uvs.push(Vec2::new(repeats * turn, -v));
            }
            if i > 0 {
                for k in 0..self.sides as u32 {
                    let (a, b) = (previous_ring + k, previous_ring + k + 1);
                    mesh.triangles.push([a, b, ring + k]);
                    if !is_tip {
                        mesh.triangles.push([b, ring + k + 1, ring + k]);
                    }
                }
            }
            previous_ring = ring;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::super::random::Random;
    use super::super::skeleton;
    use super::*;

    #[test]
    fn tubes_are_closed_but_for_their_hidden_first_ring() {
        for species in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
            let skeleton = skeleton::grow(&species, &Random::new(6));
            for (index, stem) in skeleton.stems.iter().enumerate().take(200) {
                let Some(tube) = Tube::fit(stem, index == 0, 2.0) else { continue };
                let mut mesh = PlantMesh::default();
                tube.build(&species, &mut mesh);
                assert_eq!(mesh.triangles.len(), tube.triangles());
                // Vertices at the same position are one; the tip's vertices are.
                let mut first_at: HashMap<[u32; 3], u32> = HashMap::new();
                let welded: Vec<u32> = (0..mesh.positions.len())
                    .map(|i| {
                        let key = (mesh.positions[i] + 0.0).to_array().map(f32::to_bits);
                        *first_at.entry(key).or_insert(i as u32)
                    })
                    .collect();
                let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
                for t in &mesh.triangles {
                    for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                        let (a, b) = (welded[a as usize], welded[b as usize]);
                        *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
                    }
                }
                let open: Vec<_> = edges.iter().filter(|&(_, &walks)| walks != 0).map(|(edge, _)| *edge).collect();
                assert_eq!(open.len(), tube.sides, "stem {index}");
                assert!(open.iter().all(|&(a, b)| (a.max(b) as usize) <= tube.sides));
            }
        }
    }

    #[test]
    fn bark_is_neither_stretched_nor_cut_at_the_seam() {
        let species = GrowParameters::broadleaf();
        let skeleton = skeleton::grow(&species, &Random::new(9));
        let Some(tube) = Tube::fit(&skeleton.stems[0], true, 1.0) else { panic!("the trunk is always drawn") };
        let mut mesh = PlantMesh::default();
        tube.build(&species, &mut mesh);
        let ring = tube.sides + 1;
        for i in 0..tube.nodes.len() - 1 {
            let (first, last) = (mesh.uvs[i * ring], mesh.uvs[i * ring + tube.sides]);
            assert_eq!((last.x - first.x).fract(), 0.0);
            assert!(last.x > first.x && last.y == first.y);
            // Halfway up the bare trunk a texture repeat is twice as high as wide, within the taper and the bark's
            // curve.
            if i > 0 && (3.0..8.0).contains(&tube.nodes[i].distance) {
                let (below, here) = (mesh.uvs[(i - 1) * ring], first);
                let up = (tube.nodes[i].distance - tube.nodes[i - 1].distance) / (below.y - here.y);
                let around = TAU * tube.nodes[i].radius / (last.x - first.x);
                assert!((0.8..1.25).contains(&(up / (2.0 * around))), "{up} m up, {around} m around");
            }
        }
    }
}
