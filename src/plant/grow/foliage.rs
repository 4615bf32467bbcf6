//! The foliage: cards with leaf clusters along the outermost stems (Weber & Penn 1995, 4.9, with clusters for leaves).
//!
//! All stems that can carry leaves are laid end to end, each metre weighted by how far out in the crown it is. The
//! cards are distributed at even steps along that line. So the density of the foliage follows the branching, not the
//! number of cards. With fewer cards, each is larger, and extends as far back along its twig as it extends further
//! outwards.
//!
//! ```text
//!   flat: 2 triangles     folded along the twig: 4
//!   +-------+             +---+---+
//!   |     / |             | / | \ |
//!   | /     |             |/  |  \|
//!   +---t---+             +---t---+     t: the twig
//! ```

use glam::{Quat, Vec2, Vec3};

use super::parameters::{GrowParameters, LeafParameters};
use super::random::Random;
use super::skeleton::{Skeleton, node_at};
use crate::plant::PlantMesh;

/// Number of cards, as a fraction of the species' count, beyond which more triangles fold cards instead of adding
/// smaller ones.
const FOLD_FROM: f32 = 0.6;

/// Builds foliage of exactly `triangles` triangles (one fewer if that is odd).
pub(super) fn mesh(skeleton: &Skeleton, species: &GrowParameters, random: &Random, triangles: usize) -> PlantMesh {
    let leaves = &species.leaves;
    let pairs = triangles / 2;
    let count = ((FOLD_FROM * leaves.count as f32) as usize).clamp(pairs.div_ceil(2), pairs).max(1);
    let folded = if leaves.fold_deg > 0.0 { pairs - count } else { 0 };
    let count = pairs - folded;

    let mut cards = deal(skeleton, leaves, random, count);
    // The total area does not depend on the number of cards: it is that of the species, scaled to this individual.
    let wanted = leaves.count as f32 * (leaves.scale * skeleton.scale).powi(2);
    let drawn: f32 = cards.iter().map(|card| card.length * card.length).sum();
    let factor = (wanted / drawn.max(1e-12)).sqrt();
    for card in &mut cards {
        card.length *= factor;
        // A card that is larger than the species' cluster extends half outwards, half back along the twig.
        let reference = leaves.scale * skeleton.scale;
        card.base -= card.direction * 0.5 * (card.length - reference).max(0.0);
    }
    let crown = Crown::around(&cards);
    let mut mesh = PlantMesh::default();
    // Folds are distributed evenly over the tree (Bresenham's algorithm).
    for (index, card) in cards.iter().enumerate() {
        let fold = (index + 1) * folded / count > index * folded / count;
        card.build(leaves, &crown, fold, &mut mesh);
    }
    mesh
}

/// One leaf cluster.
struct Card {
    /// Position where its twig begins.
    base: Vec3,
    /// Direction of its twig, unit length.
    direction: Vec3,
    /// Normal of its upper side, unit length, perpendicular to the direction.
    normal: Vec3,
    /// Length along its twig, metres.
    length: f32,
    /// Whether the texture is mirrored.
    mirrored: bool,
}

/// A piece of a stem that carries leaves.
struct Run {
    stem: usize,
    from: f32,
    length: f32,
    weight: f32,
}

/// Finds the pieces of stems that carry leaves: the whole stems of the last level, the outer halves of the level
/// before, and the tips of thicker stems.
fn runs(skeleton: &Skeleton, leaves: &LeafParameters) -> Vec<Run> {
    let last = skeleton.stems.iter().map(|stem| stem.level).max().unwrap_or(0);
    let mut runs = Vec::new();
    for (index, stem) in skeleton.stems.iter().enumerate() {
        let (start, end) = (stem.nodes[0].distance, stem.nodes[stem.nodes.len() - 1].distance);
        let bare = match last - stem.level {
            0 => 0.12,
            1 => 0.5,
            _ => 0.88,
        };
        let first = start + (end - start) * bare;
        let pieces = if stem.level == last { 2 } else { 3 };
        let length = (end - first) / pieces as f32;
        for piece in 0..pieces {
            let from = first + length * piece as f32;
            let outward = node_at(&stem.nodes, from + 0.5 * length).outward;
            let inside = 1.0 - ((outward - 0.15) / 0.5).clamp(0.0, 1.0);
            // Short twigs have about as many leaves as long ones (4.9), hence the square root of the length.
            let crowded = (length * pieces as f32).max(1e-3).sqrt() / pieces as f32;
            let weight = crowded * (1.0 - leaves.shell * inside) + 1e-6;
            runs.push(Run { stem: index, from, length, weight });
        }
    }
    runs
}

