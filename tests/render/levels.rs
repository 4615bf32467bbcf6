//! A level of detail that a program adds: the example `box_level`.

use std::sync::Arc;

use bevy::{
    prelude::*,
    render::{RenderApp, renderer::RenderDevice},
};
use canopy::{
    app::{RenderedImage, Renderer, Side, Studio},
    bake::{
        BakeSettings, BakedLevel, BakedPlant, bake_plant,
        levels::{cloud::CloudSettings, cross::CrossSettings},
        lighting::{LightingSettings, transfer::TransferSettings},
    },
    plant::grow::{GrowParameters, grow},
    prelude::*,
    render::forest::{ForestStatistics, LevelStatistics},
};
use glam::{DVec2, DVec3};

use super::{NOON, SIZE, draw, renderer, showing};
use crate::support::{
    gpu::gpu,
    image::{difference, keep},
    stage::{grove, project, trees_at, trees_of_quality, view},
};

#[expect(dead_code, reason = "the example's own program opens a window")]
#[path = "../../examples/box_level.rs"]
mod box_level;

use box_level::{BOX, BoxLevelPlugin};

/// Whether a pixel is red as nothing in a forest is.
fn is_red(pixel: &[u8]) -> bool {
    f32::from(pixel[0]) > 2.0 * f32::from(pixel[1].max(pixel[2])) && pixel[0] > 60
}

fn statistics(renderer: &mut Renderer) -> Vec<LevelStatistics> {
    renderer.app().sub_app(RenderApp).world().resource::<ForestStatistics>().levels.clone()
}

#[test]
fn a_program_adds_a_level_of_its_own() {
    let gpu = gpu();
    // Distances from the camera: two full models, three boxes.
    let near = [DVec2::new(-12.0, 40.0), DVec2::new(14.0, 35.0)];
    let far = [DVec2::new(-20.0, -10.0), DVec2::new(0.0, -15.0), DVec2::new(20.0, -10.0)];
    let built = trees_at(&[near.as_slice(), &far].concat(), 1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 9.0, 60.0), 0.0, -5.0);
    let at = |picture: &RenderedImage, tree: DVec2| -> Vec<u8> {
        let foot = stage.terrain.height(tree.x, tree.y);
        let pixel = project(&from, SIZE, DVec3::new(tree.x, foot + 5.0, tree.y)).expect("before the camera");
        let first = 3 * (pixel.y as u32 * SIZE.0 + pixel.x as u32) as usize;
        picture.pixels[first..first + 3].to_vec()
    };

    let mut control = renderer(1);
    control.show(stage);
    let without = draw(&mut control, stage, &from, NOON);
    assert!(!without.pixels.chunks(3).any(is_red), "a forest without boxes has their colour");
    assert!(statistics(&mut control).iter().all(|level| level.representation != BOX));

    let mut renderer = renderer(1);
    // The renderer's app is finished already and takes no more plugins, but what this one does.
    BoxLevelPlugin.build(renderer.app());
    renderer.show(stage);
    let picture = draw(&mut renderer, stage, &from, NOON);
    keep(&picture, "boxes");
    for tree in far {
        assert!(is_red(&at(&picture, tree)), "the tree at {tree} is {:?}", at(&picture, tree));
    }
    for tree in near {
        assert!(!is_red(&at(&picture, tree)), "the tree at {tree} is {:?}", at(&picture, tree));
    }
    let levels = statistics(&mut renderer);
    let counts: Vec<_> = levels.iter().map(|level| (level.representation, level.label, level.trees)).collect();
    assert_eq!(counts, [(Representation::MODEL, "full models", 2), (BOX, "boxes", 3)]);
    assert_eq!(levels[1].triangles, 36);

    // Another list of levels takes effect on the same entity.
    let world = renderer.app().world_mut();
    for mut forest in world.query::<&mut Forest>().iter_mut(world) {
        forest.levels = Levels::only(Representation::MODEL);
    }
    let models = draw(&mut renderer, stage, &from, NOON);
    assert!(!models.pixels.chunks(3).any(is_red) && models != without);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_level_that_nothing_draws_is_named_and_the_others_are_drawn() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::new(0.0, 40.0)], 1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 9.0, 60.0), 0.0, -5.0);
    let mut renderer = renderer(1);
    renderer.show(stage);
    let world = renderer.app().world_mut();
    for mut forest in world.query::<&mut Forest>().iter_mut(world) {
        let unknown = Representation::named("hologram");
        forest.levels = Levels::only(Representation::MODEL).then(FadeBand::new(40.0, 0.0), unknown);
    }
    draw(&mut renderer, stage, &from, NOON);
    let told = gpu.messages();
    assert!(
        told.len() == 1 && told[0].contains("`hologram`") && told[0].contains("register_representation"),
        "{told:?}"
    );
    assert_eq!(statistics(&mut renderer).len(), 1);
}

