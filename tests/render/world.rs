//! Canopy in a Bevy world: beside ordinary meshes, with entities that come and go, and what it refuses.

use std::sync::Arc;

use bevy::{
    asset::RenderAssetUsages,
    camera::{RenderTarget, visibility::RenderLayers},
    core_pipeline::prepass::MotionVectorPrepass,
    diagnostic::{Diagnostic, DiagnosticPath, DiagnosticsStore},
    prelude::*,
    render::{RenderApp, render_resource::TextureFormat, view::Msaa},
};
use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    bake::{
        BakeSettings, BakedLevel, BakedPlant, bake_plant,
        levels::cross::CrossSettings,
        lighting::{LightingSettings, implicit::ImplicitSettings},
    },
    render::{
        components::{CanopyCamera, CastsCanopyShadow, Forest, SunShadowSettings},
        diagnostics::record_counts,
        forest::{ForestStatistics, GpuForests},
        terrain::TerrainStatistics,
    },
    scene::Viewpoint,
};
use glam::{DVec2, DVec3};

use super::{NOON, SIZE, again, despawn, draw, showing};
use crate::support::{
    gpu::gpu,
    image::{difference, keep, linear, luminance, mean_color},
    stage::{Built, PLACE, build, grove, instant, project, quality, trees_at, view},
};

/// A red cube, `size` metres wide.
fn cube(renderer: &mut Renderer, size: f32, place: DVec3) -> Entity {
    let world = renderer.app().world_mut();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::new(size, size, size));
    let red = StandardMaterial { base_color: Color::srgb(1.0, 0.0, 0.0), unlit: true, ..StandardMaterial::default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(red);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(place.as_vec3()))).id()
}

/// Pixels that are red as nothing in a forest is.
fn red(picture: &RenderedImage) -> usize {
    let is_red = |pixel: &&[u8]| f32::from(pixel[0]) > 2.0 * f32::from(pixel[1].max(pixel[2])) && pixel[0] > 60;
    picture.pixels.chunks(3).filter(is_red).count()
}

fn forests(renderer: &mut Renderer) -> Vec<Entity> {
    let world = renderer.app().world_mut();
    world.query_filtered::<Entity, With<Forest>>().iter(world).collect()
}

/// Draws what is there twice: what was spawned is on the device in the second frame.
#[track_caller]
fn settled(renderer: &mut Renderer, stage: &Stage, view: &Viewpoint) -> RenderedImage {
    renderer.set_instant(stage, instant(NOON));
    renderer.set_view(view);
    again(renderer);
    again(renderer)
}

