//! Plants as modelling programs, game engines and compressors write them.

use std::fs;

use canopy::plant::gltf::{GltfOptions, PlantError, UpAxis, Warning, WarningKind, load_plant, load_plant_bytes};
use canopy::plant::{PartKind, Plant};
use glam::Vec3;
use serde_json::{Value, json};

use super::gltf::{Glb, SQUARE};
use crate::support::data::data;
use crate::support::glb::TreeFile;

/// The tree of the support module with a changed JSON part.
fn edited(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let bytes = TreeFile::default().bytes();
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    change(&mut json);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &bytes[20 + length..];
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((20 + text.len() + rest.len()) as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(text);
    out.extend(rest);
    out
}

fn load_with(bytes: &[u8], options: &GltfOptions) -> (Plant, Vec<Warning>) {
    load_plant_bytes(bytes, "tree.glb".as_ref(), &Default::default(), options).expect("a plant")
}

fn load(bytes: &[u8]) -> (Plant, Vec<Warning>) {
    load_with(bytes, &GltfOptions::default())
}

fn triangles(plant: &Plant) -> usize {
    plant.triangle_count(PartKind::Wood) + plant.triangle_count(PartKind::Foliage)
}

#[track_caller]
fn says(warnings: &[Warning], words: &[&str]) {
    for word in words {
        assert!(warnings.iter().any(|warning| warning.to_string().contains(word)), "no `{word}` in {warnings:?}");
    }
}

const WHOLE: usize = 336;

// ---------------------------------------------------------------- which way is up

#[test]
fn a_tree_along_z_is_turned_upright() {
    let (upright, warnings) = load(&TreeFile::default().bytes());
    assert!(warnings.is_empty(), "{warnings:?}");
    let expected = upright.bounds().expect("vertices");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let lying = edited(|json| json["nodes"] = json!([{"mesh": 0, "rotation": [half, 0.0, 0.0, half]}]));
    let (turned, warnings) = load(&lying);
    says(&warnings, &["stands along z and is turned upright", "`up: Z`"]);
    let found = turned.bounds().expect("vertices");
    assert!((found.min - expected.min).length() < 1e-4 && (found.max - expected.max).length() < 1e-4, "{found:?}");
    for (part, original) in turned.parts.iter().zip(&upright.parts) {
        for (normal, expected) in part.mesh.normals.iter().zip(&original.mesh.normals) {
            assert!((*normal - *expected).length() < 1e-4);
        }
    }
    let stated = |up| load_with(&lying, &GltfOptions { up: Some(up), ..GltfOptions::default() });
    let (plant, warnings) = stated(UpAxis::Z);
    assert!(warnings.is_empty() && (plant.height() - upright.height()).abs() < 1e-4, "{warnings:?}");
    let (plant, _) = stated(UpAxis::Y);
    assert!(plant.height() < 0.9 * upright.height());
    // A scale in the node, and one that stands elsewhere: said, not turned.
    let small = edited(|json| {
        json["nodes"] = json!([{"mesh": 0, "rotation": [half, 0.0, 0.0, half], "scale": [0.01, 0.01, 0.01]}])
    });
    says(&load(&small).1, &["turned upright"]);
    let moved = edited(|json| {
        json["nodes"] = json!([{"mesh": 0, "rotation": [half, 0.0, 0.0, half], "translation": [40.0, 30.0, 20.0]}]);
    });
    says(&load(&moved).1, &["the trunk lies along z", "`up: Z`"]);
}

// ---------------------------------------------------------------- what is the tree

#[test]
fn only_the_finest_level_of_detail_is_drawn() {
    for names in
        [["Oak_LOD0", "Oak_LOD1", "Oak_LOD2"], ["lod0", "lod1", "lod2"], ["Oak LOD 1", "Oak LOD 2", "Oak LOD 3"]]
    {
        let nodes: Vec<Value> = names.iter().map(|name| json!({"mesh": 0, "name": name})).collect();
        let bytes = edited(|json| {
            json["nodes"] = json!(nodes);
            json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
        });
        let (plant, warnings) = load(&bytes);
        assert_eq!(triangles(&plant), WHOLE, "{names:?}");
        says(&warnings, &["coarser levels of detail", names[1], names[2]]);
    }
    // Groups above the meshes have the names.
    let bytes = edited(|json| {
        json["nodes"] =
            json!([{"children": [1], "name": "LOD0"}, {"mesh": 0}, {"children": [3], "name": "LOD1"}, {"mesh": 0}]);
        json["scenes"] = json!([{"nodes": [0, 2]}]);
    });
    assert_eq!(triangles(&load(&bytes).0), WHOLE);
    // MSFT_lod, in the scene or outside.
    for scene in [json!([0, 1]), json!([0])] {
        let bytes = edited(|json| {
            json["nodes"] = json!([{"mesh": 0, "extensions": {"MSFT_lod": {"ids": [1]}}}, {"mesh": 0}]);
            json["scenes"] = json!([{"nodes": scene}]);
            json["extensionsUsed"] = json!(["MSFT_lod"]);
        });
        let (plant, warnings) = load(&bytes);
        assert_eq!(triangles(&plant), WHOLE);
        says(&warnings, &["1 coarser levels of detail (MSFT_lod)"]);
    }
    // A hull of the finest level is none of the levels: both coarser ones were drawn inside each other.
    let names = ["UCX_Oak_LOD0", "Oak_LOD1", "Oak_LOD2"];
    let nodes: Vec<Value> = names.iter().map(|name| json!({"mesh": 0, "name": name})).collect();
    let bytes = edited(|json| {
        json["nodes"] = json!(nodes);
        json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    });
    let (plant, warnings) = load(&bytes);
    assert_eq!(triangles(&plant), WHOLE);
    says(&warnings, &["collision hulls", names[0]]);
    says(&warnings, &["coarser levels of detail", names[2]]);
    // A file of one level is that tree, whatever its name.
    let (plant, warnings) = load(&edited(|json| json["nodes"] = json!([{"mesh": 0, "name": "Oak_LOD2"}])));
    assert!(triangles(&plant) == WHOLE && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn hulls_and_ground_are_told_apart_by_name() {
    for name in ["UCX_Oak", "Oak-col", "oak_collision", "Collider"] {
        let bytes = edited(|json| {
            json["nodes"] = json!([{"mesh": 0, "name": "Oak"}, {"mesh": 0, "name": name}]);
            json["scenes"] = json!([{"nodes": [0, 1]}]);
        });
        let (plant, warnings) = load(&bytes);
        assert_eq!(triangles(&plant), WHOLE, "{name}");
        says(&warnings, &["collision hulls", name]);
    }
    for name in ["Ground", "Plane.001", "floor"] {
        let bytes = edited(|json| {
            json["nodes"] =
                json!([{"mesh": 0, "name": "Oak"}, {"mesh": 0, "name": name, "scale": [20.0, 0.001, 20.0]}]);
            json["scenes"] = json!([{"nodes": [0, 1]}]);
        });
        let (plant, warnings) = load(&bytes);
        assert_eq!(triangles(&plant), WHOLE, "{name}");
        says(&warnings, &["ground planes", name]);
    }
    // A tree may have any name.
    for name in ["Plane", "UCX_Oak", "Ground"] {
        let (plant, _) = load(&edited(|json| json["nodes"] = json!([{"mesh": 0, "name": name}])));
        assert_eq!(triangles(&plant), WHOLE, "{name}");
    }
}

#[test]
fn trees_side_by_side_are_individuals_of_a_scene_and_mentioned_elsewhere() {
    let bytes = edited(|json| {
        json["nodes"] =
            json!([{"mesh": 0, "name": "Oak A"}, {"mesh": 0, "name": "Oak B", "translation": [9.0, 0.0, 0.0]}]);
        json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    let (plant, warnings) = load(&bytes);
    assert_eq!(triangles(&plant), 2 * WHOLE);
    says(&warnings, &["2 trees side by side (Oak A, Oak B)", "node: [\"Oak A\"]"]);
    let one = load_with(&bytes, &GltfOptions { node: vec!["Oak A".to_owned()], ..GltfOptions::default() });
    assert!(triangles(&one.0) == WHOLE && one.1.is_empty(), "{:?}", one.1);
    // A scene makes an individual of each.
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("oaks.glb");
    std::fs::write(&file, &bytes).expect("a file");
    let trees = canopy::plant::gltf::trees_of(&file, &GltfOptions::default());
    assert_eq!(trees, ["Oak A", "Oak B"]);
    let text = "(terrain: Flat(size: 100), place: (latitude: 48, longitude: 9, time: \"2026-06-21T12:30+01:00\"), species: [(name: \"oak\", \
                plant: Gltf(files: [\"oaks.glb\"]), height: (9, 12), lighting: Local)], trees: Scattered(stems_per_hectare: 40, \
                surroundings: 0))";
    let scene = canopy::scene::Scene::parse(text, &folder.path().join("oaks.ron")).expect("a scene");
    let stage = canopy::assets::Stage::build(&scene, &mut canopy::progress::Silent).expect("a stage");
    assert_eq!(stage.variants.first(), Some(&(0..2)));
    let names: Vec<&str> = stage.plants.iter().map(|baked| baked.plant.name.as_str()).collect();
    assert_eq!(names, ["Oak A", "Oak B"]);
    for baked in stage.plants.iter() {
        let bounds = baked.plant.bounds().expect("triangles");
        assert!(
            triangles(&baked.plant) == WHOLE && bounds.min.x.abs() < 6.0 && (bounds.max.y - 10.5).abs() < 0.1,
            "{bounds:?}"
        );
    }
    // Trees without names of their own stay one plant, and the message says what to do.
    let nameless = edited(|json| {
        json["nodes"] = json!([{"mesh": 0, "name": "Oak"}, {"mesh": 0, "name": "Oak", "translation": [9.0, 0.0, 0.0]}]);
        json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    std::fs::write(&file, &nameless).expect("a file");
    assert!(canopy::plant::gltf::trees_of(&file, &GltfOptions::default()).is_empty());
    says(&load(&nameless).1, &["2 trees side by side", "give each a node with a name of its own"]);
    // Nor does a name choose one of two trees if it is that of the other's mesh.
    let crossed = edited(|json| {
        let mut other = json["meshes"][0].clone();
        other["name"] = "Oak A".into();
        json["meshes"][0]["name"] = "Oak B".into();
        json["meshes"].as_array_mut().expect("meshes").push(other);
        json["nodes"] =
            json!([{"mesh": 0, "name": "Oak A"}, {"mesh": 1, "name": "Oak B", "translation": [9.0, 0.0, 0.0]}]);
        json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    std::fs::write(&file, &crossed).expect("a file");
    assert!(canopy::plant::gltf::trees_of(&file, &GltfOptions::default()).is_empty());
    // The parts of one tree are not.
    let parts = edited(|json| {
        json["nodes"] = json!([{"mesh": 0, "name": "A"}, {"mesh": 0, "name": "B", "translation": [0.5, 0.0, 0.0]}]);
        json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    assert!(load(&parts).1.is_empty());
}

#[test]
fn billboards_beside_a_tree_are_levels_of_it() {
    let bytes = edited(|json| {
        json["nodes"] = json!([{"mesh": 0, "name": "Oak"}, {"mesh": 0, "name": "Oak_Billboard"}]);
        json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    let (plant, warnings) = load(&bytes);
    assert_eq!(triangles(&plant), WHOLE);
    says(&warnings, &["coarser levels of detail", "Oak_Billboard"]);
}

#[test]
fn the_caller_names_what_is_the_tree() {
    let bytes = edited(|json| {
        json["nodes"] =
            json!([{"mesh": 0, "name": "A"}, {"children": [2], "name": "B"}, {"mesh": 0, "name": "b trunk"}]);
        json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    let count = |node: &[&str], ignore: &[&str]| {
        let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
        let options = GltfOptions { node: names(node), ignore: names(ignore), ..GltfOptions::default() };
        load_plant_bytes(&bytes, "tree.glb".as_ref(), &Default::default(), &options)
            .map(|(plant, w)| (triangles(&plant), w))
    };
    assert_eq!(count(&[], &[]).expect("a plant").0, 2 * WHOLE);
    assert_eq!(count(&["A"], &[]).expect("a plant").0, WHOLE);
    assert_eq!(count(&["B"], &[]).expect("a plant").0, WHOLE);
    assert_eq!(count(&[], &["B"]).expect("a plant").0, WHOLE);
    assert_eq!(count(&[], &["leaves", "A"]).expect("a plant").0, 16);
    let (_, warnings) = count(&[], &["C"]).expect("a plant");
    says(&warnings, &["the options name 'C'"]);
    assert!(matches!(count(&["C"], &[]), Err(PlantError::Empty { .. })));
}

// ---------------------------------------------------------------- shapes

#[test]
fn skins_stand_as_their_bones_do() {
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
    let joints = glb.accessor(5121, "VEC4", 4, &[0; 16]);
    let weights = glb.floats("VEC4", 4, &[1.0, 0.0, 0.0, 0.0].repeat(4));
    let bind = glb.floats("MAT4", 16, &glam::Mat4::from_scale(Vec3::new(1.0, 1.5, 1.0)).to_cols_array());
    glb.with(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions},"JOINTS_0":{joints},"WEIGHTS_0":{weights}}},
        "indices":{indices}}}]}}],"skins":[{{"joints":[1],"inverseBindMatrices":{bind}}}],
        "nodes":[{{"mesh":0,"skin":0,"scale":[5,5,5]}},{{"scale":[1,2,1]}}],"scenes":[{{"nodes":[0,1]}}]"#
    ));
    let (plant, _) = glb.load().expect("a plant");
    assert!((plant.height() - 6.0).abs() < 1e-4, "{}", plant.height());
    let width = plant.bounds().expect("vertices").size().x;
    assert!((width - 2.0).abs() < 1e-4, "{width}");
}

#[test]
fn morph_targets_have_their_default_weights() {
    for (weights, height) in [(r#","weights":[0.5]"#, 3.0), (r#","weights":[0]"#, 2.0), ("", 2.0)] {
        for at_node in [false, true] {
            let mut glb = Glb::default();
            let positions = glb.floats("VEC3", 3, &SQUARE);
            let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
            let target = glb.floats("VEC3", 3, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0]);
            let (mesh, node) = if at_node { ("", weights) } else { (weights, "") };
            glb.with(&format!(
                r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions}}},"indices":{indices},"targets":[
                {{"POSITION":{target}}}]}}]{mesh}}}],"nodes":[{{"mesh":0{node}}}]"#
            ));
            let (plant, warnings) = glb.load().expect("a plant");
            assert!((plant.height() - height).abs() < 1e-5, "{weights}: {}", plant.height());
            assert_eq!(warnings.iter().any(|w| w.message.contains("morph targets")), height == 2.0, "{warnings:?}");
        }
    }
}

