// Crossed billboards [Franzke 2005, 4.3]: an upright quad that faces the viewer, with the texture of the upright plane along whose normal the
// tree is seen, or the textures of two; and the level plane. Twelve pulled vertices a tree.
#import canopy::octahedral::decode_octahedral
#import canopy::constants::{CROSS_VERTICES, ISOTROPIC_LEVELS, LIGHT_SCALE, SUN_SCALE, WHOLE, FADE_SPAN, GONE}
#import canopy::cross_variant::cross_variants
#import canopy::frame::{frame, light}
#import canopy::instance::{Instance, view, trees, visible, variants, unpack_tree, rotate, plant_vertex_position, rotated_vertex_position, level_distance, level_threshold, tint_foliage, tint_level, with_indirect_ambient, is_published, Crown, crown_of, depth_in_crown}
#import canopy::lighting::{Surface, shade_leaves, even_sky, leaf_transmission}
#import canopy::output::finish
#import canopy::signed_texel::signed_texel
#import canopy::sky::sky_transfer
#import canopy::stand::{stand_light, in_stand_by_transfer}
#import canopy::sun_visibility::{sample_ground, relief_at, cascaded_visibility}
#ifdef STYLED
#import canopy::constants::WOOD_LAYER
#import canopy::style_surface::{StyledSurface, styled_surface, crown_surface, individual}
#endif

@group(2) @binding(0) var color_textures: texture_2d_array<f32>;
@group(2) @binding(1) var property_textures: texture_2d_array<f32>;
@group(2) @binding(2) var texture_sampler: sampler;
// How much of the sun's light the leaves show: src/bake/levels/cross/sun.rs. Two layers a plane; four, of two values each, if it is in blocks.
@group(2) @binding(4) var sun_textures: texture_2d_array<f32>;
#ifdef TRANSFER
// How the light of the sky reaches the leaves: src/bake/levels/cross/light.rs.
@group(3) @binding(0) var light_textures: texture_2d_array<f32>;
#endif

const PI: f32 = 3.14159265;

struct Varying {
#ifdef DEPTH_FIRST
    // The same bits in the pipelines of both stages.
    @builtin(position) @invariant clip: vec4<f32>,
#else
    @builtin(position) clip: vec4<f32>,
#endif
    @location(0) relative: vec3<f32>,
    // u in the textures of the first and of the second plane, and v.
    @location(1) uv: vec3<f32>,
    // Layers of the two planes, the variant, and bits of `LEVEL`, `FIRST_BEHIND` and `SECOND_BEHIND`.
    @location(2) @interpolate(flat) layers: vec4<u32>,
    // Of upright planes, their normals on the ground; of the level plane, its right.
    @location(3) @interpolate(flat) axes: vec4<f32>,
    // Metres above the foot; then in heights of the tree, above the foot and to the right of the trunk.
    @location(4) place: vec3<f32>,
    // A `Crown`.
    @location(5) @interpolate(flat) crown_center: vec3<f32>,
    @location(6) @interpolate(flat) crown_inverse_extents: vec2<f32>,
    // Threshold of the alpha test, the fraction of the second plane, and the tree's tint.
    @location(7) @interpolate(flat) look: vec3<f32>,
#ifdef STYLED
    // Layer, and a number of the tree.
    @location(8) @interpolate(flat) identity: vec2<u32>,
#endif
}

// Bits of `Varying::layers`: the level plane, and planes that are seen from behind.
const LEVEL: u32 = 1u;
const FIRST_BEHIND: u32 = 2u;
const SECOND_BEHIND: u32 = 4u;

