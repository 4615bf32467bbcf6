//! How high the relief stands around a place: what of the sky it hides.
//!
//! A horizon is found by steps that grow with the distance, in grids of heights that grow coarser with it. Cost: one [`Terrain::height`] per node of
//! the grids, some 400,000 for a square terrain, and a bilinear lookup per cell, direction and step. It depends on the terrain alone.

use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use super::Terrain;

/// Directions in which horizons are known: the first is north, the second east of it.
pub const AZIMUTHS: usize = 16;

/// Metres from a place to the first step: nearer relief is the ground on which it lies.
const FIRST_STEP: f64 = 20.0;
/// From one step to the next, as a factor.
const STEP_GROWTH: f64 = 1.25;
/// Steepest horizon, as a tangent: some 89°.
const STEEPEST: f32 = 60.0;
/// Nodes of the finest grid along the longer side.
const FINEST_NODES: f64 = 512.0;
/// The least number of spacings of its grid that a step is long, where the grid is not the finest.
const SPACINGS_PER_STEP: f64 = 8.0;

/// Tangents of the horizon's elevation in each direction, 0 or more.
pub type Horizon = [f32; AZIMUTHS];

/// The unit vector (x east, y south) of a direction.
pub fn azimuth(index: usize) -> DVec2 {
    let (sin, cos) = (TAU * index as f64 / AZIMUTHS as f64).sin_cos();
    DVec2::new(sin, -cos)
}

/// The horizons of a grid of `columns` × `rows` cells over `extent` metres around the terrain's middle, row by row from the north. Relief farther than
/// `farthest` metres does not count. Everything is finite.
pub fn horizons(terrain: &Terrain, extent: DVec2, columns: usize, rows: usize, farthest: f64) -> Vec<Horizon> {
    let cell = extent / DVec2::new(columns.max(1) as f64, rows.max(1) as f64);
    let (_, highest) = terrain.min_max_height();
    let steps = steps(terrain, extent, farthest);
    let tangent = |place: DVec2, height: f64, direction: DVec2| {
        let mut steepest = 0.0f64;
        for (grid, distances) in &steps {
            for distance in distances {
                // What lies farther cannot be steeper.
                if f64::from(highest) - height <= steepest * distance {
                    return (steepest as f32).min(STEEPEST);
                }
                steepest = steepest.max((grid.height(place + direction * distance) - height) / distance);
            }
        }
        (steepest as f32).min(STEEPEST)
    };
    let horizon = |index: usize| {
        let place = (DVec2::new((index % columns) as f64, (index / columns) as f64) + 0.5) * cell - 0.5 * extent;
        let height = terrain.height(place.x, place.y);
        std::array::from_fn(|direction| tangent(place, height, azimuth(direction)))
    };
    (0..columns * rows).into_par_iter().map(horizon).collect()
}

/// The distances of all steps, with the grid in which each is looked up.
fn steps(terrain: &Terrain, extent: DVec2, farthest: f64) -> Vec<(HeightGrid, Vec<f64>)> {
    let mut distances = std::iter::successors(Some(FIRST_STEP), |step| Some(step * STEP_GROWTH))
        .take_while(|step| *step <= farthest)
        .peekable();
    let mut spacing = (extent.max_element() / FINEST_NODES).max(1e-3);
    let mut steps = Vec::new();
    while distances.peek().is_some() {
        // Those that are too short for the next grid.
        let of_grid: Vec<f64> =
            std::iter::from_fn(|| distances.next_if(|step| *step < 2.0 * SPACINGS_PER_STEP * spacing)).collect();
        if let Some(reach) = of_grid.last() {
            steps.push((HeightGrid::new(terrain, extent + 2.0 * reach, spacing), of_grid));
        }
        spacing *= 2.0;
    }
    steps
}

/// Heights at the nodes of a grid around the terrain's middle.
struct HeightGrid {
    corner: DVec2,
    spacing: f64,
    columns: usize,
    rows: usize,
    heights: Vec<f32>,
}

impl HeightGrid {
    fn new(terrain: &Terrain, extent: DVec2, spacing: f64) -> Self {
        let nodes = |length: f64| (length / spacing).ceil() as usize + 1;
        let (columns, rows) = (nodes(extent.x).max(2), nodes(extent.y).max(2));
        let corner = -0.5 * spacing * DVec2::new((columns - 1) as f64, (rows - 1) as f64);
        let height = |index: usize| {
            let node = corner + spacing * DVec2::new((index % columns) as f64, (index / columns) as f64);
            terrain.height(node.x, node.y) as f32
        };
        Self { corner, spacing, columns, rows, heights: (0..columns * rows).into_par_iter().map(height).collect() }
    }

