//! Graphics adapters: which there are, and the one to use.

use bevy::{
    render::settings::{Backends, WgpuSettings},
    tasks::block_on,
};

use super::error::AppError;

/// Of these only errors are worth the user's while: that a driver is slow, lacks bindless textures, or that a display
/// does not know its size in millimetres, is none.
pub const LOG_FILTER: &str = "wgpu=error,naga=error,winit=error,bevy_egui=error,bevy_render::renderer=error";

/// Names of all adapters, one line each, best first.
///
/// # Errors
/// [`AppError::NoAdapter`] where there is none.
pub fn list_adapters() -> Result<Vec<String>, AppError> {
    let adapters = enumerate();
    if adapters.is_empty() {
        return Err(AppError::NoAdapter { details: String::new() });
    }
    Ok(adapters
        .iter()
        .map(|info| format!("{} ({:?}, {}, {})", info.name, info.device_type, info.backend, info.driver_info))
        .collect())
}

fn enumerate() -> Vec<wgpu::AdapterInfo> {
    let backends = Backends::from_env().unwrap_or(Backends::VULKAN | Backends::METAL | Backends::DX12);
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut infos: Vec<_> =
        block_on(instance.enumerate_adapters(backends)).iter().map(|adapter| adapter.get_info()).collect();
    let rank = |info: &wgpu::AdapterInfo| match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    infos.sort_by_key(rank);
    infos
}

/// Settings for the adapter whose name contains `wanted` (case does not count), or the best one.
///
/// # Errors
/// [`AppError::NoAdapter`] and [`AppError::UnknownAdapter`], before Bevy would stop the process.
pub fn settings(wanted: Option<&str>) -> Result<WgpuSettings, AppError> {
    let adapters = enumerate();
    let environment = std::env::var("WGPU_ADAPTER_NAME").ok().filter(|name| !name.is_empty());
    let wanted = wanted.map(str::to_owned).or(environment);
    if adapters.is_empty() {
        let details = wanted.map_or(String::new(), |name| format!(" (looked for `{name}`)"));
        return Err(AppError::NoAdapter { details });
    }
    let chosen = match &wanted {
        None => adapters.first(),
        Some(name) => adapters.iter().find(|info| info.name.to_lowercase().contains(&name.to_lowercase())),
    };
    let Some(chosen) = chosen else {
        let present = adapters.iter().map(|info| info.name.clone()).collect::<Vec<_>>().join(", ");
        return Err(AppError::UnknownAdapter { wanted: wanted.unwrap_or_default(), present });
    };
    Ok(WgpuSettings {
        backends: Some(Backends::from(chosen.backend)),
        adapter_name: Some(chosen.name.clone()),
        ..WgpuSettings::default()
    })
}

/// Refuses a window or picture of `(width, height)` pixels that the adapter of `settings` cannot hold.
///
/// # Errors
/// [`AppError::TooLarge`].
pub fn check_size(settings: &WgpuSettings, (width, height): (u32, u32)) -> Result<(), AppError> {
    let backends = settings.backends.unwrap_or(Backends::all());
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    let adapters = block_on(wgpu::Instance::new(descriptor).enumerate_adapters(backends));
    let named = |name: String| settings.adapter_name.as_ref().is_none_or(|wanted| *wanted == name);
    let chosen = adapters.iter().find(|adapter| named(adapter.get_info().name));
    match chosen.map(|adapter| adapter.limits().max_texture_dimension_2d) {
        Some(limit) if width > limit || height > limit || width == 0 || height == 0 => {
            Err(AppError::TooLarge { width, height, limit })
        }
        _ => Ok(()),
    }
}
