//! Light that the crowns scatter: two streams, one down and one up [Dickinson 1983; Sellers 1985, eq. 1, 2].

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    StandTrees,
    layer::{Layer, RINGS, Ring},
    position,
};
use crate::math::luminance;

/// The smallest share of light between crowns.
const LEAST_SHARE: f32 = 1e-4;
/// Layers of the two streams, and number of sweeps through them. Few are enough: leaves scatter less than half of the
/// light.
const LAYERS: usize = 48;
const SWEEPS: usize = 12;

/// The key light.
pub struct Sun {
    /// Sine of its elevation.
    pub sine: f32,
    /// On a surface that faces it, lux.
    pub illuminance: Vec3,
}

/// Scattered light of the two-stream equations.
pub struct Streams {
    /// Downwelling and upwelling radiance at each boundary between layers.
    bounds: Vec<(Vec3, Vec3)>,
    /// Those of the sky's light alone.
    shaded: Vec<(Vec3, Vec3)>,
    /// Mean logarithm of the luminance of the irradiance on level surfaces at each of them, scattered light included: some
    /// are in the sun, the others in the shade.
    level_ln: Vec<f32>,
}

impl Streams {
    /// The streams in a layer over ground of this albedo.
    pub fn new(layer: &Layer, rings: &[Ring], sun: &Sun, trees: &StandTrees, ground_albedo: Vec3) -> Self {
        let depth = |bound: usize| layer.length * bound as f32 / LAYERS as f32;
        let sunlight = sun.illuminance * sun.sine.max(0.0);
        let lit: Vec<f32> = (0..=LAYERS).map(|bound| layer.transmittance(depth(bound), sun.sine)).collect();
        // Irradiance on level surfaces, of light that has met no leaf.
        let of_sun: Vec<Vec3> = lit.iter().map(|lit| sunlight * *lit).collect();
        let solid_angle = 2.0 * PI / RINGS as f32;
        let of_sky: Vec<Vec3> = (0..=LAYERS)
            .map(|bound| {
                let of_ring = |(sine, radiance): &Ring| {
                    *radiance * (*sine * layer.transmittance(depth(bound), *sine) * solid_angle)
                };
                rings.iter().map(of_ring).sum()
            })
            .collect();
        let scatter = Scatter::new(layer, trees, ground_albedo);
        let (sky_down, sky_up) = scatter.streams(&of_sky);
        let (sun_down, sun_up) = scatter.streams(&of_sun);
        let sum = |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> { a.iter().zip(b).map(|(a, b)| *a + *b).collect() };
        let (down, up) = (sum(&sky_down, &sun_down), sum(&sky_up, &sun_up));
        let level_ln = (0..=LAYERS)
            .map(|bound| {
                let shade = of_sky[bound] + down[bound];
                lit[bound] * luminance(shade + sunlight).ln() + (1.0 - lit[bound]) * luminance(shade).ln()
            })
            .collect();
        Self { bounds: radiances(&down, &up), shaded: radiances(&sky_down, &sky_up), level_ln }
    }

    /// Mean logarithm of the irradiance of level surfaces at a fraction of the crowns' length, 0..=1, less that above the
    /// crowns; at least that of [`LEAST_SHARE`], and 0 where there is no light at all.
    pub fn share_ln(&self, depth: f32) -> f32 {
        let (bound, t) = position(depth, LAYERS + 1);
        let here = self.level_ln[bound] + (self.level_ln[bound + 1] - self.level_ln[bound]) * t;
        let share = here - self.level_ln[0];
        if share.is_nan() { 0.0 } else { share.clamp(LEAST_SHARE.ln(), 0.0) }
    }

    /// Downwelling and upwelling radiance at a fraction of the crowns' length, 0..=1.
    pub fn at(&self, depth: f32) -> (Vec3, Vec3) {
        between(&self.bounds, depth)
    }

    /// The same of the sky's light alone.
    pub fn shaded_at(&self, depth: f32) -> (Vec3, Vec3) {
        between(&self.shaded, depth)
    }
}

fn between(bounds: &[(Vec3, Vec3)], depth: f32) -> (Vec3, Vec3) {
    let (bound, t) = position(depth, LAYERS + 1);
    let (a, b) = (bounds[bound], bounds[bound + 1]);
    (a.0.lerp(b.0, t), a.1.lerp(b.1, t))
}

/// Fluxes as radiance, finite and at least 0.
fn radiances(down: &[Vec3], up: &[Vec3]) -> Vec<(Vec3, Vec3)> {
    let finite = |flux: Vec3| Vec3::from((flux / PI).to_array().map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 }));
    down.iter().zip(up).map(|(down, up)| (finite(*down), finite(*up))).collect()
}

/// What one layer does to diffuse light.
struct Scatter {
    /// Parts of the light that meets leaves which are scattered on and back, per channel.
    onward: Vec3,
    back: Vec3,
    /// Of one layer, for diffuse light.
    transmittance: f32,
    ground_albedo: Vec3,
}

impl Scatter {
    fn new(layer: &Layer, trees: &StandTrees, ground_albedo: Vec3) -> Self {
        let scattered = trees.reflectance + trees.transmittance;
        // Isotropic leaves scatter half of the light backwards, plus a sixth of the difference between reflected and
        // transmitted light [Sellers 1985, eq. 3].
        let back = 0.5 * scattered + (trees.reflectance - trees.transmittance) / 6.0;
        let transmittance = layer.diffuse_transmittance(layer.length / LAYERS as f32);
        Self { onward: scattered - back, back, transmittance, ground_albedo }
    }

    /// Downwelling and upwelling flux at each boundary, where the irradiance on level surfaces of light that has met no leaf is `first`.
    fn streams(&self, first: &[Vec3]) -> (Vec<Vec3>, Vec<Vec3>) {
        // The part that each layer intercepts.
        let taken: Vec<Vec3> = first.windows(2).map(|bounds| bounds[0] - bounds[1]).collect();
        let (mut down, mut up) = (vec![Vec3::ZERO; LAYERS + 1], vec![Vec3::ZERO; LAYERS + 1]);
        let met = 1.0 - self.transmittance;
        for _ in 0..SWEEPS {
            for layer in 0..LAYERS {
                let scattered = met * (down[layer] * self.onward + up[layer + 1] * self.back);
                down[layer + 1] = down[layer] * self.transmittance + scattered + taken[layer] * self.onward;
            }
            up[LAYERS] = self.ground_albedo * (first[LAYERS] + down[LAYERS]);
            for layer in (0..LAYERS).rev() {
                let scattered = met * (up[layer + 1] * self.onward + down[layer] * self.back);
                up[layer] = up[layer + 1] * self.transmittance + scattered + taken[layer] * self.back;
            }
        }
        (down, up)
    }
}
