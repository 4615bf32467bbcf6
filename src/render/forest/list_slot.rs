//! The list of a view or a cascade for one page of a forest, made on the processor or on the device.

use bevy::render::render_resource::{BindGroup, Buffer};

use super::{
    drawn_trees::PageTrees,
    gpu_forest::{GpuForest, ListTarget},
    instances::instance_bind_group,
};
use crate::{
    cull::{DrawLists, Volume, select},
    render::{
        cull::{CullJobs, ListCounts, ListMaker, TreeList},
        frame_work::FrameWork,
        gpu::{Gpu, GrowingBuffer},
        report::FrameReport,
    },
};

/// What is drawn of one page.
pub struct PreparedPage {
    /// Its trees.
    pub trees: PageTrees,
    /// Group 1, with a dynamic offset.
    pub bind_group: BindGroup,
}

/// How a frame's lists are made.
pub struct ListWork<'a, 'w> {
    /// By whom.
    pub maker: ListMaker,
    /// The device.
    pub gpu: &'a Gpu<'w>,
    /// What the device makes in this frame.
    pub jobs: &'a mut CullJobs,
    /// Is told where the device's buffers are too small.
    pub report: &'a FrameReport,
}

/// The buffers of one list.
#[derive(Default)]
pub struct ListSlot {
    visible: Option<GrowingBuffer>,
    list: Option<TreeList>,
    /// The forest's content that `list` is made from.
    generation: u64,
}

impl ListSlot {
    /// Takes the counts that came back from the device. `true` if the list was too short, so that trees are missing in
    /// what was drawn with it.
    pub fn collect(&mut self, gpu: &Gpu, forest: &GpuForest, page: usize, target: ListTarget) -> bool {
        let current = self.generation == forest.generation;
        match (&mut self.list, forest.list_sources(gpu, page, target)) {
            (Some(list), Some(sources)) if current => list.collect(gpu, &sources),
            _ => false,
        }
    }

    /// The counts that came back last.
    pub fn counts(&self) -> Option<&ListCounts> {
        self.list.as_ref().and_then(TreeList::counts)
    }

    /// The list on the device, if it is there.
    pub fn device_list(&self) -> Option<&TreeList> {
        self.list.as_ref()
    }

    /// The trees of `page` that `volume` sees; `uniform` is bound in group 1.
    pub fn prepare(
        &mut self,
        work: &mut ListWork,
        forest: &GpuForest,
        page: usize,
        target: ListTarget,
        volume: &Volume,
        uniform: &Buffer,
    ) -> PreparedPage {
        if self.generation != forest.generation {
            (self.list, self.generation) = (None, forest.generation);
        }
        if work.maker.why_processor.is_none()
            && let Some(prepared) = self.prepare_on_device(work, forest, page, target, volume, uniform)
        {
            return prepared;
        }
        if work.maker.why_processor.is_none() {
            work.report
                .ran("tree lists", "some are made on the processor: this device's buffers are too small for them");
        }
        self.list = None;
        self.prepare_on_processor(work.gpu, forest, page, volume, uniform)
    }

    fn prepare_on_device(
        &mut self,
        work: &mut ListWork,
        forest: &GpuForest,
        page: usize,
        target: ListTarget,
        volume: &Volume,
        uniform: &Buffer,
    ) -> Option<PreparedPage> {
        if self.list.is_none() {
            let sources = forest.list_sources(work.gpu, page, target)?;
            self.list = TreeList::new(work.gpu, &sources);
        }
        let list = self.list.as_mut()?;
        self.visible = None;
        list.prepare(work.gpu, volume, work.jobs);
        let (arguments, first) = list.arguments();
        let trees = PageTrees::Indirect { table: list.table().clone(), arguments: arguments.clone(), first };
        Some(PreparedPage { trees, bind_group: instance_bind_group(work.gpu, forest, page, uniform, list.list()) })
    }

    fn prepare_on_processor(
        &mut self,
        gpu: &Gpu,
        forest: &GpuForest,
        page: usize,
        volume: &Volume,
        uniform: &Buffer,
    ) -> PreparedPage {
        let lists = forest.page_trees(page).map_or_else(DrawLists::default, |(page, trees)| {
            select(page, trees, &forest.tree_sizes, &forest.groupings, volume)
        });
        let visible = self.visible.get_or_insert_with(|| GrowingBuffer::new(&gpu.device, "canopy_visible_trees"));
        visible.write(&gpu.device, &gpu.queue, &lists.visible);
        FrameWork::add(&gpu.work.uploaded_bytes, 4 * lists.visible.len() as u64);
        FrameWork::add(&gpu.work.listed_trees, lists.visible.len() as u64);
        let bind_group = instance_bind_group(gpu, forest, page, uniform, visible.buffer());
        PreparedPage { trees: PageTrees::Listed(lists), bind_group }
    }
}
