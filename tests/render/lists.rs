//! Lists of trees that the device makes: equal to the processor's, element by element, and so are the images.

use std::sync::Arc;

use bevy::{
    ecs::world::World,
    render::{
        RenderApp,
        renderer::{RenderDevice, RenderQueue},
    },
};
use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    cull::{DrawLists, select},
    lod::{FadeBand, Levels, Representation},
    render::{
        components::{Forest, TreeListMaker, TreeLists},
        cull::TreeList,
        forest::{ForestStatistics, GpuForest, GpuForests, ListSlot, PreparedForests},
        frame_work::FrameWork,
        readback::read_words,
        sun_shadow::ShadowMaps,
    },
    scatter::{PackedStand, Stand, Tree},
    scene::Viewpoint,
};
use glam::{DVec2, DVec3};

use super::{NOON, again, draw, renderer};
use crate::support::{
    gpu::gpu,
    image::keep,
    stage::{grove, instant, trees_of_quality, view},
};

/// Sizes, places and plants by chance.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// `count` trees of `variants` plants on a square of `size` metres.
fn stand(stage: &Stage, count: usize, size: f64, variants: u16, cell: f64, seed: u64) -> Arc<PackedStand> {
    let mut chance = Chance(seed);
    let mut trees = Vec::with_capacity(count);
    for index in 0..count {
        let (x, z) = (chance.between(-0.5, 0.5) * size, chance.between(-0.5, 0.5) * size);
        trees.push(Tree {
            position: DVec3::new(x, stage.terrain.height(x.clamp(-90.0, 90.0), z.clamp(-90.0, 90.0)), z),
            yaw: chance.between(0.0, 6.0) as f32,
            scale: chance.between(0.7, 1.4) as f32,
            variant: (chance.next() * f64::from(variants)) as u16,
            tint: chance.between(-1.0, 1.0) as f32,
            index: index as u32,
        });
    }
    let sizes = vec![stage.plants[0].size(); usize::from(variants)];
    Arc::new(PackedStand::new(&Stand { trees }, cell, &sizes).expect("trees that can be packed"))
}

/// Lets the forest of `renderer` be `stand` of so many copies of the stage's plant.
fn replace(renderer: &mut Renderer, stage: &Stage, stand: &Arc<PackedStand>, variants: usize, levels: &Levels) {
    let world = renderer.app().world_mut();
    for mut forest in world.query::<&mut Forest>().iter_mut(world) {
        forest.stand = stand.clone();
        forest.plants = Arc::new(vec![stage.plants[0].clone(); variants]);
        forest.levels = levels.clone();
        forest.view_distance = 1e6;
    }
}

fn make_by(renderer: &mut Renderer, maker: TreeListMaker, trees_per_buffer: usize) {
    renderer.app().insert_resource(TreeLists { maker, trees_per_buffer });
}

/// The list of `made`, as the processor would have it.
fn on_device(world: &World, forest: &GpuForest, made: &TreeList) -> DrawLists {
    let counts = made.counts().expect("counts");
    let words = read_words(
        world.resource::<RenderDevice>(),
        world.resource::<RenderQueue>(),
        made.list(),
        counts.wanted as usize,
    );
    let mut groups = counts.groups.iter().cloned();
    let mut level = |count: usize| groups.by_ref().take(count).collect();
    let variants = forest.sizes.len();
    let levels = forest.groupings.iter().map(|grouping| level(grouping.groups(variants))).collect();
    DrawLists { visible: words.expect("words of the device"), levels }
}

