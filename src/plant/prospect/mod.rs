//! Leaf optics from leaf chemistry: PROSPECT-D, the generalised plate model of a leaf.
//!
//! [Féret et al. 2017, "PROSPECT-D", Remote Sensing of Environment 193]: a leaf is a pile of N plates of refractive index
//! n that absorb light [Jacquemoud & Baret 1990].
//!
//! ```text
//!  contents × specific absorption / N = k      τ(k) = (1 - k) e⁻ᵏ + k² E₁(k)      through one plate, diffuse light
//!  light within 40° ──> first plate [Allen et al. 1969; interfaces: Stern 1964, Allen 1973]
//!                        └─> diffuse light ──> N - 1 further plates, N real [Stokes 1862]
//! ```
//!
//! [`leaf_optics`] is the model at one wavelength, [`Spectra`] the published constants over wavelengths, and
//! [`Constituents::colors`] what a renderer needs: linear colours under daylight. A colour takes some 40 µs.
//!
//! Limits: directions are lost (a leaf is diffuse, with an interface that reflects light within 40° like a rough one); a
//! leaf is symmetric, so both of its faces have the same colours; needles are treated as flat.

mod spectra;

use glam::Vec3;

use crate::math::{color_matching::reflected_color, exponential_integral};

pub use spectra::{Spectra, SpectraError};

/// The cone of directions, in radians from the normal, from which light meets a leaf's first plate: 40°, which
/// [Jacquemoud & Baret 1990] fitted. The surface's roughness makes it wider than a beam.
const FIRST_PLATE_CONE: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// What a leaf is made of. Values are clamped to their ranges; NaN counts as the lowest value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constituents {
    /// Structure N: the number of plates, 1..=10. A thin compact leaf has 1 to 1.5, most leaves 1.5 to 2.5, succulent
    /// leaves and needles more. Higher: more reflected and less transmitted light.
    pub structure: f64,
    /// Chlorophyll a and b, µg/cm², 0 (none) to about 100.
    pub chlorophyll: f64,
    /// Carotenoids, µg/cm², 0 to about 30.
    pub carotenoid: f64,
    /// Anthocyanins, µg/cm², 0 to about 40: the red of autumn leaves and copper beeches.
    pub anthocyanin: f64,
    /// Brown pigments, in the model's arbitrary unit, 0 to about 8.
    pub brown: f64,
    /// Water as the thickness of its layer, cm (or g/cm²), 0 to about 0.1. Visible light hardly depends on it.
    pub water: f64,
    /// Dry matter, g/cm², 0 to about 0.05.
    pub dry_matter: f64,
}

impl Default for Constituents {
    /// The green leaf of the golden values.
    fn default() -> Self {
        Self {
            structure: 1.5,
            chlorophyll: 40.0,
            carotenoid: 8.0,
            anthocyanin: 0.0,
            brown: 0.0,
            water: 0.01,
            dry_matter: 0.008,
        }
    }
}

/// The optical constants of leaf tissue at one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpticalConstants {
    /// Wavelength, nm.
    pub wavelength: f64,
    /// Refractive index of the plates.
    pub refraction: f64,
    /// Specific absorption of chlorophyll, cm²/µg.
    pub chlorophyll: f64,
    /// Specific absorption of carotenoids, cm²/µg.
    pub carotenoid: f64,
    /// Specific absorption of anthocyanins, cm²/µg.
    pub anthocyanin: f64,
    /// Specific absorption of brown pigments, in the model's arbitrary unit.
    pub brown: f64,
    /// Specific absorption of water, 1/cm.
    pub water: f64,
    /// Specific absorption of dry matter, cm²/g.
    pub dry_matter: f64,
}

/// The fractions of the light that a leaf reflects and transmits, both 0..=1, with a sum of at most 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafOptics {
    /// Reflected into the hemisphere that the light comes from.
    pub reflectance: f64,
    /// Transmitted into the other hemisphere.
    pub transmittance: f64,
}

/// Linear colours (Rec. 709 primaries, 0..=1) of a leaf under light of 6504 K.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafSpectrumColors {
    /// Reflected.
    pub reflectance: Vec3,
    /// Transmitted.
    pub transmittance: Vec3,
}

impl Constituents {
    /// Absorption of one plate, from all constituents: the index k of the model, at least 0.
    fn absorption(&self, constants: &OpticalConstants) -> f64 {
        let sum: f64 = [
            (self.chlorophyll, constants.chlorophyll),
            (self.carotenoid, constants.carotenoid),
            (self.anthocyanin, constants.anthocyanin),
            (self.brown, constants.brown),
            (self.water, constants.water),
            (self.dry_matter, constants.dry_matter),
        ]
        .iter()
        .map(|(content, specific)| content.max(0.0) * specific.max(0.0))
        .filter(|product| product.is_finite())
        .sum();
        sum / self.plates()
    }

    fn plates(&self) -> f64 {
        if self.structure.is_nan() { 1.0 } else { self.structure.clamp(1.0, 10.0) }
    }

