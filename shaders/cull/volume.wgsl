// What a view or a cascade can see, in whole numbers: the same on every device. CPU twin, with the same names:
// src/cull/volume.rs, which says why and how large the numbers become.
#define_import_path canopy::volume

#import canopy::constants::{POSITION_STEPS, CELL_BITS, SCALE_SHIFT, SCALE_BITS, MAX_LEVELS, MAX_PLANES}
#import canopy::constants::{COORDINATE_LIMIT, PLANE_SLACK, ENDLESS_DROP, SQUARE_LIMIT, CLUSTER_KEYS}
#import canopy::constants::{FACTOR_ONE, FACTOR_LIMIT}
#import canopy::instance::{Tree, distance_factor, scale_of_code}

// A distance: what is nearer has a smaller sum of squares, after the shift.
struct Ring {
    shift: u32,
    square: u32,
}

struct LevelRange {
    begin: Ring,
    end: Ring,
    first_group: u32,
    // 1 if its trees are grouped by variant.
    by_variant: u32,
}

struct VolumePlane {
    normal: array<i32, 3>,
    offset: i32,
    drop_factor: i32,
}

struct Volume {
    anchor_cell: array<i32, 2>,
    anchor_step: array<i32, 2>,
    anchor_y: i32,
    y_scale: f32,
    shift: u32,
    size_factor: array<u32, 2>,
    // Units of plane tests per unit of heights, times 1024; 0: heights do not count in the distances of levels.
    height_factor: u32,
    lowest: i32,
    first_level_only: u32,
    whole_levels: u32,
    along_light: u32,
    key_normal: array<i32, 3>,
    key_offset: i32,
    key_shift: u32,
    plane_count: u32,
    level_count: u32,
    cluster_count: u32,
    variant_count: u32,
    limit: Ring,
    levels: array<LevelRange, MAX_LEVELS>,
    planes: array<VolumePlane, MAX_PLANES>,
}

// A run of trees of one cell, and the box around them: src/cull/clusters.rs.
struct Cluster {
    cell: u32,
    first: u32,
    count: u32,
    low: array<i32, 2>,
    high: array<i32, 2>,
    bottom: f32,
    top: f32,
    // Least and greatest factor on the distances of its trees.
    factors: array<u32, 2>,
}

// Size of a plant at scale 1 in 1/16 m.
struct TreeSize {
    radius: u32,
    height: u32,
    // The nominal height over that in metres, times FACTOR_ONE.
    inverse_height: u32,
}

// A box in the units of plane tests.
struct Bounds {
    low: vec3<i32>,
    high: vec3<i32>,
}

// What is known of a cluster without a look at its trees.
struct ClusterLook {
    // 0: no tree of it is drawn.
    seen: u32,
    // The level in which all its trees are drawn, plus 1; 0: they are looked at one by one.
    whole: u32,
    // Clusters of smaller keys are drawn earlier.
    key: u32,
}

@group(0) @binding(0) var<storage, read> volume: Volume;

// Whether a position (steps from the anchor, absolute values) is nearer than the ring after `factor` over FACTOR_ONE.
fn is_beyond(ring: Ring, position: vec3<u32>, factor: u32) -> bool {
    let shifted = min(position >> vec3(ring.shift), vec3(FACTOR_LIMIT));
    let at = min(shifted * factor / FACTOR_ONE, vec3(SQUARE_LIMIT));
    return at.x * at.x + at.y * at.y + at.z * at.z < ring.square;
}

// Column and row of a cell, counted from the anchor's.
fn cell_from_anchor(cell: u32) -> vec2<i32> {
    let packed_cell = bitcast<i32>(cell);
    let anchor = vec2(volume.anchor_cell[0], volume.anchor_cell[1]);
    return vec2(extractBits(packed_cell, 0u, CELL_BITS), extractBits(packed_cell, CELL_BITS, CELL_BITS)) - anchor;
}

// Steps on the ground from the anchor, of what is `steps` from the corner of its cell.
fn from_anchor(cell: u32, steps: vec2<i32>) -> vec2<i32> {
    let anchor = vec2(volume.anchor_step[0], volume.anchor_step[1]);
    return cell_from_anchor(cell) * i32(POSITION_STEPS) + (steps - anchor);
}

