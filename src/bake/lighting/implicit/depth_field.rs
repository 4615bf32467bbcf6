//! The foliage and wood around a point: the mean optical depth over all directions, as a sum of the bumps of eq. 2 of
//! [Luft 2007] over radii that double.
//!
//! An occluder of the leaf area A at the distance r hides A / (8 π r²) of the sphere on average (a leaf shows half of
//! its area to a ray), so the mean depth is the sum of that over all occluders. A single bump does not
//! behave like that: it is 0 beyond ρ and nearly constant close to its centre. But the sum of bumps with the weight A /
//! ρ² over radii that double falls off like 1 / r² between the first radius and the last (with x = r / ρ):
//!
//! ```text
//!   sum over ρ of A (1 - x²)² / (b ρ²)  ~  A / (b r² ln 2) ∫ x (1 - x²)² dx  =  A / (6 ln 2 b r²)      b = 32 π / 105
//! ```
//!
//! The doubling radii leave a ripple of 7 %.
//!
//! The slope gives the depth of a half of the sphere: ρ grad F, added up likewise, is A / r² times the direction to the
//! occluder, 16/5 as long as the value. To first order a half around n is T + 3/2 V·n deep, V being that vector in the
//! value's units. The exponential that follows weighs open directions more: by traced visibility two thirds of that are
//! right.
//!
//! The larger the radius, the fewer generators are needed: each level has an even share of them, a third of its radius
//! apart. Cost: `benches/README.md`.

use glam::Vec3;

use super::density::{DensityField, FieldSample};
use super::generators::{BUMP_VOLUME, Generator, Weighting, even_share};
use super::partition::Aabb;

/// From the sum of the bumps to the mean optical depth.
const DEPTH: f32 = 6.0 * std::f32::consts::LN_2 * BUMP_VOLUME / (8.0 * std::f32::consts::PI);
/// Share of the slope's sum that is added for the half of the sphere around a normal: two thirds of 3/2 of 5/16.
const HEMISPHERE: f32 = 0.3125;
/// Generators along a radius, at least.
const SPACINGS: f32 = 3.0;
/// Most levels; the finest ones are left out.
const MOST_LEVELS: i32 = 16;

/// The mean optical depth around any point.
#[derive(Clone, Debug, Default)]
pub struct DepthField {
    levels: Vec<DensityField>,
}

impl DepthField {
    /// The field of `occluders` for radii from `finest` metres up to what is below `extent`, the longest extent of a
    /// plant in metres. 0 everywhere where one of them is not above 0 and finite, or nothing has an area.
    pub fn new(occluders: &[Generator], finest: f32, extent: f32) -> Self {
        let usable = finest > 0.0 && extent > 0.0 && finest.is_finite() && extent.is_finite();
        let occluders: Vec<Generator> = occluders.iter().filter(|occluder| occluder.area > 0.0).copied().collect();
        if !usable || occluders.is_empty() {
            return Self::default();
        }
        let finest = finest.min(extent).max(extent * 0.5f32.powi(MOST_LEVELS));
        let size = Aabb::around(occluders.iter().map(|occluder| occluder.position)).size();
        let levels = (0..MOST_LEVELS)
            .map(|level| finest * 2.0f32.powi(level))
            .take_while(|&radius| radius < extent || radius == finest)
            .map(|radius| {
                let cells = (Vec3::from(size) * (SPACINGS / radius)).ceil().max(Vec3::ONE).element_product();
                let some = even_share(&occluders, cells / occluders.len() as f32);
                DensityField::new(&some, radius, Weighting::LeafArea)
            });
        Self { levels: levels.collect() }
    }

    /// Mean optical depth over the sphere at `points` (metres): how many leaves a ray meets, 0 or more and finite.
    pub fn depths(&self, points: &[Vec3]) -> Vec<f32> {
        self.sums::<false>(points, |_, sample, _| f64::from(sample.value))
    }

    /// Mean optical depth over the half of the sphere around each of the `normals` (unit vectors, one a point), 0 or
    /// more and finite: for wood, whose other half is itself.
    pub fn depths_above(&self, points: &[Vec3], normals: &[Vec3]) -> Vec<f32> {
        self.sums::<true>(points, |index, sample, radius| {
            let normal = normals.get(index).copied().unwrap_or(Vec3::ZERO);
            let slope = HEMISPHERE * radius * sample.gradient.dot(normal);
            f64::from(sample.value) + if slope.is_finite() { f64::from(slope) } else { 0.0 }
        })
    }

