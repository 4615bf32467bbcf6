//! Light inside a stand of trees: how much sky and sun the neighbours of a tree let through, and how much light they
//! scatter towards it.
//!
//! A stand is modelled as a uniform layer of upright crowns, from the tops (depth 0) to the ground (depth 1). Seen
//! straight up, they cover the fraction `cover` of the sky. At an elevation e a ray meets crowns by their tops and by
//! their sides. The sides are `4 l / (pi w)` times as large as the tops, where `w` and `l` are a crown's width and
//! length over the tree's height [Li & Strahler 1985; Nilson 1971], and `f` is what a crown hides of its disc:
//!
//! ```text
//!  transmittance(d, e) = exp(-tau (1 / l + 4 / (pi w) cot e) min(d, l))      tau = -ln(1 - f cover)
//!
//!  sky_transmittance  of the sky's radiance through the neighbours, mean over what the own crown leaves of the sky
//!  sun_transmittance  of the key light through the neighbours
//!  downwelling        scattered radiance from above    two-stream equations [Dickinson 1983; Sellers 1985, eq. 1, 2]
//!  upwelling          radiance from below, of leaves and ground
//! ```
//!
//! None of these terms includes the tree's own crown, because the data baked for the tree does. So a ray counts only
//! from where it leaves the own crown, and nothing is in the way at the tops of an even stand. Yet what the own crown
//! hides decides which part of the sky the neighbours may hide too ([`own_crown`](super::own_crown)). The two
//! streams describe the mean leaf of the stand and count all crowns. With a cover of 0 the result is the open sky, and
//! the ground as a lone tree sees it.
//!
//! Limits: the layer has no single trees. A tree that is taller than its neighbours, or that stands at the edge, gets
//! the mean light. Leaves have the mean colour of the stand.

mod layer;
mod streams;

use std::f32::consts::PI;

use glam::Vec3;

use self::{
    layer::{Layer, OwnSky, rings},
    streams::{Streams, Sun},
};
use super::{own_crown::OwnCrown, state::LightState};

/// Number of covers in the table, evenly from 0 to 1.
pub const COVERS: usize = 16;
/// Number of depths in the table, evenly from 0 to 1. The row of the ground follows them; it has no crown of its own.
pub const DEPTHS: usize = 16;

/// The most that a crown hides of its disc. A dense crown reaches beyond its disc and hides more area than that; with this much, stands of
/// grown trees are as bright as the path tracer has them.
const MOST_FILL: f32 = 0.92;
/// Albedo of the ground under trees: litter and moss, as `shaders/terrain/terrain.wgsl` draws them.
const FLOOR: Vec3 = Vec3::new(0.062, 0.058, 0.026);
/// What crowns that shade each other leave of the light of a level layer: with it a forest that is drawn as a surface is as bright
/// as the trees that end there (`canopy compare` of the demo with `surface_size` 6 and 0).
const CROWN_SHADE: f32 = 0.42;

/// Mean optical properties of a stand's trees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandTrees {
    /// Fraction of light that leaves reflect, per channel, 0..=1.
    pub reflectance: Vec3,
    /// Fraction of light that leaves transmit, per channel, 0..=1, at most what they do not reflect.
    pub transmittance: Vec3,
    /// A crown's width over the tree's height; clamped to 0.05..=2.
    pub crown_width: f32,
    /// A crown's length over the tree's height; clamped to 0.1..=1. The trunks below it are ignored.
    pub crown_length: f32,
    /// What a crown hides of the disc of ground that it covers, seen from above; clamped to 0.1..=0.92.
    pub crown_fill: f32,
}

impl StandTrees {
    /// Black leaves.
    pub const BLACK: Self = Self {
        reflectance: Vec3::ZERO,
        transmittance: Vec3::ZERO,
        crown_width: 0.5,
        crown_length: 0.7,
        crown_fill: MOST_FILL,
    };

    /// Albedo of their closed crowns, seen from far above: that of a deep layer of isotropic scatterers, `(1 − γ) / (1 + γ)` with
    /// `γ² = 1 − R − T` [Hapke 1981, "Bidirectional reflectance spectroscopy", eq. 12], times what crowns that shade
    /// each other leave of it.
    pub fn crown_albedo(&self) -> Vec3 {
        let scattered = (self.reflectance + self.transmittance).clamp(Vec3::ZERO, Vec3::ONE);
        let layer = |scattered: f32| {
            let gamma = (1.0 - scattered).sqrt();
            (1.0 - gamma) / (1.0 + gamma)
        };
        let albedo = CROWN_SHADE * Vec3::new(layer(scattered.x), layer(scattered.y), layer(scattered.z));
        if albedo.is_finite() { albedo } else { Vec3::ZERO }
    }

