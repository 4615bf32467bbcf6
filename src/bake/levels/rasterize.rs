//! An orthographic rasteriser on the CPU: which triangle of a plant does a viewer far away see in each sample.
//!
//! Point samples, a depth buffer, the alpha test of the plant's own textures at full resolution (so that the mean
//! over many samples is the true coverage, which a filtered alpha would bias), both sides of every triangle. The
//! image is cut into bands of rows that are independent of one another: rayon works on them in any order, and
//! within a band triangles are drawn in a fixed order, so the result is the same whatever the threads.
//!
//! Triangles are drawn from front to back: in a crown of many layers the depth buffer then rejects most samples
//! before their alpha is looked up.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::plant::{Bounds, Plant, PlantPart, geometry, surface::Surface};

/// An orthographic view: a rectangle that is looked at from afar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Middle of the rectangle, metres.
    pub center: Vec3,
    /// From the middle to the right border, metres. A zero vector makes an empty image.
    pub right: Vec3,
    /// From the middle to the upper border, metres. A zero vector makes an empty image.
    pub up: Vec3,
    /// Unit vector from the rectangle to the viewer.
    pub toward: Vec3,
}

impl View {
    /// The view from direction `toward` (unit) whose square frames the sphere around `bounds`.
    pub fn framing(bounds: Bounds, toward: Vec3) -> Self {
        let radius = 0.5 * bounds.size().length();
        let (right, up) = toward.any_orthonormal_pair();
        Self { center: bounds.center(), right: radius * right, up: radius * up, toward }
    }
}

/// What one sample sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Which part; [`Hit::NONE`]'s where nothing is seen.
    pub part: u32,
    /// Place in the part's `triangles`.
    pub triangle: u32,
    /// Barycentric weights of the second and third corner.
    pub weights: Vec2,
}

impl Hit {
    const NONE: Self = Self { part: u32::MAX, triangle: 0, weights: Vec2::ZERO };

    /// Whether the sample sees the plant.
    pub fn is_some(&self) -> bool {
        self.part != u32::MAX
    }
}

/// A triangle of a plant at a position that need not be its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedTriangle {
    /// Which part.
    pub part: u32,
    /// Place in the part's `triangles`; its corners must be valid.
    pub triangle: u32,
    /// Its corners, metres.
    pub corners: [Vec3; 3],
}

/// The materials of all parts of `plant`, for several images of it.
pub(crate) fn surfaces(plant: &Plant) -> Arc<Vec<Surface>> {
    Arc::new(plant.parts.iter().map(Surface::new).collect())
}

/// A triangle in samples (x right, y down) and metres (z toward the viewer).
struct Projected {
    corners: [Vec3; 3],
    uvs: [Vec2; 3],
    part: u32,
    triangle: u32,
}

/// A plant projected and sorted into bands, ready to be drawn band by band.
pub(crate) struct Raster {
    surfaces: Arc<Vec<Surface>>,
    projected: Vec<Projected>,
    /// For each band the triangles that touch it, nearest first.
    bands: Vec<Vec<u32>>,
    width: u32,
    height: u32,
    band_rows: u32,
}

impl Raster {
    /// Projects `plant` for an image of `width` x `height` samples, in bands of `band_rows` rows.
    pub fn new(plant: &Plant, view: &View, width: u32, height: u32, band_rows: u32) -> Self {
        let placed = plant.parts.iter().enumerate().flat_map(|(part, PlantPart { mesh, .. })| {
            geometry::triangles(mesh).map(move |(triangle, corners)| PlacedTriangle {
                part: part as u32,
                triangle,
                corners: corners.map(|i| mesh.positions[i]),
            })
        });
        Self::of_triangles(plant, surfaces(plant), placed, view, [width, height], band_rows)
    }

    /// Projects these triangles of `plant`, whose materials are `surfaces`.
    pub fn of_triangles(
        plant: &Plant,
        surfaces: Arc<Vec<Surface>>,
        triangles: impl Iterator<Item = PlacedTriangle>,
        view: &View,
        [width, height]: [u32; 2],
        band_rows: u32,
    ) -> Self {
        let inverse = |axis: Vec3| if axis.length_squared() > 0.0 { axis / axis.length_squared() } else { Vec3::ZERO };
        let (right, up) = (inverse(view.right), inverse(view.up));
        let half = 0.5 * Vec2::new(width as f32, height as f32);
        let project = |position: Vec3| {
            let p = position - view.center;
            Vec3::new(half.x * (1.0 + p.dot(right)), half.y * (1.0 - p.dot(up)), p.dot(view.toward))
        };
        let mut projected: Vec<Projected> = triangles
            .map(|placed| {
                let mesh = &plant.parts[placed.part as usize].mesh;
                let uvs = mesh.triangles[placed.triangle as usize].map(|corner| mesh.uvs[corner as usize]);
                let PlacedTriangle { part, triangle, corners } = placed;
                Projected { corners: corners.map(project), uvs, part, triangle }
            })
            .filter(|t| t.corners.iter().all(|c| c.is_finite()))
            .collect();
        // A stable sort: of two triangles at the same depth the plant's first is drawn first, and stays.
        let nearest = |t: &Projected| t.corners[0].z.max(t.corners[1].z).max(t.corners[2].z);
        projected.par_sort_by(|a, b| nearest(b).total_cmp(&nearest(a)));
        let mut bands = vec![Vec::new(); height.div_ceil(band_rows) as usize];
        for (index, triangle) in projected.iter().enumerate() {
            let [a, b, c] = triangle.corners.map(|c| c.y);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            if high >= 0.0 && low < height as f32 {
                let band = |y: f32| (y.max(0.0) as usize / band_rows as usize).min(bands.len() - 1);
                let (first, last) = (band(low), band(high));
                bands[first..=last].iter_mut().for_each(|list| list.push(index as u32));
            }
        }
        Self { surfaces, projected, bands, width, height, band_rows }
    }

