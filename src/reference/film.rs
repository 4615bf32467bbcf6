//! The film: an image that accumulates samples, and the loop that renders them.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::camera::Camera;
use super::error::ReferenceError;
use super::fog::Fog;
use super::path::PathTracer;
use super::sampler::PathSampler;
use crate::math::luminance;

/// Edge of a tile in pixels; a task renders one tile.
const TILE: u32 = 16;
/// To be raised when the same scene is traced differently, so that no older film is resumed.
const MODEL: u32 = 2;

/// Sums of radiance over the samples so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: (u32, u32),
    /// Number of the first sample: not 0 where the rest is traced elsewhere.
    first: u32,
    samples: u32,
    /// Row by row from the top: nits per channel, summed over the samples.
    pub(super) sums: Vec<DVec3>,
    /// Squares of the luminance, summed.
    pub(super) squares: Vec<f64>,
}

/// A camera, and the air before it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// The camera.
    pub camera: Camera,
    /// The renderer's fog, or clear air.
    pub fog: Option<Fog>,
}

impl Film {
    /// An empty film for `shot`.
    ///
    /// # Errors
    /// As [`Camera::check`].
    pub fn new(shot: &Shot) -> Result<Self, ReferenceError> {
        Self::beginning_at(shot, 0)
    }

    /// An empty film whose first sample is that of number `first`: a part of a longer trace, for [`append`](Self::append).
    ///
    /// # Errors
    /// As [`Camera::check`].
    pub fn beginning_at(shot: &Shot, first: u32) -> Result<Self, ReferenceError> {
        shot.camera.check()?;
        let size = shot.camera.size;
        let pixels = size.0 as usize * size.1 as usize;
        Ok(Self { size, first, samples: 0, sums: vec![DVec3::ZERO; pixels], squares: vec![0.0; pixels] })
    }

    pub(super) fn from_parts(size: (u32, u32), first: u32, samples: u32, sums: Vec<DVec3>, squares: Vec<f64>) -> Self {
        Self { size, first, samples, sums, squares }
    }

    /// Adds the samples of `next`, which follow those of this film. The sums are those of one trace but for the rounding of f64.
    ///
    /// # Errors
    /// [`ReferenceError::Size`] for another size, [`ReferenceError::NotNext`] for other samples.
    pub fn append(&mut self, next: &Self) -> Result<(), ReferenceError> {
        if next.size != self.size {
            return Err(ReferenceError::Size {
                width: next.size.0,
                height: next.size.1,
                limit: self.sums.len() as u64,
            });
        }
        let expected = self.first.saturating_add(self.samples);
        if next.first != expected || next.samples.checked_add(self.samples).is_none() {
            return Err(ReferenceError::NotNext { expected, found: next.first });
        }
        self.samples += next.samples;
        for (sum, other) in self.sums.iter_mut().zip(&next.sums) {
            *sum += *other;
        }
        for (sum, other) in self.squares.iter_mut().zip(&next.squares) {
            *sum += *other;
        }
        Ok(())
    }

    /// Number of the first sample.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Number of samples per pixel so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean radiance of each pixel in nits, row by row from the top; black without a sample.
    pub fn radiance(&self) -> Vec<Vec3> {
        let share = 1.0 / f64::from(self.samples.max(1));
        self.sums.iter().map(|sum| (*sum * share).as_vec3()).collect()
    }

    /// Standard error of the image's luminance: the root of the pixels' mean variance, over the image's mean. It is
    /// estimated from the variance of the samples as if they were independent: an upper bound for stratified ones.
    /// `None` below two samples, and for a black image.
    pub fn relative_error(&self) -> Option<f64> {
        let n = f64::from(self.samples);
        let (mut variance, mut mean) = (0.0, 0.0);
        for (sum, squares) in self.sums.iter().zip(&self.squares) {
            let sum = luminance_of(*sum);
            variance += (squares - sum * sum / n).max(0.0) / (n - 1.0) / n;
            mean += sum / n;
        }
        let pixels = self.sums.len() as f64;
        let error = (variance / pixels).sqrt() / (mean / pixels);
        (self.samples > 1 && error.is_finite()).then_some(error)
    }
}

fn luminance_of(sum: DVec3) -> f64 {
    f64::from(luminance(Vec3::X)) * sum.x
        + f64::from(luminance(Vec3::Y)) * sum.y
        + f64::from(luminance(Vec3::Z)) * sum.z
}

