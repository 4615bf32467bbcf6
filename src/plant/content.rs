//! The content of a plant as bytes, for fingerprints.

use super::{LeafTextures, PartKind, Plant, PlantMaterial};

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
            // Only where there is one, so that plants without keep their fingerprints.
            if let Some(image) = &material.leaf_textures.transmission {
                list(b"transmission");
                list(&image.width().to_le_bytes());
                list(&image.height().to_le_bytes());
                list(image.as_raw());
            }
        }
    }
}

impl PlantMaterial {
    /// Feeds `hasher` with what only the layered leaf model reads.
    pub fn feed_tissue(&self, hasher: &mut blake3::Hasher) {
        let LeafTextures { back, transmission: _, thickness, absorption } = &self.leaf_textures;
        for image in [back, &self.normal_texture] {
            let texels = image.as_ref().map(|image| (image.width(), image.height(), image.as_raw()));
            feed_image(hasher, texels);
        }
        for image in [thickness, absorption] {
            feed_image(hasher, image.as_ref().map(|image| (image.width(), image.height(), image.as_raw())));
        }
        hasher.update(format!("{:?}", self.tissue).as_bytes());
    }
}

fn feed_image(hasher: &mut blake3::Hasher, image: Option<(u32, u32, &Vec<u8>)>) {
    let (width, height, texels) =
        image.map_or((0, 0, [].as_slice()), |(width, height, texels)| (width, height, texels));
    hasher.update(&width.to_le_bytes());
    hasher.update(&height.to_le_bytes());
    hasher.update(texels);
}
