//! Each asset loads, and says what is wrong where it does not.

use bevy::{
    asset::{AssetLoader, AssetPlugin, LoadContext, LoadedUntypedAsset, io::Reader},
    prelude::*,
};
use canopy::{
    bake::{BakedPlant, lighting::LightingSettings},
    components::ForestPlugin,
    plant::{LeafKind, PartKind, grow::GrowParameters},
    prelude::*,
    terrain::Terrain,
};

use super::{Program, species, tree};
use crate::support::{glb::TreeFile, gpu::gpu};

/// The settings of a plant that is read quickly.
fn quick(settings: &mut PlantSettings) {
    settings.bake.lighting = LightingSettings::Local;
    settings.bake.cross.resolution = 64;
}

/// A GLB as a .gltf with its buffer in a file of its own, `name`.
fn split(glb: &[u8], name: &str) -> (Vec<u8>, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes([glb[at], glb[at + 1], glb[at + 2], glb[at + 3]]) as usize;
    let json = String::from_utf8_lossy(&glb[20..20 + word(12)]).into_owned();
    let bin = glb[20 + word(12) + 8..].to_vec();
    (json.replacen("{\"byteLength\"", &format!("{{\"uri\":\"{name}\",\"byteLength\""), 1).into_bytes(), bin)
}

#[test]
fn a_glb_is_one_plant_and_is_scaled_by_its_settings() {
    let mut program = Program::new(&[("trees/oak.glb", &tree())]);
    let load = |program: &Program, height: Option<f32>| -> Handle<PlantAsset> {
        let settings = move |settings: &mut PlantSettings| {
            quick(settings);
            settings.height = height;
        };
        program.server().load_builder().with_settings(settings).load("trees/oak.glb")
    };
    let handle = load(&program, Some(20.0));
    let plant = program.loaded(&handle).expect("a plant");
    assert_eq!((plant.name.as_str(), plant.individuals.len()), ("oak", 1));
    assert!((plant.individuals[0].size().height - 20.0).abs() < 0.01);
    assert!(plant.warnings.is_empty(), "{:?}", plant.warnings);
}

/// Light through the leaves of a plant's individuals.
fn transmission(plant: &PlantAsset) -> Vec<Vec3> {
    let foliage = |baked: &BakedPlant| {
        let parts = baked.plant.parts.iter().filter(|part| part.kind == PartKind::Foliage);
        parts.map(|part| part.material.transmission).next()
    };
    plant.individuals.iter().filter_map(foliage).collect()
}

#[test]
fn the_kind_of_leaf_decides_how_much_light_passes() {
    let species = species(1, (8.0, 12.0));
    let needles = species.replacen("lighting", "leaf: Needle, lighting", 1);
    let grown = "(name: \"bush\", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000), lighting: Local, \
                 leaf: Leathery, height: (3, 5))";
    let mut program = Program::new(&[
        ("tree.glb", &tree()),
        ("broad.species.ron", species.as_bytes()),
        ("needles.species.ron", needles.as_bytes()),
        ("grown.species.ron", grown.as_bytes()),
    ]);
    let mut load = |path: &'static str, leaf: LeafKind| {
        let settings = move |settings: &mut PlantSettings| {
            quick(settings);
            settings.leaf = leaf;
        };
        let handle = program.server().load_builder().with_settings(settings).load(path);
        let plant = program.loaded::<PlantAsset>(&handle).expect("a plant");
        // Another load of the same path would get the same asset, with the settings of the first.
        drop(handle);
        program.app.update();
        program.app.update();
        transmission(&plant)
    };
    for leaf in [LeafKind::Thin, LeafKind::Needle] {
        assert_eq!(load("tree.glb", leaf), [leaf.transmission()]);
        assert_eq!(load("broad.species.ron", leaf), [leaf.transmission()], "a species that does not say");
    }
    assert_eq!(load("needles.species.ron", LeafKind::Young), [LeafKind::Needle.transmission()]);
    assert_eq!(load("grown.species.ron", LeafKind::Young), [LeafKind::Leathery.transmission()]);
}

#[test]
fn a_gltf_finds_its_buffer_beside_it() {
    let (json, bin) = split(&tree(), "the%20buffer.bin");
    let mut program = Program::new(&[("trees/oak.gltf", &json), ("trees/the buffer.bin", &bin)]);
    let handle: Handle<PlantAsset> = program.server().load_builder().with_settings(quick).load("trees/oak.gltf");
    let plant = program.loaded(&handle).expect("a plant");
    let whole =
        canopy::plant::gltf::load_plant_bytes(&tree(), "oak.glb".as_ref(), &Default::default(), &Default::default());
    let (whole, _) = whole.expect("a plant");
    let meshes = |plant: &canopy::plant::Plant| plant.parts.iter().map(|part| part.mesh.clone()).collect::<Vec<_>>();
    assert_eq!(meshes(&plant.individuals[0].plant), meshes(&whole));

    // Without the buffer there is no plant; without a texture there is one.
    drop(program);
    let mut program = Program::new(&[("oak.gltf", &json)]);
    let handle: Handle<PlantAsset> = program.load("oak.gltf");
    let error = program.loaded(&handle).map(|_| ()).expect_err("no buffer");
    for word in ["oak.gltf", "/buffers/0", "the buffer.bin", "there is no such file", "export as .glb"] {
        assert!(error.contains(word), "no `{word}` in {error}");
    }
    let bare = TreeFile { absent_texture: true, ..TreeFile::default() };
    program.write("bare.glb", &bare.bytes());
    let handle: Handle<PlantAsset> = program.server().load_builder().with_settings(quick).load("bare.glb");
    let plant = program.loaded(&handle).expect("a plant");
    assert!(plant.warnings.iter().any(|warning| warning.contains("absent.png")), "{:?}", plant.warnings);
}

