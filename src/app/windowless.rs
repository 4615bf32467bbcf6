//! A Bevy app without a window, and the image that it draws into: what this renderer and its peer have in common.

use bevy::{
    app::{App, PluginGroup, PluginsState, TerminalCtrlCHandlerPlugin},
    asset::{Assets, Handle, RenderAssetUsages},
    camera::RenderTarget,
    image::Image,
    log::{Level, LogPlugin},
    prelude::DefaultPlugins,
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_asset::RenderAssets,
        render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
        renderer::{RenderDevice, RenderQueue},
        settings::{RenderCreation, WgpuSettings},
        texture::GpuImage,
    },
    window::{ExitCondition, WindowPlugin},
    winit::WinitPlugin,
};

use super::{adapter, rendered_image::RenderedImage};
use crate::render::readback::read_rgb;

/// A Bevy app that draws without a window, on the adapter of `settings`, with the plugins that `prepare` adds.
pub fn app_without_window(settings: WgpuSettings, prepare: impl FnOnce(&mut App)) -> App {
    let mut app = App::new();
    let mut plugins = DefaultPlugins
        .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..WindowPlugin::default() })
        .set(RenderPlugin {
            render_creation: RenderCreation::Automatic(Box::new(settings)),
            synchronous_pipeline_compilation: true,
            ..RenderPlugin::default()
        })
        .set(LogPlugin { level: Level::WARN, filter: adapter::LOG_FILTER.to_owned(), ..LogPlugin::default() })
        .disable::<WinitPlugin>()
        // The program has its own handler; others keep theirs.
        .disable::<TerminalCtrlCHandlerPlugin>()
        .disable::<PipelinedRenderingPlugin>();
    // A second renderer of the process writes into the first one's log.
    if tracing::dispatcher::has_been_set() {
        plugins = plugins.disable::<LogPlugin>();
    }
    app.add_plugins(plugins);
    prepare(&mut app);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    app
}

/// An image to draw into and to read back.
pub struct Target {
    image: Handle<Image>,
    size: (u32, u32),
}

impl Target {
    /// An image of this width and height in pixels.
    pub fn new(app: &mut App, size: (u32, u32)) -> Self {
        let (width, height) = size;
        let mut image = Image::new_uninit(
            Extent3d { width, height, depth_or_array_layers: 1 },
            TextureDimension::D2,
            TextureFormat::Rgba8UnormSrgb,
            // Without texels it costs nothing to keep it in the main world, from where a device that is made anew gets it.
            RenderAssetUsages::default(),
        );
        image.texture_descriptor.usage |= TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        Self { image: app.world_mut().resource_mut::<Assets<Image>>().add(image), size }
    }

    /// What a camera needs to draw into it.
    pub fn camera_target(&self) -> RenderTarget {
        RenderTarget::from(self.image.clone())
    }

    /// Reads what was drawn last back.
    ///
    /// # Errors
    /// The reason, in words.
    pub fn read(&self, app: &App) -> Result<RenderedImage, String> {
        let world = app.sub_app(RenderApp).world();
        let image = world.resource::<RenderAssets<GpuImage>>().get(&self.image);
        let image = image.ok_or("the image could not be read back: it was never drawn")?;
        let (device, queue) = (world.resource::<RenderDevice>(), world.resource::<RenderQueue>());
        let pixels = read_rgb(device, queue, &image.texture).map_err(|error| error.to_string())?;
        let (width, height) = self.size;
        Ok(RenderedImage { width, height, pixels })
    }
}
