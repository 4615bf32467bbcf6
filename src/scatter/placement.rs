//! Places trees by rules.
//!
//! Candidates are the points of the sequence, mapped to the area. Those of a low-discrepancy sequence are also shifted
//! by the seed, modulo one, which leaves them as even as they were [Cranley & Patterson 1976]. A candidate is dropped
//! where the rules forbid a tree. Since the candidates have the wanted density everywhere, the remaining ones have it
//! wherever trees may stand.
//!
//! A minimum distance drops more candidates: of two that are too close, the one with the lower index stays (dart
//! throwing, [Cook 1986]). Then more candidates follow until the density is met again. Halton and random points
//! continue where they ended. Hammersley points cannot continue, so a larger set replaces them, and its surplus is
//! removed at random.
//!
//! Cost: the points and rules run on all threads, the minimum distance on one. One million trees with ground look-ups
//! take about 0.2 s on two cores, with a minimum distance about 0.5 s.

use std::ops::Range;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::ScatterError;
use super::clearings::ClearingMask;
use super::rules::{PlacementRules, Sequence, SpeciesRule};
use super::spacing::SpacingGrid;
use super::stand::{Area, Ground, Stand, Tree, XzPlane, sink};
use super::stream::{Stream, random};
use crate::math::{
    HaltonSequence, hammersley,
    hash::{self, hash64, unit_f32, unit_f64},
};

/// Points per task: two rounds of the ternary table.
const CHUNK: u64 = 4374;

/// Maximum number of candidates per tree of the full area; then a minimum distance leaves trees out. 64 times 32
/// million trees still fit into 32-bit indices.
const MAX_EFFORT: u64 = 64;

/// A stand and how its rules were met.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// The trees, in the order of their candidates.
    pub stand: Stand,
    /// How the rules were met.
    pub report: PlacementReport,
}

/// How a stand meets its rules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementReport {
    /// Trees that the density asks for on the allowed ground.
    pub wanted: u32,
    /// Trees placed; fewer than wanted only where the minimum distance left no room.
    pub placed: u32,
    /// Candidates tried.
    pub candidates: u64,
    /// Hectares on which the rules allow trees; margins of clearings count by their density. Estimated from the
    /// candidates, with a relative error of about one over the square root of the wanted trees, or less.
    pub allowed_hectares: f64,
    /// Trees placed per hectare of allowed ground; 0 if there is none.
    pub stems_per_hectare: f64,
}

/// Places trees on `ground` by `rules`. The result depends only on the arguments, not on the number of threads.
///
/// # Errors
/// [`ScatterError::Rule`] and [`ScatterError::TooManyTrees`] for rules that cannot be met, see
/// [`PlacementRules::validate`]. Rules that allow no ground at all give an empty stand.
pub fn place_trees<G: Ground + ?Sized>(rules: &PlacementRules, ground: &G) -> Result<Placement, ScatterError> {
    rules.validate()?;
    let placer = Placer {
        rules,
        ground,
        clearings: rules.clearings.map(|noise| ClearingMask::new(&noise, rules.area, rules.seed)),
        total_weight: rules.species.iter().map(|species| species.weight).sum(),
        unrestricted: rules.species.iter().all(|s| s.height_range_m.is_none() && s.slope_limit.is_none()),
    };
    let full = rules.full_count().round() as u64;
    let first = placer.candidates(0..full, full);
    let wanted = first.len();
    let (trees, candidates) = if rules.min_distance_m == 0.0 {
        (first, full)
    } else if rules.sequence == Sequence::Hammersley {
        placer.space_set(first, full)
    } else {
        placer.space_sequence(first, full)
    };
    let allowed_hectares = rules.area.hectares() * wanted as f64 / full.max(1) as f64;
    let report = PlacementReport {
        wanted: wanted as u32,
        placed: trees.len() as u32,
        candidates,
        allowed_hectares,
        stems_per_hectare: if allowed_hectares > 0.0 { trees.len() as f64 / allowed_hectares } else { 0.0 },
    };
    Ok(Placement { stand: Stand { trees }, report })
}

/// The first [`Tree::index`] of trees of the surroundings: below are those of the rules' own area.
pub const FIRST_SURROUNDING_INDEX: u32 = 1 << 31;

/// Fraction of the full density `distance` metres beyond a stand whose surroundings are `width` metres wide: 1 in the inner
/// half, then smoothly falling to 0.
pub fn surroundings_density(distance: f64, width: f64) -> f64 {
    if distance <= 0.0 {
        return 1.0;
    }
    let t = ((distance / width - 0.5) / 0.5).clamp(0.0, 1.0);
    if t.is_nan() { 0.0 } else { 1.0 - t * t * (3.0 - 2.0 * t) }
}

/// Metres from `area` to a point (X, Z), along the axis on which it is farther; 0 inside.
pub fn distance_beyond(area: &Area, point: DVec2) -> f64 {
    (area.min - point).max(point - area.max).max(DVec2::ZERO).max_element()
}

