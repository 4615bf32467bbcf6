//! The content of a plant as bytes, for fingerprints.

use super::{PartKind, Plant};

impl Plant {
    /// Feeds `hasher` with everything that a bake or a ray tracer reads of the plant. Not among it: its name, its
    /// normal textures and the roughness of its leaves' gloss.
    pub fn feed_baked_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(&(self.parts.len() as u64).to_le_bytes());
        for part in &self.parts {
            // Every list goes with its length, so that no two plants give the same stream of bytes.
            let mut list = |bytes: &[u8]| {
                hasher.update(&(bytes.len() as u64).to_le_bytes());
                hasher.update(bytes);
            };
            let (mesh, material) = (&part.mesh, &part.material);
            list(&[match part.kind {
                PartKind::Wood => 0,
                PartKind::Foliage => 1,
            }]);
            list(bytemuck::cast_slice(&mesh.positions));
            list(bytemuck::cast_slice(&mesh.normals));
            list(bytemuck::cast_slice(&mesh.uvs));
            list(bytemuck::cast_slice(&mesh.triangles));
            list(bytemuck::bytes_of(&material.base_color));
            list(bytemuck::bytes_of(&material.alpha_cutoff));
            list(bytemuck::bytes_of(&material.transmission));
            list(bytemuck::bytes_of(&material.gloss.reflectance));
            match &material.base_color_texture {
                Some(image) => {
                    list(&image.width().to_le_bytes());
                    list(&image.height().to_le_bytes());
                    list(image.as_raw());
                }
                None => list(&[]),
            }
        }
    }
}
