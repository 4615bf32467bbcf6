//! The sky as a texture: radiance over azimuth and elevation, for the sky pass, the fog and the light.
//!
//! # Parametrisation (the shader repeats it)
//! `W = 129` columns and `H = 97` rows, row-major, with texel centres on the grid: the first and last columns and rows
//! lie at the ends of their ranges. With `a` the horizontal unit vector `(x, z)` towards the sun ([`SkyView::axis`])
//! and a unit view direction `d`:
//!
//! ```text
//! h   = d.xz                                        (need not be normalised; at the zenith any azimuth will do)
//! phi = atan2(a.x * h.y - a.y * h.x, dot(h, a))     -pi..pi, positive clockwise seen from above (guard (0, 0))
//! u   = sign(phi) * sqrt(|phi| / pi)                -1..1, dense around the sun
//! e   = asin(d.y)                                   -pi/2..pi/2
//! column = (0.5 + 0.5 * u) * 128
//! row    = e >= 0 ?  72 * (1 - sqrt( e / (pi/2)))   rows 0 (zenith) .. 72 (horizon)
//!                 :  72 + 24 * sqrt(-e / (pi/2))    rows 72 .. 96 (nadir), dense at the horizon
//! uv     = (vec2(column, row) + 0.5) / vec2(129, 97),   bilinear filter, clamp to edge
//! ```
//!
//! The horizon is the horizontal, whatever the height of the observer. (Hillaire 2020, 5.3, has the same square root in
//! elevation, but linear azimuths.) A texel is 0.02 degrees high at the horizon and 2.5 degrees at the zenith. It is
//! 0.04 degrees wide at the sun's azimuth and 5.6 degrees opposite. The error of the interpolated radiance is below
//! 0.1 % on average and 1.3 % at worst, at dusk.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec2, Vec3};
use half::f16;
use rayon::prelude::*;

use super::{Atmosphere, VIEW_STEPS, haze_weight, unit};

/// Steps along the short rays that end on the ground.
const GROUND_STEPS: usize = 12;

/// A texture of the sky. See the module's page for its parametrisation.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyView {
    /// Horizontal unit vector `(x, z)` towards the sun: the middle column.
    pub axis: Vec2,
    /// Radiance in nits, [`SkyView::WIDTH`] times [`SkyView::HEIGHT`], row by row from the zenith down.
    pub texels: Vec<[f32; 3]>,
}

impl SkyView {
    /// Columns.
    pub const WIDTH: usize = 129;
    /// Rows.
    pub const HEIGHT: usize = 97;
    /// The row of the horizon.
    pub const HORIZON_ROW: usize = 72;

    /// The horizontal unit vector `(x, z)` along `direction`; towards north for a vertical one.
    pub fn axis_of(direction: Vec3) -> Vec2 {
        Vec2::new(direction.x, direction.z).normalize_or(Vec2::new(0.0, -1.0))
    }

    /// Elevation in radians of a row, 0 to 96, which may be a fraction.
    pub fn row_elevation(row: f32) -> f32 {
        let horizon = Self::HORIZON_ROW as f32;
        if row <= horizon {
            FRAC_PI_2 * (1.0 - row / horizon).powi(2)
        } else {
            -FRAC_PI_2 * ((row - horizon) / (Self::HEIGHT as f32 - 1.0 - horizon)).powi(2)
        }
    }

    /// The unit direction of a position in texels, which may be fractions.
    pub fn direction(&self, column: f32, row: f32) -> Vec3 {
        let u = 2.0 * column / (Self::WIDTH - 1) as f32 - 1.0;
        let (sin_phi, cos_phi) = (PI * u * u.abs()).sin_cos();
        let elevation = Self::row_elevation(row);
        let (sin_e, cos_e) = elevation.sin_cos();
        let (a, right) = (self.axis, Vec2::new(-self.axis.y, self.axis.x));
        let h = (a * cos_phi + right * sin_phi) * cos_e;
        Vec3::new(h.x, sin_e, h.y)
    }

    /// Column and row of a direction, in texels.
    pub fn coordinates(&self, direction: Vec3) -> Vec2 {
        let d = unit(direction);
        let (h, a) = (Vec2::new(d.x, d.z), self.axis);
        let phi = if h.length_squared() < 1e-12 { 0.0 } else { (a.x * h.y - a.y * h.x).atan2(h.dot(a)) };
        let u = (phi.abs() / PI).min(1.0).sqrt().copysign(phi);
        let steepness = (d.y.clamp(-1.0, 1.0).asin().abs() / FRAC_PI_2).min(1.0).sqrt();
        let horizon = Self::HORIZON_ROW as f32;
        let row = if d.y >= 0.0 {
            horizon * (1.0 - steepness)
        } else {
            horizon + (Self::HEIGHT as f32 - 1.0 - horizon) * steepness
        };
        Vec2::new((0.5 + 0.5 * u) * (Self::WIDTH - 1) as f32, row)
    }

