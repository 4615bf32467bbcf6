// Planes of billboard clouds, for the view and for the shadow maps.
#define_import_path canopy::cloud_plane

#import canopy::constants::ISOTROPIC_VECTORS

struct CloudPlane {
    // Metres in the plant's frame.
    center: vec3<f32>,
    // Texture coordinates of the upper left corner.
    texture_left: f32,
    // Half extents.
    u: vec3<f32>,
    texture_top: f32,
    v: vec3<f32>,
    texture_right: f32,
    // Unit normal towards the side from which the texture was rendered.
    normal: vec3<f32>,
    texture_bottom: f32,
}

struct CloudVariant {
    // Factor for light through its leaves, as in `Surface`.
    transmission: vec3<f32>,
    // Layer of its lighting texture.
    light_layer: u32,
    // Fraction of a texel's leaf area with isotropic normals, 0..1, mip by mip.
    isotropic_fraction: array<vec4<f32>, ISOTROPIC_VECTORS>,
}

// The planes of all plants, one plant after the other.
@group(2) @binding(3) var<storage, read> planes: array<CloudPlane>;

// Corner of a plane by the index of a pulled vertex, -1..1.
fn plane_corner(index: u32) -> vec2<f32> {
    var corners = array<vec2<f32>, 6>(
        vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0),
    );
    return corners[index % 6u];
}

fn plane_uv(plane: CloudPlane, corner: vec2<f32>) -> vec2<f32> {
    let share = vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y);
    return mix(vec2(plane.texture_left, plane.texture_top), vec2(plane.texture_right, plane.texture_bottom), share);
}
