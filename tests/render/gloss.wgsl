// What a leaf of the real-time shader reflects of even light, by quadrature over both directions: one workgroup a leaf.
// The light stands still, and the leaf turns.
#import canopy::frame::light
#import canopy::lighting::{Surface, exitant, key_light, diffuse_share, leaf_gloss}

struct Leaf {
    albedo: f32,
    transmission: f32,
    specular_reflectance: f32,
    roughness: f32,
    lobe_gain: f32,
    lobe_room: f32,
}

@group(1) @binding(0) var<storage, read> leaves: array<Leaf>;
// For each leaf and height of the light: what the lobe reflects, and all that is reflected.
@group(1) @binding(1) var<storage, read_write> rows: array<vec2<f32>>;

const ROWS: u32 = 64;
const HEIGHTS: u32 = 96;
const AZIMUTHS: u32 = 192;
const PI: f32 = 3.14159265;

@compute @workgroup_size(ROWS)
fn reflect(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) row: u32) {
    let leaf = leaves[group.x];
    var surface: Surface;
    surface.albedo = vec3(leaf.albedo);
    surface.transmission = vec3(leaf.transmission);
    surface.specular_reflectance = leaf.specular_reflectance;
    surface.roughness = leaf.roughness;
    surface.lobe_gain = leaf.lobe_gain;
    surface.lobe_room = leaf.lobe_room;
    surface.gloss_isotropy = 0.0;
    surface.isotropic_fraction = 0.0;
    surface.ambient_visibility = 1.0;
    let to_light = light.key_direction;
    let aside = normalize(cross(to_light, vec3(0.3, 0.5, 0.8)));
    let nl = (f32(row) + 0.5) / f32(ROWS);
    surface.normal = to_light * nl + aside * sqrt(1.0 - nl * nl);
    // Axes in the plane of the leaf.
    let u = normalize(to_light - surface.normal * nl);
    let v = cross(surface.normal, u);
    var sum = vec2(0.0);
    for (var i = 0u; i < HEIGHTS; i++) {
        // Even in the square of the cosine: the views count by it.
        let squared = (f32(i) + 0.5) / f32(HEIGHTS);
        for (var j = 0u; j < AZIMUTHS; j++) {
            let azimuth = 2.0 * PI * (f32(j) + 0.5) / f32(AZIMUTHS);
            let level = sqrt(1.0 - squared);
            surface.viewer = surface.normal * sqrt(squared) + (u * cos(azimuth) + v * sin(azimuth)) * level;
            let specular_albedo = surface.albedo * (1.0 - diffuse_share(surface));
            let lobe = leaf_gloss(surface, specular_albedo).y / PI;
            let all = exitant(surface, key_light(surface, 1.0), vec3(0.0)).y;
            sum += vec2(lobe, all);
        }
    }
    rows[group.x * ROWS + row] = sum * (2.0 * PI / f32(ROWS * HEIGHTS * AZIMUTHS));
}