    /// Radiance in nits in a direction, interpolated bilinearly as in the shader.
    pub fn sample(&self, direction: Vec3) -> Vec3 {
        let at = self.coordinates(direction);
        let (x, y) = (at.x.clamp(0.0, (Self::WIDTH - 1) as f32), at.y.clamp(0.0, (Self::HEIGHT - 1) as f32));
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(Self::WIDTH - 1), (y0 + 1).min(Self::HEIGHT - 1));
        let texel = |x: usize, y: usize| self.texels.get(y * Self::WIDTH + x).map_or(Vec3::ZERO, |t| Vec3::from(*t));
        let row = |y: usize| texel(x0, y).lerp(texel(x1, y), x - x0 as f32);
        row(y0).lerp(row(y1), y - y0 as f32)
    }

    /// Adds the radiance `f` (nits), a function of the unit direction, to every texel.
    pub fn add(&mut self, f: impl Fn(Vec3) -> Vec3 + Sync) {
        let frame = Self { axis: self.axis, texels: Vec::new() };
        self.texels.par_chunks_mut(Self::WIDTH).enumerate().for_each(|(row, texels)| {
            for (column, texel) in texels.iter_mut().enumerate() {
                *texel = (Vec3::from(*texel) + f(frame.direction(column as f32, row as f32))).to_array();
            }
        });
    }

    /// The texels times `scale` as RGBA with alpha 1, for a texture of format `Rgba16Float`. `scale` is an exposure
    /// that keeps values within half precision; values beyond 65,504 are clamped to it.
    pub fn to_rgba16f(&self, scale: f32) -> Vec<[f16; 4]> {
        let half = |v: f32| f16::from_f32((v * scale).clamp(0.0, 65_504.0));
        self.texels.iter().map(|t| [half(t[0]), half(t[1]), half(t[2]), f16::ONE]).collect()
    }
}

impl Atmosphere {
    /// The sky, without the disc, lit by the sun or the moon in the unit direction `light` with the above-air
    /// illuminance `light_illuminance` (lux per channel). Its texels have the values of [`Atmosphere::radiance`],
    /// except for coarser steps towards the ground.
    pub fn sky_view(&self, light: Vec3, light_illuminance: Vec3, observer_height_m: f64) -> SkyView {
        self.sky_view_with_steps(light, light_illuminance, observer_height_m, VIEW_STEPS)
    }

    /// [`Atmosphere::sky_view`] with another number of steps along each ray, 1 to 10,000 (40 is the default).
    pub fn sky_view_with_steps(
        &self,
        light: Vec3,
        light_illuminance: Vec3,
        observer_height_m: f64,
        steps: usize,
    ) -> SkyView {
        let steps = steps.clamp(1, 10_000);
        let light = unit(light);
        let r = self.observer_radius(observer_height_m);
        let mut view = SkyView { axis: SkyView::axis_of(light), texels: Vec::new() };
        let middle = (SkyView::WIDTH - 1) / 2;
        // The sky is symmetric about the plane of the sun, so only the middle column and those to its right are
        // computed.
        let half: Vec<Vec3> = (0..=SkyView::HORIZON_ROW)
            .into_par_iter()
            .flat_map_iter(|row| {
                let mu = f64::from(SkyView::row_elevation(row as f32).sin());
                let (segments, _) = self.march_sky(r, mu, steps);
                let view = &view;
                (middle..SkyView::WIDTH).map(move |column| {
                    self.in_scatter(&segments, r, view.direction(column as f32, row as f32), light) * light_illuminance
                })
            })
            .collect();
        let columns = middle + 1;
        let horizon = &half[SkyView::HORIZON_ROW * columns..];
        let below: Vec<Vec3> = (SkyView::HORIZON_ROW + 1..SkyView::HEIGHT)
            .into_par_iter()
            .flat_map_iter(|row| {
                let elevation = SkyView::row_elevation(row as f32);
                let (segments, through) = self.march_ground(r, f64::from(elevation.sin()), GROUND_STEPS);
                let weight = haze_weight(elevation);
                let view = &view;
                (0..columns).map(move |column| {
                    let direction = view.direction((middle + column) as f32, row as f32);
                    let ground = self.ground_seen(&segments, through, r, direction, light) * light_illuminance;
                    horizon[column].lerp(ground, weight)
                })
            })
            .collect();
        view.texels = half
            .chunks(columns)
            .chain(below.chunks(columns))
            .flat_map(|row| row.iter().skip(1).rev().chain(row).map(|texel| texel.to_array()))
            .collect();
        view
    }
}
