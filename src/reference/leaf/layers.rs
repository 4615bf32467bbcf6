//! What the layers of a leaf do to the light: its way through the tissue, and where on that way it is looked at.
//!
//! ```text
//!          viewer    light from before                 depth
//!  -----------\----------/------------------------------ 0     the entry plane
//!   layer 1     \ .    /         n = 1.33
//!  ---------------\---------------------------------------      . test points on the refracted view ray
//!   layer 2         ----.----    n = 1.00
//!  --------------------------\----------------------------
//!   layer 3                   .  n = 1.33
//!  ------------------------------\-----\----------------- 1     the plane behind (eqs. 3.1, 3.2)
//!                                        light from behind
//! ```
//!
//! At a test point the light has the way `s` through the tissue behind it and the way `t` to the viewer before it, and is
//! attenuated by `exp(-a (t + s))` (eq. 3.4), `a` being the optical depth of the leaf. The thesis's leaf has the mean over
//! the test points, weighted by the share of tissue that each stands for ([`LeafModel::Published`]).
//!
//! # Differences from the thesis
//! - This attenuation decides only how dark a texel is under perpendicular light. With the angle it falls, where that of a
//!   tissue which scatters rises, by a quarter at 60 degrees: how the light of a leaf changes with the angle follows from
//!   three slabs that scatter (`plant/tissue_slabs.rs`). Test points are where its shadow rays start.
//! - The way of the light is that of a ray which is refracted at each layer. The correction that is printed (eq. 3.5) is
//!   that for one medium; through layers of 1.33, 1 and 1.33 it is 53 % short at 80 degrees.
//! - The weights add up to 1 over all layers.
//! - The cosine in a layer is at least [`LEAST_LAYER_COSINE`]: in the spongy tissue, which refracts like air, a grazing ray
//!   would never arrive.
//!
//! [`LeafModel::Published`]: super::LeafModel::Published

use crate::plant::LeafTissue;
use crate::plant::tissue_light::LEAST_LAYER_COSINE;

/// The three layers, from the side of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layers {
    /// Shares of the thickness; their sum is 1.
    shares: [f32; 3],
    /// Squares of the inverse indices of refraction.
    inverse_squares: [f32; 3],
    /// Number of test points in each.
    points: [u8; 3],
    /// Square of the inverse index of the one medium of eq. 3.5, where that is used for the light's way.
    one_medium: Option<f32>,
}

/// A point on the way of the view ray through the leaf, in units of its thickness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TestPoint {
    /// Depth below the entry plane, 0..=1.
    pub depth: f32,
    /// Distance from the entry point along the plane, away from the viewer.
    pub lateral: f32,
}

/// One over the cosine of a ray inside a medium that has met its plane at the cosine `outside` (Snell's law): its way over
/// the depth.
fn slant(outside: f32, inverse_square: f32) -> f32 {
    (1.0 - inverse_square * (1.0 - outside * outside)).max(0.0).sqrt().max(LEAST_LAYER_COSINE).recip()
}

/// Shift along the plane over the depth of a ray whose way over the depth is `slant`.
fn slope(slant: f32) -> f32 {
    (slant * slant - 1.0).max(0.0).sqrt()
}

impl Layers {
    /// The layers of a tissue, `sanitized`, as seen from its front. `published`: with the printed way of the light and
    /// equal weights.
    pub fn new(tissue: &LeafTissue, published: bool) -> Self {
        let inverse_squares = tissue.refraction.map(|index| 1.0 / (index * index));
        Self {
            shares: tissue.layers,
            inverse_squares,
            points: tissue.test_points,
            one_medium: published.then_some(inverse_squares[0]),
        }
    }

    /// The same as seen from the other side.
    pub fn reversed(self) -> Self {
        let turned = |[a, b, c]: [f32; 3]| [c, b, a];
        let [a, b, c] = self.points;
        Self {
            shares: turned(self.shares),
            inverse_squares: turned(self.inverse_squares),
            points: [c, b, a],
            one_medium: self.one_medium,
        }
    }

    /// Ways over depths in the layers, of a view ray that meets the leaf at the cosine `outside`.
    pub fn view(&self, outside: f32) -> [f32; 3] {
        self.inverse_squares.map(|inverse_square| slant(outside, inverse_square))
    }

    /// The same for the light.
    fn light(&self, outside: f32) -> [f32; 3] {
        match self.one_medium {
            Some(inverse_square) => [slant(outside, inverse_square); 3],
            None => self.view(outside),
        }
    }

    /// Calls `each` with every test point's layer, depth in it, and weight; the weights add up to 1.
    fn for_each_point(&self, mut each: impl FnMut(usize, f32, f32)) {
        let all: u32 = self.points.iter().map(|&count| u32::from(count)).sum();
        for layer in 0..3 {
            let piece = self.shares[layer] / f32::from(self.points[layer]);
            let weight = if self.one_medium.is_some() { 1.0 / all.max(1) as f32 } else { piece };
            for index in 0..self.points[layer] {
                each(layer, piece * (f32::from(index) + 0.5), weight);
            }
        }
    }

