//! Forests that arrive over several frames.

use std::sync::Arc;

use bevy::prelude::*;
use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    render::{
        components::{Forest, ForestUpdates, SunShadowSettings, TreeListMaker, TreeLists},
        report::{FrameReport, PassOutcome},
    },
    scatter::{Cell, PackedStand, packed::CELL_BITS},
};
use glam::DVec3;

use super::{NOON, again, despawn, draw, forests::objects, showing};
use crate::support::{
    gpu::gpu,
    stage::{grove, view},
};

/// Bytes that a frame may write: the budget, and what the last write exceeds it by.
const MOST_PER_FRAME: f64 = 12.7e6;
/// More frames than any forest here needs.
const PATIENCE: usize = 200;
/// Cells from the forest to the trees that are in no view.
const CELLS_BEHIND: i32 = 20;

/// What the last frame did for those passes whose name begins with `name`; the text of each that ran.
fn ran(renderer: &mut Renderer, name: &str) -> Vec<String> {
    let outcomes = renderer.app().world().resource::<FrameReport>().outcomes();
    let text = |(pass, outcome): (String, PassOutcome)| match outcome {
        PassOutcome::Ran(on) if pass.starts_with(name) => Some(on),
        _ => None,
    };
    outcomes.into_iter().filter_map(text).collect()
}

/// Whether a map waits for its turn.
fn waits(renderer: &mut Renderer) -> bool {
    let outcomes = renderer.app().world().resource::<FrameReport>().outcomes();
    outcomes.iter().any(|(_, outcome)| matches!(outcome, PassOutcome::Skipped(why) if why.contains("takes up")))
}

/// A renderer in which forests arrive over several frames, with the ground of `stage` alone.
fn spread(stage: &Stage) -> Renderer {
    let mut renderer = showing(stage);
    despawn::<With<Forest>>(&mut renderer);
    renderer.app().insert_resource(ForestUpdates::Spread);
    renderer
}

/// Draws until no map is drawn and none waits. Each frame draws at most one part of a map that takes up a forest. Returns
/// the last image and the number of parts.
#[track_caller]
fn with_shadows(renderer: &mut Renderer) -> (RenderedImage, usize) {
    let mut parts = 0;
    for _ in 0..PATIENCE {
        let image = again(renderer);
        let maps = ran(renderer, "sun_shadow");
        let in_frame = maps.iter().filter(|map| map.contains("parts")).count();
        assert!(in_frame <= 1, "{maps:?}");
        parts += in_frame;
        if maps.is_empty() && !waits(renderer) {
            return (image, parts);
        }
    }
    panic!("the shadows are never complete");
}

/// Draws until the upload is over, and returns the bytes of each frame. All images before the last one are `before`.
#[track_caller]
fn until_drawn(renderer: &mut Renderer, before: &RenderedImage) -> Vec<f64> {
    let mut written = vec![0.0];
    for _ in 0..PATIENCE {
        let image = again(renderer);
        let Some(upload) = ran(renderer, "forest upload").pop() else {
            written.remove(0);
            return written.iter().scan(0.0, |last, now| Some(now - std::mem::replace(last, *now))).collect();
        };
        written.push(1e6 * upload.split(' ').next().and_then(|number| number.parse::<f64>().ok()).expect("a number"));
        let drawn = upload.split(' ').next() == upload.split(' ').nth(2);
        assert!(drawn || image == *before, "it is drawn before it is there: {upload}");
    }
    panic!("the forest never arrives");
}

