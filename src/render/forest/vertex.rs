//! Vertices of the full model, twenty bytes each.

use bevy::{
    mesh::VertexBufferLayout,
    render::render_resource::{VertexFormat, VertexStepMode},
};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use half::f16;

use crate::bake::lighting::implicit::packing;

/// A vertex of the full model or of its shadow proxy.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PlantVertex {
    /// Metres in the plant's frame.
    pub position: [f32; 3],
    /// The normal, scaled by the ambient occlusion ([`packing`]).
    pub normal: u32,
    /// Texture coordinates, half precision.
    pub uv: [u16; 2],
}

impl PlantVertex {
    /// Packs one vertex. Values that are not finite are replaced by the origin, up, 1 and 0.
    pub fn new(position: Vec3, normal: Vec3, ambient: f32, uv: Vec2) -> Self {
        let position = if position.is_finite() { position } else { Vec3::ZERO };
        let half =
            |value: f32| f16::from_f32(if value.is_finite() { value.clamp(-6.0e4, 6.0e4) } else { 0.0 }).to_bits();
        Self { position: position.to_array(), normal: packing::encode(normal, ambient), uv: [half(uv.x), half(uv.y)] }
    }

    /// The vertex buffer's layout, as `shaders/forest/model.wgsl` reads it.
    pub fn layout() -> VertexBufferLayout {
        VertexBufferLayout::from_vertex_formats(
            VertexStepMode::Vertex,
            [VertexFormat::Float32x3, VertexFormat::Unorm10_10_10_2, VertexFormat::Float16x2],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_is_twenty_bytes_and_keeps_what_it_holds() {
        assert_eq!(size_of::<PlantVertex>() as u64, PlantVertex::layout().array_stride);
        assert_eq!(size_of::<PlantVertex>(), 20);
        let normal = Vec3::new(0.3, -0.8, 0.5).normalize();
        let vertex = PlantVertex::new(Vec3::ONE, normal, 0.25, Vec2::new(1.5, -2.0));
        let (unpacked, ambient) = packing::decode(vertex.normal);
        assert!(unpacked.angle_between(normal).to_degrees() < 0.4 && (ambient - 0.25).abs() < 0.0023);
        assert_eq!(f16::from_bits(vertex.uv[1]).to_f32(), -2.0);
    }

    #[test]
    fn nonsense_becomes_harmless() {
        let vertex = PlantVertex::new(Vec3::NAN, Vec3::ZERO, f32::NAN, Vec2::splat(f32::INFINITY));
        assert_eq!(vertex.position, [0.0; 3]);
        assert_eq!(packing::decode(vertex.normal), (Vec3::Y, 1.0));
        assert_eq!(vertex.uv, [0, 0]);
    }
}
