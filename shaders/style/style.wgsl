// Values of the style, shared by its full-screen passes. Rust twin: src/render/style/uniforms.rs.
#define_import_path canopy::style

struct Style {
    // The camera in metres, modulo NOISE_SPAN.
    anchor: vec3<f32>,
    // Pixels of the picture per pixel of one of 720 lines.
    unit: f32,
    // Pixels of the picture, and of the maps.
    size: vec2<f32>,
    map_size: vec2<f32>,
    paper: vec3<f32>,
    margin: f32,
    ink: vec3<f32>,
    sketch: f32,
    distance: vec3<f32>,
    air: f32,
    // Transmittance of the night's glaze.
    night: vec3<f32>,
    flow: f32,
    edges: f32,
    granulation: f32,
    wetness: f32,
    dabs: f32,
    shadow: f32,
    // Metres.
    shadow_softness: f32,
    // Pixels of the maps.
    line_width: f32,
    detail: f32,
    hatching: f32,
    tones: f32,
    // 0: contours of the normals' directions alone; 1: of normals scaled by the ambient visibility.
    scaled_normals: f32,
    // How far foliage takes on the colour of the scene's own leaves.
    scene: f32,
    // What noise is fixed to: 0 the scene, 1 the page, 2 the scene with one size in metres.
    noise_anchor: u32,
    // How much of the textures of near plants is painted.
    textures: f32,
    // Deviation of the Gaussian of light and depth, pixels of the maps.
    softness: f32,
}

@group(1) @binding(0) var<uniform> style: Style;

// Texels of the maps over which contours are sought: as wide as the Gaussian, as over less, what it has smoothed hardly differs, and
// lines would break up.
fn contour_span() -> f32 {
    return max(style.softness, 0.7);
}

struct FullScreen {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

// A triangle over the whole picture.
fn full_screen(index: u32) -> FullScreen {
    let uv = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return FullScreen(vec4(uv * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0), uv);
}

// Distances that `landscape_depth` maps to 0 and 1, metres: src/style/depth.rs.
const NEAREST: f32 = 0.5;
const FARTHEST: f32 = 50000.0;

// Depth 0..1 by the logarithm of the distance.
fn landscape_depth(distance: f32) -> f32 {
    return saturate(log(max(distance, NEAREST) / NEAREST) / log(FARTHEST / NEAREST));
}

// A depth in two values of 16 bits, whose sum it is: a multiple of 1/1024, and what is left. Differences of depths far away need both.
fn split_depth(depth: f32) -> vec2<f32> {
    let rounded = round(depth * 1024.0) / 1024.0;
    return vec2(rounded, depth - rounded);
}

// Where a distance begins to fade, and where it has faded.
fn airiness(depth: f32) -> f32 {
    return smoothstep(0.42, 0.78, depth);
}
