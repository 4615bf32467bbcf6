//! Textures of crosses and clouds in blocks look as those of texels do.

use std::sync::Arc;

use bevy::{prelude::*, render::renderer::RenderDevice};
use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    bake::{
        BakeSettings, BakedPlant, bake_plant,
        levels::{cloud::CloudSettings, cross::CrossSettings},
        lighting::{LightingSettings, transfer::TransferSettings},
    },
    prelude::*,
    render::report::{FrameReport, PassOutcome},
};
use glam::DVec2;

use super::{DUSK, NOON, despawn, draw, showing};
use crate::support::{
    gpu::gpu,
    image::{difference, keep, luminance, mean_color},
    stage::{trees_at, view},
};

/// What the last frame says of the compression.
fn outcome(renderer: &mut Renderer) -> PassOutcome {
    let outcomes = renderer.app().world().resource::<FrameReport>().outcomes();
    let found = outcomes.into_iter().find(|(pass, _)| pass == "texture compression");
    found.map(|(_, outcome)| outcome).expect("every frame says whether textures are compressed")
}

/// A row of trees, and its plant with all levels that have textures.
fn row(lighting: LightingSettings) -> (Stage, BakedPlant) {
    let places: Vec<DVec2> = (-2..=2).map(|tree| DVec2::new(12.0 * f64::from(tree), 10.0)).collect();
    let stage = trees_at(&places, 1).stage;
    let settings = BakeSettings {
        representations: [Representation::MODEL, Representation::CROSS, Representation::CLOUD].into(),
        cross: CrossSettings { resolution: 128, supersampling: 2, ..CrossSettings::default() },
        cloud: CloudSettings { planes: 60, resolution: 512, supersampling: 2, ..CloudSettings::default() },
        lighting,
        ..BakeSettings::default()
    };
    let plant = bake_plant(stage.plants[0].plant.clone(), &settings, None).0;
    (stage, plant)
}

fn transfer() -> LightingSettings {
    LightingSettings::Transfer(TransferSettings { rays: 64, ..TransferSettings::default() })
}

/// Replaces the forest by one of `plant` in `level`, and says whether its textures are compressed.
fn show(renderer: &mut Renderer, stage: &Stage, plant: &BakedPlant, level: Representation, how: Compression) {
    despawn::<With<Forest>>(renderer);
    let app = renderer.app();
    app.insert_resource(TextureCompression(how));
    let forest = stage.forest().expect("a forest");
    app.world_mut().spawn(Forest { plants: Arc::new(vec![plant.clone()]), levels: Levels::only(level), ..forest });
}

fn light(picture: &RenderedImage) -> f64 {
    // The rows of the trees.
    luminance(mean_color(picture, |_, y| (30..85).contains(&y)))
}

