//! The user's rules for the positions of trees, and the check that they can be met.

use std::ops::Range;

use serde::Deserialize;

use super::stand::{Area, MAX_COORDINATE_M, MAX_SCALE, MIN_SCALE};
use super::{ScatterError, Stream};
use crate::math::hash;

/// The most trees that rules may ask for: 32 million, some 1.5 GiB while they are placed and 512 MB on the device.
///
/// A device may hold fewer, by its largest storage buffer.
pub const MAX_TREES: u32 = 32_000_000;

/// The largest fraction of the ground that discs with the minimum distance as diameter may cover.
///
/// Discs placed one after another at random jam at a fraction of 0.547 ([Feder 1980]). The number of tries rises
/// steeply towards it; at 0.45 it is about ten per tree.
pub const MAX_DISC_COVER: f64 = 0.45;

/// The point sequence of candidate positions for trees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, bevy::reflect::Reflect)]
pub enum Sequence {
    /// Halton points in bases 2 and 3: even, with a natural look. The default.
    #[default]
    Halton,
    /// Hammersley points: the most even, but with visible rows in views along a side of the area.
    Hammersley,
    /// Independent random points: clumps and gaps, as in a stand that nobody planted.
    Random,
}

/// Meadows: ground that a smooth noise keeps free of trees.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, bevy::reflect::Reflect)]
#[serde(deny_unknown_fields, default)]
pub struct ClearingNoise {
    /// Typical distance from one clearing to the next, metres, 1 to 100000. In a scene file: `wavelength`. Default 400.
    #[serde(rename = "wavelength")]
    pub wavelength_m: f64,
    /// Fraction of the area that clearings cover, 0 (none) to 1 (no forest at all). It is met exactly, because the
    /// noise is cut at its quantile over the area. In a scene file: `share`. Default 0.1.
    #[serde(rename = "share")]
    pub cover: f64,
    /// Width of a clearing's margin, where trees thin out, as a fraction of the wavelength, 0 (a sharp edge) to 1.
    /// Default 0.15.
    pub edge: f64,
}

impl Default for ClearingNoise {
    fn default() -> Self {
        Self { wavelength_m: 400.0, cover: 0.1, edge: 0.15 }
    }
}

/// How large a species' trees are.
#[derive(Clone, Debug, PartialEq)]
pub enum SizeRule {
    /// A factor on the plant's size, uniform between the two.
    Scale {
        /// Smallest factor, at least [`MIN_SCALE`].
        min: f32,
        /// Largest factor, at most [`MAX_SCALE`].
        max: f32,
    },
    /// Heights in metres, nearly normal (bounded by ±2√3 deviations, see [`hash::bell_f32`]).
    Height {
        /// Mean height, metres.
        mean_m: f32,
        /// Standard deviation, metres; less than `mean_m / (2√3)`.
        deviation_m: f32,
        /// Height of each variant's plant at scale 1, metres, as many as there are variants.
        plant_heights_m: Vec<f32>,
    },
}

/// One species of a stand.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeciesRule {
    /// Weight of the species relative to the others that can grow at the same position; > 0.
    pub weight: f64,
    /// Heights above the datum where it grows, metres; `None`: anywhere.
    pub height_range_m: Option<(f64, f64)>,
    /// Steepest ground it grows on, radians; `None`: the limit of the stand.
    pub slope_limit: Option<f32>,
    /// How large the trees are.
    pub size: SizeRule,
    /// Indices of the species' plants; each tree picks one at random.
    pub variants: Range<u16>,
    /// Radius of the trunk at the ground at scale 1, root flare included, metres. It determines how far the foot
    /// sinks into a slope.
    pub trunk_radius_m: f32,
}

impl Default for SpeciesRule {
    /// Variant 0 at its own size, anywhere, with a trunk of 0.3 m radius.
    fn default() -> Self {
        Self {
            weight: 1.0,
            height_range_m: None,
            slope_limit: None,
            size: SizeRule::Scale { min: 1.0, max: 1.0 },
            variants: 0..1,
            trunk_radius_m: 0.3,
        }
    }
}

