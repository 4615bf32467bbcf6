// Hashes of whole numbers. The Rust twin is src/math/hash.rs.
#define_import_path canopy::hash

// lowbias32 [Wellons 2018].
fn mix32(value: u32) -> u32 {
    var x = value ^ (value >> 16u);
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}
