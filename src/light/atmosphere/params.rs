//! Coefficients of the atmosphere, per metre and per colour channel.

use glam::Vec3;

use crate::light::error::{LightError, check_range};

/// Coefficients of an atmosphere, one for each of the Rec. 709 primaries. The default is clear air.
///
/// The usual coefficients (Bruneton & Neyret 2008, Hillaire 2020) are those at 680, 550 and 440 nm. But the red primary
/// of Rec. 709 does not respond at 680 nm, and that wavelength misses the absorption of ozone, which peaks at 600 nm:
/// dusk turns purple. The default coefficients here are means over the spectrum of Rayleigh scattering (13.558e-6 at
/// 550 nm, exponent -4.08) and of ozone absorption (Serdyuchenko et al. 2014; 1.881e-6 at 550 nm). The weights are
/// sunlight (Planck, 5778 K) times the response of each primary (CIE 1931 observer as fitted by Wyman, Sloan & Shirley
/// 2013, through the matrix of BT.709). They give the exact colour of thin air. Through five air masses, the error of
/// the mean is below 3 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtmosphereParams {
    /// Radius of the planet in metres, 1e6 to 1e8.
    pub ground_radius_m: f64,
    /// Height in metres at which the atmosphere ends, 20,000 to 200,000.
    pub top_height_m: f64,
    /// Rayleigh scattering at sea level, 1/m, 0 to 1e-2.
    pub rayleigh_scattering: Vec3,
    /// Height in metres over which the density of the air falls to 1/e, 100 to 50,000.
    pub rayleigh_scale_height_m: f64,
    /// Aerosol scattering at sea level, 1/m, 0 to 1e-2.
    pub mie_scattering: Vec3,
    /// Aerosol absorption at sea level, 1/m, 0 to 1e-2.
    pub mie_absorption: Vec3,
    /// Height in metres over which the density of the aerosol falls to 1/e, 100 to 50,000.
    pub mie_scale_height_m: f64,
    /// Asymmetry `g` of the aerosol's phase function (Cornette & Shanks 1992), -0.95 to 0.95. Higher: a narrower
    /// glow.
    pub mie_anisotropy: f32,
    /// Ozone absorption at the layer's centre, 1/m, 0 to 1e-2. It makes the zenith blue at dusk.
    pub ozone_absorption: Vec3,
    /// Height in metres of the ozone layer's centre, 0 to 100,000.
    pub ozone_center_m: f64,
    /// Half width in metres of the ozone layer's tent profile, 100 to 50,000.
    pub ozone_half_width_m: f64,
    /// Diffuse albedo of the ground, 0 to 1. It brightens the sky and is visible below the horizon.
    pub ground_albedo: Vec3,
    /// Illuminance of the sun above the atmosphere on a surface that faces it, lux per channel, 0 to 1e7.
    pub solar_illuminance: Vec3,
}

impl Default for AtmosphereParams {
    /// The Earth on a clear day with 50 km of visibility.
    fn default() -> Self {
        Self::with_visibility_km(50.0)
    }
}