/// Compares all lists of the last frame with the processor's; how many lists there were, and how many trees in them.
fn compare(renderer: &mut Renderer) -> (usize, usize) {
    let world = renderer.app().sub_app(RenderApp).world();
    let (mut lists, mut trees) = (0, 0);
    for (entity, forest) in world.resource::<GpuForests>().iter() {
        let mut check = |page: usize, made: &TreeList| {
            let (shape, members) = forest.page_trees(page).expect("the page of a list");
            let volume = made.volume().expect("a list of a volume");
            let expected = select(shape, members, &forest.tree_sizes, &forest.groupings, volume);
            let found = on_device(world, forest, made);
            assert_eq!(found.levels, expected.levels, "ranges of page {page}");
            assert!(found.visible == expected.visible, "trees of page {page}");
            lists += 1;
            trees += expected.visible.len();
        };
        let prepared = world.resource::<PreparedForests>().get(entity).expect("a forest that is drawn");
        prepared.device_lists().enumerate().for_each(|(page, made)| check(page, made));
        for cascade in world.resource::<ShadowMaps>().casters.values().flat_map(|buffers| &buffers.lists) {
            for (page, slot) in cascade.iter().enumerate() {
                slot.device_list().into_iter().for_each(|made| check(page, made));
            }
        }
    }
    (lists, trees)
}

/// Lists of levels to try.
fn some_levels() -> [Levels; 4] {
    let middle = Representation::CROSS;
    [
        Levels::model_and_cross(FadeBand::new(30.0, 12.0)),
        Levels::only(Representation::MODEL),
        Levels::only(Representation::CROSS),
        Levels::only(Representation::MODEL)
            .then(FadeBand::new(12.0, 4.0), middle)
            .then(FadeBand::new(60.0, 30.0), middle),
    ]
}

/// A camera somewhere in or around the stand.
fn some_view(stage: &Stage, chance: &mut Chance, size: f64) -> Viewpoint {
    let place = (
        chance.between(-0.7, 0.7) * size,
        [0.0, 2.0, 30.0, 400.0][(4.0 * chance.next()) as usize],
        chance.between(-0.7, 0.7) * size,
    );
    let mut from = view(stage, (0.0, 2.0, 0.0), chance.between(0.0, 360.0), chance.between(-90.0, 60.0));
    from.position += DVec3::new(place.0, place.1, place.2);
    from.field_of_view = [1.0f64, 20.0, 50.0, 120.0, 170.0][(5.0 * chance.next()) as usize].to_radians();
    from
}

#[test]
fn lists_of_the_device_are_those_of_the_processor() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let mut renderer = renderer(1);
    renderer.show(stage);
    make_by(&mut renderer, TreeListMaker::Device, usize::MAX);
    let mut chance = Chance(5);
    let (mut lists, mut trees) = (0, 0);
    for (case, (count, size, variants, cell)) in [
        (0usize, 100.0, 1u16, 64.0),
        (1, 100.0, 1, 64.0),
        (300, 0.0, 2, 64.0),
        (3_000, 400.0, 3, 64.0),
        (3_000, 400.0, 40, 7.0),
        (6_000, 4_000.0, 5, 250.0),
    ]
    .into_iter()
    .enumerate()
    {
        let packed = stand(stage, count, size, variants, cell, case as u64);
        for levels in some_levels() {
            replace(&mut renderer, stage, &packed, variants.into(), &levels);
            for step in 0..4 {
                renderer.set_instant(stage, instant([NOON, super::DUSK][step % 2]));
                renderer.set_view(&some_view(stage, &mut chance, size.max(50.0)));
                again(&mut renderer);
                let (more_lists, more_trees) = compare(&mut renderer);
                (lists, trees) = (lists + more_lists, trees + more_trees);
            }
        }
    }
    println!("{lists} lists with {trees} trees");
    assert!(lists > 150 && trees > 50_000, "{lists} lists with {trees} trees");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// The image of `maker` with so many trees in a buffer.
fn image_of(
    stage: &Stage,
    stand: &Arc<PackedStand>,
    variants: usize,
    from: &Viewpoint,
    msaa: u32,
    levels: &Levels,
    (maker, trees_per_buffer): (TreeListMaker, usize),
) -> (RenderedImage, Vec<String>) {
    let mut renderer = renderer(msaa);
    renderer.show(stage);
    make_by(&mut renderer, maker, trees_per_buffer);
    replace(&mut renderer, stage, stand, variants, levels);
    let image = draw(&mut renderer, stage, from, NOON);
    (image, renderer.explain())
}

