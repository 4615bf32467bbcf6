//! Constants that Rust and the shaders share: the WGSL module `canopy::constants`, written from the Rust constants.
//!
//! Each number is defined once, in the module that it belongs to. Shaders import it by its name here. The test that
//! validates every shader composes them with the same text.

use std::fmt::Write as _;

use super::{
    bindings::uniforms,
    forest::{transfer, uniforms as forest},
};
use crate::{
    bake::{
        levels::cross,
        lighting::{AmbientTerm, implicit::packing},
    },
    cull::{clusters, device_lists, volume},
    light::{atmosphere::SkyView, night, stand},
    lod::{self, level_distance},
    scatter::packed,
    style::{Paper, anchor, layers},
    terrain::{drape, ground_noise, tiles},
};

/// A scalar of WGSL.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// `f32`; finite.
    Float(f32),
    /// `i32`.
    Int(i32),
    /// `u32`.
    Uint(u32),
}

impl From<f32> for Value {
    fn from(value: f32) -> Self {
        Self::Float(value)
    }
}

impl From<u32> for Value {
    fn from(value: u32) -> Self {
        Self::Uint(value)
    }
}

/// All shared constants: name in WGSL, description, value.
pub fn constants() -> Vec<(&'static str, &'static str, Value)> {
    let uint = |value: usize| Value::Uint(value as u32);
    let float = |value: usize| Value::Float(value as f32);
    vec![
        ("MAX_CASCADES", "Most cascades a view can have.", Value::Int(uniforms::MAX_CASCADES as i32)),
        ("SKY_COLUMNS", "Columns of the sky's table.", float(SkyView::WIDTH)),
        ("SKY_ROWS", "Its rows.", float(SkyView::HEIGHT)),
        ("SKY_HORIZON_ROW", "Its row of the horizon.", float(SkyView::HORIZON_ROW)),
        ("LUX_OF_MAGNITUDE_0", "Illuminance of a star of magnitude 0, lux.", night::LUX_OF_MAGNITUDE_0.into()),
        ("STAND_COVERS", "Canopy covers of the table of light in a stand.", float(stand::COVERS)),
        ("STAND_DEPTHS", "Its depths in the crowns; one more row is the ground's.", float(stand::DEPTHS)),
        ("TILE_SIDE", "Vertices along a side of a terrain tile.", uint(tiles::TILE_QUADS + 1)),
        (
            "NOISE_OCTAVE_DEVIATION",
            "Standard deviation of an octave of the ground's noise.",
            ground_noise::OCTAVE_DEVIATION.into(),
        ),
        ("NOISE_WEIGHT_RATIO", "Weight of an octave relative to the one before.", ground_noise::WEIGHT_RATIO.into()),
        ("LEAF_OCTAVE", "Octave in whose cells fallen leaves lie.", Value::Int(ground_noise::LEAF_OCTAVE)),
        ("LEAF_SEED", "Their seed.", ground_noise::LEAF_SEED.into()),
        ("DETAIL_TEXELS", "Texels below which a photograph of the ground lacks detail.", drape::DETAIL_TEXELS.into()),
        ("LEAST_DETAIL", "The least that added detail multiplies it by.", drape::LEAST_DETAIL.into()),
        ("MOST_DETAIL", "The most that it does.", drape::MOST_DETAIL.into()),
        ("POSITION_STEPS", "Steps of a tree's position along a cell's side.", packed::POSITION_STEPS.into()),
        ("YAW_BITS", "Bits of a tree's yaw, the lowest of `look`.", packed::YAW_BITS.into()),
        ("YAWS", "Yaws that a tree can have.", uint(transfer::YAWS)),
        ("SCALE_SHIFT", "First bit of its scale.", packed::SCALE_SHIFT.into()),
        ("SCALE_BITS", "Bits of its scale.", packed::SCALE_BITS.into()),
        ("SCALE_STEPS", "Steps of its scale, even in the logarithm.", packed::SCALE_STEPS.into()),
        ("SCALE_OCTAVES", "Binary logarithm of the largest scale over the smallest.", packed::SCALE_OCTAVES.into()),
        ("LEAST_SCALE_LOG2", "Binary logarithm of the smallest scale.", packed::LEAST_SCALE_LOG2.into()),
        (
            "CELL_BITS",
            "Bits of a tree's column and row, the lowest of `cell`, two's complement.",
            packed::CELL_BITS.into(),
        ),
        ("VARIANT_HIGH_SHIFT", "First of the upper bits of its variant in `cell`.", packed::VARIANT_HIGH_SHIFT.into()),
        ("VARIANT_HIGH_BITS", "Number of these.", packed::VARIANT_HIGH_BITS.into()),
        ("VARIANT_LOW_SHIFT", "First of the lower bits of its variant in `look`.", packed::VARIANT_LOW_SHIFT.into()),
        ("VARIANT_LOW_BITS", "Number of these.", packed::VARIANT_LOW_BITS.into()),
        ("TINT_SHIFT", "First bit of its tint.", packed::TINT_SHIFT.into()),
        ("TINT_BITS", "Bits of its tint, two's complement.", packed::TINT_BITS.into()),
        ("TINT_STEPS", "Steps of its tint on either side of 0.", packed::TINT_STEPS.into()),
        ("WHOLE", "Alpha threshold at which a representation is whole.", lod::WHOLE.into()),
        ("FADE_SPAN", "What fading adds to `WHOLE` until nothing is left.", lod::FADE_SPAN.into()),
        ("GONE", "Alpha threshold from which on nothing is left.", lod::GONE.into()),
        ("MAX_LEVELS", "Most levels of a forest.", uint(lod::MAX_LEVELS)),
        ("MAX_PLANES", "Most planes of a volume.", uint(volume::MAX_PLANES)),
        ("COORDINATE_LIMIT", "Limit of coordinates in plane tests.", Value::Int(volume::COORDINATE_LIMIT)),
        ("PLANE_SLACK", "What rounding moves a plane at most.", Value::Int(volume::PLANE_SLACK)),
        ("ENDLESS_DROP", "Units of a drop that counts as endless.", Value::Int(volume::ENDLESS_DROP)),
        ("SQUARE_LIMIT", "Largest coordinate that is squared.", volume::SQUARE_LIMIT.into()),
        ("FACTOR_LIMIT", "Largest coordinate that is multiplied by a factor.", volume::FACTOR_LIMIT.into()),
        ("FACTOR_ONE", "The factor 1 on a tree's distance.", level_distance::FACTOR_ONE.into()),
        ("LEAST_FACTOR", "The least such factor.", level_distance::LEAST_FACTOR.into()),
        ("GREATEST_FACTOR", "The greatest one.", level_distance::GREATEST_FACTOR.into()),
        ("LEAST_SHIFT", "Its least part that is the tree's own.", level_distance::LEAST_SHIFT.into()),
        ("CLUSTER_KEYS", "Keys of clusters lie below this.", volume::KEYS.into()),
        ("CLUSTER_BITS", "Bits of a cluster's index, below its key.", clusters::CLUSTER_BITS.into()),
        ("SORT_THREADS", "Threads of the workgroup that sorts.", device_lists::SORT_THREADS.into()),
        ("TEST_THREADS", "Threads of a workgroup that looks at clusters.", device_lists::TEST_THREADS.into()),
        ("LIST_STARTS", "Word of the results at which the levels' starts lie.", uint(device_lists::STARTS)),
        ("LIST_TOTALS", "The same of their numbers of trees.", uint(device_lists::TOTALS)),
        ("LIST_HEADER", "Words before the ranges of the groups.", uint(device_lists::HEADER)),
        ("AMBIENT_FITTED", "Leaves that are lit by k_a with fitted constants.", (AmbientTerm::Fitted as u32).into()),
        ("AMBIENT_PUBLISHED", "Leaves that are lit by k_a as published.", (AmbientTerm::Published as u32).into()),
        ("MOST_PLANES", "The most planes of a cross.", uint(forest::MOST_PLANES)),
        ("CROSS_VERTICES", "Vertices of a tree's cross.", forest::CROSS_VERTICES.into()),
        ("CASTER_VERTICES", "Vertices of a tree's cross as a caster.", forest::CROSS_CASTER_VERTICES.into()),
        ("ISOTROPIC_LEVELS", "Mips for which the isotropic fraction is known.", uint(cross::ISOTROPIC_LEVELS)),
        ("ISOTROPIC_VECTORS", "Vectors of four of them.", uint(cross::ISOTROPIC_LEVELS / 4)),
        ("SUN_SCALE", "Scale of the crosses' sun textures: the value of 1.", cross::SUN_SCALE.into()),
        ("LIGHT_SCALE", "Scale of lighting textures: the value of 1.", cross::LIGHT_SCALE.into()),
        ("NORMAL_STEPS", "Steps of a packed normal on either side of 0.", packing::STEPS.into()),
        ("NORMAL_LEAST_LENGTH", "Its length where the ambient visibility is 0.", packing::LEAST_LENGTH.into()),
        ("TRANSFER_WORDS", "Words of four coefficients after the first, of all bands.", uint(forest::WORDS)),
        ("GROUND_LAYER", "Layer of the ground in the styles.", u32::from(layers::GROUND).into()),
        ("WOOD_LAYER", "Layer of wood in the styles.", u32::from(layers::WOOD).into()),
        ("FIRST_FOLIAGE_LAYER", "First layer of foliage in the styles.", u32::from(layers::FIRST_FOLIAGE).into()),
        ("PAPER_SIDE", "Side of a paper's height map in texels.", float(Paper::SIDE)),
        ("NOISE_SPAN", "Metres after which the styles' noise repeats, a power of two.", anchor::NOISE_SPAN.into()),
        (
            "LIGHT_STRIDE",
            "Vectors from one yaw's light to the next: the first coefficient, then red, green and blue of each word.",
            uint(transfer::STRIDE),
        ),
    ]
}

