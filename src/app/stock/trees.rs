//! Trees as entities of stock Bevy.

use std::{collections::HashMap, sync::Arc};

use bevy::{
    app::App,
    asset::{Assets, Handle, RenderAssetUsages},
    camera::visibility::VisibilityRange,
    image::{Image, ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    math::{Quat, Vec2, Vec3},
    mesh::{Indices, Mesh, Mesh3d, PrimitiveTopology},
    pbr::{MeshMaterial3d, StandardMaterial},
    prelude::{AlphaMode, Transform},
    render::render_resource::{Extent3d, Face, TextureDimension, TextureFormat},
};

use super::{StockScene, linear};
use crate::{
    bake::{BakedPlant, levels::cross::Cross},
    math::MipChain,
    plant::{
        PartKind, PlantMaterial, PlantMesh,
        texture::{color_mips, leaf_mips},
    },
};

/// One mesh and its material, and the distances at which it is drawn.
struct Level {
    mesh: Handle<Mesh>,
    material: Handle<StandardMaterial>,
    range: Option<VisibilityRange>,
}

/// Textures that are there already: plants of one file share theirs.
#[derive(Default)]
struct Textures(HashMap<(usize, bool), Handle<Image>>);

/// Spawns all trees of `scene`.
pub fn spawn(app: &mut App, scene: &StockScene) {
    let mut textures = Textures::default();
    for (index, plant) in scene.plants.iter().enumerate() {
        let transforms: Vec<Transform> = scene
            .trees
            .iter()
            .filter(|tree| usize::from(tree.variant()) == index)
            .map(|tree| Transform {
                translation: tree.position(scene.grid).as_vec3(),
                rotation: Quat::from_rotation_y(tree.yaw()),
                scale: Vec3::splat(tree.scale()),
            })
            .collect();
        if transforms.is_empty() {
            continue;
        }
        let fade = scene.fades.get(index).cloned().flatten();
        for level in levels(app, plant, fade, &mut textures) {
            let trees =
                transforms.iter().map(|at| (Mesh3d(level.mesh.clone()), MeshMaterial3d(level.material.clone()), *at));
            match &level.range {
                Some(range) => {
                    let trees: Vec<_> = trees.map(|tree| (tree, range.clone())).collect();
                    app.world_mut().spawn_batch(trees);
                }
                None => {
                    let trees: Vec<_> = trees.collect();
                    app.world_mut().spawn_batch(trees);
                }
            }
        }
    }
}

fn levels(
    app: &mut App,
    plant: &BakedPlant,
    fade: Option<std::ops::Range<f32>>,
    textures: &mut Textures,
) -> Vec<Level> {
    let mut levels = Vec::new();
    let near = fade.clone().map(|fade| VisibilityRange { start_margin: 0.0..0.0, end_margin: fade, use_aabb: false });
    for part in &plant.plant.parts {
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(part_mesh(&part.mesh));
        let material = part_material(app, part.kind, &part.material, textures);
        levels.push(Level { mesh, material, range: near.clone() });
    }
    if let (Some(fade), Some(cross)) = (fade, plant.cross()) {
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(cross_mesh(cross));
        let images: Vec<&MipChain> =
            shown(cross).into_iter().filter_map(|plane| Some(&cross.textures.color.get(plane)?.texels)).collect();
        let texture = add_texture(app, &atlas(&images), ImageAddressMode::ClampToEdge);
        let material = add_material(app, foliage(StandardMaterial { base_color_texture: Some(texture), ..matt() }));
        let range = VisibilityRange { start_margin: fade, end_margin: f32::MAX..f32::MAX, use_aabb: false };
        levels.push(Level { mesh, material, range: Some(range) });
    }
    levels
}

/// A material without gloss.
pub fn matt() -> StandardMaterial {
    StandardMaterial { perceptual_roughness: 0.95, reflectance: 0.2, ..StandardMaterial::default() }
}

/// Adds `material` to the app.
pub fn add_material(app: &mut App, material: StandardMaterial) -> Handle<StandardMaterial> {
    app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material)
}

