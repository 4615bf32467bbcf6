// Packed trees of 16 bytes: src/scatter/packed.rs packs them, this file unpacks them.
#define_import_path canopy::instance

#import canopy::constants::{POSITION_STEPS, YAW_BITS, YAWS, SCALE_SHIFT, SCALE_BITS, SCALE_STEPS, SCALE_OCTAVES, LEAST_SCALE_LOG2}
#import canopy::constants::{CELL_BITS, VARIANT_LOW_SHIFT, VARIANT_LOW_BITS, VARIANT_HIGH_SHIFT, VARIANT_HIGH_BITS}
#import canopy::constants::{TINT_SHIFT, TINT_BITS, TINT_STEPS}
#import canopy::constants::{WHOLE, FADE_SPAN, AMBIENT_PUBLISHED}
#import canopy::hash::mix32
#import canopy::constants::{FACTOR_ONE, LEAST_FACTOR, GREATEST_FACTOR, LEAST_SHIFT}

struct Tree {
    xz: u32,
    y: f32,
    cell: u32,
    look: u32,
}

// The anchor that positions are relative to: the camera for the view, a box's centre for a cascade.
struct ForestView {
    // Counted from the stand's base cell, as those of the trees.
    anchor_cell: vec2<i32>,
    // Metres of the anchor inside its cell (x, z).
    anchor_offset: vec2<f32>,
    // Anchor's height over the stand's datum in metres.
    anchor_y: f32,
    cell_size: f32,
    // Distances in metres over which the level fades in and out.
    fade_in: vec2<f32>,
    fade_out: vec2<f32>,
    // The level's tint, and its weight.
    tint: vec4<f32>,
}

// Data of each plant, used by all representations.
struct Variant {
    // Metres.
    height: f32,
    crown_radius: f32,
    // 1 if it is lit by radiance transfer: its ambient occlusion is ray-traced, and includes light scattered by leaves.
    radiance_transfer: u32,
    // Gloss of its leaves.
    specular_reflectance: f32,
    roughness: f32,
    // 1 if the foliage's normals are realigned to point out of the crown, else 0.
    realigned: f32,
    // For billboard clouds: indirect light of the key light (indirect_sun in transfer.wgsl) in the mean over its leaves, as the component
    // of the second band towards the zenith, the first coefficient, and its colour.
    indirect_sun_zenith: f32,
    indirect_sun_mean: f32,
    indirect_sun_color: vec3<f32>,
    // How its leaves are lit by their ambient visibility: AMBIENT_FITTED, AMBIENT_PUBLISHED, or neither.
    ambient_term: u32,
    // As in `Surface`.
    lobe_gain: f32,
    lobe_room: f32,
    // Factor on the cover around it: 0 where its ambient visibility holds the shade of the trees around already, else 1.
    cover_weight: f32,
    // The nominal height over its own, times FACTOR_ONE.
    inverse_height: u32,
    // Layer of its foliage in the styles.
    foliage_layer: u32,
}

struct Instance {
    // Foot relative to the anchor, metres.
    position: vec3<f32>,
    // Cosine and sine of the yaw, x and y.
    yaw: vec2<f32>,
    // The yaw in steps of a full rotation over YAWS.
    yaw_code: u32,
    scale: f32,
    variant: u32,
    // -1..1
    tint: f32,
}

@group(1) @binding(0) var<uniform> view: ForestView;
@group(1) @binding(1) var<storage, read> trees: array<Tree>;
@group(1) @binding(2) var<storage, read> visible: array<u32>;
@group(1) @binding(3) var<storage, read> variants: array<Variant>;

fn unpack_tree(tree: Tree) -> Instance {
    let packed_cell = bitcast<i32>(tree.cell);
    let cell = vec2(extractBits(packed_cell, 0u, CELL_BITS), extractBits(packed_cell, CELL_BITS, CELL_BITS));
    let offset = vec2(f32(tree.xz & 0xffffu), f32(tree.xz >> 16u)) * (view.cell_size / POSITION_STEPS);
    let xz = vec2<f32>(cell - view.anchor_cell) * view.cell_size + (offset - view.anchor_offset);
    let yaw_code = extractBits(tree.look, 0u, YAW_BITS);
    let yaw = f32(yaw_code) * (6.28318531 / f32(YAWS));
    let scale_code = extractBits(tree.look, SCALE_SHIFT, SCALE_BITS);
    let tint_code = extractBits(bitcast<i32>(tree.look), TINT_SHIFT, TINT_BITS);
    var instance: Instance;
    instance.yaw_code = yaw_code;
    instance.position = vec3(xz.x, tree.y - view.anchor_y, xz.y);
    instance.yaw = vec2(cos(yaw), sin(yaw));
    instance.scale = exp2(f32(scale_code) * (SCALE_OCTAVES / SCALE_STEPS) + LEAST_SCALE_LOG2);
    let variant_high = extractBits(tree.cell, VARIANT_HIGH_SHIFT, VARIANT_HIGH_BITS);
    instance.variant = extractBits(tree.look, VARIANT_LOW_SHIFT, VARIANT_LOW_BITS) | (variant_high << VARIANT_LOW_BITS);
    instance.tint = max(f32(tint_code) / TINT_STEPS, -1.0);
    return instance;
}

// Plant frame to world axes: a rotation about Y.
fn rotate(v: vec3<f32>, yaw: vec2<f32>) -> vec3<f32> {
    return vec3(yaw.x * v.x + yaw.y * v.z, v.y, -yaw.y * v.x + yaw.x * v.z);
}

// Position of a tree's vertex, metres in world axes.
struct VertexPosition {
    // From the anchor.
    relative: vec3<f32>,
    // From the tree's foot.
    from_foot: vec3<f32>,
}

