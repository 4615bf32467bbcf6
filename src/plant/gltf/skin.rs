//! Shapes that follow bones or morph: drawn as the file stands at rest.
//!
//! [glTF 2.0 specification, sections 3.7.2.2 "Morph Targets" and 3.7.3 "Skins"]. A skinned vertex is the weighted mean of the
//! vertex moved by each of its joints; the node of the mesh does not count.

use glam::{DMat4, DVec3, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Elements, read_any};
use super::container::Document;
use super::error::{Fault, WarningKind, Warnings};
use super::nodes::cofactor;

/// What moves the vertices of a mesh.
#[derive(Default)]
pub(super) struct Deformation {
    /// Weights of the morph targets.
    pub weights: Vec<f32>,
    /// For each joint its movement from the shape of the mesh to the scene; empty without a skin.
    pub joints: Vec<DMat4>,
}

/// The movements of the joints of skin `index`. `globals` are the transforms of all nodes in the scene.
pub(super) fn joints(
    document: &mut Document,
    index: usize,
    globals: &[DMat4],
    warnings: &mut Warnings,
) -> Result<Vec<DMat4>, Fault> {
    let location = format!("/skins/{index}");
    let Some(skin) = document.root.skins.get(index).cloned() else {
        warnings.push(WarningKind::Missing, location, "does not exist; the mesh stands as its node does");
        return Ok(Vec::new());
    };
    let inverse = match skin.inverse_bind_matrices {
        Some(accessor) => Some(read_any(document, accessor.value(), &[Type::Mat4], warnings)?),
        None => None,
    };
    Ok(skin
        .joints
        .iter()
        .enumerate()
        .map(|(at, joint)| {
            let stand = globals.get(joint.value()).copied().unwrap_or(DMat4::IDENTITY);
            let bind =
                inverse.as_ref().map(|inverse| inverse.get(at)).and_then(|values| <[f32; 16]>::try_from(values).ok());
            stand * bind.map_or(DMat4::IDENTITY, |values| DMat4::from_cols_array(&values.map(f64::from)))
        })
        .collect())
}

/// Moves points and normals of a primitive. Returns whether its skin was applied, so that its node does not count.
pub(super) fn apply(
    document: &mut Document,
    primitive: &Primitive,
    location: &str,
    deformation: &Deformation,
    points: &mut Elements,
    normals: Option<&mut Elements>,
    warnings: &mut Warnings,
) -> Result<bool, Fault> {
    let mut normals = normals;
    for (target, weight) in
        primitive.targets.iter().flatten().zip(&deformation.weights).filter(|(_, weight)| **weight != 0.0)
    {
        let mut add = |accessor: Option<usize>, to: &mut Elements| -> Result<(), Fault> {
            let Some(accessor) = accessor else { return Ok(()) };
            let moved = read_any(document, accessor, &[Type::Vec3], warnings)?;
            for (value, moved) in to.values.iter_mut().zip(&moved.values) {
                *value += weight * moved;
            }
            Ok(())
        };
        add(target.positions.map(|accessor| accessor.value()), points)?;
        if let Some(normals) = normals.as_deref_mut() {
            add(target.normals.map(|accessor| accessor.value()), normals)?;
        }
    }
    if deformation.joints.is_empty() {
        return Ok(false);
    }
    let accessor = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
    let (Some(joints), Some(weights)) = (accessor(Semantic::Joints(0)), accessor(Semantic::Weights(0))) else {
        warnings.push(
            WarningKind::Repaired,
            location,
            "has a skin but no joints and weights; it stands as its node does",
        );
        return Ok(false);
    };
    if accessor(Semantic::Joints(1)).is_some() {
        warnings.push(WarningKind::Ignored, location, "its fifth joint of a vertex and on; the first four move it");
    }
    let joints = read_any(document, joints, &[Type::Vec4], warnings)?;
    let weights = read_any(document, weights, &[Type::Vec4], warnings)?;
    for vertex in 0..points.len() {
        let (joints, weights) = (joints.get(vertex), weights.get(vertex));
        let total: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
        let mut matrix = DMat4::ZERO;
        for (joint, weight) in joints.iter().zip(weights) {
            if let Some(movement) = deformation.joints.get(*joint as usize).filter(|_| *weight != 0.0) {
                matrix += *movement * f64::from(*weight);
            }
        }
        if !(total.is_finite() && total.abs() > 1e-6 && matrix.is_finite() && matrix != DMat4::ZERO) {
            continue;
        }
        let matrix = matrix * (1.0 / total);
        moved(points, vertex, |point| matrix.transform_point3(point));
        if let Some(normals) = normals.as_deref_mut() {
            let cofactor = cofactor(&matrix);
            moved(normals, vertex, |normal| (cofactor * normal).normalize_or_zero());
        }
    }
    Ok(true)
}

/// Replaces element `vertex`, three values, by what `change` makes of it.
fn moved(elements: &mut Elements, vertex: usize, change: impl Fn(DVec3) -> DVec3) {
    let at = vertex * elements.width;
    if let Some(values) = elements.values.get_mut(at..at + 3) {
        let changed = change(Vec3::new(values[0], values[1], values[2]).as_dvec3()).as_vec3();
        values.copy_from_slice(&changed.to_array());
    }
}