#[test]
fn a_forest_that_arrives_over_several_frames_ends_in_the_image_of_one_that_is_waited_for() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let whole = draw(&mut showing(stage), stage, &from, NOON);
    for maker in [TreeListMaker::Processor, TreeListMaker::Device] {
        let mut renderer = spread(stage);
        renderer.app().insert_resource(TreeLists { maker, ..default() });
        let ground = draw(&mut renderer, stage, &from, NOON);
        renderer.app().world_mut().spawn(stage.forest().expect("a forest"));
        let mut frames = 0;
        while ran(&mut renderer, "forest upload").is_empty() || ran(&mut renderer, "sun_shadow").is_empty() {
            let image = again(&mut renderer);
            if ran(&mut renderer, "sun_shadow").is_empty() {
                assert!(image == ground, "it is drawn before all of it is there");
            }
            frames += 1;
            assert!(frames < PATIENCE, "the forest never arrives");
        }
        // A pipeline a frame: of the view wood, leaves and crosses, of the maps the same.
        assert!(frames >= 6, "{frames}");
        let (image, parts) = with_shadows(&mut renderer);
        assert!(image == whole, "{maker:?}: it ends in another image");
        // Two maps.
        assert_eq!(parts, 8);
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_forest_that_replaces_another_is_drawn_when_all_of_it_is_there() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = spread(stage);
    let first = stage.forest().expect("a forest");
    let entity = renderer.app().world_mut().spawn(first.clone()).id();
    draw(&mut renderer, stage, &from, NOON);
    until_shown(&mut renderer);
    let (before, _) = with_shadows(&mut renderer);

    // Half of the cells, and a cell far behind the camera whose trees are more than several frames may write.
    let mut stand = PackedStand::clone(&first.stand);
    stand.cells.truncate(stand.cells.len() / 2);
    let (old, behind) = (stand.trees.len(), DVec3::Z * f64::from(CELLS_BEHIND) * stand.grid.size);
    let mut tree = stand.trees[0];
    let row = CELLS_BEHIND + (tree.cell_index(&stand.grid).1 - stand.grid.base.y);
    tree.cell = tree.cell & !(0x3FFF << CELL_BITS) | (row as u32 & 0x3FFF) << CELL_BITS;
    stand.trees.resize(2_000_000, tree);
    let near = stand.cells[0];
    stand.cells.push(Cell {
        iz: near.iz + CELLS_BEHIND,
        first: old as u32,
        count: (stand.trees.len() - old) as u32,
        min: near.min + behind,
        max: near.max + behind,
        ..near
    });
    let second = Forest { stand: Arc::new(stand), ..first };
    renderer.app().world_mut().entity_mut(entity).insert(second.clone());
    let written = until_drawn(&mut renderer, &before);
    assert!(written.len() >= 3 && written.iter().all(|bytes| *bytes <= MOST_PER_FRAME), "{written:?}");
    assert!((written.iter().sum::<f64>() - 32e6) > 0.0, "{written:?}");
    let (after, parts) = with_shadows(&mut renderer);
    assert!(after != before && parts > 0);

    let mut waited = showing(stage);
    despawn::<With<Forest>>(&mut waited);
    waited.app().world_mut().spawn(second);
    assert!(draw(&mut waited, stage, &from, NOON) == after, "it ends in another image");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Draws until no forest is on its way.
fn until_shown(renderer: &mut Renderer) {
    for _ in 0..PATIENCE {
        again(renderer);
        if ran(renderer, "forest upload").is_empty() {
            return;
        }
    }
    panic!("the forest never arrives");
}

#[test]
fn a_forest_that_goes_before_it_has_arrived_leaves_nothing_on_the_device() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = spread(stage);
    let mut counts = Vec::new();
    for frames in [1, 2, 3, 12, 1] {
        renderer.app().world_mut().spawn(stage.forest().expect("a forest"));
        draw(&mut renderer, stage, &from, NOON);
        (1..frames).for_each(|_| _ = again(&mut renderer));
        assert!(objects(&mut renderer)[0] > counts.last().map_or(0, |last: &[usize; 3]| last[0]));
        despawn::<With<Forest>>(&mut renderer);
        again(&mut renderer);
        again(&mut renderer);
        counts.push(objects(&mut renderer));
    }
    // Those that went early brought nothing that stays, and the last one leaves what the one before it left.
    assert!(counts[0] == counts[1] && counts[1] == counts[2] && counts[3] == counts[4], "{counts:?}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_camera_that_flies_while_a_forest_arrives_ends_in_the_same_image() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let mut renderer = spread(stage);
    renderer.set_shadow(SunShadowSettings { finest_radius: 8.0, ..stage.shadow() });
    draw(&mut renderer, stage, &view(stage, (0.0, 10.0, 60.0), 0.0, -5.0), NOON);
    renderer.app().world_mut().spawn(stage.forest().expect("a forest"));
    // Each step moves the box of the finest map.
    let at = |step: f64| view(stage, (4.0 * step, 10.0, 60.0 - 4.0 * step), 0.0, -5.0);
    for step in 1..30 {
        renderer.set_view(&at(f64::from(step)));
        again(&mut renderer);
    }
    let (image, _) = with_shadows(&mut renderer);
    let mut waited = super::renderer(1);
    waited.show(stage);
    waited.set_shadow(SunShadowSettings { finest_radius: 8.0, ..stage.shadow() });
    assert!(draw(&mut waited, stage, &at(29.0), NOON) == image, "it ends in another image");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
