//! The two built-in species, and the defaults of the parts of a species.
//!
//! The conifer is read from its file. The broadleaf is the default of every field that a species file omits, so it
//! cannot be read from a file itself. Its values are here, and a test compares them with
//! `assets/species/broadleaf.ron`.

use std::sync::LazyLock;

use super::parameters::{
    BarkKind, BarkParameters, BranchParameters, CrownShape, GrowParameters, LeafParameters, LeafShape, Pruning,
    StemParameters,
};
use crate::plant::LeafKind;

/// The species file of the conifer.
const CONIFER: &str = include_str!("../../../assets/species/conifer.ron");

impl GrowParameters {
    /// A broadleaf of a closed forest, between oak and beech: about 22 m high, with a crown of 7 to 9 m across that
    /// begins at a third of the height, and a trunk that forks within the crown.
    pub fn broadleaf() -> Self {
        Self {
            name: "broadleaf".into(),
            shape: CrownShape::Cylindrical,
            height: 21.4,
            height_variation: 1.6,
            ratio: 0.0112,
            ratio_power: 1.2,
            flare: 0.6,
            lobes: 6,
            lobe_depth: 0.14,
            lean_deg: 2.5,
            irregularity: 0.3,
            pruning: Some(Pruning { width: 0.18, width_peak: 0.58, power_low: 0.6, power_high: 0.42 }),
            trunk: StemParameters {
                length: 1.0,
                length_variation: 0.0,
                segments: 16,
                taper: 1.0,
                curve_variation_deg: 60.0,
                attraction_up: 0.9,
                splits: 2.4,
                split_from: 0.42,
                split_angle_deg: 40.0,
                split_angle_variation_deg: 10.0,
                bare: 0.29,
                ..StemParameters::default()
            },
            branches: vec![
                BranchParameters {
                    stem: StemParameters {
                        length: 0.2,
                        length_variation: 0.05,
                        segments: 9,
                        curve_deg: -10.0,
                        curve_variation_deg: 110.0,
                        attraction_up: 0.45,
                        splits: 1.0,
                        split_from: 0.25,
                        split_angle_deg: 42.0,
                        split_angle_variation_deg: 12.0,
                        bare: 0.2,
                        ..StemParameters::default()
                    },
                    count: 84,
                    down_angle_deg: 64.0,
                    down_angle_variation_deg: -24.0,
                    rotate_variation_deg: 25.0,
                    ..BranchParameters::default()
                },
                BranchParameters {
                    stem: StemParameters {
                        length: 0.42,
                        length_variation: 0.08,
                        segments: 5,
                        curve_variation_deg: 80.0,
                        attraction_up: 0.3,
                        bare: 0.12,
                        ..StemParameters::default()
                    },
                    count: 15,
                    down_angle_deg: 50.0,
                    down_angle_variation_deg: 14.0,
                    rotate_variation_deg: 25.0,
                    ..BranchParameters::default()
                },
                BranchParameters {
                    stem: StemParameters {
                        length: 0.45,
                        length_variation: 0.1,
                        segments: 3,
                        curve_variation_deg: 50.0,
                        attraction_up: 0.1,
                        bare: 0.1,
                        ..StemParameters::default()
                    },
                    count: 6,
                    down_angle_deg: 46.0,
                    down_angle_variation_deg: 16.0,
                    rotate_variation_deg: 30.0,
                    ..BranchParameters::default()
                },
            ],
            leaves: LeafParameters::default(),
            bark: BarkParameters::default(),
            wood_share: 0.36,
        }
    }

    /// A spruce of a closed forest: about 28 m high, with a crown of 4.5 to 6 m across and whorls of boughs, which hang
    /// in the middle and bend up at their ends, with drooping sprays of needles. It is read once from
    /// `assets/species/conifer.ron`, which is compiled in.
    pub fn conifer() -> Self {
        // The text is valid: a test reads it.
        static SHIPPED: LazyLock<GrowParameters> =
            LazyLock::new(|| GrowParameters::from_ron(CONIFER).unwrap_or_default());
        SHIPPED.clone()
    }
}

impl Default for GrowParameters {
    fn default() -> Self {
        Self::broadleaf()
    }
}

impl Default for StemParameters {
    fn default() -> Self {
        Self {
            length: 0.4,
            length_variation: 0.05,
            segments: 5,
            taper: 1.0,
            curve_deg: 0.0,
            curve_back_deg: 0.0,
            curve_variation_deg: 40.0,
            attraction_up: 0.0,
            splits: 0.0,
            split_from: 0.4,
            split_angle_deg: 30.0,
            split_angle_variation_deg: 10.0,
            bare: 0.15,
        }
    }
}

impl Default for BranchParameters {
    fn default() -> Self {
        Self {
            stem: StemParameters::default(),
            count: 12,
            whorl: 0,
            down_angle_deg: 45.0,
            down_angle_variation_deg: 10.0,
            rotate_deg: 137.5,
            rotate_variation_deg: 15.0,
        }
    }
}

impl Default for LeafParameters {
    fn default() -> Self {
        Self {
            shape: LeafShape::Ovate,
            count: 13000,
            scale: 0.3,
            aspect: 1.0,
            scale_variation: 0.25,
            down_angle_deg: 40.0,
            down_angle_variation_deg: 25.0,
            rotate_deg: 137.5,
            droop: 0.15,
            bend: 0.5,
            fold_deg: 18.0,
            normal_bend: 0.0,
            shell: 0.65,
            tint: [0.62, 0.66, 0.72],
            tint_variation: 0.12,
            transmission: LeafKind::Thin.transmission().to_array(),
        }
    }
}

impl Default for BarkParameters {
    fn default() -> Self {
        Self { kind: BarkKind::Fissured, tile: 0.7, tint: [1.0, 1.0, 1.0] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_conifer_is_what_its_file_says() {
        let file = GrowParameters::from_ron(CONIFER).unwrap();
        assert_eq!(file, GrowParameters::conifer());
        assert_eq!((file.name.as_str(), file.shape, file.branches.len()), ("conifer", CrownShape::Spire, 2));
    }
}
