// Textures of signed values in bytes, of which 128 stands for 0 and 255 for 1: a device that reads blocks has them unsigned alone.
// The Rust twin is src/bake/levels/cross/signed_mips.rs.
#define_import_path canopy::signed_texel

fn signed_texel(texel: vec4<f32>) -> vec4<f32> {
    return texel * (255.0 / 127.0) - 128.0 / 127.0;
}
