//! The light inside a stand, as a texture of bind group 0: the transmittance of neighbouring crowns for sky and sun,
//! and what they scatter ([`crate::light::stand`]). Cost: half a millisecond for a new light, in the frame or beside it
//! ([`LightUpdates`]); nothing while light, exposure and trees stay the same.

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
        renderer::{RenderDevice, RenderQueue},
    },
};
use glam::{Vec3, Vec4};
use half::f16;

use crate::{
    light::{
        StandLight, StandTrees,
        stand::{COVERS, DEPTHS},
    },
    math::color::luminance,
    render::{
        bindings::{SharedPlacement, SharedTextures},
        components::{Daylight, LightUpdates},
        extract::ExtractedScene,
        follow::{Followed, Follower},
        forest::GpuForests,
        light_table::LightTable,
        report::FrameReport,
        sets::CanopyRenderSystems,
        view::PreparedFrame,
    },
};

/// Blocks of the texture, one below the other: transmittances at leaves, downwelling radiance, upwelling radiance, transmittances at trunks. The
/// fourth channel has the key light's transmittance, or the fraction of the radiance's luminance that is left where relief hides the key light.
const BLOCKS: usize = 4;
/// The largest value that is written.
const BRIGHTEST: f32 = 6.0e4;

/// The table of [`StandLight`] on the GPU, exposed.
#[derive(Resource)]
struct StandTexture {
    /// Of the light and trees below, with an exposure.
    table: LightTable<(StandKey, f32)>,
    light: Follower<StandKey, StandLight>,
}

/// What the light in a stand depends on.
#[derive(Clone, Debug, PartialEq)]
struct StandKey {
    daylight: Daylight,
    trees: StandTrees,
}

impl StandKey {
    /// Relative difference of illuminance up to which light is near.
    const NEAR: f32 = 0.05;

    /// Whether the light that was computed for `old` may be drawn meanwhile.
    fn is_near(&self, old: &Self) -> bool {
        let sum = |key: &Self| key.daylight.0.horizontal_illuminance().element_sum();
        let (old_sum, sum) = (sum(old), sum(self));
        self.trees == old.trees
            && LightUpdates::is_near(old.daylight.0.key_direction, self.daylight.0.key_direction)
            && (old_sum - sum).abs() <= Self::NEAR * sum
    }
}

impl FromWorld for StandTexture {
    fn from_world(world: &mut World) -> Self {
        let size = (COVERS as u32, (BLOCKS * (DEPTHS + 1)) as u32);
        let table = LightTable::new(world.resource::<RenderDevice>(), "canopy_stand_light", size);
        Self { table, light: Follower::default() }
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
    mut placement: ResMut<SharedPlacement>,
) {
    let StandTexture { table, light } = &mut *stand;
    shared.stand_light = table.view().clone();
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let leaves = forests.leaves();
    let trees = leaves.trees();
    placement.crown_albedo = trees.crown_albedo();
    placement.crown_layers = leaves.layers_up_to();
    let wanted = StandKey { daylight: daylight.clone(), trees };
    let key = wanted.clone();
    let compute = move || StandLight::new(&key.daylight.0, &key.trees);
    let followed = light.follow(&wanted, scene.light_updates, |old| wanted.is_near(old), compute);
    let (Some(key), Some(light)) = (light.key(), light.value()) else { return };
    let uploaded = table.update(&queue, (key.clone(), view.exposure), || texels(light, view.exposure));
    match followed {
        Followed::Waited => report.ran("stand light", "computed for a new light"),
        Followed::Taken => report.ran("stand light", "computed in the background"),
        Followed::Same if uploaded => report.ran("stand light", "uploaded for another exposure"),
        Followed::Lags => report.skipped("stand light", "it is being computed in the background"),
        Followed::Same => report.skipped("stand light", "the light has not changed"),
    }
}

/// Half floats, block by block.
fn texels(stand: &StandLight, exposure: f32) -> Vec<[f16; 4]> {
    let samples = stand.samples();
    let lit = |all: Vec3, shaded: Vec3| {
        let fraction = luminance(shaded) / luminance(all);
        (all * exposure).extend(if fraction.is_finite() { fraction.min(1.0) } else { 1.0 })
    };
    let mut texels: Vec<Vec4> = Vec::with_capacity(BLOCKS * samples.len());
    texels.extend(samples.iter().map(|at| at.sky_transmittance.extend(at.sun_transmittance)));
    texels.extend(samples.iter().map(|at| lit(at.downwelling, at.shaded_downwelling)));
    texels.extend(samples.iter().map(|at| lit(at.upwelling, at.shaded_upwelling)));
    texels.extend(samples.iter().map(|at| at.trunk_sky_transmittance.extend(at.sun_transmittance)));
    let half = |value: f32| f16::from_f32(value.min(BRIGHTEST));
    texels.iter().map(|texel| texel.to_array().map(half)).collect()
}
