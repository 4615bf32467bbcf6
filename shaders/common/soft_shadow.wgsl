// Soft shadow of the key light by the blurred depth test [Luft 2006, 2 and 3.3].
#define_import_path canopy::soft_shadow

#import canopy::frame::{shadow, shadow_map}
#import canopy::sun_visibility::map_position

// Light by the blurred depth test [Luft 2006, eq. 5] in the cascade `index`: the map's depths under a Gaussian of 5 x 5 points, then
// the smooth step over the band of +-`softness` metres.
fn soft_visibility(index: i32, relative: vec3<f32>, normal: vec3<f32>, softness: f32) -> f32 {
    let cascade = shadow.cascades[index];
    let map = map_position(index, relative, normal, 2.0);
    let size = textureDimensions(shadow_map);
    let center = map.xy * vec2<f32>(size);
    // A quarter of the band, as wide as the softness is deep.
    let step = max(0.5 * softness / max(cascade.texel, 1e-4), 1.0) * 0.5;
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -2; y <= 2; y += 1) {
        for (var x = -2; x <= 2; x += 1) {
            let at = center + vec2(f32(x), f32(y)) * step;
            let texel = clamp(vec2<i32>(at), vec2(0), vec2<i32>(size) - 1);
            let weight = exp2(-0.4 * f32(x * x + y * y));
            sum += weight * textureLoad(shadow_map, texel, index, 0);
            weights += weight;
        }
    }
    let m = cascade.map_from_relative;
    let per_metre = length(vec3(m[0].z, m[1].z, m[2].z));
    let delta = max(softness * per_metre, 1e-6);
    // The map's depth is reversed: nearer to the light is greater. Half the band keeps lit surfaces lit.
    return smoothstep(-delta, delta, map.z - sum / weights + 0.5 * delta);
}