// An upright plane, and how the tree is seen along it.
struct Upright {
    index: u32,
    // On the ground, world axes.
    normal: vec2<f32>,
    // 1 from the front, -1 from behind.
    side: f32,
    // From where to where the plane reaches along the quad, metres to the viewer's right of the trunk at scale 1. From behind, the first is the
    // right end.
    ends: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    var corners = array<vec2<f32>, 6>(
        vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0),
    );
    let packed = trees[visible[index / CROSS_VERTICES]];
    let tree = unpack_tree(packed);
    let level = (index % CROSS_VERTICES) >= 6u;
    let corner = corners[index % 6u];
    let uprights = max(cross_variants[tree.variant].uprights, 1u);

    // From the viewer to the tree on the ground. Right above it, any direction will do.
    let away = tree.position.xz;
    let far = length(away);
    let view_direction = select(vec2(0.0, -1.0), away / max(far, 1e-6), far > 1e-3);
    let right = vec3(-view_direction.y, 0.0, view_direction.x);
    let facing = facing_planes(tree, view_direction, uprights);
    let first = upright_plane(tree, facing.first, view_direction);
    let second = upright_plane(tree, facing.second, view_direction);
    // One plane of no weight does not widen the quad.
    let first_ends = select(second.ends, first.ends, facing.weight < 1.0);
    let second_ends = select(first.ends, second.ends, facing.weight > 0.0);
    let leftmost = min(min(first_ends.x, first_ends.y), min(second_ends.x, second_ends.y));
    let rightmost = max(max(first_ends.x, first_ends.y), max(second_ends.x, second_ends.y));
    let along = mix(leftmost, rightmost, corner.x);

    let plane_index = select(first.index, uprights, level);
    let plane = cross_variants[tree.variant].planes[plane_index];
    let level_right = rotate(plane.u.xyz, tree.yaw);
    let across = 2.0 * corner - 1.0;
    let on_level = rotate(plane.center.xyz, tree.yaw) + across.x * level_right + across.y * rotate(plane.v.xyz, tree.yaw);
    let upright = right * along + vec3(0.0, plane.center.y + across.y * plane.v.y, 0.0);
    let position = rotated_vertex_position(tree, select(upright, on_level, level));

    // A plane fades out when it is seen edge-on, where its texture is only a streak. The level plane fades in only when seen from
    // above; from the side it would look like a shelf in the crown.
    let normal = select(vec3(view_direction.x, 0.0, view_direction.y), vec3(0.0, 1.0, 0.0), level);
    let toward = abs(dot(normal, normalize(plant_vertex_position(tree, plane.center.xyz).relative)));
    let edge = WHOLE + FADE_SPAN * (1.0 - smoothstep(select(0.10, 0.42, level), select(0.34, 0.72, level), toward));
    let threshold = max(level_threshold(level_distance(packed, tree)), edge);

    var out: Varying;
    out.relative = position.relative;
    out.clip = frame.clip_from_relative * vec4(out.relative, 1.0);
    if threshold >= GONE {
        // No texel would pass the alpha test, so the quad gets no area and no fragments. Its position is inside the
        // view, because clipping costs more than rejection.
        out.clip = vec4(0.0, 0.0, 0.5, 1.0);
    }
    let u = vec2(place_between(first.ends, along), place_between(second.ends, along));
    out.uv = vec3(select(u, corner.xx, level), 1.0 - corner.y);
    let first_layer = cross_variants[tree.variant].first_layer;
    // From behind, the other half of the crown faces the viewer: it is mirrored across the plane.
    let behind = select(0u, FIRST_BEHIND, first.side < 0.0) | select(0u, SECOND_BEHIND, second.side < 0.0);
    let level_behind = LEVEL | select(0u, FIRST_BEHIND, position.relative.y > 0.0);
    out.layers = vec4(first_layer + plane_index, first_layer + second.index, tree.variant, select(behind, level_behind, level));
    let unit_right = level_right.xz / max(length(plane.u.xyz), 1e-6);
    out.axes = vec4(select(first.normal, unit_right, level), second.normal);
    let height = max(variants[tree.variant].height, 0.01);
    out.place = vec3(position.from_foot.y, vec2(position.from_foot.y / max(tree.scale, 1e-6), along) / height);
    let crown = crown_of(tree);
    out.crown_center = crown.center;
    out.crown_inverse_extents = crown.inverse_extents;
    out.look = vec3(threshold, select(facing.weight, 0.0, level), tree.tint);
#ifdef STYLED
    out.identity = vec2(variants[tree.variant].foliage_layer, individual(packed));
#endif
    return out;
}

// The upright planes between whose normals, of front or back, the tree is seen.
struct Facing {
    first: u32,
    second: u32,
    // Fraction of the second, 0..1.
    weight: f32,
}

