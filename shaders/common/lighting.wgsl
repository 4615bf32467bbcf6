// One lighting function for the full model, the billboards and the ground, so that no level of detail is lit
// differently.
#define_import_path canopy::lighting

#import canopy::frame::light

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

// Radiance that a white Lambertian surface returns under the sky: src/light/sh.rs fixes signs and order.
fn sky_irradiance(n: vec3<f32>) -> vec3<f32> {
    let s = &light.sky;
    var sum = 0.28209479 * (*s)[0].rgb;
    sum += 0.48860251 * (n.y * (*s)[2].rgb - n.x * (*s)[1].rgb - n.z * (*s)[3].rgb);
    sum += 1.09254843 * (n.x * n.z * (*s)[4].rgb - n.x * n.y * (*s)[5].rgb - n.y * n.z * (*s)[7].rgb);
    sum += 0.31539157 * (3.0 * n.y * n.y - 1.0) * (*s)[6].rgb;
    sum += 0.54627421 * (n.z * n.z - n.x * n.x) * (*s)[8].rgb;
    return max(sum, vec3(0.0));
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
