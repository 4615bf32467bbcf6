//! Spherical harmonics: basis, projection, rotation about the vertical, irradiance.
//!
//! # The one page that fixes signs and axes
//! Real basis of Franzke 2005, eq. 2.6 to 2.10, with the phase `(-1)^m` inside the Legendre polynomials (2.8). It is
//! orthonormal on the sphere; coefficients lie at the linear index `i = l (l + 1) + m` (4.2). Franzke's polar axis is
//! our vertical: his `(x, y, z)` are our `(z, x, y)`, a rotation, so handedness stays. The polar angle is measured
//! from +Y, the azimuth `phi` from +Z (south) towards +X (east); a rotation by `yaw` as by `Quat::from_rotation_y(yaw)`
//! adds `yaw` to `phi`. For a unit vector `(x, y, z)` in world axes (+X east, +Y up, -Z north):
//!
//! ```text
//!  i   l  m   y_i(x, y, z)
//!  0   0  0    0.28209479
//!  1   1 -1   -0.48860251 x
//!  2   1  0    0.48860251 y
//!  3   1  1   -0.48860251 z
//!  4   2 -2    1.09254843 z x
//!  5   2 -1   -1.09254843 x y
//!  6   2  0    0.31539157 (3 y y - 1)
//!  7   2  1   -1.09254843 z y
//!  8   2  2    0.54627421 (z z - x x)
//! ```
//!
//! A light's coefficients are `c_i = integral of L(w) y_i(w) dw` with `L` the radiance that arrives FROM the direction
//! `w`. Radiance transfer is then the dot product of the light's and the transfer's coefficients (Franzke 2005, 2.13).
//! Diffuse irradiance is `E(n) = sum A_l c_i y_i(n)` with `A = pi, 2 pi / 3, pi / 4, 0, -pi / 24, 0`
//! (Ramamoorthi & Hanrahan 2001, eq. 8); with three bands its error for the skies of
//! this room is below 8 % (worst on the horizontal, with the sun low and the horizon bright), typically 2 %.

use std::f64::consts::PI;
use std::ops::{Add, Mul, Sub};
use std::sync::LazyLock;

use glam::{DMat3, DVec3, Vec3};

use crate::math::SphereQuadrature;

/// The largest number of bands the basis is defined for here: 36 coefficients, Franzke's largest set (2005, 4.2).
pub const MAX_BANDS: usize = 6;

/// Three bands of red, green and blue: the light of a sky. Index as in the module's page, unit that of the function.
pub type Sh9Rgb = [Vec3; 9];

const Y0: f32 = 0.282_094_79;
const Y1: f32 = 0.488_602_51;
const Y2: f32 = 1.092_548_4;
const Y20: f32 = 0.315_391_57;
const Y22: f32 = 0.546_274_2;

/// `sqrt(2) K_l^m` (or `K_l^0`) of eq. 2.6 at the index `l (l + 1) + |m|`.
static NORMALISATION: LazyLock<[f64; MAX_BANDS * MAX_BANDS]> = LazyLock::new(|| {
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    let mut table = [0.0; MAX_BANDS * MAX_BANDS];
    for l in 0..MAX_BANDS {
        for m in 0..=l {
            let k = ((2 * l + 1) as f64 * factorial(l - m) / (4.0 * PI * factorial(l + m))).sqrt();
            table[l * (l + 1) + m] = if m == 0 { k } else { k * std::f64::consts::SQRT_2 };
        }
    }
    table
});

/// The number of whole bands that `coefficients` values hold: the integer square root, at most [`MAX_BANDS`].
pub fn bands_in(coefficients: usize) -> usize {
    (coefficients.isqrt()).min(MAX_BANDS)
}

/// Writes the basis at the unit vector `direction` into `out`: `bands_in(out.len())` bands; what is left over is
/// zeroed.
pub fn basis_into(direction: Vec3, out: &mut [f32]) {
    out.fill(0.0);
    let bands = bands_in(out.len());
    let (x, y, z) = (f64::from(direction.x), f64::from(direction.y), f64::from(direction.z));
    // cos(m phi) sin^m(theta) and sin(m phi) sin^m(theta) are polynomials: no angle is ever computed, no pole is
    // singular.
    let (mut cos_m, mut sin_m) = (1.0, 0.0);
    let mut diagonal = 1.0;
    for m in 0..bands {
        let (mut p, mut previous) = (diagonal, 0.0);
        for l in m..bands {
            if l > m {
                let next = (y * (2 * l - 1) as f64 * p - if l > m + 1 { (l + m - 1) as f64 * previous } else { 0.0 })
                    / (l - m) as f64;
                (p, previous) = (next, p);
            }
            let value = NORMALISATION[l * (l + 1) + m] * p;
            out[l * (l + 1) + m] = (value * cos_m) as f32;
            if m > 0 {
                out[l * (l + 1) - m] = (value * sin_m) as f32;
            }
        }
        diagonal *= -((2 * m + 1) as f64);
        (cos_m, sin_m) = (cos_m * z - sin_m * x, cos_m * x + sin_m * z);
    }
}

