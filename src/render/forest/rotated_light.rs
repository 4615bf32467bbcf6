//! Rotates the light for radiance transfer into every yaw when it has changed.

use std::sync::Arc;

use bevy::{
    ecs::system::{Res, ResMut},
    render::renderer::RenderQueue,
};

use super::{
    gpu_forest::GpuForests,
    transfer::{SET_BYTES, TransferLight, Wanted, YAWS, beam, rotated},
};
use crate::{
    bake::lighting::BakedLighting,
    light::LightState,
    render::{extract::ExtractedScene, report::FrameReport, view::PreparedFrame},
};

/// Factor on the first coefficient of the sun's light. Four bands leave light where a vertex lies in the shade, and what they have below zero
/// is clamped: with all of the first coefficient, shade was too bright (docs/decisions/0027-leaves-combine-transfer-and-shadow-map.md).
const SUN_FIRST: f32 = 0.9;

/// Rotates the light if it, the exposure or the needs of the plants have changed.
pub fn prepare_transfer_light(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut transfer: ResMut<TransferLight>,
) {
    let transfer = &mut *transfer;
    // The lighting of plants may have changed since the last frame.
    let lit = || {
        let mut plants = forests.iter().flat_map(|(_, forest)| forest.plants());
        plants.any(|plant| matches!(*plant.lighting, BakedLighting::Transfer(_)))
    };
    let Some(buffer) = transfer.buffer.as_ref().filter(|_| lit()) else {
        report.skipped("transfer light", "no plant is lit by radiance transfer");
        return;
    };
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let same = |(light, exposure, wanted): &(Arc<LightState>, f32, Wanted)| {
        Arc::ptr_eq(light, &daylight.0) && *exposure == view.exposure && *wanted == transfer.wanted
    };
    if transfer.uploaded.as_ref().is_some_and(same) {
        report.skipped("transfer light", "the light has not changed");
        return;
    }
    let Wanted { bands, sun } = transfer.wanted;
    let sky = daylight.0.surroundings().project(bands);
    queue.write_buffer(buffer, 0, bytemuck::cast_slice(&rotated(&sky, view.exposure)));
    if sun {
        let mut light = beam(daylight.0.key_direction, daylight.0.key_illuminance, bands);
        if let Some(first) = light.first_mut() {
            *first *= SUN_FIRST;
        }
        queue.write_buffer(buffer, SET_BYTES, bytemuck::cast_slice(&rotated(&light, view.exposure)));
    }
    transfer.uploaded = Some((daylight.0.clone(), view.exposure, transfer.wanted));
    let of = if sun { "sky and sun, " } else { "" };
    report.ran("transfer light", format!("{of}{bands} bands rotated into {YAWS} yaws"));
}
