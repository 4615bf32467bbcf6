//! The density field of the foliage [Luft 2007, eq. 2 and 3, after Murakami & Ichihara 1987]: the sum of the bumps of
//! all generators, and its gradient.
//!
//! ```text
//!   D(q) = (1 - (|q - p| / ρ)²)²  within ρ of p, else 0          F(q) = sum of w D(q)     (τ is taken off later)
//! ```
//!
//! Generators and points are both sorted into compact groups of eight (`partition.rs`). For a group
//! of points the tree over the generators is traversed once: boxes outside the radius are skipped, boxes wholly within
//! the radius give a polynomial (`moments.rs`), and the rest, the rim of the ball, is summed in pairs, eight points
//! side by side in vector registers (glam's, because compilers do not vectorise this loop). So the time grows with the
//! surface of the ball of influence and not with its volume: a large ρ is as cheap as a small one.
//!
//! Accuracy: pairs are f32, sums of pairs and polynomials f64. Rounding moves each 1 - (d/ρ)² by at most
//! 3e-7, which only matters where all generators within the radius are near the rim; there the point is summed again in
//! f64. The
//! relative error of F is at most 1e-5 (measured: 1e-6), whatever the plant's size and position. Points are independent
//! of each other, so the result is the same for any number of threads.

use glam::{DVec3, Vec3, Vec3A, Vec4};
use rayon::prelude::*;

use super::generators::{Generator, Weighting};
use super::moments::Moments;
use super::partition::{self, Aabb, Node};

/// Points that are evaluated side by side.
const LANES: usize = 8;
/// The registers of four that they fill.
const HALVES: usize = LANES / 4;
/// Generators of a group.
const GROUP: usize = 8;
/// Margin for rounding when squared distances are compared with the radius: skipped terms must be exactly 0, because a
/// sum of only a few generators at the very rim must be right as well.
const ROOM: f32 = 1.0 + 1.0e-6;
/// Radii and coordinates beyond this many metres (and radii below its inverse) overflow f32 somewhere.
const FARTHEST: f32 = 1.0e15;

/// The field at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FieldSample {
    /// F before τ is taken off, 0 or more.
    pub value: f32,
    /// Its gradient, 1/m: into the crown.
    pub gradient: Vec3,
}

/// Eight generators; a short group is filled up with weightless ones.
#[derive(Clone, Copy, Debug)]
struct Group {
    x: [f32; GROUP],
    y: [f32; GROUP],
    z: [f32; GROUP],
    weight: [f32; GROUP],
}

/// Generators with one radius of influence, ready to be summed.
#[derive(Clone, Debug, Default)]
pub struct DensityField {
    radius: f32,
    groups: Vec<Group>,
    nodes: Vec<Node>,
    /// Moments of each node about the centre of its box.
    moments: Vec<Moments>,
}

/// What a walk adds up for eight points.
struct Sums {
    /// Sum of w t² with t = 1 - (d/ρ)².
    value: [f64; LANES],
    /// Sum of w t, for the error.
    slope: [f64; LANES],
    /// Sum of w t (q - p), the gradient but for a factor.
    pull: [[f64; LANES]; 3],
}

impl DensityField {
    /// The field of `generators` with the radius of influence `radius` in metres. A radius that is not above 0, or
    /// NaN, gives a field that is 0 everywhere, as does an empty list; radii are clamped to 1e15 m. Generators
    /// that weigh nothing or are not finite are left out.
    pub fn new(generators: &[Generator], radius: f32, weighting: Weighting) -> Self {
        let radius = if radius > 0.0 { radius.clamp(1.0 / FARTHEST, FARTHEST) } else { 0.0 };
        let weights: Vec<f32> = generators
            .iter()
            .map(|g| if radius > 0.0 { weighting.weight(g, radius).min(1.0e30) } else { 0.0 })
            .collect();
        let points: Vec<Vec3> = generators
            .iter()
            .zip(&weights)
            .map(|(g, &weight)| {
                let near = g.position.abs().max_element() <= FARTHEST;
                if near && weight > 0.0 { g.position } else { Vec3::NAN }
            })
            .collect();
        let order = partition::compact_order(&points, GROUP);
        let nodes = partition::tree(&order, GROUP);
        let groups: Vec<Group> = order
            .chunks(GROUP)
            .map(|members| {
                let at = |i: usize| members[i.min(members.len() - 1)];
                Group {
                    x: std::array::from_fn(|i| at(i).0.x),
                    y: std::array::from_fn(|i| at(i).0.y),
                    z: std::array::from_fn(|i| at(i).0.z),
                    weight: std::array::from_fn(|i| if i < members.len() { weights[at(i).1 as usize] } else { 0.0 }),
                }
            })
            .collect();
        let moments = moments(&nodes, &groups);
        Self { radius, groups, nodes, moments }
    }