/// The basis at the unit vector `direction` as an array of `C` values; `C` is 1, 4, 9, 16, 25 or 36.
pub fn basis<const C: usize>(direction: Vec3) -> [f32; C] {
    let mut out = [0.0; C];
    basis_into(direction, &mut out);
    out
}

/// Three bands at the unit vector `direction`, by the polynomials of the module's page.
pub fn basis9(direction: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = direction;
    [
        Y0,
        -Y1 * x,
        Y1 * y,
        -Y1 * z,
        Y2 * z * x,
        -Y2 * x * y,
        Y20 * (3.0 * y * y - 1.0),
        -Y2 * z * y,
        Y22 * (z * z - x * x),
    ]
}

/// Projects the function `f` of the unit direction: `out[i] = integral of f y_i` over the whole sphere by `rule`.
/// `out` takes `bands_in(out.len())` bands. Exact for functions of bands `b` when the rule's degree is `b + bands - 2`.
pub fn project<T>(rule: &SphereQuadrature, out: &mut [T], f: impl Fn(Vec3) -> T)
where
    T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
{
    out.fill(T::default());
    let mut y = [0.0; MAX_BANDS * MAX_BANDS];
    let count = bands_in(out.len()) * bands_in(out.len());
    for &(direction, solid_angle) in rule.sphere() {
        let value = f(direction) * solid_angle;
        basis_into(direction, &mut y[..count]);
        for (o, y) in out.iter_mut().zip(&y[..count]) {
            *o = *o + value * *y;
        }
    }
}

/// The value at the unit vector `direction` of the function with these coefficients (Franzke 2005, 2.12).
pub fn evaluate<T>(coefficients: &[T], direction: Vec3) -> T
where
    T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>,
{
    let mut y = [0.0; MAX_BANDS * MAX_BANDS];
    let count = bands_in(coefficients.len()) * bands_in(coefficients.len());
    basis_into(direction, &mut y[..count]);
    coefficients.iter().zip(&y[..count]).fold(T::default(), |sum, (c, y)| sum + *c * *y)
}

/// Rotates the function about +Y by `yaw` radians, exactly, at every band: afterwards
/// `f'(w) = f(R^-1 w)` with `R = Quat::from_rotation_y(yaw)`. To bring the light into the frame of a plant that
/// stands with yaw `a`, rotate the light by `-a`.
pub fn rotate_y<T>(coefficients: &mut [T], yaw: f32)
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
{
    for m in 1..bands_in(coefficients.len()) {
        let (sin, cos) = (m as f64 * f64::from(yaw)).sin_cos();
        let (sin, cos) = (sin as f32, cos as f32);
        for l in m..bands_in(coefficients.len()) {
            let (i, j) = (l * (l + 1) + m, l * (l + 1) - m);
            let (c, s) = (coefficients[i], coefficients[j]);
            coefficients[i] = c * cos - s * sin;
            coefficients[j] = c * sin + s * cos;
        }
    }
}

/// `A_l`, by which the clamped cosine scales band `l` (Ramamoorthi & Hanrahan 2001, eq. 8).
pub fn cosine_coefficient(band: usize) -> f32 {
    match band {
        0 => PI as f32,
        1 => (2.0 * PI / 3.0) as f32,
        l if l % 2 == 1 => 0.0,
        l => {
            // l! / (2^l (l/2)!^2) as a product, so that no factorial overflows.
            let ratio: f64 = (1..=l / 2).map(|k| (2 * k - 1) as f64 / (2 * k) as f64).product();
            let sign = if (l / 2) % 2 == 1 { 1.0 } else { -1.0 };
            (2.0 * PI * sign * ratio / ((l + 2) as f64 * (l as f64 - 1.0))) as f32
        }
    }
}

/// Turns coefficients of radiance into coefficients of irradiance: band `l` times `A_l`.
pub fn convolve_cosine<T: Copy + Mul<f32, Output = T>>(coefficients: &mut [T]) {
    for l in 0..bands_in(coefficients.len()) {
        let a = cosine_coefficient(l);
        for c in &mut coefficients[l * l..(l + 1) * (l + 1)] {
            *c = *c * a;
        }
    }
}

/// Irradiance (lux, when the coefficients are of nits) on a surface with the unit normal `normal`. Can be negative
/// for coefficients that did not pass through [`window_nonnegative`].
pub fn irradiance(radiance: &Sh9Rgb, normal: Vec3) -> Vec3 {
    let y = basis9(normal);
    let mut sum = radiance[0] * (y[0] * cosine_coefficient(0));
    for l in 1..3 {
        let a = cosine_coefficient(l);
        for i in l * l..(l + 1) * (l + 1) {
            sum += radiance[i] * (y[i] * a);
        }
    }
    sum
}

