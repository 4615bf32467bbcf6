// Crossed billboards [Franzke 2005, 4.3]: of the upright planes those two that face the viewer best, and the level one; eighteen
// pulled vertices a tree.
#import canopy::octahedral::decode_octahedral
#import canopy::constants::{CROSS_VERTICES, ISOTROPIC_LEVELS, LIGHT_SCALE, SUN_SCALE, WHOLE, FADE_SPAN, GONE}
#import canopy::cross_variant::cross_variants
#import canopy::frame::{frame, light}
#import canopy::instance::{Instance, view, trees, visible, variants, unpack_tree, rotate, plant_vertex_position, rotated_vertex_position, level_distance, level_threshold, tint_foliage, tint_level, with_indirect_ambient, is_published, Crown, crown_of, depth_in_crown}
#import canopy::lighting::{Surface, shade_leaves, even_sky, leaf_transmission}
#import canopy::output::finish
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
// How much of the sun's light the leaves show, two layers a plane: src/bake/levels/cross/sun.rs.
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
    @location(1) uv: vec2<f32>,
    // Layer of the textures, and the variant.
    @location(2) @interpolate(flat) layer: vec2<u32>,
    // The texture's right, up and front in world axes, the front towards the viewer.
    @location(3) @interpolate(flat) right: vec3<f32>,
    @location(4) @interpolate(flat) up: vec3<f32>,
    @location(7) @interpolate(flat) front: vec3<f32>,
    // A packed `Look`.
    @location(5) look: vec4<f32>,
    // A `Crown`.
    @location(6) @interpolate(flat) crown_center: vec3<f32>,
    @location(8) @interpolate(flat) crown_inverse_extents: vec2<f32>,
    // The functions of the sun textures at the key light's direction, times their scale.
    @location(9) @interpolate(flat) sun_basis: vec4<f32>,
    @location(10) @interpolate(flat) more_sun_basis: vec4<f32>,
#ifdef STYLED
    // Layer, and a number of the tree.
    @location(11) @interpolate(flat) identity: vec2<u32>,
#endif
}

struct Look {
    // Of the alpha test.
    threshold: f32,
    // Above the foot, metres.
    height: f32,
    // In the crown: 0 at the foot, 1 at the top.
    relative_height: f32,
    tint: f32,
}

// Packed: four numbers are interpolated at the cost of one.
fn pack_look(look: Look) -> vec4<f32> {
    return vec4(look.threshold, look.height, look.relative_height, look.tint);
}

fn unpack_look(packed: vec4<f32>) -> Look {
    return Look(packed.x, packed.y, packed.z, packed.w);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    var corners = array<vec2<f32>, 6>(
        vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0),
    );
    let packed = trees[visible[index / CROSS_VERTICES]];
    let tree = unpack_tree(packed);
    let slot = (index % CROSS_VERTICES) / 6u;
    let corner = corners[index % 6u];
    let uprights = max(cross_variants[tree.variant].uprights, 1u);
    let level = slot == 2u;
    let plane_index = select(facing(tree, slot, uprights), uprights, level);
    let plane = cross_variants[tree.variant].planes[plane_index];
    let height = max(variants[tree.variant].height * tree.scale, 0.01);

    let center = plant_vertex_position(tree, plane.center.xyz).relative;
    let normal = rotate(plane.normal.xyz, tree.yaw);
    let toward = dot(normal, normalize(center));
    // A plane fades out when it is seen edge-on, where its texture is only a streak. The horizontal plane fades in only
    // when seen from above; from the side it would look like a shelf in the crown.
    let edge = WHOLE + FADE_SPAN * (1.0 - smoothstep(select(0.10, 0.42, level), select(0.34, 0.72, level), abs(toward)));
    let turned = turn(rotate(plane.u.xyz, tree.yaw), normal, center.xz, level, uprights);
    let single = select(WHOLE, GONE, (slot == 1u) & (uprights == 1u));
    let threshold = max(max(single, level_threshold(level_distance(packed, tree))), max(edge, turned.threshold));

    var out: Varying;
    let from_center = corner.x * turned.u + corner.y * rotate(plane.v.xyz, tree.yaw);
    let position = rotated_vertex_position(tree, rotate(plane.center.xyz, tree.yaw) + from_center);
    out.relative = position.relative;
    out.clip = frame.clip_from_relative * vec4(out.relative, 1.0);
    if threshold >= GONE {
        // No texel would pass the alpha test, so the plane gets no area and no fragments. Its position is inside the
        // view, because clipping costs more than rejection.
        out.clip = vec4(0.0, 0.0, 0.5, 1.0);
    }
    out.uv = vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y);
    out.layer = vec2(cross_variants[tree.variant].first_layer + plane_index, tree.variant);
    out.right = rotate(plane.u.xyz, tree.yaw) / max(length(plane.u.xyz), 1e-6);
    out.up = rotate(plane.v.xyz, tree.yaw) / max(length(plane.v.xyz), 1e-6);
    // From behind, the other half of the crown faces the viewer: it is mirrored across the plane.
    out.front = normal * select(1.0, -1.0, toward > 0.0);
    out.look = pack_look(Look(threshold, position.from_foot.y, position.from_foot.y / height, tree.tint));
    let crown = crown_of(tree);
    out.crown_center = crown.center;
    out.crown_inverse_extents = crown.inverse_extents;
    let to_light = light.key_direction;
    let sun = vec3(dot(to_light, out.right), dot(to_light, out.up), dot(to_light, out.front));
    set_sun_basis(select(sun, sun.xzy, level), &out);
