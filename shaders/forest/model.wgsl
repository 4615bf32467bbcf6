// The full model of a tree, near the camera.
#import canopy::constants::{NORMAL_STEPS, NORMAL_LEAST_LENGTH, WHOLE, AMBIENT_FITTED}
#import canopy::frame::{frame, light}
#import canopy::instance::{view, trees, visible, variants, unpack_tree, rotate, plant_vertex_position, level_distance, level_threshold, tint_foliage, tint_level, with_indirect_ambient, is_published, leaf_visibility, crown_of, depth_in_crown}
#import canopy::lighting::{Surface, shade, shade_matt, exitant, exitant_matt, transferred_key_light, even_sky, leaf_transmission}
#import canopy::output::finish
#import canopy::stand::{Relief, StandLight, stand_light, trunk_light}
#import canopy::sun_visibility::{sample_ground, relief_at, cascaded_visibility, LeafSample, cascaded_leaf_visibility}

#ifdef LAYERED
#import canopy::lighting::key_light
#import canopy::tissue::{Tissue, tissue_light, tissue_sky}
#endif
#ifdef STYLED
#import canopy::constants::WOOD_LAYER
#import canopy::style_surface::{StyledSurface, styled_surface, crown_surface, individual}
#endif
#ifdef TRANSFER
#import canopy::transfer::{open_light, sides_in_stand, indirect_sun}
#endif

struct Part {
    base_color: vec3<f32>,
    // 1 if normals are realigned: they point out of the crown, whichever side of a leaf is seen; else 0.
    realigned: f32,
    // As in `Surface`.
    transmission: vec3<f32>,
    specular_reflectance: f32,
    roughness: f32,
    // As in `Variant`.
    ambient_term: u32,
    // As in `Surface`.
    lobe_gain: f32,
    lobe_room: f32,
    cover_weight: f32,
    // Of leaves with layers, of the front and of the back: the factors of `Tissue`.
    front_reflected: vec4<f32>,
    front_transmitted: vec4<f32>,
    back_reflected: vec4<f32>,
    back_transmitted: vec4<f32>,
}

@group(2) @binding(0) var color_texture: texture_2d<f32>;
@group(2) @binding(1) var normal_texture: texture_2d<f32>;
@group(2) @binding(2) var part_sampler: sampler;
@group(2) @binding(3) var<uniform> part: Part;
#ifdef LAYERED
@group(2) @binding(4) var back_texture: texture_2d<f32>;
@group(2) @binding(5) var transmission_texture: texture_2d<f32>;
#endif

#ifdef STYLED
@group(2) @binding(6) var strokes_texture: texture_2d<f32>;
#endif

struct Vertex {
    @location(0) position: vec3<f32>,
    // The normal, scaled by the ambient occlusion: src/bake/lighting/implicit/packing.rs.
    @location(1) normal: vec4<f32>,
    @location(2) uv: vec2<f32>,
}

#ifdef FOLIAGE
// Factor on a solid surface's bias. A texel of a map stores only the leaf nearest to the light, and shades all leaves
// behind it, even those that it does not hide: compared with the path tracer, crowns were a tenth to a third too dark.
const SHADOW_BIAS: f32 = 3.0;
#else
const SHADOW_BIAS: f32 = 1.0;
#endif

struct Look {
    ambient_visibility: f32,
    // Above the foot, metres.
    height: f32,
    // In the crown: 0 at the foot, 1 at the top.
    relative_height: f32,
    tint: f32,
}

// Packed: four numbers are interpolated at the cost of one.
fn pack_look(look: Look) -> vec4<f32> {
    return vec4(look.ambient_visibility, look.height, look.relative_height, look.tint);
}

fn unpack_look(packed: vec4<f32>) -> Look {
    return Look(packed.x, packed.y, packed.z, packed.w);
}

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) @interpolate(perspective, centroid) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    // A packed `Look`. It is interpolated at the centroid: extrapolated to the centre of a pixel that the edge of a
    // leaf only touches, it would sparkle.
    @location(3) @interpolate(perspective, centroid) look: vec4<f32>,
    @location(4) threshold: f32,
#ifdef TRANSFER
    // Irradiance of the surroundings over pi on the side of the normal and on the other.
    @location(5) @interpolate(perspective, centroid) front_sky: vec3<f32>,
    @location(6) @interpolate(perspective, centroid) back_sky: vec3<f32>,
