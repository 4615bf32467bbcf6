// The common exit of all fragment shaders: applies fog and night vision to the light of a surface. Styles will go here.
#define_import_path canopy::output

#import canopy::frame::light
#import canopy::sky::apply_fog

// The colour of a surface at `relative` (metres from the camera) that sends `radiance` (exposed) to the viewer and
// covers the fraction `coverage` of the sample.
fn finish(relative: vec3<f32>, radiance: vec3<f32>, coverage: f32) -> vec4<f32> {
    return vec4(night_vision(apply_fog(radiance, relative)), coverage);
}

// The colour of the sky, whose radiance already includes the light of the air.
fn finish_sky(radiance: vec3<f32>) -> vec4<f32> {
    return vec4(night_vision(radiance), 1.0);
}

// The eye's loss of colour in the dark and its shift to blue [Jensen et al. 2000, eq. 4; Larson et al. 1997, eq. 10]:
// the twin of ScotopicTint::apply in src/light/exposure.rs. `color` is exposed. By day the amount is zero.
fn night_vision(color: vec3<f32>) -> vec3<f32> {
    let xyz = mat3x3<f32>(
        vec3(0.4124564, 0.2126729, 0.0193339),
        vec3(0.3575761, 0.7151522, 0.1191920),
        vec3(0.1804375, 0.0721750, 0.9503041),
    ) * color;
    let v = max(xyz.y * (1.33 * (1.0 + (xyz.y + xyz.z) / max(xyz.x, 1e-12)) - 1.68) / 2.573, 0.0);
    let nits = max(xyz.y / light.exposure, 1e-12);
    let sigma = clamp((log2(nits) * 0.30103 + 2.0) / 2.6, 0.0, 1.0);
    let rods = 1.0 - sigma * sigma * (3.0 - 2.0 * sigma);
    return mix(color, light.scotopic_tint * v, min(light.scotopic_amount, light.scotopic_strength * rods));
}
