// Unit vectors in an octahedral map [Cigolla et al. 2014]. The Rust twin is src/math/octahedral.rs.
#define_import_path canopy::octahedral

// Two snorm16; the pole of the map is +Y.
fn decode_octahedral_y(packed: u32) -> vec3<f32> {
    let e = unpack2x16snorm(packed);
    var n = vec3(e.x, 1.0 - abs(e.x) - abs(e.y), e.y);
    let t = max(-n.y, 0.0);
    n.x += select(t, -t, n.x >= 0.0);
    n.z += select(t, -t, n.z >= 0.0);
    return normalize(n);
}

// 0..1 in both; the pole of the map is +Z.
fn decode_octahedral(e: vec2<f32>) -> vec3<f32> {
    let f = e * 2.0 - 1.0;
    var n = vec3(f.x, f.y, 1.0 - abs(f.x) - abs(f.y));
    let t = max(-n.z, 0.0);
    n.x += select(t, -t, n.x >= 0.0);
    n.y += select(t, -t, n.y >= 0.0);
    return normalize(n);
}
