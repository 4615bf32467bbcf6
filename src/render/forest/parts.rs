//! Full models on the GPU: a plant's parts, their meshes, their bind groups.

use bevy::render::{
    render_resource::{BindGroup, BindGroupEntries, Buffer, BufferUsages, PipelineCache},
    renderer::{RenderDevice, RenderQueue},
};
use glam::Vec3;

use super::{
    layouts::ForestLayouts,
    textures::TextureShelf,
    transfer::{TransferLight, scattered_tint},
    uniforms::part_uniform,
    vertex::PlantVertex,
};
use crate::{
    bake::{
        BakedPlant,
        lighting::BakedLighting,
        transfer::{Channels, TransferSettings},
    },
    plant::{PartKind, PlantMesh},
    render::{components::SunLight, gpu},
};

/// Vertices and indices of one part, full or proxy.
pub struct GpuMesh {
    /// [`PlantVertex`]es.
    pub vertices: Buffer,
    /// 32-bit indices.
    pub indices: Buffer,
    /// Number of indices; 0 draws nothing.
    pub index_count: u32,
}

/// What a part's pipeline depends on beside its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PartSurface {
    /// Wood or foliage.
    pub kind: PartKind,
    /// Whether its material has a normal map.
    pub normal_map: bool,
}

impl PartSurface {
    /// All of them, wood first.
    pub const ALL: [Self; 4] = [
        Self { kind: PartKind::Wood, normal_map: false },
        Self { kind: PartKind::Wood, normal_map: true },
        Self { kind: PartKind::Foliage, normal_map: false },
        Self { kind: PartKind::Foliage, normal_map: true },
    ];
}

/// One part of a plant.
pub struct GpuPart {
    /// Wood or foliage.
    pub kind: PartKind,
    /// Whether its material has a normal map.
    pub normal_map: bool,
    /// [`PartUniform`](super::PartUniform) of group 2.
    pub(super) uniform: Buffer,
    /// The full model.
    pub model: GpuMesh,
    /// What casts the near shadow.
    pub proxy: GpuMesh,
    /// Group 2.
    pub bind_group: BindGroup,
    /// Which pipeline draws it.
    pub light: PartLight,
    /// Group 3 of plants that are lit by radiance transfer.
    pub transfer: Option<BindGroup>,
}

/// What light reaches a part's full model, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartLight {
    /// Sky by normal and k_a, sun by the leaf shader.
    Plain,
    /// Sky by transfer.
    Transfer {
        /// Whether light takes on colour on its way through the crown.
        color: bool,
        /// What the sun comes by.
        sun: SunLight,
    },
}

impl GpuPart {
    /// What its pipeline depends on beside its light.
    pub fn surface(&self) -> PartSurface {
        PartSurface { kind: self.kind, normal_map: self.normal_map }
    }
}

impl PartLight {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Plain,
        Self::Transfer { color: false, sun: SunLight::LeafShader },
        Self::Transfer { color: false, sun: SunLight::Harmonics },
        Self::Transfer { color: true, sun: SunLight::LeafShader },
        Self::Transfer { color: true, sun: SunLight::Harmonics },
    ];

    /// The light of a part, with the settings of its transfer if it has one.
    pub fn new(transfer: Option<&TransferSettings>, sun: SunLight) -> Self {
        transfer.map_or(Self::Plain, |settings| Self::Transfer { color: settings.channels == Channels::Rgb, sun })
    }
}

/// The parts of a plant that the sun lights by `sun`.
pub fn upload_parts(
    plant: &BakedPlant,
    sun: SunLight,
    layouts: &ForestLayouts,
    textures: &mut TextureShelf,
    transfer: &mut TransferLight,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> Vec<GpuPart> {
    let layout = pipelines.get_bind_group_layout(&layouts.part);
    let tint = scattered_tint(&plant.plant.leaf_colors());
    let mut parts = Vec::new();
    for (index, part) in plant.plant.parts.iter().enumerate() {
        let empty = PlantMesh::default();
        let proxy = plant.shadow_proxy.get(index).unwrap_or(&empty);
        let material = &part.material;
        let coefficients = plant.lighting.transfer(index);
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let uniform = part_uniform(material, &plant.lighting);
        let uniform = gpu::buffer_with(device, "canopy_plant_part", usage, &[uniform]);
        let color = textures.color(material, part.kind, device, queue);
        let normal = textures.normal(material, device, queue);
        let bind_group = device.create_bind_group(
            "canopy_plant_part",
            &layout,
            &BindGroupEntries::sequential((&color, &normal, &layouts.part_sampler, uniform.as_entire_binding())),
        );
        parts.push(GpuPart {
            kind: part.kind,
            normal_map: material.normal_texture.is_some(),
            uniform,
            model: upload_mesh(&part.mesh, &vertices(&part.mesh, &plant.lighting, index), device),
            proxy: upload_mesh(proxy, &vertices(proxy, &BakedLighting::Local, index), device),
            bind_group,
            light: PartLight::new(coefficients.map(|(settings, _)| settings), sun),
            transfer: coefficients.map(|part| transfer.bind_group(part, tint, sun, layouts, device, pipelines)),
        });
    }
    parts
}

/// The vertices of `mesh`, which is part `part` of a plant, with the normals and the k_a of its `lighting`; what is missing
/// there is the mesh's own, or 1.
pub fn vertices(mesh: &PlantMesh, lighting: &BakedLighting, part: usize) -> Vec<PlantVertex> {
    let (normals, ambient) = (lighting.normals(part).unwrap_or(&mesh.normals), lighting.ambient(part));
    let vertex = |(i, &position): (usize, &Vec3)| {
        let normal = normals.get(i).copied().unwrap_or(Vec3::Y);
        let uv = mesh.uvs.get(i).copied().unwrap_or_default();
        PlantVertex::new(position, normal, ambient.get(i).copied().unwrap_or(1.0), uv)
    };
    mesh.positions.iter().enumerate().map(vertex).collect()
}

fn upload_mesh(mesh: &PlantMesh, vertices: &[PlantVertex], device: &RenderDevice) -> GpuMesh {
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let vertex = BufferUsages::VERTEX | BufferUsages::COPY_DST;
    GpuMesh {
        vertices: gpu::buffer_with(device, "canopy_plant_vertices", vertex, vertices),
        indices: gpu::buffer_with(device, "canopy_plant_indices", BufferUsages::INDEX, &indices),
        index_count: indices.len() as u32,
    }
}
