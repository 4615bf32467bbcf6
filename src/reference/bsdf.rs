//! Scattering by leaves, bark and ground: diffuse reflection, diffuse transmission, and the gloss of leaves.
//!
//! The twin of `shade` in `shaders/common/lighting.wgsl` [Franzke 2005, 4.2.2]: a surface scatters
//! `reflected / pi` of the light on the viewer's side to the viewer, and `transmitted / pi` of the light on the other
//! side. A leaf with gloss reflects only its subsurface albedo diffusely, and the rest of its base colour around the
//! mirror direction, on either side ([`Lobe`]). `plant/gloss.rs` derives both, and the colour of the light through a
//! leaf, as it does for the shader.
//!
//! The shader applies the lobe only to the key light, and leaves smaller than a pixel reflect like a ball. Here the
//! lobe applies to all light, and each leaf reflects about its own normal.
//!
//! Energy: reflection and transmission together must not exceed 1. A material that exceeds it is scaled down, channel
//! by channel, to a sum of 1 in the same ratio. Where the rest has no room for the whole lobe
//! ([`Gloss::specular_albedo`]), the leaf reflects more diffusely: its base colour is kept.
//!
//! Interpolated normals: a surface scatters by the cosine to the interpolated normal, but no light passes through the
//! flat triangle. Of even light, the part `(1 - c) / 2` of that cosine lies behind the triangle, `c` being the cosine
//! between both normals. The diffuse light is therefore raised by `2 / (1 + c)`: a white surface loses nothing of even
//! light ([`Bsdf::new`]).

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::leaf::LeafView;
use super::lobe::Lobe;
use crate::plant::Gloss;

/// Fractions of light that a material reflects and transmits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shares {
    /// Fraction that is reflected diffusely.
    pub reflected: Vec3,
    /// Fraction that is transmitted diffusely.
    pub transmitted: Vec3,
    /// Specular reflection around the mirror direction.
    pub lobe: Option<Lobe>,
}

impl Shares {
    /// A surface without gloss; reflected and transmitted light are scaled to a sum of at most 1.
    pub fn matt(reflected: Vec3, transmitted: Vec3) -> Self {
        let (reflected, transmitted) = (share(reflected), share(transmitted));
        let scale = (reflected + transmitted).max(Vec3::ONE).recip();
        Self { reflected: reflected * scale, transmitted: transmitted * scale, lobe: None }
    }

    /// A surface with the albedo `reflected` (mean over all directions), gloss included.
    pub fn glossy(reflected: Vec3, transmitted: Vec3, gloss: Gloss) -> Self {
        let whole = Self::matt(reflected, transmitted);
        let gloss = gloss.sanitized();
        if gloss.reflectance <= 0.0 {
            return whole;
        }
        let specular_albedo = gloss.specular_albedo(whole.reflected, whole.transmitted);
        let lobe = Lobe::new(specular_albedo, gloss.roughness);
        Self { reflected: whole.reflected - specular_albedo, lobe, ..whole }
    }

    /// The same with less diffuse light where the factors `before` and `behind` on it would make more light than there is.
    pub fn with_room_for(self, [before, behind]: [f32; 2]) -> Self {
        let most = self.reflected * before + self.transmitted * behind;
        let room = Vec3::ONE - self.lobe.as_ref().map_or(Vec3::ZERO, Lobe::albedo);
        let factor = (room / most.max(Vec3::splat(f32::MIN_POSITIVE))).min_element().clamp(0.0, 1.0);
        self.with_diffuse(factor)
    }

    /// The same with `factor` times the diffuse light.
    fn with_diffuse(self, factor: f32) -> Self {
        Self { reflected: self.reflected * factor, transmitted: self.transmitted * factor, ..self }
    }
}

/// A surface seen from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bsdf {
    /// Unit normal of the flat surface, on the viewer's side.
    geometric: Vec3,
    /// Unit normal for shading; within a right angle of `geometric`.
    shading: Vec3,
    /// Unit vector to the viewer.
    to_viewer: Vec3,
    shares: Shares,
    /// About what the lobe returns to the viewer, summed over the channels; 0 without one.
    gloss: f32,
    /// The tissue of a leaf with layers, which leaves the less of diffuse light the flatter it comes.
    tissue: Option<LeafView>,
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

