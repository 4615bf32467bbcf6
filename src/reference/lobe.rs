//! The specular lobe of a leaf: light that its surface reflects without letting it in, around the mirror direction.
//!
//! The lobe has the form of `leaf_gloss` in `shaders/common/lighting.wgsl`, the specular term of [Franzke 2005, 4.2.2]:
//!
//! ```text
//! f = strength · F · D · V
//!   F  0.5 + 10.5 (1 - cosine to the facet)⁵, a mean of 1                    (after Schlick 1994)
//!   D  microfacets of the root mean square slope `width`                     (Walter et al. 2007, GGX)
//!   V  masking over four times the cosines                                   (Hammon 2017)
//! ```
//!
//! # Energy
//! Light that one facet sends against another is lost (single scattering), and facets of a rough leaf are seldom met at
//! the grazing angles where F is large: a lobe whose strength is the specular albedo reflects, in the mean over all
//! directions, only 0.76 of it at a width of 0.1, 0.46 at 0.4 and 0.23 at 1. The measured albedo is the whole, so the
//! strength is raised accordingly ([`lobe_gain`]), here and in the shader.
//!
//! A viewer in the surface's plane gets most: 4.7 to 1 times the strength ([`lobe_peak`]). Where that and a bright
//! leaf's diffuse light would exceed 1, a part of the specular albedo is reflected diffusely instead, channel by channel
//! ([`Gloss::specular_albedo`](crate::plant::Gloss::specular_albedo)). A green leaf, which absorbs most light, is far
//! from that limit.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use crate::plant::{lobe_gain, lobe_peak};

/// The lobe of a surface, seen from anywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lobe {
    /// Factor on the distribution.
    strength: Vec3,
    /// Root mean square slope of the facets, 0.1..=1.
    width: f32,
    /// Approximate light that a strength of 1 reflects to a viewer in front of the surface, and to one in its plane.
    before: f32,
    peak: f32,
}

impl Lobe {
    /// A lobe that reflects the fraction `specular_albedo` of the light in the mean over all directions, 0..1. `width`:
    /// 0.1..=1. `None` if the lobe reflects nothing.
    pub fn new(specular_albedo: Vec3, width: f32) -> Option<Self> {
        let (gain, peak) = (lobe_gain(width), lobe_peak(width));
        let strength = specular_albedo * gain;
        (strength.max_element() > 0.0).then_some(Self { strength, width, before: 0.75 / gain, peak })
    }

    /// The fraction of the light that the lobe reflects in the mean over all directions.
    pub fn albedo(&self) -> Vec3 {
        self.strength * (self.before / 0.75)
    }

    /// Approximate light that the lobe reflects to a viewer at the cosine `to_viewer` to the normal, summed over
    /// channels.
    pub fn weight(&self, to_viewer: f32) -> f32 {
        let grazing = (1.0 - to_viewer).clamp(0.0, 1.0).powi(5);
        self.strength.element_sum() * (self.before + (self.peak - self.before) * grazing)
    }

    /// The scattering function times the cosine to the light, around `normal`; 0 where viewer or light is behind it.
    pub fn cosine_weighted(&self, normal: Vec3, to_viewer: Vec3, to_light: Vec3) -> Vec3 {
        let (nv, nl) = (normal.dot(to_viewer), normal.dot(to_light));
        let Some((nm, lm)) = middle(normal, to_viewer, to_light).filter(|_| nv >= 0.0 && nl > 0.0) else {
            return Vec3::ZERO;
        };
        let masking = 2.0 * nl * nv * (1.0 - self.width) + (nl + nv) * self.width;
        let fresnel = 0.5 + 10.5 * (1.0 - lm).clamp(0.0, 1.0).powi(5);
        self.strength * (fresnel * self.distribution(nm) * 0.5 * nl / masking.max(f32::MIN_POSITIVE))
    }