#[test]
fn vertex_colours_make_parts() {
    let colours = |values: &[f32], material: &str| {
        let mut glb = Glb::default();
        // Two squares that share no vertex.
        let mut points = SQUARE.to_vec();
        points.extend(SQUARE.chunks(3).flat_map(|p| [p[0], p[1] + 2.0, p[2]]));
        let positions = glb.floats("VEC3", 3, &points);
        let indices = glb.indices(&[0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]);
        let colors = glb.floats("VEC3", 3, values);
        glb.with(&format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions},"COLOR_0":{colors}}},"indices":{indices},
            "material":0}}]}}],"nodes":[{{"mesh":0}}],"materials":[{{"name":"all"{material}}}]"#
        ));
        glb.load().expect("a plant")
    };
    let two = [[0.3, 0.2, 0.1].repeat(4), [0.1, 0.5, 0.1].repeat(4)].concat();
    let (plant, warnings) = colours(&two, r#","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1]}"#);
    assert_eq!(plant.parts.len(), 2);
    says(&warnings, &["vertex colours are used as 2 colours"]);
    let mut bases: Vec<Vec3> = plant.parts.iter().map(|part| part.material.base_color).collect();
    bases.sort_by(|a, b| a.x.total_cmp(&b.x));
    assert!((bases[0] - Vec3::new(0.05, 0.25, 0.05)).length() < 1e-3, "{bases:?}");
    assert!((bases[1] - Vec3::new(0.15, 0.1, 0.05)).length() < 1e-3, "{bases:?}");
    // White says nothing.
    let (plant, warnings) = colours(&[1.0; 24], "");
    assert_eq!(plant.parts.len(), 1);
    assert!(!warnings.iter().any(|warning| warning.message.contains("vertex colours")), "{warnings:?}");
}

