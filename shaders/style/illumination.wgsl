// The light on the surfaces that are seen [Luft 2006, 3.2 and 3.3]: the lighting map, and the shadow by the blurred depth test.
#import canopy::frame::{frame, light, shadow}
#import canopy::soft_shadow::soft_visibility
#import canopy::style::{style, full_screen, FullScreen, landscape_depth}
#import canopy::sun_visibility::{sample_ground, terrain_visibility, cascade_weight}
#import canopy::constants::MAX_CASCADES

@group(1) @binding(1) var depths: texture_depth_2d;
@group(1) @binding(2) var surfaces: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

const INVERSE_PI: f32 = 0.318309886;
const LUMINANCE: vec3<f32> = vec3(0.2126, 0.7152, 0.0722);

// Share of the direct light in all light on open ground: without sun there is no shadow to paint.
fn direct_share() -> f32 {
    let key = dot(light.key_illuminance, LUMINANCE) * INVERSE_PI * max(light.key_direction.y, 0.05);
    let sky = max(dot(light.sky[0].rgb, LUMINANCE) * 0.282, 0.0);
    return key / max(key + sky, 1e-12);
}

// The cascade whose map is read at a distance.
fn cascade_of(distance: f32) -> i32 {
    var index = 0;
    for (var i = 0; i < MAX_CASCADES - 1; i += 1) {
        index += i32((i < shadow.cascade_count - 1) & (distance >= 0.95 * shadow.cascades[i].radius));
    }
    return index;
}

// Light of the key light that is left by what casts near it.
fn soft_light(relative: vec3<f32>, normal: vec3<f32>) -> f32 {
    let distance = length(relative);
    let lit = soft_visibility(cascade_of(distance), relative, normal, style.shadow_softness);
    return mix(1.0, lit, cascade_weight(distance));
}

// Light (0..1), pigment of the shadow (0..1), depth (0..1), and the length of the normal.
@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let texel = vec2<i32>(in.clip.xy);
    let depth = textureLoad(depths, texel, 0);
    let ndc = vec2(in.uv.x * 2.0 - 1.0, 1.0 - in.uv.y * 2.0);
    let sky = depth <= 0.0;
    let far = frame.relative_from_clip * vec4(ndc, select(depth, 0.5, sky), 1.0);
    let relative = far.xyz / far.w;
    let direction = normalize(relative);
    // The sky is painted from the horizon to the zenith.
    if sky {
        return vec4(saturate(1.25 * direction.y), 0.0, 1.0, 1.0);
    }
    let stored = textureLoad(surfaces, texel, 0);
    let ambient = max(length(stored.xyz), 1e-4);
    let normal = stored.xyz / ambient;
    let facing = dot(normal, light.key_direction);
    let ground = sample_ground(relative);
    let open = terrain_visibility(ground, stored.w);
    let shade = 1.0 - soft_light(relative, normal) * open;
    let diffuse = 0.5 + 0.5 * facing;
    let lit = diffuse * mix(0.6, 1.0, ambient);
    return vec4(lit, shade * direct_share(), landscape_depth(length(relative)), ambient);
}
