//! How the foliage of a species is lit.

use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use serde::{Deserialize, Serialize};

use super::check::Check;
use crate::{
    bake::lighting::{
        LightingSettings, SunLight,
        implicit::ImplicitSettings,
        transfer::{Channels, Scattering, TransferSettings},
    },
    math::Range,
};

/// The lighting of a species' foliage. Each choice has its own fields, all of them optional: `Transfer()`.
#[derive(Clone, Debug, PartialEq, Deserialize, Reflect)]
pub enum Lighting {
    /// Each leaf by its own normal, without occlusion of the sky: nothing is baked. For comparison.
    Local,
    /// By the implicit surface of the crown [Luft 2007]: light follows the crown's shape, its inside is dark. By
    /// default with constants that are fitted to traced plants; `Expressive(ambient: Published, weighting: Primitives)`
    /// is as published.
    Expressive(ImplicitSettings),
    /// The sky by radiance transfer, the sun by shadow maps [Franzke 2005]: closest to the ground truth.
    Transfer(Transfer),
}

/// Radiance transfer, in a user's terms: [`TransferSettings`] has more options than a scene needs, and how the sun
/// lights full models is no part of a bake.
#[derive(Clone, Debug, PartialEq, Deserialize, Reflect)]
#[reflect(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Transfer {
    /// Bands of spherical harmonics, 2 to 6. More: more accurate, and memory grows with the square. Default 4.
    #[reflect(@Range::steps(2..=6, 1.0, 1.0), @"Bands of spherical harmonics. More: more accurate, and memory grows with the square.")]
    pub bands: u32,
    /// Whether light takes on the colour of the leaves inside the crown; three times the memory. Default false.
    #[reflect(@"Whether light takes on the colour of the leaves inside the crown; three times the memory.")]
    pub color: bool,
    /// Rays per vertex, 16 to 16384. More: a slower bake with less noise. Default 1024.
    #[reflect(@Range::doubled(16..=16_384), @"Rays per vertex. More: a slower bake with less noise.")]
    pub rays: u32,
    /// How often light is followed from leaf to leaf, 0 to 8; 0: straight through leaves only. Default 3. Along
    /// 48 to 143 of the rays' lines at most: 57 of the 512 lines of 1024 rays.
    #[reflect(@Range::steps(0..=8, 1.0, 1.0), @"How often light is followed from leaf to leaf; 0: straight through leaves only.")]
    pub bounces: u32,
    /// How the sun lights full models, `Combined`, `LeafShader` or `Harmonics`; costs no bake of its own. Default `Combined`.
    #[reflect(@"How the sun lights full models: through the plant's transfer with the shadow map's detail, each leaf by its normal and the shadow map, or softly, through the transfer alone.")]
    pub sun: SunLight,
}

impl Default for Transfer {
    fn default() -> Self {
        Self { bands: 4, color: false, rays: 1024, bounces: 3, sun: SunLight::default() }
    }
}

impl Transfer {
    /// The bake settings of the lighting.
    pub fn settings(&self) -> TransferSettings {
        let byte = |value: u32| value.min(u8::MAX.into()) as u8;
        TransferSettings {
            bands: byte(self.bands),
            channels: if self.color { Channels::Rgb } else { Channels::Luminance },
            rays: self.rays,
            scattering: match byte(self.bounces) {
                0 => Scattering::TransmitOnly(1),
                bounces => Scattering::Diffuse(bounces),
            },
            ..TransferSettings::default()
        }
    }
}

/// A choice without fields, as a scene file writes it.
pub(crate) fn word(choice: &impl Serialize) -> String {
    ron::to_string(choice).unwrap_or_default()
}

impl Lighting {
    /// The bake settings of the lighting, for a single plant.
    pub fn settings(&self) -> LightingSettings {
        match self {
            Self::Local => LightingSettings::Local,
            // Plants that are lit together are first baked one by one, like all others.
            Self::Expressive(settings) => {
                LightingSettings::Expressive(ImplicitSettings { together: false, ..*settings })
            }
            Self::Transfer(transfer) => LightingSettings::Transfer(transfer.settings()),
        }
    }

    /// How the sun lights full models.
    pub fn sun(&self) -> SunLight {
        match self {
            Self::Local | Self::Expressive(_) => SunLight::default(),
            Self::Transfer(transfer) => transfer.sun,
        }
    }

