//! Branches as cylinders with few sides: trunk and limbs of a reduced model.
//!
//! [Franzke 2005, 4.3.1, 5.2] proposes them for the wood that billboards show with gaps, and did not try them. A branch
//! is any connected piece of a wood mesh. Its axis is found from level sets of the distance along the surface from one
//! end [Verroust & Lazarus 2000, "Extracting skeletal curves from 3D scattered data"]: each contour of a level is a
//! ring, whose centre is a point of the axis and whose length gives the radius; where a branch forks, a level has
//! several. The axis is then simplified [Douglas & Peucker 1973] and swept with a polygon of as much circumference as
//! the ring, so that its mean width over all directions is that of the branch. Texture coordinates repeat as often
//! around and along the branch as the original's do.
//!
//! Limits: open ends stay open; a piece that is no tube (a board, a cut stump) becomes one.

use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::reduced::ReducedPart;
use crate::plant::PlantMesh;
use crate::plant::geometry::{self, Element};

/// Levels along the longest branch.
const MOST_LEVELS: usize = 32;

/// A branch of a wood mesh, before it is reduced.
#[derive(Clone, Debug)]
pub(crate) struct Branch {
    /// Indices of its triangles, ascending.
    pub triangles: Vec<u32>,
    /// Surface, square metres.
    pub area: f32,
    /// Axes from end to end; several where it forks.
    axes: Vec<Vec<Node>>,
    /// Texture along the axis and around it.
    mapping: Mapping,
}

/// A point of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    center: Vec3,
    radius: f32,
}

/// How often a texture repeats.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mapping {
    /// Around the branch.
    around: f32,
    /// Per metre along it.
    along: f32,
    /// Whether the image's rows run around the branch, as is usual.
    upright: bool,
}

impl Branch {
    /// The greatest radius of its axes, metres.
    pub fn radius(&self) -> f32 {
        self.axes.iter().flatten().map(|node| node.radius).fold(0.0, f32::max)
    }

    /// Triangles of [`Self::sweep`].
    fn count(&self, sides: usize, tolerance: f32) -> usize {
        let rings = |axis: &Vec<Node>| simplified(axis, tolerance * self.radius()).len().saturating_sub(1);
        2 * sides * self.axes.iter().map(rings).sum::<usize>()
    }

    /// Appends the branch to `out` with `sides` sides. The axis may deviate by `tolerance` of its radius.
    fn sweep(&self, mesh: &PlantMesh, sides: usize, tolerance: f32, out: &mut ReducedPart) {
        let mut own: Vec<u32> = self.triangles.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
        own.sort_unstable();
        own.dedup();
        // As long around as the circle: the mean width over all directions is the same [Cauchy 1832].
        let widening = PI / (sides as f32 * (PI / sides as f32).sin());
        for axis in &self.axes {
            let axis = simplified(axis, tolerance * self.radius());
            let mut across = Vec3::ZERO;
            let mut length = 0.0;
            for (ring, node) in axis.iter().enumerate() {
                let before = axis[ring.saturating_sub(1)].center;
                let after = axis[(ring + 1).min(axis.len() - 1)].center;
                length += node.center.distance(before);
                let direction = (after - before).try_normalize().unwrap_or(Vec3::Y);
                // The rings do not twist: each takes over the direction of the one before.
                let carried = across - direction * across.dot(direction);
                across = carried.try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
                let other = direction.cross(across);
                let first = out.mesh.positions.len() as u32;
                for side in 0..=sides {
                    let (sin, cos) = (TAU * side as f32 / sides as f32).sin_cos();
                    let normal = across * cos + other * sin;
                    let position = node.center + normal * (node.radius * widening);
                    let turn = self.mapping.around * side as f32 / sides as f32;
                    let rise = -self.mapping.along * length;
                    out.mesh.positions.push(position);
                    out.mesh.normals.push(normal);
                    out.mesh.uvs.push(if self.mapping.upright { Vec2::new(turn, rise) } else { Vec2::new(rise, turn) });
                    out.sources.push(nearest(mesh, &own, position));
                }
                if ring > 0 {
                    let stride = sides as u32 + 1;
                    for side in 0..sides as u32 {
                        let (below, above) = (first - stride + side, first + side);
                        out.mesh.triangles.push([below, below + 1, above + 1]);
                        out.mesh.triangles.push([below, above + 1, above]);
                    }
                }
            }
        }
    }
}

