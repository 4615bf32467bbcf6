//! The field as a Bevy user would build it today.
//!
//! One entity a tree, level and material, with shared meshes and materials so that Bevy batches them;
//! `StandardMaterial` with `AlphaMode::Mask`; `VisibilityRange` with a cross-fade; a `DirectionalLight` with cascades.
//! A cross is one mesh of its three planes over one atlas of their images, since three meshes would be three entities a
//! tree.
//!
//! Kind to stock: wood has no normal map (it would need tangents), the sky is a clear colour, there is no fog, and the
//! image is not HDR; ours has all four.

use anyhow::{Context, bail};
use bevy::{
    app::{App, PluginGroup, PluginsState},
    asset::{Assets, Handle, RenderAssetUsages},
    camera::{
        Camera, Camera3d, ClearColorConfig, Exposure, PerspectiveProjection, Projection, RenderTarget,
        visibility::VisibilityRange,
    },
    color::{Color, LinearRgba},
    core_pipeline::tonemapping::Tonemapping,
    ecs::entity::Entity,
    image::{Image, ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    light::{CascadeShadowConfigBuilder, DirectionalLight, DirectionalLightShadowMap, GlobalAmbientLight},
    log::LogPlugin,
    math::primitives::Plane3d,
    mesh::{Indices, Mesh, Mesh3d, Meshable, PrimitiveTopology},
    pbr::{MeshMaterial3d, StandardMaterial},
    prelude::{AlphaMode, DefaultPlugins, Transform},
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_asset::RenderAssets,
        render_resource::{Extent3d, Face, PollType, TextureDimension, TextureFormat, TextureUsages},
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
        view::Msaa,
    },
    window::{ExitCondition, WindowPlugin},
    winit::WinitPlugin,
};
use canopy::{
    bake::levels::cross::Cross,
    light::LightState,
    math::{MipChain, luminance},
    plant::{
        PartKind, PlantMaterial, PlantMesh,
        texture::{color_mips, leaf_mips},
    },
    render::readback::read_rgb,
    scene::Viewpoint,
};
use glam::{Quat, Vec2, Vec3};
use image::RgbImage;

use super::field::{Field, GROUND_REACH};

/// Metres that the finest cascade serves, as in Canopy's default.
const FINEST_CASCADE: f32 = 30.0;

/// A Bevy app with the field in it.
pub struct Stock {
    app: App,
    camera: Entity,
    sun: Entity,
    target: Handle<Image>,
    size: (u32, u32),
}

