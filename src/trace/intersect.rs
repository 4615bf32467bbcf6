//! One ray, one triangle: the watertight test of S. Woop, C. Benthin & I. Wald 2013, "Watertight Ray/Triangle
//! Intersection", Journal of Computer Graphics Techniques 2(1).
//!
//! The ray is sheared onto the axis of its largest component; each edge then has a sign that both triangles at that
//! edge compute from the same two products, so that they agree.
//!
//! The distance comes from these products too. On a long thin triangle they are large against its area, and so is
//! their rounding: where it could hide on which side of the triangle the ray starts, the distance is found in f64.

use glam::Vec3;

/// A ray's shear, found once a ray.
#[derive(Clone, Copy)]
pub(super) struct Shear {
    origin: [f32; 3],
    direction: [f32; 3],
    axes: [usize; 3],
    x: f32,
    y: f32,
    z: f32,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy)]
pub(super) struct Crossing {
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

impl Shear {
    /// For a ray with a finite origin and a finite direction that is not zero.
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let [x, y, z] = direction.map(f32::abs);
        let last = if x > y && x > z { 0 } else { if y > z { 1 } else { 2 } };
        // The order of the other two keeps the orientation.
        let (first, second) = match (last, direction[last] < 0.0) {
            (0, false) => (1, 2),
            (0, true) => (2, 1),
            (1, false) => (2, 0),
            (1, true) => (0, 2),
            (_, false) => (0, 1),
            (_, true) => (1, 0),
        };
        let inverse = 1.0 / direction[last];
        Self {
            origin,
            direction,
            axes: [first, second, last],
            x: direction[first] * inverse,
            y: direction[second] * inverse,
            z: inverse,
        }
    }

    /// The crossing with the triangle of these corners at `0 < t < t_max`.
    #[inline(always)]
    pub fn cross(&self, corners: &[[f32; 3]; 3], t_max: f32) -> Option<Crossing> {
        let [kx, ky, kz] = self.axes;
        let [a, b, c] = corners;
        let (ox, oy, oz) = (self.origin[kx], self.origin[ky], self.origin[kz]);
        let (az, bz, cz) = (a[kz] - oz, b[kz] - oz, c[kz] - oz);
        let (ax, ay) = (a[kx] - ox - self.x * az, a[ky] - oy - self.y * az);
        let (bx, by) = (b[kx] - ox - self.x * bz, b[ky] - oy - self.y * bz);
        let (cx, cy) = (c[kx] - ox - self.x * cz, c[ky] - oy - self.y * cz);
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            // On an edge the products may only have rounded to equal values.
            let exact =
                |p: f32, q: f32, r: f32, s: f32| (f64::from(p) * f64::from(q) - f64::from(r) * f64::from(s)) as f32;
            u = exact(cx, by, cy, bx);
            v = exact(ax, cy, ay, cx);
            w = exact(bx, ay, by, ax);
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let mut t = (u * az + v * bz + w * cz) * (self.z * inverse);
        let products = (cx * by).abs() + (ax * cy).abs() + (bx * ay).abs();
        let rounding = 4.0 * f32::EPSILON * products * az.abs().max(bz.abs()).max(cz.abs());
        if t.abs() <= rounding * (self.z * inverse).abs() {
            t = self.distance(corners);
        }
        (t > 0.0 && t < t_max).then_some(Crossing { t, u: v * inverse, v: w * inverse })
    }

    /// Signed distance to the plane of a triangle along the ray.
    #[cold]
    fn distance(&self, corners: &[[f32; 3]; 3]) -> f32 {
        let [a, b, c] = corners.map(|corner| Vec3::from(corner).as_dvec3());
        let (origin, direction) = (Vec3::from(self.origin).as_dvec3(), Vec3::from(self.direction).as_dvec3());
        let normal = (b - a).cross(c - a);
        (normal.dot(a - origin) / normal.dot(direction)) as f32
    }
}