/// The branches of a wood mesh, the one with the most surface first.
pub(crate) fn branches(mesh: &PlantMesh) -> Vec<Branch> {
    let elements = geometry::elements(mesh);
    let mut all: Vec<Branch> = elements.into_iter().map(|element| branch(mesh, element)).collect();
    all.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.triangles[0].cmp(&b.triangles[0])));
    all
}

/// How coarse tubes are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TubeSettings {
    /// Sides of the thickest branch, at least 3. Thinner ones have as few as 3.
    pub sides: usize,
    /// How far the axis may deviate, as a fraction of the branch's greatest radius.
    pub tolerance: f32,
}

/// The first of `branches` as tubes, as many as `triangles` allow (at least one), and how many these are.
pub(crate) fn reduce(
    mesh: &PlantMesh,
    branches: &[Branch],
    settings: &TubeSettings,
    triangles: usize,
) -> (ReducedPart, usize) {
    let mut out = ReducedPart::default();
    let thickest = branches.iter().map(Branch::radius).fold(0.0, f32::max).max(1e-9);
    let mut count = 0;
    for branch in branches {
        let share = (branch.radius() / thickest).sqrt();
        let sides = 3 + (share * settings.sides.saturating_sub(3) as f32).round() as usize;
        if count > 0 && out.mesh.triangles.len() + branch.count(sides, settings.tolerance) > triangles {
            break;
        }
        branch.sweep(mesh, sides, settings.tolerance, &mut out);
        count += 1;
    }
    (out, count)
}

