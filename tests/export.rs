//! `canopy export`: the forest as glTF, read back.

use std::path::Path;

use canopy::plant::{
    PartKind,
    gltf::{GltfOptions, load_plant},
};

use crate::support::program::{canopy, said};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn scene(folder: &Path) -> std::io::Result<String> {
    let file = folder.join("grove.ron");
    let text = "(name: \"grove\", terrain: Noise(size: 200, amplitude: 4, wavelength: 60, seed: 3), place: (latitude: 48, longitude: 9, \
                time: \"2026-06-21T12:30+01:00\"), species: [(name: \"beech\", plant: Grown(form: Broadleaf, individuals: 2, triangles: \
                5000), height: (9, 12), lighting: Local), (name: \"fir\", plant: Grown(form: Conifer, individuals: 1, triangles: 5000), \
                height: (9, 12), lighting: Local)], trees: Scattered(stems_per_hectare: 40, min_distance: 4, surroundings: 0))";
    std::fs::write(&file, text)?;
    Ok(file.display().to_string())
}

/// The JSON of a GLB.
fn document(path: &Path) -> Result<serde_json::Value, Box<dyn std::error::Error>> {
    let bytes = std::fs::read(path)?;
    assert_eq!((&bytes[..4], bytes.len()), (&b"glTF"[..], u32::from_le_bytes(bytes[8..12].try_into()?) as usize));
    let length = u32::from_le_bytes(bytes[12..16].try_into()?) as usize;
    Ok(serde_json::from_slice(&bytes[20..20 + length])?)
}

#[test]
fn a_forest_is_exported_once_as_instances_and_as_nodes_and_read_back_whole() -> Outcome {
    let folder = tempfile::tempdir()?;
    let scene = scene(folder.path())?;
    let export = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let fixed = ["export", &scene, "--out", out.to_str().unwrap_or_default()];
        canopy(&fixed.into_iter().chain(more.iter().copied()).collect::<Vec<_>>())
    };
    let first = export("forest.glb", &[])?;
    assert_eq!(first.status.code(), Some(0), "{}", said(&first));
    let told = String::from_utf8(first.stdout)?;
    let number = |words: &str, before: &str| -> Option<usize> {
        words.split(before).next()?.split_whitespace().last()?.parse().ok()
    };
    let trees = number(&told, " trees of 3 plants").ok_or("no trees")?;
    assert!((100..=160).contains(&trees), "{told}");
    let whole = document(&folder.path().join("forest.glb"))?;
    assert_eq!(whole["nodes"].as_array().map(Vec::len), Some(4), "three plants and the ground");
    let used = whole["extensionsUsed"].to_string();
    assert!(used.contains("EXT_mesh_gpu_instancing") && used.contains("KHR_materials_diffuse_transmission"), "{used}");
    let place = &whole["asset"]["extras"];
    assert_eq!((place["latitude"].as_f64(), place["longitude"].as_f64()), (Some(48.0), Some(9.0)));

    // The gltf crate accepts it, and each plant with all its instances comes back through our own reader.
    let read = gltf::Gltf::from_slice(&std::fs::read(folder.path().join("forest.glb"))?)?;
    assert!(read.blob.is_some_and(|bytes| bytes.len() > 1000));
    let options = GltfOptions { ignore: vec!["ground".to_owned()], ..GltfOptions::default() };
    let (plant, warnings) = load_plant(&folder.path().join("forest.glb"), &options)?;
    let triangles = |kind: PartKind, plant: &canopy::plant::Plant| -> usize {
        plant.parts.iter().filter(|part| part.kind == kind).map(|part| part.mesh.triangles.len()).sum()
    };
    assert!(
        triangles(PartKind::Foliage, &plant) > 1000 * trees && triangles(PartKind::Wood, &plant) > 100 * trees,
        "{warnings:?}"
    );
    // Colours and transmitted light of the leaves are those of the plant that was exported.
    let leaf = |plant: &canopy::plant::Plant| {
        let part = plant.parts.iter().find(|part| part.kind == PartKind::Foliage).expect("leaves");
        let texel = |image: &image::RgbaImage| {
            let opaque: Vec<_> = image.pixels().filter(|pixel| pixel.0[3] > 200).collect();
            let linear = |pixel: &&image::Rgba<u8>| canopy::math::srgb_to_linear(f32::from(pixel.0[1]) / 255.0);
            opaque.iter().map(linear).sum::<f32>() / opaque.len() as f32
        };
        let front =
            part.material.base_color.y * part.material.base_color_texture.as_ref().map_or(1.0, |image| texel(image));
        (front, part.material.transmitted(glam::Vec3::splat(front)).y)
    };
    let original = canopy::plant::grow::grow(&canopy::plant::grow::GrowParameters::broadleaf(), 1, 5000)?;
    let (before, after) = (leaf(&original), leaf(&plant));
    assert!(
        (after.0 / before.0 - 1.0).abs() < 0.03 && (after.1 / before.1 - 1.0).abs() < 0.1,
        "{before:?} and {after:?}"
    );

    let second = export("nodes.glb", &["--nodes", "--no-ground", "--within", "50"])?;
    assert_eq!(second.status.code(), Some(0), "{}", said(&second));
    let nodes = document(&folder.path().join("nodes.glb"))?;
    let nodes = nodes["nodes"].as_array().ok_or("no nodes")?.clone();
    assert!(nodes.len() > trees / 8 && nodes.len() < trees / 2, "{} of {trees}", nodes.len());
    for node in &nodes {
        let place = node["translation"].as_array().ok_or("no place")?;
        assert!(place[0].as_f64().unwrap().abs() <= 50.0 && place[2].as_f64().unwrap().abs() <= 50.0, "{node}");
        assert!(node["mesh"].is_u64() && node["rotation"].is_array());
    }
    // The same bytes each time, and messages that say what to do.
    assert_eq!(export("again.glb", &[])?.status.code(), Some(0));
    assert_eq!(std::fs::read(folder.path().join("again.glb"))?, std::fs::read(folder.path().join("forest.glb"))?);
    let wrong = export("forest.fbx", &[])?;
    assert!(wrong.status.code() == Some(2) && said(&wrong).contains("must end in .glb"), "{}", said(&wrong));
    let nothing = export("nothing.glb", &["--within", "0.001", "--no-ground"])?;
    assert!(
        nothing.status.code() == Some(1) && said(&nothing).contains("neither a tree nor ground"),
        "{}",
        said(&nothing)
    );
    Ok(())
}

