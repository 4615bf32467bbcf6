// One direction of a Gaussian. Of identifiers it first makes four layers, one a channel [Luft 2006, 3.1]: 1 where a pixel is of the
// layer, else 0.

struct BlurJob {
    // From one point to the next, in texels: 3/8 of the standard deviation.
    step: vec2<f32>,
    // Texels of the source along the sides of a texel of the target.
    scale: vec2<f32>,
    first_layer: u32,
}

@group(0) @binding(0) var<uniform> job: BlurJob;
#ifdef IDENTITIES
@group(0) @binding(1) var source: texture_2d<u32>;
#else
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var linear_sampler: sampler;
#endif

struct Corner {
    @builtin(position) clip: vec4<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4(uv * 2.0 - 1.0, 0.0, 1.0));
}

const REACH: i32 = 8;

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let size = vec2<f32>(textureDimensions(source));
    var sum = vec4(0.0);
    var weights = 0.0;
    for (var i = -REACH; i <= REACH; i += 1) {
        let x = 0.375 * f32(i);
        let weight = exp(-0.5 * x * x);
        let at = in.clip.xy * job.scale + f32(i) * job.step;
#ifdef IDENTITIES
        let texel = vec2<i32>(clamp(at, vec2(0.0), size - 1.0));
        let layer = textureLoad(source, texel, 0).x - job.first_layer;
        sum += weight * select(vec4(0.0), vec4(1.0), vec4(layer) == vec4(0u, 1u, 2u, 3u));
#else
        sum += weight * textureSampleLevel(source, linear_sampler, at / size, 0.0);
#endif
        weights += weight;
    }
    return sum / weights;
}
