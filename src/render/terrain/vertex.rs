//! Tiles and their vertices as the shader reads them.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use crate::terrain::tiles::TileVertex;

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
            normal: pack_octahedral(vertex.normal),
            parent_normal: pack_octahedral(vertex.parent_normal),
        }
    }
}

/// Octahedral encoding about +Y [Cigolle et al. 2014] as two snorm16.
fn pack_octahedral(normal: Vec3) -> u32 {
    let n = normal / (normal.x.abs() + normal.y.abs() + normal.z.abs()).max(1e-12);
    let mut e = Vec2::new(n.x, n.z);
    if n.y < 0.0 {
        let sign = Vec2::new(1f32.copysign(e.x), 1f32.copysign(e.y));
        e = (Vec2::ONE - Vec2::new(e.y.abs(), e.x.abs())) * sign;
    }
    let snorm = |v: f32| ((v.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16;
    u32::from(snorm(e.x)) | u32::from(snorm(e.y)) << 16
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
