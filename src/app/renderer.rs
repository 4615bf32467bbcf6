//! The renderer without a window, driven frame by frame.

use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use bevy::{
    app::App,
    camera::Camera,
    ecs::{
        change_detection::{DetectChanges, Tick},
        entity::Entity,
        world::World,
    },
    render::{
        RenderApp,
        render_resource::{CachedPipelineState, PipelineCache, PollType},
        renderer::RenderDevice,
        settings::WgpuSettings,
        view::Msaa,
    },
    shader::ShaderCacheError,
};
use chrono::{DateTime, Utc};

use super::{
    adapter, camera,
    error::AppError,
    rendered_image::RenderedImage,
    windowless::{Target, app_without_window},
};
use crate::{
    assets::Stage,
    components::{Shown, Sun, SunRefresh},
    plugin::CanopyPlugins,
    render::{
        components::{CanopyCamera, CanopyStyle, ForestUpdates, LightUpdates, SunShadowSettings},
        forest::collect_view_counts,
        report::{FrameReport, PassOutcome},
        shaders::CanopyShaders,
        sun_shadow::collect_caster_counts,
    },
    scene::Viewpoint,
};

/// Time limit for shaders and pipelines; far more than they need on the slowest machine.
const LONGEST_WAIT: Duration = Duration::from_secs(120);

/// How often a frame is drawn again because lists of trees were too short: once is enough, since all that they lack is
/// counted.
const MOST_REDRAWS: usize = 3;

/// When a frame began and ended.
#[derive(Clone, Copy, Debug)]
pub struct UpdateTime {
    /// Its begin.
    pub began: Instant,
    /// When the CPU had submitted all of it.
    pub submitted: Instant,
    /// When the device had finished it.
    pub finished: Instant,
    /// How often it was drawn: more than once where a pass waited for its pipeline, and then its times say nothing.
    pub updates: u32,
}

/// A renderer without a window, driven frame by frame.
pub struct Renderer {
    app: App,
    camera: Entity,
    sun: Entity,
    target: Target,
    warm: bool,
    /// What the stage that is shown has in the world.
    shown: Option<Shown>,
    /// When the device was made whose errors are heard. Devices do not tell: one of another instance of wgpu may have the number
    /// of the lost one and be equal to it.
    device_since: Tick,
    /// First error that the device reported and that was not returned yet.
    fault: Arc<Mutex<Option<String>>>,
}

impl Renderer {
    /// A renderer for images of `size` pixels on the adapter whose name contains `adapter`, with `msaa` samples.
    ///
    /// # Errors
    /// [`AppError::NoAdapter`], [`AppError::UnknownAdapter`], [`AppError::AdapterConflict`], [`AppError::TooLarge`].
    pub fn new(size: (u32, u32), adapter: Option<&str>, msaa: u32) -> Result<Self, AppError> {
        Self::with_settings(adapter::settings(adapter)?, size, msaa, |_| ())
    }

    /// A renderer of [`adapter::settings`] to whose app `prepare` adds plugins.
    pub(super) fn with_settings(
        settings: WgpuSettings,
        size: (u32, u32),
        msaa: u32,
        prepare: impl FnOnce(&mut App),
    ) -> Result<Self, AppError> {
        let mut app = app_without_window(settings, |app| {
            app.add_plugins(CanopyPlugins)
                .insert_resource(LightUpdates::Blocking)
                .insert_resource(ForestUpdates::Blocking);
            prepare(app);
        });
        let device = app.world().resource_ref::<RenderDevice>();
        let (fault, device_since) = (report_faults(&device), device.last_changed());
        let limit = device.limits().max_texture_dimension_2d;
        if size.0 > limit || size.1 > limit || size.0 == 0 || size.1 == 0 {
            return Err(AppError::TooLarge { width: size.0, height: size.1, limit });
        }
        let target = Target::new(&mut app, size);
        let camera = app
            .world_mut()
            .spawn((
                Camera { is_active: false, ..Camera::default() },
                target.camera_target(),
                CanopyCamera,
                Msaa::from_samples(msaa),
            ))
            .id();
        let sun = app.world_mut().spawn(SunShadowSettings::default()).id();
        Ok(Self { app, camera, sun, target, warm: false, shown: None, device_since, fault })
    }

