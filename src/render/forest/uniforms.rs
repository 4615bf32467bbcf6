//! What the shaders know of a forest, its plants and their parts.

use bytemuck::{Pod, Zeroable};

use glam::Vec3;

use crate::{
    bake::{
        BakedPlant,
        levels::cross::SPREAD_LEVELS,
        lighting::{
            BakedLighting,
            transfer::{PackedPart, TransferSettings, code_words, mean_words},
        },
    },
    cull::VariantSize,
    light::sh::MAX_BANDS,
    math::luminance,
    plant::{LeafColors, PlantMaterial},
};

/// `ForestView` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ForestViewUniform {
    /// Cell of the anchor.
    pub anchor_cell: [i32; 2],
    /// Metres of the anchor inside its cell.
    pub anchor_offset: [f32; 2],
    /// Anchor's height over the stand's datum.
    pub anchor_y: f32,
    /// Metres along a cell's side.
    pub cell_size: f32,
    /// Distances in metres over which the level comes in.
    pub fade_in: [f32; 2],
    /// Distances in metres over which it goes out.
    pub fade_out: [f32; 2],
    /// Up to the next 16 bytes.
    pub unused: [f32; 2],
    /// Linear colour of the level's tint and how much of it is mixed in.
    pub tint: [f32; 4],
}

/// `Plane` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PlaneUniform {
    /// Middle of the picture, metres in the plant's frame.
    pub center: [f32; 4],
    /// Half extent to the picture's right.
    pub u: [f32; 4],
    /// Half extent upwards.
    pub v: [f32; 4],
    /// Unit normal towards the side that the picture was taken from.
    pub normal: [f32; 4],
}

/// Planes of a cross.
pub const PLANES: usize = 3;

/// `Variant` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VariantUniform {
    /// Two upright planes and a level one.
    pub planes: [PlaneUniform; PLANES],
    /// Height, crown radius, first layer of its pictures, 1 where it has a full model.
    pub size: [f32; 4],
    /// Transmission of its leaves; w: 1 where k_a was traced and holds what leaves send each other.
    pub transmission: [f32; 4],
    /// How far the leaves of a texel face everywhere, mip by mip.
    pub spread: [[f32; 4]; SPREAD_LEVELS / 4],
    /// Gloss of its leaves: reflectance, roughness, 1 where normals point out of the crown; w: first layer of its lighting
    /// pictures.
    pub gloss: [f32; 4],
    /// Light of the key light that its leaves send each other, in the mean: colour, first coefficient.
    pub scattered: [f32; 4],
    /// Its second band's rise towards the zenith; unused, unused, unused.
    pub scattered_rise: [f32; 4],
}

/// `Part` of `shaders/forest/model.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PartUniform {
    /// Linear factor on the texture.
    pub base_color: [f32; 4],
    /// Transmission factor; w: 1 where the normals point out of the crown, whichever side of a leaf is seen.
    pub transmission: [f32; 4],
    /// Gloss: reflectance, roughness; unused, unused.
    pub gloss: [f32; 4],
}

/// Words of four coefficients after the first, of all bands.
pub const WORDS: usize = (MAX_BANDS * MAX_BANDS - 1).div_ceil(4);

/// `Transfer` of `shaders/forest/transfer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TransferUniform {
    /// What 127 stands for in each coefficient after the first, relative to it, four a word of codes.
    pub scale: [[f32; 4]; WORDS],
    /// Words from one vertex to the next, of its means, and of the codes of one side and channel; where the codes of the key
    /// light that leaves send each other begin.
    pub form: [u32; 4],
    /// Colour of the key light that leaves send each other; w: what 127 stands for in its codes.
    pub scattered: [f32; 4],
}

impl TransferUniform {
    /// That of one part of a plant.
    pub fn new(settings: &TransferSettings, part: &PackedPart, tint: Vec3) -> Self {
        let mut scale = [0.0; 4 * WORDS];
        for (i, scale) in scale.iter_mut().enumerate() {
            *scale = part.scale.get((i + 1).isqrt()).copied().unwrap_or(0.0);
        }
        let form =
            [part.vertex_bytes / 4, mean_words(settings, part.sides), code_words(settings), part.bytes.len() / 4];
        Self {
            scale: bytemuck::cast(scale),
            form: form.map(|words| words as u32),
            scattered: tint.extend(part.scattered_scale).to_array(),
        }
    }
}

/// The colour that light takes on from a leaf, by its luminance; white where leaves are black.
///
/// With one channel a transfer holds what comes over other leaves by the luminance of their colours. That of the sky is a
/// few percent of its light and stays without colour; that of the sun is most of what lights the shade inside a crown.
pub fn scattered_tint(leaves: &LeafColors) -> Vec3 {
    let color = leaves.reflected + leaves.transmitted;
    let light = luminance(color);
    if light > 1e-4 { color / light } else { Vec3::ONE }
}

/// What the shaders know of each plant.
pub fn variants(plants: &[BakedPlant], sizes: &[VariantSize]) -> Vec<VariantUniform> {
    let mut lit_layer = 0;
    plants
        .iter()
        .zip(sizes)
        .enumerate()
        .map(|(index, (plant, size))| {
            let variant = variant(index, plant, size, lit_layer);
            lit_layer += plant.cross.textures.light.len();
            variant
        })
        .collect()
}

/// `lit_layer`: the first of its lighting pictures, if it has any.
fn variant(index: usize, plant: &BakedPlant, size: &VariantSize, lit_layer: usize) -> VariantUniform {
    let mut planes = [PlaneUniform::default(); PLANES];
    for (slot, plane) in planes.iter_mut().zip(&plant.cross.planes) {
        *slot = PlaneUniform {
            center: plane.center.extend(0.0).to_array(),
            u: plane.u.extend(0.0).to_array(),
            v: plane.v.extend(0.0).to_array(),
            normal: plane.normal.extend(0.0).to_array(),
        };
    }
    let traced = f32::from(u8::from(matches!(*plant.lighting, BakedLighting::Transfer(_))));
    let gloss = plant.plant.leaf_gloss();
    let (mean, rise) = plant.lighting.scattered();
    VariantUniform {
        planes,
        size: [size.height, size.radius, (index * PLANES) as f32, 1.0],
        transmission: plant.cross.transmission.extend(traced).to_array(),
        spread: bytemuck::cast(plant.cross.spread),
        gloss: [gloss.reflectance, gloss.roughness, realigned(&plant.lighting), lit_layer as f32],
        scattered: scattered_tint(&plant.plant.leaf_colors()).extend(mean).to_array(),
        scattered_rise: [rise, 0.0, 0.0, 0.0],
    }
}

/// 1 where the foliage's normals point out of the crown.
fn realigned(lighting: &BakedLighting) -> f32 {
    f32::from(u8::from(lighting.is_realigned()))
}

/// What the shaders know of a part's material.
pub fn part_uniform(material: &PlantMaterial, lighting: &BakedLighting) -> PartUniform {
    let gloss = material.gloss.in_range();
    PartUniform {
        base_color: material.base_color.extend(1.0).to_array(),
        transmission: material.transmission.extend(realigned(lighting)).to_array(),
        gloss: [gloss.reflectance, gloss.roughness, 0.0, 0.0],
    }
}
