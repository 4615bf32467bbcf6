//! The full model: a plant's parts, instanced, one draw call per variant and part. The shadow caster is the shadow
//! proxy.

use std::sync::Arc;

use bevy::{
    asset::Handle,
    log::error_once,
    render::{
        render_phase::TrackedRenderPass,
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferUsages, Face, FilterMode, FragmentState, IndexFormat, MipmapFilterMode, RenderPipelineDescriptor,
            Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages, TextureSampleType, VertexState,
            binding_types::{sampler, texture_2d, uniform_buffer_sized},
        },
        renderer::RenderDevice,
    },
    shader::{Shader, ShaderDefVal},
};
use glam::Vec3;

use crate::{
    bake::{
        BakedPlant,
        lighting::BakedLighting,
        lighting::transfer::{Channels, TransferSettings},
        textures::PartTextures,
    },
    cull::Grouping,
    lod::Representation,
    plant::{PartKind, PlantMesh, PlantPart},
    render::{
        components::{Forest, SunLight},
        forest::{
            representation::{
                DrawnTrees, ForestUpload, GpuLevel, LevelRenderer, LevelTarget, Relight, TreeDraw, TreeVertices,
            },
            textures::TextureCache,
            transfer::transfer_layout,
            uniforms::{PartUniform, indirect_light_color, part_uniform},
            vertex::PlantVertex,
        },
        gpu,
        shaders::{CanopyShaders, ShaderFile},
    },
};

/// Metres per texel of the coarsest shadow map for which a shadow proxy is fine enough.
const COARSEST_SHADOW_TEXEL: f64 = 0.2;

/// Draws full models.
pub struct ModelRenderer {
    shader: Handle<Shader>,
    caster: Handle<Shader>,
}

impl ModelRenderer {
    /// With Canopy's own shaders.
    pub fn new(shaders: &CanopyShaders) -> Self {
        Self { shader: shaders.get(ShaderFile::ForestModel), caster: shaders.get(ShaderFile::SunShadowModel) }
    }
}

/// How light reaches a part's full model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartLight {
    /// Sky by normal and ambient occlusion (k_a), sun by the leaf shader.
    Plain,
    /// Sky by radiance transfer.
    Transfer {
        /// Whether light takes on the colour of the leaves inside the crown.
        color: bool,
        /// How the sun lights it.
        sun: SunLight,
    },
}

impl PartLight {
    /// All values.
    pub const ALL: [Self; 7] = [
        Self::Plain,
        Self::Transfer { color: false, sun: SunLight::Combined },
        Self::Transfer { color: false, sun: SunLight::LeafShader },
        Self::Transfer { color: false, sun: SunLight::Harmonics },
        Self::Transfer { color: true, sun: SunLight::Combined },
        Self::Transfer { color: true, sun: SunLight::LeafShader },
        Self::Transfer { color: true, sun: SunLight::Harmonics },
    ];

    /// The lighting of a part of this kind, with the settings of its transfer if it has one.
    pub fn new(kind: PartKind, transfer: Option<&TransferSettings>, sun: SunLight) -> Self {
        let sun = match (kind, sun) {
            // Wood is solid: the shadow map is right on it, in the mean too.
            (PartKind::Wood, SunLight::Combined) => SunLight::LeafShader,
            _ => sun,
        };
        transfer.map_or(Self::Plain, |settings| Self::Transfer { color: settings.channels == Channels::Rgb, sun })
    }
}

/// What a part's pipeline depends on besides its lighting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct PartSurface {
    /// Wood or foliage.
    kind: PartKind,
    /// Whether its material has a normal map. Without one its pipeline samples none.
    normal_map: bool,
    /// Whether its leaves have a back, a transmission or layers of their own.
    layered: bool,
}

impl PartSurface {
    /// All values, wood first.
    const ALL: [Self; 6] = [
        Self { kind: PartKind::Wood, normal_map: false, layered: false },
        Self { kind: PartKind::Wood, normal_map: true, layered: false },
        Self { kind: PartKind::Foliage, normal_map: false, layered: false },
        Self { kind: PartKind::Foliage, normal_map: true, layered: false },
        Self { kind: PartKind::Foliage, normal_map: false, layered: true },
        Self { kind: PartKind::Foliage, normal_map: true, layered: true },
    ];

