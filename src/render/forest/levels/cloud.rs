//! Billboard clouds [Franzke 2005, 4.3.1]: the planes of a plant by vertex pulling, an instance a tree and a draw call a
//! variant; trunk and limbs as full models. The planes cast their own shadow.

use std::{ops::Range, sync::Arc};

use bevy::{
    asset::Handle,
    log::error,
    render::{
        render_phase::TrackedRenderPass,
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferUsages, FilterMode, FragmentState, MipmapFilterMode, RenderPipelineDescriptor, SamplerBindingType,
            SamplerDescriptor, ShaderStages, Texture, TextureSampleType, VertexState,
            binding_types::{sampler, storage_buffer_read_only_sized, texture_2d_array},
        },
    },
    shader::{Shader, ShaderDefVal},
};
use glam::Vec3;

use super::{
    model::ModelRenderer,
    not_baked::tell_not_baked,
    reduced::{GpuReduced, Reduced},
};
use crate::{
    bake::{
        BakedPlant,
        levels::{cloud::Cloud, texture::LevelTexture},
    },
    cull::Grouping,
    lod::Representation,
    render::{
        components::Forest,
        forest::{
            block_textures::{TexelKind, rewrite, upload_textures},
            cloud_uniforms::{cloud_planes, cloud_variants},
            representation::{
                DrawnTrees, ForestUpload, GpuLevel, LevelRenderer, LevelTarget, Relight, TreeDraw, TreeVertices,
            },
        },
        gpu,
        shaders::{CanopyShaders, ShaderFile},
    },
};

/// Metres per texel of the coarsest shadow map for which all planes are drawn; crosses serve coarser ones.
const COARSEST_SHADOW_TEXEL: f64 = 0.4;
/// The bit of the features that tells planes from wood.
const PLANES: u32 = 1 << 16;

/// Draws billboard clouds.
pub struct CloudRenderer {
    shader: Handle<Shader>,
    caster: Handle<Shader>,
    wood: ModelRenderer,
}

impl CloudRenderer {
    /// With Canopy's own shaders.
    pub fn new(shaders: &CanopyShaders) -> Self {
        Self {
            shader: shaders.get(ShaderFile::ForestCloud),
            caster: shaders.get(ShaderFile::SunShadowCloud),
            wood: ModelRenderer::new(shaders),
        }
    }
}

const WOOD: Reduced = |plant| plant.cloud().map(|cloud| cloud.wood.baked(plant));

/// How the sky's light reaches the planes of a forest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CloudLight {
    /// All by normal and ambient occlusion (k_a).
    Plain,
    /// Some by lighting textures.
    Mixed,
    /// All by lighting textures.
    Textured,
}

impl CloudLight {
    const ALL: [Self; 3] = [Self::Plain, Self::Mixed, Self::Textured];

    fn of(plants: &[BakedPlant]) -> Self {
        let clouds = || plants.iter().filter_map(BakedPlant::cloud);
        match clouds().filter(|cloud| cloud.textures.light.is_some()).count() {
            0 => Self::Plain,
            all if all == clouds().count() => Self::Textured,
            _ => Self::Mixed,
        }
    }
}

/// Group 2: colours, properties, sampler, planes, and the data of each plant.
fn cloud_layout() -> BindGroupLayoutDescriptor {
    let float = TextureSampleType::Float { filterable: true };
    BindGroupLayoutDescriptor::new(
        "canopy_cloud",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                texture_2d_array(float),
                texture_2d_array(float),
                sampler(SamplerBindingType::Filtering),
                storage_buffer_read_only_sized(false, None).visibility(ShaderStages::VERTEX),
                storage_buffer_read_only_sized(false, None),
            ),
        ),
    )
}

/// Group 3, if some plants have lighting textures.
fn light_layout() -> BindGroupLayoutDescriptor {
    let float = TextureSampleType::Float { filterable: true };
    BindGroupLayoutDescriptor::new(
        "canopy_cloud_light",
        &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, texture_2d_array(float)),
    )
}

impl LevelRenderer for CloudRenderer {
    fn representation(&self) -> Representation {
        Representation::CLOUD
    }