    /// Probability density with which [`Self::sample`] draws `to_light`, 1/sr, for a viewer in front of the surface.
    pub fn density(&self, normal: Vec3, to_viewer: Vec3, to_light: Vec3) -> f32 {
        let nv = normal.dot(to_viewer).max(0.0);
        let Some((nm, _)) = middle(normal, to_viewer, to_light) else { return 0.0 };
        let squared = self.width * self.width;
        // Smith's masking of the viewer over his cosine: what facets show of themselves, where their normals mirror.
        0.5 * self.distribution(nm) / (nv + (squared + (1.0 - squared) * nv * nv).sqrt())
    }

    /// A direction mirrored at a facet that the viewer sees, drawn as in Dupuy & Benyoub 2023, "Sampling Visible GGX
    /// Normals with Spherical Caps". It may lie behind the surface, where the lobe is 0.
    pub fn sample(&self, normal: Vec3, to_viewer: Vec3, point: Vec2) -> Vec3 {
        let (u, v) = normal.any_orthonormal_pair();
        let stretch = Vec3::new(self.width, self.width, 1.0);
        let viewer = Vec3::new(to_viewer.dot(u), to_viewer.dot(v), normal.dot(to_viewer).max(0.0));
        let stretched = (viewer * stretch).normalize_or(Vec3::Z);
        let height = (1.0 - point.x) * (1.0 + stretched.z) - stretched.z;
        let level = ((1.0 - height) * (1.0 + height)).max(0.0).sqrt();
        let (sine, cosine) = (TAU * point.y).sin_cos();
        let facet = (stretched + Vec3::new(level * cosine, level * sine, height)) * stretch;
        let facet = (u * facet.x + v * facet.y + normal * facet.z).normalize_or(normal);
        (facet * (2.0 * facet.dot(to_viewer)) - to_viewer).normalize_or(normal)
    }

    /// Density of the facets' normals at the cosine `nm` to the normal, 1/sr.
    fn distribution(&self, nm: f32) -> f32 {
        let squared = self.width * self.width;
        let denominator = nm * nm * (squared - 1.0) + 1.0;
        squared * FRAC_1_PI / (denominator * denominator)
    }
}