#[test]
fn instances_are_drawn_each() {
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
    let translations = glb.floats("VEC3", 3, &[0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 6.0, 0.0]);
    let scales = glb.floats("VEC3", 3, &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 1.0]);
    glb.with(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions}}},"indices":{indices}}}]}}],
        "extensionsUsed":["EXT_mesh_gpu_instancing"],"extensionsRequired":["EXT_mesh_gpu_instancing"],
        "nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{translations},
        "SCALE":{scales}}}}}}}}}]"#
    ));
    let (plant, _) = glb.load().expect("a plant");
    assert_eq!(triangles(&plant), 6);
    assert!((plant.height() - 10.0).abs() < 1e-5, "{}", plant.height());
}

// ---------------------------------------------------------------- textures

/// A picture of leaves in these bytes.
fn picture(format: image::ImageFormat, alpha: impl Fn(u32) -> u8) -> Vec<u8> {
    let image = image::RgbaImage::from_fn(16, 16, |x, y| image::Rgba([60, 120, 30, alpha(x + y)]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("a picture in memory");
    bytes.into_inner()
}

fn textured(png: &[u8], texture: &str, material: &str) -> (Plant, Vec<Warning>) {
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let uvs = glb.floats("VEC2", 2, &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
    let view = glb.view(png);
    glb.with(&format!(
        r#""images":[{{"bufferView":{view},"mimeType":"image/png","name":"Leaf_Albedo"}}],"textures":[{texture}],
        "materials":[{{"name":"leaf",{material}}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":
        {{"POSITION":{positions},"TEXCOORD_0":{uvs}}},"indices":{indices},"material":0}}]}}]"#
    ));
    glb.load().expect("a plant")
}

