// The ground: tiles that morph into each other (src/terrain/tiles), coloured by slope, height, canopy cover and noise.
#import canopy::constants::TILE_SIDE
#import canopy::frame::{frame, light, shadow}
#import canopy::lighting::{Surface, shade_matt, even_sky}
#import canopy::output::finish
#import canopy::stand::ground_light
#import canopy::sun_visibility::{sample_ground, terrain_visibility, cascaded_visibility}

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
@group(1) @binding(2) var noise_texture: texture_2d<f32>;
@group(1) @binding(3) var noise_sampler: sampler;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

fn decode_octahedral(packed: u32) -> vec3<f32> {
    let e = unpack2x16snorm(packed);
    var n = vec3(e.x, 1.0 - abs(e.x) - abs(e.y), e.y);
    let t = max(-n.y, 0.0);
    n.x += select(t, -t, n.x >= 0.0);
    n.z += select(t, -t, n.z >= 0.0);
    return normalize(n);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Varying {
    let tile = tiles[instance];
    let v = vertices[tile.first + index];
    let grid = vec2(f32(index % TILE_SIDE), f32(index / TILE_SIDE));
    let xz = tile.origin + grid * tile.spacing;
    let distance = max(length(xz), tile.clearance);
    let k = clamp((distance - tile.morph_start) / (tile.morph_end - tile.morph_start), 0.0, 1.0);
    let height = mix(v.height, v.parent_height, k);
    var out: Varying;
    out.relative = vec3(xz.x, height - tile.camera_height, xz.y);
    out.clip = frame.clip_from_relative * vec4(out.relative, 1.0);
    out.normal = mix(decode_octahedral(v.normal), decode_octahedral(v.parent_normal), k);
    return out;
}

// Noise of a period that divides the 1024 metres of `frame.camera`: r smooth, g fine, b patchy, a ridged; each 0..1
// around 0.5.
fn noise(xz: vec2<f32>, period: f32) -> vec4<f32> {
    return textureSample(noise_texture, noise_sampler, xz / period);
}

// The same, rotated by the angle of a 3-4-5 triangle: periods of 1024 * 3 / (5 k) and 1024 * 4 / (5 k) metres keep it
// seamless. Mixed with the other, it hides the repetition of both.
fn rotated_noise(xz: vec2<f32>, period: f32) -> vec4<f32> {
    return noise(vec2(0.6 * xz.x - 0.8 * xz.y, 0.8 * xz.x + 0.6 * xz.y), period);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let smooth_normal = normalize(in.normal);
    let xz = frame.camera.xz + in.relative.xz;
    let distance = length(in.relative);
    let wide = noise(xz, 512.0);
    let middle = 0.5 + 0.72 * (noise(xz, 64.0) + rotated_noise(xz, 51.2) - 1.0);
    let fine = 0.5 + 0.72 * (noise(xz, 8.0) + rotated_noise(xz, 12.8) - 1.0);
    let grain = 0.5 + 0.72 * (noise(xz, 2.0) + rotated_noise(xz, 3.2) - 1.0);

    let ground = sample_ground(in.relative);
    let uv = (in.relative.xz - shadow.ground.origin) * shadow.ground.inverse_size;
    let outside = max(max(-uv.x, uv.x - 1.0), max(-uv.y, uv.y - 1.0)) > 0.0;
    var cover = ground.cover;
    if outside {
        cover = frame.mean_cover;
    }

    // Detail in the normal, faded out where it is too small to see.
    let detail = 1.0 - smoothstep(20.0, 120.0, distance);
    let tilt = vec2(fine.r - fine.a, fine.g - fine.b) * 0.25 + vec2(grain.r - grain.g, grain.b - grain.a) * 0.35;
    let normal = normalize(smooth_normal + vec3(tilt.x, 0.0, tilt.y) * detail);

    let steepness = 1.0 - smooth_normal.y;
    let litter = mix(vec3(0.050, 0.040, 0.022), vec3(0.100, 0.078, 0.042), clamp(fine.g * 1.4 - 0.2 + grain.g - 0.5, 0.0, 1.0));
    let moss = mix(vec3(0.030, 0.048, 0.014), vec3(0.055, 0.080, 0.022), grain.b);
    let floor_mix = smoothstep(0.45, 0.62, middle.b * 0.6 + fine.b * 0.4);
    let forest_floor = mix(litter, moss, floor_mix * 0.75);
    let lush = mix(vec3(0.050, 0.085, 0.020), vec3(0.095, 0.135, 0.035), fine.g);
    let dry = mix(vec3(0.120, 0.115, 0.045), vec3(0.175, 0.155, 0.070), grain.g);
    let meadow = mix(lush, dry, smoothstep(0.42, 0.68, wide.r * 0.5 + middle.r * 0.5)) * (0.8 + 0.4 * grain.r);
    let rock = mix(vec3(0.13, 0.12, 0.105), vec3(0.26, 0.245, 0.22), fine.a * 0.6 + grain.a * 0.4);

    let wooded = smoothstep(0.10, 0.45, cover + (middle.g - 0.5) * 0.25);
    var albedo = mix(meadow, forest_floor, wooded);
    // Forest too far away for its trees to be drawn is coloured as crowns.
    if outside {
        let crowns = mix(vec3(0.028, 0.045, 0.013), vec3(0.050, 0.072, 0.022), middle.g);
        albedo = mix(albedo, crowns, wooded);
    }
    let stony = smoothstep(0.30, 0.42, steepness + (middle.a - 0.5) * 0.15 + (fine.a - 0.5) * 0.08);
    albedo = mix(albedo, rock, stony);
    albedo *= 0.85 + 0.3 * middle.r;

    var surface: Surface;
    surface.albedo = albedo;
    surface.normal = normal;
    surface.transmission = vec3(0.0);
    surface.ambient_visibility = 0.8 + 0.2 * grain.r;
    var shade_cover = ground.surrounding_cover;
    if outside {
        surface.ambient_visibility = 0.85;
        shade_cover = 0.0;
    }

    let stand = ground_light(shade_cover);
    var visibility = select(terrain_visibility(ground, 0.0), 1.0, outside);
    if visibility > 0.0 {
        let cascades = cascaded_visibility(in.relative, smooth_normal, 1.0, in.clip.xy);
        // Beyond the maps: the fraction of light that passes between the crowns.
        visibility *= mix(stand.key_transmittance, cascades.visibility, cascades.weight);
    }
    let color = shade_matt(surface, visibility, even_sky(surface, stand));
    return finish(in.relative, color, 1.0);
}