    /// Width, length and fill of a crown within their ranges; those of [`BLACK`](Self::BLACK) for what is no positive number.
    fn crown(&self) -> (f32, f32, f32) {
        let within = |value: f32, least: f32, most: f32, other: f32| {
            if value > 0.0 { value.clamp(least, most) } else { other }
        };
        let width = within(self.crown_width, 0.05, 2.0, Self::BLACK.crown_width);
        let length = within(self.crown_length, 0.1, 1.0, Self::BLACK.crown_length);
        (width, length, within(self.crown_fill, 0.1, MOST_FILL, Self::BLACK.crown_fill))
    }

    /// The crown of the mean tree.
    fn own_crown(&self) -> OwnCrown {
        let (width, length, fill) = self.crown();
        OwnCrown { radius: 0.5 * width, length, extinction: -(1.0 - fill).ln() / length }
    }
}

/// Light at a cover and depth of the stand, the tree's own crown excluded. Radiance in nits per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandSample {
    /// Mean transmittance of the neighbouring crowns for the sky's radiance at leaves, per channel, 0..=1.
    pub sky_transmittance: Vec3,
    /// The same at trunks.
    pub trunk_sky_transmittance: Vec3,
    /// Mean transmittance of the neighbouring crowns for the key light (sun or moon), 0..=1.
    pub sun_transmittance: f32,
    /// Downwelling radiance: scattered towards the ground by neighbouring crowns.
    pub downwelling: Vec3,
    /// Upwelling radiance: from leaves and ground below.
    pub upwelling: Vec3,
    /// The downwelling radiance where relief hides the key light.
    pub shaded_downwelling: Vec3,
    /// The upwelling radiance there.
    pub shaded_upwelling: Vec3,
}

/// Table of the light in a stand at one instant, over covers and depths.
#[derive(Clone, Debug, PartialEq)]
pub struct StandLight {
    /// Row by row: depths from 0 to 1, then the ground; in each row covers from 0 to 1.
    samples: Vec<StandSample>,
    /// Mean logarithm of the horizontal illuminance between the crowns, in sun flecks and beside them, less that on open
    /// ground: rows of depths from 0 to 1, in each row covers from 0 to 1.
    shares: Vec<f32>,
}

impl StandLight {
    /// Computes the table for a light and the stand's trees, with some 250,000 exponentials. Finite and never negative
    /// for any light.
    pub fn new(light: &LightState, trees: &StandTrees) -> Self {
        let open = albedo(light);
        let rings = rings(light);
        let sun = Sun { sine: light.key_direction.y, illuminance: light.key_illuminance };
        let own = (0..DEPTHS).map(|row| OwnSky::new(&trees.own_crown(), row as f32 / (DEPTHS - 1) as f32));
        let own: Vec<OwnSky> = own.collect();
        let mut samples = vec![StandSample::default(); COVERS * (DEPTHS + 1)];
        let mut shares = vec![0.0; COVERS * DEPTHS];
        for column in 0..COVERS {
            let cover = column as f32 / (COVERS - 1) as f32;
            let layer = Layer::new(cover, trees);
            let ground = open.lerp(FLOOR, cover);
            let streams = Streams::new(&layer, &rings, &sun, trees, ground);
            for row in 0..=DEPTHS {
                let depth = (row as f32 / (DEPTHS - 1) as f32).min(1.0);
                let within = (depth / layer.length).min(1.0);
                let (downwelling, upwelling) = streams.at(within);
                let (shaded_downwelling, shaded_upwelling) = streams.shaded_at(within);
                let (sky_transmittance, trunk_sky_transmittance, sun_transmittance) = match own.get(row) {
                    Some(own) => (
                        own.of_leaves(&layer, &rings),
                        own.of_trunk(&layer, &rings),
                        layer.neighbour_transmittance(depth, sun.sine),
                    ),
                    None => {
                        let sky = layer.sky_flux_transmittance(&rings);
                        (sky, sky, layer.transmittance(1.0, sun.sine))
                    }
                };
                samples[row * COVERS + column] = StandSample {
                    sky_transmittance,
                    trunk_sky_transmittance,
                    sun_transmittance,
                    downwelling,
                    upwelling,
                    shaded_downwelling,
                    shaded_upwelling,
                };
                if row < DEPTHS {
                    shares[row * COVERS + column] = streams.share_ln(within);
                }
            }
        }
        Self { samples, shares }
    }

