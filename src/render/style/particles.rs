//! Particles of near crowns in three intensity maps [Luft 2006, 4.2], made of the plants that a forest draws already.
//!
//! The published particles lie around the vertices of the implicit surface. Here they lie around the foliage's vertices that a
//! realigned bake puts at the surface, those with a high ambient visibility, and have their normals, which are the
//! surface's: nothing else is baked. The paper draws all of a tree's particles at any distance; a forest would have billions.
//! Here the dabs of a crown cover it about as densely at any distance, a fixed random order says which, and beyond some
//! distance the washes stand alone.
//!
//! Cost: a draw call a near tree, 16 bytes a particle and plant.

use std::sync::Arc;

use bevy::{
    ecs::{
        entity::Entity,
        query::With,
        resource::Resource,
        system::{Query, Res, ResMut},
        world::{FromWorld, World},
    },
    platform::collections::HashMap,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{BindGroup, BindGroupEntries, Buffer, BufferUsages, RenderPassDescriptor},
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};
use glam::Vec3;

use super::{
    full_screen::cleared,
    layouts::particles_layout,
    pass::StylePass,
    targets::{StyleMaps, StyleTargets, has_particles},
    uniforms::{GpuParticle, ParticleViewUniform},
};
use crate::{
    bake::BakedPlant,
    cull::{Drawn, Grouping, Volume, select},
    lod::{FadeBand, Levels, Representation},
    math::octahedral::{encode_y, pack_snorm16},
    plant::PartKind,
    render::{
        components::{CanopyCamera, DrawnStyle},
        forest::{GpuForest, GpuForests, LevelLook, forest_view, instance_bind_group},
        gpu::{self, Gpu, GrowingBuffer},
        report::FrameReport,
        view::{PreparedFrame, PreparedView},
    },
    style::particles::{PUBLISHED_THRESHOLDS, Particle, ParticleSettings},
};

/// Trees of a page are grouped by their plant.
const GROUPINGS: [Grouping; 1] = [Grouping::ByVariant];
/// Metres across a dab.
const SIZE: f32 = 0.42;
/// Metres: lower plants have smaller dabs.
const TALL: f32 = 12.0;
/// Least pixels across a dab, of a picture of 720 lines.
const LEAST_PIXELS: f32 = 6.0;
/// Dabs per area of the crown's box and area of their own box.
const COVER: f32 = 1.5;
/// Metres to which dabs are seen into a crown: δ of the blurred depth test.
const REACH: f32 = 0.9;
/// Most particles of a plant.
const MOST: usize = 6000;
/// Distances in metres over which dabs give way to washes.
pub const FADE: FadeBand = FadeBand { start: 180.0, end: 320.0 };
/// Least ambient visibility of a vertex at the surface of its crown.
const AT_SURFACE: f32 = 0.45;

/// The particles of one forest.
struct ForestParticles {
    plants: Arc<Vec<BakedPlant>>,
    /// By variant: the particles and their number.
    buffers: Vec<(Buffer, u32)>,
    /// Page by page.
    visible: Vec<GrowingBuffer>,
    uniform: Buffer,
}

/// What is drawn of one tree.
struct TreeDraw {
    variant: usize,
    /// Index in the page's list of visible trees.
    index: u32,
    count: u32,
}

/// What is drawn of one page of a forest.
struct ForestDraw {
    entity: Entity,
    instances: BindGroup,
    trees: Vec<TreeDraw>,
}

/// The particles of all forests, and what the view draws of them.
#[derive(Resource)]
pub struct StyleParticles {
    forests: HashMap<Entity, ForestParticles>,
    draws: Vec<ForestDraw>,
    settings: Buffer,
}

impl FromWorld for StyleParticles {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let settings = gpu::buffer_with(device, "canopy_style_particles", usage, &[ParticleViewUniform::default()]);
        Self { forests: HashMap::default(), draws: Vec::new(), settings }
    }
}

/// The values for particles on maps of `map_size` texels.
fn settings(map_size: (u32, u32)) -> ParticleViewUniform {
    ParticleViewUniform {
        size: SIZE,
        least_pixels: LEAST_PIXELS * map_size.1 as f32 / 720.0,
        cover: COVER,
        reach: REACH,
        thresholds: PUBLISHED_THRESHOLDS,
        map_size: [map_size.0 as f32, map_size.1 as f32],
        fade: [FADE.start, FADE.end],
    }
}

/// Dabs of a crown `height` and `radius` metres large at `distance` metres: as many as cover it at their size.
fn wanted(settings: &ParticleViewUniform, focal_pixels: f32, distance: f32, height: f32, radius: f32) -> f32 {
    let scale = focal_pixels / distance.max(0.5);
    let pixels = (settings.size * (height / TALL).min(1.0) * scale).max(settings.least_pixels);
    settings.cover * height * 2.0 * radius * scale * scale / (pixels * pixels)
}

