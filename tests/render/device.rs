//! A device that is lost and made anew.

use bevy::{
    prelude::*,
    render::{
        error_handler::{RenderErrorHandler, RenderErrorPolicy},
        render_resource::PollType,
        renderer::RenderDevice,
        settings::RenderCreation,
    },
};

use super::{NOON, draw, showing};
use crate::support::{
    gpu::gpu,
    stage::{grove, view},
};

/// More updates than a new device needs.
const PATIENCE: usize = 1000;

#[test]
fn a_device_that_is_made_anew_draws_the_same_image() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = showing(stage);
    let first = draw(&mut renderer, stage, &from, NOON);
    let recover = RenderErrorHandler(|_, _, _| RenderErrorPolicy::Recover(RenderCreation::Automatic(Box::default())));
    renderer.app().insert_resource(recover);
    let lost = renderer.app().world().resource::<RenderDevice>().clone();
    lost.wgpu_device().destroy();
    // The device reports its loss when it is polled. Until then Bevy writes to it, and panics.
    let _ = lost.wgpu_device().poll(PollType::Poll);
    // The new device may be equal to the lost one: it has the same number, in another instance of wgpu.
    let since = |app: &App| app.world().resource_ref::<RenderDevice>().last_changed();
    let made = since(renderer.app());
    for _ in 0..PATIENCE {
        if since(renderer.app()) != made {
            break;
        }
        renderer.app().update();
        std::thread::yield_now();
    }
    assert!(since(renderer.app()) != made, "there is no new device: {:?}", gpu.messages());
    let second = draw(&mut renderer, stage, &from, NOON);
    assert!(second == first, "it draws another image: {:?}", gpu.messages());
}
