//! Ambient visibility k_a: the share of the surroundings' light that reaches a vertex through the crown.
//!
//! The foliage is taken as a turbid medium. Its leaf-area density u (one-sided leaf area a volume, 1/m) is splatted
//! into a grid, and the light along a ray falls off by Beer and Lambert's law with the extinction coefficient G of
//! [Monsi & Saeki 1953; translated in Annals of Botany 95, 2005, eq. 1]:
//!
//! ```text
//!   T(x, w) = exp(-G * integral of u(x + t w) dt)        G = 1/2 for leaves that face everywhere alike
//!   k_a(x)  = mean of T over the directions w
//! ```
//!
//! The directions are a Hammersley set over the upper hemisphere (uniform in solid angle, without a cosine: a leaf
//! is lit on both sides) and a smaller one over the lower, for the light that the ground sends back. k_a is found at
//! the grid's nodes and interpolated at the vertices.
//!
//! Limits: a cell knows no leaves but only their density, so clumps smaller than a cell are too dark by Jensen's
//! inequality; wood casts no ambient shadow; a leaf stands in its own cell's density.

use glam::{IVec3, UVec3, Vec3};
use rayon::prelude::*;

use super::geometry;
use super::surface::Surface;
use crate::plant::{Bounds, PartKind, Plant};

/// How ambient visibility is computed. Values out of range are moved into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmbientSettings {
    /// Edge of a grid cell as a share of the plant's longest extent, 0.01..=0.25. Smaller: finer shading inside the
    /// crown, memory and time grow with the inverse third power.
    pub cell: f32,
    /// Directions over the upper hemisphere, 1..=4096. More: less banding, proportionally more time.
    pub upper_directions: u32,
    /// Directions over the lower hemisphere, 0..=4096. Each counts like an upper one, so their share of the whole is
    /// `lower / (upper + lower)`: the weight of the ground's light against the sky's.
    pub lower_directions: u32,
    /// Extinction coefficient G, 0..=2: area a leaf shows to a ray for its one-sided area. 0.5 for leaves that face
    /// everywhere alike. Higher: darker crowns.
    pub extinction: f32,
    /// Least value of k_a, 0..=1: light that is scattered from leaf to leaf keeps the inside from turning black.
    pub least: f32,
}

impl Default for AmbientSettings {
    fn default() -> Self {
        Self { cell: 0.045, upper_directions: 32, lower_directions: 8, extinction: 0.5, least: 0.05 }
    }
}

impl AmbientSettings {
    /// The settings with every value moved into its range; what is not finite becomes the default.
    pub fn in_range(self) -> Self {
        let or_default = |value: f32, default: f32| if value.is_finite() { value } else { default };
        let default = Self::default();
        Self {
            cell: or_default(self.cell, default.cell).clamp(0.01, 0.25),
            upper_directions: self.upper_directions.clamp(1, 4096),
            lower_directions: self.lower_directions.min(4096),
            extinction: or_default(self.extinction, default.extinction).clamp(0.0, 2.0),
            least: or_default(self.least, default.least).clamp(0.0, 1.0),
        }
    }
}

/// Ambient visibility k_a of every vertex of `plant`, wood and foliage: one list a part in the plant's order, one
/// value a position, each in `least..=1`. A plant without foliage sees everything: 1 throughout.
pub fn ambient_visibility(plant: &Plant, settings: &AmbientSettings) -> Vec<Vec<f32>> {
    let settings = settings.in_range();
    let Some(density) = leaf_area_density(plant, settings.cell) else {
        return plant.parts.iter().map(|part| vec![1.0; part.mesh.positions.len()]).collect();
    };
    let visibility = node_visibility(plant, &density, &settings);
    plant
        .parts
        .iter()
        .map(|part| {
            let at = |position: &Vec3| {
                let value = density.grid.interpolate(&visibility, density.grid.coordinates(*position));
                if value.is_finite() { value.clamp(settings.least, 1.0) } else { 1.0 }
            };
            part.mesh.positions.par_iter().map(at).collect()
        })
        .collect()
}

/// A lattice of nodes around a plant; node (0, 0, 0) lies at `origin`.
#[derive(Clone, Debug)]
struct Grid {
    origin: Vec3,
    cell: f32,
    nodes: UVec3,
}