    fn new(part: &PlantPart, textures: &PartTextures) -> Self {
        let leaf = textures.back.is_some() || textures.transmission.is_some() || textures.tissue.is_some();
        Self {
            kind: part.kind,
            normal_map: part.material.normal_texture.is_some(),
            layered: leaf && part.kind == PartKind::Foliage,
        }
    }
}

/// The pipeline of a part, as the bits that [`LevelRenderer::pipeline`] takes. Wood has the lower numbers, because it
/// is drawn first: leaves that it hides are not shaded.
fn features(surface: PartSurface, light: PartLight) -> u32 {
    let surface = PartSurface::ALL.iter().position(|known| *known == surface).unwrap_or(0);
    let light = PartLight::ALL.iter().position(|known| *known == light).unwrap_or(0);
    (surface * PartLight::ALL.len() + light) as u32
}

/// The inverse of [`features`].
fn part_of(features: u32) -> (PartSurface, PartLight) {
    let (features, lights) = (features as usize, PartLight::ALL.len());
    (PartSurface::ALL[features / lights % PartSurface::ALL.len()], PartLight::ALL[features % lights])
}

/// Group 2: colour, normals, sampler, material; what only leaves with layers sample: back and transmission; what only styles sample:
/// strokes.
fn part_layout() -> BindGroupLayoutDescriptor {
    let float = TextureSampleType::Float { filterable: true };
    BindGroupLayoutDescriptor::new(
        "canopy_plant_part",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                texture_2d(float),
                texture_2d(float),
                sampler(SamplerBindingType::Filtering),
                // The vertex shader of styles asks whose normals they are.
                uniform_buffer_sized(false, std::num::NonZeroU64::new(size_of::<PartUniform>() as u64))
                    .visibility(ShaderStages::VERTEX_FRAGMENT),
                texture_2d(float),
                texture_2d(float),
                texture_2d(float),
            ),
        ),
    )
}

/// Filters between texels and levels; textures of plants repeat.
fn part_sampler(device: &RenderDevice) -> Sampler {
    device.create_sampler(&SamplerDescriptor {
        label: Some("canopy_plant"),
        address_mode_u: AddressMode::Repeat,
        address_mode_v: AddressMode::Repeat,
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        mipmap_filter: MipmapFilterMode::Linear,
        ..Default::default()
    })
}

impl LevelRenderer for ModelRenderer {
    fn representation(&self) -> Representation {
        Representation::MODEL
    }

