// Contours of what is painted, once a texel: pencil and rims look them up at places of their own.
#import canopy::style::{style, full_screen, FullScreen}
#import canopy::style_edges::contour

@group(1) @binding(1) var soft_lights: texture_2d<f32>;
@group(1) @binding(2) var soft_normals: texture_2d<f32>;
@group(1) @binding(3) var linear_sampler: sampler;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    return vec4(contour(soft_normals, soft_lights, linear_sampler, in.uv, style.line_width));
}