/// Cosines of the facet that mirrors one direction to the other: to the normal, and to either direction. `None` where
/// they are opposite, so that any facet along the surface would do, and for facets that face into it.
fn middle(normal: Vec3, to_viewer: Vec3, to_light: Vec3) -> Option<(f32, f32)> {
    let between = to_viewer + to_light;
    let length = between.length();
    let nm = normal.dot(between);
    (length > 1e-4 && nm > 0.0).then(|| ((nm / length).min(1.0), 0.5 * length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::bsdf::cone;
    use crate::reference::sampler::PathSampler;

    const WIDTHS: [f32; 4] = [0.1, 0.25, 0.4, 1.0];

    fn lobe(specular_albedo: f32, width: f32) -> Lobe {
        Lobe::new(Vec3::splat(specular_albedo), width).unwrap()
    }

    fn direction(height: f32, azimuth: f32) -> Vec3 {
        let level = (1.0 - height * height).sqrt();
        Vec3::new(level * azimuth.cos(), height, level * azimuth.sin())
    }

    /// What the lobe returns of even light to a viewer at this height, from its samples.
    fn returned(lobe: &Lobe, height: f32, count: u32) -> f32 {
        let to_viewer = direction(height, 0.7);
        let one = |index| {
            let to_light = lobe.sample(Vec3::Y, to_viewer, PathSampler::new(1, 3, index).pair());
            let value = lobe.cosine_weighted(Vec3::Y, to_viewer, to_light).y;
            if value > 0.0 { value / lobe.density(Vec3::Y, to_viewer, to_light) } else { 0.0 }
        };
        (0..count).map(one).sum::<f32>() / count as f32
    }

    /// `leaf_gloss` of `shaders/common/lighting.wgsl` in f64, over pi: what it sends back of one lux where nothing else
    /// reflects.
    fn shader(normal: Vec3, to_viewer: Vec3, to_light: Vec3, specular_albedo: f64, width: f64) -> f64 {
        let (normal, viewer, light) = (normal.as_dvec3(), to_viewer.as_dvec3(), to_light.as_dvec3());
        let middle = (viewer + light).normalize();
        let fresnel = 0.5 + 10.5 * (1.0 - middle.dot(light)).clamp(0.0, 1.0).powi(5);
        let nl = normal.dot(light).clamp(0.0, 1.0);
        let nv = normal.dot(viewer).abs().max(1e-3);
        let nm = normal.dot(middle).clamp(0.0, 1.0);
        let denominator = nm * nm * (width * width - 1.0) + 1.0;
        let distribution = width * width / (denominator * denominator);
        let masking = 0.5 / ((1.0 - width) * 2.0 * nl * nv + width * (nl + nv)).max(1e-4);
        let strength = specular_albedo * f64::from(lobe_gain(width as f32));
        strength * fresnel * distribution * masking * nl / std::f64::consts::PI
    }

    /// Albedo of [`shader`], the mean over all directions, by quadrature over facets and viewers.
    fn carried(width: f64) -> f64 {
        let (viewers, around, slopes) = (48, 96, 192);
        let mut sum = 0.0;
        for (i, j, k) in (0..viewers).flat_map(|i| (0..around).flat_map(move |j| (0..slopes).map(move |k| (i, j, k)))) {
            let at = |index: i32, count: i32| (f64::from(index) + 0.5) / f64::from(count);
            let height = at(i, viewers);
            let viewer = glam::DVec3::new((1.0 - height * height).sqrt(), height, 0.0);
            // Facets distributed by D · cosine; the light that they mirror has a quarter of their density over the
            // cosine.
            let (fraction, azimuth) = (at(k, slopes), at(j, around) * std::f64::consts::TAU);
            let slope = width * (fraction / (1.0 - fraction)).sqrt();
            let facet = glam::DVec3::new(slope * azimuth.cos(), 1.0, slope * azimuth.sin()).normalize();
            let cosine = facet.dot(viewer);
            let light = facet * (2.0 * cosine) - viewer;
            if cosine <= 0.0 || light.y <= 0.0 {
                continue;
            }
            let distribution =
                width * width / (std::f64::consts::PI * (facet.y.powi(2) * (width * width - 1.0) + 1.0).powi(2));
            let density = distribution * facet.y / (4.0 * cosine);
            sum += 2.0 * height * shader(Vec3::Y, viewer.as_vec3(), light.as_vec3(), 1.0, width) / density;
        }
        sum / f64::from(viewers * around * slopes)
    }

    #[test]
    fn the_lobe_is_the_shaders() {
        for width in WIDTHS {
            let (lobe, carried) = (lobe(0.04, width), carried(width.into()));
            assert!((carried - 1.0).abs() < 0.01, "{width}: {carried}");
            for index in 0..4096 {
                let mut sampler = PathSampler::new(5, 2, index);
                let [normal, viewer, light] = [0, 1, 2].map(|_| cone(Vec3::Y, 3.1, sampler.pair()));
                // The shader has a floor of 1e-3 for the cosine to the viewer, and none behind the surface.
                if normal.dot(viewer) < 1e-3 || normal.dot(light) < 1e-3 {
                    continue;
                }
                let found = f64::from(lobe.cosine_weighted(normal, viewer, light).y);
                let expected = shader(normal, viewer, light, 0.04, width.into());
                assert!((found - expected).abs() <= 1e-4 * expected + 1e-9, "{width}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_shaders_lobe_carries_its_whole_share() {
        for width in [0.05, 0.1, 0.15, 0.25, 0.4, 0.6, 0.8, 1.0] {
            let carried = carried(width);
            let bound = if width < 0.1 { 0.05 } else { 0.01 };
            assert!((carried - 1.0).abs() < bound, "{width}: {carried}");
        }
    }

    #[test]
    fn it_is_reciprocal_and_never_without_bounds() {
        let heights = [0.0, 1e-30, 1e-7, 1e-3, 0.1, 0.5, 0.99, 1.0];
        for width in WIDTHS {
            let lobe = lobe(0.04, width);
            for (a, b) in heights.iter().flat_map(|a| heights.map(|b| (*a, b))) {
                for azimuth in [0.0, 1e-4, 1.0, std::f32::consts::PI] {
                    let (one, other) = (direction(a, 0.0), direction(b, azimuth));
                    let there = lobe.cosine_weighted(Vec3::Y, one, other);
                    let back = lobe.cosine_weighted(Vec3::Y, other, one);
                    assert!(there.is_finite() && there.min_element() >= 0.0, "{there}");
                    assert!(lobe.density(Vec3::Y, one, other).is_finite());
                    let (there, back) = (there * a, back * b);
                    assert!((there - back).abs().max_element() <= 1e-3 * there.max_element(), "{there} {back}");
                    assert!(b == 0.0 || lobe.cosine_weighted(Vec3::Y, one, -other) == Vec3::ZERO);
                    assert!(a == 0.0 || lobe.cosine_weighted(Vec3::Y, -one, other) == Vec3::ZERO);
                }
                let sampled = lobe.sample(Vec3::Y, direction(a, 2.0), Vec2::new(b.min(0.999), a.min(0.999)));
                assert!((sampled.length() - 1.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn it_carries_its_sheen_in_the_mean_and_never_more_than_there_is() {
        for width in [0.1, 0.13, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 1.0] {
            // The latter sends a tenth of the light to its brightest view.
            let (plain, tight) = (lobe(0.04, width), lobe(0.1 / (lobe_gain(width) * lobe_peak(width)), width));
            let (mut mean, count) = (0.0, 128);
            for step in 0..count {
                let height = (step as f32 + 0.5) / count as f32;
                mean += returned(&plain, height, 512) * 2.0 * height / count as f32;
            }
            assert!((mean / 0.04 - 1.0).abs() < 0.01, "{width}: {mean}");
            let most =
                [0.0, 1e-4, 0.01, 0.03].map(|height| returned(&tight, height, 4096)).into_iter().fold(0.0, f32::max);
            assert!(most <= 0.1005 && most > 0.098, "{width}: {most}");
            // What chooses between the lobe and the diffuse light is not far off.
            for height in [0.0, 0.05, 0.2, 0.5, 0.8, 1.0] {
                let ratio = plain.weight(height) / 3.0 / returned(&plain, height, 4096);
                assert!((0.7..1.4).contains(&ratio), "{width}, {height}: {ratio}");
            }
        }
        assert!(Lobe::new(Vec3::ZERO, 0.4).is_none());
    }

    #[test]
    fn directions_are_drawn_with_their_density() {
        const ROWS: usize = 8;
        const COLUMNS: usize = 16;
        for width in WIDTHS {
            for height in [0.0, 0.1, 0.6, 1.0] {
                let (lobe, to_viewer, count) = (lobe(0.04, width), direction(height, 0.3), 1 << 16);
                let bin = |direction: Vec3| {
                    let row = ((0.5 + 0.5 * direction.y) * ROWS as f32) as usize;
                    let azimuth = direction.z.atan2(direction.x) / TAU + 0.5;
                    row.min(ROWS - 1) * COLUMNS + ((azimuth * COLUMNS as f32) as usize).min(COLUMNS - 1)
                };
                let (mut drawn, mut expected) = (vec![0.0; ROWS * COLUMNS], vec![0.0; ROWS * COLUMNS]);
                for index in 0..count {
                    let mut sampler = PathSampler::new(1, 7, index);
                    drawn[bin(lobe.sample(Vec3::Y, to_viewer, sampler.pair()))] += 1.0 / count as f32;
                    let even = cone(Vec3::Y, std::f32::consts::PI, sampler.pair());
                    expected[bin(even)] += lobe.density(Vec3::Y, to_viewer, even) * 2.0 * TAU / count as f32;
                }
                let worst = drawn.iter().zip(&expected).map(|(a, b): (&f32, &f32)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 0.003, "{width}, {height}: {worst}");
                assert!((expected.iter().sum::<f32>() - 1.0).abs() < 0.005);
            }
        }
    }
}