/// Distributes `count` cards along the runs. Their lengths are relative to each other.
fn deal(skeleton: &Skeleton, leaves: &LeafParameters, random: &Random, count: usize) -> Vec<Card> {
    let runs = runs(skeleton, leaves);
    let total: f64 = runs.iter().map(|run| f64::from(run.weight)).sum();
    let (mut current, mut passed) = (0, 0.0f64);
    let mut azimuth = 0.0f32;
    let mut cards = Vec::with_capacity(count);
    for index in 0..count {
        let mut draw = random.split(index as u64);
        let target = (index as f64 + f64::from(draw.unit())) / count as f64 * total;
        while current + 1 < runs.len() && passed + f64::from(runs[current].weight) < target {
            passed += f64::from(runs[current].weight);
            current += 1;
        }
        let run = &runs[current];
        let along = (((target - passed) / f64::from(run.weight)) as f32).clamp(0.0, 1.0);
        let nodes = &skeleton.stems[run.stem].nodes;
        let distance = run.from + run.length * along;
        let node = node_at(nodes, distance);
        let span = 0.05 * run.length.max(0.05);
        let tangent =
            (node_at(nodes, distance + span).position - node_at(nodes, distance - span).position).normalize_or(Vec3::Y);

        azimuth = if leaves.rotate_deg < 0.0 {
            if index % 2 == 0 { -leaves.rotate_deg } else { leaves.rotate_deg }
        } else {
            azimuth + leaves.rotate_deg
        };
        let turn = azimuth + 20.0 * draw.signed();
        let down = leaves.down_angle_deg + leaves.down_angle_variation_deg * draw.signed();
        // Measured from the underside of the twig, as for branches.
        let level = tangent.cross(Vec3::Y).normalize_or(Vec3::X);
        let under = tangent.cross(level).normalize_or(Vec3::Z);
        let aside = Quat::from_axis_angle(tangent, turn.to_radians()) * under;
        let (sin, cos) = down.clamp(0.0, 150.0).to_radians().sin_cos();
        let direction = tangent * cos + aside * sin;
        let direction = direction.lerp(Vec3::NEG_Y, leaves.droop * draw.unit()).normalize_or(tangent);

        let any = Vec3::new(draw.signed(), draw.signed(), draw.signed());
        let out = Vec3::new(node.position.x, 0.0, node.position.z).normalize_or_zero();
        let light = (out + Vec3::Y).normalize_or(Vec3::Y);
        let normal = square_to(any.normalize_or(Vec3::X), direction).lerp(square_to(light, direction), leaves.bend);
        // A cluster is not much longer than its twig.
        let stem_length = nodes[nodes.len() - 1].distance - nodes[0].distance;
        let short = (0.5 + 0.5 * stem_length / leaves.scale).min(1.0);
        cards.push(Card {
            base: node.position,
            direction,
            normal: square_to(normal, direction),
            length: short * (1.0 + leaves.scale_variation * draw.signed()),
            mirrored: draw.unit() < 0.5,
        });
    }
    cards
}

/// The part of `vector` perpendicular to the unit vector `direction`, normalised.
fn square_to(vector: Vec3, direction: Vec3) -> Vec3 {
    (vector - direction * vector.dot(direction)).normalize_or(direction.any_orthonormal_vector())
}

/// The ellipsoid of the crown.
struct Crown {
    center: Vec3,
    radii: Vec3,
}

impl Crown {
    /// The ellipsoid around all cards. Its centre lies below that of the crown, so that most of the crown faces the
    /// sky.
    fn around(cards: &[Card]) -> Self {
        let first = cards.first().map_or(Vec3::ZERO, |card| card.base);
        let (low, high) = cards.iter().fold((first, first), |(low, high), c| (low.min(c.base), high.max(c.base)));
        let mut center = 0.5 * (low + high);
        let radii = (0.5 * (high - low)).max(Vec3::splat(0.1));
        center.y -= 0.3 * radii.y;
        Self { center, radii }
    }

    /// Unit vector outwards from the crown: the gradient of the ellipsoid.
    fn outward(&self, point: Vec3) -> Vec3 {
        ((point - self.center) / (self.radii * self.radii)).normalize_or(Vec3::Y)
    }
}

impl Card {
    fn build(&self, leaves: &LeafParameters, crown: &Crown, fold: bool, mesh: &mut PlantMesh) {
        let side = self.direction.cross(self.normal);
        let half = 0.5 * self.length * leaves.aspect;
        let angle = if fold { leaves.fold_deg.to_radians() } else { 0.0 };
        let (sin, cos) = angle.sin_cos();
        let mut vertex = |along: f32, across: f32| {
            let sideways = side * (across * cos) - self.normal * (across.abs() * sin);
            let position = self.base + self.direction * (self.length * along) + sideways * half;
            let normal = self.normal * cos + side * (across * sin);
            let u = if self.mirrored { 0.5 - 0.5 * across } else { 0.5 + 0.5 * across };
            let bent = normal.lerp(crown.outward(position), leaves.normal_bend);
            mesh.positions.push(position);
            mesh.normals.push(bent.normalize_or(self.normal));
            mesh.uvs.push(Vec2::new(u, 1.0 - along));
            mesh.positions.len() as u32 - 1
        };
        let left = [vertex(0.0, -1.0), vertex(1.0, -1.0)];
        let middle = fold.then(|| [vertex(0.0, 0.0), vertex(1.0, 0.0)]);
        let right = [vertex(0.0, 1.0), vertex(1.0, 1.0)];
        let mut quad = |a: [u32; 2], b: [u32; 2]| {
            mesh.triangles.push([a[0], b[0], b[1]]);
            mesh.triangles.push([a[0], b[1], a[1]]);
        };
        if let Some(middle) = middle {
            quad(left, middle);
            quad(middle, right);
        } else {
            quad(left, right);
        }
    }
}
