//! The leaf, the bark and the ground as light sees them: diffuse reflection and diffuse transmission.
//!
//! The twin of `shade` in `shaders/common/lighting.wgsl`: a surface sends back `albedo / pi` of the light on the
//! viewer's side, and `albedo * transmission / pi` of the light on the other [Franzke 2005, 4.2.2, the diffuse terms]. The
//! light through a leaf has the colour that `plant/gloss.rs` derives, as in the shader. The gloss has no lobe here: as it is a
//! part of the base colour, the same light leaves a surface in the mean over all directions.
//!
//! Energy: both shares together may not exceed 1. A material that says otherwise is scaled down, channel by channel, to
//! reflect and transmit 1 together in the ratio that it states.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

/// A surface seen from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bsdf {
    /// Unit normal of the flat surface, on the viewer's side.
    geometric: Vec3,
    /// Unit normal that the cosine counts from; within a right angle of `geometric`.
    shading: Vec3,
    /// Shares of the light that are reflected and transmitted.
    reflected: Vec3,
    transmitted: Vec3,
}

/// A direction that the surface scatters light from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scattered {
    /// Unit vector, away from the surface.
    pub direction: Vec3,
    /// What the radiance from there counts: value times cosine over probability density.
    pub weight: Vec3,
    /// Probability density of the direction, 1/sr.
    pub density: f32,
}

/// `value` kept within 0..1; what is no number becomes 0.
fn share(value: Vec3) -> Vec3 {
    Vec3::select(value.cmpge(Vec3::ZERO), value, Vec3::ZERO).min(Vec3::ONE)
}

impl Bsdf {
    /// A surface that reflects and transmits these shares of the light, seen from the unit direction `to_viewer`.
    /// `geometric` and `shading` are unit normals of either side.
    pub fn new(geometric: Vec3, shading: Vec3, reflected: Vec3, transmitted: Vec3, to_viewer: Vec3) -> Self {
        let geometric = if geometric.dot(to_viewer) < 0.0 { -geometric } else { geometric };
        let shading = if shading.dot(geometric) < 0.0 { -shading } else { shading };
        Self { geometric, shading, reflected, transmitted }
    }

    /// The scattering function times the cosine for light from `direction`: what radiance per steradian counts.
    pub fn cosine_weighted(&self, direction: Vec3) -> Vec3 {
        let (flat, cosine) = (self.geometric.dot(direction), self.shading.dot(direction));
        if flat > 0.0 && cosine > 0.0 {
            self.reflected * (cosine / PI)
        } else if flat < 0.0 && cosine < 0.0 {
            self.transmitted * (-cosine / PI)
        } else {
            Vec3::ZERO
        }
    }

    /// The probability that [`Self::sample`] reflects; the rest transmits. `None` for a black surface.
    fn reflection_probability(&self) -> Option<f32> {
        let (reflected, transmitted) = (self.reflected.element_sum(), self.transmitted.element_sum());
        let sum = reflected + transmitted;
        (sum > 0.0).then(|| reflected / sum)
    }

    /// Probability density with which [`Self::sample`] finds `direction`, 1/sr.
    pub fn density(&self, direction: Vec3) -> f32 {
        let cosine = self.shading.dot(direction);
        let probability = self.reflection_probability().unwrap_or(0.0);
        let side = if cosine > 0.0 { probability } else { 1.0 - probability };
        side * cosine.abs() / PI
    }

    /// A direction by the cosine, `lobe` in 0..1 choosing the side. `None` where the surface is black or where the
    /// direction lies between the two normals' planes, from which no light comes.
    pub fn sample(&self, lobe: f32, point: Vec2) -> Option<Scattered> {
        let probability = self.reflection_probability()?;
        let reflects = lobe < probability;
        let (side, probability, share) =
            if reflects { (1.0, probability, self.reflected) } else { (-1.0, 1.0 - probability, self.transmitted) };
        let direction = cosine_hemisphere(self.shading * side, point);
        let cosine = side * self.shading.dot(direction);
        if cosine <= 0.0 || side * self.geometric.dot(direction) <= 0.0 || probability <= 0.0 {
            return None;
        }
        Some(Scattered { direction, weight: share / probability, density: probability * cosine / PI })
    }
}

/// Reflected and transmitted shares as a material states them, brought to at most 1 together.
pub(crate) fn balanced(reflected: Vec3, transmitted: Vec3) -> (Vec3, Vec3) {
    let (reflected, transmitted) = (share(reflected), share(transmitted));
    let scale = (reflected + transmitted).max(Vec3::ONE).recip();
    (reflected * scale, transmitted * scale)
}

/// A direction around the unit vector `axis`, by the cosine (Malley's method over concentric squares, Shirley & Chiu
/// 1997).
pub(crate) fn cosine_hemisphere(axis: Vec3, point: Vec2) -> Vec3 {
    let disc = concentric_disc(point);
    let height = (1.0 - disc.length_squared()).max(0.0).sqrt();
    let (u, v) = axis.any_orthonormal_pair();
    (u * disc.x + v * disc.y + axis * height).normalize_or(axis)
}

