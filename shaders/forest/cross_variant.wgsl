// Data of each plant's crossed billboards, for the view and for the shadow maps.
#define_import_path canopy::cross_variant

#import canopy::constants::{MOST_PLANES, ISOTROPIC_VECTORS}

struct Plane {
    center: vec4<f32>,
    u: vec4<f32>,
    v: vec4<f32>,
    normal: vec4<f32>,
}

struct CrossVariant {
    // The upright planes, then the level one.
    planes: array<Plane, MOST_PLANES>,
    // Factor for light through its leaves, as in `Surface`.
    transmission: vec3<f32>,
    // First layer of its textures, and of its lighting textures.
    first_layer: u32,
    // Fraction of a texel's leaf area with isotropic normals, 0..1, mip by mip.
    isotropic_fraction: array<vec4<f32>, ISOTROPIC_VECTORS>,
    first_light_layer: u32,
    // Number of upright planes.
    uprights: u32,
}

@group(2) @binding(3) var<storage, read> cross_variants: array<CrossVariant>;
