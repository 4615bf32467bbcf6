// One lighting function for the full model, the billboards and the ground, so that no level of detail is lit
// differently.
#define_import_path canopy::lighting

#import canopy::frame::light
#import canopy::sky::sky_irradiance
#import canopy::stand::{StandLight, in_stand}
#import canopy::sun_visibility::LeafSample

const INVERSE_PI: f32 = 0.31830989;
// Weights of linear red, green and blue in the luminance.
const LUMINANCE: vec3<f32> = vec3(0.2126, 0.7152, 0.0722);

struct Surface {
    albedo: vec3<f32>,
    // Unit length, towards the viewer's side.
    normal: vec3<f32>,
    // Linear factor on the albedo for light from behind; zero for wood and ground.
    transmission: vec3<f32>,
    // Specular reflectance of a leaf's surface; 0: matt.
    specular_reflectance: f32,
    // Root mean square slope of its facets.
    roughness: f32,
    // Strength of the lobe for a specular albedo of 1, and the largest specular albedo over the fraction of light that
    // is absorbed: lobe_gain and lobe_room of src/plant/gloss.rs.
    lobe_gain: f32,
    lobe_room: f32,
    // Weight of the gloss of many leaves with isotropic normals, 0..1.
    gloss_isotropy: f32,
    // Ambient occlusion, 0..1: visible fraction of the surroundings.
    ambient_visibility: f32,
    // Unit vector to the viewer.
    viewer: vec3<f32>,
    // Fraction of leaf area with isotropic normals, which averaging the normals hides (cf. Toksvig 2005): 0 one normal.
    isotropic_fraction: f32,
}

// Mean cosine to the light over the leaves that face a viewer, for isotropic normals, weighted by projected area: the
// phase function of a diffuse sphere [Lambert 1760; Schoenberg 1925]. `cosine` is that of the angle between light and
// viewer.
fn sphere_cosine(cosine: f32) -> f32 {
    let c = clamp(cosine, -1.0, 1.0);
    return (sqrt(1.0 - c * c) + acos(-c) * c) * 0.21220659;
}

// Irradiance over pi of the surroundings on a surface in a stand, of which it sees the fraction `ambient_visibility`,
// evenly.
fn even_sky(surface: Surface, stand: StandLight) -> vec3<f32> {
    let n = surface.normal;
    let through = surface.transmission * in_stand(sky_irradiance(-n), -n, stand);
    return (in_stand(sky_irradiance(n), n, stand) + through) * surface.ambient_visibility;
}

// Fraction of the reflected light that has been inside a leaf (its subsurface albedo over its albedo), for a specular
// reflectance of `reflectance`; the rest is specular. src/plant/gloss.rs derives it.
fn subsurface_share(albedo: vec3<f32>, reflectance: f32) -> vec3<f32> {
    return albedo / max(sqrt(albedo * albedo + reflectance * reflectance) + reflectance, vec3(1e-6));
}

// Fraction of the reflected light that is diffuse: what has been inside, and what a bright leaf has no room for in its
// lobe (1 less Gloss::specular_albedo of src/plant/gloss.rs over the albedo).
fn diffuse_share(surface: Surface) -> vec3<f32> {
    let room = max(1.0 - surface.albedo * (1.0 + surface.transmission), vec3(0.0)) * surface.lobe_room;
    let least = 1.0 - room / max(surface.albedo, vec3(1e-6));
    return max(subsurface_share(surface.albedo, surface.specular_reflectance), least);
}

// Light through a leaf as a factor on its base colour: the twin of PlantMaterial::transmitted in src/plant/gloss.rs.
fn leaf_transmission(base_color: vec3<f32>, factor: vec3<f32>, reflectance: f32) -> vec3<f32> {
    let c = clamp(base_color, vec3(0.0), vec3(1.0));
    return min(factor * subsurface_share(c, reflectance), (1.0 - c) / max(c, vec3(1e-6)));
}

// The specular term of the leaf shader [Franzke 2005, 4.2.2], times pi and the cosine, for the albedo
// `specular_albedo` of the surface, its mean over all directions: microfacets [Walter et al. 2007, GGX; the masking of
// Hammon 2017], whose Fresnel factor is half constant and half that of Schlick [1994]: the mean of (1 - cosine)^5 is
// 1/21. Leaves with isotropic normals reflect like a ball: equally in all directions except for that factor.
//
// A single reflection loses the light that facets mask; the strength of the lobe compensates for it.
fn leaf_gloss(surface: Surface, specular_albedo: vec3<f32>) -> vec3<f32> {
    let to_light = light.key_direction;
    // Between two opposite directions the half vector is not defined: any direction will do.
    let between = surface.viewer + to_light;
    let middle = between * inverseSqrt(max(dot(between, between), 1e-8));
    let grazing = 1.0 - saturate(dot(middle, to_light));
    let grazing_squared = grazing * grazing;
    let fresnel = 0.5 + 10.5 * grazing_squared * grazing_squared * grazing;
    let nl = saturate(dot(surface.normal, to_light));
    let nv = max(abs(dot(surface.normal, surface.viewer)), 1e-3);
    let nm = saturate(dot(surface.normal, middle));
    let width = surface.roughness;
    let falloff = nm * nm * (width * width - 1.0) + 1.0;
    // Distribution times pi; masking over four times the cosines.
    let distribution = width * width / (falloff * falloff);
    let masking = 0.5 / max(mix(2.0 * nl * nv, nl + nv, width), 1e-4);
    let strength = specular_albedo * surface.lobe_gain;
    return fresnel * mix(strength * (distribution * masking * nl), specular_albedo * 0.25, surface.gloss_isotropy);
}