#endif
#ifdef SUN_HARMONICS
    // The same of the sun.
    @location(7) @interpolate(perspective, centroid) front_sun: vec3<f32>,
    @location(8) @interpolate(perspective, centroid) back_sun: vec3<f32>,
    // Distance to where the key light enters the crown, metres.
    @location(9) @interpolate(perspective, centroid) entry_distance: f32,
#endif
#ifdef STYLED
    // Layer, and a number of the tree.
    @location(10) @interpolate(flat) identity: vec2<u32>,
#endif
}

// The light in the stand on this part.
fn light_at(cover: f32, depth: f32, relief: Relief) -> StandLight {
#ifdef FOLIAGE
    return stand_light(cover, depth, relief);
#else
    return trunk_light(cover, depth, relief);
#endif
}

@vertex
fn vertex(in: Vertex, @builtin(instance_index) index: u32, @builtin(vertex_index) vertex: u32) -> Varying {
    let packed = trees[visible[index]];
    let tree = unpack_tree(packed);
    let position = plant_vertex_position(tree, in.position);
    var out: Varying;
    out.relative = position.relative;
    out.clip = frame.clip_from_relative * vec4(position.relative, 1.0);
    let stored = in.normal.xyz * ((2.0 * NORMAL_STEPS + 1.0) / NORMAL_STEPS) - 1.0;
    let size = max(length(stored), 1e-6);
    out.normal = rotate(stored / size, tree.yaw);
    let ambient = saturate((size - NORMAL_LEAST_LENGTH) / (1.0 - NORMAL_LEAST_LENGTH));
    out.uv = in.uv;
    let height = max(variants[tree.variant].height * tree.scale, 0.01);
    let look = Look(ambient, position.from_foot.y, position.from_foot.y / height, tree.tint);
    out.look = pack_look(look);
    out.threshold = level_threshold(level_distance(packed, tree));
#ifdef TRANSFER
    let ground = sample_ground(position.relative);
    let relief = relief_at(position.relative, ground, look.height);
    let stand = light_at(ground.surrounding_cover, 1.0 - look.relative_height, relief);
    let to_plant = vec2(tree.yaw.x, -tree.yaw.y);
    let open = open_light(vertex, tree.yaw_code);
    let sky = sides_in_stand(vertex, open.sky, rotate(stand.hidden_direction, to_plant), stand);
    out.front_sky = sky.front;
    out.back_sky = sky.back;
#ifndef SUN_HARMONICS
    let to_light = rotate(light.key_direction, to_plant);
    let indirect = indirect_sun(vertex, to_light) * (stand.key_transmittance * relief.key);
    out.front_sky += indirect;
    out.back_sky += indirect;
#endif
#endif
#ifdef SUN_HARMONICS
    out.front_sun = open.sun.front;
    out.back_sun = open.sun.back;
    out.entry_distance = depth_in_crown(position.relative, crown_of(tree), light.key_direction);
#endif
#ifdef STYLED
    out.identity = vec2(WOOD_LAYER, individual(trees[visible[index]]));
#ifdef FOLIAGE
    out.identity.x = variants[tree.variant].foliage_layer;
#ifndef OWN_NORMALS
    let crown = crown_surface(position.relative, crown_of(tree));
    let realigned = part.realigned > 0.5;
    out.normal = select(crown.xyz, out.normal, realigned);
    out.look.x = select(crown.w, ambient, realigned);
#endif
#endif
#endif
    return out;
}

// Noise in the plant's frame, so that wood dissolves in place.
fn hash(p: vec3<f32>) -> f32 {
    let q = vec3<u32>(vec3<i32>(floor(p)));
    var h = q.x * 0x8da6b343u + q.y * 0xd8163841u + q.z * 0xcb1ab31fu;
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12u)) * 0x297a2d39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

#ifdef NORMAL_MAP
// Tangent-space detail without stored tangents [Schüler 2013, "Normal Mapping Without Precomputed Tangents"].
fn detail_normal(normal: vec3<f32>, relative: vec3<f32>, uv: vec2<f32>) -> vec3<f32> {
    let texel = textureSample(normal_texture, part_sampler, uv).xyz * 2.0 - 1.0;
    let dp1 = dpdx(relative);
    let dp2 = dpdy(relative);
    let duv1 = dpdx(uv);
    let duv2 = dpdy(uv);
    let p2 = cross(dp2, normal);
    let p1 = cross(normal, dp1);
    let t = p2 * duv1.x + p1 * duv2.x;
    // The image's v runs down, the map's green runs up.
    let b = -(p2 * duv1.y + p1 * duv2.y);
    // Both are gradients times this volume, whose sign is that of the visible side, because pixel rows count downwards.
    let volume = dot(normal, cross(dp1, dp2));
    let scale = sign(volume) * inverseSqrt(max(max(dot(t, t), dot(b, b)), 1e-30));
    return normalize(normal * texel.z + (t * texel.x + b * texel.y) * scale);
}
#endif

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let look = unpack_look(in.look);
    let texel = textureSample(color_texture, part_sampler, in.uv);