    /// Listens to another device, if the app has made one for a lost one
    /// ([`RenderErrorHandler`](bevy::render::error_handler::RenderErrorHandler)). The errors of the lost one are over.
    fn follow_device(&mut self) {
        let device = self.app.world().resource_ref::<RenderDevice>();
        if device.last_changed() != self.device_since {
            self.device_since = device.last_changed();
            self.fault = report_faults(&device);
        }
    }

    /// Fails with the first error that the device reported since the last time.
    fn check_fault(&self) -> Result<(), AppError> {
        match self.fault.lock().ok().and_then(|mut fault| fault.take()) {
            Some(what) => Err(AppError::Render(what)),
            None => Ok(()),
        }
    }

    /// The Bevy app, to spawn further entities.
    pub fn app(&mut self) -> &mut App {
        &mut self.app
    }

    /// The Bevy app.
    pub(super) fn world(&self) -> &World {
        self.app.world()
    }

    /// The render world.
    pub(super) fn render_world(&self) -> &World {
        self.app.sub_app(RenderApp).world()
    }

    /// Shows `stage`: its ground, its forest, its quality.
    pub fn show(&mut self, stage: &Stage) {
        let world = self.app.world_mut();
        self.shown = Some(stage.show(&mut world.commands()));
        world.flush();
        self.set_shadow(stage.shadow());
        self.set_style(stage.style.clone());
    }

    /// Sets the style of the images.
    pub fn set_style(&mut self, style: CanopyStyle) {
        self.app.world_mut().entity_mut(self.camera).insert(style);
    }

    /// Shows `stage` with its samples per pixel instead of the one that was shown last.
    pub fn replace(&mut self, stage: &Stage) {
        let world = self.app.world_mut();
        if let Some(before) = self.shown.take() {
            before.despawn(&mut world.commands());
        }
        world.flush();
        world.entity_mut(self.camera).insert(Msaa::from_samples(stage.scene.quality.msaa));
        self.show(stage);
    }

    /// Sets how shadows are drawn.
    pub fn set_shadow(&mut self, shadow: SunShadowSettings) {
        self.app.world_mut().entity_mut(self.sun).insert(shadow);
    }

    /// Sets the light to the scene's location and instant.
    pub fn set_instant(&mut self, stage: &Stage, instant: DateTime<Utc>) {
        self.set_sun(stage.sun(instant));
    }

    /// Sets the light of the next frame.
    pub fn set_sun(&mut self, sun: Sun) {
        let mut entity = self.app.world_mut().entity_mut(self.sun);
        if entity.get() != Some(&sun) {
            entity.insert((sun, SunRefresh::Immediate));
        }
    }

    /// Sets the camera.
    pub fn set_view(&mut self, view: &Viewpoint) {
        let (origin, transform) = camera::origin_and_transform(view);
        let projection = camera::projection(view.field_of_view);
        let world = self.app.world_mut();
        world.insert_resource(origin);
        world.entity_mut(self.camera).insert((transform, projection));
    }

    /// Draws one frame and waits until the device has finished it.
    ///
    /// # Errors
    /// [`AppError::Render`] with the device's error in this frame.
    pub fn update(&mut self) -> Result<(), AppError> {
        self.update_timed().map(drop)
    }