    /// Samples in a row.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// First row of a band.
    pub fn first_row(&self, band: usize) -> usize {
        band * self.band_rows as usize
    }

    /// Number of bands.
    pub fn band_count(&self) -> usize {
        self.bands.len()
    }

    /// The material of a part.
    pub fn surface(&self, part: u32) -> &Surface {
        &self.surfaces[part as usize]
    }

    /// Draws one band: its samples row by row, `width` a row; the last band may have fewer rows.
    pub fn draw(&self, band: usize) -> Vec<Hit> {
        let top = band as u32 * self.band_rows;
        let bottom = (top + self.band_rows).min(self.height);
        let count = (self.width * (bottom - top)) as usize;
        let mut hits = vec![Hit::NONE; count];
        let mut depths = vec![f32::NEG_INFINITY; count];
        for &index in &self.bands[band] {
            self.draw_triangle(&self.projected[index as usize], top, bottom, &mut hits, &mut depths);
        }
        hits
    }

    fn draw_triangle(&self, triangle: &Projected, top: u32, bottom: u32, hits: &mut [Hit], depths: &mut [f32]) {
        let [a, b, c] = triangle.corners;
        let (ab, ac) = ((b - a).truncate(), (c - a).truncate());
        let inverse_area = 1.0 / ab.perp_dot(ac);
        if !inverse_area.is_finite() {
            return;
        }
        let surface = &self.surfaces[triangle.part as usize];
        let [ta, tb, tc] = triangle.uvs;
        let part = triangle.part;
        // Barycentric weights of b and c and how they change from sample to sample along a row.
        let (step_b, step_c) = (ac.y * inverse_area, -ab.y * inverse_area);
        for y in samples(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), top, bottom) {
            let p = Vec2::new(0.5, y as f32 + 0.5) - a.truncate();
            let (row_b, row_c) = (p.perp_dot(ac) * inverse_area, ab.perp_dot(p) * inverse_area);
            // Where all three weights are positive.
            let mut span = (0.0f32, self.width as f32 - 1.0);
            for (start, step) in [(row_b, step_b), (row_c, step_c), (1.0 - row_b - row_c, -step_b - step_c)] {
                let zero = -start / step;
                if step > 0.0 {
                    span.0 = span.0.max(zero);
                } else if step < 0.0 {
                    span.1 = span.1.min(zero);
                } else if start < 0.0 {
                    span.1 = -1.0;
                }
            }
            if span.1 < span.0 {
                continue;
            }
            let row = ((y - top) * self.width) as usize;
            for x in span.0.ceil() as usize..span.1.floor() as usize + 1 {
                let (wb, wc) = (row_b + x as f32 * step_b, row_c + x as f32 * step_c);
                let wa = 1.0 - wb - wc;
                let depth = wa * a.z + wb * b.z + wc * c.z;
                let at = row + x;
                if depth > depths[at] && surface.passes(wa * ta + wb * tb + wc * tc) {
                    depths[at] = depth;
                    hits[at] = Hit { part, triangle: triangle.triangle, weights: Vec2::new(wb, wc) };
                }
            }
        }
    }
}

/// The samples, each in the middle of its unit, that lie in `low..=high` and in `from..to`.
fn samples(low: f32, high: f32, from: u32, to: u32) -> std::ops::Range<u32> {
    // Casts to unsigned integers saturate.
    ((low - 0.5).ceil() as u32).max(from)..((high + 0.5).floor() as u32).min(to)
}

/// Area of the plant's outline seen along `view`, square metres: holes of the alpha test are not counted, what is
/// hidden counts once. Sampled with `resolution`² points; what lies outside the view's rectangle is not seen.
pub fn projected_area(plant: &Plant, view: &View, resolution: u32) -> f32 {
    let resolution = resolution.clamp(1, 8192);
    let raster = Raster::new(plant, view, resolution, resolution, 32);
    let seen: Vec<usize> = (0..raster.band_count())
        .into_par_iter()
        .map(|band| raster.draw(band).iter().filter(|hit| hit.is_some()).count())
        .collect();
    let share = seen.iter().sum::<usize>() as f32 / (resolution as f32).powi(2);
    let area = 4.0 * view.right.length() * view.up.length() * share;
    if area.is_finite() { area } else { 0.0 }
}
