//! Plant textures and glTF import.

#[path = "plant/gltf.rs"]
mod gltf;
#[path = "plant/texture.rs"]
mod texture;