    /// The leaf's colours, from all rows of `spectra` within 380 to 780 nm.
    pub fn colors(&self, spectra: &Spectra) -> LeafSpectrumColors {
        let seen: Vec<_> = spectra
            .rows()
            .iter()
            .filter(|row| (380.0..=780.0).contains(&row.wavelength))
            .map(|row| (row.wavelength, leaf_optics(self, row)))
            .collect();
        LeafSpectrumColors {
            reflectance: reflected_color(seen.iter().map(|(wavelength, leaf)| (*wavelength, leaf.reflectance))),
            transmittance: reflected_color(seen.iter().map(|(wavelength, leaf)| (*wavelength, leaf.transmittance))),
        }
    }
}

/// Reflectance and transmittance of a leaf at the wavelength of `constants`.
pub fn leaf_optics(constituents: &Constituents, constants: &OpticalConstants) -> LeafOptics {
    // No leaf has another index; at 1 there would be no interface, and the formulas divide by it.
    let n = if constants.refraction.is_nan() { 1.4 } else { constants.refraction.clamp(1.01, 3.0) };
    let inside = plate_transmission(constituents.absorption(constants));
    // Into the plate from a cone and from everywhere; out of it, with total reflection.
    let (from_cone, from_all) =
        (interface_transmissivity(n, FIRST_PLATE_CONE), interface_transmissivity(n, std::f64::consts::FRAC_PI_2));
    let out = from_all / (n * n);
    let back = 1.0 - out;
    // One plate, with all reflections between its faces.
    let plate = |enters: f64| {
        let transmitted = enters * inside * out / (1.0 - (back * inside).powi(2));
        (1.0 - enters + back * inside * transmitted, transmitted)
    };
    let (first_r, first_t) = plate(from_cone);
    let (r, t) = plate(from_all);
    let (below_r, below_t) = pile(r, t, constituents.plates() - 1.0);
    let between = 1.0 - below_r * r;
    let reflectance = (first_r + first_t * below_r * t / between).clamp(0.0, 1.0);
    let transmittance = (first_t * below_t / between).clamp(0.0, 1.0 - reflectance);
    LeafOptics { reflectance, transmittance }
}

/// Fraction of diffuse light that passes a plate with the absorption `k` (at least 0): [Allen et al. 1969].
fn plate_transmission(k: f64) -> f64 {
    if k <= 0.0 {
        return 1.0;
    }
    if k > 700.0 {
        return 0.0;
    }
    ((1.0 - k) * (-k).exp() + k * k * exponential_integral(k)).clamp(0.0, 1.0)
}

/// Fraction of the light from a cone with the half angle `cone` (radians, above 0, at most π/2) that enters a medium of
/// the index `n` > 1 through a smooth interface, the mean over both polarisations: [Stern 1964], [Allen 1973].
fn interface_transmissivity(n: f64, cone: f64) -> f64 {
    let n2 = n * n;
    let (above, below) = (n2 + 1.0, n2 - 1.0);
    let sin2 = cone.sin().powi(2);
    let a = 0.5 * (n + 1.0).powi(2);
    let k = -0.25 * below * below;
    let root = ((sin2 - 0.5 * above).powi(2) + k).max(0.0).sqrt();
    let b = root - (sin2 - 0.5 * above);
    let s_part = |x: f64| k * k / (6.0 * x.powi(3)) + k / x - 0.5 * x;
    let s = s_part(b) - s_part(a);
    let (in_a, in_b) = (2.0 * above * a - below * below, 2.0 * above * b - below * below);
    let p = -2.0 * n2 * (b - a) / above.powi(2) - 2.0 * n2 * above * (b / a).ln() / below.powi(2)
        + 0.5 * n2 * (1.0 / b - 1.0 / a)
        + 16.0 * n2 * n2 * (n2 * n2 + 1.0) * (in_b / in_a).ln() / (above.powi(3) * below.powi(2))
        + 16.0 * n2.powi(3) * (1.0 / in_b - 1.0 / in_a) / above.powi(3);
    (0.5 * (s + p) / sin2).clamp(0.0, 1.0)
}

