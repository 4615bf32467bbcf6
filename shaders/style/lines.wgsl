// Lines of a chosen width on the ridges of the contours' strength, which is as broad as the Gaussian that has smoothed light and
// depth. A ridge is found by the second derivatives at each pixel, to a part of a pixel [Steger 1998, An unbiased detector of curvilinear
// structures].
#import canopy::style::{style, full_screen, FullScreen, contour_span}

@group(1) @binding(1) var contours: texture_2d<f32>;
@group(1) @binding(2) var linear_sampler: sampler;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

fn strength(uv: vec2<f32>) -> f32 {
    return textureSampleLevel(contours, linear_sampler, uv, 0.0).x;
}

// A line of `style.line_width`, a rim as broad as the Gaussian, the depth of what is in front; all 0..1.
@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let scale = style.size.y / style.map_size.y;
    // Pixels between the points at which the strength is looked up.
    let span = max(0.35 * contour_span() * scale, 1.0);
    let dx = vec2(span, 0.0) / style.size;
    let dy = vec2(0.0, span) / style.size;
    let middle = textureSampleLevel(contours, linear_sampler, in.uv, 0.0);
    let left = strength(in.uv - dx);
    let right = strength(in.uv + dx);
    let top = strength(in.uv - dy);
    let bottom = strength(in.uv + dy);
    let diagonal = strength(in.uv + dx + dy) - strength(in.uv + dx - dy) - strength(in.uv - dx + dy) + strength(in.uv - dx - dy);
    // Derivatives, a span each.
    let gradient = 0.5 * vec2(right - left, bottom - top);
    let xx = left + right - 2.0 * middle.x;
    let yy = top + bottom - 2.0 * middle.x;
    let xy = 0.25 * diagonal;
    // The direction in which the strength bends down most, across the line.
    let half_difference = 0.5 * (xx - yy);
    let root = sqrt(half_difference * half_difference + xy * xy);
    let bend = 0.5 * (xx + yy) - root;
    let raw = select(vec2(xy, bend - xx), vec2(bend - yy, xy), half_difference < 0.0);
    let across = raw * inverseSqrt(max(dot(raw, raw), 1e-12));
    // Spans to the ridge, by the parabola through the three values across.
    let to_ridge = dot(gradient, across) / max(-bend, 1e-6);
    let on_ridge = in.uv + clamp(to_ridge, -3.0, 3.0) * across * span / style.size;
    let ridge = textureSampleLevel(contours, linear_sampler, on_ridge, 0.0);
    // What hardly stands out is drawn finer.
    let width = style.line_width * scale * mix(0.5, 1.0, ridge.y);
    let outside = abs(to_ridge) * span - 0.5 * width;
    // Neither a plateau nor a peak is a line.
    let sharp = -bend / max(middle.x, 1e-4);
    let ridged = smoothstep(0.03, 0.10, sharp) * smoothstep(0.2, 0.6, 2.0 * root / max(-bend, 1e-6));
    let coverage = saturate(0.5 - outside) * min(width, 1.0) * ridged * f32(abs(to_ridge) < 3.0);
    return vec4(coverage * ridge.y, middle.y, mix(middle.z, ridge.z, coverage), 1.0);
}