    /// The samples of the table: rows of depths from 0 to 1, then the ground, with [`COVERS`] covers in each row.
    pub fn samples(&self) -> &[StandSample] {
        &self.samples
    }

    /// The fraction of the horizontal illuminance on open ground that there is between crowns of the cover `cover` at the
    /// depth `depth`, with no crown of its own around it: 1 without cover and at depth 0, never 0. It is the geometric mean of
    /// sun flecks and shade, which is what an eye adapts to. Both arguments are clamped to 0..=1; the logarithm is
    /// interpolated.
    pub fn share(&self, cover: f32, depth: f32) -> f32 {
        self.share_ln(cover, depth).exp()
    }

    /// Natural logarithm of [`share`](Self::share).
    pub fn share_ln(&self, cover: f32, depth: f32) -> f32 {
        let ((column, u), (row, v)) = (position(cover, COVERS), position(depth, DEPTHS));
        let share = |row: usize, column: usize| self.shares[row * COVERS + column];
        let line = |row: usize| share(row, column) + (share(row, column + 1) - share(row, column)) * u;
        line(row) + (line(row + 1) - line(row)) * v
    }

    /// Interpolates the table as the shader does. `cover` and `depth` are clamped to 0..=1.
    pub fn at(&self, cover: f32, depth: f32) -> StandSample {
        let ((column, u), (row, v)) = (position(cover, COVERS), position(depth, DEPTHS));
        let sample = |row: usize, column: usize| self.samples[row * COVERS + column];
        mix(
            &mix(&sample(row, column), &sample(row, column + 1), u),
            &mix(&sample(row + 1, column), &sample(row + 1, column + 1), u),
            v,
        )
    }
}

/// The entry of a table of `count` before a value that is clamped to 0..=1, and the way from it to the next.
fn position(value: f32, count: usize) -> (usize, f32) {
    let at = (if value > 0.0 { value.min(1.0) } else { 0.0 }) * (count - 1) as f32;
    let before = (at as usize).min(count - 2);
    (before, at - before as f32)
}

fn mix(a: &StandSample, b: &StandSample, t: f32) -> StandSample {
    StandSample {
        sky_transmittance: a.sky_transmittance.lerp(b.sky_transmittance, t),
        trunk_sky_transmittance: a.trunk_sky_transmittance.lerp(b.trunk_sky_transmittance, t),
        sun_transmittance: a.sun_transmittance + (b.sun_transmittance - a.sun_transmittance) * t,
        downwelling: a.downwelling.lerp(b.downwelling, t),
        upwelling: a.upwelling.lerp(b.upwelling, t),
        shaded_downwelling: a.shaded_downwelling.lerp(b.shaded_downwelling, t),
        shaded_upwelling: a.shaded_upwelling.lerp(b.shaded_upwelling, t),
    }
}

/// Albedo of the ground in the light's surroundings; black without light.
fn albedo(light: &LightState) -> Vec3 {
    let lit = light.sky_illuminance + light.key_illuminance * light.key_direction.y.max(0.0);
    let albedo = |c: usize| if lit[c] > 0.0 { (PI * light.ground_radiance[c] / lit[c]).clamp(0.0, 1.0) } else { 0.0 };
    Vec3::from([0, 1, 2].map(albedo))
}

#[cfg(test)]
mod tests {
    use super::{
        layer::{RINGS, Ring},
        *,
    };
    use crate::light::{Atmosphere, AtmosphereParams, LightSettings, SunPosition};

    fn light(elevation: f64) -> LightState {
        let air = Atmosphere::new(AtmosphereParams::with_visibility_km(40.0)).unwrap();
        let sun = SunPosition::from_degrees(200.0, elevation).unwrap();
        LightState::new(&air, sun, None, &LightSettings::default()).unwrap()
    }

    fn leaves(reflected: f32, transmitted: f32) -> StandTrees {
        StandTrees { reflectance: Vec3::splat(reflected), transmittance: Vec3::splat(transmitted), ..StandTrees::BLACK }
    }

