//! glTF import: what arrives, what is refused, and that nothing panics.

use std::fs;
use std::path::{Path, PathBuf};

use canopy::plant::gltf::{GltfOptions, PlantError, PlantReport, Warning, WarningKind, load_plant};
use canopy::plant::texture::{AlphaFade, alpha_tested_mips, fade_alpha};
use canopy::plant::{Gloss, LeafColors, LeafKind, Measured, PartKind, Plant};
use glam::{Vec2, Vec3};
use proptest::prelude::*;

use super::texture::leaves;
use crate::support::data::data;
use crate::support::glb::TreeFile;

/// Builds a small GLB file piece by piece.
#[derive(Default)]
pub(super) struct Glb {
    pub bin: Vec<u8>,
    pub views: Vec<String>,
    pub accessors: Vec<String>,
    /// Further members of the root, such as `"nodes":[...]`.
    pub members: Vec<String>,
}

impl Glb {
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let view = format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#, self.bin.len(), bytes.len());
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    pub fn accessor(&mut self, component: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.accessors
            .push(format!(r#"{{"bufferView":{view},"componentType":{component},"type":"{shape}","count":{count}}}"#));
        self.accessors.len() - 1
    }

    pub fn floats(&mut self, shape: &str, width: usize, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(5126, shape, values.len() / width, &bytes)
    }

    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(5123, "SCALAR", values.len(), &bytes)
    }

    pub fn with(&mut self, member: &str) -> &mut Self {
        self.members.push(member.to_owned());
        self
    }

    fn json(&self, buffer: &str) -> String {
        let mut members = vec![r#""asset":{"version":"2.0"}"#.to_owned()];
        members.push(format!(r#""buffers":[{{"byteLength":{}{buffer}}}]"#, self.bin.len()));
        members.push(format!(r#""bufferViews":[{}]"#, self.views.join(",")));
        members.push(format!(r#""accessors":[{}]"#, self.accessors.join(",")));
        members.extend(self.members.iter().cloned());
        format!("{{{}}}", members.join(","))
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut json = self.json("").into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + self.bin.len();
        let mut bytes = b"glTF".to_vec();
        for word in [2, length, json.len()] {
            bytes.extend((word as u32).to_le_bytes());
        }
        bytes.extend(b"JSON");
        bytes.extend(json);
        bytes.extend((self.bin.len() as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(&self.bin);
        bytes
    }

    fn load_with(&self, options: &GltfOptions) -> Result<(Plant, Vec<Warning>), PlantError> {
        load_bytes(&self.bytes(), "plant.glb", options)
    }

    pub fn load(&self) -> Result<(Plant, Vec<Warning>), PlantError> {
        self.load_with(&GltfOptions::default())
    }
}

fn load_bytes(bytes: &[u8], name: &str, options: &GltfOptions) -> Result<(Plant, Vec<Warning>), PlantError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a temporary file");
    load_plant(&path, options)
}

/// A square of 2 m x 2 m in the plane z = 0, standing on the ground around the origin, two triangles towards +Z.
pub(super) const SQUARE: [f32; 12] = [-1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0, -1.0, 2.0, 0.0];

/// The square with an opaque and a masked material.
fn tree() -> Glb {
    let mut glb = Glb::default();
    let (positions, indices) = (glb.floats("VEC3", 3, &SQUARE), glb.indices(&[0, 1, 2, 0, 2, 3]));
    let primitive = |material: u32| {
        format!(r#"{{"attributes":{{"POSITION":{positions}}},"indices":{indices},"material":{material}}}"#)
    };
    glb.with(&format!(r#""meshes":[{{"primitives":[{},{}]}}]"#, primitive(1), primitive(0)));
    glb.with(
        r#""materials":[{"name":"bark","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.4,0.3,1]}},
        {"name":"leaves","alphaMode":"MASK","alphaCutoff":0.4}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0"#,
    );
    glb
}

/// A file of one primitive on one node; `primitive` and `node` are JSON members.
fn one(glb: &mut Glb, primitive: &str, node: &str) -> Result<(Plant, Vec<Warning>), PlantError> {
    glb.with(&format!(r#""meshes":[{{"primitives":[{{{primitive}}}]}}],"nodes":[{{"mesh":0{node}}}]"#));
    glb.load()
}

fn is_sound(plant: &Plant) -> bool {
    plant.parts.iter().all(|part| {
        let mesh = &part.mesh;
        mesh.normals.len() == mesh.positions.len()
            && mesh.uvs.len() == mesh.positions.len()
            && mesh.triangles.iter().flatten().all(|&index| (index as usize) < mesh.positions.len())
            && mesh.positions.iter().all(|position| position.is_finite())
            && mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3)
            && mesh.uvs.iter().all(|uv| uv.is_finite())
    })
}

#[test]
fn wood_and_foliage_come_from_the_alpha_mode() {
    let (plant, warnings) = tree().load().expect("a plant");
    assert!(is_sound(&plant));
    assert_eq!(plant.name, "plant");
    let kinds: Vec<PartKind> = plant.parts.iter().map(|part| part.kind).collect();
    assert_eq!(kinds, [PartKind::Wood, PartKind::Foliage]);
    assert_eq!(plant.parts[0].material.base_color, Vec3::new(0.5, 0.4, 0.3));
    assert_eq!(plant.parts[0].material.transmission, Vec3::ZERO);
    assert_eq!(plant.parts[1].material.alpha_cutoff, 0.4);
    assert_eq!(plant.parts[1].material.transmission, LeafKind::Thin.transmission());
    assert!(warnings.iter().any(|w| w.kind == WarningKind::Repaired && w.message.contains("normal")));
    for normal in &plant.parts[0].mesh.normals {
        assert!((*normal - Vec3::Z).length() < 1e-6);
    }
    let report = PlantReport::new(&plant, &warnings);
    assert_eq!((report.wood_triangles, report.foliage_triangles), (2, 2));
    assert!((report.parts[0].area - 4.0).abs() < 1e-6);
    assert!(report.to_string().contains("2 triangles of wood, 2 of foliage"));
}

#[test]
fn options_name_materials_and_scale() {
    let options = GltfOptions {
        height: Some(10.0),
        foliage_materials: vec!["bark".into()],
        wood_materials: vec!["leaves".into(), "twigs".into()],
        transmission: Some(Vec3::splat(0.3)),
        name: Some("inverted".into()),
        ..GltfOptions::default()
    };
    let (plant, warnings) = tree().load_with(&options).expect("a plant");
    assert!((plant.height() - 10.0).abs() < 1e-4);
    assert_eq!(plant.name, "inverted");
    assert_eq!(plant.parts[1].material.base_color, Vec3::new(0.5, 0.4, 0.3));
    assert_eq!(plant.parts[1].material.transmission, Vec3::splat(0.3));
    assert!(warnings.iter().any(|w| w.message.contains("'twigs'") && w.message.contains("bark, leaves")));
    for height in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let failed = tree().load_with(&GltfOptions { height: Some(height), ..options.clone() });
        assert!(matches!(failed, Err(PlantError::Option { .. })));
    }
}

/// A tree whose leaves have these members in their material, and what they do to light.
fn leafy(leaf_members: &'static str, options: &GltfOptions) -> (LeafColors, Vec<Warning>) {
    let file = TreeFile { leaf_members, ..TreeFile::default() };
    let (plant, warnings) = load_bytes(&file.bytes(), "tree.glb", options).expect("a plant");
    (plant.leaf_colors(), warnings)
}

#[test]
fn leaves_pass_as_much_light_as_their_kind_does() {
    let of = |leaf: LeafKind| leafy("", &GltfOptions { leaf, ..GltfOptions::default() }).0;
    let thin = of(LeafKind::default());
    for kind in LeafKind::ALL {
        let leaf = of(kind);
        assert_eq!(leaf.reflected, thin.reflected);
        let ratio = leaf.transmitted / thin.transmitted;
        assert!((ratio - kind.factor() / 1.3).abs().max_element() < 1e-4, "{kind:?}: {ratio}");
    }
}

#[test]
fn a_file_that_states_its_diffuse_transmission_is_believed() {
    let plain = leafy("", &GltfOptions::default()).0;
    let stated = r#","extensions":{"KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.3,
        "diffuseTransmissionColorFactor":[0.02,0.15,0.002]}}"#;
    // Whatever kind of leaf the scene has it for, and whatever gloss.
    for (leaf, gloss) in [(LeafKind::Thin, None), (LeafKind::Needle, Some(Gloss::MATT))] {
        let (leaf, warnings) = leafy(stated, &GltfOptions { leaf, gloss, ..GltfOptions::default() });
        assert!((leaf.reflected / plain.reflected - 0.7).abs().max_element() < 1e-3, "{leaf:?}");
        let wanted = 0.3 * Vec3::new(0.02, 0.15, 0.002);
        assert!((leaf.transmitted / wanted - 1.0).abs().max_element() < 0.01, "{leaf:?}");
        assert_eq!(warnings, []);
    }
    // The caller's own number goes before the file's.
    let (leaf, _) = leafy(stated, &GltfOptions { transmission: Some(Vec3::ZERO), ..GltfOptions::default() });
    assert_eq!((leaf.transmitted, leaf.reflected), (Vec3::ZERO, plain.reflected));
    // By its defaults the extension lets nothing pass.
    let (leaf, _) = leafy(r#","extensions":{"KHR_materials_diffuse_transmission":{}}"#, &GltfOptions::default());
    assert_eq!((leaf.transmitted, leaf.reflected), (Vec3::ZERO, plain.reflected));
}

#[test]
fn textures_of_transmitted_light_count_texel_by_texel() {
    // The leaves' own picture: its alpha is 1 wherever there is leaf, which is less than half of it.
    let stated = r#","extensions":{"KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.2,
        "diffuseTransmissionTexture":{"index":0},"diffuseTransmissionColorFactor":[0.5,0.5,0.5],
        "diffuseTransmissionColorTexture":{"index":0}}}"#;
    let plain = leafy("", &GltfOptions::default()).0;
    let (leaf, warnings) = leafy(stated, &GltfOptions::default());
    assert!((leaf.reflected / plain.reflected - 0.8).abs().max_element() < 1e-3, "{leaf:?}");
    // To the codes of the texture.
    assert!((leaf.transmitted - 0.2 * 0.5 * plain.reflected).abs().max_element() < 1e-4, "{leaf:?}");
    assert!(!warnings.iter().any(|warning| warning.message.contains("transmitted light")), "{warnings:?}");
}

#[test]
fn what_no_leaf_can_transmit_is_repaired_with_a_word() {
    for (members, word) in [
        (
            r#","extensions":{"KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":"much"}}"#,
            "cannot be read",
        ),
        (r#","extensions":{"KHR_materials_diffuse_transmission":[]}"#, "cannot be read"),
        (r#","extensions":{"KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":1e9}}"#, "no room"),
        (
            r#","extensions":{"KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.1,
            "diffuseTransmissionTexture":{"index":99}}}"#,
            "transmission texture 99 does not exist",
        ),
    ] {
        let (leaf, warnings) = leafy(members, &GltfOptions::default());
        assert!(warnings.iter().any(|warning| warning.message.contains(word)), "{word}: {warnings:?}");
        assert!(leaf.transmitted.min_element() >= 0.0 && (leaf.transmitted + leaf.reflected).max_element() <= 1.0);
    }
}

#[test]
fn transforms_move_normals_and_mirroring_turns_triangles() {
    for (node, facing) in
        [("", 1.0), (r#","scale":[-1,1,1]"#, 1.0), (r#","scale":[1,1,-2]"#, -1.0), (r#","rotation":[0,1,0,0]"#, -1.0)]
    {
        let mut glb = Glb::default();
        let positions = glb.floats("VEC3", 3, &SQUARE);
        let normals = glb.floats("VEC3", 3, &[0.0, 0.6, 0.8].repeat(4));
        let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
        let primitive = format!(r#""attributes":{{"POSITION":{positions},"NORMAL":{normals}}},"indices":{indices}"#);
        let (plant, _) = one(&mut glb, &primitive, node).expect("a plant");
        let mesh = &plant.parts[0].mesh;
        let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
        let face = (b - a).cross(c - a).normalize();
        assert!((face - Vec3::Z * facing).length() < 1e-5, "{node}: {face}");
        assert!(mesh.normals[0].dot(face) > 0.0 && mesh.normals[0].y > 0.0, "{node}: {}", mesh.normals[0]);
    }
    // Scaled by 2 along y, a plane tilted by (0.6, 0.8) has its normal at (0.3, 0.8), normalised.
    let mut glb = Glb::default();
    let (positions, normals) = (glb.floats("VEC3", 3, &SQUARE), glb.floats("VEC3", 3, &[0.0, 0.6, 0.8].repeat(4)));
    let indices = glb.indices(&[0, 1, 2]);
    let primitive = format!(r#""attributes":{{"POSITION":{positions},"NORMAL":{normals}}},"indices":{indices}"#);
    let (plant, _) = one(&mut glb, &primitive, r#","scale":[1,2,1]"#).expect("a plant");
    assert!((plant.parts[0].mesh.normals[0] - Vec3::new(0.0, 0.3, 0.8).normalize()).length() < 1e-5);
    assert_eq!(plant.parts[0].mesh.positions.len(), 3, "the unused vertex is dropped");
}

#[test]
fn strips_and_fans_keep_their_facing() {
    let strip = [0u16, 1, 3, 2];
    let fan = [0u16, 1, 2, 3];
    for (mode, indices) in [(5, strip), (6, fan)] {
        let mut glb = Glb::default();
        let (positions, indices) = (glb.floats("VEC3", 3, &SQUARE), glb.indices(&indices));
        let primitive = format!(r#""attributes":{{"POSITION":{positions}}},"indices":{indices},"mode":{mode}"#);
        let (plant, _) = one(&mut glb, &primitive, "").expect("a plant");
        let mesh = &plant.parts[0].mesh;
        assert_eq!(mesh.triangles.len(), 2);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            assert!(((b - a).cross(c - a) - Vec3::Z * 4.0).length() < 1e-5, "mode {mode}");
        }
    }
}

#[test]
fn textures_and_their_transform_arrive() {
    let mut png = Vec::new();
    leaves(16, 1).write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).expect("a PNG in memory");
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let uvs = glb.floats("VEC2", 2, &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let indices = glb.indices(&[0, 1, 2]);
    let view = glb.view(&png);
    glb.with(&format!(
        r#""images":[{{"bufferView":{view},"mimeType":"image/png"}}],"textures":[{{"source":0}},{{"source":7}}],
        "extensionsUsed":["KHR_texture_transform"],
        "materials":[{{"alphaMode":"MASK","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"extensions":
        {{"KHR_texture_transform":{{"offset":[0.5,0],"scale":[2,3],"rotation":1.5707963267948966,"texCoord":1}}}}}}}},
        "normalTexture":{{"index":1,"texCoord":1}}}}]"#
    ));
    let primitive =
        format!(r#""attributes":{{"POSITION":{positions},"TEXCOORD_1":{uvs}}},"indices":{indices},"material":0"#);
    let (plant, warnings) = one(&mut glb, &primitive, "").expect("a plant");
    let part = &plant.parts[0];
    assert_eq!(part.material.base_color_texture.as_deref(), Some(&leaves(16, 1)));
    // (u, v) = (0, 1): scaled to (0, 3), turned by a quarter to (3, 0), moved by 0.5.
    assert!((part.mesh.uvs[0] - Vec2::new(3.5, 0.0)).length() < 1e-5, "{}", part.mesh.uvs[0]);
    assert!(part.material.normal_texture.is_none());
    assert!(warnings.iter().any(|w| w.kind == WarningKind::Ignored && w.message.contains("normal map")));
}

#[test]
fn missing_and_broken_textures_leave_the_plant_untextured() {
    for image in [r#"{"uri":"no-such.png"}"#, r#"{"uri":"data:image/png;base64,AAAA"}"#, r#"{"bufferView":99}"#, "{}"] {
        let mut glb = Glb::default();
        let positions = glb.floats("VEC3", 3, &SQUARE);
        glb.with(&format!(
            r#""images":[{image}],"textures":[{{"source":0}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]"#
        ));
        let primitive = format!(r#""attributes":{{"POSITION":{positions}}},"material":0"#);
        let (plant, warnings) = one(&mut glb, &primitive, "").expect("a plant");
        assert!(plant.parts[0].material.base_color_texture.is_none());
        assert!(warnings.iter().any(|w| w.kind == WarningKind::Missing && w.location == "/images/0"), "{warnings:?}");
    }
}

#[test]
fn text_files_with_data_uris_and_files_beside_them() {
    let glb = tree();
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let encoded: String = glb
        .bin
        .chunks(3)
        .flat_map(|chunk| {
            let bits = chunk.iter().enumerate().fold(0u32, |bits, (i, &byte)| bits | u32::from(byte) << (16 - 8 * i));
            (0..4).map(move |i| match i <= chunk.len() {
                true => char::from(digits[(bits >> (18 - 6 * i)) as usize & 63]),
                false => '=',
            })
        })
        .collect();
    let inline = glb.json(&format!(r#","uri":"data:application/octet-stream;base64,{encoded}""#));
    let (plant, _) = load_bytes(inline.as_bytes(), "plant.gltf", &GltfOptions::default()).expect("a plant");
    assert_eq!(plant.triangle_count(PartKind::Wood), 2);

    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("plant.gltf");
    fs::write(&path, glb.json(r#","uri":"my%20data.bin""#)).expect("a temporary file");
    let message = load_plant(&path, &GltfOptions::default()).expect_err("the data are missing").to_string();
    assert!(message.contains("my data.bin") && message.contains("/buffers/0"), "{message}");
    fs::write(folder.path().join("my data.bin"), &glb.bin).expect("a temporary file");
    assert!(load_plant(&path, &GltfOptions::default()).is_ok());
    fs::write(folder.path().join("my data.bin"), &glb.bin[..20]).expect("a temporary file");
    assert!(matches!(load_plant(&path, &GltfOptions::default()), Err(PlantError::Data { .. })));
    for uri in ["https://example.org/a.bin", "/etc/hostname", "file:///a", "."] {
        fs::write(&path, glb.json(&format!(r#","uri":"{uri}""#))).expect("a temporary file");
        assert!(matches!(load_plant(&path, &GltfOptions::default()), Err(PlantError::Data { .. })), "{uri}");
    }
}

#[test]
fn sparse_accessors_substitute_and_are_checked() {
    for (index, sound) in [(1u16, true), (4, false)] {
        let mut glb = Glb::default();
        let positions = glb.floats("VEC3", 3, &SQUARE);
        let indices = glb.view(&index.to_le_bytes());
        let values = glb.view(&[3.0f32, 0.0, 0.0].map(f32::to_le_bytes).concat());
        let sparse = format!(
            r#","sparse":{{"count":1,"indices":{{"bufferView":{indices},"componentType":5123}},"values":{{"bufferView":{values}}}}}}}"#
        );
        let accessor = &mut glb.accessors[positions];
        accessor.pop();
        accessor.push_str(&sparse);
        let triangle = glb.indices(&[0, 1, 2]);
        let result = one(&mut glb, &format!(r#""attributes":{{"POSITION":{positions}}},"indices":{triangle}"#), "");
        match result {
            Ok((plant, _)) if sound => assert!((plant.bounds().expect("vertices").size().x - 4.0).abs() < 1e-5),
            Err(PlantError::Data { location, .. }) if !sound => assert_eq!(location, "/accessors/0/sparse"),
            other => panic!("{index}: {other:?}"),
        }
    }
}

#[test]
fn damaged_geometry_is_refused_with_its_place() {
    let with = |change: &dyn Fn(&mut Glb), primitive: &str, node: &str| {
        let mut glb = Glb::default();
        glb.floats("VEC3", 3, &SQUARE);
        glb.indices(&[0, 1, 2]);
        change(&mut glb);
        one(&mut glb, primitive, node)
    };
    let plain = r#""attributes":{"POSITION":0},"indices":1"#;
    let put = |glb: &mut Glb, value: f32| glb.bin[4..8].copy_from_slice(&value.to_le_bytes());
    let claim = |glb: &mut Glb, count: &str| {
        glb.accessors[0] = format!(r#"{{"bufferView":0,"componentType":5126,"type":"VEC3","count":{count}}}"#);
    };
    assert!(with(&|_| {}, plain, "").is_ok());
    let broken: Vec<(&str, Result<_, _>, &str)> = vec![
        ("NaN", with(&|glb| put(glb, f32::NAN), plain, ""), "/accessors/0"),
        ("infinity", with(&|glb| put(glb, f32::INFINITY), plain, ""), "/accessors/0"),
        ("too far", with(&|_| {}, plain, r#","scale":[1e12,1e12,1e12]"#), "/nodes/0"),
        ("index", with(&|glb| glb.bin[48] = 9, plain, ""), "/meshes/0/primitives/0/indices"),
        ("count", with(&|glb| claim(glb, "5"), plain, ""), "/accessors/0"),
        ("huge count", with(&|glb| claim(glb, "18446744073709551615"), plain, ""), "/accessors/0"),
        ("no accessor", with(&|_| {}, r#""attributes":{"POSITION":9}"#, ""), "/accessors/9"),
        ("indices as positions", with(&|_| {}, r#""attributes":{"POSITION":1}"#, ""), "/accessors/1"),
        ("positions as indices", with(&|_| {}, r#""attributes":{"POSITION":0},"indices":0"#, ""), "/accessors/0"),
        (
            "view",
            with(&|glb| glb.views[0] = r#"{"buffer":0,"byteOffset":40,"byteLength":9000}"#.into(), plain, ""),
            "/bufferViews/0",
        ),
        (
            "offset",
            with(
                &|glb| glb.views[0] = r#"{"buffer":0,"byteOffset":18446744073709551615,"byteLength":48}"#.into(),
                plain,
                "",
            ),
            "/bufferViews/0",
        ),
        ("stride", with(&|glb| glb.views[0].insert_str(1, r#""byteStride":4,"#), plain, ""), "/accessors/0"),
        ("buffer", with(&|glb| glb.views[0] = r#"{"buffer":3,"byteLength":48}"#.into(), plain, ""), "/buffers/3"),
        ("own child", with(&|_| {}, plain, r#","children":[0]"#), ""),
        ("no child", with(&|_| {}, plain, r#","children":[7]"#), "/nodes/7"),
        ("rotation", with(&|_| {}, plain, r#","rotation":[1e38,1e38,1e38,1e39]"#), "/nodes/0"),
    ];
    for (what, result, wanted) in broken {
        match result {
            Err(PlantError::Data { location, .. }) => assert_eq!(location, wanted, "{what}"),
            // A node that is its own child is no root, so nothing is left to draw.
            Err(PlantError::Empty { .. }) => assert_eq!(wanted, "", "{what}"),
            other => panic!("{what}: {other:?}"),
        }
    }
}

#[test]
fn many_nodes_cannot_multiply_a_mesh_without_limit() {
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE.repeat(5_000));
    let nodes = vec![r#"{"mesh":0}"#; 20_000].join(",");
    glb.with(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{positions}}},"mode":0}}]}}],"nodes":[{nodes}]"#
    ));
    assert!(matches!(glb.load(), Err(PlantError::Data { .. })));
}

#[test]
fn what_a_plant_does_not_use_is_named() {
    let mut glb = tree();
    glb.with(r#""cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":1}}],"extensionsUsed":["EXT_wind"]"#);
    let (_, warnings) = glb.load().expect("a plant");
    for location in ["/cameras", "/extensionsUsed"] {
        assert!(
            warnings.iter().any(|w| w.kind == WarningKind::Ignored && w.location == location),
            "{location}: {warnings:?}"
        );
    }
    let mut glb = tree();
    glb.with(r#""extensionsRequired":["KHR_draco_mesh_compression"]"#);
    let message = glb.load().expect_err("not supported").to_string();
    assert!(message.contains("KHR_draco_mesh_compression") && message.contains("plant.glb"), "{message}");
}

#[test]
fn degenerate_triangles_are_dropped_and_counted() {
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let indices = glb.indices(&[0, 1, 2, 0, 0, 1, 3, 2, 3]);
    let (plant, warnings) =
        one(&mut glb, &format!(r#""attributes":{{"POSITION":{positions}}},"indices":{indices}"#), "").expect("a plant");
    assert_eq!(plant.triangle_count(PartKind::Wood), 1);
    assert!(warnings.iter().any(|w| w.message.starts_with("2 of 3 triangles")));
}

#[test]
fn a_plant_far_off_is_moved_to_the_origin() {
    let mut glb = Glb::default();
    let positions = glb.floats("VEC3", 3, &SQUARE);
    let primitive =
        format!(r#""attributes":{{"POSITION":{positions}}},"indices":{}"#, glb.indices(&[0, 1, 2, 0, 2, 3]));
    let (plant, warnings) = one(&mut glb, &primitive, r#","translation":[100,-30,7]"#).expect("a plant");
    let bounds = plant.bounds().expect("vertices");
    assert!((bounds.min - Vec3::new(-1.0, 0.0, 0.0)).length() < 1e-4, "{bounds:?}");
    assert!(warnings.iter().any(|w| w.message.contains("moved to the origin")));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn no_damage_makes_it_panic(cut in 0usize..2000, changes in prop::collection::vec((0usize..2000, any::<u8>()), 0..6)) {
        let mut bytes = tree().bytes();
        for (at, value) in changes {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        if cut < bytes.len() {
            bytes.truncate(cut);
        }
        if let Ok((plant, _)) = load_bytes(&bytes, "plant.glb", &GltfOptions::default()) {
            prop_assert!(is_sound(&plant));
        }
    }
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Codes of the Khronos validator that mean that a drawn primitive has no readable positions or indices, or that
/// there is no container or JSON to read.
const FATAL: [&str; 17] = [
    "GLB_INVALID_MAGIC",
    "GLB_INVALID_VERSION",
    "GLB_LENGTH_TOO_SMALL",
    "GLB_EMPTY_CHUNK",
    "GLB_UNEXPECTED_END_OF_HEADER",
    "GLB_UNEXPECTED_END_OF_CHUNK_HEADER",
    "GLB_UNEXPECTED_END_OF_CHUNK_DATA",
    "GLB_UNEXPECTED_FIRST_CHUNK",
    "GLB_CHUNK_TOO_BIG",
    "INVALID_JSON",
    "TYPE_MISMATCH",
    "UNDEFINED_PROPERTY",
    "UNRESOLVED_REFERENCE",
    "BUFFER_VIEW_TOO_LONG",
    "ACCESSOR_SMALL_BYTESTRIDE",
    "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT",
    "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT",
];

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn broken_files_never_panic_and_unusable_ones_are_refused() {
    let folder = data("gltf-broken");
    let mut read = 0;
    for path in files_below(&folder) {
        if !path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            continue;
        }
        read += 1;
        let report = fs::read_to_string(format!("{}.report.json", path.display())).unwrap_or_default();
        let fatal = FATAL.iter().any(|code| report.contains(&format!("\"{code}\"")));
        match load_plant(&path, &GltfOptions::default()) {
            Ok((plant, _)) => {
                assert!(is_sound(&plant));
                assert!(!fatal, "{} is unusable and was read", path.display());
            }
            Err(error) => {
                let name = path.file_name().expect("a file").to_string_lossy().into_owned();
                assert!(error.to_string().contains(&name), "{error}");
            }
        }
    }
    assert_eq!(read, 87);
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn real_trees_have_their_triangles() {
    // Of the pine's 19,872 triangles 8 have no area.
    for (name, triangles, height) in [("oak", 13_806, 19.73), ("aspen", 7_200, 21.61), ("pine", 19_864, 15.59)] {
        let path = data(&format!("trees/{name}-medium.glb"));
        let (plant, warnings) = load_plant(&path, &GltfOptions::default()).expect("a sound file");
        assert!(is_sound(&plant));
        let (wood, foliage) = (plant.triangle_count(PartKind::Wood), plant.triangle_count(PartKind::Foliage));
        assert_eq!(wood + foliage, triangles, "{name}");
        assert_eq!(plant.parts.len(), 2);
        assert!((plant.height() - height).abs() < 0.01, "{name}: {}", plant.height());
        assert!(plant.parts[0].material.normal_texture.is_some());
        let leaf = plant.parts[1].material.base_color_texture.clone().expect("a leaf texture");
        assert!(warnings.iter().all(|w| w.kind == WarningKind::Repaired), "{warnings:?}");

        let chain = alpha_tested_mips(&fade_alpha(&leaf, 0.5, AlphaFade::PerLeaf));
        for level in 1..=7 {
            for threshold in [0.5, 0.6, 0.7, 0.8, 0.9, 0.95] {
                let (drawn, wanted) = (chain.drawn_coverage(level, threshold), chain.drawn_coverage(0, threshold));
                assert!((drawn - wanted).abs() < 0.02, "{name} level {level} at {threshold}: {drawn}, not {wanted}");
            }
        }
    }
}

#[test]
fn the_tissue_of_a_leaf_comes_from_extras() {
    let read = |leaf_members: &'static str| {
        let file = TreeFile { leaf_members, ..TreeFile::default() };
        let (plant, warnings) = load_bytes(&file.bytes(), "tree.glb", &GltfOptions::default()).expect("a plant");
        let leaf = plant.parts.into_iter().find(|part| part.kind == PartKind::Foliage).expect("leaves").material;
        (leaf, warnings)
    };
    let (leaf, warnings) = read(
        r#","extras":{"canopy_leaf":{"maxThickness":0.0005,"thicknessTexture":{"index":0},"backTexture":{"index":0}}}"#,
    );
    let tissue = leaf.tissue.expect("a tissue");
    // A thickness that a file has was painted.
    assert_eq!((tissue.max_thickness, tissue.measured), (0.0005, Measured::Leaf));
    assert!(leaf.leaf_textures.back.is_some() && leaf.leaf_textures.thickness.is_some());
    assert!(leaf.leaf_textures.absorption.is_none() && leaf.leaf_textures.transmission.is_none());
    assert!(!warnings.iter().any(|warning| warning.message.contains("canopy_leaf")), "{warnings:?}");

    let (leaf, _) = read(r#","extras":{"canopy_leaf":{"transmissionTexture":{"index":0}}}"#);
    assert!(leaf.leaf_textures.transmission.is_some() && leaf.tissue.is_some());
    for (members, word) in [
        (r#","extras":{"canopy_leaf":{"maxThickness":"much"}}"#, "cannot be read"),
        (r#","extras":{"canopy_leaf":{"maxTickness":1}}"#, "cannot be read"),
        (r#","extras":{"canopy_leaf":[]}"#, "not an object"),
        (r#","extras":{"canopy_leaf":{"maxThickness":-1}}"#, "no leaf has"),
        (r#","extras":{"canopy_leaf":{"absorptionTexture":{"index":99}}}"#, "does not exist"),
        (r#","extras":{"canopy_leaf":{"backMaterial":99}}"#, "does not exist"),
        (r#","extras":{"canopy_leaf":{"volume":true}}"#, "no closed volume"),
    ] {
        let (leaf, warnings) = read(members);
        assert!(warnings.iter().any(|warning| warning.message.contains(word)), "{members}: {warnings:?}");
        assert!(leaf.tissue.is_none_or(|tissue| tissue == tissue.sanitized() && !tissue.volume));
    }
    assert!(read(r#","extras":{"canopy_leaf":null}"#).0.tissue.is_none());
}