fn facing_planes(tree: Instance, view_direction: vec2<f32>, uprights: u32) -> Facing {
    let own = rotate(vec3(view_direction.x, 0.0, view_direction.y), tree.yaw * vec2(1.0, -1.0));
    // Normals turn from +Z over +X; half a turn on, a plane is seen from behind.
    let place = fract(atan2(own.x, own.z) / PI) * f32(uprights);
    let first = u32(place) % uprights;
    let weight = smoothstep(0.5 - CHANGE, 0.5 + CHANGE, fract(place));
    return Facing(first, (first + 1u) % uprights, select(0.0, weight, uprights > 1u));
}

// Half of the range in which one plane changes into the next, as a fraction of the angle between them.
const CHANGE: f32 = 0.15;

// The quad is turned all of the way to the viewer: a plane that is seen at an angle shows its leaves as upright streaks. What it shows
// stays as it was baked: its light does not turn with it.
fn upright_plane(tree: Instance, index: u32, view_direction: vec2<f32>) -> Upright {
    let plane = cross_variants[tree.variant].planes[index];
    let normal = rotate(plane.normal.xyz, tree.yaw).xz;
    let side = select(1.0, -1.0, dot(normal, view_direction) > 0.0);
    let width = length(plane.u.xyz);
    let middle = dot(plane.center.xyz, plane.u.xyz) / max(width, 1e-6);
    return Upright(index, normal, side, side * vec2(middle - width, middle + width));
}

// Where `at` is from the first of the ends, 0, to the second, 1.
fn place_between(ends: vec2<f32>, at: f32) -> f32 {
    let size = ends.y - ends.x;
    return (at - ends.x) / select(size, 1e-6, abs(size) < 1e-6);
}

// What is seen at a fragment.
struct Seen {
    color: vec4<f32>,
    uv: vec2<f32>,
    layer: u32,
    mip: f32,
    // 0: nothing; with several samples, in proportion to what is covered.
    coverage: f32,
    // Whether it is the second plane.
    second: bool,
}

// The most waves of the pattern by which one plane changes into another, along a tree's height.
const MOST_WAVES: f32 = 24.0;

// Whether the second plane is seen, clump by clump: a mean of the two textures would show each leaf twice, and both of them more crown than
// there is. Clumps are not smaller than pixels, so that they do not flicker.
fn is_second(place: vec2<f32>, weight: f32) -> bool {
    let pixel = max(fwidth(place.x), fwidth(place.y));
    let waves = exp2(floor(log2(clamp(0.25 / max(pixel, 1e-6), 1.0, MOST_WAVES))));
    let at = place * (2.0 * PI * waves);
    let pattern = sin(at.x + 1.9 * sin(0.61 * at.y)) + sin(1.09 * at.y + 1.7 * sin(0.67 * at.x + 1.0));
    return 0.5 + 0.25 * pattern < weight;
}

fn seen_at(in: Varying) -> Seen {
    let mips = vec2(mip_level(in.uv.xz), mip_level(in.uv.yz));
    var seen: Seen;
    seen.second = is_second(in.place.yz, in.look.y);
    seen.uv = select(in.uv.xz, in.uv.yz, seen.second);
    seen.layer = select(in.layers.x, in.layers.y, seen.second);
    seen.mip = select(mips.x, mips.y, seen.second);
    seen.color = textureSampleLevel(color_textures, texture_sampler, seen.uv, seen.layer, seen.mip);
#ifdef ALPHA_TO_COVERAGE
    seen.coverage = clamp((seen.color.a - in.look.x) / max(fwidth(seen.color.a), 1e-4) + 0.5, 0.0, 1.0);
#else
    seen.coverage = select(0.0, 1.0, seen.color.a >= in.look.x);
#endif
    // Beside its texture a plane is empty.
    seen.coverage = select(0.0, seen.coverage, abs(seen.uv.x - 0.5) <= 0.5);
    return seen;
}

// The texture's right, up and front in world axes, the front towards the viewer.
struct Axes {
    right: vec3<f32>,
    up: vec3<f32>,
    front: vec3<f32>,
}

fn axes_of(in: Varying, second: bool) -> Axes {
    let axis = select(in.axes.xy, in.axes.zw, second);
    let behind = (in.layers.w & select(FIRST_BEHIND, SECOND_BEHIND, second)) != 0u;
    let side = select(1.0, -1.0, behind);
    if (in.layers.w & LEVEL) != 0u {
        return Axes(vec3(axis.x, 0.0, axis.y), vec3(axis.y, 0.0, -axis.x), vec3(0.0, side, 0.0));
    }
    return Axes(vec3(axis.y, 0.0, -axis.x), vec3(0.0, 1.0, 0.0), vec3(side * axis.x, 0.0, side * axis.y));
}