/// Finds the near trees and how many particles each has; makes the particles of new plants.
pub fn prepare_particles(
    views: Query<&DrawnStyle, With<CanopyCamera>>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    targets: Res<StyleTargets>,
    gpu: Gpu,
    report: Res<FrameReport>,
    mut particles: ResMut<StyleParticles>,
) {
    let particles = &mut *particles;
    particles.draws.clear();
    let styled = frame.view.as_ref().and_then(|view| Some((view, views.get(view.entity).ok()?)));
    let (Some((view, _)), Some(maps)) = (styled.filter(|(_, drawn)| has_particles(&drawn.style)), &targets.0) else {
        particles.forests.clear();
        return;
    };
    let settings = settings(maps.key.size);
    gpu.queue.write_buffer(&particles.settings, 0, bytemuck::bytes_of(&settings));
    particles.forests.retain(|entity, _| forests.get(*entity).is_some());
    for (entity, forest) in forests.iter() {
        let plants = &forest.forest.plants;
        let known = particles.forests.remove(&entity).filter(|known| Arc::ptr_eq(&known.plants, plants));
        let mut own = known.unwrap_or_else(|| ForestParticles::new(&gpu, plants));
        particles.draws.extend(own.choose(&gpu, entity, forest, view, &settings, maps));
        particles.forests.insert(entity, own);
    }
    let trees: usize = particles.draws.iter().map(|draw| draw.trees.len()).sum();
    let count: u64 = particles.draws.iter().flat_map(|draw| &draw.trees).map(|tree| u64::from(tree.count)).sum();
    report.ran("style particles", format!("{count} dabs on {trees} trees"));
}

impl ForestParticles {
    fn new(gpu: &Gpu, plants: &Arc<Vec<BakedPlant>>) -> Self {
        let buffer = |(index, plant): (usize, &BakedPlant)| {
            let packed: Vec<GpuParticle> = of_plant(plant, index as u64).iter().map(pack).collect();
            (gpu::buffer_with(&gpu.device, "canopy_particles", BufferUsages::STORAGE, &packed), packed.len() as u32)
        };
        Self {
            plants: plants.clone(),
            buffers: plants.iter().enumerate().map(buffer).collect(),
            visible: Vec::new(),
            uniform: gpu::uniform_slots(&gpu.device, "canopy_particle_view", 1),
        }
    }

    /// The near trees in view, and how many particles each has.
    fn choose(
        &mut self,
        gpu: &Gpu,
        entity: Entity,
        forest: &GpuForest,
        view: &PreparedView,
        settings: &ParticleViewUniform,
        maps: &StyleMaps,
    ) -> Vec<ForestDraw> {
        let focal = view.focal_pixels * maps.key.size.1 as f32 / maps.key.picture.1.max(1) as f32;
        let uniform = forest_view(forest, view.camera, Some(LevelLook::default()));
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        self.visible.resize_with(forest.page_count(), || GrowingBuffer::new(&gpu.device, "canopy_particle_trees"));
        (0..forest.page_count())
            .filter_map(|page| self.choose_in(gpu, entity, forest, page, view, settings, focal))
            .collect()
    }

    /// The same of one page.
    fn choose_in(
        &mut self,
        gpu: &Gpu,
        entity: Entity,
        forest: &GpuForest,
        page: usize,
        view: &PreparedView,
        settings: &ParticleViewUniform,
        focal: f32,
    ) -> Option<ForestDraw> {
        let of = &forest.forest;
        let camera = view.camera - of.origin;
        let (shape, members) = forest.page_trees(page)?;
        let drawn = Drawn { page: shape, grid: of.stand.grid, groupings: &GROUPINGS, variants: forest.sizes.len() };
        let levels = Levels::only(Representation::MODEL);
        let volume = Volume::view(&drawn, camera, &view.frustum, &levels, FADE.end.min(of.view_distance));
        let near = select(shape, members, &forest.tree_sizes, &GROUPINGS, &volume);
        let mut trees = Vec::new();
        for (variant, range) in near.ranges(0).iter().enumerate() {
            let (Some((_, most)), Some(size)) = (self.buffers.get(variant), forest.sizes.get(variant)) else {
                continue;
            };
            for index in range.clone() {
                let packed = near.visible.get(index as usize).and_then(|tree| members.get(*tree as usize));
                let Some(packed) = packed else { continue };
                let relative = (packed.position(&of.stand.grid) - camera).as_vec3();
                let (distance, scale) = (relative.x.hypot(relative.z), packed.scale());
                let count = wanted(settings, focal, distance, size.height * scale, size.radius * scale);
                // The conversion saturates.
                let count = (count.ceil() as u32).min(*most);
                if count > 0 {
                    trees.push(TreeDraw { variant, index, count });
                }
            }
        }
        let visible = self.visible.get_mut(page).filter(|_| !trees.is_empty())?;
        visible.write(&gpu.device, &gpu.queue, &near.visible);
        let instances = instance_bind_group(gpu, forest, page, &self.uniform, visible.buffer());
        Some(ForestDraw { entity, instances, trees })
    }
}

