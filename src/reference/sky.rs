//! Radiance of the surroundings, and sampling of directions by it.
//!
//! The sky texture is the renderer's own ([`SkyView`], bilinear as in `shaders/common/sky.wgsl`). Around a low
//! sun it is far brighter than elsewhere, and directions sampled by the surface's cosine seldom hit it; so directions
//! are also sampled by the sky's brightness, cell by cell of the texture, and both kinds are weighted by the balance
//! heuristic (Veach & Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering").

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::error::ReferenceError;
use crate::light::SkyView;
use crate::math::luminance;

/// Least sampling weight of a cell relative to the mean: dark cells between bright ones are still sampled.
const LEAST: f64 = 0.05;

/// The light of a scene's surroundings, without discs.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from all directions, nits per channel.
    Even(Vec3),
    /// The sky texture, in nits.
    Sky {
        /// The texture. Below the horizon it shows the ground as seen through the haze.
        view: SkyView,
        /// Radiance of the whole lower hemisphere in its stead, nits: for plants alone, lit as
        /// [`crate::light::LightState::sky_sh`] has it.
        below: Option<Vec3>,
    },
}

/// An environment, ready for sampling.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    environment: Environment,
    /// `None` where no direction is better than any other.
    cells: Option<Cells>,
}

impl Sky {
    /// Prepares `environment`. With `ground`, directions below the horizon are not sampled by brightness, because the
    /// ground is there.
    pub fn new(environment: Environment, ground: bool) -> Result<Self, ReferenceError> {
        let values = match &environment {
            Environment::Even(radiance) => vec![*radiance],
            Environment::Sky { view, below } => {
                let expected = SkyView::WIDTH * SkyView::HEIGHT;
                if view.texels.len() != expected {
                    let count = view.texels.len() as f64;
                    return Err(ReferenceError::value("the number of texels of the sky", count, "129 x 97"));
                }
                if (view.axis.length_squared() - 1.0).abs() > 1e-3 || view.axis.is_nan() {
                    let length = view.axis.length().into();
                    return Err(ReferenceError::value("the length of the sky's axis", length, "a unit vector"));
                }
                view.texels.iter().map(|texel| Vec3::from(*texel)).chain(*below).collect()
            }
        };
        let mut channels = values.iter().flat_map(|value| value.to_array());
        if let Some(wrong) = channels.find(|value| !(0.0..=1e20).contains(value)) {
            return Err(ReferenceError::value("a radiance of the sky", wrong.into(), "nits from 0 to 1e20"));
        }
        let cells = match &environment {
            Environment::Even(_) => None,
            Environment::Sky { view, below } => Cells::new(view, *below, ground),
        };
        Ok(Self { environment, cells })
    }

    /// What was prepared.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Radiance in nits from the unit vector `direction`.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match &self.environment {
            Environment::Even(radiance) => *radiance,
            Environment::Sky { below: Some(below), .. } if direction.y < 0.0 => *below,
            Environment::Sky { view, .. } => view.sample(direction),
        }
    }

    /// A direction by brightness and its probability density in 1/sr; `None` where the cosine serves as well.
    pub fn sample(&self, point: Vec2) -> Option<(Vec3, f32)> {
        let (Some(cells), Environment::Sky { view, .. }) = (&self.cells, &self.environment) else { return None };
        Some(cells.sample(view, point))
    }

    /// Probability density of [`Self::sample`] at `direction`, 1/sr; 0 where it draws nothing.
    pub fn density(&self, direction: Vec3) -> f32 {
        let (Some(cells), Environment::Sky { view, .. }) = (&self.cells, &self.environment) else { return 0.0 };
        cells.density(view, direction)
    }
}

/// The texture's cells between texel centres, each uniform over its solid angle.
#[derive(Clone, Debug)]
struct Cells {
    /// Running sum of the cells' probabilities, row by row; the last is 1.
    cumulative: Vec<f64>,
    /// Each cell's probability over its solid angle.
    density: Vec<f32>,
}

const COLUMNS: usize = SkyView::WIDTH - 1;
const ROWS: usize = SkyView::HEIGHT - 1;

/// Azimuth of a column from the sun's, -pi to pi.
fn azimuth(column: usize) -> f32 {
    let u = 2.0 * column as f32 / COLUMNS as f32 - 1.0;
    PI * u * u.abs()
}

fn height(row: usize) -> f32 {
    match row {
        0 => 1.0,
        ROWS => -1.0,
        _ => SkyView::row_elevation(row as f32).sin(),
    }
}

impl Cells {
    fn new(view: &SkyView, below: Option<Vec3>, ground: bool) -> Option<Self> {
        let solid_angle = |column: usize, row: usize| {
            f64::from(azimuth(column + 1) - azimuth(column)) * f64::from(height(row) - height(row + 1))
        };
        let rows = if ground { SkyView::HORIZON_ROW } else { ROWS };
        let brightness = |column: usize, row: usize| match below {
            Some(below) if row >= SkyView::HORIZON_ROW => f64::from(luminance(below)),
            _ => {
                let texel = |c: usize, r: usize| f64::from(luminance(Vec3::from(view.texels[r * SkyView::WIDTH + c])));
                0.25 * (texel(column, row)
                    + texel(column + 1, row)
                    + texel(column, row + 1)
                    + texel(column + 1, row + 1))
            }
        };
        let places = || (0..rows).flat_map(|row| (0..COLUMNS).map(move |column| (column, row)));
        let (light, sphere) = places().fold((0.0, 0.0), |(light, sphere), (column, row)| {
            let angle = solid_angle(column, row);
            (light + angle * brightness(column, row), sphere + angle)
        });
        let least = LEAST * light / sphere;
        if least.is_nan() || least <= 0.0 {
            return None;
        }
        let weight = |(column, row)| brightness(column, row).max(least);
        let total: f64 = places().map(|place| weight(place) * solid_angle(place.0, place.1)).sum();
        let mut sum = 0.0;
        let mut cumulative: Vec<f64> = places()
            .map(|place| {
                sum += weight(place) * solid_angle(place.0, place.1) / total;
                sum
            })
            .collect();
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        Some(Self { cumulative, density: places().map(|place| (weight(place) / total) as f32).collect() })
    }