impl Grid {
    /// A lattice with one empty layer of nodes around `bounds`. `None` where the bounds have no extent.
    fn around(bounds: Bounds, cell_share: f32) -> Option<Self> {
        let size = bounds.size();
        let cell = size.max_element() * cell_share;
        if !size.is_finite() || cell < f32::MIN_POSITIVE.sqrt() {
            return None;
        }
        let cells = (size / cell).ceil().as_uvec3() + UVec3::ONE;
        let nodes = cells + UVec3::splat(3);
        let origin = bounds.center() - 0.5 * cell * (nodes - UVec3::ONE).as_vec3();
        Some(Self { origin, cell, nodes })
    }

    fn len(&self) -> usize {
        self.nodes.as_u64vec3().element_product() as usize
    }

    fn coordinates(&self, position: Vec3) -> Vec3 {
        (position - self.origin) / self.cell
    }

    fn index(&self, node: UVec3) -> usize {
        ((node.z * self.nodes.y + node.y) * self.nodes.x + node.x) as usize
    }

    fn node(&self, index: usize) -> UVec3 {
        let (x, y) = (self.nodes.x as usize, self.nodes.y as usize);
        UVec3::new((index % x) as u32, (index / x % y) as u32, (index / (x * y)) as u32)
    }

    /// The eight nodes around a point in grid coordinates, with their trilinear weights; points outside are moved to
    /// the border.
    fn corners(&self, point: Vec3) -> [(usize, f32); 8] {
        let last_cell = (self.nodes - UVec3::splat(2)).as_vec3();
        let low = point.floor().clamp(Vec3::ZERO, last_cell);
        let f = (point - low).clamp(Vec3::ZERO, Vec3::ONE);
        let g = Vec3::ONE - f;
        let at = self.index(low.as_uvec3());
        let (row, layer) = (self.nodes.x as usize, (self.nodes.x * self.nodes.y) as usize);
        [
            (at, g.x * g.y * g.z),
            (at + 1, f.x * g.y * g.z),
            (at + row, g.x * f.y * g.z),
            (at + row + 1, f.x * f.y * g.z),
            (at + layer, g.x * g.y * f.z),
            (at + layer + 1, f.x * g.y * f.z),
            (at + layer + row, g.x * f.y * f.z),
            (at + layer + row + 1, f.x * f.y * f.z),
        ]
    }

    fn interpolate(&self, values: &[f32], point: Vec3) -> f32 {
        self.corners(point).iter().map(|&(node, weight)| weight * values[node]).sum()
    }
}

/// Leaf-area density at the nodes of a grid.
struct Density {
    grid: Grid,
    /// One-sided leaf area a volume at each node, 1/m; zero at the border.
    values: Vec<f32>,
}

