//! Positions the cascades of a frame, and decides which of them are drawn again and with which casters.

use bevy::{
    ecs::system::{Res, ResMut},
    render::render_resource::{BindGroupEntries, BindingResource, BufferBinding},
};
use glam::{DVec2, DVec3};

use super::{
    maps::{CascadeForest, CascadeKey, CascadeWork, CasterBuffers, DrawnCascade, ShadowMaps},
    meshes::MeshCasters,
};
use crate::{
    cull::{
        SeenShadows, Volume,
        cascades::{CascadeBox, cascade_radii},
    },
    render::{
        bindings::{
            SharedPlacement, SharedTextures, caster_layout,
            uniforms::{CascadeViewUniform, MAX_CASCADES},
        },
        components::ForestUpdates,
        cull::{CullJobs, ListMaker},
        extract::ExtractedScene,
        forest::{GpuForests, ListSlot, ListTarget, ListWork, MAP_SHARES, PageTrees, PreparedPage, forest_view},
        gpu::{self, Gpu, UNIFORM_STRIDE},
        report::FrameReport,
        view::PreparedFrame,
    },
    scatter::PlantSize,
};

/// Places the cascades and gathers the casters of those that changed.
pub fn prepare_shadows(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    meshes: Res<MeshCasters>,
    gpu: Gpu,
    (maker, mut jobs): (Res<ListMaker>, ResMut<CullJobs>),
    report: Res<FrameReport>,
    mut maps: ResMut<ShadowMaps>,
) {
    let maps = &mut *maps;
    maps.work.clear();
    maps.cascades.clear();
    maps.casters.retain(|entity, _| forests.get(*entity).is_some());
    collect(maps, &gpu, &forests);
    let mut list_work = ListWork { maker: *maker, gpu: &gpu, jobs: &mut jobs, report: &report };
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let settings = scene.shadow;
    let light = &daylight.0;
    let direction = light.key_direction.as_dvec3();
    let why_none = if settings.cascades == 0 {
        Some("no cascades are asked for")
    } else if light.key_illuminance.max_element() <= 0.0 || direction.y <= 0.0 {
        Some("no light that casts a shadow is above the horizon")
    } else if forests.have_no_trees() && meshes.is_empty() {
        Some("nothing casts a shadow")
    } else {
        None
    };
    if let Some(why) = why_none {
        maps.fresh = None;
        report.skipped("sun_shadow", why);
        return;
    }
    maps.resize(&gpu.device, &settings);
    let largest = |measure: fn(&PlantSize) -> f32| {
        forests.iter().flat_map(move |(_, f)| f.sizes.iter().map(move |size| measure(size) * f.max_scale))
    };
    let tallest = largest(|size| size.height).fold(10.0f32, f32::max);
    let widest = largest(|size| size.radius).fold(0.0f32, f32::max);
    let radii = cascade_radii(maps.layers.len(), settings.distance.max(1.0), settings.finest_radius.max(1.0));
    maps.cascades = radii
        .iter()
        .map(|&radius| CascadeBox::new(view.camera, radius, maps.map_size, direction, f64::from(tallest)))
        .collect();

    // Where forests arrive over several frames, one map a frame takes up those that are new.
    let spread = scene.forest_updates == ForestUpdates::Spread;
    let (mut takes_new, mut goes_on) = (true, false);
    for index in 0..maps.cascades.len() {
        let place = maps.cascades[index];
        // Near the camera, a finer map already contains the trees' shadows.
        let served = index.checked_sub(1).map_or(0.0, |finer| 0.7 * maps.cascades[finer].radius);
        let content = forests.iter().map(|(entity, forest)| {
            let casting = forest.casting_distances(served..settings.proxy_distance, place.texel, view);
            (entity, forest.generation, forest.forest.origin, casting)
        });
        let mut key = CascadeKey { place, forests: content.collect(), meshes: meshes.state() };
        let name = format!("sun_shadow cascade {index}");
        let this_view = (view.camera, view.clip_from_relative);
        let drawn = maps.drawn[index].as_ref();
        let fits = |drawn: &DrawnCascade, key: &CascadeKey| {
            drawn.key == *key && drawn.seen_by.is_none_or(|seen_by| seen_by == this_view) && !drawn.incomplete
        };
        let mut fresh = false;
        if let Some(older) = spread.then(|| key.without_new_forests(drawn.map(|drawn| &drawn.key))).flatten() {
            let moved = drawn.is_some_and(|drawn| drawn.key.place != place);
            if drawn.is_some_and(|drawn| fits(drawn, &older)) {
                if !std::mem::take(&mut takes_new) {
                    report.skipped(name, "another map takes up a new forest first");
                    continue;
                }
                fresh = true;
            } else if !moved || !std::mem::take(&mut takes_new) {
                // What it holds is not what the world was before the new forest. It takes that forest up in another
                // frame; if it moves, at once, as it may move again in the next frame.
                key = older;
            }
        }
        if drawn.is_some_and(|drawn| fits(drawn, &key)) {
            report.skipped(name, "light, box and casters have not changed");
            continue;
        }
        // For a new light the map is drawn for this view only: while the light moves, the map is replaced before the
        // view changes. If it is not, it is completed once and kept. This view looks the same either way, because the
        // margin includes what the shaders add to a position before the look-up: a few texels, or half a crown for
        // crosses.
        let same_light = drawn.is_some_and(|drawn| drawn.key.place.direction == key.place.direction);
        let margin = 6.0 * place.texel + 0.6 * f64::from(widest);
        let lowest = lowest_receiver(&scene, view.camera, place.radius) - margin;
        let seen = (!same_light && !fresh).then_some(SeenShadows {
            camera: view.camera,
            frustum: &view.frustum,
            lowest,
            margin,
        });
        let casting = key.forests.clone();
        let content = DrawnCascade { key, seen_by: seen.as_ref().map(|_| this_view), incomplete: false };
        if fresh {
            maps.continue_fresh(&gpu.device, index, &content);
            goes_on = true;
        }
        let uniform = CascadeViewUniform {
            clip_from_anchor: place.clip_from_anchor().to_cols_array_2d(),
            direction: place.direction.as_vec3().to_array(),
            padding: 0.0,
        };
        gpu.write(&maps.cascade_uniforms, index as u64 * UNIFORM_STRIDE, bytemuck::bytes_of(&uniform));
        let mut work = CascadeWork { index, content, fresh, forests: Vec::new() };
        for (entity, .., casting) in &casting {
            let (entity, Some(forest)) = (*entity, forests.get(*entity)) else { continue };
            let buffers = maps.casters.entry(entity).or_insert_with(|| CasterBuffers {
                uniform: gpu::uniform_slots(&gpu.device, "canopy_caster_views", MAX_CASCADES as u64),
                lists: Default::default(),
            });
            let uniform = forest_view(forest, place.center, None);
            gpu.write(&buffers.uniform, index as u64 * UNIFORM_STRIDE, bytemuck::bytes_of(&uniform));
            let Some(slots) = buffers.lists.get_mut(index) else { continue };
            slots.resize_with(forest.page_count(), ListSlot::default);
            let mut pages = Vec::with_capacity(slots.len());
            for (page, slot) in slots.iter_mut().enumerate() {
                let Some(drawn) = forest.drawn(page) else { continue };
                let volume = Volume::cascade(&drawn, forest.forest.origin, &place, casting, seen.as_ref());
                pages.push(slot.prepare(
                    &mut list_work,
                    forest,
                    page,
                    ListTarget::ShadowMap,
                    &volume,
                    &buffers.uniform,
                ));
            }
            work.forests.push(CascadeForest { entity, pages });
        }
        let listed = |page: &PreparedPage| match &page.trees {
            PageTrees::Listed(lists) => Some(lists.visible.len()),
            PageTrees::Indirect { .. } => None,
        };
        let trees: Option<usize> = work.forests.iter().flat_map(|forest| &forest.pages).map(listed).sum();
        let trees = trees.map_or_else(|| "trees".to_owned(), |count| format!("{count} trees"));
        let part = if fresh { format!(", one of {MAP_SHARES} parts") } else { String::new() };
        report.ran(name, format!("{trees} within {:.0} m{part}", place.radius));
        maps.work.push(work);
    }
    if !goes_on {
        maps.fresh = None;
    }
    maps.cascade_bind_group = Some(gpu.bind_group(
        "canopy_cascade",
        &caster_layout(),
        &BindGroupEntries::single(BindingResource::Buffer(BufferBinding {
            buffer: &maps.cascade_uniforms,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<CascadeViewUniform>() as u64),
        })),
    ));
}

