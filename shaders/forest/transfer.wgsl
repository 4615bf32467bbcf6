// Radiance transfer [Franzke 2005, 4.2.3]: the twin of src/bake/lighting/transfer/evaluate.rs on coefficients that
// src/bake/lighting/transfer/pack.rs packed.
#define_import_path canopy::transfer

#import canopy::constants::{LIGHT_STRIDE, TRANSFER_WORDS}
#ifdef SUN_HARMONICS
#import canopy::constants::YAWS
#endif
#import canopy::frame::light
#import canopy::stand::{StandLight, in_stand_by_transfer, evaluate_two_bands}

struct Transfer {
    // Scale of each coefficient after the first, relative to it: the value of code 127; four per word of codes.
    scale: array<vec4<f32>, TRANSFER_WORDS>,
    // Words from one vertex to the next.
    vertex_words: u32,
    // Number of words of a vertex's means, which come first.
    mean_words: u32,
    // Words of the codes of one side and channel.
    side_words: u32,
    // Index of the first code of the indirect key light, one word per vertex.
    indirect_sun_start: u32,
    // Colour of the indirect key light, which is scattered between leaves.
    indirect_sun_color: vec3<f32>,
    // Scale of its codes: the value of code 127.
    indirect_sun_scale: f32,
}

// Irradiance over pi on the side of a vertex's normal and on the other.
struct Sides {
    front: vec3<f32>,
    back: vec3<f32>,
}

// The light of the surroundings per yaw, then, if a plant needs it, that of the sun.
@group(3) @binding(0) var<storage, read> light_by_yaw: array<vec4<f32>>;
@group(3) @binding(1) var<storage, read> coefficients: array<u32>;
// Not a uniform: its values control loops, and lavapipe compiles a shader again for every binding of such a uniform
// buffer.
@group(3) @binding(2) var<storage, read> transfer: Transfer;

// Decodes a non-negative half float from its bits: not every device has unpack2x16float.
fn mean_at(vertex: u32, index: u32) -> f32 {
    let bits = extractBits(coefficients[vertex + index / 2u], 16u * (index % 2u), 15u);
    return bitcast<f32>(bits << 13u) * 5.192297e33;
}

// Four coefficients of the light of a row, for each channel.
struct LightWord {
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
}

fn light_word(index: u32) -> LightWord {
    return LightWord(light_by_yaw[index], light_by_yaw[index + 1u], light_by_yaw[index + 2u]);
}

// Four coefficients of a side, relative to the first.
struct SideWord {
    red: vec4<f32>,
#ifdef TRANSFER_COLOR
    green: vec4<f32>,
    blue: vec4<f32>,
#endif
}

// Their codes are in `word`, and in words `stride` further on for green and blue if the transfer is coloured.
fn side_word(word: u32, stride: u32, scale: vec4<f32>) -> SideWord {
    var out: SideWord;
    out.red = unpack4x8snorm(coefficients[word]) * scale;
#ifdef TRANSFER_COLOR
    out.green = unpack4x8snorm(coefficients[word + stride]) * scale;
    out.blue = unpack4x8snorm(coefficients[word + 2u * stride]) * scale;
#endif
    return out;
}

fn product(side: SideWord, light: LightWord) -> vec3<f32> {
#ifdef TRANSFER_COLOR
    return vec3(dot(side.red, light.red), dot(side.green, light.green), dot(side.blue, light.blue));
#else
    return vec3(dot(side.red, light.red), dot(side.red, light.green), dot(side.red, light.blue));
#endif
}

// Means of both sides, and the vectors of their second band, one for each channel, relative to them, in the plant's frame.
struct Means {
    front: vec3<f32>,
    front_band: mat3x3<f32>,
    back: vec3<f32>,
    back_band: mat3x3<f32>,
}

fn means(vertex: u32) -> Means {
    let first = vertex * transfer.vertex_words;
    let codes = first + transfer.mean_words;
    let words = transfer.side_words;
    var out: Means;
#ifdef TRANSFER_COLOR
    out.front = vec3(mean_at(first, 0u), mean_at(first, 1u), mean_at(first, 2u));
    out.front_band = mat3x3(band(codes), band(codes + words), band(codes + 2u * words));
    out.back = vec3(mean_at(first, 3u), mean_at(first, 4u), mean_at(first, 5u));
    out.back_band = mat3x3(band(codes + 3u * words), band(codes + 4u * words), band(codes + 5u * words));
#else
    out.front = vec3(mean_at(first, 0u));
    let front = band(codes);
    out.front_band = mat3x3(front, front, front);
    out.back = vec3(mean_at(first, 1u));
    let back = band(codes + words);
    out.back_band = mat3x3(back, back, back);
#endif
    return out;
}

