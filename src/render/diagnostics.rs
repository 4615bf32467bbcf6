//! Counts of the last frame as Bevy diagnostics, beside the GPU times that Bevy itself records of every pass.
//!
//! | path | what |
//! |---|---|
//! | `canopy/forest/NAME/trees` | trees drawn in the representation NAME (`model`, `cross`, a program's own) |
//! | `canopy/forest/NAME/triangles` | triangles of these |
//! | `canopy/terrain/tiles` | tiles of the ground |
//! | `canopy/terrain/triangles` | triangles of these |
//! | `render/canopy_PASS/elapsed_gpu` | milliseconds of a pass on the device, where it has timestamps: `forest`, `terrain`, `sky`, `sun_shadow`, `mesh_shadow` |

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use bevy::{
    app::{App, First, Plugin},
    diagnostic::{Diagnostic, DiagnosticMeasurement, DiagnosticPath, DiagnosticsPlugin, DiagnosticsStore},
    ecs::{
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Res, ResMut},
    },
    log::warn,
    render::{Render, RenderApp, RenderSystems, diagnostic::RenderDiagnosticsPlugin},
};

use super::{forest::ForestStatistics, terrain::TerrainStatistics};

/// Adds the paths above to Bevy's [`DiagnosticsStore`], after [`CanopyPlugins`](crate::CanopyPlugins). Without it, nothing of
/// this is recorded.
#[derive(Clone, Copy, Debug, Default)]
pub struct CanopyDiagnosticsPlugin;

/// Counts on their way from the render world to the main world; the newest ones replace those that nobody took.
#[derive(Resource, Clone, Default)]
struct Counts(Arc<Mutex<Option<(ForestStatistics, TerrainStatistics)>>>);

impl Plugin for CanopyDiagnosticsPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<DiagnosticsPlugin>() {
            app.add_plugins(DiagnosticsPlugin);
        }
        if app.get_sub_app(RenderApp).is_none() {
            warn!("CanopyDiagnosticsPlugin was added before a renderer: there are counts, but no GPU times of passes");
        } else if !app.is_plugin_added::<RenderDiagnosticsPlugin>() {
            app.add_plugins(RenderDiagnosticsPlugin);
        }
        app.init_resource::<Counts>().add_systems(First, record);
    }

    // Here the render world is there, in whatever order the plugins were added.
    fn finish(&self, app: &mut App) {
        let counts = app.world().resource::<Counts>().clone();
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.insert_resource(counts).add_systems(Render, send.in_set(RenderSystems::Cleanup));
        }
    }
}

fn send(counts: Res<Counts>, forest: Option<Res<ForestStatistics>>, terrain: Option<Res<TerrainStatistics>>) {
    if let (Some(forest), Some(terrain)) = (forest, terrain) {
        *counts.0.lock().unwrap_or_else(PoisonError::into_inner) = Some((forest.clone(), *terrain));
    }
}

fn record(counts: Res<Counts>, mut store: ResMut<DiagnosticsStore>) {
    let counts = counts.0.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some((forest, terrain)) = counts {
        record_counts(&mut store, &forest, &terrain);
    }
}

/// Adds the counts of one frame to `store`, and the paths that are not there yet.
pub fn record_counts(store: &mut DiagnosticsStore, forest: &ForestStatistics, terrain: &TerrainStatistics) {
    let time = Instant::now();
    let mut measure = |path: String, value: usize| {
        let path = DiagnosticPath::new(path);
        if store.get(&path).is_none() {
            store.add(Diagnostic::new(path.clone()));
        }
        if let Some(diagnostic) = store.get_mut(&path) {
            diagnostic.add_measurement(DiagnosticMeasurement { time, value: value as f64 });
        }
    };
    for level in &forest.levels {
        let name = level.representation.name();
        measure(format!("canopy/forest/{name}/trees"), level.trees);
        measure(format!("canopy/forest/{name}/triangles"), level.triangles);
    }
    measure("canopy/terrain/tiles".to_owned(), terrain.tiles);
    measure("canopy/terrain/triangles".to_owned(), terrain.triangles);
}
