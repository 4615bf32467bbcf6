//! The particles of a crown [Luft 2006, 4.2]: dabs of the brush around the foliage's surface, which are drawn into three
//! intensity maps by how they face the light.

use glam::Vec3;

use crate::math::hash::{below, unit_f32};

/// How particles are made; the defaults are published.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleSettings {
    /// Particles per square metre of the tree's height, ω_quantity.
    pub quantity: f32,
    /// Distance from the surface in roots of metres of height, ω_spread.
    pub spread: f32,
}

impl Default for ParticleSettings {
    fn default() -> Self {
        Self { quantity: 30.0, spread: 0.07 }
    }
}

/// One particle, in the plant's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Metres.
    pub position: Vec3,
    /// Unit vector: that of the surface's vertex.
    pub normal: Vec3,
}

/// Most particles of a plant.
pub const MOST_PARTICLES: usize = 1 << 20;

impl ParticleSettings {
    /// Number of particles of a tree `height` metres high: ω_quantity h² (eq. 8), 0 for what is no height.
    pub fn count(&self, height: f32) -> usize {
        // The conversion saturates, and turns NaN into 0.
        ((self.quantity * height * height).round() as usize).min(MOST_PARTICLES)
    }

    /// Particles of a tree `height` metres high whose foliage's surface has these vertices, at p = v + r̂ ω_spread √h (eq. 9);
    /// `r̂` is a random direction and v a random vertex. The same `seed`, the same particles, and the first n of them are a
    /// fair sample: a tree that is drawn with fewer drops the last ones. None without vertices.
    pub fn particles(&self, vertices: &[Vec3], normals: &[Vec3], height: f32, seed: u64) -> Vec<Particle> {
        let vertex_count = vertices.len().min(normals.len());
        if vertex_count == 0 || height.is_nan() || height <= 0.0 {
            return Vec::new();
        }
        let reach = self.spread * height.sqrt();
        let particle = |index: usize| {
            let vertex = below(seed, index as u64, 0u64, vertex_count as u32) as usize;
            let position = vertices[vertex] + reach * direction(seed, index as u64);
            Particle { position, normal: normals[vertex].normalize_or(Vec3::Y) }
        };
        (0..self.count(height)).map(particle).filter(|particle| particle.position.is_finite()).collect()
    }
}

/// A random direction, uniform on the sphere.
fn direction(seed: u64, index: u64) -> Vec3 {
    let z = 2.0 * unit_f32(seed, index, 1u64) - 1.0;
    let (sin, cos) = (std::f32::consts::TAU * unit_f32(seed, index, 2u64)).sin_cos();
    let radius = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(radius * cos, z, radius * sin)
}

/// Side of a particle in pixels at the view distance `distance` (0..1 of the far plane): (1 − d) ω_scale + ω_bias (eq. 10), for
/// pictures of 720 lines; it grows with the `lines` of others.
pub fn size_in_pixels(distance: f32, scale: f32, bias: f32, lines: f32) -> f32 {
    ((1.0 - distance.clamp(0.0, 1.0)) * scale + bias) * lines / 720.0
}

/// An intensity map of foliage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intensity {
    /// Turned away from the light.
    Dark,
    /// In between.
    Medium,
    /// Facing the light.
    Bright,
}

/// The thresholds t_0 and t_1 between the maps that [Luft 2006, 4.2] uses.
pub const PUBLISHED_THRESHOLDS: [f32; 2] = [-0.5, 0.1];

impl Intensity {
    /// The map of a particle whose normal and the light have the cosine `facing` (eq. 11).
    pub fn of(facing: f32, [dark, medium]: [f32; 2]) -> Self {
        if facing <= dark {
            Self::Dark
        } else if facing <= medium {
            Self::Medium
        } else {
            Self::Bright
        }
    }

    /// Its channel: red, green or blue.
    pub const fn channel(self) -> usize {
        self as usize
    }
}

