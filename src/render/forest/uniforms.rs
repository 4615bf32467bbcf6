//! The uniforms of a forest, its plants and their parts.

use bytemuck::{Pod, Zeroable};

use glam::Vec3;

use crate::{
    bake::{
        BakedPlant,
        levels::cross::{ISOTROPIC_LEVELS, MOST_UPRIGHTS},
        lighting::{
            BakedLighting,
            transfer::{PackedPart, TransferSettings, code_words, mean_words},
        },
    },
    light::sh::MAX_BANDS,
    lod::level_distance::inverse_height,
    math::luminance,
    plant::{LeafColors, PlantMaterial, lobe_gain, lobe_room, tissue_light::TissueLight},
    scatter::PlantSize,
    style::layers,
};

/// `ForestView` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ForestViewUniform {
    /// Cell of the anchor, counted from the base of the stand's grid.
    pub anchor_cell: [i32; 2],
    /// Metres of the anchor inside its cell.
    pub anchor_offset: [f32; 2],
    /// Anchor's height over the stand's datum.
    pub anchor_y: f32,
    /// Metres along a cell's side.
    pub cell_size: f32,
    /// Distances in metres over which the level fades in.
    pub fade_in: [f32; 2],
    /// Distances in metres over which it fades out.
    pub fade_out: [f32; 2],
    /// WGSL aligns the next member to 16 bytes.
    pub padding: [f32; 2],
    /// Linear colour of the level's tint, and its weight.
    pub tint: [f32; 4],
}

/// `Plane` of `shaders/forest/cross_variant.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PlaneUniform {
    /// Centre of the billboard, metres in the plant's frame.
    pub center: [f32; 4],
    /// Half extent to the billboard's right.
    pub u: [f32; 4],
    /// Half extent upwards.
    pub v: [f32; 4],
    /// Unit normal towards the side from which the texture was rendered.
    pub normal: [f32; 4],
}

/// The most planes of a cross.
pub const MOST_PLANES: usize = MOST_UPRIGHTS as usize + 1;
/// Vertices that the shader pulls for a tree's cross: an upright quad that faces the viewer, and the level plane.
pub const CROSS_VERTICES: u32 = 12;
/// Vertices that the caster's shader pulls for a tree's cross: an upright plane and the level one.
pub const CROSS_CASTER_VERTICES: u32 = 12;

/// `Variant` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VariantUniform {
    /// Metres.
    pub height: f32,
    /// Metres.
    pub crown_radius: f32,
    /// 1 if it is lit by radiance transfer: its ambient occlusion is ray-traced, and includes light scattered by
    /// leaves.
    pub radiance_transfer: u32,
    /// Specular reflectance of its leaves.
    pub specular_reflectance: f32,
    /// Root mean square slope of their facets.
    pub roughness: f32,
    /// 1 if the foliage's normals are realigned to point out of the crown, else 0.
    pub realigned: f32,
    /// For billboard clouds, mean indirect light of the key light over its leaves: the component of SH band 1 towards the zenith.
    pub indirect_sun_zenith: f32,
    /// The first coefficient (band 0) of the same.
    pub indirect_sun_mean: f32,
    /// The colour of the same.
    pub indirect_sun_color: [f32; 3],
    /// How its leaves are lit by their ambient visibility, an [`AmbientTerm`](crate::bake::lighting::AmbientTerm).
    pub ambient_term: u32,
    /// Strength of the lobe of its gloss that carries a share of 1 ([`lobe_gain`]).
    pub lobe_gain: f32,
    /// Greatest share of the lobe over the fraction of light that is absorbed ([`lobe_room`]).
    pub lobe_room: f32,
    /// Factor on the cover around it: 0 where its k_a holds the shade of the trees around already, else 1.
    pub cover_weight: f32,
    /// Its [`inverse_height`].
    pub inverse_height: u32,
    /// Layer of its foliage in the styles ([`layers`](crate::style::layers)).
    pub foliage_layer: u32,
    /// WGSL rounds the size up to 16 bytes.
    pub padding: [u32; 3],
}

