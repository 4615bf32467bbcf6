//! The WGSL sources, embedded in the library, and their handles.
//!
//! One table serves the plugin and the test that validates every shader without a GPU. While a shader is worked
//! on, the environment variable `CANOPY_SHADERS` may name a folder that is read instead, so that no build is needed.

use std::borrow::Cow;

use bevy::{
    app::{App, SubApp},
    asset::{Assets, Handle},
    ecs::resource::Resource,
    log::warn,
    shader::Shader,
};

use super::shader_constants;

macro_rules! sources {
    ($($path:literal),+ $(,)?) => {
        &[$(($path, include_str!(concat!("../../shaders/", $path)))),+]
    };
}

/// Every shader as `(path below shaders/, source)`; libraries stand before those that import them.
pub const SOURCES: &[(&str, &str)] = sources![
    "common/frame.wgsl",
    "common/sky.wgsl",
    "common/stand.wgsl",
    "common/output.wgsl",
    "common/sun_visibility.wgsl",
    "common/lighting.wgsl",
    "forest/instance.wgsl",
    "forest/transfer.wgsl",
    "forest/model.wgsl",
    "forest/cross.wgsl",
    "sun_shadow/caster.wgsl",
    "sun_shadow/model.wgsl",
    "sun_shadow/cross.wgsl",
    "sun_shadow/mesh.wgsl",
    "sky/sky.wgsl",
    "terrain/terrain.wgsl",
];

/// [`SOURCES`] behind the module that [`shader_constants`] writes.
pub fn sources() -> Vec<(&'static str, Cow<'static, str>)> {
    let constants = ("common/constants.wgsl", Cow::Owned(shader_constants::source()));
    std::iter::once(constants).chain(SOURCES.iter().map(|&(path, source)| (path, Cow::Borrowed(source)))).collect()
}

/// Handles of [`sources`] in the same order; kept alive as long as the app.
#[derive(Resource, Clone, Default)]
pub struct CanopyShaders(Vec<Handle<Shader>>);

impl CanopyShaders {
    /// Loads all sources into the app's shader assets.
    pub fn load(app: &mut App) -> Self {
        let folder = std::env::var_os("CANOPY_SHADERS").map(std::path::PathBuf::from);
        let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
        let handles = sources().into_iter().map(|(path, source)| {
            let name = format!("canopy/{path}");
            let edited = folder.as_ref().and_then(|folder| match std::fs::read_to_string(folder.join(path)) {
                Ok(text) => Some(text),
                Err(error) => {
                    warn!("CANOPY_SHADERS: {}: {error}; the built-in shader is used", folder.join(path).display());
                    None
                }
            });
            shaders.add(match edited {
                Some(text) => Shader::from_wgsl(text, name),
                None => Shader::from_wgsl(source, name),
            })
        });
        Self(handles.collect())
    }

    /// The shader at `path` below `shaders/`; an unknown path gives a handle that never loads.
    pub fn get(&self, path: &str) -> Handle<Shader> {
        sources()
            .iter()
            .position(|(known, _)| *known == path)
            .and_then(|index| self.0.get(index).cloned())
            .unwrap_or_default()
    }

    /// Shares the handles with the render world.
    pub fn share(self, app: &mut App, render_app: impl FnOnce(&mut App) -> Option<&mut SubApp>) {
        if let Some(render_app) = render_app(app) {
            render_app.insert_resource(self.clone());
        }
        app.insert_resource(self);
    }
}
