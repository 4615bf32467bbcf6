// One lighting function for the full model, the billboards and the ground, so that no level of detail is lit
// differently.
#define_import_path canopy::lighting

#import canopy::frame::light
#import canopy::sky::sky_irradiance

const INVERSE_PI: f32 = 0.31830989;

struct Surface {
    albedo: vec3<f32>,
    // Unit length, towards the viewer's side.
    normal: vec3<f32>,
    // Linear factor on the albedo for light from behind; zero for wood and ground.
    transmission: vec3<f32>,
    // Share of the surroundings that the surface sees, 0..1.
    ambient: f32,
    // Unit vector to the viewer, and how far the surface is many leaves that face everywhere: 0 one normal, 1 all alike.
    viewer: vec3<f32>,
    spread: f32,
}

// Mean cosine to the light over the leaves that face a viewer, where leaves face everywhere alike and each counts by the
// area that it shows him: the phase function of a diffuse sphere [Lambert 1760; Schoenberg 1925]. `cosine` is that of the
// angle between light and viewer.
fn sphere_cosine(cosine: f32) -> f32 {
    let c = clamp(cosine, -1.0, 1.0);
    return (sqrt(1.0 - c * c) + acos(-c) * c) * 0.21220659;
}

// Share of the sky's light that comes through the share `depth` (0..1) of a stand whose crowns cover the share `cover` of
// the ground, by Beer and Lambert's law [Monsi & Saeki 1953]. The exponent is fitted to the path tracer in a stand of 300
// stems a hectare: 1.5 would be the mean of the hemisphere over one layer of crowns, but crowns stand behind crowns. What
// leaves pass on is the 0.05.
fn sky_through(cover: f32, depth: f32) -> f32 {
    return mix(0.05, 1.0, pow(1.0 - 0.92 * clamp(cover, 0.0, 1.0), 2.5 * clamp(depth, 0.0, 1.0)));
}

// What the surroundings bring to a surface that sees the share `ambient` of them evenly, over pi.
fn even_sky(surface: Surface) -> vec3<f32> {
    let through = surface.transmission * sky_irradiance(-surface.normal);
    return (sky_irradiance(surface.normal) + through) * surface.ambient;
}

// Exitant radiance towards the viewer; `visibility` of the key light in 0..1, `sky`: irradiance of the surroundings over pi,
// what is transmitted included.
fn shade(surface: Surface, visibility: f32, sky: vec3<f32>) -> vec3<f32> {
    let cosine = dot(surface.normal, light.key_direction.xyz);
    let between = dot(surface.viewer, light.key_direction.xyz);
    let front = mix(max(cosine, 0.0), sphere_cosine(between), surface.spread);
    let back = mix(max(-cosine, 0.0), sphere_cosine(-between), surface.spread);
    let direct = (front + back * surface.transmission) * visibility
        * light.key_illuminance.rgb * INVERSE_PI;
    return surface.albedo * (direct + sky);
}