// Light of the key light on a surface, behind whatever hides it.
struct KeyLight {
    // Irradiance over pi on the viewer's side.
    near: vec3<f32>,
    // The same on the other side.
    far: vec3<f32>,
    // Its visibility, 0..1.
    visibility: f32,
}

// Exitant radiance of a matt surface towards the viewer. `sky`: irradiance of the surroundings over pi, transmitted light
// included.
fn exitant_matt(surface: Surface, key: KeyLight, sky: vec3<f32>) -> vec3<f32> {
    return surface.albedo * (key.near + key.far * surface.transmission + sky);
}

// The same of a leaf, whose specular reflectance may be 0. Only the diffuse part of the key light is reduced by the
// gloss: the sky has no visible specular lobe.
fn exitant(surface: Surface, key: KeyLight, sky: vec3<f32>) -> vec3<f32> {
    let diffuse = diffuse_share(surface);
    let specular_albedo = surface.albedo * (1.0 - diffuse);
    let gloss = leaf_gloss(surface, specular_albedo) * light.key_illuminance * INVERSE_PI;
    return exitant_matt(surface, KeyLight(key.near * diffuse, key.far, key.visibility), sky) + gloss * key.visibility;
}

// Cosines of the key light to the viewer's side and to the other, in the mean over the leaves.
fn key_cosines(surface: Surface) -> vec2<f32> {
    let cosine = dot(surface.normal, light.key_direction);
    let between = dot(surface.viewer, light.key_direction);
    let front = mix(max(cosine, 0.0), sphere_cosine(between), surface.isotropic_fraction);
    let back = mix(max(-cosine, 0.0), sphere_cosine(-between), surface.isotropic_fraction);
    return vec2(front, back);
}

// The key light at the angle to the surface's normal, behind what leaves it a visibility of `visibility`.
fn key_light(surface: Surface, visibility: f32) -> KeyLight {
    let cosines = key_cosines(surface);
    let full = light.key_illuminance * (INVERSE_PI * visibility);
    return KeyLight(cosines.x * full, cosines.y * full, visibility);
}

// Exitant radiance of a leaf that the key light hits at the angle to its normal. There is no branch for leaves without
// gloss: their reflectance is a uniform, and a driver in software compiles a shader again for each value of a uniform
// that decides a branch (docs/decisions/0002-no-branch-on-uniforms-alone.md).
fn shade(surface: Surface, visibility: f32, sky: vec3<f32>) -> vec3<f32> {
    return exitant(surface, key_light(surface, visibility), sky);
}

// The same of a matt surface: wood and ground.
fn shade_matt(surface: Surface, visibility: f32, sky: vec3<f32>) -> vec3<f32> {
    return exitant_matt(surface, key_light(surface, visibility), sky);
}

// The key light on a surface whose own plant's shade is known from its transfer: `near` and `far`, irradiance over pi on
// the two sides, behind the plant alone. `visibility`: that behind other plants. `leaves`: what the shadow maps know more.
// They add detail that the transfer does not have, and darken what other plants in this one's crown hide.
fn transferred_key_light(
    surface: Surface, near: vec3<f32>, far: vec3<f32>, visibility: f32, leaves: LeafSample,
) -> KeyLight {
    let cosines = key_cosines(surface);
    let full = light.key_illuminance * INVERSE_PI;
    let own = saturate(dot(near + far, LUMINANCE) / max(dot(full, LUMINANCE) * (cosines.x + cosines.y), 1e-6));
    let both = own * visibility;
    // A few bands of harmonics leave light in deep shade; the map's mean is its upper limit. A map hides too much rather than too little
    // behind the leaves of a texel, hence the factor (docs/decisions/0027-leaves-combine-transfer-and-shadow-map.md).
    let limit = clamp(1.2 * leaves.mean / max(both, 1e-3), 0.15, 1.0);
    let mean = visibility * mix(1.0, limit, leaves.weight);
    let detail = leaves.detail * leaves.weight;
    var key: KeyLight;
    key.near = max(near * mean + full * (cosines.x * detail), vec3(0.0));
    key.far = max(far * mean + full * (cosines.y * detail), vec3(0.0));
    key.visibility = saturate(own * mean + detail);
    return key;
}

// Exitant radiance of leaves whose light by the key light is known as a sum over both of their sides and over all of them:
// `lit`, as a fraction of what a surface that faces the light gets, weighted as src/bake/levels/cross/sun.rs says.
// `visibility` is that behind other plants.
fn shade_leaves(surface: Surface, lit: f32, visibility: f32, sky: vec3<f32>) -> vec3<f32> {
    let share = diffuse_share(surface);
    let full = light.key_illuminance * INVERSE_PI;
    let gloss = leaf_gloss(surface, surface.albedo * (1.0 - share));
    // The leaves' own shade, for the gloss: what they show over what they would show without it.
    let sides = key_cosines(surface);
    let through = dot(surface.transmission, LUMINANCE);
    let reflected = dot(share, LUMINANCE);
    let own = saturate(lit * (reflected + through) / max(reflected * sides.x + through * sides.y, 0.05));
    let diffuse = surface.albedo * (share + surface.transmission) * lit;
    return full * visibility * (diffuse + gloss * own) + surface.albedo * sky;
}
