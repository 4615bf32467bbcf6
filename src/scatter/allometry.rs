//! Height of a tree from the diameter of its trunk, for inventories that lack heights.

/// A curve of height over diameter at breast height (dbh).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allometry {
    /// [Chave et al. 2014], "Improved allometric models to estimate the aboveground biomass of tropical trees",
    /// Global Change Biology 20, equation 6a: `ln H = 0.893 − E + 0.760 ln D − 0.0340 (ln D)²`, H in metres, D in
    /// centimetres. Fitted to trees of all tropics from 5 cm up; one tree's height scatters by a factor of about
    /// exp(0.24). 30 cm give 21.9 m at E = 0.
    Chave2014 {
        /// Environmental stress E (climate), about -0.2 (wet) to 0.8 (dry); 0 where nothing is known.
        stress: f64,
    },
    /// [Näslund 1936]: `H = 1.3 + D² / (a + b D)²`, H in metres, D in centimetres; the curve of Nordic and Central
    /// European inventories, with a and b fitted to the stand's measured trees. `1.3 + 1/b²` is the greatest height.
    Naslund {
        /// a > 0, in √(cm²/m).
        a: f64,
        /// b > 0, in √(1/m).
        b: f64,
    },
}

impl Default for Allometry {
    /// The pantropical curve without stress.
    fn default() -> Self {
        Self::Chave2014 { stress: 0.0 }
    }
}

impl Allometry {
    /// Height in metres, > 0 and finite, of a tree of `dbh_m` metres, or `None` for a diameter or parameters that give
    /// no such height.
    pub fn height_m(&self, dbh_m: f64) -> Option<f64> {
        if !(dbh_m.is_finite() && dbh_m > 0.0) {
            return None;
        }
        let d = 100.0 * dbh_m;
        let height = match *self {
            Self::Chave2014 { stress } => {
                let ln_d = d.ln();
                (0.893 - stress + 0.760 * ln_d - 0.0340 * ln_d * ln_d).exp()
            }
            Self::Naslund { a, b } => 1.3 + (d / (a + b * d)).powi(2),
        };
        (height.is_finite() && height > 0.0).then_some(height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_and_meet_their_published_values() {
        let tropical = Allometry::default();
        assert!((tropical.height_m(0.30).unwrap() - 21.9).abs() < 0.1);
        let pine = Allometry::Naslund { a: 1.5, b: 0.2 };
        assert!((pine.height_m(0.30).unwrap() - (1.3 + (30.0f64 / 7.5).powi(2))).abs() < 1e-12);
        for curve in [tropical, pine] {
            let heights: Vec<f64> = (1..150).map(|cm| curve.height_m(f64::from(cm) / 100.0).unwrap()).collect();
            assert!(heights.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }

    #[test]
    fn impossible_diameters_have_no_height() {
        for dbh in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Allometry::default().height_m(dbh), None);
        }
        assert_eq!(Allometry::Naslund { a: -0.3, b: 0.01 }.height_m(0.3), None);
    }
}
