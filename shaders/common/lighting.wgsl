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
}

// Exitant radiance towards the viewer; `visibility` of the key light in 0..1.
fn shade(surface: Surface, visibility: f32) -> vec3<f32> {
    let cosine = dot(surface.normal, light.key_direction.xyz);
    let direct = (max(cosine, 0.0) + max(-cosine, 0.0) * surface.transmission) * visibility
        * light.key_illuminance.rgb * INVERSE_PI;
    var ambient = sky_irradiance(surface.normal);
    ambient += surface.transmission * sky_irradiance(-surface.normal) * 0.5;
    return surface.albedo * (direct + ambient * surface.ambient);
}
