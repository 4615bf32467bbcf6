//! Tiles and their vertices as the shader reads them.

use bytemuck::{Pod, Zeroable};

use crate::{math::octahedral, terrain::tiles::TileVertex};

/// `TileVertex` of `shaders/terrain/terrain.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GpuTileVertex {
    /// Metres above the datum.
    pub height: f32,
    /// The same in the next coarser mesh.
    pub parent_height: f32,
    /// Octahedral normal about +Y, two snorm16 (within 0.01°).
    pub normal: u32,
    /// The same of the next coarser mesh.
    pub parent_normal: u32,
}

impl From<&TileVertex> for GpuTileVertex {
    fn from(vertex: &TileVertex) -> Self {
        Self {
            height: vertex.height,
            parent_height: vertex.parent_height,
            normal: octahedral::pack_snorm16(octahedral::encode_y(vertex.normal)),
            parent_normal: octahedral::pack_snorm16(octahedral::encode_y(vertex.parent_normal)),
        }
    }
}

/// `Tile` of `shaders/terrain/terrain.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GpuTile {
    /// North-western corner relative to the camera (x, z), metres.
    pub origin: [f32; 2],
    /// Metres between vertices.
    pub spacing: f32,
    /// First vertex.
    pub first: u32,
    /// Distance at which the morph begins, metres.
    pub morph_start: f32,
    /// Distance at which it ends, metres.
    pub morph_end: f32,
    /// Lower bound of the distance from the camera to the ground, metres.
    pub clearance: f32,
    /// Level of detail.
    pub level: f32,
}