// A height in its units, relative to the anchor. A product with a power of two is exact.
fn height_from_anchor(metres: f32) -> i32 {
    return i32(floor(metres * volume.y_scale)) - volume.anchor_y;
}

fn cluster_bounds(cluster: Cluster, low: vec2<i32>, high: vec2<i32>) -> Bounds {
    let west_north = low >> vec2(volume.shift);
    let east_south = (high >> vec2(volume.shift)) + 1;
    let bottom = height_from_anchor(cluster.bottom);
    let top = height_from_anchor(cluster.top) + 1;
    return Bounds(vec3(west_north.x, bottom, west_north.y), vec3(east_south.x, top, east_south.y));
}

fn ground_position(tree: Tree) -> vec2<i32> {
    return from_anchor(tree.cell, vec2(i32(tree.xz & 0xffffu), i32(tree.xz >> 16u)));
}

// An upper bound of a tree's scale, times 256.
fn scale_bound(look: u32) -> u32 {
    return scale_of_code(extractBits(look, SCALE_SHIFT, SCALE_BITS)) + 1u;
}

fn size_units(steps: u32, scale: u32, factor: u32) -> i32 {
    return i32(((((steps * scale) >> 8u) + 1u) * factor) >> 10u) + 1;
}

fn tree_bounds(tree: Tree, size: TreeSize, position: vec2<i32>) -> Bounds {
    let scale = scale_bound(tree.look);
    let radius = size_units(size.radius, scale, volume.size_factor[0]);
    let height = size_units(size.height, scale, volume.size_factor[1]);
    let foot = position >> vec2(volume.shift);
    let y = height_from_anchor(tree.y);
    let low = vec3(foot.x - radius, y, foot.y - radius);
    return Bounds(low, vec3(foot.x + 1 + radius, y + 1 + height, foot.y + 1 + radius));
}

// The greatest product of a normal with a position in the box.
fn farthest(normal: vec3<i32>, bounds: Bounds) -> i32 {
    let product = normal * select(bounds.low, bounds.high, normal >= vec3(0));
    return product.x + product.y + product.z;
}

// A box within the coordinates that products of planes hold.
fn clamped(bounds: Bounds) -> Bounds {
    let limit = vec3(COORDINATE_LIMIT);
    return Bounds(clamp(bounds.low, -limit, limit), clamp(bounds.high, -limit, limit));
}

// What rounding may add to a plane's product with a corner of a box, or take.
fn slack_of(bounds: Bounds) -> i32 {
    let size = max(abs(bounds.low), abs(bounds.high));
    return ((size.x + size.y + size.z) >> 1u) + PLANE_SLACK;
}

// Whether anything in a box may be inside.
fn sees(bounds: Bounds) -> bool {
    let limit = vec3(COORDINATE_LIMIT);
    if any(bounds.low > limit) || any(bounds.high < -limit) {
        return false;
    }
    let inside = clamped(bounds);
    let slack = slack_of(inside);
    let drop = max(inside.high.y - volume.lowest, 0);
    for (var i = 0u; i < volume.plane_count; i++) {
        let plane = volume.planes[i];
        let product = farthest(vec3(plane.normal[0], plane.normal[1], plane.normal[2]), inside);
        let endless = plane.drop_factor > 0 && drop >= ENDLESS_DROP;
        let value = product + plane.offset + slack + plane.drop_factor * min(drop, ENDLESS_DROP);
        if !endless && value < 0 {
            return false;
        }
    }
    return true;
}

// Whether a plane may cut a box.
fn cuts(bounds: Bounds) -> bool {
    let inside = clamped(bounds);
    let slack = slack_of(inside);
    for (var i = 0u; i < volume.plane_count; i++) {
        let plane = volume.planes[i];
        let product = -farthest(-vec3(plane.normal[0], plane.normal[1], plane.normal[2]), inside);
        if product + plane.offset - slack < 0 {
            return true;
        }
    }
    return false;
}