#[test]
fn a_photograph_over_the_ground_is_its_texture() -> Outcome {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("four.png"), crate::drape::four())?;
    let scene = folder.path().join("plane.ron");
    let place = crate::support::stage::PLACE;
    std::fs::write(&scene, format!("({}, {place}, drape: (path: \"four.png\", brightness: 1))", crate::drape::FLAT))?;
    let out = folder.path().join("plane.glb");
    let written = canopy(&["export", &scene.display().to_string(), "--out", &out.display().to_string()])?;
    assert_eq!(written.status.code(), Some(0), "{}", said(&written));
    assert!(said(&written).contains("stretched over the whole terrain"), "{}", said(&written));
    let whole = gltf::Gltf::from_slice(&std::fs::read(&out)?)?;
    let bytes = whole.blob.as_deref().ok_or("no buffer")?;
    let primitive = whole.meshes().next().and_then(|mesh| mesh.primitives().next()).ok_or("no ground")?;
    let reader = primitive.reader(|_| Some(bytes));
    let positions: Vec<[f32; 3]> = reader.read_positions().ok_or("no positions")?.collect();
    let uvs: Vec<[f32; 2]> = reader.read_tex_coords(0).ok_or("no coordinates")?.into_f32().collect();
    // North-west is the first texel, and the ground faces up.
    for ([x, _, z], [u, v]) in positions.into_iter().zip(uvs) {
        assert!((u - (x / 200.0 + 0.5)).abs() < 1e-5 && (v - (z / 200.0 + 0.5)).abs() < 1e-5, "{x} {z} {u} {v}");
    }
    let gltf::image::Source::View { view, .. } = whole.images().next().ok_or("no image")?.source() else {
        return Err("an image beside the file".into());
    };
    let image = image::load_from_memory(&bytes[view.offset()..view.offset() + view.length()])?.into_rgb8();
    assert_eq!(image.width(), 64);
    let texel = |x: u32, y: u32| image.get_pixel(x, y).0;
    assert!(texel(10, 10)[0] > 180 && texel(50, 10)[1] > 160 && texel(10, 50)[2] > 200);
    let sampler = whole.textures().next().ok_or("no texture")?.sampler();
    assert_eq!(sampler.wrap_s(), gltf::texture::WrappingMode::MirroredRepeat);
    Ok(())
}
