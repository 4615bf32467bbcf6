//! One layer of watercolour.
//!
//! [Luft 2006, 3.1] outlines what the shader does: shape, wet-in-wet and wet-on-dry, edge darkening, paper. The equations are
//! ours. `B` is the layer's intensity under a Gaussian, `h` the height of the paper (0..1), both at one point:
//!
//! ```text
//! a  = smoothstep(θ − w, θ + w, B + k_h (h − ½))      shape: small w is wet-on-dry, large w wet-in-wet
//! e  = a (1 − smoothstep(θ, θ + b, B))                rim, where pigment gathers while the wash dries
//! ρ  = 1 + k_e e + k_g (½ − h) + k_n n                pigment: rim, granulation in the paper's valleys, flow
//! C' = mix(C, C T^ρ, a α)                             glazing: transmittances multiply
//! ```
//!
//! `shaders/style/watercolor.wgsl` is the same on the device.

use glam::Vec3;

use super::depth::smooth_step;

/// How a layer is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wash {
    /// Threshold θ of the intensity at which the shape ends, 0..1.
    pub threshold: f32,
    /// Half width w of the shape's edge in intensity. Small: wet-on-dry. Large: wet-in-wet.
    pub softness: f32,
    /// Influence k_h of the paper on the shape.
    pub paper: f32,
    /// Darkening k_e of the rim.
    pub edge: f32,
    /// Width b of the rim in intensity.
    pub edge_width: f32,
    /// Granulation k_g.
    pub granulation: f32,
    /// Influence k_n of the noise.
    pub flow: f32,
}

impl Default for Wash {
    fn default() -> Self {
        Self { threshold: 0.5, softness: 0.06, paper: 0.25, edge: 0.7, edge_width: 0.4, granulation: 0.6, flow: 0.5 }
    }
}

/// Shape and pigment at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pigment {
    /// Share of the point that the layer covers, 0..1.
    pub coverage: f32,
    /// Share of the rim, 0..1.
    pub rim: f32,
    /// Density of the pigment; 1 is the palette's own colour, never below 0.
    pub density: f32,
}

impl Wash {
    /// Shape and pigment where the intensity is `intensity`, the paper's height `height` and the noise `noise` (−1..1).
    pub fn pigment(&self, intensity: f32, height: f32, noise: f32) -> Pigment {
        let raised = intensity + self.paper * (height - 0.5);
        let coverage = smooth_step(self.threshold - self.softness, self.threshold + self.softness, raised);
        let rim = coverage * (1.0 - smooth_step(self.threshold, self.threshold + self.edge_width, intensity));
        let density = 1.0 + self.edge * rim + self.granulation * (0.5 - height) + self.flow * noise;
        Pigment { coverage, rim, density: density.max(0.0) }
    }
}

/// The colour of `under` with a layer of `transmittance` (linear, 0..1) on it.
pub fn glaze(under: Vec3, transmittance: Vec3, pigment: Pigment, alpha: f32) -> Vec3 {
    let through = transmittance.max(Vec3::splat(1e-3)).powf(pigment.density);
    under.lerp(under * through, (pigment.coverage * alpha).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: Vec3 = Vec3::new(0.4, 0.6, 0.3);

    #[test]
    fn a_shape_is_whole_inside_and_ends_at_the_threshold() {
        let wash = Wash { paper: 0.0, ..Wash::default() };
        let coverage = |intensity| wash.pigment(intensity, 0.5, 0.0).coverage;
        assert_eq!([coverage(0.0), coverage(0.43), coverage(0.57), coverage(1.0)], [0.0, 0.0, 1.0, 1.0]);
        assert!((coverage(0.5) - 0.5).abs() < 1e-4);
        // Wet-in-wet is softer at the same place.
        let wet = Wash { softness: 0.4, ..wash };
        assert!(wet.pigment(0.3, 0.5, 0.0).coverage > 0.1 && (wet.pigment(0.5, 0.5, 0.0).coverage - 0.5).abs() < 1e-4);
    }

    #[test]
    fn small_shapes_vanish() {
        // A shape whose intensity the Gaussian has spread to less than the threshold [Luft 2006, fig. 11].
        assert_eq!(Wash::default().pigment(0.2, 0.5, 0.0).coverage, 0.0);
    }

    #[test]
    fn the_rim_is_darker_than_the_middle_and_outside_there_is_none() {
        let wash = Wash { paper: 0.0, ..Wash::default() };
        let at = |intensity| wash.pigment(intensity, 0.5, 0.0);
        assert!(at(0.6).density > at(1.0).density + 0.3 && at(1.0).rim == 0.0 && at(0.3).rim == 0.0);
        let paint = |intensity| glaze(Vec3::ONE, GREEN, at(intensity), 1.0);
        assert!(paint(0.6).y < paint(1.0).y - 0.05, "{} {}", paint(0.6), paint(1.0));
        assert!((paint(1.0) - GREEN).length() < 1e-5, "one wash of pigment 1 is the palette's colour");
    }

    #[test]
    fn glazes_multiply() {
        let full = Pigment { coverage: 1.0, rim: 0.0, density: 1.0 };
        let blue = Vec3::new(0.5, 0.7, 0.9);
        let both = glaze(glaze(Vec3::ONE, GREEN, full, 1.0), blue, full, 1.0);
        assert!((both - GREEN * blue).length() < 1e-6);
        // The order does not matter, and two washes are one of twice the pigment.
        assert!((both - glaze(glaze(Vec3::ONE, blue, full, 1.0), GREEN, full, 1.0)).length() < 1e-6);
        let twice = glaze(Vec3::ONE, GREEN, Pigment { density: 2.0, ..full }, 1.0);
        assert!((twice - glaze(glaze(Vec3::ONE, GREEN, full, 1.0), GREEN, full, 1.0)).length() < 1e-6);
        // A control: the mean would be lighter.
        assert!(((GREEN + blue) * 0.5).y > both.y + 0.1);
    }

    #[test]
    fn pigment_gathers_in_the_valleys_of_the_paper() {
        let wash = Wash::default();
        assert!(wash.pigment(1.0, 0.1, 0.0).density > wash.pigment(1.0, 0.9, 0.0).density + 0.3);
        assert!(wash.pigment(1.0, 1.0, -9.0).density >= 0.0);
    }
}
