// Depth from the key light: the shadow proxies of near trees (src/bake/shadow_proxy.rs).
#import canopy::instance::{trees, visible, unpack_tree, turn}
#import canopy::caster::{cascade, clamp_caster}

@group(2) @binding(0) var color_texture: texture_2d<f32>;
@group(2) @binding(2) var part_sampler: sampler;

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
    out.clip = clamp_caster(tree.position + turn(position, tree.yaw) * tree.scale);
    out.uv = uv;
    return out;
}

#ifdef FOLIAGE
@fragment
fn fragment(in: Varying) {
    if textureSample(color_texture, part_sampler, in.uv).a < 0.5 {
        discard;
    }
}
#endif
