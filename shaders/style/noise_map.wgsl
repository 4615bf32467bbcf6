// Noise that is broad enough for a coarser map: middle, broad, of clouds.
#import canopy::style::{style, full_screen, FullScreen}
#import canopy::style_noise::{anchored_noise, noise_place}

@group(1) @binding(1) var depths: texture_depth_2d;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> FullScreen {
    return full_screen(index);
}

@fragment
fn fragment(in: FullScreen) -> @location(0) vec4<f32> {
    let texel = vec2<i32>(clamp(in.uv * style.map_size, vec2(0.0), style.map_size - 1.0));
    let place = noise_place(in.uv, textureLoad(depths, texel, 0));
    let middle = anchored_noise(place.position, place.pixel * 22.0, 2u);
    let broad = anchored_noise(place.position, place.pixel * 70.0, 1u);
    let cloud = anchored_noise(place.position * vec3(1.0, 1.8, 1.0), place.pixel * 190.0, 5u);
    return vec4(middle, broad, cloud, 0.0);
}
