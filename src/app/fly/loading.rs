//! From a request to a flight: the scene is built by [`CanopyScene`] in the background. Its progress goes to the
//! terminal, its end starts the flight or stops the program.

use std::sync::{Arc, Mutex, PoisonError};

use bevy::{
    app::AppExit,
    camera::Projection,
    ecs::{
        change_detection::DetectChanges,
        entity::Entity,
        message::MessageWriter,
        observer::On,
        query::With,
        resource::Resource,
        system::{Commands, Local, Res, ResMut, Single},
        world::{Mut, Ref},
    },
    platform::cell::SyncCell,
    render::view::Msaa,
    window::{PrimaryWindow, Window},
};

use super::{controls::Command, session::Session, settings::SettingsPanel};
use crate::{
    app::{AppError, FlyOptions, camera},
    assets::StageError,
    components::{CanopyScene, SceneFailed, SceneProgress, SceneReady, SceneState},
    progress::Progress,
    render::components::CanopyCamera,
    scene::Scene,
};

/// Why the flight ended; readable after the app has run.
#[derive(Clone, Default)]
pub struct Ending(Arc<Mutex<Option<AppError>>>);

impl Ending {
    /// The error, once.
    pub fn take(&self) -> Option<AppError> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn set(&self, error: AppError) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
    }
}

/// What the user asked for.
#[derive(Resource)]
pub struct Request {
    /// The options.
    pub options: FlyOptions,
    /// The scene as it was read before the window opened, with its overrides.
    pub scene: Arc<Scene>,
    /// Why the flight ended.
    pub ending: Ending,
}

impl Request {
    /// Reads the scene of `options`.
    ///
    /// # Errors
    /// [`AppError::Scene`].
    pub fn read(options: &FlyOptions) -> Result<Scene, AppError> {
        Ok(options.overrides.applied(options.scene.read()?))
    }
}

/// Progress on the terminal.
#[derive(Resource)]
pub struct Terminal(SyncCell<Box<dyn Progress>>);

impl Terminal {
    /// The terminal behind `progress`.
    pub fn new(progress: Box<dyn Progress>) -> Self {
        Self(SyncCell::new(progress))
    }
}

/// Spawns the scene, and the camera, without which the window has no overlay.
pub fn open(mut commands: Commands, request: Res<Request>) {
    commands.spawn(CanopyScene::new(request.scene.clone()));
    let scene = &request.scene;
    let field_of_view = scene.camera.field_of_view.to_radians();
    commands.spawn((CanopyCamera, Msaa::from_samples(scene.quality.msaa), camera::projection(field_of_view)));
}

/// Starts the flight when its scene is ready, or continues it in the changed scene.
pub fn start(
    ready: On<SceneReady>,
    mut commands: Commands,
    request: Res<Request>,
    session: Option<ResMut<Session>>,
    camera: Single<(Entity, &mut Msaa, &mut Projection), With<CanopyCamera>>,
    mut window: Option<Single<&mut Window, With<PrimaryWindow>>>,
    mut exit: MessageWriter<AppExit>,
) {
    let stage = ready.stage.clone();
    let (entity, mut msaa, mut projection) = camera.into_inner();
    commands.entity(entity).insert(stage.style.clone());
    *msaa = Msaa::from_samples(stage.scene.quality.msaa);
    *projection = camera::projection(stage.scene.camera.field_of_view.to_radians());
    if let Some(window) = &mut window {
        window.title = title(&stage.scene);
    }
    commands.insert_resource(SettingsPanel::new(&stage));
    match session {
        Some(mut session) => session.enter(stage),
        None => match Session::new(stage, &request.options) {
            Ok(session) => commands.insert_resource(session),
            Err(error) => {
                request.ending.set(error);
                exit.write(AppExit::error());
            }
        },
    }
}

/// Title of the window.
pub fn title(scene: &Scene) -> String {
    format!("{} - Canopy", scene.name)
}

/// Stops the program if its scene cannot be shown. In a flight it is a changed scene, so the old one stays.
pub fn fail(
    mut failed: On<SceneFailed>,
    request: Res<Request>,
    session: Option<ResMut<Session>>,
    mut terminal: ResMut<Terminal>,
    mut exit: MessageWriter<AppExit>,
) {
    match session {
        Some(mut session) => refuse(&failed.to_string(), &mut session, &mut terminal),
        None => {
            let error = std::mem::replace(&mut failed.event_mut().error, StageError::Cancelled);
            request.ending.set(error.into());
            exit.write(AppExit::error());
        }
    }
}

/// Chooses another year or variant of the inventory; whether there is another.
pub fn choose(request: &mut Request, session: &mut Session, command: Command) -> bool {
    let surveys = &session.stage.surveys;
    let overrides = &mut request.options.overrides;
    let message = match command {
        Command::Year(forward) => match surveys.next_year(forward) {
            Some(year) => {
                overrides.year = Some(year);
                Ok(format!("the year {year}"))
            }
            None => Err("the trees of this scene are not of several years".to_owned()),
        },
        Command::Variant(forward) => match surveys.next_variant(forward) {
            Some(variant) => {
                overrides.variant = Some(variant.to_owned());
                Ok(format!("the variant {variant}"))
            }
            None => Err("the trees of this scene have no variants".to_owned()),
        },
        _ => return false,
    };
    let is_other = message.is_ok();
    session.show_message(message.unwrap_or_else(|why| why));
    is_other
}

