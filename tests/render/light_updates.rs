//! What follows from the light: in the frame, or in the background.

use bevy::prelude::*;
use canopy::{
    app::Renderer,
    components::{DrawnSun, Sun, SunRefresh},
    render::{
        components::LightUpdates,
        report::{FrameReport, PassOutcome},
    },
};
use chrono::TimeDelta;

use super::{NOON, again, draw, showing};
use crate::support::{
    gpu::gpu,
    stage::{grove, instant, view},
};

/// What the last frame did for the terrain's shadow and the light in stands.
fn outcomes(renderer: &mut Renderer) -> [PassOutcome; 2] {
    let all = renderer.app().world().resource::<FrameReport>().outcomes();
    ["terrain shadow", "stand light"].map(|wanted| {
        let (_, outcome) = all.iter().find(|(pass, _)| pass == wanted).expect("it is reported");
        outcome.clone()
    })
}

/// Whether a frame waited for it, instead of letting it be computed in the background.
fn waited(outcome: &PassOutcome) -> bool {
    matches!(outcome, PassOutcome::Ran(on) if !on.contains("in the background"))
}

/// Whether it is that of the light.
fn is_current(outcome: &PassOutcome) -> bool {
    matches!(outcome, PassOutcome::Skipped(why) if why.contains("not changed"))
}

fn drawn_sun(renderer: &mut Renderer) -> Sun {
    renderer.app().world().resource::<DrawnSun>().0.clone()
}

#[test]
fn light_beside_the_frames_ends_in_the_picture_of_light_in_the_frame() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = showing(stage);
    let first = draw(&mut renderer, stage, &from, NOON);
    assert!(draw(&mut renderer, stage, &from, NOON) == first);
    assert_eq!(*renderer.app().world().resource::<LightUpdates>(), LightUpdates::Blocking);
    let world = renderer.app().world_mut();
    let sun = world.query_filtered::<Entity, With<Sun>>().iter(world).next().expect("a sun");
    world.entity_mut(sun).insert(SunRefresh::Background { lag: 0.0 });
    let mut at = instant(NOON);
    for _ in 0..3 {
        // A quarter of a degree.
        at += TimeDelta::minutes(1);
        renderer.app().world_mut().get_mut::<Sun>(sun).expect("the sun").instant = at;
        let mut taken = [false; 2];
        loop {
            again(&mut renderer);
            let outcomes = outcomes(&mut renderer);
            assert!(!outcomes.iter().any(waited), "a frame computed it itself: {outcomes:?}");
            for (taken, outcome) in taken.iter_mut().zip(&outcomes) {
                *taken |= matches!(outcome, PassOutcome::Ran(_));
            }
            if drawn_sun(&mut renderer).instant == at && outcomes.iter().all(is_current) {
                break;
            }
        }
        assert_eq!(taken, [true; 2], "nothing was computed");
    }
    assert_eq!(*renderer.app().world().resource::<LightUpdates>(), LightUpdates::Background);
    let beside = again(&mut renderer);
    let mut fresh = showing(stage);
    fresh.set_instant(stage, at);
    fresh.set_view(&from);
    again(&mut fresh);
    assert!(again(&mut fresh) == beside, "it ends in another picture");
    assert!(first != beside);

    // After a leap of the clock nothing of the old light is drawn with the new one.
    at += TimeDelta::hours(3);
    renderer.app().world_mut().get_mut::<Sun>(sun).expect("the sun").instant = at;
    while drawn_sun(&mut renderer).instant != at {
        again(&mut renderer);
    }
    let outcomes = outcomes(&mut renderer);
    assert!(outcomes.iter().all(waited), "{outcomes:?}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