#[test]
fn plants_without_a_bake_are_not_drawn_and_named_once() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::new(-4.0, -20.0), DVec2::new(4.0, -25.0)], 1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 9.0, 60.0), 0.0, -5.0);
    let picture = |levels: &[BakedLevel], view_distance: f32| {
        let mut renderer = renderer(1);
        renderer.show(stage);
        let plants = stage.plants.iter().map(|plant| BakedPlant { levels: levels.to_vec(), ..plant.clone() });
        let plants = Arc::new(plants.collect::<Vec<_>>());
        let world = renderer.app().world_mut();
        for mut forest in world.query::<&mut Forest>().iter_mut(world) {
            forest.plants = plants.clone();
            forest.levels = Levels::only(Representation::CROSS);
            forest.view_distance = view_distance;
        }
        draw(&mut renderer, stage, &from, NOON)
    };
    let all = stage.plants[0].levels.clone();
    assert!(picture(&all, 2000.0) != picture(&all, 0.0), "a control: with a bake there are trees");
    assert_eq!(gpu.messages(), Vec::<String>::new());
    assert!(picture(&[], 2000.0) == picture(&[], 0.0), "something is drawn without a bake");
    let told = gpu.messages();
    assert!(told.len() == 1 && told[0].contains("`broadleaf") && told[0].contains("Representation::CROSS"), "{told:?}");
}

#[test]
fn more_crosses_than_a_texture_array_holds_are_refused_with_the_number_that_fits() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::new(0.0, 40.0)], 1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 9.0, 60.0), 0.0, -5.0);
    let mut renderer = renderer(1);
    renderer.show(stage);
    let limit = renderer.app().world().resource::<RenderDevice>().limits().max_texture_array_layers as usize;
    let plants = Arc::new(vec![stage.plants[0].clone(); limit / 3 + 1]);
    let world = renderer.app().world_mut();
    for mut forest in world.query::<&mut Forest>().iter_mut(world) {
        forest.plants = plants.clone();
        forest.levels = Levels::only(Representation::CROSS);
    }
    draw(&mut renderer, stage, &from, NOON);
    let told = gpu.messages();
    // Four upright planes and a level one, with two layers each of the sun's light.
    let remedy = format!("at most {} plants", limit / 10);
    assert!(told.len() == 1 && told[0].contains("texture layers") && told[0].contains(&remedy), "{told:?}");
    // A scene is refused before it is shown.
    let crowded = Stage { plants, ..built.stage };
    let refused = crowded.check_device(renderer.app().world().resource::<RenderDevice>());
    assert!(refused.is_err_and(|error| error.to_string().contains(&format!("at most {}", limit / 10))));
}

/// Billboard clouds and simplified models against the full model, isolated, in the same light.
#[test]
fn clouds_and_simplified_models_cover_and_shine_about_as_the_full_model_does() {
    let _gpu = gpu();
    let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 6000).expect("a shipped species grows"));
    let transfer = LightingSettings::Transfer(TransferSettings { rays: 64, ..TransferSettings::default() });
    for lighting in [LightingSettings::Local, transfer] {
        let settings = BakeSettings {
            representations: [Representation::MODEL, Representation::THINNED, Representation::CLOUD].into(),
            lighting,
            cloud: CloudSettings { planes: 60, resolution: 512, supersampling: 2, ..CloudSettings::default() },
            ..BakeSettings::default()
        };
        let (baked, _) = bake_plant(plant.clone(), &settings, None);
        let mut studio = Studio::new(baked, 128, None, 4).expect("a renderer");
        studio.show(None).expect("nothing");
        let empty = studio.cutout(Side::South, &Sun::default(), 1.0).expect("an image");
        assert!(empty.area() < 1.0, "{} pixels of nothing are covered", empty.area());
        for side in [Side::West, Side::Above] {
            let mut image = |level| {
                studio.show(Some(level)).expect("a tree");
                studio.cutout(side, &Sun::default(), 1.0).expect("an image")
            };
            let truth = image(Representation::MODEL);
            assert!(truth.area() > 1000.0 && truth.mean_luminance() > 0.01);
            for level in [Representation::THINNED, Representation::CLOUD] {
                let error = image(level).error(&truth);
                let near = |ratio: f64, most: f64| (ratio - 1.0).abs() < most;
                assert!(near(error.coverage, 0.15) && near(error.luminance, 0.35), "{level:?} {side:?}: {error:?}");
                assert!(error.rmse > 0.0, "{level:?} is the model itself");
            }
        }
    }
}

