//! Decides where a frame's lists of trees are made.

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
    },
    render::{
        render_resource::{PipelineCache, WgpuFeatures, WgpuLimits},
        renderer::{RenderAdapter, RenderAdapterInfo, RenderDevice},
    },
};
use wgpu::{DeviceType, DownlevelFlags};

use super::{
    layout::STORAGE_BUFFERS,
    pipelines::{ListPipelines, WORKGROUP_BYTES},
};
use crate::{
    cull::device_lists::SORT_THREADS,
    render::{components::TreeListMaker, extract::ExtractedScene, report::FrameReport, shaders::CanopyShaders},
};

/// Where this frame's lists of trees are made.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListMaker {
    /// Why the processor makes them; `None`: the device does.
    pub why_processor: Option<&'static str>,
}

impl Default for ListMaker {
    fn default() -> Self {
        Self { why_processor: Some("no frame was prepared yet") }
    }
}

impl ListMaker {
    /// The processor, because some caller has no use for lists on the device.
    pub const PROCESSOR: Self = Self { why_processor: Some("these lists are always made on the processor") };
}

/// What a device lacks to make lists; `None` if nothing.
pub fn unavailable(features: WgpuFeatures, flags: DownlevelFlags, limits: &WgpuLimits) -> Option<&'static str> {
    if !flags.contains(DownlevelFlags::COMPUTE_SHADERS) || limits.max_compute_invocations_per_workgroup < SORT_THREADS {
        Some("this device has no compute shaders")
    } else if !flags.contains(DownlevelFlags::INDIRECT_EXECUTION) {
        Some("this device has no indirect draws")
    } else if !features.contains(WgpuFeatures::INDIRECT_FIRST_INSTANCE) {
        Some("this device's indirect draws begin with instance 0 only")
    } else if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS
        || limits.max_compute_workgroup_storage_size < WORKGROUP_BYTES
    {
        Some("this device has too few storage buffers in a stage or too little memory in a workgroup")
    } else {
        None
    }
}

/// Decides for the frame, and asks for the pipelines that it needs.
pub fn choose_maker(
    scene: Res<ExtractedScene>,
    device: Res<RenderDevice>,
    adapter: Res<RenderAdapter>,
    info: Res<RenderAdapterInfo>,
    shaders: Res<CanopyShaders>,
    cache: Res<PipelineCache>,
    report: Res<FrameReport>,
    mut pipelines: ResMut<ListPipelines>,
    mut maker: ResMut<ListMaker>,
) {
    let flags = adapter.get_downlevel_capabilities().flags;
    let asked = match scene.tree_lists.maker {
        TreeListMaker::Processor => Some("the program asks for it"),
        TreeListMaker::Automatic if info.device_type == DeviceType::Cpu => {
            Some("this device is a software driver, for which the processor is the default")
        }
        TreeListMaker::Automatic | TreeListMaker::Device => None,
    };
    let why = asked.or_else(|| unavailable(device.features(), flags, &device.limits())).or_else(|| {
        let ready = pipelines.request(&shaders, &cache);
        (!ready).then_some("the device's pipelines are still being compiled")
    });
    maker.why_processor = why;
    match why {
        _ if scene.forests.is_empty() => report.skipped("tree lists", "the world has no forest"),
        None => report.ran("tree lists", "made on the device"),
        Some(why) => report.ran("tree lists", format!("made on the processor: {why}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_device_lacks_is_named() {
        let (features, flags, limits) =
            (WgpuFeatures::INDIRECT_FIRST_INSTANCE, DownlevelFlags::all(), WgpuLimits::default());
        assert_eq!(unavailable(features, flags, &limits), None);
        let lacks = |features, flags, limits: &WgpuLimits| unavailable(features, flags, limits).unwrap_or_default();
        assert!(lacks(features, flags - DownlevelFlags::COMPUTE_SHADERS, &limits).contains("compute"));
        assert!(lacks(features, flags - DownlevelFlags::INDIRECT_EXECUTION, &limits).contains("indirect"));
        assert!(lacks(WgpuFeatures::empty(), flags, &limits).contains("instance 0"));
        let few = WgpuLimits { max_storage_buffers_per_shader_stage: 4, ..limits.clone() };
        assert!(lacks(features, flags, &few).contains("storage buffers"));
        assert!(lacks(features, flags, &WgpuLimits::downlevel_webgl2_defaults()).contains("compute"));
    }
}