    /// Sums over all levels of what `of` makes of a point's index, the level's field there and its radius.
    fn sums<const GRADIENT: bool>(&self, points: &[Vec3], of: impl Fn(usize, FieldSample, f32) -> f64) -> Vec<f32> {
        let mut depths = vec![0.0f64; points.len()];
        let order = DensityField::order(points);
        for level in &self.levels {
            level.evaluate_in::<GRADIENT>(&order, |index, sample| {
                depths[index] += f64::from(DEPTH) * of(index, sample, level.radius());
            });
        }
        depths.into_iter().map(|depth| depth.clamp(0.0, f64::from(f32::MAX)) as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn occluder(position: Vec3, area: f32) -> Generator {
        Generator { position, area, primitives: 1.0 }
    }

    #[test]
    fn one_leaf_hides_what_its_solid_angle_says() {
        let field = DepthField::new(&[occluder(Vec3::ZERO, 0.01)], 0.05, 20.0);
        for distance in [0.25f32, 0.5, 1.0, 2.5, 4.0] {
            let at = distance * Vec3::new(0.6, 0.0, 0.8);
            let expected = 0.01 / (8.0 * std::f32::consts::PI * distance * distance);
            let depth = field.depths(&[at])[0];
            assert!((depth / expected - 1.0).abs() < 0.08, "{distance}: {depth} {expected}");
            let above = field.depths_above(&[at; 2], &[-at.normalize(), at.normalize()]);
            assert!(above[1] < 0.2 * depth && above[0] > 1.8 * depth, "towards the leaf and away: {above:?} {depth}");
        }
    }

    #[test]
    fn fewer_generators_for_large_radii_change_little() {
        let occluders: Vec<Generator> = (0..20_000u32)
            .map(|i| {
                let steps = glam::DVec3::new(0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902);
                occluder(10.0 * (f64::from(i) * steps).fract().as_vec3(), 0.02)
            })
            .collect();
        let points: Vec<Vec3> = occluders.iter().step_by(97).map(|o| o.position + 0.3).collect();
        let thinned = DepthField::new(&occluders, 0.1, 10.0).depths(&points);
        let mut full = vec![0.0; points.len()];
        for level in 0..7 {
            let field = DensityField::new(&occluders, 0.1 * 2.0f32.powi(level), Weighting::LeafArea);
            full.iter_mut().zip(field.values(&points)).for_each(|(sum, value)| *sum += DEPTH * value);
        }
        for (thinned, full) in thinned.iter().zip(full) {
            assert!((thinned / full - 1.0).abs() < 0.03, "{thinned} {full}");
        }
    }

    #[test]
    fn nothing_and_nonsense_are_empty() {
        let one = [occluder(Vec3::ZERO, 1.0)];
        for (finest, extent) in [(0.0, 1.0), (1.0, 0.0), (f32::NAN, 1.0), (1.0, f32::INFINITY), (-1.0, 1.0)] {
            assert_eq!(DepthField::new(&one, finest, extent).depths(&[Vec3::ZERO]), [0.0]);
        }
        assert_eq!(DepthField::new(&[occluder(Vec3::ZERO, 0.0)], 0.1, 1.0).depths(&[Vec3::ZERO]), [0.0]);
        for extent in [1.0e-30f32, 1.0, 1.0e30] {
            let field = DepthField::new(&[occluder(Vec3::ZERO, f32::MAX)], 1.0e-9 * extent, extent);
            let points = [Vec3::ZERO, Vec3::NAN, Vec3::MAX];
            let depths = field.depths(&points).into_iter().chain(field.depths_above(&points, &[Vec3::Y; 3]));
            assert!(depths.into_iter().all(|depth| depth.is_finite() && depth >= 0.0));
        }
        // A radius beyond the extent leaves one level.
        assert!(DepthField::new(&one, 5.0, 1.0).depths(&[Vec3::ZERO])[0] > 0.0);
    }
}
