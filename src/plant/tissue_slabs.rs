//! Radiative transfer through the tissue of a leaf: three plane slabs that absorb and scatter, with Fresnel's reflection and
//! Snell's refraction at every interface.
//!
//! By reciprocity one solution under diffuse light has the answer for every angle: what a leaf sends towards a direction
//! under diffuse light of radiance 1 is the fraction of the light from that direction that it sends back into the
//! hemisphere.
//!
//! The radiance over the square of the index of refraction is constant along a ray in clear tissue, so a ray is named by
//! `p = n sin(angle)`, which no interface changes. Rays of `p < 1` leave the leaf; others are trapped in the slabs whose
//! index is larger than `p`. Cells of constant source along the depth, Gauss-Legendre nodes over the cosine, iterated
//! until the light that leaves is constant (discrete ordinates, [Chandrasekhar 1950]). Scattering is isotropic.
//! `benches/leaves.rs` compares it with a walk of photons.

use std::f64::consts::PI;

/// Cells in a slab.
const CELLS: usize = 14;
/// Nodes of the quadrature between two limits of total reflection.
const NODES: usize = 8;
/// Relative change of the light that leaves at which the iteration ends.
const TOLERANCE: f64 = 1e-5;
/// The most iterations.
const ITERATIONS: u32 = 3000;
/// The least cosine of a ray inside a slab.
const LEAST_COSINE: f64 = 1e-3;

/// Three slabs of tissue in air, from the lit side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slabs {
    /// Shares of the thickness; their sum is 1.
    pub shares: [f64; 3],
    /// Indices of refraction, at least 1.
    pub indices: [f64; 3],
    /// Optical depth of absorption through the leaf.
    pub absorption: f64,
    /// Optical depth of scattering through the leaf.
    pub scattering: f64,
}

/// Where the light of one direction that has entered the leaf leaves it, as fractions 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Leaving {
    /// On the side that it came from.
    pub before: f64,
    /// On the other side.
    pub behind: f64,
}

/// A ray in all slabs.
struct Node {
    /// Reflectance of the interfaces from the first to the last.
    reflectances: [f64; 4],
    /// In each slab; `None` where the ray cannot be.
    passages: [Option<Passage>; 3],
    /// Whether it leaves the leaf.
    leaves: bool,
}

/// What a cell of a slab does to a ray.
#[derive(Clone, Copy)]
struct Passage {
    /// Share of the directions in the slab; 0 for a ray that is looked at only.
    weight: f64,
    /// Transmittance.
    left: f64,
    /// Mean transmittance up to a point of the cell.
    mean: f64,
}

impl Passage {
    fn new(weight: f64, way: f64) -> Self {
        let left = (-way).exp();
        let mean = if way > 1e-4 { (1.0 - left) / way } else { 1.0 - 0.5 * way };
        Self { weight, left, mean }
    }

    /// Takes the radiance `incoming` through a cell of the given source, and adds to the mean of all directions there.
    fn cross(&self, incoming: f64, source: f64, mean: &mut f64) -> f64 {
        *mean += 0.5 * self.weight * (source + (incoming - source) * self.mean);
        source + (incoming - source) * self.left
    }
}

/// Fresnel's reflectance of unpolarised light that meets an interface at `cosine`.
fn reflectance(cosine: f64, from: f64, to: f64) -> f64 {
    let sine_squared = (from / to).powi(2) * (1.0 - cosine * cosine);
    if sine_squared >= 1.0 {
        return 1.0;
    }
    let beyond = (1.0 - sine_squared).sqrt();
    let across = (from * cosine - to * beyond) / (from * cosine + to * beyond);
    let along = (to * cosine - from * beyond) / (to * cosine + from * beyond);
    0.5 * (across * across + along * along)
}

/// The cosine of the ray `p` in a medium; 0 beyond total reflection.
fn cosine_in(index: f64, p_squared: f64) -> f64 {
    (1.0 - p_squared / (index * index)).max(0.0).sqrt()
}