    fn label(&self) -> &'static str {
        "full models"
    }

    fn tint(&self) -> Vec3 {
        Vec3::new(0.15, 0.9, 0.2)
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
        let mut textures = TextureCache::default();
        let sampler = part_sampler(&upload.gpu.device);
        let parts = |(index, plant): (usize, &BakedPlant)| {
            let sun = forest.suns.get(index).copied().unwrap_or_default();
            upload_parts(plant, sun, &sampler, &mut textures, upload)
        };
        Box::new(GpuModels { parts: forest.plants.iter().enumerate().map(parts).collect() })
    }

    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool {
        let same_proxy = match (old.shadow_proxy(), new.shadow_proxy()) {
            (Some(old), Some(new)) => Arc::ptr_eq(old, new),
            (old, new) => old.is_none() && new.is_none(),
        };
        let same_textures = Arc::ptr_eq(&old.textures, &new.textures) || old.textures == new.textures;
        Arc::ptr_eq(&old.plant, &new.plant) && same_proxy && same_textures
    }

    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        let (PartSurface { kind, normal_map, layered }, light) = part_of(features);
        let foliage = kind == PartKind::Foliage;
        let mut defs: Vec<ShaderDefVal> = Vec::new();
        if foliage {
            defs.push("FOLIAGE".into());
        }
        let LevelTarget::View(attachment) = target else {
            return RenderPipelineDescriptor {
                label: Some(format!("canopy_caster_{kind:?}").into()),
                layout: target.layouts([part_layout()]),
                vertex: VertexState {
                    shader: self.caster.clone(),
                    shader_defs: defs.clone(),
                    entry_point: Some("vertex".into()),
                    buffers: vec![PlantVertex::layout()],
                },
                depth_stencil: Some(target.depth()),
                fragment: foliage.then(|| FragmentState {
                    shader: self.caster.clone(),
                    shader_defs: defs,
                    entry_point: Some("fragment".into()),
                    targets: Vec::new(),
                }),
                ..Default::default()
            };
        };
        if normal_map {
            defs.push("NORMAL_MAP".into());
        }
        if layered {
            defs.push("LAYERED".into());
        }
        let mut groups = vec![part_layout()];
        if let PartLight::Transfer { color, sun } = light {
            defs.push("TRANSFER".into());
            groups.push(transfer_layout());
            if color {
                defs.push("TRANSFER_COLOR".into());
            }
            if sun != SunLight::LeafShader {
                defs.push("SUN_HARMONICS".into());
            }
            if sun == SunLight::Combined {
                defs.push("SUN_DETAIL".into());
            }
        }
        let to_coverage = attachment.samples > 1 && foliage;
        if to_coverage {
            defs.push("ALPHA_TO_COVERAGE".into());
        }
        let mut pipeline = attachment.pipeline(&self.shader, defs, target.depth());
        pipeline.label = Some(if foliage { "canopy_foliage" } else { "canopy_wood" }.into());
        pipeline.layout = target.layouts(groups);
        pipeline.vertex.buffers = vec![PlantVertex::layout()];
        pipeline.primitive.cull_mode = (!foliage).then_some(Face::Back);
        pipeline.multisample.alpha_to_coverage_enabled = to_coverage;
        pipeline
    }
}

/// Vertices and indices of one part, full or proxy.
struct GpuMesh {
    /// [`PlantVertex`]es.
    vertices: Buffer,
    /// 32-bit indices.
    indices: Buffer,
    /// Number of indices; 0 draws nothing.
    index_count: u32,
}

impl GpuMesh {
    /// The draw call for the trees of `variant`, unless there is nothing to draw.
    fn draw(&self, variant: usize) -> Option<TreeDraw> {
        let vertices = TreeVertices::Indexed(self.index_count);
        (self.index_count > 0).then_some(TreeDraw { group: variant, vertices })
    }
}

/// One part of a plant.
struct GpuPart {
    surface: PartSurface,
    /// [`PartUniform`] of group 2.
    uniform: Buffer,
    /// The full model.
    model: GpuMesh,
    /// The shadow proxy, which casts the near shadow.
    proxy: GpuMesh,
    /// Group 2.
    bind_group: BindGroup,
    /// The pipeline that draws it.
    light: PartLight,
    /// Group 3 of plants that are lit by radiance transfer.
    transfer: Option<BindGroup>,
}

impl GpuPart {
    fn mesh(&self, target: LevelTarget) -> &GpuMesh {
        match target {
            LevelTarget::View(_) => &self.model,
            LevelTarget::ShadowMap => &self.proxy,
        }
    }
}

/// The full models of a forest's plants.
struct GpuModels {
    /// Parts by variant.
    parts: Vec<Vec<GpuPart>>,
}

