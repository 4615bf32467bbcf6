//! The textures of a plant's full model with the mip levels that its renderer samples.
//!
//! Filtering is expensive: half a second for a leaf texture of 1024², three for one of 4096² ([`crate::plant::texture`]).
//! So it is a bake, and its results are kept on disk, each in a file of its own: the key is the content of the image and
//! its use, so plants that share an image share the file. Plants of one process share them in memory too, for as long as
//! any of them is in use, so a renderer finds equal textures by pointer equality.

pub(super) mod filtered;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use image::RgbaImage;
use rayon::prelude::*;

use super::cache::{Cache, TextureKey};
use super::error::BakeError;
use crate::plant::tissue_light::TissueLight;
use crate::plant::{PartKind, Plant, PlantPart};
pub use filtered::{FilteredTexture, TextureUse};

/// The textures of one part of a plant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartTextures {
    /// The base colour; `None` without a texture.
    pub color: Option<Arc<FilteredTexture>>,
    /// The normal map; `None` without one.
    pub normals: Option<Arc<FilteredTexture>>,
    /// The colour of the back of leaves; `None` where it is that of the front.
    pub back: Option<Arc<FilteredTexture>>,
    /// What comes through leaves; `None` where it follows from the front.
    pub transmission: Option<Arc<FilteredTexture>>,
    /// The tissue of leaves with layers.
    pub tissue: Option<TissueLight>,
}

/// The textures of a plant's full model, one entry for each part. Empty where they were not asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlantTextures(pub Vec<PartTextures>);

impl PlantTextures {
    /// The textures of `plant`, from other plants of this process or from `cache` where they are there, else filtered
    /// and stored in `cache`. The result is the same wherever it comes from. The error says why one could not be
    /// stored.
    pub fn new(plant: &Plant, cache: Option<&Cache>) -> (Self, Option<BakeError>) {
        let images: Vec<PartImages> = plant.parts.iter().map(PartImages::of).collect();
        let jobs: Vec<(Arc<RgbaImage>, TextureUse)> = images.iter().flat_map(PartImages::jobs).collect();
        let made: Vec<_> = jobs
            .par_iter()
            .map(|(image, usage)| shared(TextureKey::new(image, *usage), image, *usage, cache))
            .collect();
        let (mut made, mut error) = (made.into_iter(), None);
        let mut next = |wanted: bool| {
            let (texture, failed) = if wanted { made.next()? } else { return None };
            error = error.take().or(failed);
            Some(texture)
        };
        let part = |(images, part): (&PartImages, &PlantPart)| {
            let [color, normals, back, transmission] = [0, 1, 2, 3].map(|role| next(images.0[role].is_some()));
            let tissue = TissueLight::new(&part.material).filter(|_| part.kind == PartKind::Foliage);
            PartTextures { color, normals, back, transmission, tissue }
        };
        let textures = Self(images.iter().zip(&plant.parts).map(part).collect());
        (textures, error)
    }
}

/// Filters the textures of `plants`, each image once, so that bakes which follow in parallel find them: hold the result
/// until these are done. Errors are left to the bakes.
pub fn filter_together<'a>(
    plants: impl IntoIterator<Item = &'a Plant>,
    cache: Option<&Cache>,
) -> Vec<Arc<FilteredTexture>> {
    let images = |plant: &'a Plant| plant.parts.iter().map(PartImages::of);
    let mut jobs: Vec<_> =
        plants.into_iter().flat_map(images).flat_map(|images| images.jobs().collect::<Vec<_>>()).collect();
    jobs.dedup_by(|(a, of_a), (b, of_b)| Arc::ptr_eq(a, b) && of_a == of_b);
    let keys: Vec<TextureKey> = jobs.par_iter().map(|(image, usage)| TextureKey::new(image, *usage)).collect();
    let unique: HashMap<TextureKey, (Arc<RgbaImage>, TextureUse)> = keys.into_iter().zip(jobs).collect();
    unique.par_iter().map(|(key, (image, usage))| shared(*key, image, *usage, cache).0).collect()
}

/// The images of a part with their use: base colour, normals, back, transmission.
struct PartImages([Option<(Arc<RgbaImage>, TextureUse)>; 4]);

impl PartImages {
    fn of(part: &PlantPart) -> Self {
        let material = &part.material;
        let foliage = part.kind == PartKind::Foliage;
        let color = if foliage { TextureUse::Leaf { cutoff: material.alpha_cutoff } } else { TextureUse::Color };
        let with = |image: &Option<Arc<RgbaImage>>, usage| image.clone().map(|image| (image, usage));
        // Without a tissue the given image itself, so that plants share it.
        let through = match (&material.tissue, &material.leaf_textures.transmission) {
            (None, given) => given.clone(),
            _ => material.light_through().map(Arc::new),
        };
        let leaf = |image: &Option<Arc<RgbaImage>>| with(image, TextureUse::Color).filter(|_| foliage);
        Self([
            with(&material.base_color_texture, color),
            with(&material.normal_texture, TextureUse::Normals),
            leaf(&material.leaf_textures.back),
            leaf(&through),
        ])
    }

    fn jobs(&self) -> impl Iterator<Item = (Arc<RgbaImage>, TextureUse)> + '_ {
        self.0.iter().flatten().cloned()
    }
}

/// The textures that are in use somewhere in the process.
static IN_USE: Mutex<Option<HashMap<TextureKey, Weak<FilteredTexture>>>> = Mutex::new(None);

fn in_use() -> MutexGuard<'static, Option<HashMap<TextureKey, Weak<FilteredTexture>>>> {
    IN_USE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The texture of `image` for `usage`, and why it could not be stored.
///
/// Two threads that ask for the same new one at the same time both filter it, and share the first result. Neither may
/// wait for the other: filtering itself waits for rayon's threads, which may be those that wait.
fn shared(
    key: TextureKey,
    image: &Arc<RgbaImage>,
    usage: TextureUse,
    cache: Option<&Cache>,
) -> (Arc<FilteredTexture>, Option<BakeError>) {
    let known = in_use().as_ref().and_then(|textures| textures.get(&key)).and_then(Weak::upgrade);
    let store = |texture: &FilteredTexture| cache.and_then(|cache| cache.store_texture(&key, texture, image).err());
    if let Some(known) = known {
        // Another plant may have been baked without a cache, or with another one.
        let missing = cache.is_some_and(|cache| !cache.texture_file(&key).exists());
        let error = if missing { store(&known) } else { None };
        return (known, error);
    }
    let mut error = None;
    let loaded = cache.and_then(|cache| cache.load_texture(&key, image));
    let texture = loaded.unwrap_or_else(|| {
        let texture = FilteredTexture::new(image, usage);
        error = store(&texture);
        texture
    });
    let mut textures = in_use();
    let textures = textures.get_or_insert_default();
    if let Some(known) = textures.get(&key).and_then(Weak::upgrade) {
        return (known, error);
    }
    textures.retain(|_, texture| texture.strong_count() > 0);
    let texture = Arc::new(texture);
    textures.insert(key, Arc::downgrade(&texture));
    (texture, error)
}
