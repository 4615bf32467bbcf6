//! A scene's forest for other programs: what `canopy export` does.

mod glb;
mod ground;
mod plants;

use std::path::PathBuf;

use glam::{DVec3, Quat, Vec3};
use serde_json::json;

use self::glb::{FLOAT, Glb};
use super::{error::AppError, interrupt};
use crate::{
    assets::Stage,
    files,
    progress::Progress,
    scatter::PackedTree,
    scene::{Overrides, SceneSource},
    terrain::CoordinateSystem,
};

/// The extension for many instances of a mesh.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";
/// The most trees with a node of their own: more make documents that few programs read.
const MOST_NODES: usize = 200_000;

/// What to export.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportOptions {
    /// The scene.
    pub scene: SceneSource,
    /// The `.glb` to write.
    pub out: PathBuf,
    /// A node for each tree, for programs that do not know instances.
    pub nodes: bool,
    /// Without the ground.
    pub without_ground: bool,
    /// Only what is at most so many metres from the middle of the scene, west to east and south to north.
    pub within: Option<f64>,
    /// Values that replace those of the scene.
    pub overrides: Overrides,
}

/// What was exported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExportReport {
    /// Trees.
    pub trees: usize,
    /// Plants that they are instances of.
    pub plants: usize,
    /// Triangles of the ground.
    pub ground_triangles: usize,
    /// Bytes of the file.
    pub bytes: u64,
}

/// Writes trees and ground of a scene as binary glTF: each plant is a mesh, its trees are instances of a node
/// (EXT_mesh_gpu_instancing) or a node each. +X is east, −Z north, heights are the scene's.
///
/// # Errors
/// [`AppError`]: a scene that cannot be built, a file that cannot be written, too many trees for nodes, nothing to export.
/// [`AppError::Interrupted`].
pub fn export(options: &ExportOptions, progress: &mut dyn Progress) -> Result<ExportReport, AppError> {
    let scene = options.overrides.applied(options.scene.read()?);
    files::check_writable(&options.out).map_err(|source| AppError::Write { path: options.out.clone(), source })?;
    let stage = Stage::build(&scene, progress).map_err(interrupt::building)?;
    let trees = wanted(&stage, options.within);
    if options.nodes && trees.len() > MOST_NODES {
        return Err(AppError::Export(format!(
            "{} trees are too many for a node each, {MOST_NODES} are the most; leave out --nodes, or export fewer with --within",
            trees.len()
        )));
    }
    let mut glb = Glb::default();
    let mut report = ExportReport::default();
    progress.begin("Plants", stage.plants.len() as u64);
    let mut images = plants::Images::default();
    for (variant, baked) in stage.plants.iter().enumerate() {
        if progress.is_cancelled() {
            return Err(AppError::Interrupted("nothing was exported".to_owned()));
        }
        let own: Vec<PackedTree> =
            trees.iter().filter(|tree| usize::from(tree.variant()) == variant).copied().collect();
        if !own.is_empty() {
            match plants::add(&mut glb, &baked.plant, &mut images)? {
                Some(mesh) => {
                    place(&mut glb, &stage, &own, mesh, &baked.plant.name, options.nodes);
                    report.plants += 1;
                    report.trees += own.len();
                }
                None => progress
                    .warn(&format!("{}: a plant without triangles; its trees are not exported", baked.plant.name)),
            }
        }
        progress.advance(1);
    }
    progress.end();
    if !options.without_ground {
        report.ground_triangles = ground::add(&mut glb, &stage, options.within)?;
    }
    if glb.nodes.is_empty() {
        return Err(AppError::Export("there is neither a tree nor ground to export".to_owned()));
    }
    let extras = place_on_earth(&stage);
    glb.write(&options.out, &stage.scene.name, &extras)?;
    let written = std::fs::metadata(&options.out);
    report.bytes = written.map_err(|source| AppError::Write { path: options.out.clone(), source })?.len();
    Ok(report)
}

/// The trees to export, in the order of the stand.
fn wanted(stage: &Stage, within: Option<f64>) -> Vec<PackedTree> {
    let near = |tree: &&PackedTree| {
        let DVec3 { x, z, .. } = tree.position(&stage.stand.grid);
        within.is_none_or(|most| x.abs() <= most && z.abs() <= most)
    };
    stage.stand.trees.iter().filter(near).copied().collect()
}

/// Adds trees of one plant.
fn place(glb: &mut Glb, stage: &Stage, trees: &[PackedTree], mesh: usize, name: &str, nodes: bool) {
    let rotation = |tree: &PackedTree| Quat::from_rotation_y(tree.yaw()).to_array();
    if nodes {
        for (number, tree) in trees.iter().enumerate() {
            glb.nodes.push(json!({
                "name": format!("{name} {}", number + 1), "mesh": mesh,
                "translation": tree.position(&stage.stand.grid).to_array(),
                "rotation": rotation(tree), "scale": Vec3::splat(tree.scale()).to_array(),
            }));
            glb.roots.push(glb.nodes.len() - 1);
        }
        return;
    }
    // Instances are in single precision: they count from a node in their middle.
    let positions: Vec<DVec3> = trees.iter().map(|tree| tree.position(&stage.stand.grid)).collect();
    let (least, most) = positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(least, most), position| {
        (least.min(*position), most.max(*position))
    });
    let middle = (0.5 * (least + most)).round();
    let translations: Vec<Vec3> = positions.iter().map(|position| (*position - middle).as_vec3()).collect();
    let rotations: Vec<[f32; 4]> = trees.iter().map(rotation).collect();
    let scales: Vec<Vec3> = trees.iter().map(|tree| Vec3::splat(tree.scale())).collect();
    let tints: Vec<f32> = trees.iter().map(PackedTree::tint).collect();
    glb.uses(INSTANCING);
    let attributes = json!({
        "TRANSLATION": glb.accessor(&translations, FLOAT, "VEC3"),
        "ROTATION": glb.accessor(&rotations, FLOAT, "VEC4"),
        "SCALE": glb.accessor(&scales, FLOAT, "VEC3"),
        // How far the tree's colour is from its plant's, -1 to 1.
        "_TINT": glb.accessor(&tints, FLOAT, "SCALAR"),
    });
    glb.nodes.push(json!({
        "name": name, "mesh": mesh, "translation": middle.to_array(),
        "extensions": { INSTANCING: { "attributes": attributes } },
    }));
    glb.roots.push(glb.nodes.len() - 1);
}

/// Where the origin lies on earth.
fn place_on_earth(stage: &Stage) -> serde_json::Value {
    let mut extras = json!({
        "scene": stage.scene.label(),
        "latitude": stage.observer.latitude_deg,
        "longitude": stage.observer.longitude_deg,
    });
    if let Some(reference) = stage.terrain.reference() {
        let epsg = match reference.system() {
            CoordinateSystem::Utm { zone, south } => Some(if south { 32_700 } else { 32_600 } + u32::from(zone)),
            CoordinateSystem::WebMercator => Some(3857),
            CoordinateSystem::Projected { epsg, .. } => epsg,
            CoordinateSystem::Geographic => Some(4326),
            CoordinateSystem::Local => None,
        };
        extras["epsg"] = epsg.into();
        extras["origin"] = json!(reference.centre().to_array());
    }
    extras
}
