//! The light of a reference render: the environment, the disc that casts shadows, and what the camera sees of the sky.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::bsdf::cone;
use super::error::ReferenceError;
use super::sky::{Environment, Sky};
use crate::light::LightState;
use crate::light::sun::SUN_ANGULAR_RADIUS;

/// A sun or a moon: a disc of uniform radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Unit vector to its middle.
    pub direction: Vec3,
    /// Illuminance on a surface that faces it, lux per channel.
    pub illuminance: Vec3,
    /// Angular radius in radians, 0 to 1.5; 0 is a point.
    pub angular_radius: f32,
}

/// A disc that the camera sees; it lights nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisibleDisc {
    /// Unit vector to its middle.
    pub direction: Vec3,
    /// Radiance in nits per channel.
    pub radiance: Vec3,
    /// Angular radius in radians.
    pub angular_radius: f32,
}

/// All light of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Radiance from all directions, without the discs.
    pub environment: Environment,
    /// The light that casts shadows.
    pub key: Option<Disc>,
    /// Discs that the camera sees in front of the environment.
    pub visible: Vec<VisibleDisc>,
}

impl Light {
    /// Uniform light from all directions, nits per channel.
    pub fn even(radiance: Vec3) -> Self {
        Self { environment: Environment::Even(radiance), key: None, visible: Vec::new() }
    }

    /// The light that the renderer draws with: its sky texture, its key light, the discs of sun and moon. Stars are
    /// left out. `below` replaces the sky texture below the horizon by one radiance in nits: for plants alone,
    /// the ground's; a scene with a ground of its own needs none.
    pub fn of(state: &LightState, below: Option<Vec3>) -> Self {
        let key = Disc {
            direction: state.key_direction,
            illuminance: state.key_illuminance,
            angular_radius: state.key_angular_radius,
        };
        let radius = SUN_ANGULAR_RADIUS as f32;
        let sun = VisibleDisc {
            direction: state.sun_direction,
            radiance: state.sun_illuminance / (PI * radius.sin().powi(2)),
            angular_radius: radius,
        };
        let moon = state.night.moon.map(|moon| VisibleDisc {
            direction: moon.direction,
            radiance: moon.radiance,
            angular_radius: moon.angular_radius,
        });
        Self {
            environment: Environment::Sky { view: state.sky_view.clone(), below },
            key: (key.illuminance.max_element() > 0.0).then_some(key),
            visible: [sun].into_iter().chain(moon).filter(|disc| disc.radiance.max_element() > 0.0).collect(),
        }
    }

    /// The same without the light that casts shadows; its disc stays visible.
    pub fn without_key(self) -> Self {
        Self { key: None, ..self }
    }

    /// The same without the light of the surroundings.
    pub fn without_environment(self) -> Self {
        Self { environment: Environment::Even(Vec3::ZERO), ..self }
    }

    /// Checks the light and prepares it for sampling, for a scene with or without a ground.
    pub(crate) fn prepare(&self, ground: bool) -> Result<PreparedLight, ReferenceError> {
        let unit = |what, direction: Vec3| {
            let length = f64::from(direction.length());
            let fits = (length - 1.0).abs() < 1e-3;
            if fits { Ok(()) } else { Err(ReferenceError::value(what, length, "a vector of length 1")) }
        };
        let amount = |what, value: Vec3| match value.to_array().iter().find(|v| !(0.0..=1e20).contains(*v)) {
            Some(&wrong) => Err(ReferenceError::value(what, wrong.into(), "0 to 1e20")),
            None => Ok(()),
        };
        let radius = |value: f32| {
            let fits = (0.0..=1.5).contains(&value);
            if fits {
                Ok(())
            } else {
                Err(ReferenceError::value("a disc's radius", value.into(), "radians from 0 to 1.5"))
            }
        };
        if let Some(key) = &self.key {
            unit("the length of the key light's direction", key.direction)?;
            amount("the key light's illuminance", key.illuminance)?;
            radius(key.angular_radius)?;
        }
        for disc in &self.visible {
            unit("the length of a disc's direction", disc.direction)?;
            amount("a disc's radiance", disc.radiance)?;
            radius(disc.angular_radius)?;
        }
        Ok(PreparedLight {
            sky: Sky::new(self.environment.clone(), ground)?,
            key: self.key,
            visible: self.visible.clone(),
            ground,
        })
    }
}

