//! The light inside a stand, as a texture of bind group 0: the transmittance of neighbouring crowns for sky and sun,
//! and what they scatter ([`crate::light::stand`]). Cost: nothing while light, exposure and trees stay the same.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin},
    ecs::{
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::{
        GpuResourceAppExt, Render, RenderApp,
        render_resource::{Texture, TextureView},
        renderer::{RenderDevice, RenderQueue},
    },
};
use glam::{Vec3, Vec4};
use half::f16;

use crate::{
    light::{
        LightState, StandLight, StandTrees,
        stand::{COVERS, DEPTHS},
    },
    render::{
        bindings::SharedTextures, extract::ExtractedScene, forest::GpuForests, gpu, report::FrameReport,
        sets::CanopyRenderSystems, view::PreparedFrame,
    },
};

/// Blocks of the texture, one below the other: transmittances, downwelling and upwelling radiance.
const BLOCKS: usize = 3;
/// The largest value that is written.
const BRIGHTEST: f32 = 6.0e4;

/// The table of [`StandLight`] on the GPU, exposed.
#[derive(Resource)]
struct StandTexture {
    texture: Texture,
    view: TextureView,
    /// The light, exposure and trees for which the texture was uploaded.
    uploaded: Option<(Arc<LightState>, f32, StandTrees)>,
}

impl FromWorld for StandTexture {
    fn from_world(world: &mut World) -> Self {
        let size = (COVERS as u32, (BLOCKS * (DEPTHS + 1)) as u32);
        let (texture, view) = gpu::table(world.resource::<RenderDevice>(), "canopy_stand_light", size);
        Self { texture, view, uploaded: None }
    }
}

/// Computes the light inside stands.
pub struct StandLightPlugin;

impl Plugin for StandLightPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<StandTexture>()
            .add_systems(Render, upload_stand_light.in_set(CanopyRenderSystems::Light));
    }
}

/// Computes and uploads the table if light, exposure or the trees have changed.
fn upload_stand_light(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut stand: ResMut<StandTexture>,
    mut shared: ResMut<SharedTextures>,
) {
    shared.stand_light = stand.view.clone();
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let trees = forests.trees();
    let same = |(light, exposure, uploaded_trees): &(Arc<LightState>, f32, StandTrees)| {
        Arc::ptr_eq(light, &daylight.0) && *exposure == view.exposure && *uploaded_trees == trees
    };
    if stand.uploaded.as_ref().is_some_and(same) {
        report.skipped("stand light", "the light has not changed");
        return;
    }
    let texels = texels(&daylight.0, &StandLight::new(&daylight.0, &trees), view.exposure);
    let height = (BLOCKS * (DEPTHS + 1)) as u32;
    gpu::write_level(&queue, &stand.texture, 0, 0, COVERS as u32, height, 8, bytemuck::cast_slice(&texels));
    stand.uploaded = Some((daylight.0.clone(), view.exposure, trees));
    report.ran("stand light", "computed for a new light");
}

/// Half floats, block by block.
fn texels(light: &LightState, stand: &StandLight, exposure: f32) -> Vec<[f16; 4]> {
    let samples = stand.samples();
    let lit = |radiance: Vec3| (radiance * exposure).extend(0.0);
    let mut texels: Vec<Vec4> =
        samples.iter().map(|sample| sample.sky_transmittance.extend(sample.sun_transmittance)).collect();
    texels.extend(samples.iter().map(|sample| lit(sample.downwelling)));
    texels
        .extend(samples.iter().map(|sample| lit(sample.upwelling - sample.sky_transmittance * light.ground_radiance)));
    let half = |value: f32| f16::from_f32(value.clamp(-BRIGHTEST, BRIGHTEST));
    texels.iter().map(|texel| texel.to_array().map(half)).collect()
}