#[test]
fn the_image_does_not_depend_on_who_made_the_lists() {
    let gpu = gpu();
    for msaa in [1, 4] {
        let built = grove(msaa);
        let stage = &built.stage;
        let from = view(stage, (10.0, 4.0, 30.0), 350.0, -6.0);
        let packed = stand(stage, 900, 180.0, 3, 64.0, 1);
        let both = Levels::model_and_cross(FadeBand::new(30.0, 12.0));
        let all = usize::MAX;
        let (expected, told) = image_of(stage, &packed, 3, &from, msaa, &both, (TreeListMaker::Processor, all));
        assert!(
            told.iter().any(|line| line.contains("tree lists: ran (made on the processor: the program asks")),
            "{told:?}"
        );
        keep(&expected, "lists-of-the-processor");
        let (made, told) = image_of(stage, &packed, 3, &from, msaa, &both, (TreeListMaker::Device, all));
        assert!(told.iter().any(|line| line.contains("tree lists: ran (made on the device)")), "{told:?}");
        assert!(made == expected, "the device's lists give another image");

        // Buffers are drawn one after the other, so trees come in another order. That is not seen with one sample a pixel,
        // nor in crosses. With several samples it is seen in models: their light is interpolated at the centroid of
        // the covered samples, and a driver may count only those that passed the depth test before, which depends on
        // what was drawn already. The software driver does. Only the light of pixels at the edges of leaves differs.
        let crosses = Levels::only(Representation::CROSS);
        let (of_crosses, _) = image_of(stage, &packed, 3, &from, msaa, &crosses, (TreeListMaker::Processor, all));
        for pages in [(TreeListMaker::Processor, 100), (TreeListMaker::Device, 100)] {
            let (split, _) = image_of(stage, &packed, 3, &from, msaa, &crosses, pages);
            assert!(split == of_crosses, "{msaa} samples, {pages:?}: crosses in several buffers give another image");
            let (split, _) = image_of(stage, &packed, 3, &from, msaa, &both, pages);
            let pairs = || split.pixels.chunks(3).zip(expected.pixels.chunks(3)).filter(|(a, b)| a != b);
            let values = pairs().flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)));
            let (pixels, farthest) = (pairs().count(), values.max().unwrap_or(0));
            println!("{pages:?}, {msaa} samples: {pixels} pixels differ, by {farthest} at most");
            let allowed = if msaa == 1 { 0 } else { split.pixels.len() / 300 };
            assert!(pixels <= allowed && farthest < 40, "{pages:?}: {pixels} pixels differ, by {farthest} at most");
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// All levels that forests have. In several buffers with one sample a pixel only, for the reason that the test before
/// this one gives.
#[test]
fn every_level_is_the_same_whoever_lists_its_trees_and_in_how_many_buffers() {
    let gpu = gpu();
    let names = ["model", "thinned", "cloud", "cross"];
    for samples in [1, 4] {
        let quality = format!(
            "quality: (levels: [(draw: \"model\", until: 20, fade: 8), (draw: \"thinned\", until: 40, fade: 8), (draw: \
             \"cloud\", until: 70, fade: 8), (draw: \"cross\", until: 300, fade: 5)], shadow_map_size: 512, cascades: 3, \
             shadow_distance: 150, cross_resolution: 64, msaa: {samples})"
        );
        let place = |index: u32| DVec2::new(f64::from(index % 13) - 6.0, f64::from(index / 13) - 6.0) * 14.0;
        let places: Vec<DVec2> = (0..169).map(place).collect();
        let stage = trees_of_quality(&places, &quality).stage;
        let from = view(&stage, (3.0, 6.0, 60.0), 8.0, -3.0);
        let image = |lists: TreeLists| {
            let mut renderer = renderer(samples);
            renderer.show(&stage);
            renderer.app().insert_resource(lists);
            let image = draw(&mut renderer, &stage, &from, NOON);
            let statistics = renderer.app().sub_app(RenderApp).world().resource::<ForestStatistics>().clone();
            (image, statistics)
        };
        let all = TreeLists { maker: TreeListMaker::Processor, ..TreeLists::default() };
        let (expected, statistics) = image(all);
        keep(&expected, "lists-of-every-level");
        let counts = statistics.levels.iter().map(|level| (level.representation.name(), level.trees));
        assert!(
            counts.clone().map(|(name, _)| name).eq(names) && counts.clone().all(|(_, trees)| trees > 1),
            "{statistics:?}"
        );
        for maker in [TreeListMaker::Processor, TreeListMaker::Device] {
            for trees_per_buffer in [usize::MAX, 64].into_iter().take(if samples == 1 { 2 } else { 1 }) {
                let lists = TreeLists { maker, trees_per_buffer };
                let (found, of_lists) = image(lists);
                assert!(found == expected, "{samples} samples, {lists:?}: another image");
                assert_eq!(of_lists, statistics, "{samples} samples, {lists:?}");
            }
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn lists_that_are_too_short_grow_and_the_image_is_whole() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let mut from = view(stage, (0.0, 260.0, 300.0), 0.0, -40.0);
    from.field_of_view = 90f64.to_radians();
    let packed = stand(stage, 40_000, 500.0, 2, 64.0, 3);
    let levels = Levels::model_and_cross(FadeBand::new(30.0, 12.0));
    let (expected, before) = image_of(stage, &packed, 2, &from, 1, &levels, (TreeListMaker::Processor, usize::MAX));
    let (made, after) = image_of(stage, &packed, 2, &from, 1, &levels, (TreeListMaker::Device, usize::MAX));
    let forest = |lines: &[String]| lines.iter().find(|line| line.contains(" forest: ran")).cloned();
    assert_eq!(forest(&before), forest(&after));
    assert!(made == expected, "trees are missing");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Bytes on the device of all trees and lists.
fn bytes(renderer: &mut Renderer) -> u64 {
    let world = renderer.app().sub_app(RenderApp).world();
    let of_forest = |(entity, forest): (_, &GpuForest)| {
        let view = world.resource::<PreparedForests>().get(entity).expect("a forest that is drawn");
        let casters =
            world.resource::<ShadowMaps>().casters.values().flat_map(|buffers| buffers.lists.iter().flatten());
        let casters = casters.filter_map(ListSlot::device_list);
        forest.tree_bytes() + view.device_lists().chain(casters).map(TreeList::bytes).sum::<u64>()
    };
    world.resource::<GpuForests>().iter().map(of_forest).sum()
}

#[test]
fn the_processor_works_no_more_for_a_million_trees_than_for_a_thousand() {
    let _gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let work = |count: usize, size: f64| -> Vec<[u64; 4]> {
        let packed = stand(stage, count, size, 1, 64.0, 9);
        let mut renderer = renderer(1);
        renderer.show(stage);
        make_by(&mut renderer, TreeListMaker::Device, usize::MAX);
        replace(&mut renderer, stage, &packed, 1, &Levels::model_and_cross(FadeBand::new(30.0, 12.0)));
        renderer.set_instant(stage, instant(NOON));
        let mut frame = |step: usize| {
            renderer.set_view(&view(stage, (0.0, 12.0, 5.0 - 10.0 * step as f64), 0.0, -5.0));
            again(&mut renderer);
            renderer.app().sub_app(RenderApp).world().resource::<FrameWork>().take()
        };
        (0..4).for_each(|step| {
            frame(step);
        });
        let work = (4..7).map(&mut frame).collect();
        let bytes = bytes(&mut renderer) as f64 / count as f64;
        println!("{count} trees: {bytes:.1} bytes a tree");
        assert!(bytes <= 40.0, "{bytes} bytes a tree");
        work
    };
    let (few, many) = (work(1_000, 200.0), work(1_000_000, 6_000.0));
    println!("bytes, commands, allocations, trees on the processor: {few:?}");
    assert_eq!(few, many);
    assert!(few.iter().all(|[bytes, commands, _, listed]| *bytes > 0 && *commands > 0 && *listed == 0));
}
