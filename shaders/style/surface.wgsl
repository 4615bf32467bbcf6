// What the styles' first pass writes for each pixel: the surface that is seen, without its light. Rust: src/render/style/surfaces.rs.
#define_import_path canopy::style_surface

#import canopy::instance::{Crown, Tree}

struct StyledSurface {
    // Unit normal in world axes times the ambient visibility, and metres above the ground.
    @location(0) surface: vec4<f32>,
    // Layer, and a random number of the tree, 0..255; strokes that are always seen, and strokes in shade, 0..255.
    @location(1) identity: vec4<u32>,
    // Linear albedo.
    @location(2) color: vec4<f32>,
}

// Least length of a stored normal: its direction is kept where the ambient visibility is 0.
const LEAST_LENGTH: f32 = 0.05;

fn styled_surface(normal: vec3<f32>, ambient: f32, height: f32, identity: vec2<u32>, albedo: vec3<f32>) -> StyledSurface {
    let scaled = normalize(normal) * mix(LEAST_LENGTH, 1.0, saturate(ambient));
    return StyledSurface(vec4(scaled, height), vec4(identity, 0u, 0u), vec4(saturate(albedo), 1.0));
}

// A number of the tree that does not change, 0..255.
fn individual(tree: Tree) -> u32 {
    var h = tree.xz * 0x9e3779b1u ^ (tree.cell * 0x85ebca6bu);
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    return h >> 24u;
}

// Normal (xyz) and ambient visibility (w) of foliage at `relative` whose normals were not realigned by a bake: those of the
// ellipsoid in the crown's extents, which is what an implicit surface of the leaves comes down to without the leaves.
fn crown_surface(relative: vec3<f32>, crown: Crown) -> vec4<f32> {
    let scale = crown.inverse_extents.xyx;
    let inside = (relative - crown.center) * scale;
    let depth = dot(inside, inside);
    return vec4(normalize(inside * scale + vec3(0.0, 1e-4, 0.0)), saturate(0.1 + 0.9 * depth));
}
