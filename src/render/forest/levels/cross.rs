//! Crossed billboards [Franzke 2005, 4.3]: an upright quad and the level plane per tree; one draw call with vertex pulling for the trees of
//! all variants. The shadow caster is one vertical plane that faces the light's azimuth, and the horizontal one.

use std::sync::Arc;

use bevy::{
    asset::Handle,
    log::error,
    render::{
        render_phase::TrackedRenderPass,
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferUsages, ColorWrites, FilterMode, FragmentState, MipmapFilterMode, RenderPipelineDescriptor,
            SamplerBindingType, SamplerDescriptor, ShaderStages, Texture, TextureSampleType, VertexState,
            binding_types::{sampler, storage_buffer_read_only_sized, texture_2d_array},
        },
    },
    shader::{Shader, ShaderDefVal},
};
use glam::Vec3;

use super::not_baked::tell_not_baked;
use crate::{
    bake::{
        BakedPlant,
        levels::{cross::Cross, texture::LevelTexture},
    },
    cull::Grouping,
    lod::Representation,
    render::{
        components::Forest,
        forest::{
            block_textures::{TexelKind, rewrite, upload_textures},
            representation::{
                DEPTH_FIRST, DrawnTrees, ForestUpload, GpuLevel, LevelRenderer, LevelTarget, Relight, TreeDraw,
                TreeVertices,
            },
            uniforms::{CROSS_CASTER_VERTICES, CROSS_VERTICES, cross_variants},
        },
        gpu,
        shaders::{CanopyShaders, ShaderFile},
        view::ViewFormat,
    },
};

/// Draws crossed billboards.
pub struct CrossRenderer {
    shader: Handle<Shader>,
    caster: Handle<Shader>,
}

impl CrossRenderer {
    /// With Canopy's own shaders.
    pub fn new(shaders: &CanopyShaders) -> Self {
        Self { shader: shaders.get(ShaderFile::ForestCross), caster: shaders.get(ShaderFile::SunShadowCross) }
    }
}

/// How the sky's light reaches the crosses of a forest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossLight {
    /// All by normal and ambient occlusion (k_a).
    Plain,
    /// Some by lighting textures.
    Mixed,
    /// All by lighting textures.
    Textured,
}

impl CrossLight {
    /// All values.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Mixed, Self::Textured];

    /// The value for the crosses of these plants.
    pub fn of(plants: &[BakedPlant]) -> Self {
        let lit = plants.iter().filter(|plant| has_light(plant)).count();
        match lit {
            0 => Self::Plain,
            all if all == plants.len() => Self::Textured,
            _ => Self::Mixed,
        }
    }
}

/// The bit of the features that tells that the light of the sun is in blocks, two values a layer.
const SUN_PAIRS: u32 = 1 << 8;

/// Whether a plant's crosses have lighting textures.
fn has_light(plant: &BakedPlant) -> bool {
    plant.cross().is_some_and(|cross| !cross.textures.light.is_empty())
}

/// Group 2: colours, properties, sampler, the data of each plant's crosses, and the light of the sun.
fn cross_layout() -> BindGroupLayoutDescriptor {
    let float = TextureSampleType::Float { filterable: true };
    BindGroupLayoutDescriptor::new(
        "canopy_cross",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                texture_2d_array(float),
                texture_2d_array(float),
                sampler(SamplerBindingType::Filtering),
                storage_buffer_read_only_sized(false, None).visibility(ShaderStages::VERTEX_FRAGMENT),
                texture_2d_array(float),
            ),
        ),
    )
}

/// Group 3, if some plants have lighting textures.
fn light_layout() -> BindGroupLayoutDescriptor {
    let float = TextureSampleType::Float { filterable: true };
    BindGroupLayoutDescriptor::new(
        "canopy_cross_light",
        &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, texture_2d_array(float)),
    )
}

impl LevelRenderer for CrossRenderer {
    fn representation(&self) -> Representation {
        Representation::CROSS
    }

