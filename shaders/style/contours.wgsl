// Contours: discontinuities of depth and normal [Saito & Takahashi 1990; Luft 2007, section 4]. How strong they are around each pixel;
// lines.wgsl finds the lines in it.
#import canopy::style::{style, full_screen, FullScreen, contour_span, NEAREST, FARTHEST}

@group(1) @binding(1) var soft_lights: texture_2d<f32>;
@group(1) @binding(2) var soft_normals: texture_2d<f32>;
@group(1) @binding(3) var linear_sampler: sampler;

// Least steps in depth that are drawn, metres.
const LEAF_STEP: f32 = 1.0;
const CROWN_STEP: f32 = 0.2;
// What 16 bits hold.
const MOST_STRENGTH: f32 = 6e4;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

// Under direction alone, what is stored short counts as much as the rest.
fn direction(uv: vec2<f32>) -> vec3<f32> {
    let stored = textureSampleLevel(soft_normals, linear_sampler, uv, 0.0).xyz;
    return mix(stored / max(length(stored), 0.02), stored, style.scaled_normals);
}

fn depth(uv: vec2<f32>) -> f32 {
    let light = textureSampleLevel(soft_lights, linear_sampler, uv, 0.0);
    return light.z + light.w;
}

// A step in depth.
struct Step {
    height: f32,
    // The least depth around.
    nearest: f32,
}

// The step in depth around `uv`, whose outline is across the gradient. There the third derivative along the gradient is opposed to the first
// [Lindeberg 1998, Edge detection and ridge detection with automatic scale selection]. On a plane, whose depth is the logarithm of a
// reciprocal, both have one sign up to the horizon: a plane has no step.
fn depth_step(uv: vec2<f32>, span: f32) -> Step {
    let dx = vec2(span, 0.0) / style.map_size;
    let dy = vec2(0.0, span) / style.map_size;
    let gradient = vec2(depth(uv + dx) - depth(uv - dx), depth(uv + dy) - depth(uv - dy));
    let along = gradient * inverseSqrt(max(dot(gradient, gradient), 1e-20)) * span;
    let forward = along / style.map_size;
    let near = depth(uv - forward);
    let far = depth(uv + forward);
    let nearest = depth(uv - 2.0 * forward);
    let slope = max(far - near, 0.0);
    let third = slope - 0.5 * (depth(uv + 2.0 * forward) - nearest);
    // An outline that turns within the Gaussian is that of a leaf or of a gap between leaves, which the Gaussian is to hide.
    let side = vec2(-along.y, along.x) / style.map_size;
    let turn = abs(depth(uv + side) + depth(uv - side) - 2.0 * depth(uv)) / max(0.5 * slope, 1e-6);
    let smooth_outline = 1.0 - saturate(style.softness) * smoothstep(0.5, 1.0, turn);
    return Step(max(third, 0.0) * smooth_outline, min(nearest, near));
}

// `strength` of a discontinuity over its limits: 0 at the first, 1 at the second.
fn over(strength: f32, first: f32, second: f32) -> f32 {
    return max(strength - first, 0.0) / (second - first);
}

// The strength; the ink, 0..1; the depth of what is in front.
@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let span = contour_span();
    let dx = vec2(span, 0.0) / style.map_size;
    let dy = vec2(0.0, span) / style.map_size;
    let bend_x = direction(in.uv + dx) - direction(in.uv - dx);
    let bend_y = direction(in.uv + dy) - direction(in.uv - dy);
    let bend = sqrt(dot(bend_x, bend_x) + dot(bend_y, bend_y));
    let found = depth_step(in.uv, span);
    let step = style.detail * found.height;
    let z = found.nearest;
    // Far crowns are a few pixels wide: only what stands out against the distance is left of their contours.
    let near = 1.0 - smoothstep(0.50, 0.66, z);
    let crease = 0.8 * over(style.detail * bend, 0.28, 0.85) * near;
    // Steps from leaf to leaf inside a near crown do not count; of farther crowns, steps from one to the next do.
    let metres = log(FARTHEST / NEAREST) * NEAREST * exp(z * log(FARTHEST / NEAREST));
    let least = max(0.0003, mix(LEAF_STEP, CROWN_STEP, smoothstep(0.32, 0.46, z)) / metres);
    let silhouette = over(step, least, 4.0 * least);
    let strong = over(step, 0.01, 0.03) * (1.0 - near);
    let limited = smoothstep(vec3(0.0), vec3(1.0), vec3(crease, silhouette, strong));
    let ink = max(limited.x, limited.y * mix(0.25, 1.0, near) + limited.z);
    return vec4(min(max(crease, silhouette), MOST_STRENGTH), saturate(ink), z, 1.0);
}