/// Reads the scene again; it replaces the current one when it is built. Camera and clock stay.
pub fn reload(request: &Request, session: &mut Session, terminal: &mut Terminal, scene: &mut Mut<CanopyScene>) {
    match Request::read(&request.options) {
        // A scene that cannot be read must not be touched: a change begins a build.
        Ok(read) => **scene = CanopyScene::new(read),
        Err(error) => refuse(&error.to_string(), session, terminal),
    }
}

fn refuse(error: &str, session: &mut Session, terminal: &mut Terminal) {
    terminal.0.get().warn(&format!("the scene was not loaded again: {error}"));
    session.show_message("the scene was not loaded again; the terminal says why".to_owned());
}

/// What the terminal has already heard of a build.
#[derive(Debug, Default)]
pub struct Heard {
    step: Option<(String, u64)>,
    done: u64,
    notes: usize,
    warnings: usize,
    over: bool,
}

impl Heard {
    /// Tells `terminal` what is new in `progress`.
    fn tell(&mut self, progress: &SceneProgress, terminal: &mut dyn Progress) {
        let over = progress.state != SceneState::Building;
        if self.over && !over {
            // Another build has begun.
            *self = Self::default();
        }
        for warning in progress.warnings.iter().skip(self.warnings) {
            terminal.warn(warning);
        }
        for note in progress.notes.iter().skip(self.notes) {
            terminal.note(note);
        }
        (self.notes, self.warnings) = (progress.notes.len(), progress.warnings.len());
        let step = (!progress.step.is_empty()).then(|| (progress.step.clone(), progress.total));
        if self.step != step {
            if let Some((name, total)) = &step {
                terminal.begin(name, *total);
            }
            (self.step, self.done) = (step, 0);
        }
        terminal.advance(progress.done.saturating_sub(self.done));
        self.done = self.done.max(progress.done);
        if over && !self.over {
            terminal.end();
        }
        self.over = over;
    }
}

/// Shows the progress of the build on the terminal.
pub fn report(scene: Single<Ref<SceneProgress>>, mut terminal: ResMut<Terminal>, mut heard: Local<Heard>) {
    if scene.is_changed() {
        heard.tell(&scene, &mut **terminal.0.get());
    }
}

#[cfg(test)]
mod tests {
    use bevy::{
        MinimalPlugins,
        app::{App, Startup, Update},
        prelude::TransformPlugin,
    };

    use super::*;
    use crate::{app::View, components::ScenePlugin, progress::Silent, scene::Overrides};

    /// A species whose file is missing.
    const MISSING: &str = "species: [(name: \"a\", plant: Gltf(files: [\"none.glb\"]))], trees: Scattered()";