/// Nodes and weights of the Gauss-Legendre quadrature over 0..1.
fn gauss_legendre() -> [(f64, f64); NODES] {
    let count = NODES as f64;
    std::array::from_fn(|i| {
        let mut x = (PI * (i as f64 + 0.75) / (count + 0.5)).cos();
        let mut slope = 1.0;
        // Newton's method doubles the digits; six steps are enough.
        for _ in 0..6 {
            let (mut last, mut value) = (1.0, x);
            for degree in 2..=NODES {
                let degree = degree as f64;
                (last, value) = (value, ((2.0 * degree - 1.0) * x * value - (degree - 1.0) * last) / degree);
            }
            slope = count * (x * value - last) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

impl Slabs {
    /// The same from the other side.
    pub fn reversed(self) -> Self {
        let turned = |[a, b, c]: [f64; 3]| [c, b, a];
        Self { shares: turned(self.shares), indices: turned(self.indices), ..self }
    }

    /// What becomes of light that comes to the first slab at these cosines, 0..=1.
    pub fn leaving<const N: usize>(&self, cosines: [f64; N]) -> [Leaving; N] {
        let mut nodes = self.nodes();
        let looked_at = nodes.len();
        nodes.extend(cosines.map(|cosine| self.node(1.0 - cosine * cosine, |_, _| Some(0.0), true)));
        let [before, behind] = [true, false].map(|lit_before| self.sent_before(&nodes, looked_at, lit_before));
        std::array::from_fn(|i| Leaving { before: before[i], behind: behind[i] })
    }

    fn node(&self, p_squared: f64, weight: impl Fn(f64, f64) -> Option<f64>, leaves: bool) -> Node {
        let index = |medium: usize| if (1..4).contains(&medium) { self.indices[medium - 1] } else { 1.0 };
        let reflectances = std::array::from_fn(|interface| {
            let (above, below) = (index(interface), index(interface + 1));
            let passes = p_squared < (above * above).min(below * below);
            if passes { reflectance(cosine_in(above, p_squared), above, below) } else { 1.0 }
        });
        let extinction = self.absorption + self.scattering;
        let passages = std::array::from_fn(|slab| {
            let cosine = cosine_in(self.indices[slab], p_squared).max(LEAST_COSINE);
            let weight = weight(self.indices[slab], cosine)?;
            Some(Passage::new(weight, extinction * self.shares[slab] / (CELLS as f64 * cosine)))
        });
        Node { reflectances, passages, leaves }
    }

    /// The nodes of the quadrature over all directions in all slabs.
    fn nodes(&self) -> Vec<Node> {
        let mut limits = vec![0.0, 1.0];
        limits.extend(self.indices);
        limits.sort_by(f64::total_cmp);
        limits.dedup();
        let rays = gauss_legendre();
        let between = |limits: &[f64]| {
            let (low, high) = (limits[0], limits[1]);
            let span = (high * high - low * low).sqrt();
            rays.map(|(x, weight)| {
                // Over t = sqrt(high² - p²), in which the cosines of all slabs are smooth: d(cosine) = t dt / (n² cosine).
                let t = span * x;
                let share =
                    |index: f64, cosine: f64| (index >= high).then(|| span * weight * t / (index * index * cosine));
                self.node(high * high - t * t, share, high <= 1.0)
            })
        };
        limits.windows(2).flat_map(between).collect()
    }

    /// Radiance that arrives from inside at the first interface along the nodes from `looked_at`, under diffuse light of
    /// radiance 1 from before or from behind.
    fn sent_before(&self, nodes: &[Node], looked_at: usize, lit_before: bool) -> Vec<f64> {
        let extinction = self.absorption + self.scattering;
        let albedo = if extinction > 0.0 { self.scattering / extinction } else { 0.0 };
        let lit = |yes: bool, node: &Node| if yes && node.leaves { 1.0 } else { 0.0 };
        let mut sources = [[0.0; CELLS]; 3];
        // Radiances that arrive at the four interfaces from above and from below.
        let mut arriving = vec![[[0.0; 2]; 4]; nodes.len()];
        for _ in 0..ITERATIONS {
            let mut means = [[0.0; CELLS]; 3];
            let mut change = 0.0f64;
            for (node, at) in nodes.iter().zip(&mut arriving) {
                let before = at[0][1];
                at[0][0] = lit(lit_before, node);
                at[3][1] = lit(!lit_before, node);
                let sent_on =
                    |interface: usize, from: f64, back: f64| from + (back - from) * node.reflectances[interface];
                let slabs = || node.passages.iter().enumerate().filter_map(|(slab, passage)| Some((slab, (*passage)?)));
                for (slab, passage) in slabs() {
                    let cells = sources[slab].iter().zip(&mut means[slab]);
                    let entering = sent_on(slab, at[slab][0], at[slab][1]);
                    at[slab + 1][0] = cells.fold(entering, |light, (source, mean)| passage.cross(light, *source, mean));
                }
                for (slab, passage) in slabs().rev() {
                    let cells = sources[slab].iter().zip(&mut means[slab]).rev();
                    let entering = sent_on(slab + 1, at[slab + 1][1], at[slab + 1][0]);
                    at[slab][1] = cells.fold(entering, |light, (source, mean)| passage.cross(light, *source, mean));
                }
                if node.leaves {
                    change = change.max((at[0][1] - before).abs() / at[0][1].max(1e-12));
                }
            }
            let next = means.map(|slab| slab.map(|mean| albedo * mean));
            let started = sources.iter().flatten().any(|source| *source > 0.0) || albedo == 0.0;
            sources = next;
            if started && change < TOLERANCE {
                break;
            }
        }
        arriving[looked_at..].iter().map(|at| at[0][1].clamp(0.0, 1.0)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSINES: [f64; 5] = [1.0, 0.7, 0.5, 0.2, 0.02];

    fn leaf(absorption: f64, scattering: f64) -> Slabs {
        Slabs { shares: [0.45, 0.4, 0.15], indices: [1.33, 1.0, 1.33], absorption, scattering }
    }

    #[test]
    fn without_absorption_all_light_leaves() {
        for slabs in [leaf(0.0, 2.0), leaf(0.0, 0.5), Slabs { indices: [1.2, 1.5, 1.0], ..leaf(0.0, 3.0) }] {
            for leaving in slabs.leaving(COSINES) {
                let all = leaving.before + leaving.behind;
                assert!((all - 1.0).abs() < 3e-3, "{slabs:?}: {all}");
            }
        }
    }

    #[test]
    fn without_scattering_and_interfaces_light_is_that_of_lambert_and_beer() {
        let clear = Slabs { indices: [1.0; 3], ..leaf(0.5, 0.0) };
        for (leaving, cosine) in clear.leaving(COSINES).into_iter().zip(COSINES) {
            assert!((leaving.behind - (-0.5 / cosine).exp()).abs() < 1e-9 && leaving.before == 0.0, "{leaving:?}");
        }
    }

    /// Chandrasekhar's H functions: a half-space of albedo ω returns 1 - sqrt(1 - ω) H(μ) of the light at μ.
    #[test]
    fn a_deep_slab_is_a_half_space() {
        let slabs = Slabs { shares: [0.1, 0.2, 0.7], indices: [1.0; 3], absorption: 10.0, scattering: 10.0 };
        // H for ω = 0.5, from its integral equation.
        for (cosine, h) in [(1.0, 1.2513), (0.5, 1.1877), (0.2, 1.1135)] {
            let [leaving] = slabs.leaving([cosine]);
            let expected = 1.0 - 0.5f64.sqrt() * h;
            assert!((leaving.before / expected - 1.0).abs() < 0.02, "{cosine}: {} {expected}", leaving.before);
        }
    }

    /// A walk of a hundred thousand photons an angle, as that of `benches/leaves.rs`.
    #[test]
    fn three_slabs_agree_with_a_walk_of_photons() {
        let at = |degrees: f64| degrees.to_radians().cos();
        let found = leaf(0.5, 4.0).leaving([0.0, 45.0, 60.0, 75.0, 85.0].map(at));
        let walk = [(0.2814, 0.0744), (0.2978, 0.0586), (0.3070, 0.0507), (0.3141, 0.0456), (0.3168, 0.0434)];
        for (leaving, (before, behind)) in found.into_iter().zip(walk) {
            assert!((leaving.before / before - 1.0).abs() < 0.01, "{leaving:?} {before}");
            assert!((leaving.behind / behind - 1.0).abs() < 0.025, "{leaving:?} {behind}");
        }
    }

    #[test]
    fn light_from_either_side_is_let_through_alike() {
        // Reciprocity: the mean over the directions is that of the other side.
        let mean = |slabs: Slabs| {
            let cosines: [f64; 32] = std::array::from_fn(|i| (i as f64 + 0.5) / 32.0);
            let entered = |cosine: f64| 1.0 - reflectance(cosine, 1.0, slabs.indices[0]);
            let leaving = slabs.leaving(cosines);
            leaving.iter().zip(cosines).map(|(leaving, c)| 2.0 * c * entered(c) * leaving.behind / 32.0).sum::<f64>()
        };
        let slabs = Slabs { indices: [1.4, 1.1, 1.25], ..leaf(0.6, 2.0) };
        let (one, other) = (mean(slabs), mean(slabs.reversed()));
        assert!((one / other - 1.0).abs() < 0.01, "{one} {other}");
    }

    #[test]
    fn strange_slabs_give_fractions() {
        for (absorption, scattering) in [(0.0, 0.0), (5.0, 0.0), (5.0, 10.0), (0.0, 10.0)] {
            for indices in [[3.0, 1.0, 3.0], [1.0, 3.0, 1.0], [1.0; 3]] {
                for shares in [[1.0, 0.0, 0.0], [0.0, 0.5, 0.5]] {
                    let slabs = Slabs { shares, indices, absorption, scattering };
                    for leaving in slabs.leaving([1.0, 0.3, 0.0]) {
                        let values = [leaving.before, leaving.behind];
                        assert!(values.iter().all(|value| (0.0..=1.0).contains(value)), "{slabs:?} {leaving:?}");
                        assert!(values.iter().sum::<f64>() <= 1.01);
                    }
                }
            }
        }
    }
}