    /// Calls `each` with every test point's layer, depth in it, and what arrives at the viewer of the light there, 0..=1: its
    /// weight times the attenuation. `view` are the view ray's ways over depths in the layers.
    fn for_each_light(
        &self,
        optical_depth: f32,
        view: [f32; 3],
        light: f32,
        behind: bool,
        mut each: impl FnMut(usize, f32, f32),
    ) {
        let light = self.light(light);
        let through = |layer: usize, slants: [f32; 3]| self.shares[layer] * slants[layer];
        let before = |layer: usize, slants: [f32; 3]| (0..layer).map(|above| through(above, slants)).sum::<f32>();
        let beyond = |layer: usize| (layer + 1..3).map(|below| through(below, light)).sum::<f32>();
        let to_viewer: [f32; 3] = std::array::from_fn(|layer| before(layer, view));
        let from_light: [f32; 3] =
            std::array::from_fn(|layer| if behind { beyond(layer) } else { before(layer, light) });
        self.for_each_point(|layer, depth, weight| {
            let rest = if behind { self.shares[layer] - depth } else { depth };
            let way = to_viewer[layer] + depth * view[layer] + from_light[layer] + rest * light[layer];
            each(layer, depth, weight * (-optical_depth * way).exp());
        });
    }

    /// Fraction of the light from the cosine `light` that is left by its way through the tissue, 0..=1.
    pub fn attenuation(&self, optical_depth: f32, view: [f32; 3], light: f32, behind: bool) -> f32 {
        let mut sum = 0.0;
        self.for_each_light(optical_depth, view, light, behind, |_, _, share| sum += share);
        sum
    }

    /// The same for a perpendicular view and perpendicular light.
    pub fn perpendicular(&self, optical_depth: f32, behind: bool) -> f32 {
        self.attenuation(optical_depth, [1.0; 3], 1.0, behind)
    }

    /// The test point that `choice`, 0..1, picks by the share of the tissue that each stands for.
    pub fn even_point(&self, view: [f32; 3], choice: f32) -> TestPoint {
        let (mut above, mut lateral) = (0.0, 0.0);
        let mut layer = 0;
        while layer < 2 && choice >= above + self.shares[layer] {
            above += self.shares[layer];
            lateral += self.shares[layer] * slope(view[layer]);
            layer += 1;
        }
        let points = f32::from(self.points[layer].max(1));
        let piece = self.shares[layer] / points;
        // Shares may add up to a little less than 1: then a layer without thickness is picked.
        let index = if piece > 0.0 { ((choice - above) / piece).floor().clamp(0.0, points - 1.0) } else { 0.0 };
        let depth = piece * (index + 0.5);
        TestPoint { depth: above + depth, lateral: lateral + depth * slope(view[layer]) }
    }