/// The ground around an area.
struct Around<'a, G: ?Sized> {
    ground: &'a G,
    inner: Area,
    width: f64,
    seed: u64,
    clearings: Option<ClearingMask>,
}

impl<G: Ground + ?Sized> Ground for Around<'_, G> {
    fn height(&self, x: f64, z: f64) -> f64 {
        self.ground.height(x, z)
    }

    fn slope(&self, x: f64, z: f64) -> f32 {
        self.ground.slope(x, z)
    }

    fn contains(&self, x: f64, z: f64) -> bool {
        let point = DVec2::new(x, z);
        let distance = distance_beyond(&self.inner, point);
        if distance <= 0.0 {
            return false;
        }
        let clearing = self.clearings.as_ref().map_or(1.0, |mask| mask.density(point));
        let density = surroundings_density(distance, self.width) * clearing;
        // Drawn by the position: a candidate that is tried again has the same lot.
        density > 0.0 && unit_f64(self.seed, hash64(x.to_bits(), z.to_bits(), Stream::Edge), Stream::Thinning) < density
    }
}

/// Places trees by `rules` within `width` metres around their area, beyond `stand`, which they have placed in it. They are
/// as dense as in the area up to half of the width, and thin out to its end; clearings go on across the border. Nothing of
/// the stand changes. The indices count from [`FIRST_SURROUNDING_INDEX`].
///
/// The ground must have heights there, whatever its [`Ground::contains`] says. A `width` of 0 places nothing.
///
/// # Errors
/// Those of [`place_trees`] for the larger area.
pub fn place_surroundings<G: Ground + ?Sized>(
    rules: &PlacementRules,
    stand: &Stand,
    width: f64,
    ground: &G,
) -> Result<Stand, ScatterError> {
    rules.validate()?;
    if !(width.is_finite() && width > 0.0) {
        return Ok(Stand::default());
    }
    let inner = rules.area;
    let outer = Area { min: inner.min - width, max: inner.max + width };
    let mask = rules.clearings.map(|noise| ClearingMask::new(&noise, inner, rules.seed));
    let around = Around { ground, inner, width, seed: rules.seed, clearings: mask };
    // Points of their own, not those of the area at another scale.
    let seed = hash64(rules.seed, 0, Stream::Surroundings);
    let placed = place_trees(&PlacementRules { area: outer, clearings: None, seed, ..rules.clone() }, &around)?;
    let mut trees = placed.stand.trees;
    if rules.min_distance_m > 0.0 {
        // Those of the stand near the border come first.
        let near = |tree: &&Tree| {
            let point = tree.position.xz_plane();
            (point - inner.min).min(inner.max - point).min_element() < rules.min_distance_m
        };
        let border: Vec<DVec2> = stand.trees.iter().filter(near).map(|tree| tree.position.xz_plane()).collect();
        let mut grid = SpacingGrid::new(outer, rules.min_distance_m, border.len().max(1) as f64);
        for point in border {
            grid.insert(point);
        }
        trees.retain(|tree| {
            let point = tree.position.xz_plane();
            distance_beyond(&inner, point) >= rules.min_distance_m || grid.insert(point)
        });
    }
    for tree in &mut trees {
        tree.index |= FIRST_SURROUNDING_INDEX;
    }
    Ok(Stand { trees })
}

struct Placer<'a, G: ?Sized> {
    rules: &'a PlacementRules,
    ground: &'a G,
    clearings: Option<ClearingMask>,
    total_weight: f64,
    /// Whether no species has its own limits.
    unrestricted: bool,
}

