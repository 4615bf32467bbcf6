// Strokes drawn by hand on leaves [Luft 2006, 4.4], as the surfaces' pass has left them.
#define_import_path canopy::style_strokes

#import canopy::style::{style, landscape_depth}

// Least steps of the depth map over which a stroke fades behind what is nearer: δ of the blurred depth test.
const REACH: f32 = 0.004;

fn strokes_of(texel: vec2<i32>, identities: texture_2d<u32>) -> vec2<f32> {
    let inside = clamp(texel, vec2(0), vec2<i32>(style.map_size) - 1);
    return vec2<f32>(textureLoad(identities, inside, 0).zw) / 255.0;
}

// Ink at `uv`, 0..1, where `dark` (0..1) lies in shade. It fades where the blurred depth is nearer than the surface.
fn stroke_ink(uv: vec2<f32>, distance: f32, soft_depth: f32, dark: f32, identities: texture_2d<u32>) -> f32 {
    // Integers have no filter.
    let at = uv * style.map_size - 0.5;
    let first = vec2<i32>(floor(at));
    let t = at - floor(at);
    let above = mix(strokes_of(first, identities), strokes_of(first + vec2(1, 0), identities), t.x);
    let below = mix(strokes_of(first + vec2(0, 1), identities), strokes_of(first + vec2(1, 1), identities), t.x);
    let strokes = mix(above, below, t.y);
    let visible = smoothstep(-REACH, REACH, soft_depth - landscape_depth(distance) + REACH);
    return visible * saturate(strokes.x + strokes.y * smoothstep(0.35, 0.65, dark));
}
