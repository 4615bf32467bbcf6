//! Frame times and counts, sent from the render world to the overlay.
//!
//! Without waiting for the device, frames pile up in its queue and a clock on the CPU measures only a fraction of the
//! frame time. So after each frame an empty submission marks its end on the device, and the render world waits for such
//! a mark before it goes on: on a hardware device for that of the frame before, so that CPU and GPU still overlap; on a
//! software device, which shares the CPU anyway, for the frame's own. The time between two marks reached is the frame
//! time, completion included, and no more than one frame is ever queued, which keeps the controls prompt.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use bevy::{
    app::{App, Plugin},
    ecs::{
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Local, Res, ResMut},
    },
    prelude::PreUpdate,
    render::{
        Render, RenderApp, RenderSystems,
        render_resource::PollType,
        renderer::{RenderAdapterInfo, RenderDevice, RenderQueue},
    },
};
use wgpu::{DeviceType, SubmissionIndex};

use crate::{
    measure::{percentile, sorted},
    render::{forest::ForestStatistics, terrain::TerrainStatistics},
};

/// Number of frames in the overlay's percentiles.
pub const WINDOW: usize = 120;

/// The times of the last [`WINDOW`] frames in seconds, and the counts of the last one.
#[derive(Resource, Clone, Debug, Default)]
pub struct FrameTimes {
    times: VecDeque<f64>,
    /// Trees of the last frame.
    pub forest: ForestStatistics,
    /// Ground of the last frame.
    pub terrain: TerrainStatistics,
}

impl FrameTimes {
    /// Adds a frame's time; the oldest one beyond the window is dropped.
    pub fn push(&mut self, seconds: f64) {
        if !seconds.is_finite() {
            return;
        }
        if self.times.len() == WINDOW {
            self.times.pop_front();
        }
        self.times.push_back(seconds);
    }

    /// The time in seconds that a share (0 to 1) of the frames does not exceed (nearest rank); `None` without frames.
    pub fn percentile(&self, share: f64) -> Option<f64> {
        let times: Vec<f64> = self.times.iter().copied().collect();
        percentile(&sorted(&times), share)
    }

    /// Number of frames that the percentiles know.
    pub fn frames(&self) -> usize {
        self.times.len()
    }
}

/// What the render world found out since the main world last looked.
#[derive(Default)]
struct News {
    times: Vec<f64>,
    forest: ForestStatistics,
    terrain: TerrainStatistics,
}

/// The samples, shared between the two worlds.
#[derive(Resource, Clone, Default)]
struct Mailbox(Arc<Mutex<News>>);

/// Keeps [`FrameTimes`] up to date.
pub struct TimingPlugin;

impl Plugin for TimingPlugin {
    fn build(&self, app: &mut App) {
        let mailbox = Mailbox::default();
        app.insert_resource(mailbox.clone()).init_resource::<FrameTimes>().add_systems(PreUpdate, receive);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.insert_resource(mailbox).add_systems(Render, await_device.in_set(RenderSystems::Cleanup));
        }
    }
}

fn receive(mailbox: Res<Mailbox>, mut frames: ResMut<FrameTimes>) {
    let mut sample = mailbox.0.lock().unwrap_or_else(PoisonError::into_inner);
    for seconds in sample.times.drain(..) {
        frames.push(seconds);
    }
    (frames.forest, frames.terrain) = (sample.forest.clone(), sample.terrain);
}

fn await_device(
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    adapter: Res<RenderAdapterInfo>,
    forest: Res<ForestStatistics>,
    terrain: Res<TerrainStatistics>,
    mailbox: Res<Mailbox>,
    mut marks: Local<VecDeque<SubmissionIndex>>,
    mut before: Local<Option<Instant>>,
) {
    marks.push_back(queue.submit(std::iter::empty()));
    let ahead = if adapter.device_type == DeviceType::Cpu { 0 } else { 1 };
    while marks.len() > ahead {
        // A device that was lost has its own message; its marks are reached at once.
        let _ = device.wgpu_device().poll(PollType::Wait { submission_index: marks.pop_front(), timeout: None });
    }
    let now = Instant::now();
    let mut sample = mailbox.0.lock().unwrap_or_else(PoisonError::into_inner);
    sample.times.extend(before.replace(now).map(|before| (now - before).as_secs_f64()));
    (sample.forest, sample.terrain) = (forest.clone(), *terrain);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_last_frames() {
        let mut frames = FrameTimes::default();
        assert_eq!(frames.percentile(0.5), None);
        frames.push(9.0);
        assert_eq!((frames.percentile(0.5), frames.percentile(0.95)), (Some(9.0), Some(9.0)));
        for number in 1..=WINDOW {
            frames.push(number as f64);
        }
        frames.push(f64::NAN);
        assert_eq!(frames.frames(), WINDOW);
        assert_eq!((frames.percentile(0.5), frames.percentile(0.95)), (Some(60.0), Some(114.0)));
        assert_eq!((frames.percentile(0.0), frames.percentile(1.0)), (Some(1.0), Some(120.0)));
    }
}