/// `value` clamped to 0..1; NaN becomes 0.
fn share(value: Vec3) -> Vec3 {
    Vec3::select(value.cmpge(Vec3::ZERO), value, Vec3::ZERO).min(Vec3::ONE)
}

impl Bsdf {
    /// A surface of these shares, seen from the unit direction `to_viewer`. `geometric` and `shading` are unit normals
    /// of either side.
    pub fn new(geometric: Vec3, shading: Vec3, shares: Shares, to_viewer: Vec3) -> Self {
        let geometric = if geometric.dot(to_viewer) < 0.0 { -geometric } else { geometric };
        let shading = if shading.dot(geometric) < 0.0 { -shading } else { shading };
        // A viewer behind the plane of an interpolated normal sees no facets; what they would send is lost.
        let cosine = shading.dot(to_viewer);
        // What the cut behind the triangle costs of even light.
        let kept = 0.5 * (1.0 + shading.dot(geometric).min(1.0));
        let shares = if shading == geometric { shares } else { shares.with_diffuse(kept.recip()) };
        let gloss = shares.lobe.filter(|_| cosine >= 0.0).map_or(0.0, |lobe| lobe.weight(cosine));
        Self { geometric, shading, to_viewer, shares, gloss, tissue: None }
    }

    /// The same with the tissue of a leaf: `tissue` gets the cosine to the viewer, 0..=1.
    pub fn with_tissue(self, tissue: impl FnOnce(f32) -> LeafView) -> Self {
        let cosine = self.shading.dot(self.to_viewer).clamp(0.0, 1.0);
        Self { tissue: Some(tissue(cosine)), ..self }
    }

    /// The tissue, the unit normal of the flat surface on the viewer's side, and the direction to the viewer.
    pub fn tissue(&self) -> Option<(&LeafView, Vec3, Vec3)> {
        self.tissue.as_ref().map(|tissue| (tissue, self.geometric, self.to_viewer))
    }

    /// Factor of the tissue on diffuse light from the cosine `cosine`, negative from behind.
    fn tissue_factor(&self, cosine: f32) -> f32 {
        self.tissue.as_ref().map_or(1.0, |tissue| tissue.factor(cosine.abs().min(1.0), cosine < 0.0))
    }

    /// The lobe, where the viewer sees it.
    fn lobe(&self) -> Option<&Lobe> {
        self.shares.lobe.as_ref().filter(|_| self.gloss > 0.0)
    }

    /// The scattering function times the cosine for light from `direction`: what radiance per steradian counts.
    pub fn cosine_weighted(&self, direction: Vec3) -> Vec3 {
        let (flat, cosine) = (self.geometric.dot(direction), self.shading.dot(direction));
        if flat > 0.0 && cosine > 0.0 {
            let diffuse = self.shares.reflected * (self.tissue_factor(cosine) * cosine / PI);
            let gloss = |lobe: &Lobe| lobe.cosine_weighted(self.shading, self.to_viewer, direction);
            self.lobe().map_or(diffuse, |lobe| diffuse + gloss(lobe))
        } else if flat < 0.0 && cosine < 0.0 {
            self.shares.transmitted * (self.tissue_factor(cosine) * -cosine / PI)
        } else {
            Vec3::ZERO
        }
    }

    /// The probabilities that [`Self::sample`] reflects diffusely and by the lobe; the rest transmits. `None` for a
    /// black surface.
    fn probabilities(&self) -> Option<(f32, f32)> {
        let (reflected, transmitted) = (self.shares.reflected.element_sum(), self.shares.transmitted.element_sum());
        let sum = reflected + transmitted + self.gloss;
        (sum > 0.0).then(|| (reflected / sum, self.gloss / sum))
    }