// A difference of heights in steps, if heights count.
fn height_steps(units: u32) -> u32 {
    let coarse = (min(units, u32(COORDINATE_LIMIT)) * volume.height_factor) >> 10u;
    return min(coarse, 0x7fffffffu >> volume.shift) << volume.shift;
}

// The levels in which a tree at `position` (steps from the anchor, absolute values) is drawn, as bits.
fn levels_at(position: vec3<u32>, factor: u32) -> u32 {
    var bits = 0u;
    for (var i = 0u; i < volume.level_count; i++) {
        if !is_beyond(volume.levels[i].begin, position, factor) && is_beyond(volume.levels[i].end, position, factor) {
            bits |= 1u << i;
        }
    }
    return select(bits, bits & (~bits + 1u), volume.first_level_only == 1u);
}

// The levels in which a tree of `size` is drawn, as bits; none if it is not seen.
fn levels_of_tree(tree: Tree, size: TreeSize) -> u32 {
    let position = ground_position(tree);
    let at = vec2<u32>(abs(position));
    if !is_beyond(volume.limit, vec3(at.x, 0u, at.y), FACTOR_ONE) || !sees(tree_bounds(tree, size, position)) {
        return 0u;
    }
    let y = height_steps(u32(abs(height_from_anchor(tree.y))));
    return levels_at(vec3(at.x, y, at.y), distance_factor(tree, size.inverse_height));
}

// A cluster's key: less is drawn earlier. In views, those that no plane cuts come first.
fn cluster_key(bounds: Bounds, near: vec2<u32>) -> u32 {
    if volume.along_light == 1u {
        let reach = farthest(vec3(volume.key_normal[0], volume.key_normal[1], volume.key_normal[2]), clamped(bounds));
        return min(u32(max(volume.key_offset - reach, 0)) >> volume.key_shift, CLUSTER_KEYS - 1u);
    }
    let shifted = min(near >> vec2(volume.shift + 3u), vec2(SQUARE_LIMIT));
    let square = (shifted.x * shifted.x + shifted.y * shifted.y) | 1u;
    // A floating-point number with 6 bits of a fraction.
    let exponent = firstLeadingBit(square);
    return (select(0u, 1u, cuts(bounds)) << 11u) | (exponent << 6u) | (((square << (31u - exponent)) >> 25u) & 0x3fu);
}

fn look_at(cluster: Cluster) -> ClusterLook {
    let low = from_anchor(cluster.cell, vec2(cluster.low[0], cluster.low[1]));
    let high = from_anchor(cluster.cell, vec2(cluster.high[0], cluster.high[1]));
    let near = vec2<u32>(max(max(low, -high), vec2(0)));
    let far = vec2<u32>(max(abs(low), abs(high)));
    let bounds = cluster_bounds(cluster, low, high);
    if !is_beyond(volume.limit, vec3(near.x, 0u, near.y), FACTOR_ONE) || !sees(bounds) {
        return ClusterLook(0u, 0u, 0u);
    }
    let bottom = bounds.low.y;
    let top = bounds.high.y;
    let nearest = vec3(near.x, height_steps(u32(max(max(bottom, -top), 0))), near.y);
    let farthest_point = vec3(far.x, height_steps(max(u32(abs(bottom)), u32(abs(top)))), far.y);
    let least = cluster.factors[0];
    let most = cluster.factors[1];
    var possible = 0u;
    var certain = 0u;
    for (var i = 0u; i < volume.level_count; i++) {
        let level = volume.levels[i];
        if !is_beyond(level.begin, farthest_point, most) && is_beyond(level.end, nearest, least) {
            possible |= 1u << i;
        }
        if !is_beyond(level.begin, nearest, least) && is_beyond(level.end, farthest_point, most) {
            certain |= 1u << i;
        }
    }
    let whole = certain & volume.whole_levels;
    let sole = is_beyond(volume.limit, vec3(far.x, 0u, far.y), FACTOR_ONE) && whole == possible && countOneBits(whole) == 1u;
    return ClusterLook(min(possible, 1u), select(0u, countTrailingZeros(whole) + 1u, sole), cluster_key(bounds, near));
}
