//! The WGSL files: embedded in the library, loaded as Bevy assets.
//!
//! The files are in the package's folder `shaders/`. [`ShaderFile`] lists them for the plugin and for the test that
//! validates every shader without a GPU. Each is the embedded asset `embedded://canopy/PATH`. With Bevy's feature
//! `embedded_watcher` a saved file takes effect in the running program: `cargo run --features bevy/embedded_watcher`.
//!
//! Assets are loaded in the background within a few frames. Until then the passes draw nothing, like Bevy's own. A
//! program that keeps every frame waits for [`CanopyShaders::loaded`], as `app/headless.rs` does.

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};

use bevy::{
    asset::{
        AssetServer, Handle, LoadState,
        io::{embedded::EmbeddedAssetRegistry, file::FileAssetReader},
    },
    ecs::resource::Resource,
    shader::Shader,
};

use super::shader_constants;

macro_rules! shader_files {
    ($($name:ident = $path:literal),+ $(,)?) => {
        /// A file below `shaders/`.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum ShaderFile {
            $(
                #[doc = concat!("`shaders/", $path, "`")]
                $name,
            )+
        }

        impl ShaderFile {
            /// All files; libraries come before the files that import them.
            pub const ALL: [Self; [$($path),+].len()] = [$(Self::$name),+];

            /// Path below `shaders/`.
            pub const fn path(self) -> &'static str {
                match self {
                    $(Self::$name => $path,)+
                }
            }

            /// The text, as it was when the library was built.
            pub const fn source(self) -> &'static str {
                match self {
                    $(Self::$name => include_str!(concat!("../../shaders/", $path)),)+
                }
            }
        }
    };
}

shader_files! {
    Hash = "common/hash.wgsl",
    Octahedral = "common/octahedral.wgsl",
    SignedTexel = "common/signed_texel.wgsl",
    Frame = "common/frame.wgsl",
    Sky = "common/sky.wgsl",
    Stand = "common/stand.wgsl",
    Output = "common/output.wgsl",
    SunVisibility = "common/sun_visibility.wgsl",
    Lighting = "common/lighting.wgsl",
    Tissue = "common/tissue.wgsl",
    ForestInstance = "forest/instance.wgsl",
    StyleSurface = "style/surface.wgsl",
    Style = "style/style.wgsl",
    StyleNoise = "style/noise.wgsl",
    StyleStrokes = "style/strokes.wgsl",
    ForestTransfer = "forest/transfer.wgsl",
    CullVolume = "cull/volume.wgsl",
    ForestCrossVariant = "forest/cross_variant.wgsl",
    ForestCloudPlane = "forest/cloud_plane.wgsl",
    ForestModel = "forest/model.wgsl",
    ForestCross = "forest/cross.wgsl",
    ForestCloud = "forest/cloud.wgsl",
    SunShadowCaster = "sun_shadow/caster.wgsl",
    SunShadowModel = "sun_shadow/model.wgsl",
    SunShadowCross = "sun_shadow/cross.wgsl",
    SunShadowCloud = "sun_shadow/cloud.wgsl",
    SunShadowMesh = "sun_shadow/mesh.wgsl",
    CullLists = "cull/lists.wgsl",
    SkyPass = "sky/sky.wgsl",
    GroundNoise = "terrain/ground_noise.wgsl",
    GroundColor = "terrain/ground_color.wgsl",
    Terrain = "terrain/terrain.wgsl",
    StyleIllumination = "style/illumination.wgsl",
    StyleBlur = "style/blur.wgsl",
    StyleParticles = "style/particles.wgsl",
    StyleContours = "style/contours.wgsl",
    StyleLines = "style/lines.wgsl",
    StyleNoiseMap = "style/noise_map.wgsl",
    StyleWatercolor = "style/watercolor.wgsl",
    StyleInk = "style/ink.wgsl",
}

/// Path of the module that [`shader_constants`] writes, next to those of [`ShaderFile`].
const CONSTANTS: &str = "common/constants.wgsl";

/// Every WGSL module as `(path, text)`: the shared constants, then [`ShaderFile::ALL`].
pub fn sources() -> Vec<(&'static str, Cow<'static, str>)> {
    let constants = (CONSTANTS, Cow::Owned(shader_constants::source()));
    let files = ShaderFile::ALL.map(|file| (file.path(), Cow::Borrowed(file.source())));
    std::iter::once(constants).chain(files).collect()
}