/// Adds a particle of `visibility` (0..1) to the intensities `under` (eq. 12): additive in its own channel, at most 1, so that the
/// order does not matter and classes do not mix.
pub fn add(under: Vec3, class: Intensity, visibility: f32) -> Vec3 {
    let mut sum = under;
    sum[class.channel()] = (sum[class.channel()] + visibility.clamp(0.0, 1.0)).min(1.0);
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::style::depth;

    /// Even directions: the vertices of a ball.
    fn ball(count: usize) -> Vec<Vec3> {
        (0..count)
            .map(|i| {
                let z = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
                let (sin, cos) = (2.399_963 * i as f32).sin_cos();
                Vec3::new(cos * (1.0 - z * z).sqrt(), z, sin * (1.0 - z * z).sqrt())
            })
            .collect()
    }

    #[test]
    fn the_published_tree_has_17000_particles() {
        let count = ParticleSettings::default().count(23.8);
        assert!((16_900..17_100).contains(&count), "{count}");
        assert_eq!([f32::NAN, -0.0, 0.0].map(|height| ParticleSettings::default().count(height)), [0; 3]);
        assert_eq!(ParticleSettings::default().count(1e9), MOST_PARTICLES);
    }

    #[test]
    fn particles_lie_around_the_surface_and_face_as_it_does() {
        let vertices = ball(500);
        let settings = ParticleSettings::default();
        let particles = settings.particles(&vertices, &vertices, 4.0, 1);
        assert_eq!(particles.len(), settings.count(4.0));
        let reach = 0.07 * 2.0;
        for particle in &particles {
            assert!((particle.position - particle.normal).length() <= reach + 1e-5, "{particle:?}");
        }
        let mean = particles.iter().map(|particle| particle.position).sum::<Vec3>() / particles.len() as f32;
        assert!(mean.length() < 0.15, "{mean}");
        assert_eq!(settings.particles(&vertices, &vertices, 4.0, 1), particles);
        assert_ne!(settings.particles(&vertices, &vertices, 4.0, 2), particles);
        assert!(
            settings.particles(&[], &[], 4.0, 1).is_empty()
                && settings.particles(&vertices, &vertices, f32::NAN, 1).is_empty()
        );
        assert_eq!(settings.particles(&[Vec3::Y], &[Vec3::ZERO], 4.0, 1)[0].normal, Vec3::Y);
    }

    #[test]
    fn a_ball_has_three_caps() {
        let light = Vec3::Y;
        let normals = ball(20_000);
        let share = |class| {
            normals.iter().filter(|n| Intensity::of(n.dot(light), PUBLISHED_THRESHOLDS) == class).count() as f32
                / 20_000.0
        };
        // A cap's area is linear in its height [Archimedes].
        for (class, area) in [(Intensity::Dark, 0.25), (Intensity::Medium, 0.3), (Intensity::Bright, 0.45)] {
            assert!((share(class) - area).abs() < 0.01, "{class:?}: {}", share(class));
        }
    }

    #[test]
    fn intensities_add_up_without_order_or_crosstalk() {
        let some = [(Intensity::Dark, 0.6), (Intensity::Bright, 0.3), (Intensity::Dark, 0.7), (Intensity::Medium, 0.2)];
        let sum = |list: &mut dyn Iterator<Item = (Intensity, f32)>| {
            list.fold(Vec3::ZERO, |under, (class, visibility)| add(under, class, visibility))
        };
        let forward = sum(&mut some.into_iter());
        assert!((forward - Vec3::new(1.0, 0.2, 0.3)).length() < 1e-6);
        assert!((forward - sum(&mut some.into_iter().rev())).length() < 1e-6);
    }

    #[test]
    fn sizes_are_the_published_ones_and_scale_with_the_picture() {
        assert_eq!([0.0, 1.0, 2.0].map(|d| size_in_pixels(d, 200.0, 5.0, 720.0)), [205.0, 5.0, 5.0]);
        assert_eq!(size_in_pixels(1.0, 200.0, 5.0, 1440.0), 10.0);
    }

    /// [Luft 2006, fig. 9]: seen along its normal and along itself, the surface of a ball carries about equally much pigment under
    /// the blurred test, and not under the binary one.
    #[test]
    fn rim_and_middle_of_a_ball_carry_equal_pigment_under_the_blurred_test_only() {
        const SIDE: usize = 96;
        let vertices = ball(3000);
        let settings = ParticleSettings { quantity: 60.0, spread: 0.12 };
        let particles = settings.particles(&vertices, &vertices, 4.0, 3);
        // The viewer looks along -z; depth over the range -2..2. The Gaussian of the depth map is the particles' own size here.
        let depth_of = |z: f32| (2.0 - z) / 4.0;
        let surface = |x: f32, y: f32| depth_of((1.0 - x * x - y * y).max(0.0).sqrt());
        let pixel = |i: usize| (i as f32 + 0.5) / SIDE as f32 * 2.4 - 1.2;
        let pigment = |delta: f32| {
            let mut map = vec![Vec3::ZERO; SIDE * SIDE];
            for particle in &particles {
                let p = particle.position;
                for (index, sum) in map.iter_mut().enumerate() {
                    let (x, y) = (pixel(index % SIDE), pixel(index / SIDE));
                    if (x - p.x).powi(2) + (y - p.y).powi(2) < 0.09 * 0.09 {
                        let visible = depth::visibility(surface(x, y), depth_of(p.z), delta, delta);
                        *sum = add(*sum, Intensity::Dark, visible);
                    }
                }
            }
            let ring = |inside: f32, outside: f32| {
                let (mut sum, mut count) = (0.0, 0.0);
                for (index, value) in map.iter().enumerate() {
                    let from_axis = pixel(index % SIDE).hypot(pixel(index / SIDE));
                    if (inside..outside).contains(&from_axis) {
                        sum += value.x;
                        count += 1.0;
                    }
                }
                sum / count
            };
            (ring(0.0, 0.4), ring(0.8, 0.95))
        };
        let ((middle, rim), (binary_middle, binary_rim)) = (pigment(0.25), pigment(0.0));
        assert!((rim / middle - 1.0).abs() <= 0.2, "blurred: {middle} in the middle, {rim} at the rim");
        assert!((binary_rim / binary_middle - 1.0).abs() > 0.2, "binary: {binary_middle}, {binary_rim}");
    }
}