impl GpuLevel for GpuModels {
    fn features(&self, target: LevelTarget) -> Vec<u32> {
        let features_of = |part: &GpuPart| match target {
            LevelTarget::View(_) => features(part.surface, part.light),
            // Depth does not depend on the normal map or the layers.
            LevelTarget::ShadowMap => {
                features(PartSurface { normal_map: false, layered: false, ..part.surface }, PartLight::Plain)
            }
        };
        let mut all: Vec<u32> = self.parts.iter().flatten().map(features_of).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn triangles(&self, variant: usize) -> usize {
        self.parts.get(variant).into_iter().flatten().map(|part| part.model.index_count as usize / 3).sum()
    }

    fn draws(&self, target: LevelTarget) -> Vec<TreeDraw> {
        let of_part = |(variant, part): (usize, &GpuPart)| part.mesh(target).draw(variant);
        let parts =
            self.parts.iter().enumerate().flat_map(|(variant, parts)| parts.iter().map(move |part| (variant, part)));
        parts.filter_map(of_part).collect()
    }

    fn draw<'a>(
        &'a self,
        pass: &mut TrackedRenderPass<'a>,
        features: u32,
        target: LevelTarget,
        trees: &DrawnTrees<'a>,
    ) {
        let (surface, light) = part_of(features);
        for (variant, parts) in self.parts.iter().enumerate().filter(|(variant, _)| !trees.is_empty(*variant)) {
            for part in parts.iter().filter(|part| part.surface.kind == surface.kind) {
                if matches!(target, LevelTarget::View(_)) && (part.surface, part.light) != (surface, light) {
                    continue;
                }
                let mesh = part.mesh(target);
                let Some(draw) = mesh.draw(variant) else { continue };
                if let (LevelTarget::View(_), Some(group)) = (target, &part.transfer) {
                    pass.set_bind_group(3, group, &[]);
                }
                pass.set_bind_group(2, &part.bind_group, &[]);
                pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                pass.set_index_buffer(mesh.indices.slice(..), IndexFormat::Uint32);
                trees.draw(pass, draw);
            }
        }
    }

    fn relight(&mut self, relight: &Relight, upload: &mut ForestUpload) {
        for (index, (old, new)) in relight.old.iter().zip(relight.new).enumerate() {
            if Arc::ptr_eq(&old.lighting, &new.lighting) {
                continue;
            }
            let tint = indirect_light_color(&new.plant.leaf_colors());
            let sun = relight.suns.get(index).copied().unwrap_or_default();
            let Some(parts) = self.parts.get_mut(index) else { continue };
            for (number, (gpu_part, part)) in parts.iter_mut().zip(&new.plant.parts).enumerate() {
                let vertices = vertices(&part.mesh, &new.lighting, number);
                let tissue = new.textures.0.get(number).and_then(|textures| textures.tissue);
                let uniform = part_uniform(&part.material, &new.lighting, tissue);
                upload.gpu.queue.write_buffer(&gpu_part.model.vertices, 0, bytemuck::cast_slice(&vertices));
                upload.gpu.queue.write_buffer(&gpu_part.uniform, 0, bytemuck::bytes_of(&uniform));
                let traced = new.lighting.transfer(number);
                gpu_part.light = PartLight::new(part.kind, traced.map(|(settings, _)| settings), sun);
                gpu_part.transfer = upload.transfer_group(&new.lighting, number, tint, sun);
            }
        }
    }
}

/// The parts of a plant whose sunlight is computed by `sun`.
fn upload_parts(
    plant: &BakedPlant,
    sun: SunLight,
    sampler: &Sampler,
    textures: &mut TextureCache,
    upload: &mut ForestUpload,
) -> Vec<GpuPart> {
    let gpu = upload.gpu;
    let tint = indirect_light_color(&plant.plant.leaf_colors());
    if plant.textures.0.len() != plant.plant.parts.len() {
        error_once!(
            "the plant `{}` is not drawn as a full model, as its textures were not filtered: list \
             `Representation::MODEL` in `BakeSettings::representations`",
            plant.plant.name
        );
        return Vec::new();
    }
    if plant.shadow_proxy().is_none() {
        error_once!(
            "the plant `{}` casts no near shadow, as no shadow proxy was baked for it: list `Representation::MODEL` in \
             `BakeSettings::representations`",
            plant.plant.name
        );
    }
    let local = Arc::new(BakedLighting::Local);
    let mut parts = Vec::new();
    for (index, (part, filtered)) in plant.plant.parts.iter().zip(&plant.textures.0).enumerate() {
        let material = &part.material;
        let coefficients = plant.lighting.transfer(index);
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let uniform = part_uniform(material, &plant.lighting, filtered.tissue);
        let uniform = gpu::buffer_with(&gpu.device, "canopy_plant_part", usage, &[uniform]);
        let color = textures.color(filtered, part.kind, upload);
        let normal = textures.normal(filtered, upload);
        let back = textures.back(filtered, &color, upload);
        let transmission = textures.transmission(filtered, material, upload);
        let strokes = textures.strokes(material, upload);
        let bind_group = gpu.bind_group(
            "canopy_plant_part",
            &part_layout(),
            &BindGroupEntries::sequential((
                &color,
                &normal,
                sampler,
                uniform.as_entire_binding(),
                &back,
                &transmission,
                &strokes,
            )),
        );
        parts.push(GpuPart {
            surface: PartSurface::new(part, filtered),
            uniform,
            model: upload_mesh(plant, index, model_mesh, &plant.lighting, upload),
            proxy: upload_mesh(plant, index, proxy_mesh, &local, upload),
            bind_group,
            light: PartLight::new(part.kind, coefficients.map(|(settings, _)| settings), sun),
            transfer: upload.transfer_group(&plant.lighting, index, tint, sun),
        });
    }
    parts
}

