//! How high the relief stands around a place: what of the sky it hides.
//!
//! Cost: one [`Terrain::height`] per cell, azimuth and step until the highest place of the terrain is lower: 0.06 s for the demo on two cores. It depends on the terrain alone.

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
    let steps = || std::iter::successors(Some(FIRST_STEP), |step| Some(step * STEP_GROWTH));
    let (_, highest) = terrain.min_max_height();
    let tangent = |place: DVec2, height: f64, direction: DVec2| {
        let mut steepest = 0.0f64;
        for distance in steps().take_while(|distance| *distance <= farthest) {
            // What lies farther cannot be steeper.
            if (f64::from(highest) - height) <= steepest * distance {
                break;
            }
            let there = place + direction * distance;
            steepest = steepest.max((terrain.height(there.x, there.y) - height) / distance);
        }
        (steepest as f32).min(STEEPEST)
    };
    let horizon = |index: usize| {
        let place = middle_of(extent, columns, rows, index);
        let height = terrain.height(place.x, place.y);
        std::array::from_fn(|direction| tangent(place, height, azimuth(direction)))
    };
    (0..columns * rows).into_par_iter().map(horizon).collect()
}

/// The angles in radians by which the ground slopes in the cells of such a grid, over 40 m.
pub fn slopes(terrain: &Terrain, extent: DVec2, columns: usize, rows: usize) -> Vec<f32> {
    let slope = |index: usize| {
        let place = middle_of(extent, columns, rows, index);
        let rise = |step: DVec2| {
            let height = |side: f64| terrain.height(place.x + side * step.x, place.y + side * step.y);
            (height(1.0) - height(-1.0)) / (2.0 * FIRST_STEP)
        };
        rise(DVec2::X * FIRST_STEP).hypot(rise(DVec2::Y * FIRST_STEP)).atan() as f32
    };
    (0..columns * rows).into_par_iter().map(slope).collect()
}

/// The middle of a cell, metres from the terrain's.
fn middle_of(extent: DVec2, columns: usize, rows: usize, index: usize) -> DVec2 {
    let cell = extent / DVec2::new(columns.max(1) as f64, rows.max(1) as f64);
    (DVec2::new((index % columns) as f64, (index / columns) as f64) + 0.5) * cell - 0.5 * extent
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
    fn a_ramp_slopes_as_it_rises() {
        let heights = (0..101 * 101).map(|index| 10.0 * (index % 101) as f32).collect();
        let field = HeightField::new(101, 101, DVec2::splat(20.0), heights).unwrap();
        let terrain = Terrain::new(field, None, Surroundings::Border);
        let ramp = slopes(&terrain, DVec2::splat(1000.0), 4, 4);
        assert!(ramp.iter().all(|slope| (slope - 0.5f32.atan()).abs() < 0.01), "{ramp:?}");
        let far_from_the_wall = slopes(&wall(), DVec2::splat(2000.0), 20, 20)[10 * 20];
        assert_eq!(far_from_the_wall, 0.0);
    }

    #[test]
    fn level_ground_has_no_horizon() {
        let level = HeightField::new(3, 3, DVec2::splat(100.0), vec![250.0; 9]).unwrap();
        let terrain = Terrain::new(level, None, Surroundings::Mirror);
        assert!(
            horizons(&terrain, DVec2::splat(200.0), 4, 4, 12_000.0).iter().flatten().all(|tangent| *tangent < 1e-5)
        );
    }
}
