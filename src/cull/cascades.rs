//! The positions of the shadow cascades. Pure functions, without history.
//!
//! A cascade is a box around the camera, not around a slice of its frustum: rotating the camera redraws nothing. Its
//! centre is the camera's position rounded to a grid of a quarter of the served radius in the light's frame (a whole
//! number of texels, so that nothing crawls), and the light's direction is rounded to a grid so fine that no shadow
//! lags by more than half a texel. Both depend only on the current arguments: equal arguments give equal maps, and a
//! map is rendered again only when one of them changes.

use glam::{DMat3, DVec3, Mat4, Vec3};

/// Step of the box's centre as a fraction of the served radius.
const STEP_SHARE: f64 = 0.25;

/// The box of one cascade, in a scene's f64 metres. Equal boxes have equal maps (for equal casters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CascadeBox {
    /// Centre in scene metres.
    pub center: DVec3,
    /// Unit vector to the light, rounded: the direction that the map is rendered from.
    pub direction: DVec3,
    /// Radius around the camera within which the map may be read, metres.
    pub radius: f64,
    /// Half the box's width and height across the light, metres.
    pub half_width: f64,
    /// Half its depth along the light, metres.
    pub half_depth: f64,
    /// Size of a texel, metres.
    pub texel: f64,
    /// Distance from the centre towards the light within which a caster can shade the box, metres.
    pub distance_to_light: f64,
}

/// Farthest caster, metres.
const FARTHEST_CASTER: f64 = 12_000.0;
/// Sine of the lowest elevation of the light for which the full length of shadows is covered.
pub const LOWEST_SINE: f64 = 2e-3;

impl CascadeBox {
    /// The box for a camera at `camera` (scene metres), served `radius` in metres, `map_size` texels,
    /// `direction` to the light (unit) and casters up to `caster_height` metres above what they shade.
    pub fn new(camera: DVec3, radius: f64, map_size: u32, direction: DVec3, caster_height: f64) -> Self {
        let size = f64::from(map_size.max(1));
        // Twice the half step on either side of the served disc, rounded up to whole texels a step.
        let half_width = radius * (1.0 + 0.5 * STEP_SHARE) * size / (size - 4.0).max(1.0);
        let texel = 2.0 * half_width / size;
        let step = (radius * STEP_SHARE / texel).floor().max(1.0) * texel;
        let half_depth = radius + caster_height + step;
        let sine = direction.try_normalize().map_or(1.0, |d| d.y).max(LOWEST_SINE);
        // The tallest tree's shadow at this light, and four boxes for trees that stand higher than the box. A power of
        // two, so that it does not change with every breath of the light.
        let shadow = half_depth + caster_height / sine;
        let distance_to_light = shadow.max(4.0 * half_depth).log2().ceil().exp2().min(FARTHEST_CASTER).max(half_depth);
        let direction = rounded_direction(direction, 0.5 * texel, caster_height, half_depth + shadow);
        let frame = light_frame(direction);
        let seen = frame.transpose() * camera;
        let center = frame * (seen / step).round() * step;
        Self { center, direction, radius, half_width, half_depth, texel, distance_to_light }
    }

    /// Metres relative to [`center`](Self::center) to the map's clip space: xy in -1..1, reversed depth (1 at the
    /// light's end).
    pub fn clip_from_anchor(&self) -> Mat4 {
        let frame = light_frame(self.direction).as_mat3();
        let (width, depth) = (self.half_width as f32, self.half_depth as f32);
        let rows = [frame.x_axis / width, frame.y_axis / width, frame.z_axis * (0.5 / depth)];
        Mat4::from_cols(
            Vec3::new(rows[0].x, rows[1].x, rows[2].x).extend(0.0),
            Vec3::new(rows[0].y, rows[1].y, rows[2].y).extend(0.0),
            Vec3::new(rows[0].z, rows[1].z, rows[2].z).extend(0.0),
            Vec3::new(0.0, 0.0, 0.5).extend(1.0),
        )
    }

    /// Metres relative to `camera` (scene metres) to the map's clip space.
    pub fn clip_from_camera(&self, camera: DVec3) -> Mat4 {
        self.clip_from_anchor() * Mat4::from_translation((camera - self.center).as_vec3())
    }
}

/// Served radii of `count` cascades up to `distance` metres, finest first, in a geometric series.
pub fn cascade_radii(count: usize, distance: f64, finest: f64) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    let ratio = (distance / finest.min(distance)).powf(1.0 / last);
    (0..count).map(|i| if count == 1 { distance } else { finest.min(distance) * ratio.powi(i as i32) }).collect()
}

