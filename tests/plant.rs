//! Plant textures and glTF import.

#[path = "plant/gltf.rs"]
mod gltf;
#[path = "plant/kinds.rs"]
mod kinds;
#[path = "plant/texture.rs"]
mod texture;