    fn label(&self) -> &'static str {
        "billboard clouds"
    }

    fn tint(&self) -> Vec3 {
        Vec3::new(0.1, 0.8, 0.9)
    }

    fn styled(&self) -> bool {
        true
    }

    fn grouping(&self) -> Grouping {
        Grouping::ByVariant
    }

    fn coarsest_shadow_texel(&self) -> Option<f64> {
        Some(COARSEST_SHADOW_TEXEL)
    }

    fn upload(&self, forest: &Forest, upload: &mut ForestUpload) -> Box<dyn GpuLevel> {
        let plants = &forest.plants;
        tell_not_baked(plants, self);
        let limit = upload.gpu.device.limits().max_texture_array_layers as usize;
        let drawn = if plants.len() > limit {
            error!(
                "a forest's {} plants need a texture layer each for their billboard clouds, but this device has at most \
                 {limit}: only their wood is drawn so; use fewer plants in a forest, or another list of levels",
                plants.len()
            );
            None
        } else {
            Some(DrawnPlanes::new(plants, upload))
        };
        let wood = GpuReduced::new(&self.wood, forest, WOOD, upload);
        Box::new(GpuClouds { wood, drawn })
    }

    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool {
        let same = match (old.cloud(), new.cloud()) {
            (Some(old), Some(new)) => Arc::ptr_eq(old, new) || same_outline(old, new),
            (old, new) => old.is_none() && new.is_none(),
        };
        same && self.wood.same_shape(old, new)
    }

    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        if features & PLANES == 0 {
            return self.wood.pipeline(features, target);
        }
        let mut defs: Vec<ShaderDefVal> = vec!["FOLIAGE".into()];
        let mut groups = vec![cloud_layout()];
        let LevelTarget::View(attachment) = target else {
            return RenderPipelineDescriptor {
                label: Some("canopy_caster_clouds".into()),
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
        let light = CloudLight::ALL[(features & !PLANES) as usize % CloudLight::ALL.len()];
        if light != CloudLight::Plain {
            defs.push("TRANSFER".into());
            groups.push(light_layout());
        }
        if light == CloudLight::Mixed {
            defs.push("PLAIN_TOO".into());
        }
        let to_coverage = attachment.samples > 1;
        if to_coverage {
            defs.push("ALPHA_TO_COVERAGE".into());
        }
        let mut pipeline = attachment.pipeline(&self.shader, defs, target.depth());
        pipeline.label = Some("canopy_clouds".into());
        pipeline.layout = target.layouts(groups);
        pipeline.multisample.alpha_to_coverage_enabled = to_coverage;
        pipeline
    }
}

/// The billboard clouds of a forest's plants.
struct GpuClouds {
    wood: GpuReduced,
    /// `None` if the device cannot hold them.
    drawn: Option<DrawnPlanes>,
}

struct DrawnPlanes {
    /// The planes of each variant in the buffer of all.
    ranges: Vec<Range<u32>>,
    /// Normals, ambient occlusion (k_a) and foliage, a layer per variant.
    properties: Texture,
    /// [`CloudVariantUniform`](crate::render::forest::CloudVariantUniform)s.
    variants: Buffer,
    /// Group 2.
    bind_group: BindGroup,
    /// The pipeline that draws them.
    light: CloudLight,
    /// Group 3, if some have lighting textures.
    light_textures: Option<BindGroup>,
}

impl DrawnPlanes {
    fn new(plants: &Arc<Vec<BakedPlant>>, upload: &mut ForestUpload) -> Self {
        let layers = if plants.iter().any(|plant| plant.cloud().is_some()) { plants.len() } else { 0 };
        let mut array = |label, kind, find| upload_textures(upload, label, kind, layers, plants, find);
        let (_, colors) = array("canopy_cloud_color", TexelKind::Color, |plants, index| {
            layer(plants, index, |cloud| &cloud.textures.color)
        });
        let (texture, properties) = array("canopy_cloud_properties", TexelKind::Linear, |plants, index| {
            layer(plants, index, |cloud| &cloud.textures.properties)
        });
        let gpu = upload.gpu;
        let sampler = gpu.device.create_sampler(&SamplerDescriptor {
            label: Some("canopy_cloud"),
            address_mode_u: AddressMode::ClampToEdge,
            address_mode_v: AddressMode::ClampToEdge,
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..Default::default()
        });
        let (planes, ranges) = cloud_planes(plants);
        let planes = gpu::buffer_with(&gpu.device, "canopy_cloud_planes", BufferUsages::STORAGE, &planes);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let variants = gpu::buffer_with(&gpu.device, "canopy_cloud_variants", usage, &cloud_variants(plants));
        let bind_group = gpu.bind_group(
            "canopy_cloud",
            &cloud_layout(),
            &BindGroupEntries::sequential((
                &colors,
                &properties,
                &sampler,
                planes.as_entire_binding(),
                variants.as_entire_binding(),
            )),
        );
        let (light, light_textures) = (CloudLight::of(plants), upload_light(plants, upload));
        Self { ranges, properties: texture, variants, bind_group, light, light_textures }
    }

