//! Tiles whose vertices are on the device, kept while they are in use.

use std::sync::Arc;

use bevy::{
    platform::collections::HashMap,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferUsages},
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::vertex::GpuTileVertex;
use crate::terrain::{
    Terrain, TerrainError,
    tiles::{TILE_QUADS, TileSettings, TileTree},
};

/// Vertices of a tile.
pub const TILE_VERTICES: usize = (TILE_QUADS + 1) * (TILE_QUADS + 1);
/// Initial number of tiles on the device; doubled while a view needs more.
const FIRST_SLOTS: usize = 512;

/// Level, column and row in the quadtree.
pub type TileKey = (u32, i32, i32);

/// Tiles on the GPU by their position in the quadtree.
pub struct TileCache {
    terrain: Arc<Terrain>,
    settings: TileSettings,
    /// The quadtree.
    pub tree: TileTree,
    slots: HashMap<TileKey, (usize, u64)>,
    free: Vec<usize>,
    /// Vertices of all slots.
    pub vertices: Buffer,
    capacity: usize,
}

impl TileCache {
    /// An empty cache of the tiles of `terrain`.
    ///
    /// # Errors
    /// [`TerrainError`] for settings that are not valid for a quadtree.
    pub fn new(device: &RenderDevice, terrain: &Arc<Terrain>, settings: &TileSettings) -> Result<Self, TerrainError> {
        Ok(Self {
            terrain: terrain.clone(),
            settings: *settings,
            tree: TileTree::new(terrain, settings)?,
            slots: HashMap::default(),
            free: (0..FIRST_SLOTS).rev().collect(),
            vertices: Self::buffer(device, FIRST_SLOTS),
            capacity: FIRST_SLOTS,
        })
    }

    /// Whether it holds tiles of `terrain` under `settings`.
    pub fn is_of(&self, terrain: &Arc<Terrain>, settings: &TileSettings) -> bool {
        Arc::ptr_eq(&self.terrain, terrain) && self.settings == *settings
    }

    fn buffer(device: &RenderDevice, capacity: usize) -> Buffer {
        device.create_buffer(&BufferDescriptor {
            label: Some("canopy_terrain_vertices"),
            size: (capacity * TILE_VERTICES * size_of::<GpuTileVertex>()) as u64,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    fn clear(&mut self, device: &RenderDevice, capacity: usize) {
        self.vertices = Self::buffer(device, capacity);
        self.capacity = capacity;
        self.slots.clear();
        self.free = (0..capacity).rev().collect();
    }

    /// The most tiles that `device` holds: their vertices lie in one storage buffer.
    pub fn most(device: &RenderDevice) -> usize {
        let limit = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size) as usize;
        limit / (TILE_VERTICES * size_of::<GpuTileVertex>())
    }

    /// Makes room for `wanted` tiles; the current tiles may have to be uploaded again.
    pub fn reserve(&mut self, device: &RenderDevice, wanted: usize) {
        let capacity = wanted.next_power_of_two().max(FIRST_SLOTS).min(Self::most(device));
        if capacity > self.capacity {
            self.clear(device, capacity);
        }
    }

    /// The slot of a tile, which is computed and uploaded if it is new. `None` if all slots are in use in this frame.
    pub fn slot(&mut self, key: TileKey, frame: u64, queue: &RenderQueue, made: &mut usize) -> Option<usize> {
        if let Some((slot, used)) = self.slots.get_mut(&key) {
            *used = frame;
            return Some(*slot);
        }
        if self.free.is_empty() {
            // Drop the least recently used half.
            let mut ages: Vec<(u64, TileKey, usize)> =
                self.slots.iter().filter(|(_, (_, used))| *used != frame).map(|(k, (s, u))| (*u, *k, *s)).collect();
            ages.sort_unstable();
            for (_, key, slot) in ages.iter().take(ages.len().div_ceil(2)) {
                self.slots.remove(key);
                self.free.push(*slot);
            }
        }
        let slot = self.free.pop()?;
        let vertices: Vec<GpuTileVertex> =
            self.tree.tile_vertices(&self.terrain, key.0, key.1, key.2).iter().map(GpuTileVertex::from).collect();
        let offset = slot * TILE_VERTICES * size_of::<GpuTileVertex>();
        queue.write_buffer(&self.vertices, offset as u64, bytemuck::cast_slice(&vertices));
        self.slots.insert(key, (slot, frame));
        *made += 1;
        Some(slot)
    }
}
