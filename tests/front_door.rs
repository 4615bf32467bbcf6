//! What a Bevy program loads and spawns: assets by handle, terrain and forests as components. No device, no window.

mod assets;
mod examples;
mod forests;
mod reflection;

use std::path::Path;

use bevy::{
    asset::{Asset, AssetPath, AssetPlugin, LoadState},
    prelude::*,
};
use canopy::{
    assets::CanopyAssetPlugin,
    components::{ForestPlugin, ScenePlugin},
    prelude::*,
    render::components::{Forest, Ground},
};
use tempfile::TempDir;

use crate::support::{
    glb::TreeFile,
    gpu::{Gpu, gpu},
};

/// Updates that something may take: minutes, on the slowest machine.
const PATIENCE: usize = 20_000_000;

/// What the observers heard, in its order.
#[derive(Resource, Default)]
struct Heard {
    ready: Vec<(Entity, usize)>,
    failed: Vec<(Entity, String)>,
    terrains: Vec<Entity>,
    failed_terrains: Vec<(Entity, String)>,
}

/// A program without a window whose assets are in a folder of its own.
struct Program {
    app: App,
    folder: TempDir,
    /// What is logged here would be heard by a test of pictures.
    _quiet: Gpu,
}

impl Program {
    fn new(files: &[(&str, &[u8])]) -> Self {
        let quiet = gpu();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file_path = folder.path().display().to_string();
        let mut app = App::new();
        app.add_plugins((
            MinimalPlugins,
            AssetPlugin { file_path, ..AssetPlugin::default() },
            TransformPlugin,
            CanopyAssetPlugin,
            ForestPlugin,
            ScenePlugin,
        ));
        app.init_resource::<Heard>()
            .add_observer(|event: On<ForestReady>, mut heard: ResMut<Heard>| {
                heard.ready.push((event.entity, event.trees));
            })
            .add_observer(|event: On<ForestFailed>, mut heard: ResMut<Heard>| {
                heard.failed.push((event.entity, event.error.to_string()));
            })
            .add_observer(|event: On<TerrainReady>, mut heard: ResMut<Heard>| heard.terrains.push(event.entity))
            .add_observer(|event: On<TerrainFailed>, mut heard: ResMut<Heard>| {
                heard.failed_terrains.push((event.entity, event.error.clone()));
            });
        app.finish();
        app.cleanup();
        let program = Self { app, folder, _quiet: quiet };
        for (name, bytes) in files {
            program.write(name, bytes);
        }
        program
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(""))).expect("a temporary folder");
        std::fs::write(path, bytes).expect("a temporary file");
    }

    fn server(&self) -> AssetServer {
        self.app.world().resource::<AssetServer>().clone()
    }

    fn load<A: Asset>(&self, path: &str) -> Handle<A> {
        self.server().load(AssetPath::parse(path))
    }

    fn heard(&self) -> &Heard {
        self.app.world().resource()
    }

    /// Updates until `done`.
    #[track_caller]
    fn until(&mut self, done: impl Fn(&World) -> bool) {
        for _ in 0..PATIENCE {
            if done(self.app.world()) {
                return;
            }
            self.app.update();
            std::thread::yield_now();
        }
        let heard = self.heard();
        panic!("in vain; failed: {:?} {:?}", heard.failed, heard.failed_terrains);
    }

    #[track_caller]
    fn until_heard(&mut self, done: impl Fn(&Heard) -> bool) {
        self.until(|world| done(world.resource()));
    }

    /// Waits for an asset, or for the reason why it cannot be loaded.
    #[track_caller]
    fn loaded<A: Asset + Clone>(&mut self, handle: &Handle<A>) -> Result<A, String> {
        let server = self.server();
        self.until(|_| !matches!(server.load_state(handle), LoadState::NotLoaded | LoadState::Loading));
        // The asset itself is there with the frame after.
        self.app.update();
        match server.load_state(handle) {
            LoadState::Failed(error) => Err(error.to_string()),
            _ => Ok(self.app.world().resource::<Assets<A>>().get(handle).expect("a loaded asset").clone()),
        }
    }

    fn spawn(&mut self, bundle: impl Bundle) -> Entity {
        self.app.world_mut().spawn(bundle).id()
    }

    /// A plane of this width as an asset of the program's own.
    fn plane(&mut self, size: f64) -> Handle<TerrainMap> {
        let map = TerrainMap::flat(size).expect("a plane");
        self.app.world_mut().resource_mut::<Assets<TerrainMap>>().add(map)
    }

    fn forest(&self, entity: Entity) -> Option<&Forest> {
        self.app.world().get(entity)
    }

    fn ground(&self, entity: Entity) -> Option<&Ground> {
        self.app.world().get(entity)
    }
}

/// The bytes of a small tree.
fn tree() -> Vec<u8> {
    TreeFile::default().bytes()
}

/// A species of so many copies of `tree.glb`, lit without a bake.
fn species(individuals: usize, height: (f64, f64)) -> String {
    let files = vec!["\"tree.glb\""; individuals].join(", ");
    format!("(name: \"small\", plant: Gltf(files: [{files}]), lighting: Local, height: ({}, {}))", height.0, height.1)
}
