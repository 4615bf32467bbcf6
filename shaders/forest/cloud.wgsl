// Planes of billboard clouds [Franzke 2005, 4.3]: six pulled vertices a plane, an instance a tree.
#import canopy::octahedral::decode_octahedral
#import canopy::cloud_plane::{CloudVariant, planes, plane_corner, plane_uv}
#import canopy::constants::{ISOTROPIC_LEVELS, LIGHT_SCALE, AMBIENT_FITTED, WHOLE, FADE_SPAN, GONE}
#import canopy::frame::{frame, light}
#import canopy::instance::{trees, visible, variants, unpack_tree, rotate, plant_vertex_position, level_distance, level_threshold, tint_foliage, tint_level, with_indirect_ambient, is_published, leaf_visibility}
#import canopy::lighting::{Surface, shade, even_sky, leaf_transmission}
#import canopy::output::finish
#import canopy::signed_texel::signed_texel
#import canopy::sky::sky_transfer
#import canopy::stand::{stand_light, in_stand_by_transfer, evaluate_two_bands}
#import canopy::sun_visibility::{sample_ground, relief_at, cascaded_visibility}
#ifdef STYLED
#import canopy::constants::WOOD_LAYER
#import canopy::instance::{Crown, crown_of}
#import canopy::style_surface::{StyledSurface, styled_surface, crown_surface, individual}
#endif

@group(2) @binding(0) var color_textures: texture_2d_array<f32>;
@group(2) @binding(1) var property_textures: texture_2d_array<f32>;
@group(2) @binding(2) var texture_sampler: sampler;
@group(2) @binding(4) var<storage, read> cloud_variants: array<CloudVariant>;
#ifdef TRANSFER
// How the light of the sky reaches the leaves: src/bake/levels/cross/light.rs.
@group(3) @binding(0) var light_textures: texture_2d_array<f32>;
#endif

// As for the leaves of full models (model.wgsl).
const SHADOW_BIAS: f32 = 3.0;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) @interpolate(flat) variant: u32,
    // The texture's right, up and front in world axes, the front towards the viewer.
    @location(3) @interpolate(flat) right: vec3<f32>,
    @location(4) @interpolate(flat) up: vec3<f32>,
    @location(5) @interpolate(flat) front: vec3<f32>,
    // A packed `Look`.
    @location(6) look: vec4<f32>,
#ifdef STYLED
    // A `Crown`.
    @location(7) @interpolate(flat) crown_center: vec3<f32>,
    @location(8) @interpolate(flat) crown_inverse_extents: vec2<f32>,
    // Layer, and a number of the tree.
    @location(9) @interpolate(flat) identity: vec2<u32>,
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
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Varying {
    let packed = trees[visible[instance]];
    let tree = unpack_tree(packed);
    let plane = planes[index / 6u];
    let corner = plane_corner(index);
    let position = plant_vertex_position(tree, plane.center + corner.x * plane.u + corner.y * plane.v);
    let height = max(variants[tree.variant].height * tree.scale, 0.01);
    let normal = rotate(plane.normal, tree.yaw);

    var out: Varying;
    out.relative = position.relative;
    out.clip = frame.clip_from_relative * vec4(out.relative, 1.0);
    out.uv = plane_uv(plane, corner);
    out.variant = tree.variant;
    out.right = rotate(plane.u, tree.yaw) / max(length(plane.u), 1e-6);
    out.up = rotate(plane.v, tree.yaw) / max(length(plane.v), 1e-6);
    // From behind, the other sides of its leaves face the viewer: it is mirrored across the plane.
    let toward = dot(normal, normalize(plant_vertex_position(tree, plane.center).relative));
    out.front = select(normal, -normal, toward > 0.0);
    // A plane fades out when it is seen edge-on, where its leaves are streaks.
    let edge = WHOLE + FADE_SPAN * (1.0 - smoothstep(0.06, 0.22, abs(toward)));
    let threshold = max(level_threshold(level_distance(packed, tree)), edge);
    if threshold >= GONE {
        // No texel would pass the alpha test.
        out.clip = vec4(0.0, 0.0, 0.5, 1.0);
    }
    out.look = pack_look(Look(threshold, position.from_foot.y, position.from_foot.y / height, tree.tint));
#ifdef STYLED
    let crown = crown_of(tree);
    out.crown_center = crown.center;
    out.crown_inverse_extents = crown.inverse_extents;
    out.identity = vec2(variants[tree.variant].foliage_layer, individual(trees[visible[instance]]));
#endif
    return out;
}