/// The WGSL text of the module.
pub fn source() -> String {
    let mut text = "// Written by src/render/shader_constants.rs.\n#define_import_path canopy::constants\n".to_owned();
    for (name, comment, value) in constants() {
        // The shortest decimal number that reads as the same float.
        let _ = match value {
            Value::Float(value) => writeln!(text, "\n// {comment}\nconst {name}: f32 = {value:?}f;"),
            Value::Int(value) => writeln!(text, "\n// {comment}\nconst {name}: i32 = {value}i;"),
            Value::Uint(value) => writeln!(text, "\n// {comment}\nconst {name}: u32 = {value}u;"),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use naga::{Expression, Literal};

    use super::*;

    #[test]
    fn shaders_read_the_values_to_the_bit() {
        let module = naga::front::wgsl::parse_str(&source().replace("#define_import_path", "//")).expect("valid WGSL");
        assert_eq!(module.constants.len(), constants().len(), "a name is defined twice");
        for (name, _, value) in constants() {
            let found = module.constants.iter().find(|(_, constant)| constant.name.as_deref() == Some(name));
            let (_, constant) = found.unwrap_or_else(|| panic!("{name} is missing"));
            let same = match (&module.global_expressions[constant.init], value) {
                (Expression::Literal(Literal::F32(read)), Value::Float(value)) => read.to_bits() == value.to_bits(),
                (Expression::Literal(Literal::I32(read)), Value::Int(value)) => *read == value,
                (Expression::Literal(Literal::U32(read)), Value::Uint(value)) => *read == value,
                _ => false,
            };
            assert!(same, "{name}");
        }
    }
}