const MASKED: &str = r#""alphaMode":"MASK","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#;

#[test]
fn leaves_without_a_cut_out_are_told_with_the_name_of_the_texture() {
    let png = |alpha: fn(u32) -> u8| picture(image::ImageFormat::Png, alpha);
    let cut = png(|at| if at % 3 == 0 { 0 } else { 255 });
    let full = png(|_| 255);
    let plain = r#"{"source":0}"#;
    let missing = |warnings: &[Warning]| {
        warnings.iter().any(|w| w.kind == WarningKind::Missing && w.message.contains("Leaf_Albedo"))
    };
    assert!(!missing(&textured(&cut, plain, MASKED).1));
    says(&textured(&full, plain, MASKED).1, &["'Leaf_Albedo' has no transparent texels", "full cards"]);
    says(&textured(b"no picture", plain, MASKED).1, &["'Leaf_Albedo'", "full cards"]);
    let opaque = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#;
    says(&textured(&cut, plain, opaque).1, &["'leaf' is opaque", "name the material as foliage"]);
    let (_, warnings) = load(&TreeFile { absent_texture: true, ..TreeFile::default() }.bytes());
    says(&warnings, &["'absent.png'", "full cards"]);
}

#[test]
fn webp_is_read_with_or_without_a_fallback() {
    let webp = picture(image::ImageFormat::WebP, |at| if at % 3 == 0 { 0 } else { 255 });
    for texture in [r#"{"extensions":{"EXT_texture_webp":{"source":0}}}"#, r#"{"source":0}"#] {
        let (plant, warnings) = textured(&webp, texture, MASKED);
        assert!(plant.parts[0].material.base_color_texture.is_some(), "{texture}: {warnings:?}");
    }
}

