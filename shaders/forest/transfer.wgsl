// Radiance transfer [Franzke 2005, 4.2.3]: the twin of src/bake/transfer/evaluate.rs on coefficients that
// src/bake/transfer/pack.rs packed.
#define_import_path canopy::transfer

struct Transfer {
    // What 127 stands for in each band, relative to the first coefficient.
    scale: array<vec4<f32>, 2>,
    // Words from one vertex to the next, bytes from one side to the other, bands, channels.
    form: vec4<u32>,
}

// Coefficients from one yaw's light to the next.
const STRIDE: u32 = 36u;
// The first row of the sun's light.
const SUN_ROWS: u32 = 256u;

// The surroundings' light as a plant of each yaw sees it, then, where a plant wants it, the sun's.
@group(3) @binding(0) var<storage, read> turned_light: array<vec4<f32>>;
@group(3) @binding(1) var<storage, read> coefficients: array<u32>;
// No uniform: its values steer loops, and lavapipe compiles a shader again for every binding of such a buffer.
@group(3) @binding(2) var<storage, read> transfer: Transfer;

fn snorm_at(byte: u32) -> f32 {
    return f32(extractBits(bitcast<i32>(coefficients[byte / 4u]), 8u * (byte % 4u), 8u)) / 127.0;
}

// A half that is not negative, by its bits: unpack2x16float is not on every device.
fn half_at(byte: u32) -> f32 {
    let bits = extractBits(coefficients[byte / 4u], 8u * (byte % 4u), 15u);
    return bitcast<f32>(bits << 13u) * 5.192297e33;
}

// Irradiance over pi that the light of a row brings to a side of a vertex: 0 the normal's, 1 the other. The row is the
// tree's yaw for the surroundings, SUN_ROWS more for the sun.
fn side_light(vertex: u32, side: u32, row: u32) -> vec3<f32> {
    let channels = transfer.form.w;
    let colored = channels == 3u;
    let first = 4u * vertex * transfer.form.x + side * transfer.form.y;
    var mean = vec3(half_at(first));
    if colored {
        mean = vec3(mean.x, half_at(first + 2u), half_at(first + 4u));
    }
    let light = row * STRIDE;
    var sum = turned_light[light].rgb;
    var byte = first + 2u * channels;
    for (var band = 1u; band < transfer.form.z; band += 1u) {
        let scale = transfer.scale[band / 4u][band % 4u];
        for (var i = band * band; i < (band + 1u) * (band + 1u); i += 1u) {
            var value = vec3(snorm_at(byte));
            if colored {
                value = vec3(value.x, snorm_at(byte + 1u), snorm_at(byte + 2u));
            }
            sum += turned_light[light + i].rgb * value * scale;
            byte += channels;
        }
    }
    // A few bands can fall below zero where next to nothing arrives.
    return max(sum * mean, vec3(0.0));
}