    fn label(&self) -> &'static str {
        "crosses"
    }

    fn tint(&self) -> Vec3 {
        Vec3::new(0.2, 0.35, 1.0)
    }

    fn styled(&self) -> bool {
        true
    }

    fn grouping(&self) -> Grouping {
        Grouping::Together
    }

    fn coarsest_shadow_texel(&self) -> Option<f64> {
        Some(f64::INFINITY)
    }

    fn upload(&self, forest: &Forest, upload: &mut ForestUpload) -> Box<dyn GpuLevel> {
        let plants = &forest.plants;
        tell_not_baked(plants, self);
        let (layers, limit) =
            (plane_count(plants) * SUN_LAYERS, upload.gpu.device.limits().max_texture_array_layers as usize);
        if layers > limit {
            error!(
                "a forest's {} plants need {layers} texture layers for their crossed billboards, but this device has at \
                 most {limit}: they are not drawn so; use at most {} plants in a forest, or another list of levels",
                plants.len(),
                limit * plants.len() / layers
            );
            return Box::new(GpuCrosses { drawn: None });
        }
        let (properties, sun, variants, bind_group) = upload_group(plants, upload);
        let (light, light_textures) = (CrossLight::of(plants), upload_light(plants, upload));
        let drawn = DrawnCrosses { properties, sun, variants, bind_group, light, light_textures };
        Box::new(GpuCrosses { drawn: Some(drawn) })
    }

    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool {
        match (old.cross(), new.cross()) {
            (Some(old), Some(new)) => Arc::ptr_eq(old, new) || same_outline(old, new),
            (old, new) => old.is_none() && new.is_none(),
        }
    }

    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        let mut defs: Vec<ShaderDefVal> = vec!["FOLIAGE".into()];
        let mut groups = vec![cross_layout()];
        let LevelTarget::View(attachment) = target else {
            return RenderPipelineDescriptor {
                label: Some("canopy_caster_crosses".into()),
                layout: target.layouts(groups),
                vertex: VertexState {
                    shader: self.caster.clone(),
                    shader_defs: defs.clone(),
                    entry_point: Some("vertex".into()),
                    buffers: Vec::new(),
                },
                depth_stencil: Some(target.depth()),
                fragment: Some(FragmentState {
                    shader: self.caster.clone(),
                    shader_defs: defs,
                    entry_point: Some("fragment".into()),
                    targets: Vec::new(),
                }),
                ..Default::default()
            };
        };
        let light = CrossLight::ALL[(features & !SUN_PAIRS) as usize % CrossLight::ALL.len()];
        if features & SUN_PAIRS != 0 {
            defs.push("SUN_PAIRS".into());
        }
        if light != CrossLight::Plain {
            defs.push("TRANSFER".into());
            groups.push(light_layout());
        }
        if light == CrossLight::Mixed {
            defs.push("PLAIN_TOO".into());
        }
        let to_coverage = attachment.samples > 1;
        if to_coverage {
            defs.push("ALPHA_TO_COVERAGE".into());
        }
        let mut pipeline = attachment.pipeline(&self.shader, defs, target.depth());
        pipeline.label = Some("canopy_crosses".into());
        pipeline.layout = target.layouts(groups);
        pipeline.multisample.alpha_to_coverage_enabled = to_coverage;
        pipeline
    }

    fn depth_pipeline(&self, _: u32, format: ViewFormat) -> Option<RenderPipelineDescriptor> {
        // With several samples a pixel the depth costs more than it saves: docs/decisions/0023.
        if format.samples > 1 {
            return None;
        }
        let plain = CrossLight::ALL.iter().position(|light| *light == CrossLight::Plain)?;
        let mut pipeline = self.pipeline(plain as u32, LevelTarget::View(format));
        pipeline.label = Some("canopy_crosses_depth".into());
        pipeline.vertex.shader_defs.push(DEPTH_FIRST.into());
        let fragment = pipeline.fragment.as_mut()?;
        fragment.shader_defs.push(DEPTH_FIRST.into());
        fragment.entry_point = Some("depth".into());
        // The attachment's colours stay as they are.
        fragment.targets.iter_mut().flatten().for_each(|target| target.write_mask = ColorWrites::empty());
        Some(pipeline)
    }
}

