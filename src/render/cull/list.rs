//! The list of one volume of one page on the device.

use std::{ops::Range, sync::Arc};

use bevy::{
    log::{error_once, info_once},
    render::render_resource::{BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferUsages},
};

use super::{
    draws::DrawTable,
    jobs::{CountCopy, CullJob, CullJobs},
    layout::{ListRoom, list_layout},
    readback::Readback,
};
use crate::{
    cull::{
        Grouping, Volume,
        device_lists::{HEADER, TEST_THREADS},
    },
    render::gpu::Gpu,
};

/// Entries of the first list of a large page.
const FIRST_CAPACITY: usize = 1 << 14;
/// Entries that can first be sorted by variant.
const FIRST_STAGING: usize = 1 << 12;
/// Words of an indirect draw's arguments.
const ARGUMENTS: usize = 5;

/// What lists are made from.
#[derive(Clone, Copy)]
pub struct ListSources<'a> {
    /// The trees of the page.
    pub trees: &'a Buffer,
    /// Number of trees.
    pub tree_count: usize,
    /// Its clusters.
    pub clusters: &'a Buffer,
    /// Number of clusters.
    pub cluster_count: usize,
    /// Sizes of the plants.
    pub sizes: &'a Buffer,
    /// The draw calls.
    pub table: &'a Arc<DrawTable>,
    /// One for each level.
    pub groupings: &'a [Grouping],
    /// Number of variants.
    pub variants: usize,
}

impl ListSources<'_> {
    fn groups(&self) -> usize {
        self.groupings.iter().map(|grouping| grouping.groups(self.variants)).sum()
    }
}

/// What the device counted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ListCounts {
    /// Entries that the whole list has.
    pub wanted: u32,
    /// Entries that must be sorted by variant at once.
    pub wanted_staging: u32,
    /// Ranges of the groups of all levels, as drawn.
    pub groups: Vec<Range<u32>>,
}

/// The list of one volume of one page, and the arguments of its draw calls.
pub struct TreeList {
    table: Arc<DrawTable>,
    volume: Buffer,
    room_buffer: Buffer,
    work: Buffer,
    list: Buffer,
    results: Buffer,
    bind_group: BindGroup,
    readback: Readback,
    room: ListRoom,
    /// The volume that the buffers hold, or will hold after this frame.
    held: Option<Volume>,
    /// Whether its counts are known or on their way.
    counted: bool,
    counts: Option<ListCounts>,
}

