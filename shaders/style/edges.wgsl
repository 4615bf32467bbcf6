// Contours: discontinuities of depth and normal [Saito & Takahashi 1990; Luft 2007, section 4].
#define_import_path canopy::style_edges

#import canopy::frame::{frame, relative_position}
#import canopy::style::{style, NEAREST, FARTHEST}

// Least steps in depth that are drawn, metres.
const LEAF_STEP: f32 = 2.0;
const CROWN_STEP: f32 = 0.4;

// How strongly the maps change around `uv` within `reach` texels, 0..1: `normals` (scaled by the ambient visibility, which
// suppresses what is inside a crown) and `light`, whose third channel is the depth.
fn contour(normals: texture_2d<f32>, lights: texture_2d<f32>, linear_sampler: sampler, uv: vec2<f32>, reach: f32) -> f32 {
    // As wide as the Gaussian: over less, what it has smoothed hardly differs, and lines would break up.
    let span = max(max(reach, style.softness), 0.3);
    let dx = vec2(span, 0.0) / style.map_size;
    let dy = vec2(0.0, span) / style.map_size;
    let n0 = direction(textureSampleLevel(normals, linear_sampler, uv - dx, 0.0).xyz);
    let n1 = direction(textureSampleLevel(normals, linear_sampler, uv + dx, 0.0).xyz);
    let n2 = direction(textureSampleLevel(normals, linear_sampler, uv - dy, 0.0).xyz);
    let n3 = direction(textureSampleLevel(normals, linear_sampler, uv + dy, 0.0).xyz);
    let bend = length(n1 - n0) + length(n3 - n2);
    let z = textureSampleLevel(lights, linear_sampler, uv, 0.0).z;
    let z0 = textureSampleLevel(lights, linear_sampler, uv - dx, 0.0).z;
    let z1 = textureSampleLevel(lights, linear_sampler, uv + dx, 0.0).z;
    let z2 = textureSampleLevel(lights, linear_sampler, uv - dy, 0.0).z;
    let z3 = textureSampleLevel(lights, linear_sampler, uv + dy, 0.0).z;
    // The second difference is zero on planes; the contour is on what is in front.
    let level = level_ground(textureSampleLevel(normals, linear_sampler, uv, 0.0).xyz, uv, span);
    let step = max(z0 + z1 - 2.0 * z, 0.0) + max(z2 + z3 - 2.0 * z - level, 0.0);
    // Far crowns are a few pixels wide: only what stands out against the distance is left of their contours.
    let near = 1.0 - smoothstep(0.50, 0.66, z);
    let creases = smoothstep(0.28, 0.85, style.detail * bend) * near;
    // Steps from leaf to leaf inside a near crown do not count; of farther crowns, steps from one to the next do.
    let metres = log(FARTHEST / NEAREST) * NEAREST * exp(z * log(FARTHEST / NEAREST));
    let least = max(0.0005, mix(LEAF_STEP, CROWN_STEP, smoothstep(0.32, 0.46, z)) / metres);
    let strong = smoothstep(0.01, 0.03, style.detail * step) * (1.0 - near);
    let silhouettes = smoothstep(least, 4.0 * least, style.detail * step) * mix(0.25, 1.0, near) + strong;
    return saturate(max(0.8 * creases, silhouettes));
}

// Under direction alone, what is stored short counts as much as the rest.
fn direction(stored: vec3<f32>) -> vec3<f32> {
    return mix(stored / max(length(stored), 0.02), stored, style.scaled_normals);
}

// The second difference of the depth over `span` texels of a level surface with this normal. It grows without end towards the
// horizon, which is no edge of the surface: a hill's crest has another slope than the hill.
fn level_ground(stored: vec3<f32>, uv: vec2<f32>, span: f32) -> f32 {
    let normal = stored / max(length(stored), 0.02);
    let slope = abs(dot(normal, normalize(relative_position(uv, 0.0))));
    // The part of the way to the horizon that a span is.
    let angle = span * style.size.y / (style.map_size.y * frame.focal_length_pixels);
    let part = min(angle / max(slope, 1e-4), 0.999);
    return -log(1.0 - part * part) / log(FARTHEST / NEAREST);
}
