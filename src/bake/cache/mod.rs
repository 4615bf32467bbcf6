//! Baked plants on disk, keyed by the content that they were made from.
//!
//! The name of a file is the BLAKE3 hash of everything that the bake reads (meshes, materials, textures, settings)
//! and of the version of the bakes: a changed input has another file, so nothing ever has to be invalidated. A file
//! is used only if its magic, version, key, length and checksum agree (`codec.rs`); otherwise it counts as absent, and
//! is computed and written again. Files appear whole or not at all (written to a temporary name, then renamed), so any
//! number of processes may share a folder.
//!
//! The textures of full models are files of their own, keyed by image and use: plants that share an image share its file.
//!
//! Files of plants that are no longer used stay; the folder may be deleted at any time.

mod codec;
mod texture;

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::RgbaImage;

use super::baked::{BakeSettings, BakedPlant};
use super::error::BakeError;
use super::levels::{LevelSet, needs_textures};
use super::textures::PlantTextures;
use super::textures::filtered::FilteredTexture;
use crate::files;
use crate::plant::Plant;
pub use texture::TextureKey;

/// Identifier of a baked plant: a hash of all inputs of the bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CacheKey {
    hash: [u8; 32],
    /// The representations that it is baked for.
    representations: LevelSet,
}

impl CacheKey {
    /// Hashes everything that a bake of `plant` with `settings` reads. The plant's name and its normal
    /// textures are not included.
    pub fn new(plant: &Plant, settings: &BakeSettings) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&codec::VERSION.to_le_bytes());
        // Every field, every number to its last bit: no setting can be forgotten here. Numbers and enums can always be
        // written; if that ever changes, the key still tells settings apart.
        let representations = settings.representations;
        let settings = postcard::to_stdvec(settings).unwrap_or_else(|_| format!("{settings:?}").into_bytes());
        hasher.update(&(settings.len() as u64).to_le_bytes());
        hasher.update(&settings);
        plant.feed_baked_content(&mut hasher);
        let layered = plant.parts.iter().filter(|part| part.material.tissue.is_some());
        layered.for_each(|part| part.material.feed_tissue(&mut hasher));
        Self { hash: *hasher.finalize().as_bytes(), representations }
    }

    /// The key as 64 hexadecimal digits.
    pub fn to_hex(self) -> String {
        blake3::Hash::from_bytes(self.hash).to_hex().to_string()
    }
}

/// A folder with baked plants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// A cache in `folder`, which is created when the first plant is stored.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The user's cache: the folder `$CANOPY_CACHE` where that is set and not empty, else the folder `canopy` where the
    /// system keeps caches: `$XDG_CACHE_HOME` or `~/.cache` on Linux, `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on
    /// Windows. `None` if there is neither.
    pub fn of_user() -> Option<Self> {
        user_folder(std::env::var_os("CANOPY_CACHE"), dirs::cache_dir()).map(Self::new)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file that holds, or would hold, the plant with `key`.
    pub fn file(&self, key: &CacheKey) -> PathBuf {
        self.folder.join(key.to_hex()).with_extension("bake")
    }

    /// Loads the baked plant with `key`, the key of `plant`. `None` if there is none that is whole and of this version.
    /// Of its textures, those that are not in the cache are filtered again and stored.
    pub fn load(&self, key: &CacheKey, plant: &Arc<Plant>) -> Option<BakedPlant> {
        let bytes = files::read_ordinary(&self.file(key)).ok()?;
        let baked = codec::decode(&bytes, key, plant)?;
        let textures = if key.representations.iter().any(needs_textures) {
            PlantTextures::new(plant, Some(self)).0
        } else {
            PlantTextures::default()
        };
        Some(BakedPlant { textures: Arc::new(textures), ..baked })
    }

    /// Stores a baked plant under `key`, without its textures.
    ///
    /// # Errors
    /// [`BakeError::CacheFolder`] or [`BakeError::CacheWrite`] where the folder or the file cannot be written.
    pub fn store(&self, key: &CacheKey, baked: &BakedPlant) -> Result<(), BakeError> {
        let bytes = codec::encode(baked, &key.hash).ok_or_else(|| io::Error::other("it cannot be written as bytes"));
        self.write(self.file(key), bytes)
    }

    /// The file that holds, or would hold, the texture with `key`.
    pub fn texture_file(&self, key: &TextureKey) -> PathBuf {
        self.folder.join(key.to_hex()).with_extension("texture")
    }

    /// Loads the texture with `key`, the key of `image`. `None` if there is none that is whole and of this version.
    pub fn load_texture(&self, key: &TextureKey, image: &Arc<RgbaImage>) -> Option<FilteredTexture> {
        let bytes = files::read_ordinary(&self.texture_file(key)).ok()?;
        texture::decode(&bytes, key, image)
    }

    /// Stores a texture, filtered from `image`, under `key`.
    ///
    /// # Errors
    /// As [`store`](Self::store).
    pub fn store_texture(
        &self,
        key: &TextureKey,
        texture: &FilteredTexture,
        image: &RgbaImage,
    ) -> Result<(), BakeError> {
        self.write(self.texture_file(key), Ok(texture::encode(key, texture, image)))
    }

    fn write(&self, path: PathBuf, bytes: io::Result<Vec<u8>>) -> Result<(), BakeError> {
        std::fs::create_dir_all(&self.folder)
            .map_err(|source| BakeError::CacheFolder { path: self.folder.clone(), source })?;
        bytes
            .and_then(|bytes| files::replace(&path, |writer| writer.write_all(&bytes)))
            .map_err(|source| BakeError::CacheWrite { path, source })
    }
}