/// A scene that names the levels draws them, with their bakes, and they cast a shadow.
#[test]
fn a_scene_names_the_levels_between_model_and_crosses() {
    let _gpu = gpu();
    let quality = "quality: (levels: [(draw: \"model\", until: 30, fade: 8), (draw: \"thinned\", until: 68, fade: 4), (draw: \
                   \"cloud\", until: 115, fade: 2), (draw: \"cross\", until: 200, fade: 5)], msaa: 1)";
    // Distances from the camera: 10, 30, 50 and 80 m, of trees 11 m high.
    let places = [DVec2::new(-3.0, 50.0), DVec2::new(3.0, 30.0), DVec2::new(-6.0, 10.0), DVec2::new(8.0, -20.0)];
    let stage = trees_of_quality(&places, quality).stage;
    let levels = stage.scene.quality.lod_levels();
    let names: Vec<&str> = levels.representations().iter().map(|level| level.name()).collect();
    assert_eq!(names, ["model", "thinned", "cloud", "cross"]);
    let mut drawn = renderer(1);
    drawn.show(&stage);
    let picture = draw(&mut drawn, &stage, &view(&stage, (0.0, 6.0, 60.0), 0.0, -3.0), NOON);
    let trees = |name: &str| -> usize {
        let levels = statistics(&mut drawn);
        levels.iter().filter(|level| level.representation.name() == name).map(|level| level.trees).sum()
    };
    let counts = ["model", "thinned", "cloud", "cross"].map(trees);
    keep(&picture, "levels-between");
    assert_eq!(counts, [1, 1, 1, 1]);
}

#[test]
fn crosses_whose_depth_is_drawn_first_look_the_same() {
    let gpu = gpu();
    for samples in [1, 4] {
        let built = grove(samples);
        let from = view(&built.stage, (0.0, 10.0, 60.0), 0.0, -5.0);
        let mut renderer = showing(&built.stage);
        let world = renderer.app().world_mut();
        for mut forest in world.query::<&mut Forest>().iter_mut(world) {
            forest.levels = Levels::only(Representation::CROSS);
        }
        let mut drawn = |depth_first: bool| {
            let world = renderer.app().world_mut();
            let mut views = world.query::<&mut ViewOptions>();
            views.iter_mut(world).for_each(|mut options| options.depth_first = depth_first);
            draw(&mut renderer, &built.stage, &from, NOON)
        };
        let (first, at_once) = (drawn(true), drawn(false));
        assert!(first == at_once, "{samples} samples: mean FLIP {}", difference(&first, &at_once));
        // It is no accident: there are trees.
        let statistics = statistics(&mut renderer);
        assert!(statistics.iter().any(|level| level.trees > 50), "{statistics:?}");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// From the sides that a plane faces, a cross with more of them is the same; from between, it is nearer to the model.
#[test]
fn a_cross_with_more_upright_planes_is_nearer_to_the_model_from_between_them() {
    let _gpu = gpu();
    let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 6000).expect("a shipped species grows"));
    let studio = |uprights: u32| {
        let cross = CrossSettings { uprights, resolution: 128, supersampling: 2, ..CrossSettings::default() };
        let settings = BakeSettings { cross, lighting: LightingSettings::Local, ..BakeSettings::default() };
        Studio::new(bake_plant(plant.clone(), &settings, None).0, 96, None, 4).expect("a renderer")
    };
    let image = |studio: &mut Studio, degrees: f32, level| {
        studio.turn(degrees.to_radians());
        studio.show(Some(level)).expect("a tree");
        studio.cutout(Side::South, &Sun::default(), 1.0).expect("an image")
    };
    let (mut two, mut four, mut one) = (studio(2), studio(4), studio(1));
    let mut errors = |degrees: f32| {
        let truth = image(&mut two, degrees, Representation::MODEL);
        [&mut one, &mut two, &mut four].map(|studio| image(studio, degrees, Representation::CROSS).error(&truth).rmse)
    };
    for degrees in [0.0, 90.0, 180.0] {
        let [_, two, four] = errors(degrees);
        // The same plane but for its neighbours' edges.
        assert!((two - four).abs() < 0.005 * two, "{degrees} degrees: {two} with two, {four} with four");
    }
    for degrees in [45.0, 135.0, 225.0] {
        let [one, two, four] = errors(degrees);
        println!("{degrees} degrees: {one:.3}, {two:.3}, {four:.3}");
        assert!(four < 0.85 * two, "{degrees} degrees: {two} with two, {four} with four");
    }
    let [one, two, _] = errors(90.0);
    assert!(two < 0.85 * one, "from the side: {one} with one, {two} with two");
}