/// The vertices of `mesh`, which is part `part` of a plant, with the normals and the ambient occlusion (k_a) of its
/// `lighting`. Values that are missing there are the mesh's own normals, or 1.
fn vertices(mesh: &PlantMesh, lighting: &BakedLighting, part: usize) -> Vec<PlantVertex> {
    let (normals, ambient) = (lighting.normals(part).unwrap_or(&mesh.normals), lighting.ambient(part));
    let vertex = |(i, &position): (usize, &Vec3)| {
        let normal = normals.get(i).copied().unwrap_or(Vec3::Y);
        let uv = mesh.uvs.get(i).copied().unwrap_or_default();
        PlantVertex::new(position, normal, ambient.get(i).copied().unwrap_or(1.0), uv)
    };
    mesh.positions.iter().enumerate().map(vertex).collect()
}

/// The mesh of a plant's part.
fn model_mesh(plant: &BakedPlant, part: usize) -> Option<&PlantMesh> {
    plant.plant.parts.get(part).map(|part| &part.mesh)
}

/// The mesh that casts a part's near shadow.
fn proxy_mesh(plant: &BakedPlant, part: usize) -> Option<&PlantMesh> {
    plant.shadow_proxy()?.get(part)
}

/// The mesh that `mesh_of` finds for a part, with the normals and the ambient occlusion (k_a) of `lighting`.
fn upload_mesh(
    plant: &BakedPlant,
    part: usize,
    mesh_of: fn(&BakedPlant, usize) -> Option<&PlantMesh>,
    lighting: &Arc<BakedLighting>,
    upload: &mut ForestUpload,
) -> GpuMesh {
    let mesh = mesh_of(plant, part);
    let vertex_count = mesh.map_or(0, |mesh| mesh.positions.len());
    let index_count = mesh.map_or(0, |mesh| 3 * mesh.triangles.len());
    let (owner, lighting) = (plant.clone(), Arc::clone(lighting));
    let packed = move || mesh_of(&owner, part).map_or_else(Vec::new, |mesh| vertices(mesh, &lighting, part));
    let owner = plant.clone();
    let indices = move || {
        let triangles = mesh_of(&owner, part).map(|mesh| mesh.triangles.iter().flatten());
        triangles.map(|corners| corners.copied().collect()).unwrap_or_default()
    };
    GpuMesh {
        vertices: upload.buffer("canopy_plant_vertices", BufferUsages::VERTEX, vertex_count, packed),
        indices: upload.buffer("canopy_plant_indices", BufferUsages::INDEX, index_count, indices),
        index_count: index_count as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_has_a_pipeline_of_its_own_and_wood_comes_first() {
        let all = PartSurface::ALL.map(|surface| PartLight::ALL.map(|light| (surface, light)));
        for (index, (surface, light)) in all.into_iter().flatten().enumerate() {
            assert_eq!(features(surface, light), index as u32);
            assert_eq!(part_of(index as u32), (surface, light));
        }
        let is_wood = |surface: &PartSurface| surface.kind == PartKind::Wood;
        assert!(PartSurface::ALL.is_sorted_by_key(|surface| !is_wood(surface)), "wood first");
    }
}
