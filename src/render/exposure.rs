//! The exposure of a camera from the light at its place: the sun and the sky of the hour, and of these what the stand around
//! it lets through. A function of light, ground, trees and position alone, so that a still and a frame of a flight agree.
//!
//! ```text
//! share(p) = exp(mean over a disc around p of ln E(cover, depth) / E(open ground))
//! EV100    = EV100(hour) + stand_adaptation * log2(share),  in steps of 1/64 EV
//! ```
//!
//! `E` is the illuminance between the crowns from the table of [`StandLight`]; the cover is the ground's, and the depth 0 a
//! little above the mean height of the trees, 1 on the ground. The disc has a radius of 48 m: exposure changes by a few
//! percent over a metre at most. Cost: 113 look-ups a frame, some 20 µs, and half a millisecond for a new light.

use std::{fmt, sync::Arc};

use glam::{DVec2, DVec3, Vec3};

use super::{components::Ground, forest::Leaves};
use crate::{
    bake::BakedPlant,
    light::{LightState, StandLight},
    scatter::{CoverMap, PackedStand},
};

/// Radius in metres of the disc whose mean logarithm counts.
const RADIUS: f64 = 48.0;
/// Metres between the points of the disc.
const SPACING: f64 = 8.0;
/// Height over the mean of the trees' heights at which a camera is in the open.
const TOP: f32 = 1.25;
/// Steps of the exposure per stop: what follows from it is uploaded again only for another step.
const STEPS: f32 = 64.0;

/// Sums over the trees of stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandTotals {
    leaves: Leaves,
    trees: f64,
    /// Sum of the trees' heights, metres.
    heights: f64,
}

impl StandTotals {
    /// The sums of one stand of `plants`, by variant.
    pub fn of(stand: &PackedStand, plants: &[BakedPlant]) -> Self {
        let heights: Vec<f32> = plants.iter().map(|plant| plant.size().height).collect();
        let height = |variant: u16, scale: f32| heights.get(usize::from(variant)).map_or(0.0, |height| height * scale);
        Self {
            leaves: Leaves::of(stand, plants),
            trees: stand.trees.len() as f64,
            heights: stand.trees.iter().map(|tree| f64::from(height(tree.variant(), tree.scale()))).sum(),
        }
    }

    /// Albedo of their crowns, seen together from far above.
    pub fn crown_albedo(&self) -> Vec3 {
        self.leaves.trees().crown_albedo()
    }

    /// The sums of two stands.
    #[must_use]
    pub fn combined(self, other: Self) -> Self {
        Self {
            leaves: self.leaves.add(other.leaves),
            trees: self.trees + other.trees,
            heights: self.heights + other.heights,
        }
    }

    /// Mean height of the trees, metres; 0 without any.
    pub fn height(&self) -> f32 {
        if self.trees > 0.0 { (self.heights / self.trees) as f32 } else { 0.0 }
    }
}

/// The exposure under one light among the trees of a world.
#[derive(Clone, Debug)]
pub struct CameraExposure {
    light: Arc<LightState>,
    stand: StandLight,
    /// Height above the ground at which a camera is in the open, metres.
    top: f32,
}

/// The exposure at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceExposure {
    /// EV at ISO 100.
    pub ev100: f32,
    /// EV at ISO 100 on open ground.
    pub open_ev100: f32,
    /// Fraction of the light on open ground, 0..1.
    pub share: f32,
    /// Whether it is fixed by a setting.
    pub fixed: bool,
}

impl fmt::Display for PlaceExposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { ev100, open_ev100, share, fixed } = self;
        match (fixed, *share < 1.0) {
            (true, _) => write!(f, "EV {ev100:.2}, fixed"),
            (false, false) => write!(f, "EV {ev100:.2}, in the open"),
            (false, true) => write!(
                f,
                "EV {ev100:.2}: {:.2} stops brighter than in the open, for {:.1} % of its light",
                open_ev100 - ev100,
                100.0 * share
            ),
        }
    }
}

impl CameraExposure {
    /// The exposure under `light` among the trees that `totals` sums up.
    pub fn new(light: Arc<LightState>, totals: StandTotals) -> Self {
        let stand = StandLight::new(&light, &totals.leaves.trees());
        Self { light, stand, top: TOP * totals.height() }
    }

    /// The exposure on open ground.
    pub fn in_the_open(&self) -> PlaceExposure {
        self.of_share(1.0)
    }

    /// The exposure at `position`, metres from the ground's own origin. Without a canopy cover it is that in the open.
    pub fn at(&self, ground: &Ground, position: DVec3) -> PlaceExposure {
        let above = (position.y - ground.terrain.height(position.x, position.z)) as f32;
        self.of_share(
            ground.cover.as_ref().map_or(1.0, |cover| self.share(cover, DVec2::new(position.x, position.z), above)),
        )
    }

    /// Fraction of the light on open ground, `above` metres over the ground at `point`.
    fn share(&self, cover: &CoverMap, point: DVec2, above: f32) -> f32 {
        // Written so that a camera whose height is not a number is in the open.
        if !(above < self.top && point.is_finite()) {
            return 1.0;
        }
        let depth = 1.0 - above.max(0.0) / self.top;
        let steps = (RADIUS / SPACING) as i32;
        let (mut sum, mut weights) = (0.0, 0.0);
        for row in -steps..=steps {
            for column in -steps..=steps {
                let offset = DVec2::new(f64::from(column), f64::from(row)) * SPACING;
                let weight = (1.0 - offset.length_squared() / (RADIUS * RADIUS)).max(0.0).powi(2) as f32;
                if weight > 0.0 {
                    sum += weight * self.stand.share_ln(cover.smooth_at(point + offset), depth);
                    weights += weight;
                }
            }
        }
        (sum / weights).exp()
    }

    fn of_share(&self, share: f32) -> PlaceExposure {
        let open_ev100 = self.light.ev100;
        let fixed = self.light.exposure_settings.fixed_ev100.is_some();
        if fixed || share >= 1.0 {
            return PlaceExposure { ev100: open_ev100, open_ev100, share: share.min(1.0), fixed };
        }
        // Steps below that of open ground, so that they end there.
        let gain = open_ev100 - self.light.ev100_in_stand(share);
        PlaceExposure { ev100: open_ev100 - (gain * STEPS).round() / STEPS, open_ev100, share, fixed }
    }
}