// The sun's light that the leaves of a texel show: the twin of `basis` in src/bake/levels/cross/sun.rs. `sun`: right, zenith, front; there
// are no suns below the horizon.
fn sunlight(texel: vec4<f32>, more: vec4<f32>, sun: vec3<f32>) -> f32 {
    let high = 2.0 * abs(sun.y) - 1.0;
    let basis = vec4(1.0, high, sun.x, sun.z);
    let more_basis = vec4(sun.x * high, sun.z * high, sun.x * sun.z, sun.x * sun.x - sun.z * sun.z);
    return max(SUN_SCALE * (dot(texel, basis) + dot(more, more_basis)), 0.0);
}

// The first or second four coefficients of the sun's light.
fn sun_texel(seen: Seen, half: u32) -> vec4<f32> {
#ifdef SUN_PAIRS
    let layer = 4u * seen.layer + 2u * half;
    let first = textureSampleLevel(sun_textures, texture_sampler, seen.uv, layer, seen.mip).rg;
    let second = textureSampleLevel(sun_textures, texture_sampler, seen.uv, layer + 1u, seen.mip).rg;
    return signed_texel(vec4(first, second));
#else
    return signed_texel(textureSampleLevel(sun_textures, texture_sampler, seen.uv, 2u * seen.layer + half, seen.mip));
#endif
}

#ifdef DEPTH_FIRST
// Depth alone, with the alpha test of the light that follows.
@fragment
fn depth(in: Varying) -> @location(0) vec4<f32> {
    if seen_at(in).coverage <= 0.0 {
        discard;
    }
    return vec4(0.0);
}
#endif

#ifdef STYLED
// The surface alone: the styles light it themselves.
@fragment
fn styled(in: Varying) -> StyledSurface {
    let seen = seen_at(in);
    if seen.coverage <= 0.0 {
        discard;
    }
    let axes = axes_of(in, seen.second);
    let properties = textureSampleLevel(property_textures, texture_sampler, seen.uv, seen.layer, seen.mip);
    let local = decode_octahedral(properties.xy);
    var normal = vec4(normalize(axes.right * local.x + axes.up * local.y + axes.front * local.z), properties.b);
    let foliage = properties.a > 0.5;
#ifndef OWN_NORMALS
    let crown = crown_surface(in.relative, Crown(in.crown_center, in.crown_inverse_extents));
    normal = select(normal, crown, foliage & (variants[in.layers.z].realigned < 0.5));
#endif
    let albedo = mix(seen.color.rgb, tint_foliage(seen.color.rgb, in.look.z), properties.a);
    let identity = vec2(select(WOOD_LAYER, in.identity.x, foliage), in.identity.y);
    return styled_surface(normal.xyz, select(1.0, normal.w, foliage), in.place.x, identity, albedo);
}
#endif

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let variant = in.layers.z;
    let seen = seen_at(in);
    if seen.coverage <= 0.0 {
        discard;
    }
    let axes = axes_of(in, seen.second);
    let texel = seen.color;
    let properties = textureSampleLevel(property_textures, texture_sampler, seen.uv, seen.layer, seen.mip);
    let local = decode_octahedral(properties.xy);
    let normal = normalize(axes.right * local.x + axes.up * local.y + axes.front * local.z);

    let foliage = properties.a;
    var surface: Surface;
    surface.albedo = mix(texel.rgb, tint_foliage(texel.rgb, in.look.z), foliage);
    surface.normal = normal;
    let reflectance = variants[variant].specular_reflectance;
    let ambient_term = variants[variant].ambient_term;
    let published = is_published(ambient_term);
    let transmission = leaf_transmission(texel.rgb, cross_variants[variant].transmission, reflectance) * foliage;
    surface.transmission = transmission * (1.0 - published);
    surface.viewer = -normalize(in.relative);
    surface.isotropic_fraction = isotropic_fraction(variant, seen.mip) * foliage;
    surface.specular_reflectance = reflectance * foliage;
    surface.roughness = variants[variant].roughness;
    surface.lobe_gain = variants[variant].lobe_gain;
    surface.lobe_room = variants[variant].lobe_room;
    surface.gloss_isotropy = max(surface.isotropic_fraction, variants[variant].realigned * (1.0 - published));
    let ground = sample_ground(in.relative);
    let by_transfer = variants[variant].radiance_transfer == 1u;
    let relief = relief_at(in.relative, ground, in.place.x);
    let stand = stand_light(ground.surrounding_cover * variants[variant].cover_weight, 1.0 - in.place.y, relief);
    var visibility = relief.key;
