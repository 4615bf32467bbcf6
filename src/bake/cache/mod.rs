//! Baked plants on disk, found by the content they were made from.
//!
//! The name of a file is the BLAKE3 hash of everything that the bake reads (meshes, materials, textures, settings)
//! and of the version of the bakes: a changed input is another file, so nothing ever has to be invalidated. A file
//! is believed only after its magic, version, key, length and checksum agree (`codec.rs`); anything else counts as
//! absent and is computed and written again. Files appear whole or not at all (written beside, then renamed), so
//! any number of processes may share a folder.
//!
//! Files of plants that are no longer used stay; the folder may be deleted at any time.

mod codec;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::baked::{BakeSettings, BakedPlant};
use super::error::BakeError;
use crate::plant::{PartKind, Plant};

/// What identifies a baked plant: a hash of all inputs of the bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CacheKey([u8; 32]);

impl CacheKey {
    /// Hashes everything that a bake of `plant` with `settings` reads. Neither the plant's name nor its normal
    /// textures are among it.
    pub fn new(plant: &Plant, settings: &BakeSettings) -> Self {
        let mut hasher = blake3::Hasher::new();
        let mut number = |value: u64| {
            hasher.update(&value.to_le_bytes());
        };
        number(u64::from(codec::VERSION));
        number(plant.parts.len() as u64);
        // Every field by name, every number to its last bit: no setting can be forgotten here.
        hasher.update(format!("{settings:?}").as_bytes());
        for part in &plant.parts {
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
            // Its roughness is read by no bake.
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
        Self(*hasher.finalize().as_bytes())
    }

    /// The key as 64 hexadecimal digits.
    pub fn to_hex(self) -> String {
        blake3::Hash::from_bytes(self.0).to_hex().to_string()
    }
}

/// A folder with baked plants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// A cache in `folder`, which is made when the first plant is stored.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The user's cache: the folder `$CANOPY_CACHE`, else `$XDG_CACHE_HOME/canopy`, else `$HOME/.cache/canopy`.
    /// Empty variables count as not set, a relative `XDG_CACHE_HOME` too (XDG Base Directory Specification 0.8).
    /// `None` where none of the three is set.
    pub fn of_user() -> Option<Self> {
        default_folder(|name| std::env::var_os(name)).map(Self::new)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file that holds, or would hold, the plant with `key`.
    pub fn file(&self, key: &CacheKey) -> PathBuf {
        self.folder.join(key.to_hex()).with_extension("bake")
    }

    /// The baked plant with `key`, which is that of `plant`. `None` where there is none, or none that is whole and of
    /// this version.
    pub fn load(&self, key: &CacheKey, plant: &Arc<Plant>) -> Option<BakedPlant> {
        let bytes = std::fs::read(self.file(key)).ok()?;
        codec::decode(&bytes, &key.0, plant)
    }

    /// Stores a baked plant under `key`.
    ///
    /// # Errors
    /// [`BakeError::CacheFolder`] or [`BakeError::CacheWrite`] where the folder or the file cannot be written.
    pub fn store(&self, key: &CacheKey, baked: &BakedPlant) -> Result<(), BakeError> {
        let path = self.file(key);
        std::fs::create_dir_all(&self.folder)
            .map_err(|source| BakeError::CacheFolder { path: self.folder.clone(), source })?;
        let write = || -> std::io::Result<()> {
            let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
            file.write_all(&codec::encode(baked, &key.0))?;
            file.persist(&path).map_err(|error| error.error)?;
            Ok(())
        };
        write().map_err(|source| BakeError::CacheWrite { path: path.clone(), source })
    }
}

fn default_folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let set = |name: &str| variable(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    set("CANOPY_CACHE")
        .or_else(|| set("XDG_CACHE_HOME").filter(|path| path.is_absolute()).map(|path| path.join("canopy")))
        .or_else(|| set("HOME").map(|home| home.join(".cache").join("canopy")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::lighting::{
        LightingSettings,
        implicit::{ImplicitSettings, NormalSource},
    };

    #[test]
    fn the_folder_follows_the_environment() {
        let folder = |set: &[(&str, &str)]| {
            default_folder(|name| set.iter().find(|(key, _)| *key == name).map(|(_, value)| OsString::from(value)))
        };
        assert_eq!(folder(&[]), None);
        assert_eq!(folder(&[("HOME", "/h")]), Some("/h/.cache/canopy".into()));
        assert_eq!(folder(&[("HOME", "/h"), ("XDG_CACHE_HOME", "relative")]), Some("/h/.cache/canopy".into()));
        assert_eq!(folder(&[("HOME", "/h"), ("XDG_CACHE_HOME", "/x")]), Some("/x/canopy".into()));
        assert_eq!(folder(&[("XDG_CACHE_HOME", "/x"), ("CANOPY_CACHE", "here")]), Some("here".into()));
        assert_eq!(folder(&[("XDG_CACHE_HOME", "/x"), ("CANOPY_CACHE", "")]), Some("/x/canopy".into()));
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
        let mut changed = [base; 9];
        changed[0].lighting = LightingSettings::Local;
        changed[1] = expressive(&|settings| settings.radius = Some(0.1));
        changed[2] = expressive(&|settings| settings.radius = Some(0.1f32.next_up()));
        changed[3] = expressive(&|settings| settings.threshold = Some(0.1));
        changed[4] = expressive(&|settings| settings.normals = NormalSource::Gradient);
        changed[5].cross.resolution = 512;
        changed[6].cross.supersampling = 2;
        changed[7].cross.normal_smoothing = 0.01;
        changed[8].shadow_share = 0.5;
        let mut keys: Vec<String> =
            changed.iter().chain([&base]).map(|settings| CacheKey::new(&plant, settings).to_hex()).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 10);
    }
}