    /// A draw call for each variant that has planes: six vertices a plane.
    fn draws(&self) -> impl Iterator<Item = TreeDraw> {
        let variants = self.ranges.iter().enumerate().filter(|(_, planes)| !planes.is_empty());
        variants.map(|(group, planes)| {
            let vertices = TreeVertices::Instanced { first: 6 * planes.start, count: 6 * planes.len() as u32 };
            TreeDraw { group, vertices }
        })
    }
}

impl GpuLevel for GpuClouds {
    fn features(&self, target: LevelTarget) -> Vec<u32> {
        // Wood first: leaves that it hides are not shaded.
        let mut features = self.wood.features(target);
        features.extend(self.drawn.as_ref().map(|drawn| match target {
            LevelTarget::View(_) => {
                PLANES | CloudLight::ALL.iter().position(|known| *known == drawn.light).unwrap_or(0) as u32
            }
            LevelTarget::ShadowMap => PLANES,
        }));
        features
    }

    fn triangles(&self, variant: usize) -> usize {
        let planes = self.drawn.as_ref().and_then(|drawn| drawn.ranges.get(variant)).map_or(0, ExactSizeIterator::len);
        2 * planes + self.wood.triangles(variant)
    }

    fn draws(&self, target: LevelTarget) -> Vec<TreeDraw> {
        let planes = self.drawn.iter().flat_map(DrawnPlanes::draws);
        self.wood.draws(target).into_iter().chain(planes).collect()
    }

    fn draw<'a>(
        &'a self,
        pass: &mut TrackedRenderPass<'a>,
        features: u32,
        target: LevelTarget,
        trees: &DrawnTrees<'a>,
    ) {
        if features & PLANES == 0 {
            self.wood.draw(pass, features, target, trees);
            return;
        }
        let Some(drawn) = &self.drawn else { return };
        pass.set_bind_group(2, &drawn.bind_group, &[]);
        if let (LevelTarget::View(_), Some(textures)) = (target, &drawn.light_textures) {
            pass.set_bind_group(3, textures, &[]);
        }
        drawn.draws().for_each(|draw| trees.draw(pass, draw));
    }

    fn relight(&mut self, relight: &Relight, upload: &mut ForestUpload) {
        self.wood.relight(relight, upload);
        let Some(drawn) = &mut self.drawn else { return };
        for (index, plant) in relight.new.iter().enumerate() {
            if let Some(cloud) = plant.cloud() {
                rewrite(upload, &drawn.properties, TexelKind::Linear, index as u32, &cloud.textures.properties);
            }
        }
        upload.gpu.queue.write_buffer(&drawn.variants, 0, bytemuck::cast_slice(&cloud_variants(relight.new)));
        drawn.light = CloudLight::of(relight.new);
        drawn.light_textures = upload_light(&Arc::new(relight.new.to_vec()), upload);
    }
}

/// A layer, of one per plant, of the texture that `of` takes from a cloud. A plant without a cloud gets that of another one,
/// which none of its planes shows.
fn layer(plants: &[BakedPlant], index: usize, of: fn(&Cloud) -> &LevelTexture) -> Option<&LevelTexture> {
    let own = plants.get(index)?.cloud();
    let cloud = own.or_else(|| plants.iter().find_map(BakedPlant::cloud));
    cloud.map(|cloud| of(cloud))
}

/// A layer of the lighting textures, of those plants that have them.
fn light_layer(plants: &[BakedPlant], index: usize) -> Option<&LevelTexture> {
    let clouds = plants.iter().filter_map(BakedPlant::cloud);
    clouds.filter_map(|cloud| cloud.textures.light.as_ref()).nth(index)
}

/// The lighting textures, of those plants that have them.
fn upload_light(plants: &Arc<Vec<BakedPlant>>, upload: &mut ForestUpload) -> Option<BindGroup> {
    let lit = |plant: &&BakedPlant| plant.cloud().is_some_and(|cloud| cloud.textures.light.is_some());
    let layers = plants.iter().filter(lit).count();
    if layers == 0 {
        return None;
    }
    let label = "canopy_cloud_light";
    let (_, view) = upload_textures(upload, label, TexelKind::Linear, layers, plants, light_layer);
    Some(upload.gpu.bind_group(label, &light_layout(), &BindGroupEntries::single(&view)))
}

/// Whether clouds have the same planes, wood, colours and outlines. A bake with another lighting creates equal ones in
/// other memory.
fn same_outline(old: &Cloud, new: &Cloud) -> bool {
    old.planes == new.planes
        && old.wood == new.wood
        && old.textures.color == new.textures.color
        && old.textures.properties.shape() == new.textures.properties.shape()
}