/// The vertex of `own` nearest to `position`; the first of several.
fn nearest(mesh: &PlantMesh, own: &[u32], position: Vec3) -> u32 {
    let distance = |vertex: &u32| mesh.positions[*vertex as usize].distance_squared(position);
    own.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// A connected piece of the mesh, its vertices joined where they lie at the same position.
struct Piece {
    positions: Vec<Vec3>,
    /// Corners as places in `positions`.
    triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the corners.
    uvs: Vec<[Vec2; 3]>,
}

impl Piece {
    fn new(mesh: &PlantMesh, element: &Element) -> Self {
        let mut known: HashMap<[u32; 3], u32> = HashMap::new();
        let mut piece = Self { positions: Vec::new(), triangles: Vec::new(), uvs: Vec::new() };
        for &triangle in &element.triangles {
            let corners = mesh.triangles[triangle as usize].map(|corner| corner as usize);
            piece.uvs.push(corners.map(|corner| mesh.uvs[corner]));
            piece.triangles.push(corners.map(|corner| {
                let position = mesh.positions[corner] + Vec3::ZERO;
                *known.entry(position.to_array().map(f32::to_bits)).or_insert_with(|| {
                    piece.positions.push(position);
                    piece.positions.len() as u32 - 1
                })
            }));
        }
        piece
    }

    fn edges(&self) -> Vec<(u32, u32)> {
        let of = |&[a, b, c]: &[u32; 3]| [(a.min(b), a.max(b)), (b.min(c), b.max(c)), (c.min(a), c.max(a))];
        let mut edges: Vec<(u32, u32)> = self.triangles.iter().flat_map(of).collect();
        edges.sort_unstable();
        edges
    }

    /// Distances from `starts` along the edges [Dijkstra 1959].
    fn distances(&self, neighbours: &[Vec<u32>], starts: &[u32]) -> Vec<f32> {
        let mut distances = vec![f32::INFINITY; self.positions.len()];
        // Distances are not negative, so their bits sort as they do.
        let mut open = std::collections::BTreeSet::new();
        for &start in starts {
            distances[start as usize] = 0.0;
            open.insert((0u32, start));
        }
        while let Some((bits, place)) = open.pop_first() {
            let here = f32::from_bits(bits);
            if here > distances[place as usize] {
                continue;
            }
            for &next in &neighbours[place as usize] {
                let there = here + self.positions[place as usize].distance(self.positions[next as usize]);
                if there < distances[next as usize] {
                    distances[next as usize] = there;
                    open.insert((there.to_bits(), next));
                }
            }
        }
        distances
    }

    /// The rings at `level`: centre, circumference, and the length in the texture along its two axes.
    fn contours(&self, distances: &[f32], level: f32) -> Vec<(Node, Vec2)> {
        // Each segment joins the points on two edges.
        let mut segments: Vec<([(u32, u32); 2], [Vec3; 2], Vec2)> = Vec::new();
        for (corners, uvs) in self.triangles.iter().zip(&self.uvs) {
            let mut crossed = Vec::with_capacity(2);
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                let (from, to) = (distances[corners[i] as usize], distances[corners[j] as usize]);
                if (from < level) != (to < level) {
                    let part = ((level - from) / (to - from)).clamp(0.0, 1.0);
                    let (a, b) = (self.positions[corners[i] as usize], self.positions[corners[j] as usize]);
                    let edge = (corners[i].min(corners[j]), corners[i].max(corners[j]));
                    crossed.push((edge, a.lerp(b, part), uvs[i].lerp(uvs[j], part)));
                }
            }
            if let [(e, p, s), (f, q, t)] = crossed[..] {
                segments.push(([e, f], [p, q], (t - s).abs()));
            }
        }
        // Rings: segments that share an edge.
        let mut ring_of: HashMap<(u32, u32), usize> = HashMap::new();
        let mut rings: Vec<usize> = Vec::with_capacity(segments.len());
        let mut roots: Vec<usize> = Vec::new();
        let root = |roots: &[usize], mut ring: usize| {
            while roots[ring] != ring {
                ring = roots[ring];
            }
            ring
        };
        for (edges, ..) in &segments {
            let known: Vec<usize> =
                edges.iter().filter_map(|edge| ring_of.get(edge)).map(|&ring| root(&roots, ring)).collect();
            let ring = known.iter().copied().min().unwrap_or_else(|| {
                roots.push(roots.len());
                roots.len() - 1
            });
            known.iter().for_each(|&other| roots[other] = ring);
            edges.iter().for_each(|&edge| {
                ring_of.insert(edge, ring);
            });
            rings.push(ring);
        }
        let mut sums: Vec<(Vec3, f32, Vec2)> = vec![(Vec3::ZERO, 0.0, Vec2::ZERO); roots.len()];
        for ((_, [p, q], texture), ring) in segments.iter().zip(rings) {
            let length = p.distance(*q);
            let sum = &mut sums[root(&roots, ring)];
            sum.0 += length * 0.5 * (*p + *q);
            sum.1 += length;
            sum.2 += *texture;
        }
        sums.into_iter()
            .filter(|(_, length, _)| *length > 0.0)
            .map(|(moment, length, texture)| (Node { center: moment / length, radius: length / TAU }, texture))
            .collect()
    }
}

fn branch(mesh: &PlantMesh, element: Element) -> Branch {
    let piece = Piece::new(mesh, &element);
    let edges = piece.edges();
    let mut neighbours = vec![Vec::new(); piece.positions.len()];
    for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    let farthest = |distances: &[f32]| {
        let reached = |distance: f32| if distance.is_finite() { distance } else { 0.0 };
        let order = |a: &usize, b: &usize| reached(distances[*a]).total_cmp(&reached(distances[*b]));
        (0..distances.len()).max_by(order).unwrap_or(0) as u32
    };
    let one_end = farthest(&piece.distances(&neighbours, &[0]));
    let other_end = farthest(&piece.distances(&neighbours, &[one_end]));
    let height = |place: u32| piece.positions[place as usize].y;
    let start = if height(other_end) < height(one_end) { other_end } else { one_end };
    let distances = piece.distances(&neighbours, &open_end(&edges, start));
    let length = distances.iter().copied().filter(|distance| distance.is_finite()).fold(0.0, f32::max);
    let mean_radius = (element.area / (TAU * length.max(1e-6))).max(1e-6);
    let levels = ((length / (2.0 * mean_radius)) as usize).clamp(2, MOST_LEVELS);
    let rings: Vec<Vec<(Node, Vec2)>> = (0..=levels)
        .map(|level| {
            let share = (level as f32 / levels as f32).clamp(0.002, 0.998);
            piece.contours(&distances, share * length)
        })
        .collect();
    let mapping = mapping(&piece, &rings, element.area);
    let axes = axes(&rings);
    Branch { triangles: element.triangles, area: element.area, axes, mapping }
}

