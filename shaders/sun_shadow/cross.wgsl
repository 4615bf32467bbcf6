// Depth from the key light: far trees as one upright picture that turns its face to the light's azimuth, so that the
// shadow's area does not depend on it, and the level picture for a high light.
#import canopy::instance::{trees, visible, variants, unpack_tree, turn}
#import canopy::caster::{cascade, clamp_caster}

@group(2) @binding(0) var color_pictures: texture_2d_array<f32>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    // In texels of the level.
    @location(0) place: vec2<f32>,
    // Layer and level.
    @location(1) @interpolate(flat) picture: vec2<i32>,
}

// Map texels that a vector (metres) spans.
fn span(vector: vec3<f32>) -> f32 {
    return length((cascade.clip_from_anchor * vec4(vector, 0.0)).xy) * cascade.direction.w;
}

const VERTICES_A_TREE: u32 = 12u;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    var corners = array<vec2<f32>, 6>(
        vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0),
    );
    let tree = unpack_tree(trees[visible[index / VERTICES_A_TREE]]);
    let upright = (index % VERTICES_A_TREE) < 6u;
    let corner = corners[index % 6u];
    let plane_index = select(2u, 0u, upright);
    let plane = variants[tree.variant].planes[plane_index];
    var u = turn(plane.u.xyz, tree.yaw);
    let v = turn(plane.v.xyz, tree.yaw);
    let center = turn(plane.center.xyz, tree.yaw);
    if upright {
        // Face the light's azimuth about the crown's axis, so that both pictures shade the same place.
        let across = cascade.direction.zx * vec2(1.0, -1.0);
        let axis = across / max(length(across), 1e-6);
        u = vec3(axis.x, 0.0, axis.y) * length(plane.u.xyz);
    }
    var out: Varying;
    out.clip = clamp_caster(tree.position + (center + corner.x * u + corner.y * v) * tree.scale);
    // One texel of a level that is twice as fine as what a map's texel covers: a map is coarser than what a filter would
    // add, but a cross has few texels, and their sum must hold. The light is parallel, so the level is one for the picture.
    let size = vec2<f32>(textureDimensions(color_pictures));
    let spans = 2.0 * tree.scale * vec2(span(u), span(v));
    let covered = size / max(spans, vec2(1e-3));
    let coarsest = f32(textureNumLevels(color_pictures) - 1u);
    let level = i32(clamp(log2(max(0.5 * max(covered.x, covered.y), 1.0)), 0.0, coarsest));
    let uv = vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y);
    out.place = uv * vec2<f32>(textureDimensions(color_pictures, level));
    out.picture = vec2(i32(variants[tree.variant].size.z) + i32(plane_index), level);
    return out;
}

@fragment
fn fragment(in: Varying) {
    let size = vec2<f32>(textureDimensions(color_pictures, in.picture.y));
    let place = vec2<i32>(clamp(in.place, vec2(0.0), size - 0.5));
    if textureLoad(color_pictures, place, in.picture.x, in.picture.y).a < 0.5 {
        discard;
    }
}