/// The crosses of a forest's plants; `None` if the device cannot hold them.
struct GpuCrosses {
    drawn: Option<DrawnCrosses>,
}

struct DrawnCrosses {
    /// Normals, ambient occlusion (k_a) and foliage, a layer per plane.
    properties: Texture,
    /// The light of the sun: four values a layer and two layers a plane, or in blocks two values and four layers.
    sun: Texture,
    /// [`CrossVariantUniform`](crate::render::forest::CrossVariantUniform)s.
    variants: Buffer,
    /// Group 2.
    bind_group: BindGroup,
    /// The pipeline that draws them.
    light: CrossLight,
    /// Group 3, if some have lighting textures.
    light_textures: Option<BindGroup>,
}

impl DrawnCrosses {
    fn features(&self) -> u32 {
        let light = CrossLight::ALL.iter().position(|known| *known == self.light).unwrap_or(0) as u32;
        if self.sun.format().is_compressed() { light | SUN_PAIRS } else { light }
    }
}

/// The one draw call.
fn all_crosses(target: LevelTarget) -> TreeDraw {
    let vertices = match target {
        LevelTarget::View(_) => CROSS_VERTICES,
        LevelTarget::ShadowMap => CROSS_CASTER_VERTICES,
    };
    TreeDraw { group: 0, vertices: TreeVertices::Pulled(vertices) }
}

impl GpuLevel for GpuCrosses {
    fn features(&self, target: LevelTarget) -> Vec<u32> {
        match (&self.drawn, target) {
            (None, _) => Vec::new(),
            (Some(drawn), LevelTarget::View(_)) => vec![drawn.features()],
            (Some(_), LevelTarget::ShadowMap) => vec![0],
        }
    }

    fn triangles(&self, _: usize) -> usize {
        CROSS_VERTICES as usize / 3
    }

    fn draws(&self, target: LevelTarget) -> Vec<TreeDraw> {
        self.drawn.iter().map(|_| all_crosses(target)).collect()
    }

    fn draw<'a>(&'a self, pass: &mut TrackedRenderPass<'a>, _: u32, target: LevelTarget, trees: &DrawnTrees<'a>) {
        let Some(drawn) = self.drawn.as_ref().filter(|_| !trees.is_empty(0)) else { return };
        pass.set_bind_group(2, &drawn.bind_group, &[]);
        if let (LevelTarget::View(_), Some(textures)) = (target, &drawn.light_textures) {
            pass.set_bind_group(3, textures, &[]);
        }
        trees.draw(pass, all_crosses(target));
    }

    fn relight(&mut self, relight: &Relight, upload: &mut ForestUpload) {
        let Some(drawn) = &mut self.drawn else { return };
        let changed = |(old, new): &(&BakedPlant, &BakedPlant)| match (old.cross(), new.cross()) {
            (Some(old), Some(new)) => !Arc::ptr_eq(old, new),
            _ => false,
        };
        let pairs = || relight.old.iter().zip(relight.new);
        let variants = cross_variants(relight.new);
        for (index, (_, new)) in pairs().enumerate().filter(|(_, pair)| changed(pair)) {
            let Some(cross) = new.cross() else { continue };
            let first = variants.get(index).map_or(0, |variant| variant.first_layer);
            for (layer, texture) in (first..).zip(&cross.textures.properties) {
                rewrite(upload, &drawn.properties, TexelKind::Linear, layer, texture);
            }
            for (layer, texture) in (first * SUN_LAYERS as u32..).zip(&cross.textures.sun) {
                rewrite(upload, &drawn.sun, TexelKind::Pairs, layer, texture);
            }
        }
        upload.gpu.queue.write_buffer(&drawn.variants, 0, bytemuck::cast_slice(&variants));
        if pairs().filter(changed).any(|(old, new)| has_light(old) || has_light(new)) {
            // Adding or removing a plant's lighting textures moves the layers of the others.
            drawn.light = CrossLight::of(relight.new);
            drawn.light_textures = upload_light(&Arc::new(relight.new.to_vec()), upload);
        }
    }
}

