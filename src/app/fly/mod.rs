//! The interactive flight: a window onto a scene.
//!
//! `motion`, `tour`, `clock` and `session` are the flight itself and know neither window nor renderer; `controls`
//! says which key does what; `window` brings both together; `overlay`, `picture` and `explain` show and keep what is
//! seen; `light` turns the light of the leaves while looking; `timing` measures.

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

/// Opens a window and flies until the user has enough. Blocks; must be called on the program's main thread.
///
/// # Errors
/// [`AppError`] for anything in the scene that cannot be used, where there is no display or no graphics adapter, and
/// where the device fails during the flight.
pub fn fly(options: &FlyOptions, progress: &mut dyn Progress) -> Result<(), AppError> {
    display::check()?;
    let settings = adapter::settings(options.adapter.as_deref())?;
    adapter::check_size(&settings, options.size)?;
    let scene = options.overrides.applied(options.scene.read()?);
    let stage = Stage::build(&scene, progress)?;
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
                window::catch_mouse,
                window::obey,
                light::follow_light,
                window::fly,
                window::follow,
                picture::take_picture,
            )
                .chain(),
        )
        .add_systems(EguiPrimaryContextPass, overlay::draw_overlays);
    // Letters that the overlay shows for the first time must reach the device with the frame that shows them.
    app.configure_sets(PostUpdate, AssetEventSystems.after(EguiPostUpdateSet::PostProcessOutput));
    if options.explain {
        app.add_systems(Update, explain::explain.after(window::follow));
    }
    app
}