    /// Probability density with which [`Self::sample`] finds `direction`, 1/sr.
    pub fn density(&self, direction: Vec3) -> f32 {
        let cosine = self.shading.dot(direction);
        let (diffuse, gloss) = self.probabilities().unwrap_or_default();
        if cosine > 0.0 {
            let lobe = |lobe: &Lobe| gloss * lobe.density(self.shading, self.to_viewer, direction);
            diffuse * cosine / PI + self.lobe().map_or(0.0, lobe)
        } else {
            (1.0 - diffuse - gloss) * -cosine / PI
        }
    }

    /// A direction by the cosine or by the lobe, `choice` in 0..1 choosing between them and the sides. `None` where the
    /// surface is black or where no light comes from the direction: between the two normals' planes, and where a facet
    /// sends it against another.
    pub fn sample(&self, choice: f32, point: Vec2) -> Option<Scattered> {
        let (diffuse, gloss) = self.probabilities()?;
        if let Some(lobe) = self.lobe().filter(|_| (diffuse..diffuse + gloss).contains(&choice)) {
            let direction = lobe.sample(self.shading, self.to_viewer, point);
            return self.mixed(direction);
        }
        let (side, probability, share) = if choice < diffuse {
            (1.0, diffuse, self.shares.reflected)
        } else {
            (-1.0, 1.0 - diffuse - gloss, self.shares.transmitted)
        };
        let direction = cosine_hemisphere(self.shading * side, point);
        let cosine = side * self.shading.dot(direction);
        if cosine <= 0.0 || side * self.geometric.dot(direction) <= 0.0 || probability <= 0.0 {
            return None;
        }
        if side > 0.0 && self.lobe().is_some() {
            return self.mixed(direction);
        }
        let weight = share * self.tissue_factor(side * cosine) / probability;
        Some(Scattered { direction, weight, density: probability * cosine / PI })
    }

    /// A direction on the viewer's side that either the cosine or the lobe may have found.
    fn mixed(&self, direction: Vec3) -> Option<Scattered> {
        let value = self.cosine_weighted(direction);
        let density = self.density(direction);
        let before = self.geometric.dot(direction) > 0.0 && self.shading.dot(direction) > 0.0;
        let weight = value / density;
        (before && weight.is_finite()).then_some(Scattered { direction, weight, density })
    }
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
    let sine_to_axis = (depth * (2.0 - depth)).max(0.0).sqrt();
    let (sine, cosine) = (TAU * point.y).sin_cos();
    let (u, v) = axis.any_orthonormal_pair();
    (u * (sine_to_axis * cosine) + v * (sine_to_axis * sine) + axis * height).normalize_or(axis)
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

    const SHINY: Gloss = Gloss { reflectance: 0.09, roughness: 0.3 };

    /// A matt leaf and a glossy one of the same colour.
    fn leaves(shading: Vec3) -> [Bsdf; 2] {
        [Gloss::MATT, SHINY].map(|gloss| {
            let shares = Shares::glossy(Vec3::new(0.5, 0.3, 0.1), Vec3::new(0.4, 0.15, 0.02), gloss);
            Bsdf::new(Vec3::Y, shading, shares, Vec3::new(0.2, 0.9, 0.1).normalize())
        })
    }

    /// An even direction of the sphere.
    fn sphere(point: Vec2) -> Vec3 {
        cone(Vec3::X, PI, point)
    }

    #[test]
    fn energy_is_conserved_whatever_the_material_says() {
        for (reflected, transmitted) in [(0.3, 0.5), (1.0, 1.0), (0.9, 0.4), (7.0, f32::NAN), (-1.0, 3.0)] {
            let shares = Shares::matt(Vec3::splat(reflected), Vec3::splat(transmitted));
            assert!((shares.reflected + shares.transmitted).max_element() <= 1.0 + 1e-6);
            assert!(shares.reflected.min_element() >= 0.0 && shares.transmitted.min_element() >= 0.0);
        }
        let whole = Shares::matt(Vec3::splat(0.4), Vec3::splat(0.5));
        assert_eq!((whole.reflected, whole.transmitted), (Vec3::splat(0.4), Vec3::splat(0.5)));
        let Shares { reflected, transmitted, .. } = Shares::matt(Vec3::ONE, Vec3::splat(0.25));
        assert!((reflected + transmitted - 1.0).abs().max_element() < 1e-6);
        assert!((transmitted / reflected - 0.25).abs().max_element() < 1e-6);
    }

