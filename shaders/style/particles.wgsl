// Particles of near crowns in three intensity maps [Luft 2006, 4.2]: dark in red, medium in green, bright in blue, added up.
// src/style/particles.rs makes them and has the equations.
#import canopy::hash::mix32
#import canopy::octahedral::decode_octahedral_y
#import canopy::frame::{frame, light}
#import canopy::instance::{view, trees, visible, variants, unpack_tree, rotate, plant_vertex_position}
#import canopy::style::{FARTHEST, NEAREST, landscape_depth}

struct Particle {
    // Metres in the plant's frame.
    position: vec3<f32>,
    // Octahedral, two snorm16.
    normal: u32,
}

struct ParticleView {
    // Metres across a dab, and least pixels across one.
    size: f32,
    least_pixels: f32,
    // Dabs per pixel of a crown and square of their own pixels.
    cover: f32,
    // Depth in metres to which they are seen into a crown, of the blurred depth test.
    reach: f32,
    // Thresholds between dark, medium and bright.
    thresholds: vec2<f32>,
    map_size: vec2<f32>,
    // Distances in metres over which they give way to the washes alone.
    fade: vec2<f32>,
}

@group(2) @binding(0) var<storage, read> particles: array<Particle>;
@group(2) @binding(1) var<uniform> settings: ParticleView;
@group(2) @binding(2) var soft_lights: texture_2d<f32>;

// Metres: lower plants have smaller dabs.
const TALL: f32 = 12.0;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) corner: vec2<f32>,
    // Distance in metres, and strength.
    @location(1) @interpolate(flat) at: vec2<f32>,
    // The map.
    @location(2) @interpolate(flat) class_color: vec3<f32>,
}

fn hash(index: u32) -> f32 {
    return f32(mix32(index * 0x9e3779b1u) >> 8u) / 16777216.0;
}

// Pixels of the maps across a dab of a plant `height` metres high at a distance.
fn dab_pixels(distance: f32, height: f32) -> f32 {
    return max(settings.size * min(height / TALL, 1.0) * frame.focal_length_pixels / max(distance, 0.5), settings.least_pixels);
}

// Dabs of a crown `height` and `radius` metres large at a distance: the twin of `wanted` in src/render/style/particles.rs.
fn wanted(distance: f32, height: f32, radius: f32) -> f32 {
    let pixels = dab_pixels(distance, height);
    let scale = frame.focal_length_pixels / max(distance, 0.5);
    return settings.cover * height * 2.0 * radius * scale * scale / (pixels * pixels);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Varying {
    var corners = array<vec2<f32>, 6>(
        vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0),
    );
    let number = index / 6u;
    let corner = corners[index % 6u];
    let particle = particles[number];
    let tree = unpack_tree(trees[visible[instance]]);
    let center = plant_vertex_position(tree, particle.position).relative;
    let distance = length(center);
    let of_tree = length(tree.position.xz);
    let size = vec2(variants[tree.variant].height, variants[tree.variant].crown_radius) * tree.scale;
    let count = max(wanted(of_tree, size.x, size.y), 1.0);
    // The last of the fixed random order fade first: none pops.
    let strength = saturate((count - f32(number)) / (0.2 * count + 1.0)) * (1.0 - smoothstep(settings.fade.x, settings.fade.y, of_tree));
    // A dab lies across its own direction, and is longer than wide.
    let turn = 6.2831853 * hash(number);
    let shape = vec2(corner.x, corner.y * mix(0.45, 0.75, hash(number + 7919u)));
    let turned = vec2(cos(turn) * shape.x - sin(turn) * shape.y, sin(turn) * shape.x + cos(turn) * shape.y);
    let grown = mix(0.7, 1.35, hash(number + 104729u));

    var out: Varying;
    out.clip = frame.clip_from_relative * vec4(center, 1.0);
    out.clip += vec4(turned * grown * dab_pixels(distance, size.x) / settings.map_size * out.clip.w, 0.0, 0.0);
    out.corner = corner;
    let facing = dot(rotate(decode_octahedral_y(particle.normal), tree.yaw), light.key_direction);
    let dark = facing <= settings.thresholds.x;
    let bright = facing > settings.thresholds.y;
    out.class_color = vec3(f32(dark), f32(!(dark | bright)), f32(bright));
    out.at = vec2(distance, strength);
    if strength <= 0.0 {
        out.clip = vec4(0.0, 0.0, 0.5, 1.0);
    }
    return out;
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    // No dab is an ellipse: its outline has lobes.
    let angle = atan2(in.corner.y, in.corner.x) + 40.0 * in.at.y + in.at.x;
    let outline = 0.82 + 0.11 * sin(3.0 * angle) + 0.07 * sin(5.0 * angle + 1.3);
    let shape = 1.0 - smoothstep(outline - 0.22, outline, length(in.corner));
    // The blurred depth test [Luft 2006, eq. 2] with a shift of its half width, in metres: a band of constant width.
    let texel = vec2<i32>(in.clip.xy);
    let depth = textureLoad(soft_lights, texel, 0).z;
    let behind = (landscape_depth(in.at.x) - depth) * log(FARTHEST / NEAREST) * in.at.x;
    let seen = smoothstep(-settings.reach, settings.reach, settings.reach - behind);
    return vec4(in.class_color * (shape * seen * in.at.y), 1.0);
}