#ifdef LAYERED
    let back_texel = textureSample(back_texture, part_sampler, in.uv);
    let through_texel = textureSample(transmission_texture, part_sampler, in.uv);
#endif
    let smooth_normal = normalize(in.normal);
    var normal = smooth_normal;
#ifdef NORMAL_MAP
    normal = detail_normal(smooth_normal, in.relative, in.uv);
#endif
    var coverage = 1.0;
#ifdef FOLIAGE
    let across = fwidth(in.uv);
    let alpha = texel.a;
#ifdef ALPHA_TO_COVERAGE
    coverage = clamp((alpha - in.threshold) / max(fwidth(alpha), 1e-4) + 0.5, 0.0, 1.0);
    if coverage <= 0.0 {
        discard;
    }
#else
    if alpha < in.threshold {
        discard;
    }
#endif
    // A leaf has two sides; its own normal is that of the visible side. A realigned normal points out of the crown, and
    // a normal map of the leaf does not apply to it.
    let own_normal = part.realigned < 0.5;
    let behind = own_normal & (dot(smooth_normal, in.relative) > 0.0);
    normal = select(smooth_normal, select(normal, -normal, behind), own_normal);
#else
    let keep = hash(vec3(in.uv * 97.0, look.height * 31.0));
    if WHOLE + (1.0 - WHOLE) * keep < in.threshold - 1e-4 {
        discard;
    }
#endif
    var surface: Surface;
    surface.albedo = texel.rgb * part.base_color;
#ifdef FOLIAGE
    let published = is_published(part.ambient_term);
#ifdef LAYERED
    surface.albedo = select(surface.albedo, back_texel.rgb * part.base_color, behind);
    let transmission = min(through_texel.rgb, max(1.0 - surface.albedo, vec3(0.0))) / max(surface.albedo, vec3(1e-6));
#else
    let transmission = leaf_transmission(surface.albedo, part.transmission, part.specular_reflectance);
#endif
    surface.transmission = transmission * (1.0 - published);
    surface.albedo = tint_foliage(surface.albedo, look.tint);
    surface.viewer = -normalize(in.relative);
    surface.specular_reflectance = part.specular_reflectance;
    surface.roughness = part.roughness;
    surface.lobe_gain = part.lobe_gain;
    surface.lobe_room = part.lobe_room;
    // A pixel that covers half a texture of leaves covers several of them, and each faces elsewhere: highlights of one would
    // sparkle. Normals that point out of the crown are no leaf's at all; as published, the crown has the highlight.
    let isotropy = max(saturate(2.0 * max(across.x, across.y)), part.realigned);
    surface.gloss_isotropy = isotropy * (1.0 - published * part.realigned);
#endif
    surface.normal = normal;
    let ground = sample_ground(in.relative);
    let relief = relief_at(in.relative, ground, look.height);
#ifdef LAYERED
    let tissue = Tissue(
        select(part.front_reflected, part.back_reflected, behind),
        select(part.front_transmitted, part.back_transmitted, behind),
        select(part.back_transmitted, part.front_transmitted, behind),
    );
    let to_viewer = abs(dot(normal, surface.viewer));
    let key_factors = tissue_light(tissue, to_viewer, abs(dot(normal, light.key_direction)));
    let sky_factors = tissue_sky(tissue, to_viewer);
#endif
#ifdef TRANSFER
#ifdef FOLIAGE
    let near_sky = select(in.front_sky, in.back_sky, behind);
    let far_sky = select(in.back_sky, in.front_sky, behind);
#ifdef LAYERED
    let sky = near_sky * sky_factors.x + surface.transmission * far_sky * sky_factors.y;
#else
    let sky = near_sky + surface.transmission * far_sky;
#endif
#else
    let sky = in.front_sky;
