// Depth from the key light: ordinary Bevy meshes that cast onto trees and terrain.
#import canopy::caster::{cascade, clamp_caster}

struct MeshPosition {
    // Mesh frame to metres relative to the box's centre.
    anchor_from_local: mat4x4<f32>,
}

@group(1) @binding(0) var<uniform> mesh: MeshPosition;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    return clamp_caster((mesh.anchor_from_local * vec4(position, 1.0)).xyz);
}
