// The sky behind everything: the radiance table, the sun's and the moon's disc, stars.
#import canopy::constants::LUX_OF_MAGNITUDE_0
#import canopy::frame::{frame, light}
#import canopy::output::finish_sky
#import canopy::sky::sky_radiance

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) ndc: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let uv = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    var out: Varying;
    out.ndc = uv * 2.0 - 1.0;
    // Reversed depth: infinitely far is 0.
    out.clip = vec4(out.ndc, 0.0, 1.0);
    return out;
}

// Coverage of a disc around `center`, of which `disc_cosine` is the cosine of the angular radius.
fn disc(direction: vec3<f32>, center: vec3<f32>, disc_cosine: f32) -> f32 {
    let cosine = dot(direction, center);
    // The edge is soft over the angle of one pixel.
    let angle = sqrt(max(2.0 - 2.0 * cosine, 0.0));
    let radius = sqrt(max(2.0 - 2.0 * disc_cosine, 0.0));
    let pixel = 1.0 / frame.focal_length_pixels;
    return 1.0 - smoothstep(radius - pixel, radius + pixel, angle);
}

// PCG hash [Jarzynski & Olano 2020], the twin of src/light/night.rs.
fn pcg(state: u32) -> u32 {
    let s = state * 747796405u + 2891336453u;
    let w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}

fn unit(h: u32) -> f32 {
    return f32(h >> 8u) / 16777216.0;
}

// Radiance of the procedural star field, exposed: at most one star in each cell of a cube grid.
fn stars(direction: vec3<f32>) -> vec3<f32> {
    let d = light.star_frame[0] * direction.x + light.star_frame[1] * direction.y + light.star_frame[2] * direction.z;
    let a = abs(d);
    var face = 0u;
    var st = vec2(0.0);
    if a.x >= a.y && a.x >= a.z {
        face = select(1u, 0u, d.x > 0.0);
        st = d.yz / a.x;
    } else if a.y >= a.z {
        face = select(3u, 2u, d.y > 0.0);
        st = d.xz / a.y;
    } else {
        face = select(5u, 4u, d.z > 0.0);
        st = d.xy / a.z;
    }
    let n = light.star_cells;
    let position = clamp((st * 0.5 + 0.5) * n, vec2(0.0), vec2(n - 0.001));
    let cell = vec2<u32>(position);
    let edge = u32(n);
    var h = pcg(((face * edge + cell.y) * edge + cell.x) ^ light.star_seed);
    if unit(h) >= light.star_density {
        return vec3(0.0);
    }
    h = pcg(h);
    let x = 0.15 + 0.7 * unit(h);
    h = pcg(h);
    let y = 0.15 + 0.7 * unit(h);
    h = pcg(h);
    let magnitude = max(6.5 + 2.0 * log(max(unit(h), 1e-6)) / log(10.0), -1.5);
    h = pcg(h);
    let warm = mix(vec3(1.15, 0.98, 0.80), vec3(0.85, 0.97, 1.25), unit(h));
    // Angle per cell at the face's middle; a star is as large as a pixel.
    let offset = (position - floor(position) - vec2(x, y)) * (2.0 / n);
    let blur = max(0.8 / frame.focal_length_pixels, 0.0006);
    let radiance = LUX_OF_MAGNITUDE_0 * exp2(-1.3287712 * magnitude) / (3.14159 * blur * blur);
    return warm * radiance * exp(-dot(offset, offset) / (blur * blur)) * light.exposure;
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let far = frame.relative_from_clip * vec4(in.ndc, 0.5, 1.0);
    let direction = normalize(far.xyz / far.w);
    var color = sky_radiance(direction);
    let above = smoothstep(-0.004, 0.004, direction.y);
    color += disc(direction, light.sun_direction, light.sun_disc_cosine) * light.sun_radiance * above;
    let moon = disc(direction, light.moon_direction, light.moon_disc_cosine);
    color += moon * light.moon_radiance * above;
    color += stars(direction) * above * (1.0 - moon) * smoothstep(0.0, 0.25, direction.y);
    return finish_sky(min(color, vec3(6.0e4)));
}