impl<G: Ground + ?Sized> Placer<'_, G> {
    /// The allowed trees among the candidates in `range` of a set of `count`, in order.
    fn candidates(&self, range: Range<u64>, count: u64) -> Vec<Tree> {
        let chunks = (range.end - range.start).div_ceil(CHUNK);
        let parts: Vec<Vec<Tree>> = (0..chunks)
            .into_par_iter()
            .map(|chunk| {
                let start = range.start + chunk * CHUNK;
                self.chunk(start..(start + CHUNK).min(range.end), count)
            })
            .collect();
        parts.concat()
    }

    fn chunk(&self, range: Range<u64>, count: u64) -> Vec<Tree> {
        let seed = self.rules.seed;
        let shift = DVec2::new(unit_f64(seed, 0, Stream::Shift), unit_f64(seed, 1, Stream::Shift));
        let shifted = |unit: DVec2| {
            let moved = unit + shift;
            DVec2::new(
                if moved.x >= 1.0 { moved.x - 1.0 } else { moved.x },
                if moved.y >= 1.0 { moved.y - 1.0 } else { moved.y },
            )
        };
        let start = range.start;
        match self.rules.sequence {
            Sequence::Halton => {
                range.zip(HaltonSequence::new(start)).filter_map(|(i, p)| self.tree(i, shifted(p))).collect()
            }
            Sequence::Hammersley => range.filter_map(|i| self.tree(i, shifted(hammersley(i, count)))).collect(),
            Sequence::Random => range.filter_map(|i| self.tree(i, random(i, seed))).collect(),
        }
    }

    /// The tree at the point `unit` of the unit square, or `None` where the rules forbid it.
    fn tree(&self, index: u64, unit: DVec2) -> Option<Tree> {
        let PlacementRules { seed, area, height_range_m, slope_limit, .. } = *self.rules;
        let point = (area.min + unit * area.size()).min(area.max);
        if !self.ground.contains(point.x, point.y) {
            return None;
        }
        if let Some(clearings) = &self.clearings
            && unit_f64(seed, index, Stream::Edge) >= clearings.density(point)
        {
            return None;
        }
        let height = self.ground.height(point.x, point.y);
        if !height.is_finite() || height_range_m.is_some_and(|(low, high)| !(low..=high).contains(&height)) {
            return None;
        }
        let slope = self.ground.slope(point.x, point.y);
        if slope.is_nan() || slope > slope_limit {
            return None;
        }
        let species = self.species(index, height, slope)?;
        let variant = hash::below(seed, index, Stream::Variant, species.variants.len() as u32) as u16;
        let scale = species.size.scale(seed, index, variant.into());
        let foot = height - sink(species.trunk_radius_m * scale, slope);
        Some(Tree {
            position: DVec3::new(point.x, foot, point.y),
            yaw: hash::angle_f32(seed, index, Stream::Yaw),
            scale,
            variant: species.variants.start + variant,
            tint: unit_f32(seed, index, Stream::Tint) * 2.0 - 1.0,
            index: index as u32,
        })
    }

    /// Chooses a species at random among those that grow at this height and slope.
    fn species(&self, index: u64, height: f64, slope: f32) -> Option<&SpeciesRule> {
        let grows = |species: &&SpeciesRule| {
            species.height_range_m.is_none_or(|(low, high)| (low..=high).contains(&height))
                && species.slope_limit.is_none_or(|limit| slope <= limit)
        };
        let all = &self.rules.species;
        if let ([only], true) = (all.as_slice(), self.unrestricted) {
            return Some(only);
        }
        let total = if self.unrestricted {
            self.total_weight
        } else {
            all.iter().filter(grows).map(|species| species.weight).sum()
        };
        let mut rest = unit_f64(self.rules.seed, index, Stream::Species) * total;
        let mut chosen = None;
        for species in all.iter().filter(grows) {
            chosen = Some(species);
            rest -= species.weight;
            if rest < 0.0 {
                break;
            }
        }
        chosen
    }

    fn grid(&self, wanted: usize) -> SpacingGrid {
        SpacingGrid::new(self.rules.area, self.rules.min_distance_m, wanted as f64)
    }

    /// Applies the minimum distance to a sequence: adds candidates until there are as many trees as in `first`.
    fn space_sequence(&self, first: Vec<Tree>, full: u64) -> (Vec<Tree>, u64) {
        let wanted = first.len();
        let mut grid = self.grid(wanted);
        let mut trees = first;
        trees.retain(|tree| grid.insert(tree.position.xz_plane()));
        let mut tried = full;
        while trees.len() < wanted && tried < full.saturating_mul(MAX_EFFORT) {
            // Twice as many as the missing trees need at the current rate of allowed ground: some will be too close.
            let missing = (wanted - trees.len()) as f64 / wanted as f64 * full as f64;
            let batch = ((2.0 * missing) as u64).clamp(CHUNK.min(full), full.saturating_mul(2));
            let end = (tried + batch).min(full.saturating_mul(MAX_EFFORT));
            for tree in self.candidates(tried..end, full) {
                if trees.len() < wanted && grid.insert(tree.position.xz_plane()) {
                    trees.push(tree);
                }
            }
            tried = end;
        }
        (trees, tried)
    }

    /// Applies the minimum distance to a set of fixed size: takes larger sets until there are enough trees, then thins
    /// them at random.
    fn space_set(&self, first: Vec<Tree>, full: u64) -> (Vec<Tree>, u64) {
        let wanted = first.len();
        let (mut trees, mut count) = (first, full);
        loop {
            let mut grid = self.grid(wanted);
            trees.retain(|tree| grid.insert(tree.position.xz_plane()));
            if trees.len() >= wanted || count >= full.saturating_mul(MAX_EFFORT) {
                break;
            }
            let factor = (1.05 * wanted as f64 / trees.len().max(1) as f64).clamp(1.1, 2.0);
            count = ((count as f64 * factor).ceil() as u64).min(full.saturating_mul(MAX_EFFORT));
            trees = self.candidates(0..count, count);
        }
        if trees.len() > wanted {
            let lot = |tree: &Tree| hash64(self.rules.seed, tree.index.into(), Stream::Thinning);
            let mut lots: Vec<u64> = trees.iter().map(lot).collect();
            let limit = *lots.select_nth_unstable(wanted).1;
            trees.retain(|tree| lot(tree) < limit);
        }
        (trees, count)
    }
}