#[test]
fn crosses_and_clouds_in_blocks_look_as_those_of_texels() {
    let gpu = gpu();
    for (name, lighting) in [("transfer", transfer()), ("local", LightingSettings::Local)] {
        let (stage, plant) = row(lighting);
        let from = view(&stage, (0.0, 6.0, 55.0), 0.0, -2.0);
        let mut renderer = showing(&stage);
        for level in [Representation::CROSS, Representation::CLOUD] {
            for at in [NOON, DUSK] {
                let mut drawn = |how| {
                    show(&mut renderer, &stage, &plant, level, how);
                    let picture = draw(&mut renderer, &stage, &from, at);
                    (picture, outcome(&mut renderer))
                };
                let (texels, told) = drawn(Compression::Never);
                assert!(matches!(told, PassOutcome::Skipped(why) if why.contains("is `Never`")));
                let (blocks, told) = drawn(Compression::WherePossible);
                if let PassOutcome::Skipped(why) = told {
                    assert!(why.contains("does not read"), "{why}");
                    assert!(blocks == texels);
                    continue;
                }
                keep(&blocks, &format!("blocks-{name}-{}", level.name()));
                let (off, ratio) = (difference(&blocks, &texels), light(&blocks) / light(&texels));
                println!("{name}, {}, {at}: mean FLIP {off:.4}, light {ratio:.3}", level.name());
                // Blocks are no texels, but as near as this; the control is below.
                assert!(off > 0.0 && off < 0.02, "{name}, {}, {at}: mean FLIP {off}", level.name());
                assert!((ratio - 1.0).abs() < 0.03, "{name}, {}, {at}: {ratio} of the light", level.name());
                // The other level of the same plant is farther away.
                let other = if level == Representation::CROSS { Representation::CLOUD } else { Representation::CROSS };
                show(&mut renderer, &stage, &plant, other, Compression::Never);
                let control = difference(&draw(&mut renderer, &stage, &from, at), &texels);
                assert!(control > 2.0 * off, "{name}, {}, {at}: {off} in blocks, control {control}", level.name());
            }
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A new light is written over the blocks of the old one, set by set and layer by layer.
#[test]
fn blocks_take_another_light() {
    let gpu = gpu();
    let (stage, plant) = row(transfer());
    let (_, other) = row(LightingSettings::Transfer(TransferSettings { rays: 8, ..TransferSettings::default() }));
    // The planes and their colours are the same, so that the forest stays and only its light is written.
    let lit = BakedPlant { lighting: other.lighting.clone(), levels: other.levels.clone(), ..plant.clone() };
    let from = view(&stage, (0.0, 6.0, 55.0), 0.0, -2.0);
    let mut renderer = showing(&stage);
    let how = Compression::WherePossible;
    for level in [Representation::CROSS, Representation::CLOUD] {
        show(&mut renderer, &stage, &lit, level, how);
        let wanted = draw(&mut renderer, &stage, &from, NOON);
        show(&mut renderer, &stage, &plant, level, how);
        let before = draw(&mut renderer, &stage, &from, NOON);
        assert!(before != wanted);
        let world = renderer.app().world_mut();
        let plants = Arc::new(vec![lit.clone()]);
        world.query::<&mut Forest>().iter_mut(world).for_each(|mut forest| forest.plants = plants.clone());
        let after = draw(&mut renderer, &stage, &from, NOON);
        assert!(after == wanted, "{}: mean FLIP {}", level.name(), difference(&after, &wanted));
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A level that was not baked has no textures, and a block needs four texels.
#[test]
fn levels_without_a_bake_are_no_blocks() {
    let gpu = gpu();
    let (stage, plant) = row(LightingSettings::Local);
    let from = view(&stage, (0.0, 6.0, 55.0), 0.0, -2.0);
    let mut renderer = showing(&stage);
    let bare = BakedPlant { levels: Vec::new(), ..plant };
    for level in [Representation::CROSS, Representation::CLOUD] {
        show(&mut renderer, &stage, &bare, level, Compression::WherePossible);
        draw(&mut renderer, &stage, &from, NOON);
        let told = gpu.messages();
        assert!(told.iter().all(|message| message.contains("none were baked")), "{told:?}");
    }
}

/// The light of the sun takes twice as many layers in blocks. Where that is more than a device has, it is texels, and all is drawn.
#[test]
fn more_plants_than_blocks_of_the_sun_have_layers_for_are_drawn() {
    let gpu = gpu();
    let (stage, plant) = row(LightingSettings::Local);
    let from = view(&stage, (0.0, 6.0, 55.0), 0.0, -2.0);
    let mut renderer = showing(&stage);
    let limit = renderer.app().world().resource::<RenderDevice>().limits().max_texture_array_layers as usize;
    let mut drawn = |count: usize, how| {
        show(&mut renderer, &stage, &plant, Representation::CROSS, how);
        let world = renderer.app().world_mut();
        let plants = Arc::new(vec![plant.clone(); count]);
        world.query::<&mut Forest>().iter_mut(world).for_each(|mut forest| forest.plants = plants.clone());
        draw(&mut renderer, &stage, &from, NOON)
    };
    let planes = plant.cross().expect("crosses").planes.len();
    let texels = drawn(1, Compression::Never);
    let few = drawn(1, Compression::WherePossible);
    // Two textures a plane are twice as many layers in blocks.
    let many = drawn(limit / (4 * planes) + 1, Compression::WherePossible);
    assert_eq!(gpu.messages(), Vec::<String>::new());
    if few != texels {
        assert!(many != few && many != texels, "the light of the sun is texels, and colours are blocks");
    }
    assert!(difference(&many, &texels) < 0.02);
}
