//! What measures: adapter, driver, processor.

use bevy::{
    ecs::world::World,
    render::renderer::{RenderAdapterInfo, RenderDevice},
};
use wgpu::{DeviceType, Features};

use super::record::{Machine, Memory};
use crate::app::Renderer;

/// The machine that `renderer` runs on.
pub fn machine(renderer: &Renderer) -> Machine {
    let world = renderer.world();
    let info = world.get_resource::<RenderAdapterInfo>();
    let features = world.get_resource::<RenderDevice>().map(RenderDevice::features).unwrap_or_default();
    let driver = |info: &RenderAdapterInfo| format!("{} {}", info.driver, info.driver_info).trim().to_owned();
    Machine {
        adapter: info.map(|info| info.name.clone()).unwrap_or_default(),
        driver: info.map(driver).unwrap_or_default(),
        backend: info.map(|info| info.backend.to_string()).unwrap_or_default(),
        software: info.is_some_and(|info| info.device_type == DeviceType::Cpu),
        gpu_times: features.contains(Features::TIMESTAMP_QUERY | Features::TIMESTAMP_QUERY_INSIDE_PASSES),
        processor: processor(),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        canopy: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// The processor's name, where Linux says it.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Memory in use by the renderer of `world`.
pub fn memory(world: &World) -> Memory {
    let device = world.get_resource::<RenderDevice>();
    let report = device.and_then(|device| device.wgpu_device().generate_allocator_report());
    Memory { device: report.map(|report| report.total_allocated_bytes), program: resident() }
}

/// Resident memory of the process, where Linux says it.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}
