//! A texture that follows from the light.

use bevy::render::{
    render_resource::{Texture, TextureView},
    renderer::{RenderDevice, RenderQueue},
};
use half::f16;

use super::gpu;

/// A texture of half-float texels that is uploaded when its key changes.
pub struct LightTable<K> {
    texture: Texture,
    view: TextureView,
    label: &'static str,
    size: (u32, u32),
    /// The key of its texels.
    uploaded: Option<K>,
}

impl<K: PartialEq> LightTable<K> {
    /// A table of `size` texels without content.
    pub fn new(device: &RenderDevice, label: &'static str, size: (u32, u32)) -> Self {
        let (texture, view) = gpu::table(device, label, size);
        Self { texture, view, label, size, uploaded: None }
    }

    /// The texture, to be bound.
    pub fn view(&self) -> &TextureView {
        &self.view
    }

    /// Gives the texture another size, and no content; nothing if it has that size.
    pub fn resize(&mut self, device: &RenderDevice, size: (u32, u32)) {
        if size != self.size {
            *self = Self::new(device, self.label, size);
        }
    }

    /// Uploads `texels`, row by row, unless those of `key` are there; whether it did.
    pub fn update<T: AsRef<[[f16; 4]]>>(&mut self, queue: &RenderQueue, key: K, texels: impl FnOnce() -> T) -> bool {
        if self.uploaded.as_ref() == Some(&key) {
            return false;
        }
        self.write(queue, texels().as_ref());
        self.uploaded = Some(key);
        true
    }

    /// Uploads `texels` without a key.
    pub fn write(&self, queue: &RenderQueue, texels: &[[f16; 4]]) {
        let (width, height) = self.size;
        gpu::write_level(queue, &self.texture, 0, 0, width, height, 8, bytemuck::cast_slice(texels));
    }
}
