// Depth from the key light: the planes of billboard clouds.
#import canopy::cloud_plane::{planes, plane_corner, plane_uv}
#import canopy::instance::{trees, visible, unpack_tree, plant_vertex_position}
#import canopy::caster::clamp_caster

@group(2) @binding(0) var color_textures: texture_2d_array<f32>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) variant: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Varying {
    let tree = unpack_tree(trees[visible[instance]]);
    let plane = planes[index / 6u];
    let corner = plane_corner(index);
    var out: Varying;
    out.clip = clamp_caster(plant_vertex_position(tree, plane.center + corner.x * plane.u + corner.y * plane.v).relative);
    out.uv = plane_uv(plane, corner);
    out.variant = tree.variant;
    return out;
}

// A single texel of the matching mip, as in model.wgsl.
fn alpha(uv: vec2<f32>, layer: u32) -> f32 {
    let size = vec2<f32>(textureDimensions(color_textures));
    let texels = max(fwidth(uv.x) * size.x, fwidth(uv.y) * size.y);
    let level = clamp(i32(log2(max(texels, 1.0))), 0, i32(textureNumLevels(color_textures)) - 1);
    let position = clamp(uv, vec2(0.0), vec2(0.9999)) * vec2<f32>(textureDimensions(color_textures, level));
    return textureLoad(color_textures, vec2<i32>(position), i32(layer), level).a;
}

@fragment
fn fragment(in: Varying) {
    if alpha(in.uv, in.variant) < 0.5 {
        discard;
    }
}
