// Sky radiance from the look-up table of src/light/atmosphere [Hillaire 2020, 5.3], and the fog that fits it.
#define_import_path canopy::sky

#import canopy::constants::{SKY_COLUMNS, SKY_ROWS, SKY_HORIZON_ROW}
#import canopy::frame::{frame, light, sky_texture, sky_sampler}

const PI: f32 = 3.14159265;

// Radiance of the sky without sun and moon, exposed. `direction` has unit length.
fn sky_radiance(direction: vec3<f32>) -> vec3<f32> {
    let a = light.sky_axis;
    let h = direction.xz;
    var phi = 0.0;
    if dot(h, h) > 1e-12 {
        phi = atan2(a.x * h.y - a.y * h.x, dot(h, a));
    }
    let u = sign(phi) * sqrt(min(abs(phi) / PI, 1.0));
    let column = (0.5 + 0.5 * u) * (SKY_COLUMNS - 1.0);
    let steepness = sqrt(min(abs(asin(clamp(direction.y, -1.0, 1.0))) / (0.5 * PI), 1.0));
    let below = SKY_HORIZON_ROW + (SKY_ROWS - 1.0 - SKY_HORIZON_ROW) * steepness;
    let row = select(below, SKY_HORIZON_ROW * (1.0 - steepness), direction.y >= 0.0);
    return textureSampleLevel(sky_texture, sky_sampler, (vec2(column, row) + 0.5) / vec2(SKY_COLUMNS, SKY_ROWS), 0.0).rgb;
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

// Irradiance over pi of the sky, for two bands of transfer: the coefficient `mean`, and `vector` of the second band.
fn sky_transfer(mean: f32, vector: vec3<f32>) -> vec3<f32> {
    let s = &light.sky;
    // The light is stored convolved with a Lambertian surface: its second band is multiplied by 2/3.
    let band = vector.y * (*s)[2].rgb - vector.x * (*s)[1].rgb - vector.z * (*s)[3].rgb;
    return max(mean * (*s)[0].rgb + 1.5 * band, vec3(0.0));
}

// Optical depth of a haze whose density falls exponentially with height, along a straight ray.
fn fog_optical_depth(relative: vec3<f32>) -> f32 {
    let distance = length(relative);
    let inverse_scale = light.fog_inverse_scale_height;
    let start = exp(-max(frame.camera.y, 0.0) * inverse_scale);
    let rise = clamp(relative.y * inverse_scale, -20.0, 20.0);
    // (1 - e^-x) / x, by its series where x vanishes.
    let mean = select((1.0 - exp(-rise)) / rise, 1.0 - 0.5 * rise, abs(rise) < 1e-3);
    return distance * start * min(mean, 50.0);
}

// Fog over a long path has the colour of the sky at the horizon in that direction. Fog over a short path has the mean
// colour of the sky on that side: the bright horizon around a low sun comes from the whole path to the horizon, most of
// which is missing here, or lies in the shadow of the terrain.
fn apply_fog(color: vec3<f32>, relative: vec3<f32>) -> vec3<f32> {
    let transmittance = exp(-light.fog_extinction * fog_optical_depth(relative));
    let direction = relative / max(length(relative), 1e-3);
    let mean = sky_irradiance(normalize(vec3(direction.x, max(direction.y, 0.4), direction.z)));
    let rim = sky_radiance(normalize(vec3(direction.x, max(direction.y, 0.03), direction.z)));
    let amount = 1.0 - transmittance.g;
    let inscatter = mix(mean, min(rim, 6.0 * mean), amount * amount);
    return color * transmittance + inscatter * (1.0 - transmittance);
}
