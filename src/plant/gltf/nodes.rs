//! The nodes of the default scene with their transforms.

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use gltf::json::{Root, scene::Node};

use super::error::{EXPORT_AGAIN, Fault, WarningKind, Warnings};
use super::roles;
use crate::plant::PlantMesh;

/// Largest coordinate of a plant in metres: large enough for any unit, small enough that lengths, areas and sums stay
/// finite.
const FARTHEST: f32 = 1e9;

/// A mesh, and where a node places it.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    /// Index of the node.
    pub node: usize,
    /// Index of the mesh.
    pub mesh: usize,
    /// Transform from the frame of the mesh to that of the scene.
    pub transform: DMat4,
    /// The node and the nodes above it, the root first.
    pub path: Vec<usize>,
}

/// All meshes of the default scene. That is the first scene if the file names none, and all root nodes if there is no
/// scene.
///
/// The second result is the transform of every node, for skins.
pub(super) fn placements(root: &Root, warnings: &mut Warnings) -> Result<(Vec<Placement>, Vec<DMat4>), Fault> {
    let mut visited = vec![false; root.nodes.len()];
    let mut globals = vec![DMat4::IDENTITY; root.nodes.len()];
    let mut found = Vec::new();
    let coarser = roles::coarser_nodes(root);
    let mut left_out = 0;
    let mut stack: Vec<(usize, DMat4, Vec<usize>)> =
        roots(root, warnings)?.into_iter().rev().map(|node| (node, DMat4::IDENTITY, Vec::new())).collect();
    while let Some((index, parent, mut path)) = stack.pop() {
        let location = format!("/nodes/{index}");
        let Some(node) = root.nodes.get(index) else {
            return Err(Fault::new(location, format!("does not exist, there are {}", root.nodes.len()), EXPORT_AGAIN));
        };
        if std::mem::replace(&mut visited[index], true) {
            let what = "has several parents or is its own ancestor; glTF demands a tree";
            return Err(Fault::new(location, what, EXPORT_AGAIN));
        }
        if coarser.contains(&index) {
            left_out += 1;
            continue;
        }
        path.push(index);
        let transform = parent * local_transform(node, &location, warnings)?;
        if !transform.is_finite() {
            return Err(Fault::new(location, "its transform is not finite", EXPORT_AGAIN));
        }
        globals[index] = transform;
        // A path is as deep as its file has nodes; deep chains have few meshes.
        stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), transform, path.clone())));
        if let Some(mesh) = node.mesh {
            found.push(Placement { node: index, mesh: mesh.value(), transform, path });
        }
    }
    let outside = |index: usize| !visited[index] && !coarser.contains(&index);
    let unused = root.nodes.iter().enumerate().filter(|(index, node)| outside(*index) && node.mesh.is_some()).count();
    let levels = left_out + coarser.iter().filter(|index| visited.get(**index) == Some(&false)).count();
    if levels > 0 {
        let message = format!("{levels} coarser levels of detail (MSFT_lod), which are not drawn");
        warnings.push(WarningKind::Ignored, "/nodes", message);
    }
    if unused > 0 {
        let message = format!("{unused} nodes with meshes are not in the default scene");
        warnings.push(WarningKind::Ignored, "/nodes", message);
    }
    Ok((found, globals))
}

/// The root nodes of the default scene.
fn roots(root: &Root, warnings: &mut Warnings) -> Result<Vec<usize>, Fault> {
    if root.scenes.len() > 1 {
        let message = format!("{} other scenes", root.scenes.len() - 1);
        warnings.push(WarningKind::Ignored, "/scenes", message);
    }
    let scene = match root.scene {
        Some(index) => Some(root.scenes.get(index.value()).ok_or_else(|| {
            Fault::new(
                "/scene",
                format!("scene {} does not exist, there are {}", index.value(), root.scenes.len()),
                EXPORT_AGAIN,
            )
        })?),
        None => root.scenes.first(),
    };
    if let Some(scene) = scene {
        return Ok(scene.nodes.iter().map(|node| node.value()).collect());
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().filter_map(|node| node.children.as_ref()).flatten() {
        if let Some(is_child) = is_child.get_mut(child.value()) {
            *is_child = true;
        }
    }
    Ok((0..root.nodes.len()).filter(|&node| !is_child[node]).collect())
}

/// The local transform of a node: its matrix, or translation * rotation * scale.
fn local_transform(node: &Node, location: &str, warnings: &mut Warnings) -> Result<DMat4, Fault> {
    if let Some(matrix) = node.matrix {
        return Ok(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let vector = |v: Option<[f32; 3]>, default: DVec3| v.map_or(default, |v| Vec3::from(v).as_dvec3());
    let rotation = match node.rotation {
        Some(rotation) => {
            let q = DQuat::from_array(rotation.0.map(f64::from));
            let length = q.length();
            if !length.is_finite() {
                return Err(Fault::new(location, "its rotation is not finite", EXPORT_AGAIN));
            }
            if length < 1e-6 {
                warnings.push(WarningKind::Repaired, location, "its rotation has no length; done without");
                DQuat::IDENTITY
            } else {
                q / length
            }
        }
        None => DQuat::IDENTITY,
    };
    let scale = vector(node.scale, DVec3::ONE);
    Ok(DMat4::from_scale_rotation_translation(scale, rotation, vector(node.translation, DVec3::ZERO)))
}

/// What normals are transformed by: the cofactor matrix, which is the inverse transpose times the determinant. It exists for
/// singular transforms, too.
pub(super) fn cofactor(transform: &DMat4) -> DMat3 {
    let linear = DMat3::from_mat4(*transform);
    DMat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    )
}

/// Transforms `mesh` by `transform`. Normals are transformed by the inverse transpose, and triangles are reversed if
/// the transform mirrors.
///
/// If the transform flattens, triangles that are seen edge-on lose their area. They are removed, and the result is
/// their number.
pub(super) fn apply(mesh: &mut PlantMesh, transform: &DMat4, location: &str) -> Result<usize, Fault> {
    let linear = DMat3::from_mat4(*transform);
    let cofactor = cofactor(transform);
    let mirrored = linear.determinant() < 0.0;
    let facing = if mirrored { -1.0 } else { 1.0 };
    for position in &mut mesh.positions {
        *position = transform.transform_point3(position.as_dvec3()).as_vec3();
        if !position.is_finite() || position.abs().max_element() > FARTHEST {
            return Err(Fault::new(
                location,
                format!("moves its mesh to {position}, beyond {FARTHEST} m"),
                EXPORT_AGAIN,
            ));
        }
    }
    for normal in &mut mesh.normals {
        *normal = (cofactor * normal.as_dvec3() * facing).try_normalize().unwrap_or(DVec3::Y).as_vec3();
    }
    if mirrored {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|&[a, b, c]| {
        let [a, b, c] = [a, b, c].map(|i| positions[i as usize].as_dvec3());
        (b - a).cross(c - a).length_squared() > 0.0
    });
    Ok(before - mesh.triangles.len())
}