/// The places of the open end on which `start` lies, or `start` alone. `edges` are sorted; one that occurs once is open.
fn open_end(edges: &[(u32, u32)], start: u32) -> Vec<u32> {
    let mut beside: HashMap<u32, Vec<u32>> = HashMap::new();
    for chunk in edges.chunk_by(|a, b| a == b).filter(|chunk| chunk.len() == 1) {
        let (a, b) = chunk[0];
        beside.entry(a).or_default().push(b);
        beside.entry(b).or_default().push(a);
    }
    let mut end = vec![start];
    let mut at = 0;
    while at < end.len() {
        for &next in beside.get(&end[at]).map_or(&[][..], Vec::as_slice) {
            if !end.contains(&next) {
                end.push(next);
            }
        }
        at += 1;
    }
    end
}

/// Joins the rings of successive levels to axes. A ring follows the nearest one of the level below; of several that
/// follow the same one the thickest goes on, and the others begin new axes there.
fn axes(rings: &[Vec<(Node, Vec2)>]) -> Vec<Vec<Node>> {
    let mut axes: Vec<Vec<Node>> = Vec::new();
    // The axis that ends in each ring of the level below.
    let mut below: Vec<(Node, usize)> = Vec::new();
    for level in rings {
        let mut here: Vec<(Node, usize)> = Vec::with_capacity(level.len());
        let mut order: Vec<Node> = level.iter().map(|(node, _)| *node).collect();
        order.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        let mut gone_on = Vec::new();
        for node in order {
            let distance = |other: &(Node, usize)| other.0.center.distance_squared(node.center);
            let parent = below.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let axis = match parent {
                Some((_, axis)) if !gone_on.contains(&axis) => axis,
                Some((from, _)) => {
                    axes.push(vec![Node { radius: node.radius, ..from }]);
                    axes.len() - 1
                }
                None => {
                    axes.push(Vec::new());
                    axes.len() - 1
                }
            };
            gone_on.push(axis);
            axes[axis].push(node);
            here.push((node, axis));
        }
        if !here.is_empty() {
            below = here;
        }
    }
    axes.retain(|axis| axis.len() > 1);
    axes
}

fn mapping(piece: &Piece, rings: &[Vec<(Node, Vec2)>], area: f32) -> Mapping {
    let (mut texture, mut around, mut count) = (Vec2::ZERO, 0.0, 0.0f32);
    for (node, length) in rings.iter().flatten() {
        texture += *length;
        around += TAU * node.radius;
        count += 1.0;
    }
    let upright = texture.x >= texture.y;
    let repeats = texture.max_element() / count.max(1.0);
    let repeats = if repeats.is_finite() { repeats.round().clamp(1.0, 64.0) } else { 1.0 };
    // As large in the texture as the original.
    let covered: f32 = piece.uvs.iter().map(|[a, b, c]| 0.5 * (*b - *a).perp_dot(*c - *a).abs()).sum();
    let along = covered / area * (around / count.max(1.0)) / repeats;
    Mapping { around: repeats, along: if along.is_finite() { along.clamp(0.0, 1e3) } else { 1.0 }, upright }
}