impl Stock {
    /// Stock Bevy's side of `field`.
    pub fn new(field: &Field) -> anyhow::Result<Self> {
        let mut app = App::new();
        app.add_plugins(
            DefaultPlugins
                .set(WindowPlugin {
                    primary_window: None,
                    exit_condition: ExitCondition::DontExit,
                    ..WindowPlugin::default()
                })
                .set(RenderPlugin { synchronous_pipeline_compilation: true, ..RenderPlugin::default() })
                // One logger a process: the other side's.
                .disable::<LogPlugin>()
                .disable::<WinitPlugin>()
                .disable::<PipelinedRenderingPlugin>(),
        );
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let look = &field.look;
        app.insert_resource(DirectionalLightShadowMap { size: look.shadow_size as usize });
        if look.trees {
            spawn_trees(&mut app, field);
        }
        if look.ground {
            spawn_ground(&mut app);
        }
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: look.cascades.max(1),
            minimum_distance: 0.1,
            maximum_distance: look.shadow_distance as f32,
            first_cascade_far_bound: FINEST_CASCADE,
            ..CascadeShadowConfigBuilder::default()
        };
        let sun = app
            .world_mut()
            .spawn((
                DirectionalLight { shadow_maps_enabled: look.cascades > 0, ..DirectionalLight::default() },
                cascades.build(),
            ))
            .id();
        let target = render_target(&mut app, look.size);
        let camera = app
            .world_mut()
            .spawn((
                Camera3d::default(),
                Camera { clear_color: ClearColorConfig::Custom(Color::srgb(0.62, 0.75, 0.9)), ..Camera::default() },
                RenderTarget::from(target.clone()),
                Msaa::Off,
                Tonemapping::TonyMcMapface,
            ))
            .id();
        let mut stock = Self { app, camera, sun, target, size: look.size };
        stock.light(&field.light(&field.sky(0, false))?);
        stock.place(&field.view(0));
        // Meshes, textures and shaders reach the device, as ours does in its first update.
        stock.frame()?;
        Ok(stock)
    }

    /// Places the camera.
    pub fn place(&mut self, view: &Viewpoint) {
        let transform = Transform {
            translation: view.position.as_vec3(),
            rotation: view.rotation().as_quat(),
            ..Transform::default()
        };
        let projection = Projection::Perspective(PerspectiveProjection {
            fov: view.field_of_view as f32,
            near: 0.1,
            far: 2.0 * GROUND_REACH as f32,
            ..PerspectiveProjection::default()
        });
        self.app.world_mut().entity_mut(self.camera).insert((transform, projection));
    }

    /// Turns the sun and sets its and the sky's strength.
    pub fn light(&mut self, light: &LightState) {
        let world = self.app.world_mut();
        let illuminance = light.key_illuminance.max_element().max(0.0);
        let color = light.key_illuminance / illuminance.max(1e-12);
        if let Some(mut sun) = world.get_mut::<DirectionalLight>(self.sun) {
            sun.illuminance = illuminance;
            sun.color = linear(color);
        }
        if let Some(mut transform) = world.get_mut::<Transform>(self.sun) {
            *transform = Transform::default().looking_to(-light.key_direction, Vec3::Y);
        }
        let sky = light.sky_illuminance.max(Vec3::ZERO);
        world.insert_resource(GlobalAmbientLight {
            color: linear(sky / sky.max_element().max(1e-12)),
            brightness: luminance(sky) / std::f32::consts::PI * 0.5,
            ..GlobalAmbientLight::default()
        });
        world.entity_mut(self.camera).insert(Exposure { ev100: light.ev100 });
    }

    /// Draws a frame and waits for the device.
    pub fn frame(&mut self) -> anyhow::Result<()> {
        self.app.update();
        self.wait()?;
        match self.app.should_exit() {
            Some(exit) if exit.is_error() => bail!("stock Bevy reported an error (see above)"),
            _ => Ok(()),
        }
    }

    /// Waits until the device has finished everything.
    pub fn wait(&self) -> anyhow::Result<()> {
        let device = self.app.world().resource::<RenderDevice>();
        device.wgpu_device().poll(PollType::Wait { submission_index: None, timeout: None })?;
        Ok(())
    }

    /// The last frame.
    pub fn read(&self) -> anyhow::Result<RgbImage> {
        let render_world = self.app.sub_app(RenderApp).world();
        let device = render_world.resource::<RenderDevice>();
        let images = render_world.resource::<RenderAssets<GpuImage>>();
        let image = images.get(&self.target).context("stock Bevy has drawn no image")?;
        let pixels = read_rgb(device, render_world.resource::<RenderQueue>(), &image.texture)?;
        let (width, height) = self.size;
        RgbImage::from_raw(width, height, pixels).context("an image of another size")
    }
}

fn linear(color: Vec3) -> Color {
    LinearRgba::rgb(color.x, color.y, color.z).into()
}

/// One mesh and its material, and the distances at which it is drawn.
struct Level {
    mesh: Handle<Mesh>,
    material: Handle<StandardMaterial>,
    range: Option<VisibilityRange>,
}

