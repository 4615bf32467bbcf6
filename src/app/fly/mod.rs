//! The interactive flight: a window onto a scene.
//!
//! It stands on the library's front door: a [`CanopyScene`](crate::components::CanopyScene) builds the scene while the
//! window is open, and the flight moves a [`CanopyCamera`](crate::render::components::CanopyCamera) and the scene's
//! [`Sun`](crate::components::Sun).
//!
//! `loading` leads from the request to the flight. `motion`, `tour`, `clock` and `session` are the flight itself and use
//! neither window nor renderer; `controls` maps keys to commands; `window` connects both; `overlay`, `picture` and
//! `explain` show and save what is seen; `settings` edits the lighting of the leaves and everything else that can be
//! reflected; `timing` measures.

mod clock;
mod controls;
mod display;
mod explain;
mod loading;
mod motion;
mod overlay;
mod picture;
mod session;
pub(super) mod settings;
mod timing;
mod tour;
mod window;

use std::sync::Arc;

use bevy::{
    app::{App, AppExit, PluginGroup, PostUpdate, PreUpdate, Startup, TerminalCtrlCHandlerPlugin, Update},
    asset::AssetEventSystems,
    ecs::{
        message::MessageWriter,
        schedule::{IntoScheduleConfigs, common_conditions::resource_exists},
    },
    log::{Level, LogPlugin},
    prelude::DefaultPlugins,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
    window::{PresentMode, Window, WindowPlugin},
};
use bevy_egui::{EguiPlugin, EguiPostUpdateSet, EguiPreUpdateSet, EguiPrimaryContextPass};

use super::{FlyOptions, adapter, error::AppError, interrupt};
use crate::{plugin::CanopyPlugins, progress::Progress};
use loading::{Ending, Request, Terminal};
use session::Session;
use tour::Tour;

/// Opens a window and flies until the user quits. Blocks; must be called on the program's main thread. `progress` hears
/// of the scene's build.
///
/// # Errors
/// [`AppError`] if the scene cannot be used, if there is no display or no graphics adapter, or if the device fails
/// during the flight; [`AppError::Interrupted`] after an interrupt, if the program listens to them
/// ([`listen_to_interrupts`](super::listen_to_interrupts)). What can be known of it is checked before the window opens.
pub fn fly(options: &FlyOptions, mut progress: impl Progress + 'static) -> Result<(), AppError> {
    display::check()?;
    let settings = adapter::settings(options.adapter.as_deref())?;
    adapter::check_size(&settings, options.size)?;
    let scene = Request::read(options)?;
    options.overrides.warnings(&scene).iter().for_each(|warning| progress.warn(warning));
    Tour::new(&scene, options.view)?;
    let ending = Ending::default();
    let request = Request { options: options.clone(), scene: Arc::new(scene), ending: ending.clone() };
    let mut app = display::open(|| build(request, Terminal::new(Box::new(progress)), settings))?;
    let exit = app.run();
    match (ending.take(), exit) {
        (Some(error), _) => Err(error),
        (None, AppExit::Success) => Ok(()),
        (None, AppExit::Error(_)) if interrupt::received().is_some() => {
            Err(AppError::Interrupted("the flight was ended".to_owned()))
        }
        (None, AppExit::Error(_)) => {
            Err(AppError::Render("the graphics device or the window reported an error (see above)".to_owned()))
        }
    }
}

fn build(request: Request, terminal: Terminal, settings: WgpuSettings) -> App {
    let mut app = App::new();
    // What a build reports goes to the terminal without the marks of a log.
    let filter = format!("{},canopy::components::scene=off", adapter::LOG_FILTER);
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: Some(Window {
                    title: loading::title(&request.scene),
                    resolution: request.options.size.into(),
                    present_mode: PresentMode::AutoVsync,
                    ..Window::default()
                }),
                ..WindowPlugin::default()
            })
            .set(RenderPlugin {
                render_creation: RenderCreation::Automatic(Box::new(settings)),
                ..RenderPlugin::default()
            })
            .set(LogPlugin { level: Level::WARN, filter, ..LogPlugin::default() })
            // The program has its own handler, which knows the request to terminate too.
            .disable::<TerminalCtrlCHandlerPlugin>(),
    );
    if request.options.explain {
        app.add_systems(Update, explain::explain.after(window::follow).run_if(resource_exists::<Session>));
    }
    let flight = (settings::update, window::fly, window::follow, picture::save_image);
    app.add_plugins((CanopyPlugins, EguiPlugin::default(), timing::TimingPlugin))
        .insert_resource(request)
        .insert_resource(terminal)
        .add_observer(loading::start)
        .add_observer(loading::fail)
        .add_systems(Startup, loading::open)
        .add_systems(
            Update,
            (
                end_when_interrupted,
                loading::report,
                window::capture_mouse,
                window::handle_keys,
                flight.chain().run_if(resource_exists::<Session>),
            )
                .chain(),
        )
        .add_systems(
            PreUpdate,
            window::keep_keys_from_overlay.after(EguiPreUpdateSet::ProcessInput).before(EguiPreUpdateSet::BeginPass),
        )
        .add_systems(EguiPrimaryContextPass, overlay::draw_overlays);
    // Glyphs that the overlay shows for the first time must be uploaded in the same frame.
    app.configure_sets(PostUpdate, AssetEventSystems.after(EguiPostUpdateSet::PostProcessOutput));
    app
}

/// Ends the app when an interrupt has arrived.
fn end_when_interrupted(mut exit: MessageWriter<AppExit>) {
    if let Some(interrupt) = interrupt::received() {
        exit.write(AppExit::from_code(interrupt.exit_code()));
    }
}