#endif
#else
    surface.ambient_visibility = with_indirect_ambient(look.ambient_visibility, part.ambient_term);
    let neighbours = ground.surrounding_cover * part.cover_weight;
    let stand = light_at(neighbours, 1.0 - look.relative_height, relief);
#ifdef LAYERED
    var under_sky = surface;
    under_sky.transmission *= sky_factors.y / max(sky_factors.x, 1e-3);
    let sky = even_sky(under_sky, stand) * sky_factors.x;
#else
    let sky = even_sky(surface, stand);
#endif
#endif
    var visibility = relief.key;
    var lit_side = normal;
#ifdef FOLIAGE
    // A leaf that is lit from behind must not shade itself: its light arrives on the other side.
    lit_side = select(normal, -normal, dot(normal, light.key_direction) < 0.0);
#endif
#ifdef SUN_HARMONICS
    var leaves = LeafSample(1.0, 0.0, 0.0);
#endif
    if visibility > 0.0 {
#ifdef SUN_HARMONICS
        // The plant's own shade is in the harmonics. What the maps add is that of other plants, which the light meets before it
        // enters the crown.
        let entry = in.relative + light.key_direction * in.entry_distance;
        let cascades = cascaded_visibility(entry, light.key_direction, 0.25, in.clip.xy);
#ifdef SUN_DETAIL
        leaves = cascaded_leaf_visibility(in.relative, lit_side, SHADOW_BIAS, in.clip.xy);
        leaves.detail *= visibility;
#endif
#else
        let cascades = cascaded_visibility(in.relative, lit_side, SHADOW_BIAS, in.clip.xy);
#endif
        visibility *= mix(1.0, cascades.visibility, cascades.weight);
    }
#ifdef FOLIAGE
#ifndef TRANSFER
    visibility *= select(1.0, leaf_visibility(look.ambient_visibility), part.ambient_term == AMBIENT_FITTED);
#endif
#endif
#ifdef SUN_HARMONICS
#ifdef FOLIAGE
    let near_sun = select(in.front_sun, in.back_sun, behind);
    let far_sun = select(in.back_sun, in.front_sun, behind);
    var key = transferred_key_light(surface, near_sun, far_sun, visibility, leaves);
#ifdef LAYERED
    key.near *= key_factors.x;
    key.far *= key_factors.y;
#endif
    var color = exitant(surface, key, sky);
#else
    var color = exitant_matt(surface, transferred_key_light(surface, in.front_sun, vec3(0.0), visibility, leaves), sky);
#endif
#else
#ifdef LAYERED
    var key = key_light(surface, visibility);
    key.near *= key_factors.x;
    key.far *= key_factors.y;
    var color = exitant(surface, key, sky);
#else
#ifdef FOLIAGE
    var color = shade(surface, visibility, sky);
#else
    var color = shade_matt(surface, visibility, sky);
#endif
#endif
#endif
    color = tint_level(color);
    return finish(in.relative, color, coverage);
}

#ifdef STYLED
// The surface alone: the styles light it themselves.
@fragment
fn styled(in: Varying) -> StyledSurface {
    let look = unpack_look(in.look);
    let texel = textureSample(color_texture, part_sampler, in.uv);
    var normal = normalize(in.normal);
#ifdef FOLIAGE
    let strokes = textureSample(strokes_texture, part_sampler, in.uv).xy;
    // Strokes vanish where their leaf is seen from its edge.
    let leaf_normal = normalize(cross(dpdx(in.relative), dpdy(in.relative)) + vec3(0.0, 1e-12, 0.0));
    let facing = smoothstep(0.0, 0.5, abs(dot(leaf_normal, normalize(in.relative))));
    if texel.a < in.threshold {
        discard;
    }
#ifdef OWN_NORMALS
    normal = select(normal, -normal, (part.realigned < 0.5) & (dot(normal, in.relative) > 0.0));
#endif
    let albedo = tint_foliage(texel.rgb * part.base_color, look.tint);
    var surface = styled_surface(normal, look.ambient_visibility, look.height, in.identity, albedo);
    surface.identity.z = u32(round(255.0 * facing * strokes.x));
    surface.identity.w = u32(round(255.0 * facing * strokes.y));
    return surface;
#else
    let keep = hash(vec3(in.uv * 97.0, look.height * 31.0));
    if WHOLE + (1.0 - WHOLE) * keep < in.threshold - 1e-4 {
        discard;
    }
    return styled_surface(normal, 1.0, look.height, in.identity, texel.rgb * part.base_color);
#endif
}
#endif
