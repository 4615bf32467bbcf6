//! Light inside a stand of trees: what the neighbours of a tree leave of the sky and of the sun, and what they send
//! instead.
//!
//! A stand is a layer of upright crowns, as many everywhere, from the tops (depth 0) to the ground (depth 1). Straight up
//! they cover the share `cover` of the sky; at an elevation e a ray meets crowns by their tops and by their sides, which are
//! `4 l / (pi w)` times as large, `w` and `l` being a crown's width and length over the tree's height [Li & Strahler 1985;
//! Nilson 1971]:
//!
//! ```text
//!  left(d, e) = exp(-tau (1 / l + 4 / (pi w) cot e) min(d, l))      tau = -ln(1 - 0.92 cover)
//!
//!  sky   share of the sky's radiance, in the mean over the upper half, that neighbours leave
//!  beam  share of the key light that they leave
//!  down  radiance from above of what they scatter     two-stream equations [Dickinson 1983; Sellers 1985, eq. 1 and 2]
//!  up    radiance from below: of leaves and ground
//! ```
//!
//! A tree's own crown is in none of it: it is in what was baked for the tree. So a ray counts only from where it has left
//! the own crown, `w / 2` away, and at the tops of an even stand nothing is in the way. The two streams, which are about the
//! mean leaf of the stand, count all of it. With a cover of 0 there is the sky, and the ground as a lone tree has it.
//!
//! Limits: the layer knows no single tree. A tree that is taller than its neighbours, or that stands at the edge, has the
//! light of the mean. Leaves have the mean colour of the stand's.

use std::f32::consts::PI;

use glam::Vec3;

use super::state::LightState;

/// Covers that are tabled, evenly from 0 to 1.
pub const COVERS: usize = 16;
/// Depths that are tabled, evenly from 0 to 1. After them comes the row of the ground, which has no crown of its own.
pub const DEPTHS: usize = 16;

/// Share of a crown's outline that leaves fill.
const FILLED: f32 = 0.92;
/// Albedo of the ground under trees: litter and moss, as `shaders/terrain/terrain.wgsl` draws them.
const FLOOR: Vec3 = Vec3::new(0.062, 0.058, 0.026);
/// Layers of the two streams, and how often light is sent through them: leaves reflect and pass on less than half of it.
const LAYERS: usize = 48;
const SWEEPS: usize = 12;
/// Rings of the upper half of the sky, of equal solid angle, and directions in each.
const RINGS: usize = 32;
const AZIMUTHS: usize = 32;

/// What a stand's trees are to light, in the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandTrees {
    /// Share that leaves reflect, per channel, 0..=1.
    pub reflectance: Vec3,
    /// Share that passes through leaves, per channel, 0..=1, at most what is not reflected.
    pub transmittance: Vec3,
    /// A crown's width over the tree's height; moved into 0.05..=2.
    pub crown_width: f32,
    /// A crown's length over the tree's height; moved into 0.1..=1. Below are trunks, which are left out.
    pub crown_length: f32,
}

impl StandTrees {
    /// Black leaves.
    pub const BLACK: Self =
        Self { reflectance: Vec3::ZERO, transmittance: Vec3::ZERO, crown_width: 0.5, crown_length: 0.7 };
}

/// What a place in the stand is lit by beside its own tree. Radiance in nits per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandPlace {
    /// Share of the sky that the neighbours leave, per channel, 0..=1.
    pub sky: Vec3,
    /// Share of the key light that they leave in the mean, 0..=1.
    pub beam: f32,
    /// Radiance from above of what they scatter.
    pub down: Vec3,
    /// Radiance from below.
    pub up: Vec3,
}

/// The light of one instant at every cover and depth of a stand.
#[derive(Clone, Debug, PartialEq)]
pub struct StandLight {
    /// Row by row: depths from 0 to 1, then the ground; covers from 0 to 1 in each.
    places: Vec<StandPlace>,
}

/// The mean radiance of a ring and the sine of its elevation.
type Ring = (f32, Vec3);