/// The particles of a plant, around the vertices of its foliage that lie at the crown's surface.
fn of_plant(plant: &BakedPlant, seed: u64) -> Vec<Particle> {
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let size = plant.size();
    let center = Vec3::Y * 0.5 * size.height;
    for (index, part) in plant.plant.parts.iter().enumerate().filter(|(_, part)| part.kind == PartKind::Foliage) {
        let realigned = plant.lighting.normals(index).filter(|_| plant.lighting.is_realigned());
        let ambient = plant.lighting.ambient(index);
        for (vertex, position) in part.mesh.positions.iter().enumerate() {
            // Without realigned normals those of the crown's ellipsoid, as in shaders/style/surface.wgsl.
            let scale = Vec3::new(size.radius, 0.5 * size.height, size.radius).max(Vec3::splat(1e-3)).recip();
            let inside = (*position - center) * scale;
            let normal = realigned.and_then(|normals| normals.get(vertex)).copied();
            let depth = if realigned.is_some() { ambient.get(vertex).copied().unwrap_or(1.0) } else { inside.length() };
            if depth >= AT_SURFACE && position.is_finite() {
                positions.push(*position);
                normals.push(normal.unwrap_or_else(|| (inside * scale).normalize_or(Vec3::Y)));
            }
        }
    }
    let mut particles = ParticleSettings::default().particles(&positions, &normals, size.height, seed);
    particles.truncate(MOST);
    particles
}

fn pack(particle: &Particle) -> GpuParticle {
    GpuParticle { position: particle.position.to_array(), normal: pack_snorm16(encode_y(particle.normal)) }
}

/// Draws the particles into their map.
pub fn particles_pass(
    view: ViewQuery<&DrawnStyle, With<CanopyCamera>>,
    style: StylePass,
    particles: Res<StyleParticles>,
    mut ctx: RenderContext,
) {
    let (Some(group), Some(maps)) = (style.frame.of(view.entity()), style.maps()) else { return };
    let pipeline = style.pipeline(style.pipelines.particles());
    let Some(dabs) = maps.dabs.as_ref() else { return };
    let layout = style.cache.get_bind_group_layout(&particles_layout());
    let group_of = |buffer: &Buffer| {
        style.device.create_bind_group(
            "canopy_style_particles",
            &layout,
            &BindGroupEntries::sequential((
                buffer.as_entire_binding(),
                particles.settings.as_entire_binding(),
                &maps.soft_lights,
            )),
        )
    };
    let mut groups: HashMap<(Entity, usize), BindGroup> = HashMap::default();
    for draw in &particles.draws {
        let Some(of) = particles.forests.get(&draw.entity) else { continue };
        for tree in &draw.trees {
            if let Some((buffer, _)) = of.buffers.get(tree.variant) {
                groups.entry((draw.entity, tree.variant)).or_insert_with(|| group_of(buffer));
            }
        }
    }
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("canopy_style_particles"),
        color_attachments: &[cleared(dabs)],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "canopy_style_particles");
    if let Some(pipeline) = pipeline {
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        for draw in &particles.draws {
            pass.set_bind_group(1, &draw.instances, &[0]);
            for tree in &draw.trees {
                let Some(own) = groups.get(&(draw.entity, tree.variant)) else { continue };
                pass.set_bind_group(2, own, &[]);
                pass.draw(0..6 * tree.count, tree.index..tree.index + 1);
            }
        }
    }
    span.end(&mut pass);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crowns_are_covered_about_as_densely_at_any_distance() {
        let settings = settings((1280, 720));
        // Area of the dabs over that of the crown's box, in pixels.
        let cover = |distance: f32| {
            let scale = 700.0 / distance;
            let pixels = (SIZE * scale).max(settings.least_pixels);
            wanted(&settings, 700.0, distance, 12.0, 4.0) * pixels * pixels / (96.0 * scale * scale)
        };
        for distance in [2.0, 20.0, 100.0, 300.0] {
            assert!((cover(distance) - COVER).abs() < 1e-3, "{distance}: {}", cover(distance));
        }
        // Fewer from afar.
        let count = |distance| wanted(&settings, 700.0, distance, 12.0, 4.0);
        assert!(count(20.0) > 300.0 && count(300.0) < 0.2 * count(20.0) && count(0.0).is_finite());
    }
}