/// Rules for a whole stand.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacementRules {
    /// Trees on a hectare of ground where trees stand: meadows, cliffs and the like are not counted. > 0.
    pub stems_per_hectare: f64,
    /// Which points are tried.
    pub sequence: Sequence,
    /// Changes everything that is drawn by lot, the shift of the sequence included.
    pub seed: u64,
    /// No two trees are nearer to each other on the map, metres; 0: no limit.
    pub min_distance_m: f64,
    /// Steepest ground with trees, radians, 0 to π/2.
    pub slope_limit: f32,
    /// Heights above the datum with trees, metres; `None` is any.
    pub height_range_m: Option<(f64, f64)>,
    /// The rectangle to fill, within ±2,000 km.
    pub area: Area,
    /// Meadows; `None`: there are none.
    pub clearings: Option<ClearingNoise>,
    /// The species, at least one.
    pub species: Vec<SpeciesRule>,
}

fn rule(field: impl Into<String>, value: impl ToString, remedy: impl Into<String>) -> ScatterError {
    ScatterError::Rule { field: field.into(), value: value.to_string(), remedy: remedy.into() }
}

fn check_range(field: &str, range: Option<(f64, f64)>) -> Result<(), ScatterError> {
    match range {
        Some((low, high)) if !(low.is_finite() && high.is_finite() && low < high) => {
            Err(rule(field, format!("({low}, {high})"), "give finite metres, the lower first"))
        }
        _ => Ok(()),
    }
}

fn check_slope(field: &str, slope: f32) -> Result<(), ScatterError> {
    if (0.0..=std::f32::consts::FRAC_PI_2 + 1e-6).contains(&slope) {
        Ok(())
    } else {
        Err(rule(field, slope, "give radians from 0 to π/2 (1.5708)"))
    }
}

impl PlacementRules {
    /// Trees that the area would hold if trees could stand everywhere.
    pub fn full_count(&self) -> f64 {
        self.stems_per_hectare * self.area.hectares()
    }

    /// Checks that every value can be met.
    ///
    /// # Errors
    /// [`ScatterError::Rule`] names the first field that cannot, [`ScatterError::TooManyTrees`] a stand beyond
    /// [`MAX_TREES`].
    pub fn validate(&self) -> Result<(), ScatterError> {
        if !(self.stems_per_hectare.is_finite() && self.stems_per_hectare > 0.0) {
            return Err(rule("stems_per_hectare", self.stems_per_hectare, "give a finite number above 0"));
        }
        self.validate_area()?;
        if self.full_count() > f64::from(MAX_TREES) {
            return Err(ScatterError::TooManyTrees { count: self.full_count(), limit: MAX_TREES });
        }
        self.validate_distance()?;
        check_slope("slope_limit", self.slope_limit)?;
        check_range("height_range_m", self.height_range_m)?;
        if let Some(clearings) = &self.clearings {
            clearings.validate()?;
        }
        if self.species.is_empty() {
            return Err(rule("species", "empty", "give at least one species"));
        }
        self.species.iter().enumerate().try_for_each(|(i, species)| species.validate(&format!("species[{i}]")))
    }

    fn validate_area(&self) -> Result<(), ScatterError> {
        let Area { min, max } = self.area;
        let shown = || format!("({}, {}) to ({}, {})", min.x, min.y, max.x, max.y);
        if !(min.is_finite() && max.is_finite() && min.abs().max(max.abs()).max_element() <= MAX_COORDINATE_M) {
            let remedy = format!("give finite metres within ±{MAX_COORDINATE_M} of the scene's centre");
            return Err(rule("area", shown(), remedy));
        }
        if !min.cmplt(max).all() {
            return Err(rule("area", shown(), "give a smaller `min` and a larger `max` in both directions"));
        }
        Ok(())
    }

    fn validate_distance(&self) -> Result<(), ScatterError> {
        let distance = self.min_distance_m;
        if !(distance.is_finite() && distance >= 0.0) {
            return Err(rule("min_distance_m", distance, "give finite metres, at least 0"));
        }
        let disc_cover = std::f64::consts::FRAC_PI_4 * distance * distance * self.stems_per_hectare / 10_000.0;
        if disc_cover > MAX_DISC_COVER {
            let factor = (MAX_DISC_COVER / disc_cover).sqrt();
            let remedy = format!(
                "{} stems per hectare cannot keep that distance; at most {:.2} m with this density, or {:.0} stems per \
                 hectare with this distance",
                self.stems_per_hectare,
                distance * factor,
                (self.stems_per_hectare * factor * factor).floor()
            );
            return Err(rule("min_distance_m", distance, remedy));
        }
        Ok(())
    }
}

