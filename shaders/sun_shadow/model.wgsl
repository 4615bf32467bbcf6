// Depth from the key light: the shadow proxies of near trees (src/bake/levels/shadow_proxy.rs).
#import canopy::instance::{trees, visible, unpack_tree, plant_vertex_position}
#import canopy::caster::{cascade, clamp_caster}

@group(2) @binding(0) var color_texture: texture_2d<f32>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @builtin(instance_index) index: u32,
) -> Varying {
    let tree = unpack_tree(trees[visible[index]]);
    var out: Varying;
    out.clip = clamp_caster(plant_vertex_position(tree, position).relative);
    out.uv = uv;
    return out;
}

#ifdef FOLIAGE
// A single texel of the matching mip: a map's texel is coarser than the effect of a filter, and most of the pass is
// spent here.
fn alpha(uv: vec2<f32>) -> f32 {
    let size = vec2<f32>(textureDimensions(color_texture));
    let texels = max(fwidth(uv.x) * size.x, fwidth(uv.y) * size.y);
    let level = clamp(i32(log2(max(texels, 1.0))), 0, i32(textureNumLevels(color_texture)) - 1);
    let position = fract(uv) * vec2<f32>(textureDimensions(color_texture, level));
    return textureLoad(color_texture, vec2<i32>(position), level).a;
}

@fragment
fn fragment(in: Varying) {
    if alpha(in.uv) < 0.5 {
        discard;
    }
}
#endif
