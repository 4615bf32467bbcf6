// The ground: tiles that morph into each other (src/terrain/tiles), coloured by slope, canopy cover and noise.
#import canopy::octahedral::decode_octahedral_y
#import canopy::constants::{TILE_SIDE, DETAIL_TEXELS, LEAST_DETAIL, MOST_DETAIL}
#import canopy::frame::{frame, light, shadow}
#import canopy::ground_color::{GroundColor, ground_color}
#import canopy::lighting::{LUMINANCE, Surface, shade_matt, even_sky}
#import canopy::output::finish
#import canopy::stand::{Relief, ground_light, stand_light}
#import canopy::sun_visibility::{GroundSample, sample_ground, relief_at, cascaded_visibility}
#ifdef SOFT_SHADOW
#import canopy::sun_visibility::soft_cascaded_visibility
#endif
#ifdef STYLED
#import canopy::constants::{GROUND_LAYER, FIRST_FOLIAGE_LAYER}
#import canopy::ground_noise::noise_band
#import canopy::style_surface::{StyledSurface, styled_surface}
#endif

struct TileVertex {
    // Metres above the datum: own, and in the next coarser mesh.
    height: f32,
    parent_height: f32,
    // Octahedral normals, two snorm16 each.
    normal: u32,
    parent_normal: u32,
}

struct Tile {
    // North-western corner relative to the camera (x, z), metres.
    origin: vec2<f32>,
    spacing: f32,
    // First vertex.
    first: u32,
    morph_start: f32,
    morph_end: f32,
    // Lower bound of the distance from the camera to the ground.
    clearance: f32,
    // Height of the camera above the terrain's datum, metres.
    camera_height: f32,
}

@group(1) @binding(0) var<storage, read> vertices: array<TileVertex>;
@group(1) @binding(1) var<storage, read> tiles: array<Tile>;

#ifdef DRAPE
// A photograph over the ground (src/terrain/drape).
struct Drape {
    // North-western corner relative to the camera (x, z), metres.
    origin: vec2<f32>,
    inverse_size: vec2<f32>,
    // Metres over which it gives way to the ground at its border.
    edge: f32,
    // Metres of a texel.
    texel: f32,
    // Factor from its values to reflectance.
    brightness: f32,
    // 1 where it is mirrored at its borders, else 0.
    mirrored: f32,
}

@group(1) @binding(2) var<uniform> drape: Drape;
@group(1) @binding(3) var drape_texture: texture_2d<f32>;
@group(1) @binding(4) var drape_sampler: sampler;
#endif

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

// Whether a position lies outside of the ground map.
fn is_outside(relative: vec3<f32>) -> bool {
    let uv = (relative.xz - shadow.ground.origin) * shadow.ground.inverse_size;
    return max(max(-uv.x, uv.x - 1.0), max(-uv.y, uv.y - 1.0)) > 0.0;
}

#ifdef FOREST_SURFACE
// How much of the forest at a position is drawn as a surface, 0..1. It is whole before the first trees vanish, which do so up to
// 19 % earlier than their mean (src/lod/level_distance.rs).
fn surface_share(relative: vec3<f32>) -> f32 {
    let begin = frame.forest_surface.x;
    let middle = 0.5 * (begin + frame.forest_surface.y);
    return smoothstep(begin, max(0.84 * middle, begin + 1e-3), length(relative));
}

// How closed the canopy over a position is, 0..1: the surface of a forest lies at its height there, and on the ground in the open.
fn closed_canopy(relative: vec3<f32>) -> f32 {
    let ground = sample_ground(relative);
    let cover = select(ground.cover + ground.undrawn_cover, frame.mean_cover, is_outside(relative));
    return smoothstep(0.1, 0.6, cover);
}
#endif

// Height of a tile's skirt. It covers gaps that are narrower than a pixel.
const SKIRT_PIXELS: f32 = 1.5;

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Varying {
    let tile = tiles[instance];
    // The vertices of the skirt follow those of the tile.
    let in_skirt = index >= TILE_SIDE * TILE_SIDE;
    let at = select(index, index - TILE_SIDE * TILE_SIDE, in_skirt);
    let v = vertices[tile.first + at];
    let grid = vec2(f32(at % TILE_SIDE), f32(at / TILE_SIDE));
    let xz = tile.origin + grid * tile.spacing;
    let distance = max(length(xz), tile.clearance);
    let k = clamp((distance - tile.morph_start) / (tile.morph_end - tile.morph_start), 0.0, 1.0);
    let height = mix(v.height, v.parent_height, k);
    var out: Varying;
    out.relative = vec3(xz.x, height - tile.camera_height, xz.y);
#ifdef FOREST_SURFACE
    out.relative.y += frame.forest_surface.z * closed_canopy(out.relative) * surface_share(out.relative);
#endif
    out.relative.y -= select(0.0, SKIRT_PIXELS * length(out.relative) / frame.focal_length_pixels, in_skirt);
    out.clip = frame.clip_from_relative * vec4(out.relative, 1.0);
    out.normal = mix(decode_octahedral_y(v.normal), decode_octahedral_y(v.parent_normal), k);
    return out;
}