    /// The lighting in the syntax of a scene file after `lighting:`, such as `Expressive(radius: 0.8, normals:
    /// Smooth)`. Fields with their default values are left out. A scene with this text gets the same lighting, bit for
    /// bit.
    pub fn to_ron(&self) -> String {
        let mut fields = Vec::new();
        let name = match self {
            Self::Local => return "Local".to_owned(),
            Self::Expressive(expressive) => {
                let default = ImplicitSettings::default();
                for (name, value) in [
                    ("radius", expressive.radius),
                    ("threshold", expressive.threshold),
                    ("ambient_radius", expressive.ambient_radius),
                    ("least", expressive.least),
                    ("core", expressive.core),
                    ("exponent", expressive.exponent),
                    ("surface_share", expressive.surface_share),
                ] {
                    fields.extend(value.map(|value| format!("{name}: {value}")));
                }
                let mut field = |differs: bool, text: String| fields.extend(differs.then_some(text));
                let (share, own_normal) = (expressive.generator_share, expressive.own_normal);
                field(share != default.generator_share, format!("share: {share}"));
                field(own_normal != default.own_normal, format!("own_normal: {own_normal}"));
                field(expressive.ambient != default.ambient, format!("ambient: {}", word(&expressive.ambient)));
                field(expressive.normals != default.normals, format!("normals: {}", word(&expressive.normals)));
                field(expressive.weighting != default.weighting, format!("weighting: {}", word(&expressive.weighting)));
                field(expressive.surface != default.surface, format!("surface: {}", expressive.surface));
                field(expressive.resolution != default.resolution, format!("resolution: {}", expressive.resolution));
                field(expressive.together, "together: true".to_owned());
                "Expressive"
            }
            Self::Transfer(transfer) => {
                let default = Transfer::default();
                let mut field = |differs: bool, text: String| fields.extend(differs.then_some(text));
                field(transfer.bands != default.bands, format!("bands: {}", transfer.bands));
                field(transfer.color != default.color, format!("color: {}", transfer.color));
                field(transfer.rays != default.rays, format!("rays: {}", transfer.rays));
                field(transfer.bounces != default.bounces, format!("bounces: {}", transfer.bounces));
                field(transfer.sun != default.sun, format!("sun: {}", word(&transfer.sun)));
                "Transfer"
            }
        };
        format!("{name}({})", fields.join(", "))
    }

    pub(super) fn check(&self, at: &str, check: &mut Check) {
        if let Self::Transfer(transfer) = self {
            check.count(&format!("{at}.lighting.bands"), transfer.bands, 2..=6);
            check.count(&format!("{at}.lighting.rays"), transfer.rays, 16..=16_384);
            check.count(&format!("{at}.lighting.bounces"), transfer.bounces, 0..=8);
        }
        let Self::Expressive(expressive) = self else { return };
        for (name, value, range, unit) in [
            ("radius", expressive.radius, ImplicitSettings::RADIUS, "m"),
            ("threshold", expressive.threshold, ImplicitSettings::DENSITY, "leaves"),
            ("ambient_radius", expressive.ambient_radius, ImplicitSettings::AMBIENT_RADIUS, "m"),
            ("least", expressive.least, ImplicitSettings::UNIT, ""),
            ("core", expressive.core, ImplicitSettings::DENSITY, "leaves"),
            ("exponent", expressive.exponent, ImplicitSettings::EXPONENT, ""),
            ("share", Some(expressive.generator_share), ImplicitSettings::SHARE, ""),
            ("own_normal", Some(expressive.own_normal), ImplicitSettings::UNIT, ""),
            ("resolution", Some(expressive.resolution), ImplicitSettings::RESOLUTION, "cells"),
            ("surface_share", expressive.surface_share, ImplicitSettings::UNIT, ""),
        ] {
            if let Some(value) = value {
                check.number(&format!("{at}.lighting.{name}"), value, range, unit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::lighting::implicit::Weighting;

    #[test]
    fn a_scene_chooses_what_a_generator_counts() {
        // Scene files are read so.
        let options =
            ron::Options::default().with_default_extension(ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES);
        for weighting in [Weighting::LeafArea, Weighting::Primitives, Weighting::Vertices] {
            let text = format!("Expressive(weighting: {})", word(&weighting));
            let lighting: Lighting = options.from_str(&text).unwrap();
            assert_eq!(lighting, Lighting::Expressive(ImplicitSettings { weighting, ..Default::default() }));
            assert_eq!(options.from_str::<Lighting>(&lighting.to_ron()).unwrap(), lighting);
        }
    }
}