#[test]
fn a_species_file_is_what_stands_in_a_scene() {
    let rules = "(name: \"bush\", height: 4.0, height_variation: 0.1)";
    let grown = "(name: \"bushes\", plant: Grown(form: File(\"rules/bush.ron\"), individuals: 2, triangles: 5000), \
                 lighting: Local, height: (3, 5), slope_limit: 30)";
    let mut program = Program::new(&[
        ("species/tree.glb", &tree()),
        ("species/small.species.ron", species(2, (8.0, 12.0)).as_bytes()),
        ("bushes.species.ron", grown.as_bytes()),
        ("rules/bush.ron", rules.as_bytes()),
    ]);
    let (small, bushes) = (program.load::<PlantAsset>("species/small.species.ron"), program.load("bushes.species.ron"));
    let small = program.loaded(&small).expect("a species of files");
    assert_eq!((small.name.as_str(), small.individuals.len()), ("small", 2));
    assert_eq!(small.growth.heights, Some((8.0, 12.0)));
    assert!((small.individuals[1].size().height - 10.0).abs() < 0.01, "scaled to the mean height");
    let bushes: PlantAsset = program.loaded(&bushes).expect("a grown species");
    assert_eq!((bushes.individuals.len(), bushes.growth.slope_limit), (2, 30.0));
    let height = bushes.individuals[0].size().height;
    assert!((2.0..10.0).contains(&height), "{height} m is the default's height");
}

#[test]
fn what_is_broken_is_said_with_file_place_and_remedy() {
    let mut program = Program::new(&[
        ("cut.glb", &tree()[..200]),
        ("wrong.species.ron", b"(\n    name: \"a\",\n    plant: Grown(),\n    hight: (3, 5),\n)"),
        ("wrong.tif", b"II*\0 and nothing more"),
        ("wrong.canopy.ron", b"(terrain: Flat(size: -1), place: (latitude: 48, longitude: 9))"),
        ("lost.species.ron", b"(name: \"a\", plant: Gltf(files: [\"lost.glb\"]))"),
    ]);
    let expect = |error: Result<(), String>, words: &[&str]| {
        let error = error.expect_err("an error");
        for word in words {
            assert!(error.contains(word), "no `{word}` in {error}");
        }
    };
    let plant = |program: &mut Program, path: &str| {
        let handle = program.load::<PlantAsset>(path);
        program.loaded(&handle).map(|_| ())
    };
    expect(plant(&mut program, "cut.glb"), &["cut.glb", "byte", "export or download it again"]);
    expect(plant(&mut program, "wrong.species.ron"), &["wrong.species.ron:4:5", "hight", "did you mean `height`"]);
    expect(plant(&mut program, "lost.species.ron"), &["lost.glb", "no such file", "check the path"]);
    expect(plant(&mut program, "missing.glb"), &["missing.glb"]);
    let map = program.load::<TerrainMap>("wrong.tif");
    expect(program.loaded(&map).map(|_| ()), &["wrong.tif", "fetch or export it again"]);
    let scene = program.load::<SceneAsset>("wrong.canopy.ron");
    expect(program.loaded(&scene).map(|_| ()), &["wrong.canopy.ron:1:", "terrain.size", "-1"]);
}

/// Another loader for the same ending, as Bevy's own for glTF.
#[derive(Asset, TypePath, Clone)]
struct Other(usize);

#[derive(Default, TypePath)]
struct OtherLoader;

impl AssetLoader for OtherLoader {
    type Asset = Other;
    type Settings = ();
    type Error = std::io::Error;

    async fn load(&self, reader: &mut dyn Reader, (): &(), _: &mut LoadContext<'_>) -> Result<Other, std::io::Error> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        Ok(Other(bytes.len()))
    }

    fn extensions(&self) -> &[&str] {
        &["glb"]
    }
}