fn foliage(material: StandardMaterial) -> StandardMaterial {
    StandardMaterial { alpha_mode: AlphaMode::Mask(0.5), double_sided: true, cull_mode: None, ..material }
}

/// The same textures as Canopy's, mips included.
fn part_material(
    app: &mut App,
    kind: PartKind,
    material: &PlantMaterial,
    textures: &mut Textures,
) -> Handle<StandardMaterial> {
    let texture = material.base_color_texture.as_ref().map(|image| {
        let key = (Arc::as_ptr(image) as usize, kind == PartKind::Foliage);
        let known = textures.0.get(&key).cloned();
        known.unwrap_or_else(|| {
            let chain = match kind {
                PartKind::Foliage => leaf_mips(image, material.alpha_cutoff),
                PartKind::Wood => color_mips(image),
            };
            let texture = add_texture(app, &chain, ImageAddressMode::Repeat);
            textures.0.insert(key, texture.clone());
            texture
        })
    });
    let plain = StandardMaterial { base_color: linear(material.base_color), base_color_texture: texture, ..matt() };
    let whole = match kind {
        PartKind::Foliage => foliage(plain),
        PartKind::Wood => StandardMaterial { cull_mode: Some(Face::Back), ..plain },
    };
    add_material(app, whole)
}

fn add_texture(app: &mut App, chain: &MipChain, address: ImageAddressMode) -> Handle<Image> {
    let mut image = Image::new_uninit(
        Extent3d { width: chain.width, height: chain.height, depth_or_array_layers: 1 },
        TextureDimension::D2,
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.texture_descriptor.mip_level_count = chain.levels.len() as u32;
    image.data = Some(chain.concat());
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        address_mode_u: address,
        address_mode_v: address,
        mag_filter: ImageFilterMode::Linear,
        min_filter: ImageFilterMode::Linear,
        mipmap_filter: ImageFilterMode::Linear,
        ..ImageSamplerDescriptor::default()
    });
    app.world_mut().resource_mut::<Assets<Image>>().add(image)
}

fn part_mesh(mesh: &PlantMesh) -> Mesh {
    build_mesh(
        mesh.positions.clone(),
        mesh.normals.clone(),
        mesh.uvs.clone(),
        mesh.triangles.iter().flatten().copied().collect(),
    )
}

/// A mesh of triangles.
pub fn build_mesh(positions: Vec<Vec3>, normals: Vec<Vec3>, uvs: Vec<Vec2>, indices: Vec<u32>) -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_inserted_indices(Indices::U32(indices))
}

/// The planes that stock Bevy draws: two upright ones at right angles as far as there are, and the level one.
fn shown(cross: &Cross) -> Vec<usize> {
    let uprights = cross.uprights().len();
    let mut planes = vec![0, uprights / 2, uprights];
    planes.dedup();
    planes
}

/// The planes' quads; each takes its image's column of the [`atlas`].
fn cross_mesh(cross: &Cross) -> Mesh {
    let planes: Vec<_> = shown(cross).into_iter().filter_map(|plane| cross.planes.get(plane)).collect();
    let count = planes.len() as f32;
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (column, plane) in planes.into_iter().enumerate() {
        let first = positions.len() as u32;
        for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            positions.push(plane.center + plane.u * s + plane.v * t);
            normals.push(plane.normal);
            uvs.push(Vec2::new((column as f32 + 0.5 + 0.5 * s) / count, 0.5 - 0.5 * t));
        }
        indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    build_mesh(positions, normals, uvs, indices)
}

/// The images side by side, mip by mip.
fn atlas(images: &[&MipChain]) -> MipChain {
    let Some(first) = images.first() else {
        return MipChain { width: 1, height: 1, levels: vec![vec![0; 4]] };
    };
    let levels = (0..first.levels.len())
        .map(|level| {
            let (width, height) = first.level_size(level);
            let row = 4 * width as usize;
            (0..height as usize)
                .flat_map(|y| images.iter().flat_map(move |image| &image.levels[level][y * row..(y + 1) * row]))
                .copied()
                .collect()
        })
        .collect();
    MipChain { width: first.width * images.len() as u32, height: first.height, levels }
}