    /// The field of the same generators, with the weights that they have here, and another radius of influence.
    pub fn with_radius(&self, radius: f32) -> Self {
        let radius = if self.radius > 0.0 && radius > 0.0 { radius.clamp(1.0 / FARTHEST, FARTHEST) } else { 0.0 };
        let (groups, nodes, moments) = (self.groups.clone(), self.nodes.clone(), self.moments.clone());
        if radius > 0.0 { Self { radius, groups, nodes, moments } } else { Self::default() }
    }

    /// Radius of influence in metres; 0 for a field that is 0 everywhere.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The box around all generators with a weight.
    pub(super) fn extent(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// Bytes that the field holds.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.groups) + size_of_val(&*self.nodes) + size_of_val(&*self.moments)
    }

    /// F at `points` (metres) before τ is taken off; 0 at a point that is not finite.
    pub fn values(&self, points: &[Vec3]) -> Vec<f32> {
        let mut values = vec![0.0; points.len()];
        self.evaluate::<false>(points, |index, sample| values[index] = sample.value);
        values
    }

    /// F and its gradient at `points` (metres); 0 at a point that is not finite.
    pub fn samples(&self, points: &[Vec3]) -> Vec<FieldSample> {
        let mut samples = vec![FieldSample::default(); points.len()];
        self.evaluate::<true>(points, |index, sample| samples[index] = sample);
        samples
    }

