//! The exposure at the camera: bright in the wood, without a jump on the way into it, and fixed where a scene says so.

use std::sync::Arc;

use bevy::camera::Exposure;
use canopy::{
    assets::Stage,
    light::{Atmosphere, AtmosphereParams, LightState},
    render::{
        components::CanopyCamera,
        exposure::{CameraExposure, PlaceExposure, StandTotals},
    },
};
use glam::DVec3;

use super::{DUSK, NIGHT, NOON, draw, showing};
use crate::support::{
    gpu::gpu,
    image::{keep, luminance, mean_color},
    stage::{BROADLEAF, Built, PLACE, build, instant, quality, view},
};

/// A dense wood whose edge runs through the middle of a plain.
fn edge(camera: &str) -> Built {
    let quality = quality(1);
    build(
        &format!(
            "(name: \"edge\", seed: 7, terrain: Flat(size: 400), species: [{BROADLEAF}], trees: \
             Scattered(stems_per_hectare: 700, area: (west: 0, south: -150, east: 150, north: 150)), {PLACE}, {quality}\
             {camera})"
        ),
        &[],
    )
}

fn light(stage: &Stage, at: &str) -> Arc<LightState> {
    let air = Atmosphere::new(AtmosphereParams::with_visibility_km(40.0)).expect("air");
    Arc::new(stage.sun(instant(at)).light(&air).expect("light"))
}

fn at(stage: &Stage, exposure: &CameraExposure, east: f64, above: f64) -> PlaceExposure {
    exposure.at(&stage.ground(), DVec3::new(east, stage.terrain.height(east, 0.0) + above, 0.0))
}

#[test]
fn exposure_follows_the_light_into_the_wood_without_a_jump() {
    let built = edge("");
    let stage = &built.stage;
    for hour in [NOON, DUSK, NIGHT] {
        let light = light(stage, hour);
        let exposure = CameraExposure::new(light.clone(), StandTotals::of(&stage.stand, &stage.plants));
        let open = at(stage, &exposure, -150.0, 1.7);
        assert_eq!(open.ev100, light.ev100, "{hour}: far from the wood nothing changes");
        let inside = at(stage, &exposure, 75.0, 1.7);
        assert!((1.0..7.0).contains(&(open.ev100 - inside.ev100)), "{hour}: {inside}");
        let mut before = open.ev100;
        for metre in -150..=75 {
            let here = at(stage, &exposure, f64::from(metre), 1.7).ev100;
            // A sixteenth of a stop is four percent.
            assert!((here - before).abs() <= 0.14, "{hour}: {} stops at {metre} m", here - before);
            assert!(here.is_finite() && here <= open.ev100);
            before = here;
        }
        // Up through the crowns it rises steadily to that in the open.
        let mut before = inside.ev100;
        for decimetre in 17..300 {
            let here = at(stage, &exposure, 75.0, f64::from(decimetre) * 0.1).ev100;
            assert!(here >= before - 1e-3 && here - before < 0.13, "{hour}: {} stops at {decimetre} dm", here - before);
            before = here;
        }
        assert_eq!(before, light.ev100);
        for strange in [DVec3::NAN, DVec3::INFINITY, DVec3::splat(-1e300)] {
            assert!(exposure.at(&stage.ground(), strange).ev100.is_finite());
        }
    }
}

#[test]
fn the_inside_of_a_wood_is_no_black_picture_and_a_fixed_exposure_stays() {
    let gpu = gpu();
    let built = edge("");
    let stage = &built.stage;
    let inside = view(stage, (75.0, 1.7, 0.0), 90.0, 0.0);
    let mut renderer = showing(stage);
    let bright = draw(&mut renderer, stage, &inside, NOON);
    keep(&bright, "exposure-inside");
    let world = renderer.app().world_mut();
    let ev =
        world.query_filtered::<&Exposure, bevy::ecs::query::With<CanopyCamera>>().iter(world).next().map(|e| e.ev100);
    let explained = renderer.explain().join("\n");
    assert!(explained.contains("exposure: ran (EV ") && explained.contains("stops brighter"), "{explained}");

    let open_ev = light(stage, NOON).ev100;
    assert!(ev.is_some_and(|ev| ev < open_ev - 1.0), "{ev:?} inside, {open_ev} in the open");
    let fixed = edge(&format!(", camera: (exposure: {open_ev})"));
    let mut renderer = showing(&fixed.stage);
    let dark = draw(&mut renderer, &fixed.stage, &inside, NOON);
    keep(&dark, "exposure-fixed");
    assert!(renderer.explain().join("\n").contains("fixed"));
    let mean = |picture| luminance(mean_color(picture, |_, _| true));
    assert!(mean(&bright) > 1.8 * mean(&dark), "{} with the wood's exposure, {} without", mean(&bright), mean(&dark));
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A picture does not depend on the frame before it.
#[test]
fn exposure_has_no_history() {
    let _gpu = gpu();
    let built = edge("");
    let stage = &built.stage;
    let inside = view(stage, (60.0, 1.7, 0.0), 90.0, 0.0);
    let fresh = draw(&mut showing(stage), stage, &inside, NOON);
    let mut travelled = showing(stage);
    draw(&mut travelled, stage, &view(stage, (-150.0, 30.0, 0.0), 90.0, 0.0), NIGHT);
    let after = draw(&mut travelled, stage, &inside, NOON);
    assert!(fresh == after, "the frames before show");
}
