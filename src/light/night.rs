//! The sky without sun and moon: airglow, the light of stars too faint to see, zodiacal light, and the stars.
//!
//! After H. W. Jensen et al. 2001, "A Physically-Based Night Sky Model" (SIGGRAPH), with the brightnesses of Leinert et
//! al. 1998, "The 1997 reference of diffuse night sky brightness" (A&A Supplement 127). These are the physical floor
//! under the model of twilight: they add up to 2.8e-4 nits at the zenith (21.5 magnitudes per square arc second, a
//! dark site) and about 1e-3 lux on the ground.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::atmosphere::{Atmosphere, haze_weight, unit};

/// Diffuse light of the night sky, nits per channel above the lower atmosphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NightSky {
    /// Airglow at the zenith; it brightens towards the horizon, as its layer at 90 km is seen at a slant (van Rhijn
    /// 1921).
    pub airglow: Vec3,
    /// Unresolved stars and diffuse galactic light, mean over the sky.
    pub starlight: Vec3,
    /// Zodiacal light away from the sun, mean over the night sky.
    pub zodiacal: Vec3,
}

impl Default for NightSky {
    /// A dark site at mean solar activity: airglow 145 S10, starlight 80 S10, zodiacal light 110 S10 (Leinert et al.
    /// 1998), 1 S10 = 8.4e-7 nits. Airglow is given the colour of its green oxygen line and the red and infrared OH
    /// bands, which dark-adapted eyes do not see; its blue share stands for the Herzberg bands. The sum is slightly
    /// bluish.
    fn default() -> Self {
        Self {
            airglow: 1.22e-4 * Vec3::new(0.62, 1.08, 1.33),
            starlight: 0.67e-4 * Vec3::new(0.90, 1.00, 1.29),
            zodiacal: 0.92e-4 * Vec3::new(0.95, 1.00, 1.15),
        }
    }
}

impl NightSky {
    /// Radiance in nits from the unit direction `view` at an observer at a height above the sea; below the
    /// horizon the ground, dimly lit by it, behind the horizon's haze. What the air scatters into the view is not
    /// integrated; to make up for it (Leinert et al. 1998, 2.2), extinction and slant are those of a zenith cosine
    /// that flattens out at 0.17, 10 degrees up, without which the horizon would be black instead of pale.
    pub fn radiance(&self, atmosphere: &Atmosphere, view: Vec3, observer_height_m: f64) -> Vec3 {
        let view = unit(view);
        let sky = self.above(atmosphere, view.y.max(0.0), observer_height_m);
        if view.y >= 0.0 {
            return sky;
        }
        let ground = atmosphere.params().ground_albedo / PI * self.horizontal_illuminance(atmosphere);
        sky.lerp(ground, haze_weight(view.y.max(-1.0).asin()))
    }

    /// Illuminance in lux of the horizontal ground at sea level.
    pub fn horizontal_illuminance(&self, atmosphere: &Atmosphere) -> Vec3 {
        const RINGS: usize = 16;
        (0..RINGS)
            .map(|ring| {
                let y = (ring as f32 + 0.5) / RINGS as f32;
                self.above(atmosphere, y, 0.0) * (y * TAU / RINGS as f32)
            })
            .sum()
    }

    fn above(&self, atmosphere: &Atmosphere, y: f32, observer_height_m: f64) -> Vec3 {
        let seen = (y * y + 0.17 * 0.17).sqrt().min(1.0);
        let sine_squared = 1.0 - seen * seen;
        let slant = 6_360.0f32 / (6_360.0 + 90.0);
        let van_rhijn = 1.0 / (1.0 - slant * slant * sine_squared).max(1e-3).sqrt();
        let through = atmosphere.transmittance(Vec3::new(sine_squared.max(0.0).sqrt(), seen, 0.0), observer_height_m);
        through * (self.airglow * van_rhijn + self.starlight + self.zodiacal)
    }
}

/// The stars that the eye sees, as a function of the direction: a cube of cells, at most one star in each.
///
/// Positions are hashed, not a catalogue's; numbers and brightnesses follow the real sky: 9,000 stars brighter than
/// magnitude 6.5, ten times fewer for each two magnitudes less (Allen 1976, section 117).
///
/// The shader's twin: `cell = (face * n + row) * n + column`; `h0..h4` are five successive values of the PCG hash
/// (Jarzynski & Olano 2020) that starts from `cell ^ seed`. A cell has a star when `h0 < density`. It stands at
/// `0.15 + 0.7 h1`, `0.15 + 0.7 h2` of the cell, so that a footprint never leaves it; its magnitude is `6.5 + 2
/// log10(h3)`, not below -1.5; its colour runs with `h4` from 3,500 K to 20,000 K.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StarField {
    /// Cells along each edge of a cube face, 8 to 1024.
    pub cells: u32,
    /// Seed of the stars' positions.
    pub seed: u32,
}

impl Default for StarField {
    fn default() -> Self {
        Self { cells: 64, seed: 1 }
    }
}

/// A star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Star {
    /// Unit vector in the frame of the star field.
    pub direction: Vec3,
    /// Illuminance above the atmosphere, lux per channel.
    pub illuminance: Vec3,
}

/// Stars in the whole sky brighter than magnitude 6.5.
const STARS: f32 = 9_000.0;
/// Lux of a star of magnitude 0 (Allen 1976, section 10).
pub const LUX_OF_MAGNITUDE_0: f32 = 2.54e-6;

impl StarField {
    /// The fraction of cells that contain a star, 0 to 1.
    pub fn density(&self) -> f32 {
        let n = self.edge() as f32;
        (STARS / (6.0 * n * n)).min(1.0)
    }