    /// A lower and an upper bound of F in a box.
    pub(super) fn bounds(&self, region: &Aabb) -> (f32, f32) {
        let reach = self.radius * self.radius;
        let bump = |square: f32| (1.0 - square / reach).max(0.0).powi(2) as f64;
        let (mut least, mut most) = (0.0f64, 0.0f64);
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let (near, far) = node.bounds.distances_squared(region);
            // Boxes that are small against the radius need not be looked into.
            let settled = node.group != Node::INNER || far - near < 0.1 * reach;
            if near < reach && !settled {
                at += 1;
                continue;
            }
            if near < reach {
                let weight = self.moments[at].weight;
                least += weight * bump(far);
                most += weight * bump(near);
            }
            at = node.next as usize;
        }
        // Rounding of the distances, with room.
        ((least * (1.0 - 1.0e-5)) as f32, (most * (1.0 + 1.0e-5)).min(f64::from(f32::MAX)) as f32)
    }

    fn evaluate<const GRADIENT: bool>(&self, points: &[Vec3], put: impl FnMut(usize, FieldSample)) {
        if !self.groups.is_empty() {
            self.evaluate_in::<GRADIENT>(&Self::order(points), put);
        }
    }

    /// The finite ones of `points` with their indices, in the order in which they are evaluated.
    pub(super) fn order(points: &[Vec3]) -> Vec<(Vec3, u32)> {
        partition::compact_order(points, LANES)
    }

    /// Calls `put` with the index and the field of each point of `order`, a result of [`Self::order`]; the gradient
    /// is meaningless if it was not requested.
    pub(super) fn evaluate_in<const GRADIENT: bool>(
        &self,
        order: &[(Vec3, u32)],
        mut put: impl FnMut(usize, FieldSample),
    ) {
        let found: Vec<[FieldSample; LANES]> = order
            .par_chunks(LANES)
            .with_min_len(16)
            .map_init(Vec::new, |rim, members| self.eight::<GRADIENT>(members, rim))
            .collect();
        for (members, samples) in order.chunks(LANES).zip(&found) {
            for ((_, index), sample) in members.iter().zip(samples) {
                put(*index as usize, *sample);
            }
        }
    }

    /// The field at up to eight points that lie together. `rim` is scratch space.
    fn eight<const GRADIENT: bool>(&self, members: &[(Vec3, u32)], rim: &mut Vec<u32>) -> [FieldSample; LANES] {
        let lane = |i: usize| members[i.min(members.len() - 1)].0;
        let points: [[Vec4; 3]; HALVES] = std::array::from_fn(|half| {
            std::array::from_fn(|axis| Vec4::from_array(std::array::from_fn(|i| lane(4 * half + i)[axis])))
        });
        let region = Aabb::around(members.iter().map(|(point, _)| *point));
        let center = region.center();
        rim.clear();
        let inside = self.walk(&region, |group| rim.push(group));
        let sums = self.pairs::<GRADIENT>(rim, &points);

        let radius = f64::from(self.radius);
        let polynomial = inside.map(|moments| moments.polynomial(radius));
        std::array::from_fn(|i| {
            let Some((point, _)) = members.get(i) else { return FieldSample::default() };
            let pull = DVec3::new(sums.pull[0][i], sums.pull[1][i], sums.pull[2][i]);
            let (mut value, mut gradient) = (sums.value[i], -4.0 / (radius * radius) * pull);
            if let Some(polynomial) = &polynomial {
                let (v, g) = polynomial.at(point.as_dvec3() - center.as_dvec3());
                value += v;
                gradient += g;
            }
            // A pair's w t² is off by 2 w t times the rounding of t: where that is too much, the point is done again.
            const ROUNDING: f64 = 3.0e-7;
            const TOLERANCE: f64 = 4.0e-6;
            if 2.0 * ROUNDING * sums.slope[i] > TOLERANCE * value {
                (value, gradient) = self.exact(*point);
            }
            let limit = f64::from(f32::MAX);
            FieldSample {
                value: value.clamp(0.0, limit) as f32,
                gradient: gradient.clamp(DVec3::splat(-limit), DVec3::splat(limit)).as_vec3(),
            }
        })
    }

    /// Calls `at_rim` with each group at the rim of the ball around `region` and returns the moments, about the
    /// region's centre, of all generators that reach all of it.
    fn walk(&self, region: &Aabb, mut at_rim: impl FnMut(u32)) -> Option<Moments> {
        let reach = self.radius * self.radius;
        let beyond = reach * ROOM;
        let center = region.center().as_dvec3();
        let mut inside: Option<Moments> = None;
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let (near, far) = node.bounds.distances_squared(region);
            if near >= beyond {
                at = node.next as usize;
            } else if far < reach {
                let shift = node.bounds.center().as_dvec3() - center;
                inside.get_or_insert_with(Moments::zero).add_moved(&self.moments[at], shift);
                at = node.next as usize;
            } else {
                if node.group != Node::INNER {
                    at_rim(node.group);
                }
                at += 1;
            }
        }
        inside
    }

    /// Sums over the generators of the groups in `rim`.
    fn pairs<const GRADIENT: bool>(&self, rim: &[u32], points: &[[Vec4; 3]; HALVES]) -> Sums {
        /// Groups that are summed in f32 before their sum is added in f64.
        const RUN: usize = 4;
        let scale = Vec4::splat((self.radius * self.radius).recip());
        let mut sums = Sums { value: [0.0; LANES], slope: [0.0; LANES], pull: [[0.0; LANES]; 3] };
        for run in rim.chunks(RUN) {
            for (half, [qx, qy, qz]) in points.iter().enumerate() {
                let [mut value, mut slope, mut px, mut py, mut pz] = [Vec4::ZERO; 5];
                for group in run.iter().map(|&group| &self.groups[group as usize]) {
                    for k in 0..GROUP {
                        let (dx, dy, dz) = (*qx - group.x[k], *qy - group.y[k], *qz - group.z[k]);
                        let t = (Vec4::ONE - (dx * dx + dy * dy + dz * dz) * scale).max(Vec4::ZERO);
                        let wt = t * group.weight[k];
                        slope += wt;
                        value += wt * t;
                        if GRADIENT {
                            px += wt * dx;
                            py += wt * dy;
                            pz += wt * dz;
                        }
                    }
                }
                let gather = |sum: &mut [f64; LANES], part: Vec4| {
                    let sum = sum.iter_mut().skip(4 * half);
                    sum.zip(part.to_array()).for_each(|(sum, part)| *sum += f64::from(part));
                };
                gather(&mut sums.value, value);
                gather(&mut sums.slope, slope);
                if GRADIENT {
                    sums.pull.iter_mut().zip([px, py, pz]).for_each(|(sum, part)| gather(sum, part));
                }
            }
        }
        sums
    }

    /// The field at one point, in f64 throughout.
    fn exact(&self, point: Vec3) -> (f64, DVec3) {
        let (point, radius) = (point.as_dvec3(), f64::from(self.radius));
        let here = point.as_vec3().into();
        let (mut value, mut gradient) = (0.0, DVec3::ZERO);
        let inside = self.walk(&Aabb { min: here, max: here }, |group| {
            let group = &self.groups[group as usize];
            for k in 0..GROUP {
                let away = (point - DVec3::new(group.x[k].into(), group.y[k].into(), group.z[k].into())) / radius;
                let t = (1.0 - away.length_squared()).max(0.0);
                let weight = f64::from(group.weight[k]);
                value += weight * t * t;
                gradient -= 4.0 * weight * t / radius * away;
            }
        });
        if let Some(moments) = inside {
            let (v, g) = moments.polynomial(radius).at(DVec3::ZERO);
            value += v;
            gradient += g;
        }
        (value, gradient)
    }
}

