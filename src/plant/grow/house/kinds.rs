//! The leaves of the house plants: shape, veins, chemistry.

use glam::Vec3;

use crate::plant::grow::textures::blade::{BladeStyle, Outline, Tissue, Venation};
use crate::plant::prospect::Constituents;

/// A large leaf to be looked at by itself, with letters stamped into its tissue or without.
pub(super) fn single_leaf(letters: Option<&str>) -> BladeStyle {
    let leaf = Constituents { structure: 1.45, chlorophyll: 31.0, carotenoid: 7.0, ..Constituents::default() };
    let tissue = Tissue::of(&leaf, 0.6);
    BladeStyle {
        size: [1024, 1536],
        outline: Outline::ovate(),
        venation: Venation::Pinnate { pairs: 9, angle: 0.86 },
        midrib: 0.0085,
        net: 72.0,
        contrast: 1.0,
        tissue,
        vein: tissue.veins(0.55),
        stripe: None,
        relief: 0.006,
        letters: letters.map(str::to_owned),
        seed: 1,
    }
}

/// A rubber plant: thick leather, dark green, glossy.
pub(super) fn rubber() -> BladeStyle {
    let leaf = Constituents {
        structure: 2.0,
        chlorophyll: 66.0,
        carotenoid: 14.0,
        dry_matter: 0.02,
        water: 0.03,
        ..Constituents::default()
    };
    let tissue = Tissue::of(&leaf, 0.42);
    BladeStyle {
        size: [512, 1024],
        outline: Outline::elliptic(),
        venation: Venation::Pinnate { pairs: 22, angle: 1.15 },
        midrib: 0.011,
        net: 70.0,
        contrast: 0.5,
        tissue,
        vein: tissue.veins(0.45),
        stripe: None,
        relief: 0.002,
        letters: None,
        seed: 2,
    }
}

/// A spider plant: straps with a cream stripe.
pub(super) fn spider() -> BladeStyle {
    let leaf = Constituents {
        structure: 1.4,
        chlorophyll: 24.0,
        carotenoid: 6.0,
        dry_matter: 0.004,
        ..Constituents::default()
    };
    let cream = Constituents {
        structure: 1.6,
        chlorophyll: 1.2,
        carotenoid: 1.2,
        dry_matter: 0.004,
        ..Constituents::default()
    };
    let tissue = Tissue::of(&leaf, 0.7);
    BladeStyle {
        size: [96, 1536],
        outline: Outline::strap(),
        venation: Venation::Parallel { count: 13 },
        midrib: 0.003,
        net: 90.0,
        contrast: 0.35,
        tissue,
        vein: tissue.veins(0.3),
        stripe: Some((Tissue::of(&cream, 0.7), 0.55)),
        relief: 0.0012,
        letters: None,
        seed: 3,
    }
}

/// A begonia: thin, pale and toothed, with a touch of red.
pub(super) fn begonia() -> BladeStyle {
    let leaf = Constituents {
        structure: 1.3,
        chlorophyll: 22.0,
        carotenoid: 5.0,
        anthocyanin: 0.5,
        dry_matter: 0.004,
        ..Constituents::default()
    };
    let tissue = Tissue::of(&leaf, 0.7);
    let mut vein = tissue.veins(0.4);
    vein.back = vein.back.lerp(Vec3::new(0.34, 0.16, 0.12), 0.5);
    BladeStyle {
        size: [512, 512],
        outline: Outline::lopsided_heart(),
        venation: Venation::Palmate { pairs: 3 },
        midrib: 0.0085,
        net: 42.0,
        contrast: 1.0,
        tissue,
        vein,
        stripe: None,
        relief: 0.008,
        letters: None,
        seed: 4,
    }
}

/// A weeping fig: small, smooth, with a drip tip.
pub(super) fn fig() -> BladeStyle {
    let leaf = Constituents { structure: 1.6, chlorophyll: 38.0, carotenoid: 9.0, ..Constituents::default() };
    let tissue = Tissue::of(&leaf, 0.6);
    BladeStyle {
        size: [192, 384],
        outline: Outline::drip_tip(),
        venation: Venation::Pinnate { pairs: 12, angle: 1.0 },
        midrib: 0.012,
        net: 36.0,
        contrast: 0.7,
        tissue,
        vein: tissue.veins(0.4),
        stripe: None,
        relief: 0.004,
        letters: None,
        seed: 5,
    }
}
