// What a leaf's tissue leaves of the light [Franzke 2005, 3.2]: the layered model in real time.
#define_import_path canopy::tissue

struct Tissue {
    // Absorption times thickness, in the mean over the leaf.
    optical_depth: f32,
    // Shares of the three layers.
    shares: vec3<f32>,
    // Squares of their inverse indices of refraction.
    inverse_squares: vec3<f32>,
    // What is left of perpendicular light seen perpendicularly, from before and from behind.
    perpendicular: vec2<f32>,
    // Factors on even light from before and from behind, at the cosines 0.1, 0.55 and 1 to the viewer.
    sky_before: vec3<f32>,
    sky_behind: vec3<f32>,
}

// The mean of exp(-x t) over t in 0..1.
fn mean_exp(x: vec3<f32>) -> vec3<f32> {
    return select((1.0 - exp(-x)) / x, 1.0 - 0.5 * x, x < vec3(1e-2));
}

// One over the cosines in the layers of a ray that meets the leaf at a cosine.
fn slants(tissue: Tissue, outside: f32) -> vec3<f32> {
    let squares = 1.0 - tissue.inverse_squares * max(1.0 - outside * outside, 0.0);
    // The least cosine in a layer is 0.05.
    return inverseSqrt(max(squares, vec3(0.0025)));
}

// Factors on the light at the cosine `to_light`, seen at the cosine `to_viewer`, from before and from behind: 0..1. The twin
// of TissueLight::factors in src/plant/tissue_light.rs.
fn tissue_light(tissue: Tissue, to_viewer: f32, to_light: f32) -> vec2<f32> {
    let depth = tissue.optical_depth * tissue.shares;
    let view = depth * slants(tissue, to_viewer);
    let light = depth * slants(tissue, to_light);
    let both = view + light;
    // What lies before each layer, and beyond it.
    let above = exp(-vec3(0.0, both.x, both.x + both.y));
    let seen = vec3(0.0, view.x, view.x + view.y);
    let below = vec3(light.y + light.z, light.z, 0.0);
    let before = dot(tissue.shares, above * mean_exp(both));
    let least = min(view, light);
    let behind = dot(tissue.shares, exp(-(seen + below + least)) * mean_exp(max(view, light) - least));
    return min(vec2(before, behind) / tissue.perpendicular, vec2(1.0));
}

// The same in even light: the parabola through three cosines.
fn tissue_sky(tissue: Tissue, to_viewer: f32) -> vec2<f32> {
    let x = max(to_viewer, 0.1);
    let weights = vec3((x - 0.55) * (x - 1.0), -2.0 * (x - 0.1) * (x - 1.0), (x - 0.1) * (x - 0.55)) / 0.405;
    return saturate(vec2(dot(weights, tissue.sky_before), dot(weights, tissue.sky_behind)));
}