    #[test]
    fn no_direction_gets_more_than_there_is() {
        for index in 0..256 {
            let mut sampler = PathSampler::new(11, 0, index);
            let (colors, gloss, view) = (sampler.pair(), sampler.pair(), sampler.pair());
            let colors = [colors, sampler.pair(), sampler.pair()].map(|pair| pair * 1.2);
            let reflected = Vec3::from(colors.map(|pair| pair.x));
            let transmitted = Vec3::from(colors.map(|pair| pair.y));
            let gloss = Gloss { reflectance: 0.1 * gloss.x, roughness: 1.1 * gloss.y };
            let shares = Shares::glossy(reflected, transmitted, gloss);
            // Every other viewer near the surface's plane.
            let height = if index % 2 == 0 { view.x } else { view.x.powi(8) };
            let level = (1.0 - height * height).sqrt();
            let bsdf = Bsdf::new(Vec3::Y, Vec3::Y, shares, Vec3::new(level, height, 0.0));
            let (mut sum, count) = (Vec3::ZERO, 1 << 14);
            for index in 0..count {
                let mut sampler = PathSampler::new(12, 0, index);
                sum += bsdf.sample(sampler.pair().x, sampler.pair()).map_or(Vec3::ZERO, |scattered| scattered.weight);
            }
            let sum = sum / count as f32;
            assert!(sum.is_finite() && sum.max_element() <= 1.02, "{shares:?} at {height}: {sum}");
        }
    }

    #[test]
    fn integral_and_samples_agree_with_the_shares() {
        for shading in [Vec3::Y, Vec3::new(0.5, 1.0, -0.3).normalize()] {
            for bsdf in leaves(shading) {
                let count = 1 << 14;
                let (mut even, mut drawn, mut densities, mut lost) = (Vec3::ZERO, Vec3::ZERO, 0.0, 0.0);
                for index in 0..count {
                    let mut sampler = PathSampler::new(1, 0, index);
                    let direction = sphere(sampler.pair());
                    even += bsdf.cosine_weighted(direction) * (4.0 * PI);
                    densities += bsdf.density(direction) * (4.0 * PI);
                    let (choice, point) = (sampler.pair().x, sampler.pair());
                    if let Some(scattered) = bsdf.sample(choice, point) {
                        drawn += scattered.weight;
                        let expected = bsdf.cosine_weighted(scattered.direction) / scattered.density;
                        assert!((expected - scattered.weight).abs().max_element() < 1e-3, "{expected}");
                        assert!((bsdf.density(scattered.direction) / scattered.density - 1.0).abs() < 1e-4);
                    } else if let Some((diffuse, gloss)) = bsdf.probabilities()
                        && (diffuse..diffuse + gloss).contains(&choice)
                    {
                        let lobe = bsdf.lobe().unwrap();
                        lost += f32::from(u8::from(lobe.sample(shading, bsdf.to_viewer, point).dot(shading) <= 0.0));
                    }
                }
                let (even, drawn) = (even / count as f32, drawn / count as f32);
                let all = bsdf.shares.reflected + bsdf.shares.transmitted;
                assert!((even - drawn).abs().max_element() < 4e-3, "{even} {drawn}");
                assert!(((densities + lost) / count as f32 - 1.0).abs() < 2e-3);
                // Between the planes of two different normals nothing is scattered: energy is lost there, never made.
                // Of a glossy leaf more comes to some viewers than in the mean, and less to others.
                let most = if bsdf.lobe().is_some() { 0.8 * SHINY.reflectance } else { 0.0 };
                assert!((drawn - all).max_element() < 2e-3 + most);
                assert!(shading != Vec3::Y || (drawn - all).min_element() > -2e-3);
                // The diffuse light makes up for it; a lobe that is cut loses something.
                let material = Shares::glossy(Vec3::new(0.5, 0.3, 0.1), Vec3::new(0.4, 0.15, 0.02), Gloss::MATT);
                let whole = material.reflected + material.transmitted;
                assert!(bsdf.lobe().is_some() || (drawn - whole).abs().max_element() < 2e-3, "{drawn} {whole}");
            }
        }
    }