    #[test]
    fn without_cover_there_is_the_sky_and_the_open_ground() {
        let light = light(35.0);
        let stand = StandLight::new(&light, &leaves(0.1, 0.1));
        for depth in [0.0, 0.4, 1.0] {
            let sample = stand.at(0.0, depth);
            assert_eq!(
                (sample.sky_transmittance, sample.sun_transmittance, sample.downwelling),
                (Vec3::ONE, 1.0, Vec3::ZERO)
            );
            let up = (sample.upwelling / light.ground_radiance - 1.0).abs().max_element();
            // Sums over rings against a finer quadrature.
            assert!(up < 0.01, "{up}");
        }
    }

    #[test]
    fn behind_relief_there_is_the_light_of_the_sky_alone() {
        let lit = light(12.0);
        let mut unlit = lit.clone();
        unlit.ground_radiance = albedo(&lit) / PI * lit.sky_illuminance;
        unlit.key_illuminance = Vec3::ZERO;
        let [shaded, dark] = [&lit, &unlit].map(|light| StandLight::new(light, &leaves(0.1, 0.1)));
        for (a, b) in shaded.samples().iter().zip(dark.samples()) {
            let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= 1e-4 * b.max_element();
            assert!(near(a.shaded_downwelling, b.downwelling) && near(a.shaded_upwelling, b.upwelling), "{a:?}, {b:?}");
            assert!(a.shaded_downwelling.cmple(a.downwelling).all() && a.shaded_upwelling.cmple(a.upwelling).all());
        }
        let deep = shaded.at(0.7, 0.3);
        assert!(deep.shaded_downwelling.y < 0.9 * deep.downwelling.y, "{deep:?}");
    }

    #[test]
    fn the_share_of_light_falls_with_cover_and_depth_and_starts_at_one() {
        for elevation in [70.0, 30.0, 4.0, -5.0] {
            let stand = StandLight::new(&light(elevation), &leaves(0.1, 0.1));
            for i in 0..=20 {
                let value = i as f32 / 20.0;
                assert!((stand.share(0.0, value) - 1.0).abs() < 1e-3, "{}", stand.share(0.0, value));
                assert!((stand.share(value, 0.0) - 1.0).abs() < 1e-3, "{}", stand.share(value, 0.0));
            }
            for i in 0..20 {
                let (here, next) = (i as f32 / 20.0, (i + 1) as f32 / 20.0);
                assert!(
                    stand.share(next, 1.0) < stand.share(here, 1.0) && stand.share(0.8, next) <= stand.share(0.8, here)
                );
            }
            assert!((1e-4..0.3).contains(&stand.share(0.95, 1.0)), "{}", stand.share(0.95, 1.0));
        }
    }

    #[test]
    fn it_gets_darker_with_depth_and_cover() {
        for elevation in [60.0, 8.0] {
            let stand = StandLight::new(&light(elevation), &leaves(0.1, 0.1));
            for cover in 0..10 {
                let cover = cover as f32 / 10.0;
                assert_eq!(stand.at(cover, 0.0).sky_transmittance, Vec3::ONE, "the tops see all of the sky");
                for depth in 0..10 {
                    let depth = depth as f32 / 10.0;
                    let (here, deeper, denser) =
                        (stand.at(cover, depth), stand.at(cover, depth + 0.1), stand.at(cover + 0.1, depth));
                    // Below the crowns, from 0.7 on, the own one opens again: more of the sky counts.
                    let opens = if depth < 0.65 { 1e-6 } else { 0.04 };
                    for (other, rise) in [(deeper, opens), (denser, 1e-6)] {
                        assert!(
                            (other.sky_transmittance - here.sky_transmittance).max_element() < rise
                                && other.sun_transmittance <= here.sun_transmittance + 1e-6
                        );
                    }
                }
            }
            let ground = &stand.samples()[DEPTHS * COVERS..];
            assert!(ground.windows(2).all(|pair| pair[1].sun_transmittance < pair[0].sun_transmittance
                && pair[1].sky_transmittance.y < pair[0].sky_transmittance.y));
        }
    }