/// Light whose directions can be sampled.
#[derive(Clone, Debug)]
pub(crate) struct PreparedLight {
    pub sky: Sky,
    key: Option<Disc>,
    visible: Vec<VisibleDisc>,
    ground: bool,
}

impl PreparedLight {
    /// A direction to the key light, with its radiance times the solid angle that the direction stands for.
    ///
    /// Over a ground, a disc that is partly set sends all of its (already reduced) illuminance from the part above the
    /// horizon: the lower half is mirrored.
    pub fn key(&self, point: Vec2) -> Option<(Vec3, Vec3)> {
        let key = self.key?;
        let mut direction = cone(key.direction, key.angular_radius, point);
        if self.ground && direction.y < 0.0 && key.direction.y > -key.angular_radius.sin() {
            direction.y = -direction.y;
        }
        // E / (π sin² r) times 2 π (1 - cos r).
        Some((direction, key.illuminance * (2.0 / (1.0 + key.angular_radius.cos()))))
    }

    /// Everything that light depends on, as bytes for a fingerprint.
    pub fn feed(&self, hasher: &mut blake3::Hasher) {
        match self.sky.environment() {
            Environment::Even(radiance) => hasher.update(bytemuck::bytes_of(radiance)),
            Environment::Sky { view, below } => hasher
                .update(bytemuck::cast_slice(&view.texels))
                .update(format!("{:?} {below:?}", view.axis).as_bytes()),
        };
        hasher.update(format!("{:?} {:?}", self.key, self.visible).as_bytes());
    }

    /// What the camera sees in `direction` where nothing stands: environment and discs, each disc's edge as hard as it
    /// is.
    pub fn seen(&self, direction: Vec3) -> Vec3 {
        let mut color = self.sky.radiance(direction);
        for disc in &self.visible {
            let chord = (direction - disc.direction).length();
            if chord < 2.0 * (0.5 * disc.angular_radius).sin() && !(self.ground && direction.y < 0.0) {
                color += disc.radiance;
            }
        }
        color
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::PathSampler;

    #[test]
    fn the_disc_gives_its_illuminance_whatever_its_size() {
        for angular_radius in [0.0, 0.0047, 0.5] {
            let direction = Vec3::new(0.3, 0.8, -0.5).normalize();
            let key = Disc { direction, illuminance: Vec3::splat(9e4), angular_radius };
            let light = Light { key: Some(key), ..Light::even(Vec3::ZERO) }.prepare(true).unwrap();
            let mut sum = 0.0;
            for index in 0..1024 {
                let (to, weight) = light.key(PathSampler::new(1, 0, index).pair()).unwrap();
                sum += f64::from(weight.x * to.dot(direction)) / 1024.0;
            }
            assert!((sum / 9e4 - 1.0).abs() < 1e-3, "{angular_radius}: {sum}");
        }
    }

    #[test]
    fn a_setting_disc_stays_above_the_ground() {
        let key = Disc { direction: Vec3::X, illuminance: Vec3::ONE, angular_radius: 0.005 };
        let light = Light { key: Some(key), ..Light::even(Vec3::ZERO) };
        let lowest = |ground| {
            let light = light.prepare(ground).unwrap();
            (0..64).map(|i| light.key(PathSampler::new(1, 0, i).pair()).unwrap().0.y).fold(1.0, f32::min)
        };
        assert!(lowest(true) >= 0.0 && lowest(false) < -0.003);
    }

    #[test]
    fn impossible_lights_are_refused() {
        let disc = Disc { direction: Vec3::Y, illuminance: Vec3::ONE, angular_radius: 0.1 };
        let bad = |key| Light { key: Some(key), ..Light::even(Vec3::ONE) }.prepare(false).is_err();
        assert!(!bad(disc));
        assert!(bad(Disc { direction: Vec3::ZERO, ..disc }));
        assert!(bad(Disc { direction: Vec3::NAN, ..disc }));
        assert!(bad(Disc { illuminance: Vec3::INFINITY, ..disc }));
        assert!(bad(Disc { angular_radius: -0.1, ..disc }));
    }
}