/// `CrossVariant` of `shaders/forest/cross_variant.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CrossVariantUniform {
    /// The upright planes, then the level one.
    pub planes: [PlaneUniform; MOST_PLANES],
    /// Mean factor for light through its leaves ([`PlantMaterial::transmission`]).
    pub transmission: [f32; 3],
    /// First layer of its textures.
    pub first_layer: u32,
    /// Fraction of a texel's leaf area with isotropic normals, mip by mip.
    pub isotropic_fraction: [[f32; 4]; ISOTROPIC_LEVELS / 4],
    /// First layer of its lighting textures, if it has any.
    pub first_light_layer: u32,
    /// Number of upright planes.
    pub uprights: u32,
    /// WGSL rounds the size up to 16 bytes.
    pub padding: [u32; 2],
}

/// `Part` of `shaders/forest/model.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PartUniform {
    /// Linear factor on the texture.
    pub base_color: [f32; 3],
    /// 1 if the normals are realigned: they point out of the crown, whichever side of a leaf is seen; else 0.
    pub realigned: f32,
    /// Factor for light from behind ([`PlantMaterial::transmission`]).
    pub transmission: [f32; 3],
    /// Specular reflectance of a leaf's surface; 0: matt.
    pub specular_reflectance: f32,
    /// Root mean square slope of its facets.
    pub roughness: f32,
    /// How its leaves are lit by their ambient visibility, an [`AmbientTerm`](crate::bake::lighting::AmbientTerm).
    pub ambient_term: u32,
    /// Strength of the lobe of its gloss that carries a share of 1 ([`lobe_gain`]).
    pub lobe_gain: f32,
    /// Greatest share of the lobe over the fraction of light that is absorbed ([`lobe_room`]).
    pub lobe_room: f32,
    /// Factor on the cover around it: 0 where its k_a holds the shade of the trees around already, else 1.
    pub cover_weight: f32,
    /// Alignment.
    pub padding: [u32; 3],
    /// Of leaves with layers, the factors of an angle on the light that is sent back and let through, of the front and of
    /// the back ([`TissueLight`]).
    pub front_reflected: [f32; 4],
    /// The second of them.
    pub front_transmitted: [f32; 4],
    /// The third.
    pub back_reflected: [f32; 4],
    /// The last.
    pub back_transmitted: [f32; 4],
}

/// Words of four coefficients after the first, of all bands.
pub const WORDS: usize = (MAX_BANDS * MAX_BANDS - 1).div_ceil(4);

/// `Transfer` of `shaders/forest/transfer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TransferUniform {
    /// Scale of each coefficient after the first, relative to it: the value of code 127; four per word of codes.
    pub scale: [[f32; 4]; WORDS],
    /// Words from one vertex to the next.
    pub vertex_words: u32,
    /// Number of words of a vertex's means, which come first.
    pub mean_words: u32,
    /// Words of the codes of one side and channel.
    pub side_words: u32,
    /// Index of the first code of the indirect key light, one word per vertex.
    pub indirect_sun_start: u32,
    /// Colour of the indirect key light, which is scattered between leaves.
    pub indirect_sun_color: [f32; 3],
    /// Scale of its codes: the value of code 127.
    pub indirect_sun_scale: f32,
}

impl TransferUniform {
    /// The uniform of one part of a plant.
    pub fn new(settings: &TransferSettings, part: &PackedPart, tint: Vec3) -> Self {
        let mut scale = [0.0; 4 * WORDS];
        for (i, scale) in scale.iter_mut().enumerate() {
            *scale = part.scale.get((i + 1).isqrt()).copied().unwrap_or(0.0);
        }
        Self {
            scale: bytemuck::cast(scale),
            vertex_words: (part.vertex_bytes / 4) as u32,
            mean_words: mean_words(settings, part.sides) as u32,
            side_words: code_words(settings) as u32,
            indirect_sun_start: (part.bytes.len() / 4) as u32,
            indirect_sun_color: tint.to_array(),
            indirect_sun_scale: part.indirect_sun_scale,
        }
    }
}

