//! Quadrature on the sphere: Gauss-Legendre nodes in the height `y`, equally spaced azimuths.
//!
//! Each hemisphere has its own rule, so that an integrand that jumps at the horizon (sky above, ground below) is
//! integrated as exactly as a smooth one. With `n` rings per hemisphere and `k` azimuths, polynomials in the direction
//! are integrated exactly up to degree `min(2n - 1, k - 1)` (Davis & Rabinowitz 1984, 2.7).

use std::f64::consts::{PI, TAU};

use glam::Vec3;

/// Nodes and weights of the Gauss-Legendre rule with `n` nodes on `[-1, 1]`. The nodes ascend, and the weights sum to
/// 2. Found by Newton's method from Chebyshev's estimate (Davis & Rabinowitz 1984, 2.7), accurate to about 1e-15.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut rule = Vec::with_capacity(n);
    for i in (0..n).rev() {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut derivative = 1.0;
        for _ in 0..100 {
            let (mut p, mut previous) = (1.0, 0.0);
            for k in 1..=n {
                let k = k as f64;
                (p, previous) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k, p);
            }
            derivative = n as f64 * (x * p - previous) / (x * x - 1.0);
            let step = p / derivative;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        rule.push((x, 2.0 / ((1.0 - x * x) * derivative * derivative)));
    }
    rule
}

/// Directions and solid angles that integrate functions on the sphere.
#[derive(Debug, Clone)]
pub struct SphereQuadrature {
    nodes: Vec<(Vec3, f32)>,
    upper: usize,
}

impl SphereQuadrature {
    /// A rule with `rings` rings in each hemisphere (at least 1) and `azimuths` directions in each ring (at least 1).
    pub fn new(rings: usize, azimuths: usize) -> Self {
        let (rings, azimuths) = (rings.max(1), azimuths.max(1));
        let rule = gauss_legendre(rings);
        let mut nodes = Vec::with_capacity(2 * rings * azimuths);
        for sign in [1.0, -1.0] {
            for &(x, w) in &rule {
                let y = 0.5 * (x + 1.0);
                let s = (1.0 - y * y).max(0.0).sqrt();
                let solid_angle = (0.5 * w * TAU / azimuths as f64) as f32;
                for k in 0..azimuths {
                    let (sin, cos) = (TAU * (k as f64 + 0.5) / azimuths as f64).sin_cos();
                    nodes.push((Vec3::new((s * sin) as f32, (sign * y) as f32, (s * cos) as f32), solid_angle));
                }
            }
        }
        Self { upper: rings * azimuths, nodes }
    }

    /// All directions (unit vectors) with their solid angles in steradians, which sum to 4 pi.
    pub fn sphere(&self) -> &[(Vec3, f32)] {
        &self.nodes
    }

    /// The directions with `y > 0`; their solid angles sum to 2 pi.
    pub fn upper(&self) -> &[(Vec3, f32)] {
        &self.nodes[..self.upper]
    }

    /// The directions with `y < 0`; their solid angles sum to 2 pi.
    pub fn lower(&self) -> &[(Vec3, f32)] {
        &self.nodes[self.upper..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_legendre_integrates_polynomials_exactly() {
        for n in [1, 2, 5, 16, 48] {
            let rule = gauss_legendre(n);
            for degree in 0..(2 * n).min(40) {
                let got: f64 = rule.iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                let want = if degree % 2 == 0 { 2.0 / (degree as f64 + 1.0) } else { 0.0 };
                assert!((got - want).abs() < 1e-12, "n {n}, degree {degree}: {got} instead of {want}");
            }
        }
    }

    #[test]
    fn solid_angles_fill_each_hemisphere() {
        let rule = SphereQuadrature::new(7, 12);
        let sum = |nodes: &[(Vec3, f32)]| nodes.iter().map(|(_, w)| f64::from(*w)).sum::<f64>();
        assert!((sum(rule.upper()) - TAU).abs() < 1e-5);
        assert!((sum(rule.lower()) - TAU).abs() < 1e-5);
        assert!(rule.upper().iter().all(|(d, _)| d.y > 0.0) && rule.lower().iter().all(|(d, _)| d.y < 0.0));
    }
}
