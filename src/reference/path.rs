//! Path tracing: the radiance that arrives at the camera, and that which leaves a point of a leaf.
//!
//! Unidirectional path tracing (Kajiya 1986; Pharr, Jakob & Humphreys 2023, 13) with next-event estimation. At each
//! surface one ray goes to the key light's disc, one to the sky by its brightness, and the path goes on by the
//! surface's cosine; where it leaves the scene it has the sky's radiance, weighted against the second ray by the
//! balance heuristic. From the third surface on Russian roulette ends paths that carry little; it is unbiased.

use glam::Vec3;

use super::camera::WorldRay;
use super::error::ReferenceError;
use super::light::{Light, PreparedLight};
use super::sampler::PathSampler;
use super::scene::{Normals, ReferenceScene, Surface};

/// Surfaces of a path before Russian roulette.
const SURE: u32 = 3;
/// The greatest probability of survival in Russian roulette, so that no path is endless.
const MOST_SURVIVAL: f32 = 0.95;

/// Settings of the path tracer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSettings {
    /// Maximum number of bounces between surfaces before the last one scatters the light to the viewer. 0: only light
    /// directly from sun and sky. `u32::MAX`: no limit (default). A stand of grown
    /// broadleaves seen from above loses 7 % of its light at 0 bounces, 0.7 % at one, 0.07 % at two.
    pub bounces: u32,
    /// Seed of the random numbers. Renders with different seeds have independent noise.
    pub seed: u64,
    /// The normals that shading uses.
    pub normals: Normals,
    /// Maximum radiance of one sample in nits, above 0. A lower limit removes fireflies and light with them: any limit
    /// is a bias. Default: no limit.
    pub limit: f32,
}

impl Default for TraceSettings {
    fn default() -> Self {
        Self { bounces: u32::MAX, seed: 1, normals: Normals::default(), limit: f32::INFINITY }
    }
}

/// A scene and its light, ready for path tracing.
pub struct PathTracer<'a> {
    scene: &'a ReferenceScene,
    light: PreparedLight,
    settings: TraceSettings,
}

impl<'a> PathTracer<'a> {
    /// Prepares `light` for `scene`.
    ///
    /// # Errors
    /// [`ReferenceError::Value`] for a light or a setting that is impossible.
    pub fn new(scene: &'a ReferenceScene, light: &Light, settings: TraceSettings) -> Result<Self, ReferenceError> {
        if settings.limit.is_nan() || settings.limit <= 0.0 {
            return Err(ReferenceError::value("the limit of a sample", settings.limit.into(), "nits above 0"));
        }
        Ok(Self { scene, light: light.prepare(scene.ground().is_some())?, settings })
    }

    /// The scene.
    pub fn scene(&self) -> &'a ReferenceScene {
        self.scene
    }

    /// The settings.
    pub fn settings(&self) -> &TraceSettings {
        &self.settings
    }

    pub(crate) fn light(&self) -> &PreparedLight {
        &self.light
    }

    /// Radiance in nits that one path finds along `ray`, and how far away in metres the surface is that it comes from;
    /// `None` where it is the sky, in which the discs of sun and moon are seen.
    pub(crate) fn along(&self, ray: &WorldRay, sampler: &mut PathSampler) -> (Vec3, Option<f64>) {
        let Some(found) = self.scene.closest(ray) else {
            return (self.light.seen(ray.direction.as_vec3()), None);
        };
        match self.scene.surface(found, ray.direction, self.settings.normals) {
            Some(surface) => (self.exitant(surface, sampler), Some((surface.position - ray.origin).length())),
            None => (Vec3::ZERO, Some(0.0)),
        }
    }

    /// Radiance in nits that one path finds that `first` sends to its viewer. Never negative, always finite.
    pub(crate) fn exitant(&self, first: Surface, sampler: &mut PathSampler) -> Vec3 {
        let mut surface = first;
        let mut throughput = Vec3::ONE;
        let mut sum = Vec3::ZERO;
        let mut depth = 0;
        loop {
            sum += throughput * (self.key_light(&surface, sampler) + self.sky_light(&surface, sampler));
            let choice = sampler.pair();
            let Some(scattered) = surface.bsdf.sample(choice.x, sampler.pair()) else { break };
            throughput *= scattered.weight;
            if depth >= SURE {
                let survival = throughput.max_element().min(MOST_SURVIVAL);
                if choice.y >= survival {
                    break;
                }
                throughput /= survival;
            }
            let ray = self.leave(&surface, scattered.direction, sampler);
            let Some(found) = self.scene.closest(&ray) else {
                let other = self.light.sky.density(scattered.direction);
                let weight = scattered.density / (scattered.density + other);
                sum += throughput * self.light.sky.radiance(scattered.direction) * weight;
                break;
            };
            if depth >= self.settings.bounces {
                break;
            }
            let Some(next) = self.scene.surface(found, ray.direction, self.settings.normals) else { break };
            surface = next;
            depth = depth.saturating_add(1);
        }
        if sum.is_finite() { sum.clamp(Vec3::ZERO, Vec3::splat(self.settings.limit.min(1e30))) } else { Vec3::ZERO }
    }

    /// Light straight from the key light's disc.
    fn key_light(&self, surface: &Surface, sampler: &mut PathSampler) -> Vec3 {
        let Some((direction, light)) = self.light.key(sampler.pair()) else { return Vec3::ZERO };
        self.unless_occluded(surface, direction, light, sampler)
    }

    /// Light straight from the sky, in a direction drawn by its brightness.
    fn sky_light(&self, surface: &Surface, sampler: &mut PathSampler) -> Vec3 {
        let Some((direction, density)) = self.light.sky.sample(sampler.pair()) else { return Vec3::ZERO };
        let light = self.light.sky.radiance(direction) / (density + surface.bsdf.density(direction));
        self.unless_occluded(surface, direction, light, sampler)
    }

    fn unless_occluded(&self, surface: &Surface, direction: Vec3, light: Vec3, sampler: &mut PathSampler) -> Vec3 {
        let value = surface.bsdf.cosine_weighted(direction) * light;
        let lit = value.max_element() > 0.0 && !self.scene.occluded(&self.leave(surface, direction, sampler));
        if lit { value } else { Vec3::ZERO }
    }

    /// A ray that leaves the surface; from a leaf with layers it comes from one of the test points inside.
    fn leave(&self, surface: &Surface, direction: Vec3, sampler: &mut PathSampler) -> WorldRay {
        match surface.bsdf.tissue() {
            Some(_) => self.scene.leave_leaf(surface, direction, sampler.pair().x),
            None => self.scene.leave(surface, direction),
        }
    }
}
