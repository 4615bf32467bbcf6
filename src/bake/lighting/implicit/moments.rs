//! The sum of many whole bumps as one polynomial.
//!
//! Inside its radius the bump of eq. 2 is a polynomial of degree 4 in the point q. So the sum over generators that
//! are *all* within reach of *all* points of a group needs no loop over them: 14 moments of the generators are kept a
//! node of the tree, moved to the group's centre, added up, and evaluated once a point. With u = q - c and v = p - c
//! in units of the radius, and a = 1 - v·v:
//!
//! ```text
//!   (1 - |u - v|²)² = a² + (u·u)² + 4 (u·v)² - 2 a u·u + 4 a u·v - 4 (u·u)(u·v)
//! ```
//!
//! This is exact, not an expansion that is cut off; sums are f64.

use glam::{DMat3, DVec3};

/// Moments of weighted generators about a centre, in metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    /// Sum of the weights.
    pub weight: f64,
    /// Sum of w v.
    pub first: DVec3,
    /// Sum of w v vᵀ.
    pub second: DMat3,
    /// Sum of w (v·v) v.
    pub third: DVec3,
    /// Sum of w (v·v)².
    pub fourth: f64,
}

impl Moments {
    pub fn zero() -> Self {
        Self { second: DMat3::ZERO, ..Self::default() }
    }

    /// Adds a generator at `v` from the centre.
    pub fn add(&mut self, v: DVec3, weight: f64) {
        let square = v.length_squared();
        self.weight += weight;
        self.first += weight * v;
        self.second += weight * outer(v, v);
        self.third += weight * square * v;
        self.fourth += weight * square * square;
    }

    /// Adds the generators of `other`, whose centre lies at `shift` from this one.
    pub fn add_moved(&mut self, other: &Self, shift: DVec3) {
        let Self { weight, first, second, third, fourth } = *other;
        let (trace, square) = (second.x_axis.x + second.y_axis.y + second.z_axis.z, shift.length_squared());
        let along = first.dot(shift);
        self.weight += weight;
        self.first += first + weight * shift;
        self.second += second + outer(first, shift) + outer(shift, first) + weight * outer(shift, shift);
        // (v + s)² (v + s) and ((v + s)²)², multiplied out.
        self.third +=
            third + trace * shift + 2.0 * (second * shift + along * shift) + square * (first + weight * shift);
        self.fourth += fourth
            + 4.0 * third.dot(shift)
            + 2.0 * square * trace
            + 4.0 * shift.dot(second * shift)
            + 4.0 * square * along
            + weight * square * square;
    }

    /// The polynomial that these generators make with the radius of influence `radius`.
    pub fn polynomial(&self, radius: f64) -> Polynomial {
        let s = radius.recip();
        let (first, second, third) = (self.first * s, self.second * (s * s), self.third * (s * s * s));
        let fourth = self.fourth * (s * s) * (s * s);
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        Polynomial {
            constant: self.weight - 2.0 * trace + fourth,
            linear: 4.0 * (first - third),
            square: -2.0 * (self.weight - trace),
            quadratic: 4.0 * second,
            cubic: -4.0 * first,
            quartic: self.weight,
            scale: s,
        }
    }
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Sum of bumps as a polynomial in the offset from the centre of its moments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polynomial {
    constant: f64,
    linear: DVec3,
    square: f64,
    quadratic: DMat3,
    cubic: DVec3,
    quartic: f64,
    scale: f64,
}

impl Polynomial {
    /// Value at `offset` metres from the centre, and gradient, 1/m.
    pub fn at(&self, offset: DVec3) -> (f64, DVec3) {
        let u = offset * self.scale;
        let square = u.length_squared();
        let (turned, along) = (self.quadratic * u, self.cubic.dot(u));
        let value =
            self.constant + self.linear.dot(u) + u.dot(turned) + square * (self.square + along + self.quartic * square);
        let gradient = self.linear
            + 2.0 * turned
            + square * self.cubic
            + 2.0 * (self.square + along + 2.0 * self.quartic * square) * u;
        (value, gradient * self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_is_the_sum_of_the_bumps_wherever_the_moments_are_moved() {
        let generators: Vec<(DVec3, f64)> = (0..20)
            .map(|i| {
                let f = f64::from(i);
                (DVec3::new((f * 1.3).sin(), (f * 2.1).cos(), (f * 0.7).sin()) * 0.4 + 3.0, 0.5 + (f * 0.9).sin().abs())
            })
            .collect();
        let (here, there, radius) = (DVec3::splat(3.1), DVec3::new(2.5, 3.4, 3.0), 2.5);
        let mut near = Moments::zero();
        generators.iter().for_each(|(p, w)| near.add(*p - here, *w));
        let mut moved = Moments::zero();
        moved.add_moved(&near, here - there);
        let polynomial = moved.polynomial(radius);
        for q in [DVec3::splat(3.0), DVec3::new(2.2, 3.3, 3.6)] {
            let (value, gradient) = polynomial.at(q - there);
            let sum = |q: DVec3| -> f64 {
                generators.iter().map(|(p, w)| w * (1.0 - (q - *p).length_squared() / (radius * radius)).powi(2)).sum()
            };
            assert!((value - sum(q)).abs() < 1e-12 * value, "{value} {}", sum(q));
            let step = 1e-5;
            for axis in 0..3 {
                let mut d = DVec3::ZERO;
                d[axis] = step;
                let slope = (sum(q + d) - sum(q - d)) / (2.0 * step);
                assert!((gradient[axis] - slope).abs() < 1e-7, "{axis}: {} {slope}", gradient[axis]);
            }
        }
    }
}