impl ClearingNoise {
    fn validate(&self) -> Result<(), ScatterError> {
        if !(self.wavelength_m.is_finite() && self.wavelength_m >= 1.0) {
            return Err(rule("clearings.wavelength_m", self.wavelength_m, "give finite metres, at least 1"));
        }
        for (field, value) in [("clearings.cover", self.cover), ("clearings.edge", self.edge)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(rule(field, value, "give a fraction from 0 to 1"));
            }
        }
        Ok(())
    }
}

impl SpeciesRule {
    fn validate(&self, at: &str) -> Result<(), ScatterError> {
        if !(self.weight.is_finite() && self.weight > 0.0) {
            return Err(rule(format!("{at}.weight"), self.weight, "give a finite number above 0"));
        }
        check_range(&format!("{at}.height_range_m"), self.height_range_m)?;
        if let Some(limit) = self.slope_limit {
            check_slope(&format!("{at}.slope_limit"), limit)?;
        }
        if self.variants.is_empty() {
            let shown = format!("{}..{}", self.variants.start, self.variants.end);
            return Err(rule(format!("{at}.variants"), shown, "give at least one plant, as first..last + 1"));
        }
        if !(self.trunk_radius_m.is_finite() && (0.0..=20.0).contains(&self.trunk_radius_m)) {
            return Err(rule(format!("{at}.trunk_radius_m"), self.trunk_radius_m, "give metres from 0 to 20"));
        }
        self.size.validate(at, self.variants.len())
    }
}

impl SizeRule {
    fn validate(&self, at: &str, variants: usize) -> Result<(), ScatterError> {
        let scales = MIN_SCALE..=MAX_SCALE;
        match self {
            Self::Scale { min, max } => {
                if scales.contains(min) && scales.contains(max) && min <= max {
                    return Ok(());
                }
                let remedy = format!("give factors from {MIN_SCALE} to {MAX_SCALE}, the smaller first");
                Err(rule(format!("{at}.size"), format!("{min} to {max}"), remedy))
            }
            Self::Height { mean_m, deviation_m, plant_heights_m } => {
                if plant_heights_m.len() != variants {
                    let remedy = format!("give one height for each of the {variants} variants");
                    return Err(rule(format!("{at}.plant_heights_m"), format!("{plant_heights_m:?}"), remedy));
                }
                let spread = BELL_BOUND * deviation_m;
                if !(mean_m.is_finite() && *deviation_m >= 0.0 && mean_m - spread > 0.0) {
                    let remedy =
                        "give a mean above 0 and a deviation of at least 0 and less than mean / 3.47".to_owned();
                    return Err(rule(format!("{at}.size"), format!("{mean_m} ± {deviation_m} m"), remedy));
                }
                let bad = plant_heights_m.iter().find(|&&plant| {
                    !(plant.is_finite()
                        && plant > 0.0
                        && scales.contains(&((mean_m - spread) / plant))
                        && scales.contains(&((mean_m + spread) / plant)))
                });
                bad.map_or(Ok(()), |plant| {
                    let remedy = format!(
                        "heights of {:.2} to {:.2} m need a plant whose scale stays within {MIN_SCALE} to {MAX_SCALE}",
                        mean_m - spread,
                        mean_m + spread
                    );
                    Err(rule(format!("{at}.plant_heights_m"), plant, remedy))
                })
            }
        }
    }

    /// The scale of the tree `index`, whose plant is number `variant` of its species' variants.
    pub(super) fn scale(&self, seed: u64, index: u64, variant: usize) -> f32 {
        let scale = match self {
            Self::Scale { min, max } => min + (max - min) * hash::unit_f32(seed, index, Stream::Scale),
            Self::Height { mean_m, deviation_m, plant_heights_m } => {
                let height = mean_m + deviation_m * hash::bell_f32(seed, index, Stream::Scale);
                height / plant_heights_m.get(variant).copied().unwrap_or(*mean_m)
            }
        };
        scale.clamp(MIN_SCALE, MAX_SCALE)
    }
}

/// Bound of [`hash::bell_f32`], 2√3.
const BELL_BOUND: f32 = 3.464_101_7;