/// Reflectance and transmittance of `count` plates (real, at least 0), each with `r` (above 0) and `t`: [Stokes 1862].
/// Written with the inverse of the published b, which stays finite for black plates.
fn pile(r: f64, t: f64, count: f64) -> (f64, f64) {
    if r + t > 1.0 - 1e-12 {
        // Nothing is absorbed: the limit.
        let through = t / (t + (1.0 - t) * count);
        return (1.0 - through, through);
    }
    let root = ((1.0 + r + t) * (1.0 + r - t) * (1.0 - r + t) * (1.0 - r - t)).max(0.0).sqrt();
    let a = (1.0 + r * r - t * t + root) / (2.0 * r);
    let c = (2.0 * t / (1.0 - r * r + t * t + root)).powf(count);
    let below = a * a - c * c;
    (a * (1.0 - c * c) / below, c * (a * a - 1.0) / below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::LeafKind;

    fn at(wavelength: f64) -> OpticalConstants {
        *Spectra::visible().rows().iter().find(|row| row.wavelength == wavelength).unwrap()
    }

    #[test]
    fn a_green_leaf_has_the_published_values() {
        for (wavelength, reflectance, transmittance) in
            [(450.0, 0.0413, 0.0014), (550.0, 0.1518, 0.1510), (670.0, 0.0364, 0.0061), (800.0, 0.4467, 0.4789)]
        {
            let got = leaf_optics(&Constituents::default(), &at(wavelength));
            assert!((got.reflectance - reflectance).abs() < 1e-4, "{wavelength}: {got:?}");
            assert!((got.transmittance - transmittance).abs() < 1e-4, "{wavelength}: {got:?}");
        }
    }

    #[test]
    fn leaves_keep_energy_and_darken_with_pigment() {
        for structure in [1.0, 1.4, 2.0, 3.3, 10.0] {
            for row in Spectra::visible().rows() {
                let mut before = 2.0;
                for chlorophyll in [0.0, 1.0, 5.0, 20.0, 60.0, 1e3, 1e6] {
                    let constituents = Constituents { structure, chlorophyll, ..Constituents::default() };
                    let leaf = leaf_optics(&constituents, row);
                    let sum = leaf.reflectance + leaf.transmittance;
                    assert!(leaf.reflectance > 0.0 && leaf.transmittance >= 0.0 && sum <= 1.0, "{leaf:?}");
                    assert!(sum <= before, "{structure} {chlorophyll}: {sum} {before}");
                    before = sum;
                }
            }
        }
    }

    #[test]
    fn without_absorption_no_light_is_lost() {
        for structure in [1.0, 1.5, 4.0] {
            for refraction in [1.01, 1.2, 1.45, 3.0] {
                let clear = Constituents { structure, ..Constituents::default() };
                let constants = OpticalConstants {
                    wavelength: 550.0,
                    refraction,
                    chlorophyll: 0.0,
                    carotenoid: 0.0,
                    anthocyanin: 0.0,
                    brown: 0.0,
                    water: 0.0,
                    dry_matter: 0.0,
                };
                let leaf = leaf_optics(&clear, &constants);
                assert!((leaf.reflectance + leaf.transmittance - 1.0).abs() < 1e-12, "{refraction}: {leaf:?}");
                // The limit is one of the general case.
                let nearly = OpticalConstants { water: 1e-7, ..constants };
                let near = leaf_optics(&clear, &nearly);
                assert!((near.reflectance - leaf.reflectance).abs() < 1e-6, "{refraction}: {near:?} {leaf:?}");
            }
        }
    }

    #[test]
    fn an_interface_passes_what_fresnels_equations_say() {
        // The integral over the cone, numerically.
        let fresnel = |n: f64, theta: f64| {
            let (i, o) = (theta.cos(), (1.0 - (theta.sin() / n).powi(2)).sqrt());
            1.0 - 0.5 * (((i - n * o) / (i + n * o)).powi(2) + ((o - n * i) / (o + n * i)).powi(2))
        };
        for (n, degrees) in [(1.45, 40.0), (1.45, 90.0), (1.33, 60.0), (2.0, 90.0)] {
            let cone = f64::to_radians(degrees);
            let steps = 20_000;
            let (mut sum, mut weights) = (0.0, 0.0);
            for step in 0..steps {
                let theta = cone * (f64::from(step) + 0.5) / f64::from(steps);
                let weight = theta.sin() * theta.cos();
                sum += weight * fresnel(n, theta);
                weights += weight;
            }
            let got = interface_transmissivity(n, cone);
            assert!((got - sum / weights).abs() < 1e-6, "{n} {degrees}: {got} {}", sum / weights);
        }
    }

    #[test]
    fn senseless_contents_give_no_senseless_light() {
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, f64::MAX, f64::MIN_POSITIVE];
        for a in bad {
            for b in bad {
                let constituents = Constituents { structure: a, chlorophyll: b, water: a, ..Constituents::default() };
                let constants = OpticalConstants { refraction: b, chlorophyll: a, ..at(550.0) };
                let leaf = leaf_optics(&constituents, &constants);
                let sum = leaf.reflectance + leaf.transmittance;
                assert!(leaf.reflectance >= 0.0 && leaf.transmittance >= 0.0 && sum <= 1.0, "{a} {b}: {leaf:?}");
            }
        }
    }

    #[test]
    fn kinds_of_leaves_have_the_colours_of_their_constituents() {
        let mut count = 0;
        for kind in LeafKind::ALL {
            let Some(constituents) = kind.constituents() else { continue };
            let colors = constituents.colors(Spectra::visible());
            let (r, t) = (colors.reflectance - kind.reflectance(), colors.transmittance - kind.transmittance());
            assert!(r.abs().max_element() < 0.004 && t.abs().max_element() < 0.004, "{kind:?}: {colors:?}");
            count += 1;
        }
        assert_eq!(count, 6);
    }
}