    fn sample(&self, view: &SkyView, point: Vec2) -> (Vec3, f32) {
        let wanted = f64::from(point.x);
        let cell = self.cumulative.partition_point(|&sum| sum <= wanted).min(self.cumulative.len() - 1);
        let before = cell.checked_sub(1).map_or(0.0, |before| self.cumulative[before]);
        let share = (self.cumulative[cell] - before).max(f64::MIN_POSITIVE);
        let across = ((wanted - before) / share).clamp(0.0, 1.0) as f32;
        let (column, row) = (cell % COLUMNS, cell / COLUMNS);
        let (left, right) = (azimuth(column), azimuth(column + 1));
        let (upper, lower) = (height(row), height(row + 1));
        let (sine, cosine) = (left + across * (right - left)).sin_cos();
        let y = upper + point.y * (lower - upper);
        let level = ((1.0 - y) * (1.0 + y)).max(0.0).sqrt();
        let h = (view.axis * cosine + Vec2::new(-view.axis.y, view.axis.x) * sine) * level;
        (Vec3::new(h.x, y, h.y).normalize_or(Vec3::Y), self.density[cell])
    }

    fn density(&self, view: &SkyView, direction: Vec3) -> f32 {
        let at = view.coordinates(direction);
        let (column, row) = ((at.x.max(0.0) as usize).min(COLUMNS - 1), (at.y.max(0.0) as usize).min(ROWS - 1));
        self.density.get(row * COLUMNS + column).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::PathSampler;

    /// A sky with a bright spot around the sun's azimuth, low.
    fn texture() -> SkyView {
        let mut view =
            SkyView { axis: Vec2::new(0.6, -0.8), texels: vec![[10.0; 3]; SkyView::WIDTH * SkyView::HEIGHT] };
        let sun = view.direction(64.0, 60.0);
        view.add(|d| Vec3::new(2.0, 1.5, 1.0) * 3000.0 * (40.0 * (d.dot(sun) - 1.0)).exp());
        view
    }

    #[test]
    fn drawn_directions_integrate_the_sky_as_even_ones_do() {
        let below = Some(Vec3::splat(100.0));
        for (below, ground) in [(None, false), (below, false), (None, true)] {
            let sky = Sky::new(Environment::Sky { view: texture(), below }, ground).unwrap();
            let count = 1 << 16;
            let (mut drawn, mut even, mut densities) = (0.0, 0.0, 0.0);
            for index in 0..count {
                let mut sampler = PathSampler::new(1, 0, index);
                let (direction, density) = sky.sample(sampler.pair()).unwrap();
                assert!((direction.length() - 1.0).abs() < 1e-5);
                assert!(!ground || direction.y >= 0.0);
                drawn += f64::from(sky.radiance(direction).y / density);
                let direction = crate::reference::bsdf::cone(Vec3::Y, PI, sampler.pair());
                densities += f64::from(sky.density(direction)) * 4.0 * f64::from(PI);
                if !ground || direction.y >= 0.0 {
                    even += f64::from(sky.radiance(direction).y) * 4.0 * f64::from(PI);
                }
            }
            assert!((drawn / even - 1.0).abs() < 0.01, "{}", drawn / even);
            assert!((densities / f64::from(count) - 1.0).abs() < 0.01, "{}", densities / f64::from(count));
        }
    }

    #[test]
    fn densities_are_those_of_the_samples() {
        let sky = Sky::new(Environment::Sky { view: texture(), below: None }, false).unwrap();
        let mut wrong = 0;
        for index in 0..4096 {
            let (direction, density) = sky.sample(PathSampler::new(1, 9, index).pair()).unwrap();
            // Directions on the edge of a cell may round into its neighbour.
            wrong += u32::from((sky.density(direction) / density - 1.0).abs() > 1e-4);
        }
        assert!(wrong < 40, "{wrong}");
    }

    #[test]
    fn black_skies_are_dark_and_impossible_ones_refused() {
        let black = SkyView { axis: Vec2::X, texels: vec![[0.0; 3]; SkyView::WIDTH * SkyView::HEIGHT] };
        let sky = Sky::new(Environment::Sky { view: black.clone(), below: None }, false).unwrap();
        assert!(sky.sample(Vec2::splat(0.5)).is_none());
        assert_eq!((sky.radiance(Vec3::X), sky.density(Vec3::X)), (Vec3::ZERO, 0.0));
        assert!(Sky::new(Environment::Even(Vec3::new(0.0, f32::NAN, 0.0)), false).is_err());
        assert!(Sky::new(Environment::Even(Vec3::splat(-1.0)), false).is_err());
        let short = SkyView { axis: Vec2::X, texels: vec![[0.0; 3]; 5] };
        assert!(Sky::new(Environment::Sky { view: short, below: None }, false).is_err());
        let nan = SkyView { axis: Vec2::splat(f32::NAN), ..black };
        assert!(Sky::new(Environment::Sky { view: nan, below: None }, false).is_err());
    }
}