    /// The flight without window and device, through the scene of a file, until it has begun or has ended.
    fn flight(file: &std::path::Path) -> Result<(App, Ending), AppError> {
        let options = FlyOptions {
            scene: file.into(),
            size: (64, 36),
            at: None,
            view: View::Scene,
            clock: 0.0,
            underground: false,
            overrides: Overrides::default(),
            adapter: None,
            quiet: true,
            explain: false,
        };
        let (scene, ending) = (Arc::new(Request::read(&options)?), Ending::default());
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, ScenePlugin))
            .insert_resource(Request { options, scene, ending: ending.clone() })
            .insert_resource(Terminal::new(Box::new(Silent)))
            .add_observer(start)
            .add_observer(fail)
            .add_systems(Startup, open)
            .add_systems(Update, report);
        while !app.world().contains_resource::<Session>() && app.should_exit().is_none() {
            app.update();
            std::thread::yield_now();
        }
        Ok((app, ending))
    }

    /// Presses the key R, and waits for the build that it begins, if it does.
    fn load_again(app: &mut App) -> String {
        press(app, Command::Reload)
    }

    /// The same with a key that chooses.
    fn press(app: &mut App, command: Command) -> String {
        let mut scenes = app.world_mut().query::<&mut CanopyScene>();
        app.world_mut().resource_scope(|world, mut session: Mut<Session>| {
            world.resource_scope(|world, mut terminal: Mut<Terminal>| {
                world.resource_scope(|world, mut request: Mut<Request>| {
                    let mut scene = scenes.single_mut(world).unwrap();
                    if command == Command::Reload || choose(&mut request, &mut session, command) {
                        reload(&request, &mut session, &mut terminal, &mut scene);
                    }
                });
            });
        });
        app.update();
        let mut progress = app.world_mut().query::<&SceneProgress>();
        while progress.single(app.world()).unwrap().state == SceneState::Building {
            app.update();
            std::thread::yield_now();
        }
        app.world().resource::<Session>().message().unwrap_or_default().to_owned()
    }

    #[test]
    fn a_flight_begins_with_its_scene_and_a_changed_one_replaces_it() -> Result<(), Box<dyn std::error::Error>> {
        let file = tempfile::Builder::new().suffix(".ron").tempfile()?;
        let write = |seed: &str, more: &str| {
            let ground = "terrain: Flat(size: 100), place: (latitude: 47, longitude: 9)";
            std::fs::write(file.path(), format!("(seed: {seed}, {ground}, {more})"))
        };
        write("1", "")?;
        let (mut app, ending) = flight(file.path())?;
        let seed = |app: &App| app.world().resource::<Session>().stage.scene.seed;
        assert!(seed(&app) == 1 && ending.take().is_none());
        write("2", "")?;
        assert!(load_again(&mut app).contains("was loaded again") && seed(&app) == 2);
        // One cannot be read, one cannot be built.
        for (wrong, more) in [("none", ""), ("3", MISSING)] {
            write(wrong, more)?;
            let message = load_again(&mut app);
            assert!(message.contains("not loaded again") && seed(&app) == 2, "{wrong}: {message}");
        }
        assert!(app.should_exit().is_none());
        Ok(())
    }

    #[test]
    fn keys_choose_years_and_variants_of_an_inventory() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("plot.ron");
        let rows = "1,1,2000,kept\n5,5,2000,kept\n1,1,2010,kept\n5,5,2010,kept\n9,9,2010,kept\n1,1,2010,felled\n";
        std::fs::write(folder.path().join("plot.csv"), format!("x,y,survey_year,variant\n{rows}"))?;
        let text = "(terrain: Flat(size: 100), place: (latitude: 47, longitude: 9), species: [(name: \"oak\", plant: Grown(form: Broadleaf, \
                    individuals: 1, triangles: 5000), lighting: Local)], trees: Inventory(path: \"plot.csv\", anchor: SouthWest))";
        std::fs::write(&file, text)?;
        let (mut app, _) = flight(&file)?;
        let trees = |app: &App| app.world().resource::<Session>().stage.stand.trees.len();
        assert_eq!(trees(&app), 3, "the last year, the first variant");
        press(&mut app, Command::Year(true));
        assert_eq!(trees(&app), 2, "after the last year comes the first");
        press(&mut app, Command::Year(false));
        press(&mut app, Command::Variant(true));
        assert_eq!(trees(&app), 1);
        press(&mut app, Command::Variant(true));
        assert_eq!(trees(&app), 3);
        Ok(())
    }

    #[test]
    fn a_scene_that_cannot_be_built_ends_the_program_with_its_error() -> Result<(), Box<dyn std::error::Error>> {
        let file = tempfile::Builder::new().suffix(".ron").tempfile()?;
        let text = format!("(terrain: Flat(size: 100), place: (latitude: 47, longitude: 9), {MISSING})");
        std::fs::write(file.path(), text)?;
        let (app, ending) = flight(file.path())?;
        assert!(app.should_exit().is_some_and(|exit| exit.is_error()));
        let message = ending.take().ok_or("no error")?.to_string();
        assert!(message.contains("none.glb") && message.contains("check the path"), "{message}");
        Ok(())
    }

    #[derive(Default)]
    struct Lines(Vec<String>);

    impl Progress for Lines {
        fn begin(&mut self, what: &str, steps: u64) {
            self.0.push(format!("{what} of {steps}"));
        }

        fn advance(&mut self, steps: u64) {
            if steps > 0 {
                self.0.push(format!("+{steps}"));
            }
        }

        fn end(&mut self) {
            self.0.push("end".to_owned());
        }

        fn warn(&mut self, message: &str) {
            self.0.push(format!("warning: {message}"));
        }

        fn note(&mut self, message: &str) {
            self.0.push(message.to_owned());
        }
    }

    #[test]
    fn the_terminal_hears_everything_once_and_a_second_build_from_its_start() {
        let (mut heard, mut lines) = (Heard::default(), Lines::default());
        let mut progress = SceneProgress::default();
        heard.tell(&progress, &mut lines);
        (progress.step, progress.total, progress.done) = ("Plants".to_owned(), 4, 1);
        heard.tell(&progress, &mut lines);
        progress.done = 3;
        progress.warnings.push("w".to_owned());
        progress.notes.push("n".to_owned());
        heard.tell(&progress, &mut lines);
        heard.tell(&progress, &mut lines);
        progress.state = SceneState::Ready;
        heard.tell(&progress, &mut lines);
        assert_eq!(lines.0, ["Plants of 4", "+1", "warning: w", "n", "+2", "end"]);
        lines.0.clear();
        heard.tell(&progress, &mut lines);
        progress =
            SceneProgress { step: "Trees".to_owned(), warnings: vec!["v".to_owned()], ..SceneProgress::default() };
        heard.tell(&progress, &mut lines);
        assert_eq!(lines.0, ["warning: v", "Trees of 0"]);
    }
}