impl StandLight {
    /// The table for a light and the stand's trees: some 34,000 exponentials. Finite and never negative, for any light.
    pub fn new(light: &LightState, trees: &StandTrees) -> Self {
        let open = albedo(light);
        let rings = rings(light);
        let sun = Sun { sine: light.key_direction.y, illuminance: light.key_illuminance };
        let mut places = vec![StandPlace::default(); COVERS * (DEPTHS + 1)];
        for column in 0..COVERS {
            let cover = column as f32 / (COVERS - 1) as f32;
            let layer = Layer::new(cover, trees);
            let streams = Streams::new(&layer, &rings, &sun, trees, open.lerp(FLOOR, cover));
            for row in 0..=DEPTHS {
                let depth = (row as f32 / (DEPTHS - 1) as f32).min(1.0);
                let (down, up) = streams.at((depth / layer.length).min(1.0));
                let place = if row == DEPTHS {
                    StandPlace { sky: layer.flux_left(&rings), beam: layer.left(1.0, sun.sine), down, up }
                } else {
                    StandPlace {
                        sky: layer.sky_left(depth, &rings),
                        beam: layer.left_by_neighbours(depth, sun.sine),
                        down,
                        up,
                    }
                };
                places[row * COVERS + column] = place;
            }
        }
        Self { places }
    }

    /// The tabled places: rows of depths from 0 to 1, then of the ground, [`COVERS`] covers in each.
    pub fn places(&self) -> &[StandPlace] {
        &self.places
    }

    /// Between the tabled places, as the shader reads them. `cover` and `depth` are moved into 0..=1.
    pub fn at(&self, cover: f32, depth: f32) -> StandPlace {
        let clamp = |value: f32, count: usize| (if value > 0.0 { value.min(1.0) } else { 0.0 }) * (count - 1) as f32;
        let (x, y) = (clamp(cover, COVERS), clamp(depth, DEPTHS));
        let (column, row) = ((x as usize).min(COVERS - 2), (y as usize).min(DEPTHS - 2));
        let place = |row: usize, column: usize| self.places[row * COVERS + column];
        let (u, v) = (x - column as f32, y - row as f32);
        mix(
            &mix(&place(row, column), &place(row, column + 1), u),
            &mix(&place(row + 1, column), &place(row + 1, column + 1), u),
            v,
        )
    }
}

fn mix(a: &StandPlace, b: &StandPlace, t: f32) -> StandPlace {
    StandPlace {
        sky: a.sky.lerp(b.sky, t),
        beam: a.beam + (b.beam - a.beam) * t,
        down: a.down.lerp(b.down, t),
        up: a.up.lerp(b.up, t),
    }
}

/// Albedo of the ground that the light's surroundings have; black without light.
fn albedo(light: &LightState) -> Vec3 {
    let lit = light.sky_illuminance + light.key_illuminance * light.key_direction.y.max(0.0);
    let albedo = |c: usize| if lit[c] > 0.0 { (PI * light.ground_radiance[c] / lit[c]).clamp(0.0, 1.0) } else { 0.0 };
    Vec3::from([0, 1, 2].map(albedo))
}

fn rings(light: &LightState) -> Vec<Ring> {
    let ring = |index: usize| {
        let sine = (index as f32 + 0.5) / RINGS as f32;
        let reach = (1.0 - sine * sine).sqrt();
        let sum: Vec3 = (0..AZIMUTHS)
            .map(|azimuth| {
                let (z, x) = (2.0 * PI * (azimuth as f32 + 0.5) / AZIMUTHS as f32).sin_cos();
                light.sky_view.sample(Vec3::new(reach * x, sine, reach * z))
            })
            .sum();
        (sine, sum / AZIMUTHS as f32)
    };
    (0..RINGS).map(ring).collect()
}

/// The ratio of two sums over the sky; 1 where the sky is black.
fn ratio(part: Vec3, whole: Vec3) -> Vec3 {
    Vec3::from([0, 1, 2].map(|c| if whole[c] > 0.0 { (part[c] / whole[c]).clamp(0.0, 1.0) } else { 1.0 }))
}

/// Crowns of one cover.
struct Layer {
    /// Optical depth of all of it, seen straight up.
    tau: f32,
    /// Area of a crown's side over that of its top.
    side: f32,
    /// Radius of the own crown over the tree's height.
    own: f32,
    /// Length of crowns over the tree's height.
    length: f32,
}

impl Layer {
    fn new(cover: f32, trees: &StandTrees) -> Self {
        let within = |value: f32, least: f32, most: f32, other: f32| {
            if value > 0.0 { value.clamp(least, most) } else { other }
        };
        let width = within(trees.crown_width, 0.05, 2.0, StandTrees::BLACK.crown_width);
        let length = within(trees.crown_length, 0.1, 1.0, StandTrees::BLACK.crown_length);
        Self { tau: -(1.0 - FILLED * cover).ln(), side: 4.0 / (PI * width), own: 0.5 * width, length }
    }