/// The colour of indirect light, which leaves have scattered: their own colour divided by its luminance; white for
/// black leaves.
///
/// A transfer with one channel stores light from other leaves by the luminance of their colours. Scattered light of the
/// sky is a few percent of the sky's light and stays uncoloured; that of the sun is most of the light in the shade
/// inside a crown.
pub fn indirect_light_color(leaves: &LeafColors) -> Vec3 {
    let color = leaves.reflected + leaves.transmitted;
    let light = luminance(color);
    if light > 1e-4 { color / light } else { Vec3::ONE }
}

/// The uniforms of each plant.
pub fn variants(plants: &[BakedPlant], sizes: &[PlantSize]) -> Vec<VariantUniform> {
    let groups = foliage_groups(plants);
    let layer = |group: &u8| u32::from(layers::FIRST_FOLIAGE) + u32::from(*group);
    let uniform = |((plant, size), group)| VariantUniform { foliage_layer: layer(group), ..variant(plant, size) };
    plants.iter().zip(sizes).zip(&groups).map(uniform).collect()
}

/// The layer of foliage (0, 1, ...) of each plant: those with leaves of one colour share it.
pub fn foliage_groups(plants: &[BakedPlant]) -> Vec<u8> {
    layers_of(plants.iter().map(|plant| plant.plant.leaf_colors().reflected))
}

/// The same for the colours of the plants' leaves.
pub fn layers_of(colors: impl Iterator<Item = Vec3>) -> Vec<u8> {
    layers::foliage_groups(&colors.collect::<Vec<_>>(), layers::MOST_FOLIAGE)
}

fn variant(plant: &BakedPlant, size: &PlantSize) -> VariantUniform {
    let gloss = plant.plant.leaf_gloss();
    let (mean, zenith) = plant.lighting.indirect_sun();
    VariantUniform {
        height: size.height,
        crown_radius: size.radius,
        radiance_transfer: u32::from(matches!(*plant.lighting, BakedLighting::Transfer(_))),
        specular_reflectance: gloss.reflectance,
        roughness: gloss.roughness,
        realigned: realigned(&plant.lighting),
        indirect_sun_zenith: zenith,
        indirect_sun_color: indirect_light_color(&plant.plant.leaf_colors()).to_array(),
        indirect_sun_mean: mean,
        ambient_term: plant.lighting.ambient_term() as u32,
        lobe_gain: lobe_gain(gloss.roughness),
        lobe_room: lobe_room(gloss.roughness),
        cover_weight: cover_weight(&plant.lighting),
        inverse_height: inverse_height(size.height),
        foliage_layer: 0,
        padding: [0; 3],
    }
}

/// The uniforms of the crosses of each plant; planes without extent for a plant without a cross.
pub fn cross_variants(plants: &[BakedPlant]) -> Vec<CrossVariantUniform> {
    let (mut first_layer, mut first_light_layer) = (0, 0);
    let mut variants = Vec::with_capacity(plants.len());
    for plant in plants {
        let mut variant = CrossVariantUniform { first_layer, first_light_layer, ..CrossVariantUniform::default() };
        if let Some(cross) = plant.cross() {
            for (slot, plane) in variant.planes.iter_mut().zip(&cross.planes) {
                *slot = PlaneUniform {
                    center: plane.center.extend(0.0).to_array(),
                    u: plane.u.extend(0.0).to_array(),
                    v: plane.v.extend(0.0).to_array(),
                    normal: plane.normal.extend(0.0).to_array(),
                };
            }
            variant.transmission = cross.transmission.to_array();
            variant.isotropic_fraction = bytemuck::cast(cross.isotropic_fraction);
            variant.uprights = cross.uprights().len() as u32;
            first_layer += cross.planes.len() as u32;
            first_light_layer += cross.textures.light.len() as u32;
        }
        variants.push(variant);
    }
    variants
}

/// 1 if the foliage's normals are realigned.
fn realigned(lighting: &BakedLighting) -> f32 {
    f32::from(u8::from(lighting.is_realigned()))
}