    #[test]
    fn a_leaf_returns_its_colour_in_the_mean_at_every_roughness() {
        // One channel has room for the whole lobe, one for some of it, one for none.
        let (color, through) = (Vec3::new(0.15, 0.43, 0.5), Vec3::new(0.15, 0.5, 0.5));
        for tenths in 1..=10 {
            let gloss = Gloss { roughness: tenths as f32 / 10.0, ..Gloss::LEAF };
            let shares = Shares::glossy(color, through, gloss);
            let (views, count) = (64, 1 << 10);
            let mut sum = Vec3::ZERO;
            for view in 0..views {
                let height = ((view as f32 + 0.5) / views as f32).sqrt();
                let viewer = Vec3::new((1.0 - height * height).sqrt(), height, 0.0);
                let bsdf = Bsdf::new(Vec3::Y, Vec3::Y, shares, viewer);
                for index in 0..count {
                    let mut sampler = PathSampler::new(13, view, index);
                    let scattered = bsdf.sample(sampler.pair().x, sampler.pair());
                    sum += scattered.map_or(Vec3::ZERO, |scattered| scattered.weight);
                }
            }
            let found = sum / (views as u32 * count) as f32 - through;
            assert!((found / color - 1.0).abs().max_element() < 0.02, "{tenths}: {found}");
        }
    }

    #[test]
    fn the_scattering_function_is_reciprocal() {
        let waxy = Gloss { roughness: 0.1, ..SHINY };
        let downy = Gloss { roughness: 1.0, ..SHINY };
        for gloss in [Gloss::MATT, SHINY, Gloss::LEAF, waxy, downy] {
            let shares = Shares::glossy(Vec3::new(0.5, 0.3, 0.1), Vec3::splat(0.3), gloss);
            for index in 0..256 {
                let mut sampler = PathSampler::new(3, 1, index);
                let (from, to) = (sphere(sampler.pair()), sphere(sampler.pair()));
                let value = |viewer: Vec3, light: Vec3| {
                    Bsdf::new(Vec3::Y, Vec3::Y, shares, viewer).cosine_weighted(light) / light.y.abs()
                };
                let (there, back) = (value(from, to), value(to, from));
                assert!((there - back).abs().max_element() <= 1e-6 + 1e-4 * there.max_element(), "{there} {back}");
            }
        }
    }

    #[test]
    fn no_light_leaks_where_the_normals_differ() {
        let shading = Vec3::new(0.9, 0.5, 0.0).normalize();
        let shares = Shares::glossy(Vec3::splat(0.4), Vec3::splat(0.3), SHINY);
        for index in 0..4096 {
            let mut sampler = PathSampler::new(3, 1, index);
            let (viewer, light) = (sphere(sampler.pair()), sphere(sampler.pair()));
            let bsdf = Bsdf::new(Vec3::Y, shading, shares, viewer);
            let value = bsdf.cosine_weighted(light);
            assert!(value.is_finite() && value.min_element() >= 0.0);
            let (flat, round) = (light.y * bsdf.geometric.y, bsdf.shading.dot(light));
            assert!(value == Vec3::ZERO || flat * round > 0.0);
            assert!(bsdf.shading.dot(viewer) >= 0.0 || bsdf.lobe().is_none());
            if let Some(scattered) = bsdf.sample(sampler.pair().x, sampler.pair()) {
                let (flat, round) = (bsdf.geometric.dot(scattered.direction), bsdf.shading.dot(scattered.direction));
                assert!(flat * round > 0.0 && scattered.weight.is_finite() && scattered.density > 0.0);
            }
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
