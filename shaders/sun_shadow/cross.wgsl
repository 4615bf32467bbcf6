// Depth from the key light: far trees as one upright texture that faces the light's azimuth, so that the
// shadow's area does not depend on it, and the horizontal one for a high light.
#import canopy::constants::CASTER_VERTICES
#import canopy::cross_variant::cross_variants
#import canopy::instance::{trees, visible, unpack_tree, rotate, rotated_vertex_position}
#import canopy::caster::{cascade, clamp_caster}

@group(2) @binding(0) var color_textures: texture_2d_array<f32>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) layer: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    var corners = array<vec2<f32>, 6>(
        vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0),
    );
    let tree = unpack_tree(trees[visible[index / CASTER_VERTICES]]);
    let upright = (index % CASTER_VERTICES) < 6u;
    let corner = corners[index % 6u];
    let plane_index = select(cross_variants[tree.variant].uprights, 0u, upright);
    let plane = cross_variants[tree.variant].planes[plane_index];
    var u = rotate(plane.u.xyz, tree.yaw);
    let v = rotate(plane.v.xyz, tree.yaw);
    let center = rotate(plane.center.xyz, tree.yaw);
    if upright {
        // Face the light's azimuth about the crown's axis, so that both textures shade the same spot.
        let across = cascade.direction.zx * vec2(1.0, -1.0);
        let axis = across / max(length(across), 1e-6);
        u = vec3(axis.x, 0.0, axis.y) * length(plane.u.xyz);
    }
    var out: Varying;
    out.clip = clamp_caster(rotated_vertex_position(tree, center + corner.x * u + corner.y * v).relative);
    out.uv = vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y);
    out.layer = cross_variants[tree.variant].first_layer + plane_index;
    return out;
}

// A single texel, as in model.wgsl, but of a mip that is twice as fine: a cross has few texels, and their coverage must
// be preserved.
fn alpha(uv: vec2<f32>, layer: u32) -> f32 {
    let size = vec2<f32>(textureDimensions(color_textures));
    let texels = max(fwidth(uv.x) * size.x, fwidth(uv.y) * size.y);
    let level = clamp(i32(log2(max(0.5 * texels, 1.0))), 0, i32(textureNumLevels(color_textures)) - 1);
    let position = clamp(uv, vec2(0.0), vec2(0.9999)) * vec2<f32>(textureDimensions(color_textures, level));
    return textureLoad(color_textures, vec2<i32>(position), i32(layer), level).a;
}

@fragment
fn fragment(in: Varying) {
    if alpha(in.uv, in.layer) < 0.5 {
        discard;
    }
}
