//! The interactive flight: a window onto a scene.
//!
//! `motion`, `tour`, `clock` and `session` are the flight itself and use neither window nor renderer; `controls` maps
//! keys to commands; `window` connects both; `overlay`, `picture` and `explain` show and save what is seen; `light`
//! adjusts the lighting of the leaves during the flight; `timing` measures.

mod clock;
mod controls;
mod display;
mod explain;
mod light;
mod motion;
mod overlay;
mod picture;
mod session;
mod timing;
mod tour;
mod window;

use bevy::{
    app::{App, AppExit, PluginGroup, PostStartup, PostUpdate, Startup, Update},
    asset::AssetEventSystems,
    ecs::schedule::IntoScheduleConfigs,
    log::{Level, LogPlugin},
    prelude::DefaultPlugins,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
    window::{PresentMode, Window, WindowPlugin},
};
use bevy_egui::{EguiPlugin, EguiPostUpdateSet, EguiPrimaryContextPass};

use super::{FlyOptions, adapter, error::AppError};
use crate::{assets::Stage, plugin::CanopyPlugins, progress::Progress};
use session::Session;

/// Opens a window and flies until the user quits. Blocks; must be called on the program's main thread.
///
/// # Errors
/// [`AppError`] if the scene cannot be used, if there is no display or no graphics adapter, or if the device fails
/// during the flight.
pub fn fly(options: &FlyOptions, progress: &mut dyn Progress) -> Result<(), AppError> {
    display::check()?;
    let settings = adapter::settings(options.adapter.as_deref())?;
    let most_trees = adapter::check_size(&settings, options.size)?;
    let scene = options.overrides.applied(options.scene.read()?);
    // A start off the path is found before the long work.
    tour::Tour::new(&scene, options.view)?;
    let stage = Stage::build_within(&scene, most_trees, progress)?;
    let session = Session::new(stage, options)?;
    let mut app = display::open(|| build(session, options, settings))?;
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(_) => {
            Err(AppError::Render("the graphics device or the window reported an error (see above)".to_owned()))
        }
    }
}

fn build(session: Session, options: &FlyOptions, settings: WgpuSettings) -> App {
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: Some(Window {
                    title: format!("{} - Canopy", session.stage.scene.name),
                    resolution: options.size.into(),
                    present_mode: PresentMode::AutoVsync,
                    ..Window::default()
                }),
                ..WindowPlugin::default()
            })
            .set(RenderPlugin {
                render_creation: RenderCreation::Automatic(Box::new(settings)),
                ..RenderPlugin::default()
            })
            .set(LogPlugin { level: Level::WARN, filter: adapter::LOG_FILTER.to_owned(), ..LogPlugin::default() }),
    );
    app.add_plugins((CanopyPlugins, EguiPlugin::default(), timing::TimingPlugin))
        .insert_resource(light::LightPanel::new(&session.stage))
        .insert_resource(session)
        .add_systems(Startup, window::set_up)
        .add_systems(PostStartup, window::follow)
        .add_systems(
            Update,
            (
                window::capture_mouse,
                window::handle_keys,
                light::apply_bakes,
                window::fly,
                window::follow,
                picture::save_image,
            )
                .chain(),
        )
        .add_systems(EguiPrimaryContextPass, overlay::draw_overlays);
    // Glyphs that the overlay shows for the first time must be uploaded in the same frame.
    app.configure_sets(PostUpdate, AssetEventSystems.after(EguiPostUpdateSet::PostProcessOutput));
    if options.explain {
        app.add_systems(Update, explain::explain.after(window::follow));
    }
    app
}