impl AtmosphereParams {
    /// The Earth (profiles: Hillaire 2020, table 1; Bruneton 2017) with the aerosol for a meteorological visibility of
    /// `km` kilometres at sea level, clamped to 2 to 250. By Koschmieder's law (1924) the extinction at 550 nm is
    /// 3.912 / visibility. What remains after Rayleigh scattering is aerosol with a single-scattering albedo of 0.9 and an
    /// Angstrom exponent of 1.3 (continental). 50 km is a clear day, with an aerosol optical depth of 0.077; 250 km
    /// means almost no aerosol.
    pub fn with_visibility_km(km: f64) -> Self {
        let rayleigh_scattering = Vec3::new(7.112e-6, 13.755e-6, 33.06e-6);
        let km = if km.is_finite() { km.clamp(2.0, 250.0) } else { 50.0 };
        let aerosol = (3.912e-3 / km - f64::from(rayleigh_scattering.y)).max(1e-7) as f32;
        // (wavelength / 550 nm)^-1.3 in the three primaries.
        let aerosol = aerosol * Vec3::new(0.821, 1.011, 1.334);
        Self {
            ground_radius_m: 6_360_000.0,
            top_height_m: 100_000.0,
            rayleigh_scattering,
            rayleigh_scale_height_m: 8_000.0,
            mie_scattering: 0.9 * aerosol,
            mie_absorption: 0.1 * aerosol,
            mie_scale_height_m: 1_200.0,
            mie_anisotropy: 0.8,
            ozone_absorption: Vec3::new(2.714e-6, 1.789e-6, 0.0),
            ozone_center_m: 25_000.0,
            ozone_half_width_m: 15_000.0,
            ground_albedo: Vec3::new(0.13, 0.15, 0.10),
            // The luminous solar constant, 1.28e5 lux, times the colour of a black body of 5778 K with luminance 1.
            solar_illuminance: 1.28e5 * Vec3::new(1.110, 0.976, 0.912),
        }
    }

    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for the first field that is out of range.
    pub fn validate(&self) -> Result<(), LightError> {
        check_range("planet radius", self.ground_radius_m, "m", 1e6, 1e8, "the Earth has 6,360,000 m")?;
        check_range("top of the atmosphere", self.top_height_m, "m", 2e4, 2e5, "the Earth's is at 100,000 m")?;
        for (name, h) in [
            ("Rayleigh scale height", self.rayleigh_scale_height_m),
            ("aerosol scale height", self.mie_scale_height_m),
            ("ozone half width", self.ozone_half_width_m),
        ] {
            check_range(name, h, "m", 100.0, 5e4, "give metres")?;
        }
        check_range("ozone centre", self.ozone_center_m, "m", 0.0, 1e5, "give metres")?;
        check_range("aerosol asymmetry", f64::from(self.mie_anisotropy), "", -0.95, 0.95, "the Earth's is about 0.8")?;
        for (name, c) in [
            ("Rayleigh scattering", self.rayleigh_scattering),
            ("aerosol scattering", self.mie_scattering),
            ("aerosol absorption", self.mie_absorption),
            ("ozone absorption", self.ozone_absorption),
        ] {
            for v in c.to_array() {
                check_range(name, f64::from(v), "1/m", 0.0, 1e-2, "coefficients are per metre, not per kilometre")?;
            }
        }
        for v in self.ground_albedo.to_array() {
            check_range("ground albedo", f64::from(v), "", 0.0, 1.0, "an albedo is a fraction")?;
        }
        for v in self.solar_illuminance.to_array() {
            check_range("solar illuminance", f64::from(v), "lx", 0.0, 1e7, "the sun gives 128,000 lux")?;
        }
        Ok(())
    }

    /// Radius in metres of the top of the atmosphere.
    pub(super) fn top_radius(&self) -> f64 {
        self.ground_radius_m + self.top_height_m
    }

    /// Coefficients at a height in metres above the ground (Hillaire 2020, section 4).
    pub(super) fn medium(&self, height_m: f64) -> Medium {
        let h = height_m.max(0.0);
        let rayleigh = self.rayleigh_scattering * (-h / self.rayleigh_scale_height_m).exp() as f32;
        let mie_density = (-h / self.mie_scale_height_m).exp() as f32;
        let ozone = (1.0 - (h - self.ozone_center_m).abs() / self.ozone_half_width_m).max(0.0) as f32;
        let mie = self.mie_scattering * mie_density;
        let extinction = rayleigh + mie + self.mie_absorption * mie_density + self.ozone_absorption * ozone;
        Medium { rayleigh, mie, extinction }
    }
}

/// Coefficients at one height, 1/m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Medium {
    pub rayleigh: Vec3,
    pub mie: Vec3,
    pub extinction: Vec3,
}