#ifdef TRANSFER
    let light_layer = cross_variants[variant].first_light_layer + seen.layer - cross_variants[variant].first_layer;
    let stored = LIGHT_SCALE * signed_texel(textureSampleLevel(light_textures, texture_sampler, seen.uv, light_layer, seen.mip));
    let side = axes.right * stored.x + axes.up * stored.y + axes.front * stored.z;
    // The second band is not relative to the mean here.
    let open = sky_transfer(stored.w, side);
    let band = side / max(stored.w, 1e-3);
    let around = in_stand_by_transfer(open, vec3(stored.w), mat3x3(band, band, band), stand.hidden_direction, stand);
    var sky = (1.0 + surface.transmission) * around;
#ifdef PLAIN_TOO
    surface.ambient_visibility = with_indirect_ambient(properties.b, ambient_term);
    sky = select(even_sky(surface, stand), sky, by_transfer);
#endif
#else
    surface.ambient_visibility = with_indirect_ambient(properties.b, ambient_term);
    let sky = even_sky(surface, stand);
#endif
    if visibility > 0.0 {
        // The plant's own shade is in the sun textures. What the maps and the stand add is that of other plants, which the
        // light meets before it enters the crown.
        let entry = in.relative + light.key_direction * depth_in_crown(in.relative, Crown(in.crown_center, in.crown_inverse_extents), light.key_direction);
        let cascades = cascaded_visibility(entry, light.key_direction, 0.25, in.clip.xy);
        visibility *= mix(mix(1.0, stand.key_transmittance, foliage), cascades.visibility, cascades.weight);
    }
    let sun = sun_texel(seen, 0u);
    let more_sun = sun_texel(seen, 1u);
    let to_light = light.key_direction;
    let in_plane = vec3(dot(to_light, axes.right), dot(to_light, axes.up), dot(to_light, axes.front));
    var lit = sunlight(sun, more_sun, select(in_plane, in_plane.xzy, (in.layers.w & LEVEL) != 0u));
    // The level plane's texture has its lit side. From below one sees what comes through.
    lit *= select(1.0, dot(surface.transmission, vec3(0.2126, 0.7152, 0.0722)), axes.front.y < -0.5);
    var color = shade_leaves(surface, lit, visibility, sky);
    color = tint_level(color);
    return finish(in.relative, color, seen.coverage);
}

// Fraction of a texel's leaf area with isotropic normals.
fn isotropic_fraction(variant: u32, level: f32) -> f32 {
    let at = clamp(level, 0.0, f32(ISOTROPIC_LEVELS - 1u));
    let finer = u32(at);
    let coarser = min(finer + 1u, ISOTROPIC_LEVELS - 1u);
    let fraction = &cross_variants[variant].isotropic_fraction;
    return mix((*fraction)[finer / 4u][finer % 4u], (*fraction)[coarser / 4u][coarser % 4u], fract(at));
}

// How many mips finer than one whose texels are as large as pixels. There, a bilinear lookup is a mean over two pixels, and a fifth of a crown's
// contrast is lost. One mip finer, it is a mean over one pixel, but crowns shimmer (docs/measurements/levels-of-detail.md).
const SHARPER: f32 = 0.5;

// Mip level of the textures: the mean of the two axes' levels. The larger one, which samplers use, would blur a plane
// seen at an angle along its whole height. The little aliasing that remains affects leaves, whose coverage is right at
// any level.
fn mip_level(uv: vec2<f32>) -> f32 {
    let size = vec2<f32>(textureDimensions(color_textures));
    let dx = dpdx(uv * size);
    let dy = dpdy(uv * size);
    return 0.25 * (log2(max(dot(dx, dx), 1e-8)) + log2(max(dot(dy, dy), 1e-8))) - SHARPER;
}