/// Takes the counts that came back from the device. Maps that were drawn with a list that was too short are drawn again;
/// `true` if there are any.
fn collect(maps: &mut ShadowMaps, gpu: &Gpu, forests: &GpuForests) -> bool {
    let mut short = false;
    for (entity, buffers) in &mut maps.casters {
        let Some(forest) = forests.get(*entity) else { continue };
        for (index, (slots, drawn)) in buffers.lists.iter_mut().zip(&mut maps.drawn).enumerate() {
            for (page, slot) in slots.iter_mut().enumerate() {
                if !slot.collect(gpu, forest, page, ListTarget::ShadowMap) {
                    continue;
                }
                short = true;
                drawn.iter_mut().for_each(|drawn| drawn.incomplete = true);
                maps.fresh.take_if(|fresh| fresh.index == index);
            }
        }
    }
    short
}

/// [`collect_view_counts`](crate::render::forest::collect_view_counts) for the casters.
pub fn collect_caster_counts(gpu: Gpu, forests: Res<GpuForests>, mut maps: ResMut<ShadowMaps>) -> bool {
    collect(&mut maps, &gpu, &forests)
}

/// Height in scene metres below which nothing within `radius` metres of the camera can be in shadow.
fn lowest_receiver(scene: &ExtractedScene, camera: DVec3, radius: f64) -> f64 {
    let ground = scene.ground.as_ref().map(|(_, ground, origin)| {
        let middle = DVec2::new(camera.x - origin.x, camera.z - origin.z);
        f64::from(ground.terrain.height_bounds(middle - radius, middle + radius).0) + origin.y
    });
    ground.unwrap_or(f64::NEG_INFINITY).max(camera.y - radius)
}

/// Passes the maps to the passes that read them.
pub fn share_maps(
    frame: Res<PreparedFrame>,
    maps: Res<ShadowMaps>,
    mut textures: ResMut<SharedTextures>,
    mut placement: ResMut<SharedPlacement>,
) {
    textures.shadow_maps = maps.view.clone();
    placement.shadow_map_size = maps.map_size;
    placement.cascade_count = maps.cascades.len();
    if let Some(view) = &frame.view {
        placement.cascades = maps.uniforms(view.camera);
    }
}