    /// The test point that `choice`, 0..1, picks; each has the probability of its share in [`Self::attenuation`].
    pub fn point(&self, optical_depth: f32, view: [f32; 3], light: f32, behind: bool, choice: f32) -> TestPoint {
        let mut left = choice * self.attenuation(optical_depth, view, light, behind);
        let mut found = TestPoint::default();
        self.for_each_light(optical_depth, view, light, behind, |layer, depth, share| {
            if left >= 0.0 && share > 0.0 {
                found = TestPoint {
                    depth: self.shares[..layer].iter().sum::<f32>() + depth,
                    lateral: (0..layer).map(|above| self.shares[above] * slope(view[above])).sum::<f32>()
                        + depth * slope(view[layer]),
                };
            }
            left -= share;
        });
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers() -> Layers {
        Layers::new(&LeafTissue::default(), false)
    }

    /// The whole way through the layers at an angle in degrees, in thicknesses, from the attenuation of light from behind
    /// seen perpendicularly at the entry.
    fn way(layers: &Layers, degrees: f32) -> f32 {
        let light = layers.light(degrees.to_radians().cos());
        (0..3).map(|layer| layers.shares[layer] * light[layer]).sum()
    }

    #[test]
    fn ways_are_those_of_refracted_rays() {
        let published = Layers::new(&LeafTissue::default(), true);
        for (degrees, layered, one) in [(0.0, 1.0, 1.0), (60.0, 1.59, 1.32), (80.0, 3.20, 1.49)] {
            assert!((way(&layers(), degrees) - layered).abs() < 0.006, "{degrees}: {}", way(&layers(), degrees));
            assert!((way(&published, degrees) - one).abs() < 0.006, "{degrees}: {}", way(&published, degrees));
        }
        // In one medium both are the same.
        let tissue = LeafTissue { refraction: [1.33; 3], ..LeafTissue::default() };
        for degrees in [0.0, 30.0, 60.0, 80.0, 90.0] {
            let (ours, printed) =
                (way(&Layers::new(&tissue, false), degrees), way(&Layers::new(&tissue, true), degrees));
            assert!((ours - printed).abs() < 1e-6);
        }
    }

    #[test]
    fn light_gets_less_the_flatter_it_comes_and_never_more() {
        for layers in [layers(), layers().reversed()] {
            for behind in [false, true] {
                for depth in [0.0, 0.05, 0.5, 3.0, 300.0, 1e30] {
                    let mut last = f32::INFINITY;
                    for step in 0..=90 {
                        let cosine = (step as f32).to_radians().cos();
                        let got = layers.attenuation(depth, layers.view(0.8), cosine, behind);
                        assert!((0.0..=1.0 + 1e-6).contains(&got) && got <= last, "{step} degrees: {got} after {last}");
                        last = got;
                    }
                }
            }
        }
    }

    #[test]
    fn view_and_light_may_be_exchanged() {
        for (a, b) in [(1.0, 0.3), (0.7, 0.05), (0.0, 0.6)] {
            let front = layers();
            let one = front.attenuation(0.7, front.view(a), b, false);
            let other = front.attenuation(0.7, front.view(b), a, false);
            assert!((one - other).abs() < 1e-6);
            // The light through the leaf is the same from either side [3.2.1].
            let back = front.reversed();
            let through = front.attenuation(0.7, front.view(a), b, true);
            let returned = back.attenuation(0.7, back.view(b), a, true);
            assert!((through - returned).abs() < 1e-6, "{through} {returned}");
        }
    }

    #[test]
    fn perpendicular_light_through_a_leaf_is_that_of_lambert_and_beer() {
        assert!((layers().perpendicular(0.5, true) - (-0.5f32).exp()).abs() < 1e-6);
        // From before: the mean over the depth, but for the number of test points.
        let tissue = LeafTissue { test_points: [8, 8, 8], ..LeafTissue::default() };
        let mean = (1.0 - (-1.0f32).exp()) / 1.0;
        assert!((Layers::new(&tissue, false).perpendicular(0.5, false) - mean).abs() < 1e-3);
        assert!((layers().perpendicular(0.5, false) - mean).abs() < 5e-3);
    }

    #[test]
    fn test_points_lie_on_the_refracted_view_ray_and_are_picked_by_their_share() {
        let front = layers();
        let view = front.view(0.5);
        let mut last = -1.0;
        let mut mean = 0.0;
        for step in 0..1000 {
            let TestPoint { depth, lateral } = front.point(0.5, view, 1.0, true, (step as f32 + 0.5) / 1000.0);
            assert!((0.0..=1.0).contains(&depth) && depth >= last && lateral >= 0.0);
            // In the first layer the ray has the angle of Snell's law.
            if depth < 0.45 {
                let sine = 0.75f32.sqrt() / 1.33;
                assert!((lateral / depth - sine / (1.0 - sine * sine).sqrt()).abs() < 1e-4);
            }
            last = depth;
            mean += depth / 1000.0;
        }
        // Without attenuation every point has the share of its tissue, as it has where the slabs decide.
        for step in 0..1000 {
            let choice = (step as f32 + 0.5) / 1000.0;
            let (one, other) = (front.even_point(view, choice), front.point(0.0, view, 1.0, true, choice));
            assert!((one.depth - other.depth).abs() < 1e-5 && (one.lateral - other.lateral).abs() < 1e-5);
        }
        // Seen perpendicularly all points of a leaf have equal light from behind: their mean depth is that of their tissue.
        let (mut even, mut picked) = (0.0, 0.0);
        front.for_each_point(|layer, depth, weight| {
            even += weight * (front.shares[..layer].iter().sum::<f32>() + depth)
        });
        for step in 0..1000 {
            picked += front.point(0.5, [1.0; 3], 1.0, true, (step as f32 + 0.5) / 1000.0).depth / 1000.0;
        }
        assert!((even - picked).abs() < 2e-3 && mean < even, "{even} {picked} {mean}");
    }

    #[test]
    fn a_layer_without_thickness_is_not_there() {
        let tissue =
            LeafTissue { layers: [1.0, 0.0, 0.0], test_points: [2, 0, 0], ..LeafTissue::default() }.sanitized();
        let layers = Layers::new(&tissue, false);
        assert!(layers.attenuation(0.5, layers.view(0.0), 0.0, true).is_finite());
        assert!((layers.perpendicular(0.5, true) - (-0.5f32).exp()).abs() < 1e-6);
        assert!(layers.point(f32::INFINITY, layers.view(0.3), 0.2, false, 0.99).depth.is_finite());
        // Shares that add up to a little less than 1 once gave NaN for the last choice.
        let short = Layers { shares: [0.99, 0.0, 0.0], ..layers };
        let TestPoint { depth, lateral } = short.even_point(short.view(0.3), 0.999);
        assert!(depth == 0.99 && lateral.is_finite());
    }
}
