// Code that all casters of a cascade share.
#define_import_path canopy::caster

struct CascadeView {
    // Metres relative to the box's centre to the map's clip space, reversed depth.
    clip_from_anchor: mat4x4<f32>,
    // Unit vector to the light.
    direction: vec3<f32>,
}

@group(0) @binding(0) var<uniform> cascade: CascadeView;

// Casters between the light and the box are clamped onto its near plane: they cast although they are outside. Casters
// behind the box are clamped onto its far plane, where they shade nothing: dropping them would require clipping.
fn clamp_caster(position: vec3<f32>) -> vec4<f32> {
    var clip = cascade.clip_from_anchor * vec4(position, 1.0);
    clip.z = clamp(clip.z, 0.0, 1.0);
    return clip;
}
