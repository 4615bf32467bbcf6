//! How far the mesh of a level lies from the ground.

use glam::DVec2;
use rayon::prelude::*;

use super::super::Terrain;
use super::mesh::triangulated_height;

/// Samples of the ground per level at most; beyond, an even share of the quads is looked at.
const BUDGET: usize = 1_000_000;
/// Measured maxima are raised by this much, for what lies between the samples and for tiles that fall differently on
/// the mirror images of the field.
const MEASURED_MARGIN: f64 = 1.1;
/// The bend is taken at the corners of the cells; inside a cell it can be a little larger.
const BEND_MARGIN: f64 = 1.15;

/// The deviation of each vertex spacing (metres, rising) that the share `coverage` of the ground keeps, in metres,
/// never falling.
///
/// Spacings below half a sample of the field see a surface that is nearly quadratic over a triangle, so the second
/// derivatives give the deviation, `spacing² * bend`; coarser ones are measured over the field.
pub(super) fn of_levels(terrain: &Terrain, spacings: impl Iterator<Item = f64>, coverage: f64) -> Vec<f64> {
    let bend = quantile(terrain.bends(), coverage) * BEND_MARGIN;
    let cell = terrain.field().spacing().min_element();
    let mut largest = 0.0_f64;
    spacings
        .map(|spacing| {
            largest = largest.max(if spacing > 0.5 * cell {
                quantile(measured(terrain, spacing, cell), coverage) * MEASURED_MARGIN
            } else {
                spacing * spacing * bend
            });
            largest
        })
        .collect()
}

/// The smallest value that the share `coverage` of all values do not exceed; 0 of none.
fn quantile(mut values: Vec<f32>, coverage: f64) -> f64 {
    let rank = ((values.len() as f64 * coverage).ceil() as usize).clamp(1, values.len().max(1));
    if values.is_empty() {
        return 0.0;
    }
    f64::from(*values.select_nth_unstable_by(rank - 1, f32::total_cmp).1)
}

/// The largest deviation of each quad of the mesh over the field, or of an even share of them.
fn measured(terrain: &Terrain, spacing: f64, cell: f64) -> Vec<f32> {
    let half = terrain.extent() * 0.5;
    let first = (-half / spacing).floor();
    let count = (half / spacing).ceil() - first;
    let (columns, rows) = (count.x.max(1.0) as usize, count.y.max(1.0) as usize);
    // Two samples of the ground per sample of the field, but not less than four per quad.
    let per_side = ((2.0 * spacing / cell).ceil() as usize).clamp(4, 256);
    let quads = columns * rows;
    let visits = (BUDGET / (per_side * per_side)).clamp(1, quads);
    let deviation_of_quad = |visit: usize| {
        let quad = (visit as u128 * quads as u128 / visits as u128) as usize;
        let origin = (first + DVec2::new((quad % columns) as f64, (quad / columns) as f64)) * spacing;
        let height = |u: f64, v: f64| terrain.height(origin.x + u * spacing, origin.y + v * spacing);
        let corners = [height(0.0, 0.0), height(1.0, 0.0), height(0.0, 1.0), height(1.0, 1.0)];
        // The middle of the diagonal is where a bowl is farthest from its triangles.
        let mut largest = (height(0.5, 0.5) - triangulated_height(corners, 0.5, 0.5)).abs();
        for j in 0..per_side {
            let v = (j as f64 + 0.5) / per_side as f64;
            for i in 0..per_side {
                let u = (i as f64 + 0.5) / per_side as f64;
                largest = largest.max((height(u, v) - triangulated_height(corners, u, v)).abs());
            }
        }
        largest as f32
    };
    (0..visits).into_par_iter().with_min_len(64).map(deviation_of_quad).collect()
}