// Mean depth in the canopy of what is seen of it from above, 0..1.
const CROWN_DEPTH: f32 = 0.1;

// What is seen of the ground at a fragment.
struct Seen {
    // Its normal without noise.
    normal: vec3<f32>,
    ground: GroundSample,
    // Whether it lies outside of the ground map.
    outside: bool,
    // Fractions of the canopy cover: all of it, that of trees that are not drawn, and the latter's share of the former.
    cover: f32,
    undrawn: f32,
    far: f32,
    color: GroundColor,
}

// A pixel on the ground. Seen at a flat angle it is long and narrow: one lookup as wide as it is long would smear what lies side
// by side.
struct GroundPixel {
    // Its width and its length, metres.
    across: f32,
    along: f32,
    // Unit vector along it (x, z).
    direction: vec2<f32>,
}

// `flattest` is the sine of the least angle at which its length still grows.
fn ground_pixel(relative: vec3<f32>, normal: vec3<f32>, flattest: f32) -> GroundPixel {
    let distance = max(length(relative), 1e-3);
    let across = distance / frame.focal_length_pixels;
    let along = across / max(abs(dot(normal, relative)) / distance, flattest);
    return GroundPixel(across, along, relative.xz / max(length(relative.xz), 1e-3));
}

// The most places along a pixel on the ground at which its colour is looked up.
const MOST_PLACES: f32 = 2.0;

// The colour of the ground in a pixel.
fn color_of_pixel(in: Varying, normal: vec3<f32>, cover: f32, far: f32) -> GroundColor {
    let pixel = ground_pixel(in.relative, normal, 0.05);
    let places = clamp(ceil(0.7 * pixel.along / pixel.across), 1.0, MOST_PLACES);
    let footprint = max(pixel.across, pixel.along / places);
    let stride = pixel.direction * (pixel.along / places);
    let first = frame.camera.xz + in.relative.xz - 0.5 * (places - 1.0) * stride;
    var sum = GroundColor(vec3(0.0), vec2(0.0), 0.0);
    for (var place = 0.0; place < places; place += 1.0) {
        let color = ground_color(first + place * stride, 1.0 - normal.y, cover, far, footprint);
        sum.albedo += color.albedo;
        sum.tilt += color.tilt;
        sum.ambient_visibility += color.ambient_visibility;
    }
    return GroundColor(sum.albedo / places, sum.tilt / places, sum.ambient_visibility / places);
}

#ifdef DRAPE
// The most places along a pixel at which a photograph is looked up.
const MOST_LOOKUPS: f32 = 6.0;

// The albedo under a photograph, where `own` is that of the ground without it. What the photograph is too coarse for, it has
// from the ground's own colour. The twin is Soil::albedo in src/reference/soil.rs.
fn draped(in: Varying, normal: vec3<f32>, cover: f32, far: f32, own: vec3<f32>) -> vec3<f32> {
    let uv = (in.relative.xz - drape.origin) * drape.inverse_size;
    let pixel = ground_pixel(in.relative, normal, 0.02);
    let places = clamp(ceil(pixel.along / pixel.across), 1.0, MOST_LOOKUPS);
    let lod = log2(max(max(pixel.across, pixel.along / places) / drape.texel, 1.0));
    let stride = pixel.direction * (pixel.along / places) * drape.inverse_size;
    let first = uv - 0.5 * (places - 1.0) * stride;
    // Colour times opacity, and opacity.
    var photo = vec4(0.0);
    for (var place = 0.0; place < places; place += 1.0) {
        photo += textureSampleLevel(drape_texture, drape_sampler, first + place * stride, lod);
    }
    photo /= places;
    let to_border = min(uv, 1.0 - uv) / drape.inverse_size;
    let inside = max(smoothstep(0.0, max(drape.edge, 1e-6), min(to_border.x, to_border.y)), drape.mirrored);
    let shown = photo * inside;

    var detail = 1.0;
    if pixel.across < DETAIL_TEXELS * drape.texel {
        let place = frame.camera.xz + in.relative.xz;
        let mean = ground_color(place, 1.0 - normal.y, cover, far, DETAIL_TEXELS * drape.texel).albedo;
        detail = clamp(dot(own, LUMINANCE) / max(dot(mean, LUMINANCE), 1e-4), LEAST_DETAIL, MOST_DETAIL);
    }
    return clamp(own * (1.0 - shown.a) + shown.rgb * (drape.brightness * detail), vec3(0.0), vec3(1.0));
}
#endif

