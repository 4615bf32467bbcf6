//! Images: small scenes drawn without a window, on whatever graphics driver there is (a software one will do).

mod arrival;
mod coherence;
mod device;
mod drape;
mod exposure;
mod foliage;
mod forests;
mod gloss;
mod levels;
mod light_updates;
mod lists;
mod memory;
mod pictures;
mod plate;
mod plugins;
mod shadows;
mod style;
mod texture_compression;
mod traps;
mod world;

use bevy::ecs::{entity::Entity, query::QueryFilter};
use canopy::app::{RenderedImage, Renderer};
use canopy::assets::Stage;
use canopy::scene::Viewpoint;

use crate::support::stage::instant;

/// Size of the tests' images.
const SIZE: (u32, u32) = (192, 108);

const NOON: &str = "2026-06-21T12:30+01:00";
/// The sun stands a degree and a half above the horizon.
const DUSK: &str = "2026-06-21T20:15+01:00";
const NIGHT: &str = "2026-06-22T00:30+01:00";

#[track_caller]
fn renderer(samples: u32) -> Renderer {
    match Renderer::new(SIZE, None, samples) {
        Ok(renderer) => renderer,
        Err(error) => panic!("{error}"),
    }
}

/// A renderer of its own for `stage`.
#[track_caller]
fn showing(stage: &Stage) -> Renderer {
    let mut renderer = renderer(stage.scene.quality.msaa);
    renderer.show(stage);
    renderer
}

#[track_caller]
fn draw(renderer: &mut Renderer, stage: &Stage, view: &Viewpoint, at: &str) -> RenderedImage {
    match renderer.draw(stage, view, instant(at)) {
        Ok(picture) => picture,
        Err(error) => panic!("{error}"),
    }
}

/// Another frame of what is there.
#[track_caller]
fn again(renderer: &mut Renderer) -> RenderedImage {
    match renderer.update().and_then(|()| renderer.read()) {
        Ok(picture) => picture,
        Err(error) => panic!("{error}"),
    }
}

/// Despawns the entities that `F` selects.
fn despawn<F: QueryFilter>(renderer: &mut Renderer) {
    let world = renderer.app().world_mut();
    let entities: Vec<Entity> = world.query_filtered::<Entity, F>().iter(world).collect();
    entities.into_iter().for_each(|entity| _ = world.despawn(entity));
}
