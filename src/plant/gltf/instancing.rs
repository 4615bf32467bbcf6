//! EXT_mesh_gpu_instancing [Khronos, glTF 2.0 extension]: a node that places its mesh many times.

use glam::{DMat4, DQuat, DVec3};
use gltf::json::Value;
use gltf::json::accessor::Type;

use super::accessor::{Elements, read_any};
use super::container::Document;
use super::error::{Fault, WarningKind, Warnings};
use super::nodes::Placement;

/// The name of the extension.
pub(super) const NAME: &str = "EXT_mesh_gpu_instancing";

/// Most placements of a file.
const MOST: usize = 1 << 20;

/// Puts a placement for each instance in the place of a node that has instances.
pub(super) fn expand(
    document: &mut Document,
    placements: Vec<Placement>,
    warnings: &mut Warnings,
) -> Result<Vec<Placement>, Fault> {
    let mut expanded = Vec::with_capacity(placements.len());
    for placement in placements {
        let node = document.root.nodes.get(placement.node).filter(|_| !placement.path.is_empty());
        let extension =
            node.and_then(|node| node.extensions.as_ref()).and_then(|extensions| extensions.others.get(NAME));
        let Some(attributes) = extension.and_then(|extension| extension.get("attributes")).cloned() else {
            expanded.push(placement);
            continue;
        };
        let location = format!("/nodes/{}/extensions/{NAME}", placement.node);
        let accessor =
            |name: &str| attributes.get(name).and_then(Value::as_u64).and_then(|index| usize::try_from(index).ok());
        let mut read = |name: &str, shape: Type| -> Result<Option<Elements>, Fault> {
            accessor(name).map(|index| read_any(document, index, &[shape], warnings)).transpose()
        };
        let translations = read("TRANSLATION", Type::Vec3)?;
        let rotations = read("ROTATION", Type::Vec4)?;
        let scales = read("SCALE", Type::Vec3)?;
        let count = [&translations, &rotations, &scales].into_iter().flatten().map(Elements::len).min().unwrap_or(0);
        if count == 0 {
            warnings.push(WarningKind::Repaired, location, "has no instances; its mesh is drawn once");
            expanded.push(placement);
            continue;
        }
        if expanded.len().saturating_add(count) > MOST {
            return Err(Fault::new(
                location,
                format!("{count} instances are too many for one plant"),
                "use fewer instances",
            ));
        }
        for instance in 0..count {
            let vector = |elements: &Option<Elements>, default: DVec3| match elements.as_ref().map(|e| e.get(instance))
            {
                Some(&[x, y, z]) => DVec3::new(x.into(), y.into(), z.into()),
                _ => default,
            };
            let rotation = match rotations.as_ref().map(|elements| elements.get(instance)) {
                Some(&[x, y, z, w]) => DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into()),
                _ => DQuat::IDENTITY,
            };
            let length = rotation.length();
            let rotation = if length.is_finite() && length > 1e-6 { rotation / length } else { DQuat::IDENTITY };
            let local = DMat4::from_scale_rotation_translation(
                vector(&scales, DVec3::ONE),
                rotation,
                vector(&translations, DVec3::ZERO),
            );
            let transform = placement.transform * local;
            if !transform.is_finite() {
                return Err(Fault::new(
                    location,
                    format!("instance {instance} is not finite"),
                    super::error::EXPORT_AGAIN,
                ));
            }
            expanded.push(Placement { transform, ..placement.clone() });
        }
    }
    Ok(expanded)
}
