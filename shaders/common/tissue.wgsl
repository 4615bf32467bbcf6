// How the light of a leaf with a tissue changes with the angle [Franzke 2005, 3.2]: the layered model in real time.
#define_import_path canopy::tissue

// Factors on light over its cosine to the leaf, on the side that is seen and on the other: polynomials, constant first.
struct Tissue {
    // On light that is sent back.
    reflected: vec4<f32>,
    // On light that enters on one side and comes out on the other, at the side that is seen, and there.
    transmitted: vec4<f32>,
    entering: vec4<f32>,
}

// A polynomial at a cosine; the least value is that of AngleFactor.
fn factor_at(polynomial: vec4<f32>, cosine: f32) -> f32 {
    return max(((polynomial.w * cosine + polynomial.z) * cosine + polynomial.y) * cosine + polynomial.x, 1e-3);
}

// The mean over even light.
fn factor_mean(polynomial: vec4<f32>) -> f32 {
    return max(dot(polynomial, vec4(1.0, 2.0 / 3.0, 0.5, 0.4)), 1e-3);
}

// Factors on the light at the cosine `to_light`, seen at the cosine `to_viewer`, from before and from behind. The twin of
// TissueLight::factors in src/plant/tissue_light.rs.
fn tissue_light(tissue: Tissue, to_viewer: f32, to_light: f32) -> vec2<f32> {
    let seen = vec2(factor_at(tissue.reflected, to_viewer), factor_at(tissue.transmitted, to_viewer));
    return seen * vec2(factor_at(tissue.reflected, to_light), factor_at(tissue.entering, to_light));
}

// The same in even light.
fn tissue_sky(tissue: Tissue, to_viewer: f32) -> vec2<f32> {
    let seen = vec2(factor_at(tissue.reflected, to_viewer), factor_at(tissue.transmitted, to_viewer));
    return seen * vec2(factor_mean(tissue.reflected), factor_mean(tissue.entering));
}