impl PathTracer<'_> {
    /// Adds samples to `film` until each pixel has `until`. After each pass of one sample per pixel, `hear` gets
    /// the film, to show or to save it. It may stop the work; a later call continues with the same result as without
    /// the interruption.
    ///
    /// Every sample is a function of seed, pixel and sample number, and a pixel's samples are added in order. So the
    /// film's bytes depend neither on threads nor on interruptions.
    ///
    /// # Errors
    /// As [`Camera::check`]; [`ReferenceError::Size`] for a film of another size than the camera's.
    pub fn render(
        &self,
        shot: &Shot,
        film: &mut Film,
        until: u32,
        hear: &mut dyn FnMut(&Film) -> ControlFlow<()>,
    ) -> Result<(), ReferenceError> {
        self.render_unless(shot, film, until, &|| false, hear)
    }

    /// As [`render`](Self::render), but `stop` is also asked during a pass, from any thread, before each
    /// tile of 16 × 16 pixels. Once it is true, the work ends; the samples of the unfinished pass are dropped.
    ///
    /// # Errors
    /// Those of [`render`](Self::render).
    pub fn render_unless(
        &self,
        shot: &Shot,
        film: &mut Film,
        until: u32,
        stop: &(dyn Fn() -> bool + Sync),
        hear: &mut dyn FnMut(&Film) -> ControlFlow<()>,
    ) -> Result<(), ReferenceError> {
        shot.camera.check()?;
        let (width, height) = shot.camera.size;
        if film.size != shot.camera.size {
            return Err(ReferenceError::Size {
                width: film.size.0,
                height: film.size.1,
                limit: film.sums.len() as u64,
            });
        }
        let across = width.div_ceil(TILE);
        let tiles = across * height.div_ceil(TILE);
        let corner = |tile: u32| (tile % across * TILE, tile / across * TILE);
        let pixels = |tile: u32| {
            let (left, top) = corner(tile);
            let rows = top..(top + TILE).min(height);
            rows.flat_map(move |row| (left..(left + TILE).min(width)).map(move |column| (column, row)))
        };
        while film.samples < until {
            let sample = film.first.wrapping_add(film.samples);
            let trace = |tile| pixels(tile).map(|(column, row)| self.sample(shot, column, row, sample)).collect();
            let pass: Option<Vec<Vec<Vec3>>> =
                (0..tiles).into_par_iter().map(|tile| (!stop()).then(|| trace(tile))).collect();
            let Some(pass) = pass else { break };
            for (tile, values) in (0..tiles).zip(pass) {
                for ((column, row), value) in pixels(tile).zip(values) {
                    let at = row as usize * width as usize + column as usize;
                    film.sums[at] += value.as_dvec3();
                    film.squares[at] += luminance_of(value.as_dvec3()).powi(2);
                }
            }
            film.samples += 1;
            if hear(film).is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Radiance in nits of one sample of one pixel.
    fn sample(&self, shot: &Shot, column: u32, row: u32, sample: u32) -> Vec3 {
        let pixel = u64::from(row) * u64::from(shot.camera.size.0) + u64::from(column);
        let mut sampler = PathSampler::new(self.settings().seed, pixel, sample);
        let ray = shot.camera.ray(column, row, sampler.pair());
        let (radiance, distance) = self.along(&ray, &mut sampler);
        let color = match (distance, &shot.fog) {
            (Some(distance), Some(fog)) => {
                let relative = ray.at(distance) - shot.camera.view.position;
                fog.apply(radiance, relative.as_vec3())
            }
            _ => radiance,
        };
        if color.is_finite() { color.max(Vec3::ZERO) } else { Vec3::ZERO }
    }

    /// A hash of everything that a pixel of `shot` depends on: scene, light, settings, camera and fog.
    pub fn fingerprint(&self, shot: &Shot) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&MODEL.to_le_bytes());
        self.scene().feed(&mut hasher);
        self.light().feed(&mut hasher);
        let settings = self.settings();
        hasher.update(format!("{settings:?} {:?}", shot.camera).as_bytes());
        match &shot.fog {
            Some(fog) => fog.feed(&mut hasher),
            None => {
                hasher.update(b"clear");
            }
        }
        *hasher.finalize().as_bytes()
    }
}