#[test]
fn a_quantised_file_keeps_its_normal_map() {
    let png = picture(image::ImageFormat::Png, |at| if at % 3 == 0 { 0 } else { 255 });
    let transform = r#""extensions":{"KHR_texture_transform":{"offset":[0.1,0.2],"scale":[2,2]}}"#;
    let other = r#""extensions":{"KHR_texture_transform":{"offset":[0.1,0.2],"scale":[3,2]}}"#;
    let material = |normal: &str| {
        format!(
            r#""alphaMode":"MASK","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,{transform}}}}},"normalTexture":
            {{"index":0,{normal}}}"#
        )
    };
    let (plant, _) = textured(&png, r#"{"source":0}"#, &material(transform));
    assert!(plant.parts[0].material.normal_texture.is_some());
    let (plant, warnings) = textured(&png, r#"{"source":0}"#, &material(other));
    assert!(plant.parts[0].material.normal_texture.is_none());
    says(&warnings, &["normal map has texture coordinates of its own"]);
}

#[test]
fn files_beside_it_are_found_under_many_spellings() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("Textures")).expect("a folder");
    let png = picture(image::ImageFormat::Png, |at| if at % 3 == 0 { 0 } else { 255 });
    fs::write(folder.path().join("Textures/Leaf A.png"), &png).expect("a file");
    fs::write(folder.path().join("100%25.png"), &png).expect("a file");
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let uvs = glb.floats("VEC2", 2, &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
    for uri in [
        "Textures/Leaf%20A.png",
        "Textures/Leaf A.png",
        r"Textures\\Leaf A.png",
        r"textures\\LEAF%20a.PNG",
        r".\\Textures\\Leaf A.png",
        r"C:\\models\\Textures\\100%2525.png",
        "100%25.png",
    ] {
        let mut glb = Glb {
            bin: glb.bin.clone(),
            views: glb.views.clone(),
            accessors: glb.accessors.clone(),
            members: Vec::new(),
        };
        glb.with(&format!(
            r#""images":[{{"uri":"{uri}"}}],"textures":[{{"source":0}}],"materials":[{{"name":"leaf",{MASKED}}}],
            "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions},"TEXCOORD_0":{uvs}}},
            "indices":{indices},"material":0}}]}}]"#
        ));
        let path = folder.path().join("plant.glb");
        fs::write(&path, glb.bytes()).expect("a file");
        let (plant, warnings) = load_plant(&path, &GltfOptions::default()).expect("a plant");
        assert!(plant.parts[0].material.base_color_texture.is_some(), "{uri}: {warnings:?}");
    }
}