/// A direction in the cone of the half-angle `radius` radians around the unit vector `axis`, even by solid angle.
pub(crate) fn cone(axis: Vec3, radius: f32, point: Vec2) -> Vec3 {
    // 1 - cos without cancellation: half a degree of arc leaves no digits in f32 otherwise.
    let depth = 2.0 * (0.5 * radius).sin().powi(2) * point.x;
    let height = 1.0 - depth;
    let reach = (depth * (2.0 - depth)).max(0.0).sqrt();
    let (sine, cosine) = (TAU * point.y).sin_cos();
    let (u, v) = axis.any_orthonormal_pair();
    (u * (reach * cosine) + v * (reach * sine) + axis * height).normalize_or(axis)
}

/// Shirley & Chiu's concentric map of the unit square onto the unit disc.
fn concentric_disc(point: Vec2) -> Vec2 {
    let p = point * 2.0 - 1.0;
    if p.x.abs() > p.y.abs() {
        let (sine, cosine) = (0.25 * PI * (p.y / p.x)).sin_cos();
        p.x * Vec2::new(cosine, sine)
    } else if p.y != 0.0 {
        let (sine, cosine) = (0.5 * PI - 0.25 * PI * (p.x / p.y)).sin_cos();
        p.y * Vec2::new(cosine, sine)
    } else {
        Vec2::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::PathSampler;

    fn leaf(shading: Vec3) -> Bsdf {
        Bsdf::new(Vec3::Y, shading, Vec3::new(0.5, 0.3, 0.1), Vec3::new(0.4, 0.15, 0.02), Vec3::new(0.2, 0.9, 0.1))
    }

    /// An even direction of the sphere.
    fn sphere(point: Vec2) -> Vec3 {
        cone(Vec3::X, PI, point)
    }

    #[test]
    fn energy_is_conserved_whatever_the_material_says() {
        for (reflected, transmitted) in [(0.3, 0.5), (1.0, 1.0), (0.9, 0.4), (7.0, f32::NAN), (-1.0, 3.0)] {
            let (reflected, transmitted) = balanced(Vec3::splat(reflected), Vec3::splat(transmitted));
            assert!((reflected + transmitted).max_element() <= 1.0 + 1e-6);
            assert!(reflected.min_element() >= 0.0 && transmitted.min_element() >= 0.0);
        }
        assert_eq!(balanced(Vec3::splat(0.4), Vec3::splat(0.5)), (Vec3::splat(0.4), Vec3::splat(0.5)));
        let (reflected, transmitted) = balanced(Vec3::ONE, Vec3::splat(0.25));
        assert!((reflected + transmitted - 1.0).abs().max_element() < 1e-6);
        assert!((transmitted / reflected - 0.25).abs().max_element() < 1e-6);
    }

    #[test]
    fn integral_and_samples_agree_with_the_shares() {
        for shading in [Vec3::Y, Vec3::new(0.5, 1.0, -0.3).normalize()] {
            let bsdf = leaf(shading);
            let count = 1 << 14;
            let (mut even, mut drawn, mut densities) = (Vec3::ZERO, Vec3::ZERO, 0.0);
            for index in 0..count {
                let mut sampler = PathSampler::new(1, 0, index);
                let direction = sphere(sampler.pair());
                even += bsdf.cosine_weighted(direction) * (4.0 * PI);
                densities += bsdf.density(direction) * (4.0 * PI);
                if let Some(scattered) = bsdf.sample(sampler.pair().x, sampler.pair()) {
                    drawn += scattered.weight;
                    let expected = bsdf.cosine_weighted(scattered.direction) / scattered.density;
                    assert!((expected - scattered.weight).abs().max_element() < 1e-3, "{expected}");
                    assert!((bsdf.density(scattered.direction) / scattered.density - 1.0).abs() < 1e-4);
                }
            }
            let (even, drawn) = (even / count as f32, drawn / count as f32);
            let all = bsdf.reflected + bsdf.transmitted;
            assert!((even - drawn).abs().max_element() < 4e-3, "{even} {drawn}");
            assert!((densities / count as f32 - 1.0).abs() < 2e-3);
            // Between the planes of two different normals nothing is scattered: energy is lost there, never made.
            assert!((drawn - all).max_element() < 2e-3);
            assert!(shading != Vec3::Y || (drawn - all).abs().max_element() < 2e-3);
        }
    }

    #[test]
    fn the_scattering_function_is_reciprocal() {
        let (reflected, transmitted) = (Vec3::new(0.5, 0.3, 0.1), Vec3::splat(0.3));
        for index in 0..256 {
            let mut sampler = PathSampler::new(3, 1, index);
            let (from, to) = (sphere(sampler.pair()), sphere(sampler.pair()));
            let value = |viewer: Vec3, light: Vec3| {
                Bsdf::new(Vec3::Y, Vec3::Y, reflected, transmitted, viewer).cosine_weighted(light) / light.y.abs()
            };
            assert!((value(from, to) - value(to, from)).abs().max_element() < 1e-6);
        }
    }

    #[test]
    fn cones_are_even_and_narrow_ones_keep_their_edge() {
        let axis = Vec3::new(0.3, 0.8, -0.5).normalize();
        let radius = 0.0047f32;
        let mut inside = 0;
        for index in 0..4096 {
            let direction = cone(axis, radius, PathSampler::new(1, 5, index).pair());
            let angle = 2.0 * (0.5 * (direction - axis).length()).asin();
            assert!(angle < radius * 1.001);
            inside += u32::from(angle < radius * 0.5f32.sqrt());
        }
        assert!((1980..2120).contains(&inside), "{inside}");
    }
}