    /// Share of light from an elevation of this sine that comes down to `depth`.
    fn left(&self, depth: f32, sine: f32) -> f32 {
        let sine = sine.clamp(0.02, 1.0);
        let cotangent = (1.0 - sine * sine).sqrt() / sine;
        (-self.tau * (1.0 / self.length + self.side * cotangent) * depth.min(self.length)).exp()
    }

    /// The same of what is beyond the own crown.
    fn left_by_neighbours(&self, depth: f32, sine: f32) -> f32 {
        let sine = sine.clamp(0.02, 1.0);
        let tangent = sine / (1.0 - sine * sine).max(1e-6).sqrt();
        self.left((depth - self.own * tangent).max(0.0), sine)
    }

    fn sky_left(&self, depth: f32, rings: &[Ring]) -> Vec3 {
        let part = rings.iter().map(|(sine, radiance)| *radiance * self.left_by_neighbours(depth, *sine)).sum();
        ratio(part, rings.iter().map(|(_, radiance)| *radiance).sum())
    }

    /// Share of the sky's light on level ground that comes through.
    fn flux_left(&self, rings: &[Ring]) -> Vec3 {
        let part = rings.iter().map(|(sine, radiance)| *radiance * *sine * self.left(1.0, *sine)).sum();
        ratio(part, rings.iter().map(|(sine, radiance)| *radiance * *sine).sum())
    }

    /// Share of even light that a layer of the thickness `depth` within the crowns keeps: the mean of the cosine-weighted
    /// optical depths.
    fn kept(&self, depth: f32) -> f32 {
        (-self.tau * (1.0 / self.length + 0.5 * PI * self.side) * depth).exp()
    }
}

struct Sun {
    sine: f32,
    illuminance: Vec3,
}

/// Light that leaves scatter, up and down.
struct Streams {
    /// Radiance downwards and upwards at each of the layers' bounds.
    bounds: Vec<(Vec3, Vec3)>,
}