// The vector of the second band of a side and channel whose first codes are in `word`.
fn band(word: u32) -> vec3<f32> {
    let codes = unpack4x8snorm(coefficients[word]).xyz * transfer.scale[0].xyz;
    return vec3(-codes.x, codes.y, -codes.z);
}

// Irradiance of the surroundings on both sides of a vertex of a tree in a stand, from that in the open. `hidden_direction`: that of the stand
// in the plant's frame.
fn sides_in_stand(vertex: u32, open: Sides, hidden_direction: vec3<f32>, stand: StandLight) -> Sides {
    let own = means(vertex);
    var sides: Sides;
    sides.front = in_stand_by_transfer(open.front, own.front, own.front_band, hidden_direction, stand);
#ifdef FOLIAGE
    sides.back = in_stand_by_transfer(open.back, own.back, own.back_band, hidden_direction, stand);
#endif
    return sides;
}

// Irradiance over pi of the indirect key light at a vertex: what the leaves around it scatter, the same on both of its
// sides, where nothing else is in the way. `to_light`: in the plant's frame.
fn indirect_sun(vertex: u32, to_light: vec3<f32>) -> vec3<f32> {
    let codes = unpack4x8snorm(coefficients[transfer.indirect_sun_start + vertex]) * transfer.indirect_sun_scale;
    let band = codes.z * to_light.y - codes.y * to_light.x - codes.w * to_light.z;
    return light.key_illuminance * transfer.indirect_sun_color * evaluate_two_bands(codes.x, band);
}

// Irradiance over pi on the sides of a vertex by the surroundings and by the sun.
struct OpenLight {
    sky: Sides,
    sun: Sides,
}

// Without neighbours, in the light for a tree's yaw. The rows of the sun come YAWS after those of the surroundings. Both lights are summed
// in one loop, so that each word of coefficients is read once.
fn open_light(vertex: u32, yaw: u32) -> OpenLight {
    let first = vertex * transfer.vertex_words;
    let codes = first + transfer.mean_words;
    let words = transfer.side_words;
    let sky_row = yaw * LIGHT_STRIDE;
    var open: OpenLight;
    open.sky.front = light_by_yaw[sky_row].rgb;
#ifdef SUN_HARMONICS
    let sun_row = sky_row + YAWS * LIGHT_STRIDE;
    open.sun.front = light_by_yaw[sun_row].rgb;
#endif
#ifdef FOLIAGE
#ifdef TRANSFER_COLOR
    let other = 3u * words;
#else
    let other = words;
#endif
    open.sky.back = open.sky.front;
    open.sun.back = open.sun.front;
#endif
    for (var k = 0u; k < words; k += 1u) {
        let sky = light_word(sky_row + 1u + 3u * k);
        let front = side_word(codes + k, words, transfer.scale[k]);
        open.sky.front += product(front, sky);
#ifdef FOLIAGE
        let back = side_word(codes + other + k, words, transfer.scale[k]);
        open.sky.back += product(back, sky);
#endif
#ifdef SUN_HARMONICS
        let sun = light_word(sun_row + 1u + 3u * k);
        open.sun.front += product(front, sun);
#ifdef FOLIAGE
        open.sun.back += product(back, sun);
#endif
#endif
    }
#ifdef TRANSFER_COLOR
    let front_mean = vec3(mean_at(first, 0u), mean_at(first, 1u), mean_at(first, 2u));
#else
    let front_mean = vec3(mean_at(first, 0u));
#endif
    // With few bands the sum can be negative where almost no light arrives.
    open.sky.front = max(open.sky.front * front_mean, vec3(0.0));
    open.sun.front = max(open.sun.front * front_mean, vec3(0.0));
#ifdef FOLIAGE
#ifdef TRANSFER_COLOR
    let back_mean = vec3(mean_at(first, 3u), mean_at(first, 4u), mean_at(first, 5u));
#else
    let back_mean = vec3(mean_at(first, 1u));
#endif
    open.sky.back = max(open.sky.back * back_mean, vec3(0.0));
    open.sun.back = max(open.sun.back * back_mean, vec3(0.0));
#endif
    return open;
}