#ifdef STYLED
    out.identity = vec2(variants[tree.variant].foliage_layer, individual(trees[visible[index / CROSS_VERTICES]]));
#endif
    return out;
}

// How far an upright plane turns towards the viewer, as a fraction of the way.
const TURN: f32 = 0.85;

struct Turned {
    // The plane's axis across, world axes, metres at scale 1.
    u: vec3<f32>,
    // Of the alpha test.
    threshold: f32,
}

// The upright plane of `slot` 0 or 1: the two between whose normals, of front or back, the tree is seen.
fn facing(tree: Instance, slot: u32, uprights: u32) -> u32 {
    // The tree's foot in its own axes, from the viewer; of a viewer right above, any direction.
    let foot = rotate(plant_vertex_position(tree, vec3(0.0)).relative, tree.yaw * vec2(1.0, -1.0));
    let above = max(abs(foot.x), abs(foot.z)) < 1e-6;
    // Normals turn from +Z over +X; half a turn on, a plane is seen from behind.
    let azimuth = select(atan2(foot.x, foot.z), 0.0, above) / PI;
    return (u32(fract(azimuth) * f32(uprights)) + slot) % uprights;
}

// Turns an upright plane about its middle towards the viewer. A plane that is seen at an angle shows its leaves as upright
// streaks. So the one that the viewer is in front of is drawn, and around the middle between two, both. What they show stays as it was
// baked: its light does not turn with it. `center`: from the viewer to the plane's middle, on the ground.
fn turn(u: vec3<f32>, normal: vec3<f32>, center: vec2<f32>, level: bool, uprights: u32) -> Turned {
    let far = length(center);
    if level || far < 1e-3 {
        return Turned(u, WHOLE);
    }
    let view = center / far;
    let toward = dot(normal.xz, view);
    let front = normal.xz * select(-1.0, 1.0, toward > 0.0);
    // Not all of the way: two planes that face the viewer would lie in each other.
    let wanted = normalize(mix(front, view, TURN));
    let rotation = vec2(dot(front, wanted), front.x * wanted.y - front.y * wanted.x);
    let across = vec2(u.x * rotation.x - u.z * rotation.y, u.x * rotation.y + u.z * rotation.x);
    // Half of the angle between two planes.
    let middle = 0.5 * PI / f32(uprights);
    let seen = smoothstep(cos(1.21 * middle), cos(0.98 * middle), abs(toward));
    return Turned(vec3(across.x, u.y, across.y), WHOLE + FADE_SPAN * (1.0 - seen));
}

// The twin of `basis` in src/bake/levels/cross/sun.rs. `sun`: right, zenith, front; there are no suns below the horizon.
fn set_sun_basis(sun: vec3<f32>, out: ptr<function, Varying>) {
    let high = 2.0 * abs(sun.y) - 1.0;
    (*out).sun_basis = SUN_SCALE * vec4(1.0, high, sun.x, sun.z);
    (*out).more_sun_basis = SUN_SCALE * vec4(sun.x * high, sun.z * high, sun.x * sun.z, sun.x * sun.x - sun.z * sun.z);
}

#ifdef DEPTH_FIRST
// Depth alone, with the alpha test of the light that follows.
@fragment
fn depth(in: Varying) -> @location(0) vec4<f32> {
    let texel = textureSampleLevel(color_textures, texture_sampler, in.uv, in.layer.x, mip_level(in.uv));
    if texel.a < unpack_look(in.look).threshold {
        discard;
    }
    return vec4(0.0);
}
#endif