/// Factor on the cover around a plant: neighbours that are in its k_a do not count again.
fn cover_weight(lighting: &BakedLighting) -> f32 {
    if lighting.is_lit_together() { 0.0 } else { 1.0 }
}

/// What the shaders know of a part's material.
pub fn part_uniform(material: &PlantMaterial, lighting: &BakedLighting, tissue: Option<TissueLight>) -> PartUniform {
    let gloss = material.gloss.sanitized();
    let tissue = tissue.unwrap_or(TissueLight::LAMBERT);
    PartUniform {
        base_color: material.base_color.to_array(),
        realigned: realigned(lighting),
        transmission: material.transmission.to_array(),
        specular_reflectance: gloss.reflectance,
        roughness: gloss.roughness,
        ambient_term: lighting.ambient_term() as u32,
        lobe_gain: lobe_gain(gloss.roughness),
        lobe_room: lobe_room(gloss.roughness),
        cover_weight: cover_weight(lighting),
        padding: [0; 3],
        front_reflected: tissue.front.reflected.0.to_array(),
        front_transmitted: tissue.front.transmitted.0.to_array(),
        back_reflected: tissue.back.reflected.0.to_array(),
        back_transmitted: tissue.back.transmitted.0.to_array(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        bake::{
            BakeSettings, bake_plant,
            lighting::{
                AmbientTerm, LightingSettings,
                implicit::{AmbientField, ImplicitSettings},
            },
        },
        plant::grow::{GrowParameters, grow},
    };

    #[test]
    fn the_shaders_know_by_which_equations_leaves_are_lit() -> Result<(), Box<dyn std::error::Error>> {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000)?);
        let expressive = |ambient, radius| {
            LightingSettings::Expressive(ImplicitSettings { ambient, radius, ..ImplicitSettings::default() })
        };
        for (lighting, term) in [
            (LightingSettings::Local, AmbientTerm::None),
            (expressive(AmbientField::Depth, None), AmbientTerm::Fitted),
            (expressive(AmbientField::Published, None), AmbientTerm::Published),
            // Without a field k_a is 1, and the equations are the published ones still.
            (expressive(AmbientField::Published, Some(0.0)), AmbientTerm::Published),
        ] {
            let (plant, _) = bake_plant(plant.clone(), &BakeSettings { lighting, ..BakeSettings::default() }, None);
            assert_eq!(plant.lighting.ambient_term(), term);
            assert_eq!(variants(std::slice::from_ref(&plant), &[plant.size()])[0].ambient_term, term as u32);
            assert_eq!(part_uniform(&PlantMaterial::default(), &plant.lighting, None).ambient_term, term as u32);
        }
        Ok(())
    }

    #[test]
    fn a_share_of_1_of_their_own_normals_lights_leaves_as_leaves() -> Result<(), Box<dyn std::error::Error>> {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000)?);
        let baked = |lighting| bake_plant(plant.clone(), &BakeSettings { lighting, ..BakeSettings::default() }, None).0;
        let expressive =
            |own_normal| baked(LightingSettings::Expressive(ImplicitSettings { own_normal, ..Default::default() }));
        let (local, own, half) = (baked(LightingSettings::Local), expressive(1.0), expressive(0.5));
        for (part, source) in plant.parts.iter().enumerate() {
            let realigned = |plant: &BakedPlant| part_uniform(&source.material, &plant.lighting, None).realigned;
            assert_eq!([realigned(&local), realigned(&own), realigned(&half)], [0.0, 0.0, 1.0]);
            assert_eq!(own.lighting.normals(part), None, "the leaves keep their own");
        }
        // Crosses too: their texels' normals are those of leaves, whose visible side counts.
        let normals = |plant: &BakedPlant| -> Vec<[u8; 2]> {
            let textures = plant.cross().into_iter().flat_map(|cross| &cross.textures.properties);
            textures
                .flat_map(|texture| texture.texels.levels[0].chunks_exact(4).map(|texel| [texel[0], texel[1]]))
                .collect()
        };
        assert!(normals(&own) == normals(&local) && normals(&half) != normals(&local));
        Ok(())
    }
}