impl Streams {
    fn new(layer: &Layer, rings: &[Ring], sun: &Sun, trees: &StandTrees, ground_albedo: Vec3) -> Self {
        let scattered = trees.reflectance + trees.transmittance;
        // Leaves that face everywhere send half of the light back the way it came, and of the difference between reflected
        // and transmitted light a sixth more [Sellers 1985, eq. 3].
        let back = 0.5 * scattered + (trees.reflectance - trees.transmittance) / 6.0;
        let onward = scattered - back;
        // Light on level ground that has met no leaf down to a depth.
        let first = |depth: f32| -> Vec3 {
            let solid_angle = 2.0 * PI / RINGS as f32;
            let of_sun = sun.illuminance * (sun.sine.max(0.0) * layer.left(depth, sun.sine));
            let of_sky = |(sine, radiance): &Ring| *radiance * (*sine * layer.left(depth, *sine) * solid_angle);
            of_sun + rings.iter().map(of_sky).sum::<Vec3>()
        };
        let firsts: Vec<Vec3> = (0..=LAYERS).map(|bound| first(layer.length * bound as f32 / LAYERS as f32)).collect();
        // What each layer takes from it.
        let taken: Vec<Vec3> = firsts.windows(2).map(|bounds| bounds[0] - bounds[1]).collect();
        let floor = firsts[LAYERS];
        let kept = layer.kept(layer.length / LAYERS as f32);
        let (mut down, mut up) = (vec![Vec3::ZERO; LAYERS + 1], vec![Vec3::ZERO; LAYERS + 1]);
        for _ in 0..SWEEPS {
            for layer in 0..LAYERS {
                let met = (1.0 - kept) * (down[layer] * onward + up[layer + 1] * back);
                down[layer + 1] = down[layer] * kept + met + taken[layer] * onward;
            }
            up[LAYERS] = ground_albedo * (floor + down[LAYERS]);
            for layer in (0..LAYERS).rev() {
                let met = (1.0 - kept) * (up[layer + 1] * onward + down[layer] * back);
                up[layer] = up[layer + 1] * kept + met + taken[layer] * back;
            }
        }
        let finite =
            |flux: Vec3| Vec3::from((flux / PI).to_array().map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 }));
        Self { bounds: down.into_iter().zip(up).map(|(down, up)| (finite(down), finite(up))).collect() }
    }

    /// Radiance downwards and upwards at a share of the crowns' length, 0..=1.
    fn at(&self, depth: f32) -> (Vec3, Vec3) {
        let place = depth * LAYERS as f32;
        let bound = (place as usize).min(LAYERS - 1);
        let (a, b) = (self.bounds[bound], self.bounds[bound + 1]);
        let t = place - bound as f32;
        (a.0.lerp(b.0, t), a.1.lerp(b.1, t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            let place = stand.at(0.0, depth);
            assert_eq!((place.sky, place.beam, place.down), (Vec3::ONE, 1.0, Vec3::ZERO));
            let up = (place.up / light.ground_radiance - 1.0).abs().max_element();
            // Sums over rings against a finer quadrature.
            assert!(up < 0.01, "{up}");
        }
    }

    #[test]
    fn it_gets_darker_with_depth_and_cover() {
        for elevation in [60.0, 8.0] {
            let stand = StandLight::new(&light(elevation), &leaves(0.1, 0.1));
            for cover in 0..10 {
                let cover = cover as f32 / 10.0;
                assert_eq!(stand.at(cover, 0.0).sky, Vec3::ONE, "the tops see all of the sky");
                for depth in 0..10 {
                    let depth = depth as f32 / 10.0;
                    let (here, deeper, denser) =
                        (stand.at(cover, depth), stand.at(cover, depth + 0.1), stand.at(cover + 0.1, depth));
                    for other in [deeper, denser] {
                        assert!((other.sky - here.sky).max_element() < 1e-6 && other.beam <= here.beam + 1e-6);
                    }
                }
            }
            let ground = &stand.places()[DEPTHS * COVERS..];
            assert!(ground.windows(2).all(|pair| pair[1].beam < pair[0].beam && pair[1].sky.y < pair[0].sky.y));
        }
    }

    #[test]
    fn a_low_sky_glow_is_hidden_before_a_high_one() {
        let trees = leaves(0.1, 0.1);
        let layer = Layer::new(0.5, &trees);
        let at = |elevation: f32| layer.left_by_neighbours(0.4, elevation.to_radians().sin());
        assert!(at(5.0) < 0.7 * at(30.0) && at(30.0) < at(60.0));
        assert_eq!(at(89.0), 1.0, "straight up there is the own crown alone");
        // Broad crowns are met by their tops, slender ones by their sides too.
        let slender = Layer::new(0.5, &StandTrees { crown_width: 0.2, ..trees });
        assert!(slender.left(0.5, 0.3) < layer.left(0.5, 0.3));
    }

    #[test]
    fn leaves_that_swallow_nothing_lose_no_light() {
        let light = light(40.0);
        let rings = rings(&light);
        let sun = Sun { sine: light.key_direction.y, illuminance: light.key_illuminance };
        let trees = leaves(0.5, 0.5);
        let layer = Layer::new(0.4, &trees);
        // A ground that swallows all: what comes in from above leaves upwards or arrives there.
        let streams = Streams::new(&layer, &rings, &sun, &trees, Vec3::ZERO);
        let first = |depth: f32| {
            let ring = |(sine, radiance): &Ring| radiance.y * sine * layer.left(depth, *sine) * 2.0 * PI / RINGS as f32;
            sun.illuminance.y * sun.sine * layer.left(depth, sun.sine) + rings.iter().map(ring).sum::<f32>()
        };
        let (_, out) = streams.at(0.0);
        let (arrived, _) = streams.at(1.0);
        let kept = PI * (out.y + arrived.y) + first(1.0);
        assert!((kept / first(0.0) - 1.0).abs() < 0.01, "{}", kept / first(0.0));
        // Black leaves over white ground send nothing back that they would have to scatter.
        let dark = Streams::new(&layer, &rings, &sun, &StandTrees::BLACK, Vec3::ZERO);
        assert!(dark.bounds.iter().all(|(down, up)| *down == Vec3::ZERO && *up == Vec3::ZERO));
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
        };
        for light in [black, light(-3.0), light(0.0), light(89.0)] {
            for trees in [StandTrees::BLACK, leaves(0.5, 0.5), wild, StandTrees { crown_width: 1e9, ..wild }] {
                let stand = StandLight::new(&light, &trees);
                for place in stand.places() {
                    let finite = place.sky.is_finite() && place.beam.is_finite();
                    assert!(finite && place.down.is_finite() && place.up.is_finite(), "{place:?}");
                    assert!(place.sky.min_element() >= 0.0 && place.down.min_element() >= 0.0);
                    assert!(place.up.min_element() >= 0.0 && (0.0..=1.0).contains(&place.beam));
                }
                assert!(stand.at(f32::NAN, f32::INFINITY).up.is_finite());
            }
        }
    }
}