/// Splats the foliage into a grid. Each triangle is sampled on a lattice no wider than half a cell; the points that
/// pass the alpha test carry their share of its area to the eight nodes around them. `None` where there is no leaf.
fn leaf_area_density(plant: &Plant, cell_share: f32) -> Option<Density> {
    const FEWEST: u32 = 4;
    const MOST: u32 = 48;
    plant.bounds_of(|kind| kind == PartKind::Foliage)?;
    let grid = Grid::around(plant.bounds()?, cell_share)?;
    let lattices: Vec<Vec<Vec3>> = (FEWEST..=MOST).map(geometry::barycentric_lattice).collect();
    let mut values = vec![0.0f32; grid.len()];
    for part in plant.parts.iter().filter(|part| part.kind == PartKind::Foliage) {
        let surface = Surface::new(part);
        let mesh = &part.mesh;
        for (_, corners) in geometry::triangles(mesh) {
            let [a, b, c] = corners.map(|i| grid.coordinates(mesh.positions[i]));
            let [ta, tb, tc] = corners.map(|i| mesh.uvs[i]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let order = ((2.0 * longest).ceil() as u32).clamp(FEWEST, MOST);
            let lattice = &lattices[(order - FEWEST) as usize];
            let share = geometry::area(mesh, corners) / lattice.len() as f32;
            for w in lattice {
                if surface.passes(w.x * ta + w.y * tb + w.z * tc) {
                    for (node, weight) in grid.corners(w.x * a + w.y * b + w.z * c) {
                        values[node] += share * weight;
                    }
                }
            }
        }
    }
    let volume = grid.cell.powi(3);
    values.iter_mut().for_each(|value| *value /= volume);
    Some(Density { grid, values })
}

/// k_a at the nodes around the plant's vertices; 1 at all others, which nobody reads.
fn node_visibility(plant: &Plant, density: &Density, settings: &AmbientSettings) -> Vec<f32> {
    let grid = &density.grid;
    let mut wanted = vec![false; grid.len()];
    for position in plant.parts.iter().flat_map(|part| &part.mesh.positions) {
        for (node, _) in grid.corners(grid.coordinates(*position)) {
            wanted[node] = true;
        }
    }
    let directions = directions(settings.upper_directions, settings.lower_directions);
    let last = (grid.nodes - UVec3::ONE).as_ivec3();
    wanted
        .par_iter()
        .enumerate()
        .map(|(index, wanted)| {
            if !wanted {
                return 1.0;
            }
            let start = grid.node(index).as_vec3();
            let sum: f32 = directions
                .iter()
                .map(|direction| {
                    // Midpoint rule with steps of one cell, up to the border, where the density is zero.
                    let mut depth = 0.0;
                    let mut point = start + 0.5 * direction;
                    loop {
                        let cell = point.floor().as_ivec3();
                        if cell.cmplt(IVec3::ZERO).any() || cell.cmpge(last).any() {
                            break;
                        }
                        depth += grid.interpolate(&density.values, point);
                        point += direction;
                    }
                    (-settings.extinction * depth * grid.cell).exp()
                })
                .sum();
            sum / directions.len() as f32
        })
        .collect()
}

/// Hammersley points on the two hemispheres, uniform in solid angle.
fn directions(upper: u32, lower: u32) -> Vec<Vec3> {
    let hemisphere = |count: u32, sign: f32| {
        (0..count).map(move |i| {
            let y = (i as f32 + 0.5) / count as f32;
            // Radical inverse to base 2: the bits of i mirrored at the point.
            let azimuth = std::f32::consts::TAU * (i.reverse_bits() as f32 / 4_294_967_296.0);
            let radius = (1.0 - y * y).max(0.0).sqrt();
            Vec3::new(radius * azimuth.cos(), sign * y, radius * azimuth.sin())
        })
    };
    hemisphere(upper, 1.0).chain(hemisphere(lower, -1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{PlantMaterial, PlantMesh, PlantPart};
    use glam::Vec2;

    #[test]
    fn directions_are_units_and_balanced() {
        let upper = directions(64, 0);
        assert!(upper.iter().all(|d| (d.length() - 1.0).abs() < 1e-5 && d.y > 0.0));
        let mean = upper.iter().copied().sum::<Vec3>() / 64.0;
        assert!((mean - 0.5 * Vec3::Y).length() < 0.05, "{mean}");
        assert_eq!(directions(4, 3).iter().filter(|d| d.y < 0.0).count(), 3);
    }

    /// Thin horizontal leaves that fill a box evenly: the density inside is known, so is the light straight down.
    #[test]
    fn a_homogeneous_slab_follows_beer_and_lambert() {
        let (layers, extent) = (200, 20.0f32);
        let mut mesh = PlantMesh::default();
        for layer in 0..layers {
            let y = (layer as f32 + 0.5) / layers as f32;
            let base = mesh.positions.len() as u32;
            let steps = 20;
            for (i, k) in (0..steps).flat_map(|i| (0..steps).map(move |k| (i, k))) {
                let o = Vec3::new(i as f32, 0.0, k as f32) * (extent / steps as f32) + y * Vec3::Y;
                let s = extent / steps as f32 * (0.01f32 * 2.0).sqrt();
                mesh.positions.extend([o, o + s * Vec3::X, o + s * Vec3::Z]);
            }
            let count = mesh.positions.len() as u32 - base;
            mesh.triangles.extend((0..count / 3).map(|t| [base + 3 * t, base + 3 * t + 1, base + 3 * t + 2]));
        }
        // A box of 20 x 1 x 20 m with 200 layers that cover 1 % each: leaf-area index 2.
        mesh.normals = vec![Vec3::Y; mesh.positions.len()];
        mesh.uvs = vec![Vec2::ZERO; mesh.positions.len()];
        let part = PlantPart { kind: PartKind::Foliage, mesh, material: PlantMaterial::default() };
        let plant = Plant { name: String::new(), parts: vec![part] };
        let settings =
            AmbientSettings { cell: 0.01, upper_directions: 256, lower_directions: 0, extinction: 0.5, least: 0.0 };
        let ambient = ambient_visibility(&plant, &settings);
        let middle = plant.parts[0].mesh.positions.iter().zip(&ambient[0]);
        let middle: Vec<f32> = middle
            .filter(|(p, _)| (p.x - 10.0).abs() < 2.0 && (p.z - 10.0).abs() < 2.0 && p.y < 0.05)
            .map(|(_, k)| *k)
            .collect();
        let mean = middle.iter().sum::<f32>() / middle.len() as f32;
        // Integral of exp(-0.5 * 2 / mu) over mu in 0..1 is the exponential integral E2(1) = 0.1485.
        assert!((mean - 0.1485).abs() < 0.03, "{mean}");
    }
}