/// Textures of the sun's light per plane.
const SUN_LAYERS: usize = 2;

/// Planes of all crosses.
fn plane_count(plants: &[BakedPlant]) -> usize {
    plants.iter().filter_map(BakedPlant::cross).map(|cross| cross.planes.len()).sum()
}

/// A layer of the textures that `of` takes from the crosses, one cross after the other.
fn layer(plants: &[BakedPlant], index: usize, of: fn(&Cross) -> &[LevelTexture]) -> Option<&LevelTexture> {
    let crosses = plants.iter().filter_map(BakedPlant::cross);
    crosses.flat_map(|cross| of(cross)).nth(index)
}

/// The textures of all crosses' properties and of the sun's light, the data of each plant's crosses, and their bind group.
fn upload_group(plants: &Arc<Vec<BakedPlant>>, upload: &mut ForestUpload) -> (Texture, Texture, Buffer, BindGroup) {
    let layers = plane_count(plants);
    let mut array = |label, kind, layers, find| upload_textures(upload, label, kind, layers, plants, find);
    let (_, colors) = array("canopy_cross_color", TexelKind::Color, layers, |plants, index| {
        layer(plants, index, |cross| &cross.textures.color)
    });
    let (property_texture, properties) =
        array("canopy_cross_properties", TexelKind::Linear, layers, |plants, index| {
            layer(plants, index, |cross| &cross.textures.properties)
        });
    let (sun_texture, sun) = array("canopy_cross_sun", TexelKind::Pairs, layers * SUN_LAYERS, |plants, index| {
        layer(plants, index, |cross| &cross.textures.sun)
    });
    let gpu = upload.gpu;
    let sampler = gpu.device.create_sampler(&SamplerDescriptor {
        label: Some("canopy_cross"),
        address_mode_u: AddressMode::ClampToEdge,
        address_mode_v: AddressMode::ClampToEdge,
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        mipmap_filter: MipmapFilterMode::Linear,
        ..Default::default()
    });
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
    let variants = gpu::buffer_with(&gpu.device, "canopy_cross_variants", usage, &cross_variants(plants));
    let bind_group = gpu.bind_group(
        "canopy_cross",
        &cross_layout(),
        &BindGroupEntries::sequential((&colors, &properties, &sampler, variants.as_entire_binding(), &sun)),
    );
    (property_texture, sun_texture, variants, bind_group)
}

/// The lighting textures, of those plants that have them.
fn upload_light(plants: &Arc<Vec<BakedPlant>>, upload: &mut ForestUpload) -> Option<BindGroup> {
    let layers = plants.iter().filter_map(BakedPlant::cross).map(|cross| cross.textures.light.len()).sum();
    if layers == 0 {
        return None;
    }
    let label = "canopy_cross_light";
    let (_, view) = upload_textures(upload, label, TexelKind::Linear, layers, plants, |plants, index| {
        layer(plants, index, |cross| &cross.textures.light)
    });
    Some(upload.gpu.bind_group(label, &light_layout(), &BindGroupEntries::single(&view)))
}

/// Whether crosses have the same planes, colours and outlines. A bake with another lighting creates equal ones in other
/// memory.
fn same_outline(old: &Cross, new: &Cross) -> bool {
    let sizes = |cross: &Cross| -> Vec<_> {
        cross.textures.properties.iter().chain(&cross.textures.sun).map(LevelTexture::shape).collect()
    };
    old.planes == new.planes && sizes(old) == sizes(new) && old.textures.color == new.textures.color
}