#ifdef STYLED
// The surface alone: the styles light it themselves.
@fragment
fn styled(in: Varying) -> StyledSurface {
    let look = unpack_look(in.look);
    let level = mip_level(in.uv);
    let texel = textureSampleLevel(color_textures, texture_sampler, in.uv, in.variant, level);
    if texel.a < look.threshold {
        discard;
    }
    let properties = textureSampleLevel(property_textures, texture_sampler, in.uv, in.variant, level);
    let local = decode_octahedral(properties.xy);
    var normal = vec4(normalize(in.right * local.x + in.up * local.y + in.front * local.z), properties.b);
    let foliage = properties.a > 0.5;
    let realigned = variants[in.variant].realigned > 0.5;
#ifdef OWN_NORMALS
    let away = (dot(normal.xyz, in.relative) > 0.0) & !realigned;
    normal = vec4(select(normal.xyz, -normal.xyz, away), normal.w);
#else
    let crown = crown_surface(in.relative, Crown(in.crown_center, in.crown_inverse_extents));
    normal = select(normal, crown, foliage & !realigned);
#endif
    let albedo = mix(texel.rgb, tint_foliage(texel.rgb, look.tint), properties.a);
    let identity = vec2(select(WOOD_LAYER, in.identity.x, foliage), in.identity.y);
    return styled_surface(normal.xyz, select(1.0, normal.w, foliage), look.height, identity, albedo);
}
#endif

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let look = unpack_look(in.look);
    let variant = in.variant;
    let level = mip_level(in.uv);
    let texel = textureSampleLevel(color_textures, texture_sampler, in.uv, variant, level);
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
    let properties = textureSampleLevel(property_textures, texture_sampler, in.uv, variant, level);
    let local = decode_octahedral(properties.xy);
    let stored_normal = normalize(in.right * local.x + in.up * local.y + in.front * local.z);
    let foliage = properties.a;
    // A leaf has two sides, of which the viewer sees one, also in a plane that is seen at an angle. A realigned normal
    // points out of the crown from any side.
    let behind = (dot(stored_normal, in.relative) > 0.0) & (variants[variant].realigned < 0.5) & (foliage > 0.5);
    let normal = select(stored_normal, -stored_normal, behind);
    var surface: Surface;
    surface.albedo = mix(texel.rgb, tint_foliage(texel.rgb, look.tint), foliage);
    surface.normal = normal;
    let reflectance = variants[variant].specular_reflectance;
    let ambient_term = variants[variant].ambient_term;
    let published = is_published(ambient_term);
    let transmission = leaf_transmission(texel.rgb, cloud_variants[variant].transmission, reflectance) * foliage;
    surface.transmission = transmission * (1.0 - published);
    surface.viewer = -normalize(in.relative);
    // A plane shows leaves as large as they are seen along its normal. Seen at an angle, those that face the viewer are too
    // small and the others too large: their light tends to that of leaves of all directions as a viewer there sees them.
    let along = dot(in.front, surface.viewer);
    let isotropic = mix(isotropic_fraction(variant, level), 1.0, saturate(1.0 - along * along) * (1.0 - variants[variant].realigned));
    surface.isotropic_fraction = isotropic * foliage;
    surface.specular_reflectance = reflectance * foliage;
    surface.roughness = variants[variant].roughness;
    surface.lobe_gain = variants[variant].lobe_gain;
    surface.lobe_room = variants[variant].lobe_room;
    surface.gloss_isotropy = max(surface.isotropic_fraction, variants[variant].realigned * (1.0 - published));
    let ground = sample_ground(in.relative);
    let relief = relief_at(in.relative, ground, look.height);
    let stand = stand_light(ground.surrounding_cover * variants[variant].cover_weight, 1.0 - look.relative_height, relief);
#ifdef TRANSFER
    // The lighting textures have half as many texels along a side.
    let texel_light = textureSampleLevel(light_textures, texture_sampler, in.uv, cloud_variants[variant].light_layer, level - 1.0);
    let stored = LIGHT_SCALE * signed_texel(texel_light);
    let side = in.right * stored.x + in.up * stored.y + in.front * stored.z;
    // The second band is not relative to the mean here.
    let band = side / max(stored.w, 1e-3);
    let open = sky_transfer(stored.w, side);
    let around = in_stand_by_transfer(open, vec3(stored.w), mat3x3(band, band, band), stand.hidden_direction, stand);
    let zenith = variants[variant].indirect_sun_zenith * light.key_direction.y;
    let indirect = evaluate_two_bands(variants[variant].indirect_sun_mean, zenith) * stand.key_transmittance * relief.key;
    let indirect_sun = light.key_illuminance * variants[variant].indirect_sun_color * indirect;
    var sky = (1.0 + surface.transmission) * (around + indirect_sun);
#ifdef PLAIN_TOO
    surface.ambient_visibility = with_indirect_ambient(properties.b, ambient_term);
    sky = select(even_sky(surface, stand), sky, variants[variant].radiance_transfer == 1u);
#endif
#else
    surface.ambient_visibility = with_indirect_ambient(properties.b, ambient_term);
    let sky = even_sky(surface, stand);
#endif
    var visibility = relief.key;
    if visibility > 0.0 {
        let cascades = cascaded_visibility(in.relative, normal, SHADOW_BIAS, in.clip.xy);
        visibility *= mix(1.0, cascades.visibility, cascades.weight);
    }
    let dimmed = select(1.0, leaf_visibility(properties.b), ambient_term == AMBIENT_FITTED);
    visibility *= mix(1.0, dimmed, foliage);
    let color = tint_level(shade(surface, visibility, sky));
    return finish(in.relative, color, coverage);
}

// Fraction of a texel's leaf area with isotropic normals.
fn isotropic_fraction(variant: u32, level: f32) -> f32 {
    let at = clamp(level, 0.0, f32(ISOTROPIC_LEVELS - 1u));
    let finer = u32(at);
    let coarser = min(finer + 1u, ISOTROPIC_LEVELS - 1u);
    let fraction = &cloud_variants[variant].isotropic_fraction;
    return mix((*fraction)[finer / 4u][finer % 4u], (*fraction)[coarser / 4u][coarser % 4u], fract(at));
}

// Mip level of the textures: the mean of the two axes' levels, as for crosses.
fn mip_level(uv: vec2<f32>) -> f32 {
    let size = vec2<f32>(textureDimensions(color_textures));
    let dx = dpdx(uv * size);
    let dy = dpdy(uv * size);
    return 0.25 * (log2(max(dot(dx, dx), 1e-8)) + log2(max(dot(dy, dy), 1e-8)));
}