/// The axis with as few nodes as keep within `tolerance` metres of the others, in position and in radius [Douglas &
/// Peucker 1973].
fn simplified(axis: &[Node], tolerance: f32) -> Vec<Node> {
    let Some(last) = axis.len().checked_sub(1) else { return Vec::new() };
    let mut kept = vec![false; axis.len()];
    kept[0] = true;
    kept[last] = true;
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (axis[from], axis[to]);
        let along = b.center - a.center;
        let deviation = |node: &Node| {
            let share = ((node.center - a.center).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let radius = a.radius + share * (b.radius - a.radius);
            node.center.distance(a.center + share * along).max((node.radius - radius).abs())
        };
        let worst = (from + 1..to).max_by(|i, j| deviation(&axis[*i]).total_cmp(&deviation(&axis[*j])));
        if let Some(worst) = worst.filter(|worst| deviation(&axis[*worst]) > tolerance) {
            kept[worst] = true;
            open.extend([(from, worst), (worst, to)]);
        }
    }
    axis.iter().zip(kept).filter(|(_, kept)| *kept).map(|(node, _)| *node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bent cone of twelve sides, welded but for its seam.
    fn cone(rings: usize, bend: f32) -> PlantMesh {
        const SIDES: usize = 12;
        let mut mesh = PlantMesh::default();
        for ring in 0..=rings {
            let share = ring as f32 / rings as f32;
            let radius = 0.3 - 0.2 * share;
            for side in 0..=SIDES {
                let (sin, cos) = (TAU * (side % SIDES) as f32 / SIDES as f32).sin_cos();
                let normal = Vec3::new(cos, 0.0, sin);
                mesh.positions.push(Vec3::new(bend * share * share, 5.0 * share, 0.0) + radius * normal);
                mesh.normals.push(normal);
                mesh.uvs.push(Vec2::new(2.0 * side as f32 / SIDES as f32, -2.5 * share));
                if ring > 0 && side < SIDES {
                    let (at, row) = ((ring * (SIDES + 1) + side) as u32, SIDES as u32 + 1);
                    mesh.triangles.push([at - row, at, at + 1]);
                    mesh.triangles.push([at - row, at + 1, at + 1 - row]);
                }
            }
        }
        mesh
    }

    #[test]
    fn a_cone_becomes_a_tube_of_its_width_and_texture() {
        for (bend, rings) in [(0.0, 20), (2.0, 20)] {
            let mesh = cone(rings, bend);
            let all = branches(&mesh);
            assert_eq!(all.len(), 1);
            assert_eq!(all[0].axes.len(), 1);
            assert!((all[0].radius() - 0.3).abs() < 0.02, "{}", all[0].radius());
            let settings = TubeSettings { sides: 6, tolerance: 0.2 };
            let (tube, count) = reduce(&mesh, &all, &settings, 1000);
            assert_eq!(count, 1);
            assert!(tube.mesh.is_whole() && tube.sources.len() == tube.mesh.positions.len());
            let triangles = tube.mesh.triangles.len();
            assert!(if bend == 0.0 { triangles == 12 } else { (24..=96).contains(&triangles) }, "{triangles}");
            let area = |mesh: &PlantMesh| mesh.triangles.iter().map(|t| mesh.area(*t)).sum::<f32>();
            assert!((area(&tube.mesh) / area(&mesh) - 1.0).abs() < 0.06, "{} {}", area(&tube.mesh), area(&mesh));
            let of_texture = |mesh: &PlantMesh| {
                let uvs = || mesh.triangles.iter().map(|t| t.map(|corner| mesh.uvs[corner as usize]));
                uvs().map(|[a, b, c]| 0.5 * (b - a).perp_dot(c - a).abs()).sum::<f32>()
            };
            assert!((of_texture(&tube.mesh) / of_texture(&mesh) - 1.0).abs() < 0.15);
            // The outside is the front.
            for [a, b, c] in tube.mesh.triangles.iter().map(|t| t.map(|corner| corner as usize)) {
                let p = &tube.mesh.positions;
                assert!((p[b] - p[a]).cross(p[c] - p[a]).dot(tube.mesh.normals[a]) > 0.0);
            }
        }
    }

    #[test]
    fn what_is_no_tube_does_no_harm() {
        let mut flat = cone(1, 0.0);
        flat.positions.iter_mut().for_each(|position| *position = Vec3::ONE);
        let mut single = cone(1, 0.0);
        single.triangles.truncate(1);
        for mesh in [PlantMesh::default(), flat, single] {
            let all = branches(&mesh);
            let (tube, _) = reduce(&mesh, &all, &TubeSettings { sides: 5, tolerance: 0.5 }, 100);
            assert!(tube.mesh.is_whole());
            assert!(tube.sources.iter().all(|&source| (source as usize) < mesh.positions.len()));
        }
    }
}
