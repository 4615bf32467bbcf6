// Radiance transfer [Franzke 2005, 4.2.3]: the twin of src/bake/lighting/transfer/evaluate.rs on coefficients that
// src/bake/lighting/transfer/pack.rs packed.
#define_import_path canopy::transfer

#import canopy::constants::{LIGHT_STRIDE, TRANSFER_WORDS}
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

// Irradiance over pi by four coefficients of the light on a side whose codes for them are in `word`, and in words
// `stride` further on for green and blue if the transfer is coloured.
fn irradiance_by_word(word: u32, stride: u32, scale: vec4<f32>, light: u32) -> vec3<f32> {
    let red = unpack4x8snorm(coefficients[word]) * scale;
#ifdef TRANSFER_COLOR
    let green = unpack4x8snorm(coefficients[word + stride]) * scale;
    let blue = unpack4x8snorm(coefficients[word + 2u * stride]) * scale;
#else
    let green = red;
    let blue = red;
#endif
    return vec3(dot(red, light_by_yaw[light]), dot(green, light_by_yaw[light + 1u]), dot(blue, light_by_yaw[light + 2u]));
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

// Irradiance of the surroundings on both sides of a vertex of a tree in a stand. `hidden_direction`: that of the stand in the plant's frame.
fn light_in_stand(vertex: u32, yaw: u32, hidden_direction: vec3<f32>, stand: StandLight) -> Sides {
    let open = light_sides(vertex, yaw);
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

// Irradiance over pi that the light of a row brings to the sides of a vertex. The row is the tree's yaw for the
// surroundings, YAWS more for the sun.
fn light_sides(vertex: u32, row: u32) -> Sides {
    let first = vertex * transfer.vertex_words;
    let codes = first + transfer.mean_words;
    let words = transfer.side_words;
    let light = row * LIGHT_STRIDE;
    var sides: Sides;
    sides.front = light_by_yaw[light].rgb;
#ifdef TRANSFER_COLOR
    let other = 3u * words;
#else
    let other = words;
#endif
#ifdef FOLIAGE
    sides.back = sides.front;
#endif
    for (var k = 0u; k < words; k += 1u) {
        let at = light + 1u + 3u * k;
        sides.front += irradiance_by_word(codes + k, words, transfer.scale[k], at);
#ifdef FOLIAGE
        sides.back += irradiance_by_word(codes + other + k, words, transfer.scale[k], at);
#endif
    }
    // With few bands the sum can be negative where almost no light arrives.
#ifdef TRANSFER_COLOR
    sides.front = max(sides.front * vec3(mean_at(first, 0u), mean_at(first, 1u), mean_at(first, 2u)), vec3(0.0));
#else
    sides.front = max(sides.front * mean_at(first, 0u), vec3(0.0));
#endif
#ifdef FOLIAGE
#ifdef TRANSFER_COLOR
    sides.back = max(sides.back * vec3(mean_at(first, 3u), mean_at(first, 4u), mean_at(first, 5u)), vec3(0.0));
#else
    sides.back = max(sides.back * mean_at(first, 1u), vec3(0.0));
#endif
#endif
    return sides;
}
