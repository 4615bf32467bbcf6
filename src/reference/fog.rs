//! The renderer's fog on what the camera sees: the twin of `apply_fog` in `shaders/common/sky.wgsl`.
//!
//! The fog is a visual effect fitted to the sky, not light transport. A reference has it so that its renders can be
//! compared with the renderer's. It acts on the camera's own rays, not on those between surfaces.

use std::f32::consts::PI;

use glam::Vec3;

use crate::light::{FogParams, LightState, Sh9Rgb, SkyView, sh};

/// The fog of a light, seen from one height.
#[derive(Clone, Debug, PartialEq)]
pub struct Fog {
    params: FogParams,
    sky_sh: Sh9Rgb,
    view: SkyView,
    camera_height: f32,
}

impl Fog {
    /// The fog of `light` for a camera `height` metres above the datum.
    pub fn new(light: &LightState, height: f64) -> Self {
        Self {
            params: light.fog,
            sky_sh: light.sky_sh,
            view: light.sky_view.clone(),
            camera_height: if height.is_finite() { height.max(0.0) as f32 } else { 0.0 },
        }
    }

    /// Optical depth over a unit of extinction, in metres.
    fn path(&self, relative: Vec3) -> f32 {
        let inverse_scale = 1.0 / self.params.scale_height_m.max(1.0);
        let start = (-self.camera_height * inverse_scale).exp();
        let rise = (relative.y * inverse_scale).clamp(-20.0, 20.0);
        // (1 - e^-x) / x, by its series where x vanishes.
        let mean = if rise.abs() < 1e-3 { 1.0 - 0.5 * rise } else { (1.0 - (-rise).exp()) / rise };
        relative.length() * start * mean.min(50.0)
    }

    /// Radiance that a white Lambertian surface returns under the sky.
    fn returned(&self, normal: Vec3) -> Vec3 {
        (sh::irradiance(&self.sky_sh, normal) / PI).max(Vec3::ZERO)
    }

    /// What remains of `radiance` (nits) that comes from the position `relative` to the camera in metres, and what the
    /// air adds.
    pub fn apply(&self, radiance: Vec3, relative: Vec3) -> Vec3 {
        let transmittance = (-self.params.extinction * self.path(relative)).exp();
        let direction = relative / relative.length().max(1e-3);
        let raised = |y: f32| Vec3::new(direction.x, direction.y.max(y), direction.z).normalize_or(Vec3::Y);
        let mean = self.returned(raised(0.4));
        let rim = self.view.sample(raised(0.03));
        let amount = 1.0 - transmittance.y;
        let inscatter = mean.lerp(rim.min(6.0 * mean), amount * amount);
        radiance * transmittance + inscatter * (Vec3::ONE - transmittance)
    }

    /// Everything that the fog depends on, as bytes for a fingerprint.
    pub(crate) fn feed(&self, hasher: &mut blake3::Hasher) {
        for value in [self.params.extinction, Vec3::new(self.params.scale_height_m, self.camera_height, 0.0)] {
            hasher.update(bytemuck::bytes_of(&value));
        }
        hasher.update(bytemuck::cast_slice(&self.sky_sh));
        hasher.update(bytemuck::cast_slice(&self.view.texels));
        hasher.update(bytemuck::bytes_of(&self.view.axis));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn fog() -> Fog {
        let mut sky_sh = [Vec3::ZERO; 9];
        sky_sh[0] = Vec3::splat(5000.0 / 0.282_094_79);
        Fog {
            params: FogParams { extinction: Vec3::new(1e-4, 1.2e-4, 1.5e-4), scale_height_m: 2000.0 },
            sky_sh,
            view: SkyView { axis: Vec2::X, texels: vec![[8000.0; 3]; SkyView::WIDTH * SkyView::HEIGHT] },
            camera_height: 100.0,
        }
    }

    #[test]
    fn near_things_are_clear_and_far_ones_have_the_sky() {
        let fog = fog();
        let color = Vec3::new(100.0, 200.0, 50.0);
        assert!((fog.apply(color, Vec3::new(0.0, 0.0, -1.0)) - color).abs().max_element() < 2.0);
        let far = fog.apply(color, Vec3::new(0.0, 0.0, -1e6));
        assert!((far - 8000.0).abs().max_element() < 1.0, "{far}");
        // At a few hundred metres the air has the mean of the sky.
        let middle = fog.apply(Vec3::ZERO, Vec3::new(500.0, 0.0, 0.0));
        let expected = 5000.0 * (1.0 - (-1.2e-4 * 500.0 * (-0.05f32).exp()).exp());
        assert!((middle.y / expected - 1.0).abs() < 0.02, "{middle} {expected}");
        for strange in [Vec3::ZERO, Vec3::splat(1e30), Vec3::new(0.0, -1e9, 0.0)] {
            assert!(fog.apply(color, strange).is_finite(), "{strange}");
        }
    }
}