fn spawn_trees(app: &mut App, field: &Field) {
    let levels = levels(app, field);
    let grid = field.stand.grid;
    for level in levels {
        let trees = field.stand.trees.iter().map(|tree| {
            let transform = Transform {
                translation: tree.position(&grid).as_vec3(),
                rotation: Quat::from_rotation_y(tree.yaw()),
                scale: Vec3::splat(tree.scale()),
            };
            (Mesh3d(level.mesh.clone()), MeshMaterial3d(level.material.clone()), transform)
        });
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

fn levels(app: &mut App, field: &Field) -> Vec<Level> {
    let look = &field.look;
    let band = field.band_in_space();
    let near = VisibilityRange { start_margin: 0.0..0.0, end_margin: band.clone(), use_aabb: false };
    let far = VisibilityRange { start_margin: band, end_margin: f32::MAX..f32::MAX, use_aabb: false };
    let mut levels = Vec::new();
    for part in &field.plant.plant.parts {
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(part_mesh(&part.mesh));
        let material = part_material(app, part.kind, &part.material);
        levels.push(Level { mesh, material, range: (!look.is_full()).then(|| near.clone()) });
    }
    if !look.is_full() {
        let Some(cross) = field.plant.cross() else { return levels };
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(cross_mesh(cross));
        let atlas = atlas(&cross.textures.color);
        let texture = add_texture(app, &atlas, ImageAddressMode::ClampToEdge);
        let material = add_material(app, foliage(StandardMaterial { base_color_texture: Some(texture), ..matt() }));
        levels.push(Level { mesh, material, range: Some(far) });
    }
    levels
}

fn matt() -> StandardMaterial {
    StandardMaterial { perceptual_roughness: 0.95, reflectance: 0.2, ..StandardMaterial::default() }
}

fn foliage(material: StandardMaterial) -> StandardMaterial {
    StandardMaterial { alpha_mode: AlphaMode::Mask(0.5), double_sided: true, cull_mode: None, ..material }
}

fn add_material(app: &mut App, material: StandardMaterial) -> Handle<StandardMaterial> {
    app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material)
}

/// The same textures as Canopy's, mips included.
fn part_material(app: &mut App, kind: PartKind, material: &PlantMaterial) -> Handle<StandardMaterial> {
    let texture = material.base_color_texture.as_ref().map(|image| {
        let chain = match kind {
            PartKind::Foliage => leaf_mips(image, material.alpha_cutoff),
            PartKind::Wood => color_mips(image),
        };
        add_texture(app, &chain, ImageAddressMode::Repeat)
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

fn build_mesh(positions: Vec<Vec3>, normals: Vec<Vec3>, uvs: Vec<Vec2>, indices: Vec<u32>) -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_inserted_indices(Indices::U32(indices))
}

/// The planes' quads; each takes its picture's column of the [`atlas`].
fn cross_mesh(cross: &Cross) -> Mesh {
    let count = cross.planes.len() as f32;
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (column, plane) in cross.planes.iter().enumerate() {
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

/// The images side by side, level by level.
fn atlas(pictures: &[MipChain]) -> MipChain {
    let Some(first) = pictures.first() else {
        return MipChain { width: 1, height: 1, levels: vec![vec![0; 4]] };
    };
    let levels = (0..first.levels.len())
        .map(|level| {
            let (width, height) = first.level_size(level);
            let row = 4 * width as usize;
            (0..height as usize)
                .flat_map(|y| pictures.iter().flat_map(move |picture| &picture.levels[level][y * row..(y + 1) * row]))
                .copied()
                .collect()
        })
        .collect();
    MipChain { width: first.width * pictures.len() as u32, height: first.height, levels }
}

fn spawn_ground(app: &mut App) {
    let plane = Plane3d::new(Vec3::Y, Vec2::splat(GROUND_REACH as f32)).mesh();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Mesh::from(plane));
    let material = add_material(app, StandardMaterial { base_color: linear(Vec3::new(0.06, 0.05, 0.025)), ..matt() });
    app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::default()));
}

fn render_target(app: &mut App, (width, height): (u32, u32)) -> Handle<Image> {
    let mut image = Image::new_uninit(
        Extent3d { width, height, depth_or_array_layers: 1 },
        TextureDimension::D2,
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.texture_descriptor.usage |= TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
    app.world_mut().resource_mut::<Assets<Image>>().add(image)
}
