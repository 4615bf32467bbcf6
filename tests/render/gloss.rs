//! The gloss of a leaf as the real-time shader has it, measured on the device against what the ground truth reflects.

use std::borrow::Cow;

use bevy::tasks::block_on;
use canopy::plant::{Gloss, PlantMaterial, lobe_gain, lobe_room};
use canopy::render::bindings::uniforms::LightUniform;
use glam::Vec3;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, ShaderSource};

use crate::shaders::compose;
use crate::support::gpu::gpu;

/// As in gloss.wgsl.
const ROWS: usize = 64;

/// `Leaf` of gloss.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Leaf {
    albedo: f32,
    transmission: f32,
    specular_reflectance: f32,
    roughness: f32,
    lobe_gain: f32,
    lobe_room: f32,
}

/// What the shader's lobe and the whole shader reflect of even light, for each leaf.
fn reflected(leaves: &[Leaf]) -> Vec<[f64; 2]> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY);
    let instance = wgpu::Instance::new(descriptor);
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
    let (device, queue) = block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
    let module = compose("gloss.wgsl", include_str!("gloss.wgsl"), &[]).unwrap();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: ShaderSource::Naga(Cow::Owned(module)),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let light = LightUniform { key_direction: [0.6, 0.48, 0.64], key_illuminance: [1.0; 3], ..LightUniform::default() };
    let filled =
        |contents: &[u8], usage| device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage });
    let light = filled(bytemuck::bytes_of(&light), BufferUsages::UNIFORM);
    let input = filled(bytemuck::cast_slice(leaves), BufferUsages::STORAGE);
    let empty = |usage| {
        let size = (leaves.len() * ROWS * size_of::<[f32; 2]>()) as u64;
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let output = empty(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
    let read = empty(BufferUsages::MAP_READ | BufferUsages::COPY_DST);
    let group = |index, buffers: &[(u32, &wgpu::Buffer)]| {
        let mut entries = Vec::new();
        for &(binding, buffer) in buffers {
            entries.push(wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
        }
        let layout = &pipeline.get_bind_group_layout(index);
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    };
    let groups = [group(0, &[(1, &light)]), group(1, &[(0, &input), (1, &output)])];
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    for (index, group) in groups.iter().enumerate() {
        pass.set_bind_group(index as u32, group, &[]);
    }
    pass.dispatch_workgroups(leaves.len() as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &read, 0, output.size());
    queue.submit([encoder.finish()]);
    read.slice(..).map_async(wgpu::MapMode::Read, |mapped| mapped.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = read.slice(..).get_mapped_range();
    let rows: &[[f32; 2]] = bytemuck::cast_slice(&bytes);
    let sum = |rows: &[[f32; 2]]| [0, 1].map(|value| rows.iter().map(|row| f64::from(row[value])).sum());
    rows.chunks(ROWS).map(sum).collect()
}

#[test]
fn the_shaders_leaf_reflects_its_colour_and_its_lobe_what_the_ground_truths_does() {
    let _gpu = gpu();
    let mut leaves = Vec::new();
    let mut expected = Vec::new();
    for tenths in 1..=10 {
        let gloss = Gloss { roughness: tenths as f32 / 10.0, ..Gloss::LEAF };
        // Green leaves have room for the whole lobe, bright ones for some of it, the last for none.
        for color in [0.05, 0.15, 0.43, 0.5] {
            let material = PlantMaterial { gloss, transmission: Vec3::splat(1.3), ..PlantMaterial::default() };
            let through = material.transmitted(Vec3::splat(color));
            leaves.push(Leaf {
                albedo: color,
                transmission: through.y / color,
                specular_reflectance: gloss.reflectance,
                roughness: gloss.roughness,
                lobe_gain: lobe_gain(gloss.roughness),
                lobe_room: lobe_room(gloss.roughness),
            });
            expected.push([gloss.specular_albedo(Vec3::splat(color), through).y, color].map(f64::from));
        }
    }
    for ((leaf, found), expected) in leaves.iter().zip(reflected(&leaves)).zip(expected) {
        let Leaf { albedo, roughness, .. } = leaf;
        for (found, expected) in found.into_iter().zip(expected) {
            let bound = 0.02 * expected + 1e-4;
            assert!((found - expected).abs() < bound, "{albedo} at {roughness}: {found} {expected}");
        }
    }
}