// ---------------------------------------------------------------- extensions

#[test]
fn a_required_extension_that_is_not_understood_is_an_error() {
    for (name, remedy) in [
        ("KHR_draco_mesh_compression", "gltf-transform copy"),
        ("KHR_texture_basisu", "PNG"),
        ("MSFT_texture_dds", "PNG"),
        ("EXT_something_new", "export without it"),
    ] {
        let bytes = edited(|json| {
            json["extensionsUsed"] = json!([name]);
            json["extensionsRequired"] = json!([name]);
        });
        let error = load_plant_bytes(&bytes, "tree.glb".as_ref(), &Default::default(), &GltfOptions::default());
        let text = error.expect_err("not understood").to_string();
        assert!(text.contains(name) && text.contains(remedy), "{text}");
    }
    for name in ["KHR_mesh_quantization", "EXT_meshopt_compression", "EXT_texture_webp", "KHR_materials_unlit"] {
        let bytes = edited(|json| json["extensionsRequired"] = json!([name]));
        assert_eq!(triangles(&load(&bytes).0), WHOLE, "{name}");
    }
    let (_, warnings) = load(&edited(|json| json["extensionsUsed"] = json!(["EXT_something_new"])));
    says(&warnings, &["the extension EXT_something_new"]);
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn compressed_files_are_the_same_tree() {
    let read = |name: &str| load_plant(&data(&format!("hard/92-glb-compressed/{name}.glb")), &GltfOptions::default());
    let (reference, _) = read("reference-70").expect("a plant");
    let size = reference.bounds().expect("vertices").size();
    for name in ["meshopt", "quantize", "webp"] {
        let (plant, warnings) = read(name).expect("a plant");
        assert_eq!(triangles(&plant), triangles(&reference), "{name}");
        let found = plant.bounds().expect("vertices").size();
        assert!((found - size).abs().max_element() < 0.01, "{name}: {found} instead of {size}");
        let texture =
            |plant: &Plant| plant.parts[1].material.base_color_texture.as_ref().map(|image| image.dimensions());
        assert_eq!(texture(&plant), texture(&reference), "{name}: {warnings:?}");
        // The same corners, wherever they stand in the file.
        let corner = |plant: &Plant| -> Vec<[i32; 3]> {
            let centre = |part: &canopy::plant::PlantPart, t: &[u32; 3]| {
                t.iter().map(|at| part.mesh.positions[*at as usize]).sum::<Vec3>() / 3.0
            };
            let mut centres: Vec<[i32; 3]> = plant
                .parts
                .iter()
                .flat_map(|part| {
                    part.mesh
                        .triangles
                        .iter()
                        .map(move |t| (centre(part, t) * 5.0).round().to_array().map(|v| v as i32))
                })
                .collect();
            centres.sort_unstable();
            centres
        };
        let (found, expected) = (corner(&plant), corner(&reference));
        let near = found.iter().filter(|centre| expected.binary_search(centre).is_ok()).count();
        assert!(near * 10 > found.len() * 8, "{name}: {near} of {}", found.len());
    }
    assert!(read("draco").expect_err("compressed").to_string().contains("KHR_draco_mesh_compression"));
    let (plant, warnings) = load_plant(&data("hard/78-glb-z-up/tree.glb"), &GltfOptions::default()).expect("a plant");
    assert!((plant.bounds().expect("vertices").size() - size).abs().max_element() < 0.01);
    says(&warnings, &["turned upright"]);
}
