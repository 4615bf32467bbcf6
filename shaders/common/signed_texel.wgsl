// Signed values as unsigned bytes: 128 is 0, and 255 is 1. BC7 has no signed form, so all such textures are stored this way.
// The Rust twin is src/bake/levels/cross/signed_mips.rs.
#define_import_path canopy::signed_texel

fn signed_texel(texel: vec4<f32>) -> vec4<f32> {
    return texel * (255.0 / 127.0) - 128.0 / 127.0;
}