    /// The star of a cell: `face` 0 to 5 (+X, -X, +Y, -Y, +Z, -Z), `column` and `row` below [`StarField::cells`].
    /// `None` for an empty cell and for one that does not exist.
    pub fn star(&self, face: u32, column: u32, row: u32) -> Option<Star> {
        let n = self.edge();
        if face > 5 || column >= n || row >= n {
            return None;
        }
        let mut state = ((face * n + row) * n + column) ^ self.seed;
        let mut next = || {
            state = pcg(state);
            (state >> 8) as f32 / 16_777_216.0
        };
        if next() >= self.density() {
            return None;
        }
        let u = 2.0 * (column as f32 + 0.15 + 0.7 * next()) / n as f32 - 1.0;
        let v = 2.0 * (row as f32 + 0.15 + 0.7 * next()) / n as f32 - 1.0;
        let magnitude = (6.5 + 2.0 * next().max(1e-6).log10()).max(-1.5);
        let cool = Vec3::new(1.30, 0.95, 0.60);
        let hot = Vec3::new(0.75, 1.00, 1.65);
        let color = cool.lerp(hot, next());
        Some(Star {
            direction: from_cube(face, u, v),
            illuminance: color * (LUX_OF_MAGNITUDE_0 * 10f32.powf(-0.4 * magnitude)),
        })
    }

    /// Radiance in nits of the stars in a unit direction of the star field's frame, each drawn as a Gaussian footprint
    /// of the standard deviation `blur` radians (about half a pixel), which keeps each star's illuminance.
    /// `blur` is kept between 1e-5 and a twentieth of a cell.
    pub fn radiance(&self, direction: Vec3, blur: f32) -> Vec3 {
        let direction = unit(direction);
        let n = self.edge();
        let (face, u, v) = to_cube(direction);
        let cell = |t: f32| ((0.5 * (t + 1.0) * n as f32) as u32).min(n - 1);
        let Some(star) = self.star(face, cell(u), cell(v)) else { return Vec3::ZERO };
        let sigma = if blur.is_finite() { blur.clamp(1e-5, 0.05 / n as f32) } else { 1e-5 };
        let distance_squared = (direction - star.direction).length_squared();
        star.illuminance * ((-0.5 * distance_squared / (sigma * sigma)).exp() / (TAU * sigma * sigma))
    }

    fn edge(&self) -> u32 {
        self.cells.clamp(8, 1024)
    }
}

/// PCG hash of one word (Jarzynski & Olano 2020, "Hash Functions for GPU Rendering").
fn pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

fn from_cube(face: u32, u: f32, v: f32) -> Vec3 {
    unit(match face {
        0 => Vec3::new(1.0, u, v),
        1 => Vec3::new(-1.0, u, v),
        2 => Vec3::new(u, 1.0, v),
        3 => Vec3::new(u, -1.0, v),
        4 => Vec3::new(u, v, 1.0),
        _ => Vec3::new(u, v, -1.0),
    })
}

fn to_cube(d: Vec3) -> (u32, f32, f32) {
    let a = d.abs();
    if a.x >= a.y && a.x >= a.z {
        (u32::from(d.x < 0.0), d.y / a.x, d.z / a.x)
    } else if a.y >= a.z {
        (2 + u32::from(d.y < 0.0), d.x / a.y, d.z / a.y)
    } else {
        (4 + u32::from(d.z < 0.0), d.x / a.z, d.y / a.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn star_counts_and_light_are_those_of_the_sky() {
        let field = StarField::default();
        let stars: Vec<Star> = (0..6)
            .flat_map(|f| (0..64).flat_map(move |r| (0..64).map(move |c| (f, r, c))))
            .filter_map(|(f, r, c)| field.star(f, c, r))
            .collect();
        assert!((8_500..9_500).contains(&stars.len()), "{}", stars.len());
        // Brighter than magnitude 2.5: a hundredth of them.
        let limit = LUX_OF_MAGNITUDE_0 * 10f32.powf(-0.4 * 2.5);
        let bright = stars.iter().filter(|s| s.illuminance.y > limit).count();
        assert!((60..140).contains(&bright), "{bright}");
        assert_eq!(field.star(6, 0, 0), None);
        assert_eq!(field.star(0, 64, 0), None);
    }

    #[test]
    fn a_footprint_keeps_the_stars_illuminance() {
        let field = StarField::default();
        let (face, column, row) = (0..64)
            .flat_map(|r| (0..64).map(move |c| (2, c, r)))
            .find(|&(f, c, r)| field.star(f, c, r).is_some())
            .unwrap();
        let star = field.star(face, column, row).unwrap();
        let sigma = 4e-4;
        let (t, b) = star.direction.any_orthonormal_pair();
        let step = sigma / 4.0;
        let mut sum = Vec3::ZERO;
        for i in -20..=20 {
            for j in -20..=20 {
                let d = (star.direction + t * (i as f32 * step) + b * (j as f32 * step)).normalize();
                sum += field.radiance(d, sigma) * step * step;
            }
        }
        assert!((sum / star.illuminance - Vec3::ONE).abs().max_element() < 0.02, "{}", sum / star.illuminance);
    }

    #[test]
    fn cube_faces_invert() {
        for d in [Vec3::new(0.3, 0.8, -0.5), Vec3::new(-0.9, 0.1, 0.2), Vec3::new(0.1, -0.2, -0.99), Vec3::Z] {
            let (face, u, v) = to_cube(d);
            assert!((from_cube(face, u, v) - d.normalize()).length() < 1e-6);
        }
    }
}