    #[test]
    fn a_low_sky_glow_is_hidden_before_a_high_one() {
        let trees = leaves(0.1, 0.1);
        let layer = Layer::new(0.5, &trees);
        let at = |elevation: f32| layer.neighbour_transmittance(0.4, elevation.to_radians().sin());
        assert!(at(5.0) < 0.7 * at(30.0) && at(30.0) < at(60.0));
        assert_eq!(at(89.0), 1.0, "straight up there is the own crown alone");
        // Broad crowns are met by their tops, slender ones by their sides too.
        let slender = Layer::new(0.5, &StandTrees { crown_width: 0.2, ..trees });
        assert!(slender.transmittance(0.5, 0.3) < layer.transmittance(0.5, 0.3));
    }

    /// Thin crowns let more of the sun and of the sky through.
    #[test]
    fn thin_crowns_are_brighter_below() {
        let light = light(50.0);
        let [thin, dense] =
            [0.5, 0.95].map(|fill| StandLight::new(&light, &StandTrees { crown_fill: fill, ..leaves(0.1, 0.1) }));
        let (thin, dense) = (thin.at(0.7, 1.0), dense.at(0.7, 1.0));
        assert!(thin.sun_transmittance > 1.3 * dense.sun_transmittance);
        assert!(thin.sky_transmittance.y > 1.3 * dense.sky_transmittance.y);
    }

    #[test]
    fn leaves_that_absorb_nothing_lose_no_light() {
        let light = light(40.0);
        let rings = rings(&light);
        let sun = Sun { sine: light.key_direction.y, illuminance: light.key_illuminance };
        let trees = leaves(0.5, 0.5);
        let layer = Layer::new(0.4, &trees);
        // Over a black ground, all light from above leaves upwards or arrives at the ground.
        let streams = Streams::new(&layer, &rings, &sun, &trees, Vec3::ZERO);
        let first = |depth: f32| {
            let ring = |(sine, radiance): &Ring| {
                radiance.y * sine * layer.transmittance(depth, *sine) * 2.0 * PI / RINGS as f32
            };
            sun.illuminance.y * sun.sine * layer.transmittance(depth, sun.sine) + rings.iter().map(ring).sum::<f32>()
        };
        let (_, out) = streams.at(0.0);
        let (arrived, _) = streams.at(1.0);
        let kept = PI * (out.y + arrived.y) + first(1.0);
        assert!((kept / first(0.0) - 1.0).abs() < 0.01, "{}", kept / first(0.0));
        // Black leaves over white ground send nothing back that they would have to scatter.
        let dark = Streams::new(&layer, &rings, &sun, &StandTrees::BLACK, Vec3::ZERO);
        for depth in [0.0, 0.3, 1.0] {
            assert_eq!((dark.at(depth), dark.shaded_at(depth)), ((Vec3::ZERO, Vec3::ZERO), (Vec3::ZERO, Vec3::ZERO)));
        }
    }

    #[test]
    fn no_light_and_impossible_trees_leave_finite_numbers() {
        let mut black = light(-40.0);
        black.sky_view.texels.fill([0.0; 3]);
        black.key_illuminance = Vec3::ZERO;
        black.sky_illuminance = Vec3::ZERO;
        black.ground_radiance = Vec3::ZERO;
        let wild = StandTrees {
            reflectance: Vec3::splat(f32::NAN),
            transmittance: Vec3::splat(9.0),
            crown_width: f32::NAN,
            crown_length: -1.0,
            crown_fill: f32::INFINITY,
        };
        for light in [black, light(-3.0), light(0.0), light(89.0)] {
            for trees in [StandTrees::BLACK, leaves(0.5, 0.5), wild, StandTrees { crown_width: 1e9, ..wild }] {
                let stand = StandLight::new(&light, &trees);
                for sample in stand.samples() {
                    let finite = sample.sky_transmittance.is_finite() && sample.sun_transmittance.is_finite();
                    assert!(finite && sample.downwelling.is_finite() && sample.upwelling.is_finite(), "{sample:?}");
                    assert!(sample.sky_transmittance.min_element() >= 0.0 && sample.downwelling.min_element() >= 0.0);
                    assert!(sample.upwelling.min_element() >= 0.0 && (0.0..=1.0).contains(&sample.sun_transmittance));
                }
                assert!(stand.at(f32::NAN, f32::INFINITY).upwelling.is_finite());
                let share = stand.share(f32::INFINITY, 1.0);
                assert!((0.0..=1.0).contains(&share) && share > 0.0, "{share}");
            }
        }
    }
}