/// Moments of all nodes: leaves from their generators, the others from their two children.
fn moments(nodes: &[Node], groups: &[Group]) -> Vec<Moments> {
    let mut moments = vec![Moments::zero(); nodes.len()];
    // Children follow their parents.
    for (at, node) in nodes.iter().enumerate().rev() {
        let center: Vec3A = node.bounds.center();
        let mut sum = Moments::zero();
        if node.group == Node::INNER {
            let left = at + 1;
            for child in [left, nodes[left].next as usize] {
                let shift = nodes[child].bounds.center().as_dvec3() - center.as_dvec3();
                sum.add_moved(&moments[child], shift);
            }
        } else {
            let group = &groups[node.group as usize];
            for k in 0..GROUP {
                let v = DVec3::new(group.x[k].into(), group.y[k].into(), group.z[k].into()) - center.as_dvec3();
                sum.add(v, group.weight[k].into());
            }
        }
        moments[at] = sum;
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(count: u32) -> Vec<Generator> {
        let unit = |i: u32, k: u32| {
            let x = (i.wrapping_mul(0x9e37_79b9) ^ k.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
            ((x ^ x >> 15).wrapping_mul(0x2c1b_3c6d) >> 8) as f32 / 16_777_216.0
        };
        (0..count)
            .map(|i| Generator {
                position: Vec3::new(unit(i, 1), 2.0 * unit(i, 2), unit(i, 3)),
                area: 0.001 + 0.01 * unit(i, 4),
                primitives: 1.0,
            })
            .collect()
    }

    fn brute(generators: &[Generator], q: Vec3, radius: f32) -> (f64, DVec3) {
        let r = f64::from(radius);
        generators.iter().fold((0.0, DVec3::ZERO), |(value, gradient), g| {
            let away = q.as_dvec3() - g.position.as_dvec3();
            let t = (1.0 - away.length_squared() / (r * r)).max(0.0);
            let w = f64::from(Weighting::LeafArea.weight(g, radius));
            (value + w * t * t, gradient - 4.0 * w * t / (r * r) * away)
        })
    }

    #[test]
    fn the_sum_is_that_of_brute_force_for_any_radius_size_and_place() {
        let base = cloud(1501);
        for (scale, offset) in [(1.0, 0.0), (1.0e-3, 0.0), (1.0e4, 0.0), (1.0, 1.0e6)] {
            let generators: Vec<Generator> = base
                .iter()
                .map(|g| Generator { position: g.position * scale + offset, area: g.area * scale * scale, ..*g })
                .collect();
            let points: Vec<Vec3> = cloud(300).iter().map(|g| (1.3 * g.position - 0.1) * scale + offset).collect();
            for share in [0.01, 0.1, 0.5, 1.0, 3.0, 1.0e5] {
                let radius = share * scale;
                let field = DensityField::new(&generators, radius, Weighting::LeafArea);
                let values = field.values(&points);
                for (q, (sample, value)) in points.iter().zip(field.samples(&points).iter().zip(values)) {
                    let (sum, gradient) = brute(&generators, *q, radius);
                    assert!((f64::from(value) - sum).abs() <= 1e-5 * sum, "{share} {scale}: {value} {sum}");
                    assert!((f64::from(sample.value) - sum).abs() <= 1e-5 * sum);
                    // The gradient is a difference of pulls: measured against what they would be without it.
                    let error = (sample.gradient.as_dvec3() - gradient).length();
                    assert!(
                        error <= 1e-5 * 4.0 * sum.sqrt().max(sum) / f64::from(radius) + 1e-30,
                        "{share} {scale}: {error}"
                    );
                }
            }
        }
    }

    #[test]
    fn one_generator_makes_the_published_bump() {
        let one = [Generator { position: Vec3::ONE, area: 1.0, primitives: 1.0 }];
        let field = DensityField::new(&one, 2.0, Weighting::Primitives);
        for i in 0..30 {
            let x = 0.1 * i as f32;
            let q = Vec3::ONE + x * Vec3::new(0.6, 0.0, 0.8);
            let expected = if x < 2.0 { (1.0 - (x / 2.0).powi(2)).powi(2) } else { 0.0 };
            let sample = field.samples(&[q])[0];
            assert!((sample.value - expected).abs() < 1e-5, "{x}: {} {expected}", sample.value);
            let mirrored = field.samples(&[2.0 * Vec3::ONE - q])[0];
            assert!((mirrored.value - sample.value).abs() < 1e-6);
            assert!((mirrored.gradient + sample.gradient).length() < 1e-5);
        }
    }

    #[test]
    fn nonsense_gives_zero() {
        let mut generators = cloud(50);
        generators[3].position.x = f32::NAN;
        generators[4].position.y = f32::MAX;
        generators[5].area = f32::INFINITY;
        for radius in [0.0, -1.0, f32::NAN] {
            let field = DensityField::new(&generators, radius, Weighting::LeafArea);
            assert_eq!(field.values(&[Vec3::ZERO, Vec3::NAN]), [0.0, 0.0]);
        }
        for radius in [f32::MIN_POSITIVE, 0.3, f32::MAX, f32::INFINITY] {
            let field = DensityField::new(&generators, radius, Weighting::LeafArea);
            let points = [Vec3::ZERO, Vec3::NAN, Vec3::MAX, Vec3::MIN, generators[0].position];
            let samples = field.samples(&points);
            assert!(samples.iter().all(|s| s.value.is_finite() && s.gradient.is_finite() && s.value >= 0.0));
            assert_eq!(samples[1], FieldSample::default());
        }
        assert_eq!(DensityField::new(&[], 1.0, Weighting::LeafArea).values(&[Vec3::ZERO]), [0.0]);
    }

    #[test]
    fn bounds_hold_what_lies_between() {
        let field = DensityField::new(&cloud(800), 0.25, Weighting::LeafArea);
        for corner in 0..64u32 {
            let low = Vec3::new((corner % 4) as f32, (corner / 4 % 4) as f32, (corner / 16) as f32) * 0.4 - 0.3;
            let region = Aabb { min: low.into(), max: (low + 0.1).into() };
            let (least, most) = field.bounds(&region);
            let points: Vec<Vec3> =
                (0..27).map(|i| low + 0.05 * Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32)).collect();
            assert!(field.values(&points).iter().all(|v| (least..=most).contains(v)), "{least} {most}");
        }
    }
}