// Position of the vertex that is at `local` (metres) in the plant's frame. All vertex shaders of plants call this,
// those of shadows too.
fn plant_vertex_position(tree: Instance, local: vec3<f32>) -> VertexPosition {
    return rotated_vertex_position(tree, rotate(local, tree.yaw));
}

// The same for a position in the plant that is already rotated into world axes.
fn rotated_vertex_position(tree: Instance, rotated: vec3<f32>) -> VertexPosition {
    var position: VertexPosition;
    position.from_foot = rotated * tree.scale;
    position.relative = tree.position + position.from_foot;
    return position;
}

// The ellipsoid in a tree's extents.
struct Crown {
    // Metres from the anchor.
    center: vec3<f32>,
    // One over its half extents across and upwards, 1/m.
    inverse_extents: vec2<f32>,
}

fn crown_of(tree: Instance) -> Crown {
    let size = vec2(variants[tree.variant].crown_radius, 0.5 * variants[tree.variant].height) * tree.scale;
    return Crown(tree.position + vec3(0.0, size.y, 0.0), 1.0 / max(size, vec2(1e-3)));
}

// Light enters a crown after this fraction of the way out of its ellipsoid, which reaches to the farthest leaves: neighbouring crowns reach
// into it, and their shade would be missed (docs/decisions/0025-crosses-have-sun-textures.md).
const ENTRY: f32 = 0.7;

// Distance from a position to where light from the unit vector `to_light` enters the crown, metres; 0 outside of it.
fn depth_in_crown(relative: vec3<f32>, crown: Crown, to_light: vec3<f32>) -> f32 {
    let scale = crown.inverse_extents.xyx;
    let position = (relative - crown.center) * scale;
    let along = to_light * scale;
    let square = dot(along, along);
    let middle = dot(position, along);
    let inside = middle * middle + square * (1.0 - dot(position, position));
    return ENTRY * max(sqrt(max(inside, 0.0)) - middle, 0.0) / square;
}

// The scale of a code, times 256; octaves are interpolated linearly. CPU twin: src/scatter/packed.rs.
fn scale_of_code(code: u32) -> u32 {
    let octaves = 8u * code + 8u;
    return ((4096u + (octaves & 4095u)) << (octaves >> 12u)) >> 8u;
}

// Factor on the distance of a tree by its size and place, times FACTOR_ONE. CPU twin: src/lod/level_distance.rs.
fn distance_factor(tree: Tree, inverse_height: u32) -> u32 {
    let code = extractBits(tree.look, SCALE_SHIFT, SCALE_BITS);
    let inverse_scale = scale_of_code(u32(SCALE_STEPS) - code);
    let place = mix32(tree.xz ^ mix32(extractBits(tree.cell, 0u, 2u * CELL_BITS)));
    let shift = LEAST_SHIFT + ((3u * (place >> 26u)) >> 1u);
    let factor = min(inverse_scale * inverse_height / FACTOR_ONE, 2u * GREATEST_FACTOR) * shift / FACTOR_ONE;
    return clamp(factor, LEAST_FACTOR, GREATEST_FACTOR);
}

// The distance by which a tree's level is chosen, metres.
fn level_distance(tree: Tree, instance: Instance) -> f32 {
    let factor = distance_factor(tree, variants[instance.variant].inverse_height);
    return length(instance.position) * (f32(factor) / f32(FACTOR_ONE));
}

// Threshold of the alpha test of this level at a distance: the CPU twin is src/lod.
fn level_threshold(distance: f32) -> f32 {
    let coming = 0.5 * (view.fade_in.x + view.fade_in.y);
    let going = 0.5 * (view.fade_out.x + view.fade_out.y);
    return max(
        WHOLE + FADE_SPAN * clamp((coming - distance) / max(coming - view.fade_in.x, 1e-3), 0.0, 1.0),
        WHOLE + FADE_SPAN * clamp((distance - going) / max(view.fade_out.y - going, 1e-3), 0.0, 1.0),
    );
}

// Mixes in the level's tint.
fn tint_level(color: vec3<f32>) -> vec3<f32> {
    return mix(color, view.tint.rgb * dot(color, vec3(0.5)), view.tint.w);
}

// Individual shift of the foliage's hue and brightness.
fn tint_foliage(albedo: vec3<f32>, tint: f32) -> vec3<f32> {
    return albedo * (1.0 + tint * vec3(0.18, 0.07, -0.05));
}

// Ambient light at an ambient visibility `k`: what does not come from the sky comes from other leaves, by their albedo. The
// share is fitted to the path tracer (benches/expressive.rs).
// As published there is none.
fn with_indirect_ambient(k: f32, ambient_term: u32) -> f32 {
    return k + (1.0 - k) * select(0.13, 0.0, ambient_term == AMBIENT_PUBLISHED);
}

// 1 where leaves are lit by [Luft 2007, eq. 1] alone, else 0: no light comes through them, and the gloss is that of the
// normals out of the crown.
fn is_published(ambient_term: u32) -> f32 {
    return select(0.0, 1.0, ambient_term == AMBIENT_PUBLISHED);
}

// Visibility of the key light behind nearby leaves, for which the shadow maps are too coarse, from the ambient term `k`
// of a density field: a leaf that sees little of the sky mostly lies in shade. Where the map is fine, `k` adds no
// information, and 0.8 + 0.75 k, at most 1.3, would be slightly closer to the path tracer (benches/expressive.rs).
fn leaf_visibility(k: f32) -> f32 {
    return min(0.35 + 2.0 * k, 1.1);
}