/// The smallest irradiance over all normals of one channel's radiance coefficients.
///
/// Irradiance of three bands is a quadratic `n.An + b.n + c` on the unit sphere. Its minimum has no duality gap
/// (trust-region subproblem, Sorensen 1982): it is the maximum over `t <= lambda_min(A)` of the concave
/// `c + t - b.(A - t)^-1 b / 4`. The maximum is found by bisection of its derivative. The value is at most 1e-5 of
/// the largest coefficient below the true minimum, and not above it but by rounding.
pub fn min_irradiance(radiance: &[f32; 9]) -> f32 {
    let mut e = [0.0; 9];
    for (l, range) in [(0, 0..1), (1, 1..4), (2, 4..9)] {
        for i in range {
            e[i] = f64::from(radiance[i]) * f64::from(cosine_coefficient(l));
        }
    }
    let [y0, y1, y2, y20, y22] = [Y0, Y1, Y2, Y20, Y22].map(f64::from);
    let (xx, yy, zz) = (-y22 * e[8], 3.0 * y20 * e[6], y22 * e[8]);
    let (xy, xz, yz) = (-0.5 * y2 * e[5], 0.5 * y2 * e[4], -0.5 * y2 * e[7]);
    let a = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
    let b = DVec3::new(-y1 * e[1], y1 * e[2], -y1 * e[3]);
    let c = y0 * e[0] - y20 * e[6];
    let lowest = smallest_eigenvalue(a);
    let scale = e.iter().fold(1e-300, |m: f64, v| m.max(v.abs()));
    let shifted = |t: f64| a - DMat3::from_diagonal(DVec3::splat(t));
    // Below the eigenvalue by enough that the inverse is accurate; what this costs is on the safe side.
    let top = lowest - 1e-5 * scale;
    let (mut low, mut high) = (top - 0.5 * b.length(), top);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if (shifted(mid).inverse() * b).length_squared() < 4.0 {
            low = mid;
        } else {
            high = mid;
        }
    }
    let t = low;
    let dual = c + t - 0.25 * b.dot(shifted(t).inverse() * b);
    if dual.is_finite() { dual as f32 } else { c as f32 }
}

/// The smallest eigenvalue of a symmetric matrix (Smith 1961).
fn smallest_eigenvalue(a: DMat3) -> f64 {
    let mean = (a.x_axis.x + a.y_axis.y + a.z_axis.z) / 3.0;
    let b = a - DMat3::from_diagonal(DVec3::splat(mean));
    let p = ((b.x_axis.length_squared() + b.y_axis.length_squared() + b.z_axis.length_squared()) / 6.0).sqrt();
    if p < 1e-300 {
        return mean;
    }
    let r = ((b * (1.0 / p)).determinant() * 0.5).clamp(-1.0, 1.0);
    mean + 2.0 * p * ((r.acos() + 2.0 * PI) / 3.0).cos()
}

/// Damps the bands of each channel until its irradiance is nowhere negative, and returns the factor `s` of each
/// channel: band `l` is scaled by `s^l`, that is, the light is blurred with a Poisson kernel (a positive kernel, so a
/// blur of light stays light). `s` is the largest in `[0, 1]` that suffices, found by bisection to 1e-4.
///
/// Loss: none (`s = 1`) for every sky that fills a hemisphere; a single direction of light, the worst case that can
/// occur, needs `s = 0.864` and so loses 14 % of its first band and 25 % of its second. The mean is kept.
/// A channel with a negative or non-finite mean is set to black, `s = 0`.
pub fn window_nonnegative(radiance: &mut Sh9Rgb) -> Vec3 {
    let mut factors = Vec3::ONE;
    for channel in 0..3 {
        let original: [f32; 9] = std::array::from_fn(|i| radiance[i][channel]);
        let scaled = |s: f32| -> [f32; 9] {
            std::array::from_fn(|i| original[i] * [1.0, s, s, s, s * s, s * s, s * s, s * s, s * s][i])
        };
        let result = if original.iter().any(|c| !c.is_finite()) || original[0] <= 0.0 {
            factors[channel] = 0.0;
            [0.0; 9]
        } else if min_irradiance(&original) >= 0.0 {
            original
        } else {
            let (mut low, mut high) = (0.0f32, 1.0f32);
            while high - low > 1e-4 {
                let mid = 0.5 * (low + high);
                if min_irradiance(&scaled(mid)) >= 0.0 {
                    low = mid;
                } else {
                    high = mid;
                }
            }
            factors[channel] = low;
            scaled(low)
        };
        for (c, value) in radiance.iter_mut().zip(result) {
            c[channel] = value;
        }
    }
    factors
}