/// The folder that the environment asks for, else one in the system's own.
fn user_folder(asked: Option<OsString>, system: Option<PathBuf>) -> Option<PathBuf> {
    asked.filter(|folder| !folder.is_empty()).map(PathBuf::from).or_else(|| system.map(|caches| caches.join("canopy")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::lighting::{
        LightingSettings,
        implicit::{ImplicitSettings, NormalSource},
    };
    use crate::lod::Representation;

    #[test]
    fn the_folder_follows_the_environment() {
        let folder = |asked: Option<&str>, system: Option<&str>| {
            user_folder(asked.map(OsString::from), system.map(PathBuf::from))
        };
        assert_eq!(folder(None, None), None);
        assert_eq!(folder(Some(""), None), None);
        assert_eq!(folder(None, Some("/h/.cache")), Some("/h/.cache/canopy".into()));
        assert_eq!(folder(Some(""), Some("/x")), Some("/x/canopy".into()));
        assert_eq!(folder(Some("here"), Some("/x")), Some("here".into()));
        assert_eq!(folder(Some("here"), None), Some("here".into()));
    }

    #[test]
    fn every_setting_counts() {
        let plant = Plant::default();
        let base = BakeSettings::default();
        let expressive = |change: &dyn Fn(&mut ImplicitSettings)| {
            let mut settings = ImplicitSettings::default();
            change(&mut settings);
            BakeSettings { lighting: LightingSettings::Expressive(settings), ..base }
        };
        let mut changed = [base; 16];
        changed[0].lighting = LightingSettings::Local;
        changed[1] = expressive(&|settings| settings.radius = Some(0.1));
        changed[2] = expressive(&|settings| settings.radius = Some(0.1f32.next_up()));
        changed[3] = expressive(&|settings| settings.threshold = Some(0.1));
        changed[4] = expressive(&|settings| settings.normals = NormalSource::Gradient);
        changed[5].cross.resolution = 512;
        changed[6].cross.supersampling = 2;
        changed[7].cross.normal_smoothing = 0.01;
        changed[8].shadow_share = 0.5;
        changed[9].representations = [Representation::MODEL].into();
        changed[10].cloud.planes = 99;
        changed[11].cloud.turn = 0.25;
        changed[12].thinned.share = 0.5;
        changed[13].surface.share = 0.5;
        changed[14].surface.radius = 0.5;
        changed[15].cross.uprights = 3;
        let mut keys: Vec<String> =
            changed.iter().chain([&base]).map(|settings| CacheKey::new(&plant, settings).to_hex()).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 17);
    }
}