/// Handles of all shaders; they live as long as the app. The default ones are never loaded.
#[derive(Resource, Clone, Debug)]
pub struct CanopyShaders {
    files: [Handle<Shader>; ShaderFile::ALL.len()],
    constants: Handle<Shader>,
}

impl Default for CanopyShaders {
    fn default() -> Self {
        Self { files: std::array::from_fn(|_| Handle::default()), constants: Handle::default() }
    }
}

impl CanopyShaders {
    /// Embeds all files and starts to load them.
    pub fn load(registry: &EmbeddedAssetRegistry, server: &AssetServer) -> Self {
        let base = FileAssetReader::get_base_path();
        let load = |path: &str| server.load(format!("embedded://canopy/{path}"));
        let embedded = |path: &str| Path::new("canopy").join(path);
        registry.insert_asset(PathBuf::new(), &embedded(CONSTANTS), shader_constants::source().into_bytes());
        for file in ShaderFile::ALL {
            let path = file.path();
            registry.insert_asset(watched_path(&base, path), &embedded(path), file.source().as_bytes());
        }
        Self { files: ShaderFile::ALL.map(|file| load(file.path())), constants: load(CONSTANTS) }
    }

    /// The shader of a file.
    pub fn get(&self, file: ShaderFile) -> Handle<Shader> {
        self.files[file as usize].clone()
    }

    /// Whether all shaders are loaded; the next frame can be drawn with them.
    ///
    /// # Errors
    /// Why one of them cannot be loaded.
    pub fn loaded(&self, server: &AssetServer) -> Result<bool, String> {
        let mut all = true;
        for handle in self.files.iter().chain([&self.constants]) {
            match server.load_state(handle) {
                LoadState::Loaded => {}
                LoadState::Failed(error) => return Err(error.to_string()),
                LoadState::NotLoaded | LoadState::Loading => all = false,
            }
        }
        Ok(all)
    }
}

/// The file of the shader at `path` as Bevy's watcher names it: from the folder `base` that it watches, if the package
/// is in there.
fn watched_path(base: &Path, path: &str) -> PathBuf {
    let full = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders").join(path);
    full.strip_prefix(base).map(Path::to_owned).unwrap_or(full)
}

#[cfg(test)]
mod tests {
    use bevy::{
        app::{App, TaskPoolPlugin},
        asset::{AssetApp, AssetPlugin, Assets},
        shader::ShaderLoader,
    };

    use super::*;

    #[test]
    fn every_shader_is_an_asset() {
        let mut app = App::new();
        app.add_plugins((TaskPoolPlugin::default(), AssetPlugin::default()));
        app.init_asset::<Shader>().init_asset_loader::<ShaderLoader>();
        let world = app.world();
        let server = world.resource::<AssetServer>().clone();
        let shaders = CanopyShaders::load(world.resource(), &server);
        assert_eq!(shaders.loaded(&server), Ok(false), "nothing is loaded before the first frame");
        while shaders.loaded(&server) == Ok(false) {
            app.update();
            std::thread::yield_now();
        }
        assert_eq!(shaders.loaded(&server), Ok(true));
        let assets = app.world().resource::<Assets<Shader>>();
        for file in ShaderFile::ALL {
            let shader = assets.get(&shaders.get(file)).expect("a loaded shader");
            assert_eq!(shader.path, format!("embedded://canopy/{}", file.path()));
            assert_eq!(shader.source.as_str(), file.source());
        }
        let constants = assets.get(&shaders.constants).expect("the constants");
        assert_eq!(constants.source.as_str(), shader_constants::source());
    }

    #[test]
    fn a_shader_that_is_missing_is_named() {
        let mut app = App::new();
        app.add_plugins((TaskPoolPlugin::default(), AssetPlugin::default()));
        app.init_asset::<Shader>().init_asset_loader::<ShaderLoader>();
        let server = app.world().resource::<AssetServer>().clone();
        let shaders = CanopyShaders::load(app.world().resource(), &server);
        let broken = CanopyShaders { constants: server.load("embedded://canopy/none.wgsl"), ..shaders };
        while broken.loaded(&server) == Ok(false) {
            app.update();
            std::thread::yield_now();
        }
        assert!(broken.loaded(&server).is_err_and(|error| error.contains("none.wgsl")));
    }

    #[test]
    fn a_watcher_finds_the_files_in_the_package() {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(watched_path(package, "sky/sky.wgsl"), Path::new("shaders/sky/sky.wgsl"));
        assert!(watched_path(Path::new("/another/program"), "sky/sky.wgsl").is_file());
    }
}