fn seen_at(in: Varying) -> Seen {
    let normal = normalize(in.normal);
    let ground = sample_ground(in.relative);
    let outside = is_outside(in.relative);
    // Forest too far away for its trees to be drawn is coloured as crowns.
    let beyond = select(ground.undrawn_cover, frame.mean_cover, outside);
    let planted = select(ground.cover, 0.0, outside);
    var undrawn = beyond;
#ifdef FOREST_SURFACE
    undrawn += planted * surface_share(in.relative);
#endif
    let cover = beyond + planted;
    let far = undrawn / max(cover, 1e-3);
    var color = color_of_pixel(in, normal, cover, far);
#ifdef DRAPE
    color.albedo = draped(in, normal, cover, far, color.albedo);
#endif
    return Seen(normal, ground, outside, cover, undrawn, far, color);
}

// Relief that leaves level ground at least half of the light: in a low sun its slopes would be black blots, as nothing that
// small shades the ground between them.
fn limited_tilt(tilt: vec2<f32>) -> vec2<f32> {
    let sun = light.key_direction;
    let most = 0.5 * max(sun.y, 0.0) / max(length(sun.xz), 1e-3);
    return tilt * min(1.0, most / max(length(tilt), 1e-4));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let seen = seen_at(in);
    var surface: Surface;
    surface.albedo = seen.color.albedo;
    let tilt = limited_tilt(seen.color.tilt);
    surface.normal = normalize(seen.normal + vec3(tilt.x, 0.0, tilt.y));
    surface.transmission = vec3(0.0);
    // What is seen as crowns is lit as their tops are.
    surface.ambient_visibility = mix(seen.color.ambient_visibility, 0.85, seen.far);
    let shade_cover = select(seen.ground.surrounding_cover, 0.0, seen.outside);

    let within = relief_at(in.relative, seen.ground, 0.0);
    let key = select(within.key, 1.0, seen.outside);
    let relief = Relief(within.hidden, within.level_fraction, within.direction, key, within.slope_factor);
    let stand = ground_light(shade_cover, relief);
    var visibility = relief.key;
    if visibility > 0.0 {
#ifdef SOFT_SHADOW
        let cascades = soft_cascaded_visibility(in.relative, seen.normal, in.clip.xy);
#else
        let cascades = cascaded_visibility(in.relative, seen.normal, 1.0, in.clip.xy);
#endif
        // Beyond the maps: the fraction of light that passes between the crowns.
        let passed = mix(stand.key_transmittance, cascades.visibility, cascades.weight);
        // A canopy is rough: in low light its crowns shade each other near their tops, as those of drawn trees do.
        visibility *= mix(passed, stand_light(seen.cover, CROWN_DEPTH, relief).key_transmittance, seen.far);
    }
    return finish(in.relative, shade_matt(surface, visibility, even_sky(surface, stand)), 1.0);
}

#ifdef STYLED
// What of a forest's surface makes it look like the trees that end here: mean ambient visibility of what is seen of crowns, and the slope
// of their relief.
const CROWN_VISIBILITY: f32 = 0.2;
const CROWN_SLOPE: f32 = 0.6;

// The surface alone: the styles light it themselves. Forest whose trees are not drawn is of the layers of their foliage.
@fragment
fn styled(in: Varying) -> StyledSurface {
    let seen = seen_at(in);
    if (seen.far <= 0.5) | (seen.undrawn <= 0.3) {
        return styled_surface(seen.normal, 1.0, 0.0, vec2(GROUND_LAYER, 128u), seen.color.albedo);
    }
    // Octaves of 8 to 32 m. Crowns are upright: they are as wide in the picture at whatever angle the ground is seen.
    let across = length(in.relative) / frame.focal_length_pixels;
    let band = noise_band(frame.camera.xz + in.relative.xz, 5, 3, across);
    let crowns = band.value * inverseSqrt(max(1.0 - band.lost, 1e-2));
    // Evenly distributed: the logistic function is near the integral of a normal distribution.
    let even = 1.0 / (1.0 + exp(-1.7 * crowns));
    let layer = FIRST_FOLIAGE_LAYER + u32(even.y > frame.crown_layers.x) + u32(even.y > frame.crown_layers.y) + u32(even.y > frame.crown_layers.z);
    let normal = seen.normal + CROWN_SLOPE * vec3(crowns.x, 0.0, crowns.y);
    return styled_surface(normal, CROWN_VISIBILITY, 0.0, vec2(layer, u32(255.0 * even.x)), seen.color.albedo);
}
#endif
