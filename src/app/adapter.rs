//! Graphics adapters: lists them and chooses one.

use bevy::{
    render::settings::{Backends, WgpuSettings},
    tasks::block_on,
};

use super::error::AppError;
use crate::assets::most_trees;

/// Of these only errors are worth the user's while: that a driver is slow, lacks bindless textures, or that a display
/// does not know its size in millimetres, is none.
pub const LOG_FILTER: &str = "wgpu=error,naga=error,winit=error,bevy_egui=error,bevy_render::renderer=error";

/// Names of all adapters, one line each, best first.
///
/// # Errors
/// [`AppError::NoAdapter`] where there is none.
pub fn list_adapters() -> Result<Vec<String>, AppError> {
    let adapters = best_first(enumerate());
    if adapters.is_empty() {
        return Err(AppError::NoAdapter { details: String::new() });
    }
    Ok(adapters
        .iter()
        .map(|info| format!("{} ({:?}, {}, {})", info.name, info.device_type, info.backend, info.driver_info))
        .collect())
}

/// All adapters in the drivers' own order.
fn enumerate() -> Vec<wgpu::AdapterInfo> {
    let backends = Backends::from_env().unwrap_or(Backends::VULKAN | Backends::METAL | Backends::DX12);
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    let instance = wgpu::Instance::new(descriptor);
    block_on(instance.enumerate_adapters(backends)).iter().map(|adapter| adapter.get_info()).collect()
}

fn best_first(mut infos: Vec<wgpu::AdapterInfo>) -> Vec<wgpu::AdapterInfo> {
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

/// Whether `name` contains `part`, as Bevy compares them: case is ignored, and every name contains an empty part.
fn is_named(name: &str, part: &str) -> bool {
    name.to_lowercase().contains(&part.to_lowercase())
}

/// Rejects an environment that would make Bevy use another adapter than `chosen`, the one that `wanted` names.
///
/// Bevy prefers WGPU_ADAPTER_NAME to its settings (bevy_render 0.19, `initialize_renderer`): it takes the first
/// adapter, in the drivers' order `present`, whose name contains the variable's value, and any adapter if none does.
fn check_environment(environment: &str, wanted: &str, chosen: &str, present: &[&str]) -> Result<(), AppError> {
    match present.iter().find(|name| is_named(name, environment)) {
        Some(taken) if *taken == chosen => Ok(()),
        _ => Err(AppError::AdapterConflict {
            environment: environment.to_owned(),
            wanted: wanted.to_owned(),
            chosen: chosen.to_owned(),
        }),
    }
}

/// Settings for the adapter whose name contains `wanted` (case is ignored), or for the best one.
///
/// # Errors
/// [`AppError::NoAdapter`] and [`AppError::UnknownAdapter`], before Bevy would stop the process;
/// [`AppError::AdapterConflict`] if the environment's WGPU_ADAPTER_NAME would replace `wanted` by another adapter.
pub fn settings(wanted: Option<&str>) -> Result<WgpuSettings, AppError> {
    let present = enumerate();
    let adapters = best_first(present.clone());
    let asked = wanted;
    let environment = std::env::var("WGPU_ADAPTER_NAME").ok();
    let wanted = asked.map(str::to_owned).or_else(|| environment.clone().filter(|name| !name.is_empty()));
    if adapters.is_empty() {
        let details = wanted.map_or(String::new(), |name| format!(" (looked for `{name}`)"));
        return Err(AppError::NoAdapter { details });
    }
    let chosen = match &wanted {
        None => adapters.first(),
        Some(name) => adapters.iter().find(|info| is_named(&info.name, name)),
    };
    let Some(chosen) = chosen else {
        let present = adapters.iter().map(|info| info.name.clone()).collect::<Vec<_>>().join(", ");
        return Err(AppError::UnknownAdapter { wanted: wanted.unwrap_or_default(), present });
    };
    if let (Some(asked), Some(environment)) = (asked, &environment) {
        let same_backend = present.iter().filter(|info| info.backend == chosen.backend);
        let names: Vec<&str> = same_backend.map(|info| info.name.as_str()).collect();
        check_environment(environment, asked, &chosen.name, &names)?;
    }
    Ok(WgpuSettings {
        backends: Some(Backends::from(chosen.backend)),
        adapter_name: Some(chosen.name.clone()),
        ..WgpuSettings::default()
    })
}

/// Rejects a window or image of `(width, height)` pixels that is too large for the adapter of `settings`. Returns the
/// most trees that the adapter holds; `None` if it is not found again.
///
/// # Errors
/// [`AppError::TooLarge`].
pub fn check_size(settings: &WgpuSettings, (width, height): (u32, u32)) -> Result<Option<usize>, AppError> {
    let backends = settings.backends.unwrap_or(Backends::all());
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    let adapters = block_on(wgpu::Instance::new(descriptor).enumerate_adapters(backends));
    let named = |name: String| settings.adapter_name.as_ref().is_none_or(|wanted| *wanted == name);
    let chosen = adapters.iter().find(|adapter| named(adapter.get_info().name));
    let Some(limits) = chosen.map(wgpu::Adapter::limits) else { return Ok(None) };
    let limit = limits.max_texture_dimension_2d;
    if width > limit || height > limit || width == 0 || height == 0 {
        return Err(AppError::TooLarge { width, height, limit });
    }
    Ok(Some(most_trees(&limits)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRESENT: [&str; 3] = ["Fast Card 9", "Fast Card 9 Laptop", "llvmpipe (LLVM 19)"];

    #[test]
    fn an_environment_that_means_the_same_adapter_is_no_conflict() {
        for environment in ["llvm", "LLVMPIPE", "llvmpipe (LLVM 19)"] {
            assert!(check_environment(environment, "pipe", PRESENT[2], &PRESENT).is_ok(), "{environment}");
        }
        assert!(check_environment("", "fast", PRESENT[0], &PRESENT).is_ok());
    }

    #[test]
    fn an_environment_that_means_another_adapter_is_reported_with_both_names() {
        // Another name, a name that fits an earlier adapter too, one that fits all, and one that fits none.
        let cases = [("llvm", 0), ("fast", 1), ("", 2), ("abacus", 0)];
        for (environment, chosen) in cases {
            let error = check_environment(environment, "it", PRESENT[chosen], &PRESENT);
            let message = error.map_or_else(|error| error.to_string(), |()| String::new());
            assert!(message.contains(PRESENT[chosen]), "{environment}: {message}");
            assert!(message.contains(&format!("`{environment}`")) && message.contains("unset WGPU_ADAPTER_NAME"));
        }
    }
}
