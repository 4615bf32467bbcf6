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
        forest::{GpuForest, GpuForests, ListSlot, PreparedForests},
        frame_work::FrameWork,
        readback::read_words,
        sun_shadow::ShadowMaps,
    },
    scatter::{PackedStand, Stand, Tree},
    scene::Viewpoint,
};
use glam::DVec3;

use super::{NOON, again, draw, renderer};
use crate::support::{
    gpu::gpu,
    image::keep,
    stage::{grove, instant, view},
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
    (maker, trees_per_buffer): (TreeListMaker, usize),
) -> (RenderedImage, Vec<String>) {
    let mut renderer = renderer(msaa);
    renderer.show(stage);
    make_by(&mut renderer, maker, trees_per_buffer);
    replace(&mut renderer, stage, stand, variants, &Levels::model_and_cross(FadeBand::new(30.0, 12.0)));
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
        let all = usize::MAX;
        let (expected, told) = image_of(stage, &packed, 3, &from, msaa, (TreeListMaker::Processor, all));
        assert!(
            told.iter().any(|line| line.contains("tree lists: ran (made on the processor: the program asks")),
            "{told:?}"
        );
        keep(&expected, "lists-of-the-processor");
        let (made, told) = image_of(stage, &packed, 3, &from, msaa, (TreeListMaker::Device, all));
        assert!(told.iter().any(|line| line.contains("tree lists: ran (made on the device)")), "{told:?}");
        assert!(made == expected, "the device's lists give another image");
        for pages in [(TreeListMaker::Processor, 100), (TreeListMaker::Device, 100)] {
            let (split, _) = image_of(stage, &packed, 3, &from, msaa, pages);
            // Pages are drawn one after the other: where the planes of two trees cut each other, a pixel has two fragments of
            // equal depth, and the later one is seen.
            let pixels = split.pixels.chunks(3).zip(expected.pixels.chunks(3)).filter(|(a, b)| a != b).count();
            println!("{pages:?}, {msaa} samples: {pixels} pixels differ");
            assert!(pixels <= 4, "a forest in several buffers gives another image: {pages:?}, {pixels} pixels");
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
    let (expected, before) = image_of(stage, &packed, 2, &from, 1, (TreeListMaker::Processor, usize::MAX));
    let (made, after) = image_of(stage, &packed, 2, &from, 1, (TreeListMaker::Device, usize::MAX));
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
