// One direction of a Gaussian. Of identifiers it first makes four layers, one a channel [Luft 2006, 3.1]: 1 where a pixel is of the
// layer, else 0.

#import canopy::style::split_depth

struct BlurJob {
    // From one point of the Gaussian to the next, in texels of the source.
    step: vec2<f32>,
    // Texels of the source along the sides of a texel of the target.
    scale: vec2<f32>,
    // From one point to the next, in standard deviations.
    spacing: f32,
    first_layer: u32,
    // 1: the third and fourth channel are a depth in two values.
    splits_depth: u32,
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

// Points on either side. Their number is fixed, as a branch on uniforms alone is slow (docs/decisions/0002-no-branch-on-uniforms-alone.md).
#ifdef IDENTITIES
const POINTS: i32 = 8;
#else
const POINTS: i32 = 10;
#endif

fn weight(point: i32) -> f32 {
    let x = f32(point) * job.spacing;
    return exp(-0.5 * x * x);
}

fn value(at: vec2<f32>, size: vec2<f32>) -> vec4<f32> {
#ifdef IDENTITIES
    let texel = vec2<i32>(clamp(at, vec2(0.0), size - 1.0));
    let layer = textureLoad(source, texel, 0).x - job.first_layer;
    return select(vec4(0.0), vec4(1.0), vec4(layer) == vec4(0u, 1u, 2u, 3u));
#else
    return textureSampleLevel(source, linear_sampler, at / size, 0.0);
#endif
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let size = vec2<f32>(textureDimensions(source));
    let center = in.clip.xy * job.scale;
    var sum = value(center, size);
    var weights = 1.0;
#ifdef IDENTITIES
    for (var i = 1; i <= POINTS; i += 1) {
        let offset = f32(i) * job.step;
        let each = weight(i);
        sum += each * (value(center + offset, size) + value(center - offset, size));
        weights += 2.0 * each;
    }
#else
    // Two points a lookup: between texels a bilinear lookup is the weighted mean of both [Rákos 2010].
    for (var i = 1; i < POINTS; i += 2) {
        let farther = weight(i + 1);
        let both = weight(i) + farther;
        let offset = (f32(i) + farther / max(both, 1e-30)) * job.step;
        sum += both * (value(center + offset, size) + value(center - offset, size));
        weights += 2.0 * both;
    }
#endif
    let mean = sum / weights;
    return select(mean, vec4(mean.xy, split_depth(mean.z + mean.w)), job.splits_depth > 0u);
}