    /// As [`update`](Self::update), with its times.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn update_timed(&mut self) -> Result<UpdateTime, AppError> {
        if !self.warm {
            self.warm_up()?;
            self.warm = true;
        }
        let mut time = self.draw_once()?;
        // Lists of trees that were too short have grown, and the frame is drawn again.
        for _ in 0..MOST_REDRAWS {
            if !self.lists_were_short() {
                break;
            }
            let again = self.draw_once()?;
            time = UpdateTime { updates: time.updates + again.updates, ..again };
        }
        match self.app.should_exit() {
            Some(exit) if exit.is_error() => {
                Err(AppError::Render("the graphics device reported an error (see above)".to_owned()))
            }
            _ => Ok(time),
        }
    }

    /// Draws one frame with the lists of trees as long as they are.
    fn draw_once(&mut self) -> Result<UpdateTime, AppError> {
        let began = Instant::now();
        self.app.update();
        let mut time = UpdateTime { began, submitted: Instant::now(), finished: began, updates: 1 };
        self.follow_device();
        // A frame in which a pass waited for its pipeline is drawn again.
        let started = Instant::now();
        while !self.pipelines_are_ready()? {
            patience(started, "the pipelines")?;
            self.app.update();
            time.updates += 1;
        }
        let device = self.app.world().resource::<RenderDevice>();
        let waited = device.wgpu_device().poll(PollType::Wait { submission_index: None, timeout: None });
        // What the device reported says more than that it could not be waited for.
        self.check_fault()?;
        waited.map_err(|error| AppError::Render(error.to_string()))?;
        time.finished = Instant::now();
        Ok(time)
    }

    /// Takes the counts of the lists that the device made; whether trees are missing in the last frame.
    fn lists_were_short(&mut self) -> bool {
        let world = self.app.sub_app_mut(RenderApp).world_mut();
        let view = world.run_system_cached(collect_view_counts).unwrap_or(false);
        let casters = world.run_system_cached(collect_caster_counts).unwrap_or(false);
        view || casters
    }

    /// The first updates upload meshes, textures and shaders, and draw nothing yet.
    fn warm_up(&mut self) -> Result<(), AppError> {
        let started = Instant::now();
        loop {
            self.app.update();
            let world = self.app.world();
            let (Some(shaders), Some(server)) = (world.get_resource::<CanopyShaders>(), world.get_resource()) else {
                return Err(AppError::Render("there is no renderer (see above)".to_owned()));
            };
            if shaders.loaded(server).map_err(AppError::Render)? {
                break;
            }
            patience(started, "the shaders")?;
            std::thread::yield_now();
        }
        if let Some(mut camera) = self.app.world_mut().get_mut::<Camera>(self.camera) {
            camera.is_active = true;
        }
        Ok(())
    }

    /// Whether all pipelines that the last frame requested were ready.
    fn pipelines_are_ready(&self) -> Result<bool, AppError> {
        let cache = self.app.sub_app(RenderApp).world().resource::<PipelineCache>();
        let mut ready = true;
        for pipeline in cache.pipelines() {
            match &pipeline.state {
                CachedPipelineState::Ok(_) => {}
                CachedPipelineState::Queued | CachedPipelineState::Creating(_) => ready = false,
                CachedPipelineState::Err(
                    ShaderCacheError::ShaderNotLoaded(_) | ShaderCacheError::ShaderImportNotYetAvailable,
                ) => ready = false,
                CachedPipelineState::Err(error) => {
                    return Err(AppError::Render(format!("a shader is broken: {error}")));
                }
            }
        }
        Ok(ready)
    }

    /// Draws `stage` from `view` at `instant`.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn draw(&mut self, stage: &Stage, view: &Viewpoint, instant: DateTime<Utc>) -> Result<RenderedImage, AppError> {
        self.set_instant(stage, instant);
        self.set_view(view);
        self.update()?;
        self.read()
    }

    /// Which passes the last frame ran or skipped, one line per pass.
    pub fn explain(&self) -> Vec<String> {
        let report = self.app.world().resource::<FrameReport>();
        let line = |(pass, outcome)| match outcome {
            PassOutcome::Ran(on) => format!("  {pass}: ran ({on})"),
            PassOutcome::Skipped(why) => format!("  {pass}: skipped ({why})"),
        };
        report.outcomes().into_iter().map(line).collect()
    }

    /// Reads the last frame back.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn read(&self) -> Result<RenderedImage, AppError> {
        let read = self.target.read(&self.app);
        // What the device reported says more than that nothing came back.
        self.check_fault()?;
        read.map_err(AppError::Render)
    }
}

/// Fails if a wait that began at `started` takes too long.
fn patience(started: Instant, what: &str) -> Result<(), AppError> {
    if started.elapsed() < LONGEST_WAIT {
        return Ok(());
    }
    Err(AppError::Render(format!("{what} were not ready within {} s", LONGEST_WAIT.as_secs())))
}

/// Installs a handler that stores the first error of the device.
///
/// Bevy's own handler, which this replaces, reports an error only with the next frame; the frame that caused it would
/// be saved as a broken image.
fn report_faults(device: &RenderDevice) -> Arc<Mutex<Option<String>>> {
    let fault = Arc::new(Mutex::new(None));
    let stored = fault.clone();
    device.wgpu_device().on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        if let Ok(mut slot) = stored.lock() {
            slot.get_or_insert(error.to_string());
        }
    }));
    fault
}
