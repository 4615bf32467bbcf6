//! Terrain from fractal noise, for scenes without data.

use glam::DVec2;
use noise::{Fbm, MultiFractal, NoiseFn, Perlin, RidgedMulti};
use rayon::prelude::*;

use super::{HeightField, TerrainError};

/// What the hills look like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum NoiseKind {
    /// Fractional Brownian motion: rolling hills, peaks like valleys [Musgrave et al. 1989].
    #[default]
    Rolling,
    /// Ridged multifractal: sharp crests above smooth valleys [Musgrave 1994, in "Texturing and Modeling", ch. 16].
    Ridged,
}

/// A terrain of gradient noise [Perlin 1985] in octaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseTerrain {
    /// Samples from west to east, 2 or more.
    pub columns: usize,
    /// Samples from north to south, 2 or more.
    pub rows: usize,
    /// Distance of samples in metres, both ways.
    pub spacing: f64,
    /// Another seed, another land.
    pub seed: u32,
    /// Rolling or ridged.
    pub kind: NoiseKind,
    /// Octaves, 1 to 16: each halves the wavelength. Those finer than two samples are left out.
    pub octaves: usize,
    /// Heights lie within `base - amplitude` and `base + amplitude`, in metres; 0 is a plain.
    pub amplitude: f64,
    /// Wavelength of the first octave in metres: the distance from one hill to the next.
    pub wavelength: f64,
    /// Height of each octave relative to the one before, in (0, 1): 0.5 is natural, more is rougher.
    pub persistence: f64,
    /// Mean height in metres above the datum.
    pub base: f64,
}

impl Default for NoiseTerrain {
    /// 10 km x 10 km of rolling hills, 300 m from valley to top.
    fn default() -> Self {
        Self {
            columns: 513,
            rows: 513,
            spacing: 20.0,
            seed: 1,
            kind: NoiseKind::Rolling,
            octaves: 8,
            amplitude: 150.0,
            wavelength: 3000.0,
            persistence: 0.45,
            base: 400.0,
        }
    }
}

impl NoiseTerrain {
    /// Computes the heights: the same for the same settings on every machine and any number of threads. About 60 ns
    /// per sample and octave.
    ///
    /// # Errors
    /// A parameter outside the range its field names, or what [`HeightField::new`] refuses.
    pub fn height_field(&self) -> Result<HeightField, TerrainError> {
        let check = |name, value: f64, low: f64, high: f64, range| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(TerrainError::BadParameter { name, value, range }) }
        };
        check("the noise's spacing", self.spacing, 1.0e-3, 1.0e6, "0.001 m to 1000000 m")?;
        check("the noise's wavelength", self.wavelength, 1.0e-2, 1.0e7, "0.01 m to 10000000 m")?;
        check("the noise's amplitude", self.amplitude, 0.0, 1.0e5, "0 m to 100000 m")?;
        check("the noise's base height", self.base, -1.0e5, 1.0e5, "within +-100000 m")?;
        check("the noise's persistence", self.persistence, 0.01, 0.99, "0.01 to 0.99")?;
        check("the noise's number of octaves", self.octaves as f64, 1.0, 16.0, "1 to 16")?;
        if self.columns < 2 || self.rows < 2 {
            return Err(TerrainError::TooSmall { columns: self.columns, rows: self.rows });
        }
        let limit = super::MAX_SAMPLES;
        if self.columns.checked_mul(self.rows).is_none_or(|count| count > limit) {
            return Err(TerrainError::TooLarge { columns: self.columns, rows: self.rows, limit });
        }
        let carried = (self.wavelength / (2.0 * self.spacing)).log2().floor() + 1.0;
        let octaves = self.octaves.min(carried.max(1.0) as usize);
        let heights = match self.kind {
            NoiseKind::Rolling => {
                let source = Fbm::<Perlin>::new(self.seed)
                    .set_octaves(octaves)
                    .set_frequency(1.0)
                    .set_lacunarity(2.0)
                    .set_persistence(self.persistence);
                self.sampled(&source)
            }
            NoiseKind::Ridged => {
                let source = RidgedMulti::<Perlin>::new(self.seed)
                    .set_octaves(octaves)
                    .set_frequency(1.0)
                    .set_lacunarity(2.0)
                    .set_persistence(self.persistence);
                self.sampled(&source)
            }
        };
        HeightField::new(self.columns, self.rows, DVec2::splat(self.spacing), heights)
    }

    fn sampled(&self, source: &(impl NoiseFn<f64, 2> + Sync)) -> Vec<f32> {
        let scale = self.spacing / self.wavelength;
        let centre = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64) * 0.5;
        let mut heights = vec![0.0; self.columns * self.rows];
        heights.par_chunks_mut(self.columns).enumerate().for_each(|(row, line)| {
            let y = (row as f64 - centre.y) * scale;
            for (column, height) in line.iter_mut().enumerate() {
                let x = (column as f64 - centre.x) * scale;
                // Gradient noise is zero at integers: a shift keeps the centre of the land from being special.
                let value = source.get([x + 0.37, y + 0.61]).clamp(-1.0, 1.0);
                *height = (self.base + self.amplitude * value) as f32;
            }
        });
        heights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_keeps_its_promises() {
        for kind in [NoiseKind::Rolling, NoiseKind::Ridged] {
            let land = NoiseTerrain { columns: 130, rows: 90, kind, ..NoiseTerrain::default() };
            let field = land.height_field().unwrap();
            let (low, high) = field.min_max();
            assert!(low >= 250.0 && high <= 550.0, "{kind:?}: {low} {high}");
            assert!(high - low > 60.0, "{kind:?} is flat: {low} {high}");
            assert_eq!(field, land.height_field().unwrap());
            assert_ne!(field, NoiseTerrain { seed: 2, ..land }.height_field().unwrap());
        }
    }

    #[test]
    fn octaves_beyond_the_samples_change_nothing() {
        let land = NoiseTerrain { columns: 40, rows: 40, wavelength: 160.0, octaves: 3, ..NoiseTerrain::default() };
        assert_eq!(land.height_field().unwrap(), NoiseTerrain { octaves: 16, ..land }.height_field().unwrap());
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        let land = NoiseTerrain::default();
        for broken in [
            NoiseTerrain { spacing: 0.0, ..land },
            NoiseTerrain { wavelength: f64::NAN, ..land },
            NoiseTerrain { amplitude: f64::INFINITY, ..land },
            NoiseTerrain { persistence: 1.0, ..land },
            NoiseTerrain { octaves: 0, ..land },
            NoiseTerrain { columns: 1, ..land },
            NoiseTerrain { columns: usize::MAX, ..land },
        ] {
            assert!(broken.height_field().is_err(), "{broken:?}");
        }
    }
}