/// Right-handed frame whose third column points to the light; columns are unit vectors.
pub fn light_frame(direction: DVec3) -> DMat3 {
    let forward = direction.try_normalize().unwrap_or(DVec3::Y);
    let up = if forward.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
    let right = up.cross(forward).normalize_or(DVec3::X);
    DMat3::from_cols(right, forward.cross(right), forward)
}

/// The direction on a grid of elevation and azimuth so fine that the shadow of a caster `height` metres above
/// moves by at most `tolerance` metres across the light; the ray's length is at most `max_distance` metres.
fn rounded_direction(direction: DVec3, tolerance: f64, height: f64, max_distance: f64) -> DVec3 {
    let direction = direction.try_normalize().unwrap_or(DVec3::Y);
    let elevation = direction.y.clamp(-1.0, 1.0).asin();
    let azimuth = direction.x.atan2(-direction.z);
    let ray = (height / elevation.sin().abs().max(1e-6)).min(max_distance).max(1e-3);
    // Rounding moves by half a cell in each of two angles: a cell of tolerance / ray keeps the sum below tolerance.
    // A power of two, so that the grid itself stays put while the elevation moves.
    let cell = (tolerance / ray).log2().floor().exp2();
    let elevation = (elevation / cell).round() * cell;
    let ring = (cell / elevation.cos().abs().max(cell)).log2().floor().exp2();
    let azimuth = (azimuth / ring).round() * ring;
    let flat = elevation.cos();
    DVec3::new(azimuth.sin() * flat, elevation.sin(), -azimuth.cos() * flat)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn directions() -> impl Strategy<Value = DVec3> {
        (0.001f64..1.57, -3.1f64..3.1).prop_map(|(elevation, azimuth)| {
            DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), -azimuth.cos() * elevation.cos())
        })
    }

    proptest! {
        #[test]
        fn every_point_in_the_served_radius_lies_in_the_map(
            direction in directions(),
            camera in (-1e6f64..1e6, -100.0f64..3e3, -1e6f64..1e6),
            toward in (-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0),
            radius in 5.0f64..2000.0,
        ) {
            let camera = DVec3::new(camera.0, camera.1, camera.2);
            let cascade = CascadeBox::new(camera, radius, 2048, direction, 40.0);
            let offset = DVec3::new(toward.0, toward.1, toward.2).normalize_or(DVec3::X) * radius;
            let clip = cascade.clip_from_camera(camera) * offset.as_vec3().extend(1.0);
            prop_assert!(clip.x.abs() <= 1.0 && clip.y.abs() <= 1.0, "{clip}");
            prop_assert!((0.0..=1.0).contains(&clip.z), "{clip}");
            prop_assert_eq!(clip.w, 1.0);
        }

        #[test]
        fn the_rounded_light_lags_by_half_a_texel_at_most(direction in directions(), radius in 10.0f64..1000.0) {
            let height = 40.0;
            let cascade = CascadeBox::new(DVec3::ZERO, radius, 2048, direction, height);
            let ray = height / direction.y.max(LOWEST_SINE);
            let lag = direction.angle_between(cascade.direction) * ray;
            prop_assert!(lag <= 0.5 * cascade.texel * 1.01, "lag {lag} texel {}", cascade.texel);
        }

        #[test]
        fn the_centre_steps_by_whole_texels(direction in directions(), x in -1e4f64..1e4, z in -1e4f64..1e4) {
            let a = CascadeBox::new(DVec3::ZERO, 100.0, 2048, direction, 30.0);
            let b = CascadeBox::new(DVec3::new(x, 20.0, z), 100.0, 2048, direction, 30.0);
            let moved = light_frame(a.direction).transpose() * (b.center - a.center) / a.texel;
            prop_assert!((moved.x - moved.x.round()).abs() < 1e-4 && (moved.y - moved.y.round()).abs() < 1e-4);
        }
    }

    #[test]
    fn a_small_move_or_turn_redraws_nothing() {
        let direction = DVec3::new(0.3, 0.8, 0.2).normalize();
        let a = CascadeBox::new(DVec3::new(10.0, 300.0, 5.0), 100.0, 2048, direction, 30.0);
        let b = CascadeBox::new(DVec3::new(10.1, 300.0, 5.1), 100.0, 2048, direction, 30.0);
        assert_eq!(a, b);
        let c = CascadeBox::new(DVec3::new(90.0, 300.0, 5.0), 100.0, 2048, direction, 30.0);
        assert_ne!(a, c);
    }

    #[test]
    fn radii_grow_geometrically() {
        assert_eq!(cascade_radii(1, 300.0, 30.0), vec![300.0]);
        let radii = cascade_radii(3, 400.0, 25.0);
        assert!((radii[0] - 25.0).abs() < 1e-9 && (radii[1] - 100.0).abs() < 1e-6 && (radii[2] - 400.0).abs() < 1e-6);
    }
}
