//! The data of billboard clouds that shaders read.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::bake::{
    BakedPlant,
    levels::{cloud::CloudPlane, cross::ISOTROPIC_LEVELS},
};

/// `CloudPlane` of `shaders/forest/cloud_plane.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CloudPlaneUniform {
    /// Centre, metres in the plant's frame.
    pub center: [f32; 3],
    /// Texture coordinates of the upper left corner: the first.
    pub texture_left: f32,
    /// Half extent to the right.
    pub u: [f32; 3],
    /// The second.
    pub texture_top: f32,
    /// Half extent upwards.
    pub v: [f32; 3],
    /// Those of the lower right corner: the first.
    pub texture_right: f32,
    /// Unit normal towards the side from which the texture was rendered.
    pub normal: [f32; 3],
    /// The second.
    pub texture_bottom: f32,
}

impl CloudPlaneUniform {
    fn new(plane: &CloudPlane) -> Self {
        let ([left, top], [right, bottom]) = (plane.texture_min.to_array(), plane.texture_max.to_array());
        Self {
            center: plane.center.to_array(),
            texture_left: left,
            u: plane.u.to_array(),
            texture_top: top,
            v: plane.v.to_array(),
            texture_right: right,
            normal: plane.normal.to_array(),
            texture_bottom: bottom,
        }
    }
}

/// `CloudVariant` of `shaders/forest/cloud_plane.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CloudVariantUniform {
    /// Mean factor for light through its leaves.
    pub transmission: [f32; 3],
    /// Layer of its lighting texture.
    pub light_layer: u32,
    /// Fraction of a texel's leaf area with isotropic normals, mip by mip.
    pub isotropic_fraction: [[f32; 4]; ISOTROPIC_LEVELS / 4],
}

/// The planes of all plants, and which of them belong to each.
pub fn cloud_planes(plants: &[BakedPlant]) -> (Vec<CloudPlaneUniform>, Vec<Range<u32>>) {
    let mut planes = Vec::new();
    let ranges = plants.iter().map(|plant| {
        let first = planes.len() as u32;
        planes.extend(plant.cloud().into_iter().flat_map(|cloud| &cloud.planes).map(CloudPlaneUniform::new));
        first..planes.len() as u32
    });
    let ranges = ranges.collect();
    (planes, ranges)
}

/// The uniforms of each plant; those of one without a cloud are not read.
pub fn cloud_variants(plants: &[BakedPlant]) -> Vec<CloudVariantUniform> {
    let mut light_layer = 0;
    let variant = |plant: &BakedPlant| {
        let Some(cloud) = plant.cloud() else { return CloudVariantUniform::default() };
        let own = light_layer;
        light_layer += u32::from(cloud.textures.light.is_some());
        CloudVariantUniform {
            transmission: cloud.transmission.to_array(),
            light_layer: own,
            isotropic_fraction: bytemuck::cast(cloud.isotropic_fraction),
        }
    };
    plants.iter().map(variant).collect()
}