#[test]
fn the_type_of_an_asset_chooses_its_loader_and_other_loaders_keep_their_endings() {
    let mut program = Program::new(&[("oak.glb", &tree())]);
    program.app.init_asset::<Other>().register_asset_loader(OtherLoader);
    let other = program.load::<Other>("oak.glb");
    assert_eq!(program.loaded(&other).expect("the other asset").0, tree().len());
    let plant = program.server().load_builder().with_settings(quick).load::<PlantAsset>("oak.glb");
    assert_eq!(program.loaded(&plant).expect("a plant").individuals.len(), 1);
    // Whatever comes last, a file without a type is the other loader's.
    let untyped = program.server().load_builder().load_untyped("oak.glb");
    let server = program.server();
    program.until(|_| server.is_loaded_with_dependencies(&untyped));
    let loaded = program.app.world().resource::<Assets<LoadedUntypedAsset>>().get(&untyped).expect("an asset");
    assert_eq!(loaded.handle.type_id(), std::any::TypeId::of::<Other>());
}

#[test]
fn terrain_is_read_as_from_its_file() {
    let grid = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n4 5 6\n";
    let tif =
        std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/terrain/jacksboro_6km.tif")).expect("a terrain");
    let mut program = Program::new(&[("small.asc", grid.as_bytes()), ("valley.tif", &tif)]);
    let (small, valley) = (program.load::<TerrainMap>("small.asc"), program.load::<TerrainMap>("valley.tif"));
    let small = program.loaded(&small).expect("a grid");
    assert_eq!(small.terrain.field().heights(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(small.warnings.len(), 1, "{:?}", small.warnings);
    let valley = program.loaded(&valley).expect("a GeoTIFF");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/terrain/jacksboro_6km.tif");
    let (direct, _): (Terrain, _) =
        canopy::terrain::read_terrain(path.as_ref(), &Default::default()).expect("a terrain");
    assert_eq!(valley.terrain.field().heights(), direct.field().heights());
    assert_eq!(valley.terrain.reference(), direct.reference());

    program.write("crop.asc", grid.as_bytes());
    let server = program.server();
    let crop = canopy::terrain::Crop { west: 0.0, south: 0.0, east: 16.0, north: 20.0 };
    let settings = move |settings: &mut TerrainMapSettings| settings.crop = Some(crop);
    let cropped: Handle<TerrainMap> = server.load_builder().with_settings(settings).load("crop.asc");
    assert_eq!(program.loaded(&cropped).expect("a part").terrain.field().columns(), 2);
}

#[test]
fn a_scene_is_loaded_by_handle_and_shown() {
    let text = "(terrain: Flat(size: 100), place: (latitude: 48, longitude: 9), species: [(name: \"small\", plant: \
                Gltf(files: [\"../tree.glb\"]), lighting: Local, height: (8, 12))], trees: Inventory(path: \
                \"trees.csv\"), quality: (cross_resolution: 64))";
    let mut program = Program::new(&[
        ("tree.glb", &tree()),
        ("scenes/grove.canopy.ron", text.as_bytes()),
        ("scenes/trees.csv", b"x,y,height\n1,2,9\n5,6,11\n"),
    ]);
    let handle = program.load::<SceneAsset>("scenes/grove.canopy.ron");
    let scene = program.loaded(&handle).expect("a scene").scene;
    assert_eq!(scene.file.as_deref(), Some(program.folder.path().join("scenes/grove.canopy.ron").as_path()));
    let entity = program.app.world_mut().spawn(CanopyScene::new(scene)).id();
    program.until(|world| world.get::<LoadedScene>(entity).is_some());
    let stage = program.app.world().get::<LoadedScene>(entity).map(|loaded| loaded.stage.clone());
    assert_eq!(stage.map(|stage| stage.stand.trees.len()), Some(2));
}

#[test]
fn plants_are_made_in_code() {
    let mut settings = PlantSettings::default();
    quick(&mut settings);
    let bush = GrowParameters { height: 4.0, height_variation: 0.2, ..GrowParameters::broadleaf() };
    let asset = PlantAsset::grown(&bush, 3..5, 5000, &settings).expect("two bushes");
    assert_eq!((asset.name.as_str(), asset.individuals.len()), ("broadleaf", 2));
    assert!(PlantAsset::grown(&bush, 3..5, 1, &settings).is_err());
    assert!(TerrainMap::flat(f64::NAN).is_err());
}

#[test]
fn plugins_come_in_any_order_and_a_missing_one_is_no_panic() {
    // What is logged here would be heard by a test of pictures.
    let quiet = gpu();
    let mut app = App::new();
    app.add_plugins((CanopyAssetPlugin, CanopyAssetPlugin, MinimalPlugins, AssetPlugin::default()));
    app.finish();
    app.cleanup();
    app.update();
    assert!(app.world().contains_resource::<Assets<PlantAsset>>());

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, CanopyAssetPlugin, ForestPlugin));
    app.finish();
    app.cleanup();
    app.update();
    assert!(!app.world().contains_resource::<Assets<PlantAsset>>());
    let said = quiet.messages();
    assert!(said.iter().any(|message| message.contains("add Bevy's `AssetPlugin`")), "{said:?}");
}