impl TreeList {
    /// An empty list; `None` if the device's buffers are too small for it.
    pub fn new(gpu: &Gpu, sources: &ListSources) -> Option<Self> {
        let sorted = sources.variants > 1 && sources.groupings.contains(&Grouping::ByVariant);
        let room = ListRoom {
            capacity: (sources.tree_count / 4).max(FIRST_CAPACITY).min(sources.tree_count.max(64)) as u32,
            staging: if sorted { FIRST_STAGING.min(sources.tree_count) as u32 } else { 0 },
            group_count: sources.groups() as u32,
            draw_count: sources.table.len() as u32,
        };
        let uniform = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let volume = gpu.buffer(&BufferDescriptor {
            label: Some("canopy_volume"),
            size: size_of::<Volume>() as u64,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let words = HEADER + 2 * room.group_count as usize;
        let results = gpu.buffer(&BufferDescriptor {
            label: Some("canopy_list_results"),
            size: 4 * (words + ARGUMENTS * room.draw_count as usize) as u64,
            usage: BufferUsages::STORAGE | BufferUsages::INDIRECT | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let room_buffer = gpu.filled_buffer("canopy_list_room", uniform, &[room]);
        let (work, list) = buffers(gpu, sources, &room)?;
        let readback = Readback::new(gpu, words);
        let bind_group = bind_group(gpu, sources, [&volume, &work, &list, &results, &room_buffer]);
        Some(Self {
            table: sources.table.clone(),
            volume,
            room_buffer,
            work,
            list,
            results,
            bind_group,
            readback,
            room,
            held: None,
            counted: false,
            counts: None,
        })
    }

    /// Indices of the trees: the `visible` of everything that draws them. Another one after the list has grown.
    pub fn list(&self) -> &Buffer {
        &self.list
    }

    /// The arguments of the draw calls, and the first byte of them.
    pub fn arguments(&self) -> (&Buffer, u64) {
        (&self.results, 4 * (HEADER as u64 + 2 * u64::from(self.room.group_count)))
    }

    /// Bytes of its buffers.
    pub fn bytes(&self) -> u64 {
        [&self.volume, &self.room_buffer, &self.work, &self.list, &self.results]
            .map(|buffer| buffer.size())
            .iter()
            .sum()
    }

    /// The volume that it was made for last.
    pub fn volume(&self) -> Option<&Volume> {
        self.held.as_ref()
    }

    /// The draw calls.
    pub fn table(&self) -> &Arc<DrawTable> {
        &self.table
    }

    /// The last counts that came back. They may be those of an earlier volume.
    pub fn counts(&self) -> Option<&ListCounts> {
        self.counts.as_ref()
    }

    /// Takes the counts that came back. `true` if the list was too short: it has grown, and is empty until the next
    /// [`prepare`](Self::prepare).
    pub fn collect(&mut self, gpu: &Gpu, sources: &ListSources) -> bool {
        let Some(words) = self.readback.take() else { return false };
        let groups = words.get(HEADER..).unwrap_or(&[]).chunks_exact(2).map(|range| range[0]..range[1]).collect();
        let word = |index: usize| words.get(index).copied().unwrap_or(0);
        let counts = ListCounts { wanted: word(1), wanted_staging: word(2), groups };
        let (capacity, staging) = (counts.wanted, counts.wanted_staging);
        self.counts = Some(counts);
        if capacity <= self.room.capacity && (staging <= self.room.staging) {
            return false;
        }
        let grown = |wanted: u32, known: u32| if wanted > known { wanted.saturating_add(wanted / 4) } else { known };
        let room = ListRoom {
            capacity: grown(capacity, self.room.capacity),
            staging: grown(staging, self.room.staging),
            ..self.room
        };
        let Some((work, list)) = buffers(gpu, sources, &room) else {
            error_once!(
                "a list of {capacity} trees is longer than a buffer of this device: the farthest ones are not drawn. Set \
                 `TreeLists::maker` to the processor"
            );
            return false;
        };
        info_once!("a list of trees was too short for {capacity} of them: it has grown");
        (self.work, self.list, self.room) = (work, list, room);
        gpu.write(&self.room_buffer, 0, bytemuck::bytes_of(&self.room));
        let buffers = [&self.volume, &self.work, &self.list, &self.results, &self.room_buffer];
        self.bind_group = bind_group(gpu, sources, buffers);
        self.held = None;
        true
    }

    /// Has the list of `volume` made in this frame, unless the buffers hold it.
    pub fn prepare(&mut self, gpu: &Gpu, volume: &Volume, jobs: &mut CullJobs) {
        let known = self.held.as_ref() == Some(volume);
        if known && self.counted {
            return;
        }
        if !known {
            gpu.write(&self.volume, 0, bytemuck::bytes_of(volume));
            self.held = Some(*volume);
        }
        let bytes = 4 * (HEADER as u64 + 2 * u64::from(self.room.group_count));
        let copy = self.readback.begin().map(|target| CountCopy {
            results: self.results.clone(),
            bytes,
            target: target.clone(),
            readback: self.readback.clone(),
        });
        self.counted = copy.is_some();
        jobs.0.push(CullJob { bind_group: self.bind_group.clone(), clusters: volume.cluster_count, copy });
    }
}

/// The buffers whose sizes depend on the room: work and list.
fn buffers(gpu: &Gpu, sources: &ListSources, room: &ListRoom) -> Option<(Buffer, Buffer)> {
    let limits = gpu.device.limits();
    let clusters = sources.cluster_count as u64;
    let work = clusters * (2 + sources.groupings.len() as u64) + u64::from(room.staging);
    let bytes = [work, u64::from(room.capacity)].map(|words| 4 * words.max(1));
    let largest = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let groups = clusters.div_ceil(TEST_THREADS.into());
    let fits =
        bytes.iter().all(|bytes| *bytes <= largest) && groups <= limits.max_compute_workgroups_per_dimension.into();
    let create = |label, size, usage| {
        gpu.buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
    };
    fits.then(|| {
        let [work, list] = bytes;
        (
            create("canopy_list_work", work, BufferUsages::STORAGE),
            create("canopy_tree_list", list, BufferUsages::STORAGE | BufferUsages::COPY_SRC),
        )
    })
}

/// Group 0 over the list's own buffers: volume, work, list, results, room.
fn bind_group(gpu: &Gpu, sources: &ListSources, own: [&Buffer; 5]) -> BindGroup {
    let [volume, work, list, results, room] = own.map(|buffer| buffer.as_entire_binding());
    gpu.bind_group(
        "canopy_tree_lists",
        &list_layout(),
        &BindGroupEntries::sequential((
            volume,
            sources.trees.as_entire_binding(),
            sources.clusters.as_entire_binding(),
            sources.sizes.as_entire_binding(),
            sources.table.buffer.as_entire_binding(),
            work,
            list,
            results,
            room,
        )),
    )
}