    /// The bilinear height at a place; that of the border beyond it.
    fn height(&self, place: DVec2) -> f64 {
        let at = (place - self.corner) / self.spacing;
        let (column, across) = node(at.x, self.columns);
        let (row, along) = node(at.y, self.rows);
        let first = row * self.columns + column;
        let [a, b, c, d] =
            [first, first + 1, first + self.columns, first + self.columns + 1].map(|i| f64::from(self.heights[i]));
        let (north, south) = (a + (b - a) * across, c + (d - c) * across);
        north + (south - north) * along
    }
}

/// The node before a position in spacings, and the way from it to the next.
fn node(at: f64, count: usize) -> (usize, f64) {
    let at = at.clamp(0.0, (count - 1) as f64);
    let before = (at as usize).min(count - 2);
    (before, at - before as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{HeightField, Surroundings};

    /// 2 km of level ground with a wall of 100 m along its eastern border.
    fn wall() -> Terrain {
        let heights = (0..101 * 101).map(|index| if index % 101 >= 91 { 100.0 } else { 0.0 }).collect();
        Terrain::new(HeightField::new(101, 101, DVec2::splat(20.0), heights).unwrap(), None, Surroundings::Border)
    }

    #[test]
    fn a_wall_stands_as_high_as_it_is_over_its_distance() {
        let horizons = horizons(&wall(), DVec2::splat(2000.0), 20, 20, 12_000.0);
        // 50 m from the western border, in the middle: the wall's edge is 1,770 m away.
        let west = horizons[10 * 20];
        let east = west[AZIMUTHS / 4];
        assert!((0.8..1.1).contains(&(east * 1770.0 / 100.0)), "{east}");
        assert_eq!((west[0], west[AZIMUTHS / 2], west[3 * AZIMUTHS / 4]), (0.0, 0.0, 0.0));
        assert!(horizons.iter().flatten().all(|tangent| (0.0..=STEEPEST).contains(tangent)));
    }

    #[test]
    fn level_ground_has_no_horizon() {
        let level = HeightField::new(3, 3, DVec2::splat(100.0), vec![250.0; 9]).unwrap();
        let terrain = Terrain::new(level, None, Surroundings::Mirror);
        assert!(
            horizons(&terrain, DVec2::splat(200.0), 4, 4, 12_000.0).iter().flatten().all(|tangent| *tangent < 1e-5)
        );
    }

    #[test]
    fn coarse_heights_leave_the_horizon_where_exact_ones_have_it() {
        let hill = |i: usize, from: f32, length: f32| 60.0 * (i as f32 / length + from).sin();
        let heights: Vec<f32> = (0..201 * 201)
            .map(|index| hill(index % 201, 0.3, 9.0) + hill(index / 201, 1.1, 14.0) + 0.1 * hill(index, 0.0, 2.0))
            .collect();
        let field = HeightField::new(201, 201, DVec2::splat(20.0), heights).unwrap();
        let terrain = Terrain::new(field, None, Surroundings::Mirror);
        let (extent, side, farthest) = (DVec2::splat(4000.0), 16, 6000.0);
        let found = horizons(&terrain, extent, side, side, farthest);
        let (mut error, mut sum) = (0.0f64, 0.0f64);
        for (index, horizon) in found.iter().enumerate() {
            let place =
                (DVec2::new((index % side) as f64, (index / side) as f64) + 0.5) * (4000.0 / side as f64) - 2000.0;
            let height = terrain.height(place.x, place.y);
            for (direction, tangent) in horizon.iter().enumerate() {
                let exact = std::iter::successors(Some(FIRST_STEP), |step| Some(step * STEP_GROWTH))
                    .take_while(|step| *step <= farthest)
                    .map(|step| {
                        let there = place + step * azimuth(direction);
                        (terrain.height(there.x, there.y) - height) / step
                    })
                    .fold(0.0, f64::max);
                error += (exact - f64::from(*tangent)).abs();
                sum += exact;
            }
        }
        assert!(sum > 0.05 * found.len() as f64 * AZIMUTHS as f64 && error < 0.03 * sum, "{error} of {sum}");
    }

    #[test]
    fn any_extent_has_horizons() {
        for (extent, cells) in [(DVec2::ZERO, 1), (DVec2::new(1e-9, 1.0), 2), (DVec2::new(2e6, 10.0), 3)] {
            let found = horizons(&wall(), extent, cells, cells, 2000.0);
            assert_eq!(found.len(), cells * cells);
            assert!(found.iter().flatten().all(|tangent| (0.0..=STEEPEST).contains(tangent)));
        }
        assert!(horizons(&wall(), DVec2::splat(100.0), 0, 0, 2000.0).is_empty());
    }
}