#[test]
fn meshes_and_trees_hide_each_other() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::ZERO], 1);
    let stage = &built.stage;
    // Once with the tree as a full model, once as a cross.
    for distance in [18.0, 70.0] {
        let from = view(stage, (0.0, 6.0, distance), 0.0, 0.0);
        let mut renderer = showing(stage);
        let behind = cube(&mut renderer, 4.0, DVec3::new(0.0, 7.0, -6.0));
        let hidden = settled(&mut renderer, stage, &from);
        keep(&hidden, &format!("cube-behind-{distance}"));
        renderer.app().world_mut().despawn(behind);
        let before = cube(&mut renderer, 2.0, DVec3::new(0.0, 7.0, 8.0));
        let whole = settled(&mut renderer, stage, &from);
        keep(&whole, &format!("cube-before-{distance}"));

        despawn::<With<Forest>>(&mut renderer);
        let without = settled(&mut renderer, stage, &from);
        assert_eq!(red(&whole), red(&without), "at {distance} m a tree covers a cube that stands before it");
        renderer.app().world_mut().despawn(before);
        cube(&mut renderer, 4.0, DVec3::new(0.0, 7.0, -6.0));
        let free = settled(&mut renderer, stage, &from);
        assert!(red(&free) >= 30 && red(&without) >= 10, "{} and {} red pixels", red(&free), red(&without));
        assert!(
            red(&hidden) * 2 < red(&free),
            "at {distance} m {} of {} pixels of a cube are seen through a tree",
            red(&hidden),
            red(&free)
        );
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

fn bare() -> Built {
    let quality = quality(1);
    build(&format!("(terrain: Flat(size: 200), {PLACE}, {quality})"), &[])
}

#[test]
fn a_mesh_casts_its_shadow_onto_the_ground() {
    let gpu = gpu();
    let built = bare();
    let stage = &built.stage;
    let from = view(stage, (0.0, 40.0, 30.0), 0.0, -50.0);
    let mut renderer = showing(stage);
    renderer.set_shadow(SunShadowSettings { map_size: 1024, cascades: 1, distance: 80.0, ..Default::default() });
    let cube = cube(&mut renderer, 4.0, DVec3::new(0.0, 12.0, 0.0));
    let without = settled(&mut renderer, stage, &from);
    renderer.app().world_mut().entity_mut(cube).insert(CastsCanopyShadow);
    let with = settled(&mut renderer, stage, &from);
    keep(&with, "cube-shadow");
    let sun = renderer.app().world().resource::<canopy::render::components::Daylight>().0.key_direction.as_dvec3();
    let spot = DVec3::new(0.0, 12.0, 0.0) - sun * (12.0 / sun.y);
    let share = |point: DVec3| {
        let at = project(&from, SIZE, point).expect("before the camera");
        let mean = |picture: &RenderedImage| {
            luminance(mean_color(picture, |column, row| {
                (DVec2::new(f64::from(column), f64::from(row)) + 0.5 - at).abs().max_element() <= 1.5
            }))
        };
        mean(&with) / mean(&without)
    };
    assert!(share(spot) < 0.6, "{} of the light is left in the shadow", share(spot));
    let beside = share(spot + DVec3::new(7.0, 0.0, 0.0));
    assert!((beside - 1.0).abs() < 0.02, "{beside} beside it");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_forest_that_is_despawned_frees_what_it_held() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = showing(stage);
    let second = Forest { origin: DVec3::new(0.0, 30.0, 0.0), ..stage.forest().expect("a forest") };
    renderer.app().world_mut().spawn(second);
    settled(&mut renderer, stage, &from);
    let on_device =
        |renderer: &mut Renderer| renderer.app().sub_app(RenderApp).world().resource::<GpuForests>().iter().count();
    assert_eq!(on_device(&mut renderer), 2, "several forests in one world");
    assert!(Arc::strong_count(&stage.stand) > 1 && Arc::strong_count(&stage.plants) > 1);
    despawn::<With<Forest>>(&mut renderer);
    settled(&mut renderer, stage, &from);
    assert_eq!(on_device(&mut renderer), 0);
    assert_eq!((Arc::strong_count(&stage.stand), Arc::strong_count(&stage.plants)), (1, 1));
    let grounds: Vec<Entity> = {
        let world = renderer.app().world_mut();
        world.query_filtered::<Entity, With<canopy::render::components::Ground>>().iter(world).collect()
    };
    for ground in grounds {
        renderer.app().world_mut().despawn(ground);
    }
    settled(&mut renderer, stage, &from);
    assert_eq!(Arc::strong_count(&stage.terrain), 1, "the ground is held after it was despawned");
    assert_eq!(stage.cover.as_ref().map(Arc::strong_count), Some(1), "the cover is held");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Gives every forest these plants.
fn set_plants(renderer: &mut Renderer, plants: &Arc<Vec<BakedPlant>>) {
    for forest in forests(renderer) {
        if let Some(mut forest) = renderer.app().world_mut().get_mut::<Forest>(forest) {
            forest.plants = plants.clone();
        }
    }
}

#[test]
fn another_light_is_drawn_as_if_it_had_always_been_there() {
    let gpu = gpu();
    // Near and far trees: models and crosses.
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let settings = BakeSettings {
        lighting: LightingSettings::Expressive(ImplicitSettings::default()),
        cross: CrossSettings { resolution: 64, ..CrossSettings::default() },
        ..BakeSettings::default()
    };
    let lit = |plant: &BakedPlant| {
        let (baked, _) = bake_plant(plant.plant.clone(), &settings, None);
        let cross = baked.cross().expect("a cross").clone();
        BakedPlant { lighting: baked.lighting, ..plant.clone() }.with_level(BakedLevel::Cross(cross))
    };
    let plants = Arc::new(stage.plants.iter().map(lit).collect::<Vec<_>>());

    let mut renderer = showing(stage);
    let before = settled(&mut renderer, stage, &from);
    let generations = |renderer: &mut Renderer| -> Vec<u64> {
        let forests = renderer.app().sub_app(RenderApp).world().resource::<GpuForests>();
        forests.iter().map(|(_, forest)| forest.generation).collect()
    };
    let generation = generations(&mut renderer);
    set_plants(&mut renderer, &plants);
    let relit = settled(&mut renderer, stage, &from);
    keep(&relit, "relit");
    assert_eq!(generations(&mut renderer), generation, "shadows are drawn anew for a light in the leaves");
    let mut fresh = showing(stage);
    set_plants(&mut fresh, &plants);
    assert!(settled(&mut fresh, stage, &from) == relit, "relit plants are drawn otherwise than new ones");
    assert!(before != relit);
    set_plants(&mut renderer, &stage.plants);
    assert!(settled(&mut renderer, stage, &from) == before, "the way back leads elsewhere");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_second_camera_is_refused() {
    let gpu = gpu();
    let built = grove(4);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = showing(stage);
    let alone = draw(&mut renderer, stage, &from, NOON);
    let world = renderer.app().world_mut();
    let target = Image::new_target_texture(64, 64, TextureFormat::Rgba8UnormSrgb, None);
    let target =
        world.resource_mut::<Assets<Image>>().add(Image { asset_usage: RenderAssetUsages::RENDER_WORLD, ..target });
    world.spawn((
        Camera3d::default(),
        Camera { order: 1, ..Camera::default() },
        RenderTarget::from(target),
        CanopyCamera,
        Msaa::Off,
        Transform::from_xyz(3.0, 320.0, 5.0),
    ));
    let beside = settled(&mut renderer, stage, &from);
    let told = gpu.messages();
    assert!(told.iter().any(|message| message.contains("2 cameras have a CanopyCamera")), "{told:?}");
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(beside == alone, "the first camera's image changed");
}

#[test]
fn motion_vectors_are_refused() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = showing(stage);
    draw(&mut renderer, stage, &from, NOON);
    let world = renderer.app().world_mut();
    let camera = world.query_filtered::<Entity, With<CanopyCamera>>().iter(world).next().expect("a camera");
    world.entity_mut(camera).insert(MotionVectorPrepass);
    let picture = settled(&mut renderer, stage, &from);
    let told = gpu.messages();
    assert!(told.iter().any(|message| message.contains("motion vectors") && message.contains("Use MSAA")), "{told:?}");
    keep(&picture, "motion-vectors");
    // Bevy's dither is all that is left.
    let first = &picture.pixels[..3];
    let plain = |pixel: &[u8]| pixel.iter().zip(first).all(|(a, b)| a.abs_diff(*b) <= 3);
    assert!(picture.pixels.chunks(3).all(plain), "something was drawn");
}

/// The grove's trees alone, with `place` on the forest's entity.
fn placed(stage: &Stage, place: impl Bundle) -> RenderedImage {
    let mut renderer = super::renderer(1);
    renderer.set_instant(stage, instant(NOON));
    renderer.set_view(&super::pictures::over_the_grove(stage));
    let forest = stage.forest().expect("a forest");
    renderer.app().world_mut().spawn((forest, place));
    again(&mut renderer)
}

#[test]
fn transform_visibility_and_render_layers_of_a_forest_take_effect() {
    let _gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let plain = placed(stage, ());
    let bare = placed(stage, Visibility::Hidden);
    assert!(plain.pixels != bare.pixels, "a control: trees are seen");
    assert_eq!(placed(stage, RenderLayers::layer(3)).pixels, bare.pixels);
    // Moved there by its origin and back by its transform, a forest stands where it did.
    let away = DVec3::new(64.0, 0.0, -128.0);
    let moved = Forest { origin: away, ..stage.forest().expect("a forest") };
    let mut renderer = super::renderer(1);
    renderer.set_instant(stage, instant(NOON));
    renderer.set_view(&super::pictures::over_the_grove(stage));
    renderer.app().world_mut().spawn((moved, Transform::from_translation(-away.as_vec3())));
    assert_eq!(again(&mut renderer).pixels, plain.pixels);
}

#[test]
fn a_scene_moves_with_its_ground() {
    let _gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let seen = |offset: DVec3| {
        let mut renderer = super::renderer(1);
        renderer.set_instant(stage, instant(NOON));
        let view = super::pictures::over_the_grove(stage);
        renderer.set_view(&Viewpoint { position: view.position + offset, ..view });
        let place = Transform::from_translation(offset.as_vec3());
        renderer.app().world_mut().spawn((stage.forest().expect("a forest"), place));
        renderer.app().world_mut().spawn((stage.ground(), place));
        // The cascades' grid lies in the scene: where it falls, shadows differ by parts of a texel.
        renderer.set_shadow(SunShadowSettings { cascades: 0, ..stage.shadow() });
        again(&mut renderer)
    };
    let (here, there) = (seen(DVec3::ZERO), seen(DVec3::new(2048.0, 0.0, -1024.0)));
    keep(&there, "moved-scene");
    let error = difference(&there, &here);
    assert!(error < 0.005, "{error}");
}

#[test]
fn an_ordinary_mesh_receives_the_shadow_of_trees() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::ZERO], 1);
    let stage = &built.stage;
    // A white plate over the ground, seen from straight above beside the tree.
    let plate = |renderer: &mut Renderer| {
        let world = renderer.app().world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Plane3d::default().mesh().size(60.0, 60.0).build());
        let white = world.resource_mut::<Assets<StandardMaterial>>().add(Color::WHITE);
        let height = stage.terrain.height(0.0, 0.0) as f32 + 0.5;
        world.spawn((Mesh3d(mesh), MeshMaterial3d(white), Transform::from_xyz(0.0, height, 0.0)));
    };
    let seen = |trees: bool, maps: bool| {
        let mut renderer = super::renderer(1);
        renderer.set_instant(stage, instant(NOON));
        renderer.set_view(&view(stage, (0.0, 45.0, 0.0), 0.0, -90.0));
        renderer.set_shadow(stage.shadow());
        if trees {
            renderer.app().world_mut().spawn(stage.forest().expect("a forest"));
        }
        plate(&mut renderer);
        let world = renderer.app().world_mut();
        for mut light in world.query::<&mut DirectionalLight>().iter_mut(world) {
            light.shadow_maps_enabled = maps;
        }
        again(&mut renderer)
    };
    let (shaded, open) = (seen(true, true), seen(true, false));
    keep(&shaded, "shaded-plate");
    // Where the plate lies far from the tree both are alike; in the tree's shadow the plate is darker.
    let darker = |a: &RenderedImage, b: &RenderedImage| {
        let dark = |(a, b): (&[u8], &[u8])| luminance(linear(a)) < 0.7 * luminance(linear(b));
        a.pixels.chunks(3).zip(b.pixels.chunks(3)).filter(|(a, b)| dark((a, b))).count()
    };
    let in_shadow = darker(&shaded, &open);
    assert!(in_shadow > 40, "{in_shadow} pixels in the tree's shadow");
    assert!(in_shadow < (SIZE.0 * SIZE.1 / 4) as usize, "{in_shadow} pixels are more than a tree shades");
    // Controls: without a tree nothing is shaded, and nothing is where the light has no maps.
    assert_eq!(darker(&seen(false, true), &seen(false, false)), 0);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn counts_are_diagnostics() {
    let _gpu = gpu();
    let built = grove(1);
    let mut renderer = showing(&built.stage);
    draw(&mut renderer, &built.stage, &super::pictures::over_the_grove(&built.stage), NOON);
    again(&mut renderer);
    let world = renderer.app().sub_app(RenderApp).world();
    let (statistics, terrain) = (world.resource::<ForestStatistics>(), world.resource::<TerrainStatistics>());
    let mut store = DiagnosticsStore::default();
    record_counts(&mut store, statistics, terrain);
    let value = |path: &str| store.get(&DiagnosticPath::new(path.to_owned())).and_then(Diagnostic::value);
    for level in &statistics.levels {
        let name = level.representation.name();
        assert!(level.trees > 0);
        assert_eq!(value(&format!("canopy/forest/{name}/trees")), Some(level.trees as f64));
        assert_eq!(value(&format!("canopy/forest/{name}/triangles")), Some(level.triangles as f64));
    }
    assert!(value("canopy/terrain/tiles").is_some_and(|tiles| tiles > 0.0));
    assert_eq!(value("canopy/forest/none/trees"), None);
}
