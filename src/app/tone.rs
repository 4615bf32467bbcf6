//! Reads the table of the renderer's tone curve from Bevy.

use bevy::{
    app::{App, TaskPoolPlugin},
    asset::{AssetApp, AssetPlugin, Assets},
    core_pipeline::tonemapping::{TonemappingLuts, TonemappingPlugin},
    image::{Image, ImagePlugin},
    render::render_resource::TextureFormat,
    shader::{Shader, ShaderLoader},
};
use glam::Vec3;
use half::f16;
use tracing::subscriber::NoSubscriber;

use super::error::AppError;
use crate::reference::ToneTable;

/// The table of [`TONEMAPPING`](crate::render::components::TONEMAPPING). No device is needed: Bevy keeps its tables in
/// the main world.
///
/// # Errors
/// [`AppError::Render`] if Bevy has no such table, or not in half floats.
pub fn tone_table() -> Result<ToneTable, AppError> {
    let failed = |what: &str| AppError::Render(format!("Bevy's tone curve cannot be read: {what}"));
    let mut app = App::new();
    app.add_plugins((TaskPoolPlugin::default(), AssetPlugin::default(), ImagePlugin::default()));
    // The plugin loads shaders, which are not used, and logs errors where they have no loader or there is no renderer.
    app.init_asset::<Shader>().init_asset_loader::<ShaderLoader>();
    tracing::subscriber::with_default(NoSubscriber::default(), || app.add_plugins(TonemappingPlugin));
    let world = app.world();
    let handle = world.get_resource::<TonemappingLuts>().map(|tables| tables.blender_filmic.clone());
    let image = handle.as_ref().and_then(|handle| world.get_resource::<Assets<Image>>()?.get(handle));
    let image = image.ok_or_else(|| failed("it is not there"))?;
    if image.texture_descriptor.format != TextureFormat::Rgba16Float {
        return Err(failed("its texels are not half floats"));
    }
    let data = image.data.as_deref().ok_or_else(|| failed("it is on the device only"))?;
    let size = image.texture_descriptor.size;
    if size.width != size.height || size.height != size.depth_or_array_layers {
        return Err(failed("it is not a cube"));
    }
    let (texels, _) = data.as_chunks::<8>();
    let half = |texel: &[u8; 8], at: usize| f16::from_le_bytes([texel[2 * at], texel[2 * at + 1]]).to_f32();
    let texels = texels.iter().map(|texel| Vec3::new(half(texel, 0), half(texel, 1), half(texel, 2))).collect();
    Ok(ToneTable::new(size.width as usize, texels)?)
}