#ifdef STYLED
// The surface alone: the styles light it themselves.
@fragment
fn styled(in: Varying) -> StyledSurface {
    let look = unpack_look(in.look);
    let level = mip_level(in.uv);
    let texel = textureSampleLevel(color_textures, texture_sampler, in.uv, in.layer.x, level);
    if texel.a < look.threshold {
        discard;
    }
    let properties = textureSampleLevel(property_textures, texture_sampler, in.uv, in.layer.x, level);
    let local = decode_octahedral(properties.xy);
    var normal = vec4(normalize(in.right * local.x + in.up * local.y + in.front * local.z), properties.b);
    let foliage = properties.a > 0.5;
#ifndef OWN_NORMALS
    let crown = crown_surface(in.relative, Crown(in.crown_center, in.crown_inverse_extents));
    normal = select(normal, crown, foliage & (variants[in.layer.y].realigned < 0.5));
#endif
    let albedo = mix(texel.rgb, tint_foliage(texel.rgb, look.tint), properties.a);
    let identity = vec2(select(WOOD_LAYER, in.identity.x, foliage), in.identity.y);
    return styled_surface(normal.xyz, select(1.0, normal.w, foliage), look.height, identity, albedo);
}
#endif

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let look = unpack_look(in.look);
    let variant = in.layer.y;
    let level = mip_level(in.uv);
    let texel = textureSampleLevel(color_textures, texture_sampler, in.uv, in.layer.x, level);
    var coverage = 1.0;
#ifdef ALPHA_TO_COVERAGE
    coverage = clamp((texel.a - look.threshold) / max(fwidth(texel.a), 1e-4) + 0.5, 0.0, 1.0);
    if coverage <= 0.0 {
        discard;
    }
#else
    if texel.a < look.threshold {
        discard;
    }
#endif
    let properties = textureSampleLevel(property_textures, texture_sampler, in.uv, in.layer.x, level);
    let local = decode_octahedral(properties.xy);
    let normal = normalize(in.right * local.x + in.up * local.y + in.front * local.z);

    let foliage = properties.a;
    var surface: Surface;
    surface.albedo = mix(texel.rgb, tint_foliage(texel.rgb, look.tint), foliage);
    surface.normal = normal;
    let reflectance = variants[variant].specular_reflectance;
    let ambient_term = variants[variant].ambient_term;
    let published = is_published(ambient_term);
    let transmission = leaf_transmission(texel.rgb, cross_variants[variant].transmission, reflectance) * foliage;
    surface.transmission = transmission * (1.0 - published);
    surface.viewer = -normalize(in.relative);
    surface.isotropic_fraction = isotropic_fraction(variant, level) * foliage;
    surface.specular_reflectance = reflectance * foliage;
    surface.roughness = variants[variant].roughness;
    surface.lobe_gain = variants[variant].lobe_gain;
    surface.lobe_room = variants[variant].lobe_room;
    surface.gloss_isotropy = max(surface.isotropic_fraction, variants[variant].realigned * (1.0 - published));
    let ground = sample_ground(in.relative);
    let by_transfer = variants[variant].radiance_transfer == 1u;
    let relief = relief_at(in.relative, ground, look.height);
    let stand = stand_light(ground.surrounding_cover * variants[variant].cover_weight, 1.0 - look.relative_height, relief);
    var visibility = relief.key;
#ifdef TRANSFER
    let light_layer = cross_variants[variant].first_light_layer + in.layer.x - cross_variants[variant].first_layer;
    let stored = textureSampleLevel(light_textures, texture_sampler, in.uv, light_layer, level) * LIGHT_SCALE;
    let side = in.right * stored.x + in.up * stored.y + in.front * stored.z;
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
    let sun_layer = 2u * in.layer.x;
    let sun = textureSampleLevel(sun_textures, texture_sampler, in.uv, sun_layer, level);
    let more_sun = textureSampleLevel(sun_textures, texture_sampler, in.uv, sun_layer + 1u, level);
    var lit = max(dot(sun, in.sun_basis) + dot(more_sun, in.more_sun_basis), 0.0);
    // The level plane's texture has its lit side. From below one sees what comes through.
    lit *= select(1.0, dot(surface.transmission, vec3(0.2126, 0.7152, 0.0722)), in.front.y < -0.5);
    var color = shade_leaves(surface, lit, visibility, sky);
    color = tint_level(color);
    return finish(in.relative, color, coverage);
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
