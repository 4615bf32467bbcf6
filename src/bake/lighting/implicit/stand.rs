//! Several plants in one field [Luft 2007, 5]: a tall tree darkens the small one beside it.
//!
//! Such a bake belongs to one plant at one position, so the plants cannot be instances of one model. Memory: the result
//! is 16 bytes a vertex (normal and ambient term, 4 bytes once packed) and 24 a vertex and 12 a triangle of the
//! surface; while it is made there are all meshes once more in the stand's frame (32 bytes a vertex, 12 a triangle), 20
//! bytes a leaf and a triangle of wood, 62 more for each of them in the density field and in each level of the depth
//! field (the coarse half of the levels has few), and at most 48 bytes a vertex for the evaluation.

use std::borrow::Cow;

use glam::{DVec3, Quat, Vec3};

use super::density::DensityField;
use super::generators::{Generator, even_share};
use super::{
    ImplicitBake, ImplicitParameters, ImplicitReport, ImplicitSettings, Part, SurfaceMesh, bake_parts, depth_field,
    extent, foliage_generators, parameters,
};
use crate::plant::{Plant, PlantMesh};

/// A plant of a stand.
#[derive(Clone, Copy, Debug)]
pub struct StandPlant<'a> {
    /// The plant in its own frame.
    pub plant: &'a Plant,
    /// Its foot in the scene, metres.
    pub position: DVec3,
    /// Rotation about the upright axis in radians, from +Z towards +X.
    pub yaw: f32,
    /// Factor on its size, above 0.
    pub scale: f32,
}

/// Normals and ambient term of one plant of a stand.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantShading {
    /// Unit normals in the plant's own frame: one list per part, one value per vertex.
    pub normals: Vec<Vec<Vec3>>,
    /// Ambient term: one list per part, one value per vertex.
    pub ambient: Vec<Vec<f32>>,
}

/// Plants that are lit together.
#[derive(Clone, Debug, PartialEq)]
pub struct StandBake {
    /// One per plant, in their order.
    pub plants: Vec<PlantShading>,
    /// Where the surface's frame (not rotated, not scaled) lies in the scene, metres.
    pub origin: DVec3,
    /// The surface around all crowns, relative to `origin`; `None` where there is none or none was asked for.
    pub surface: Option<SurfaceMesh>,
    /// Report of the bake.
    pub report: ImplicitReport,
}

/// Bakes all `plants` in one field. Values that the settings leave open are the means of what each plant would have
/// alone, weighted by leaf area: that a stand is dense must darken it, and not raise τ. The depth field reaches as far
/// as in a plant of the mean extent. A plant whose position, yaw or scale is not usable is lit alone, as it is
/// modelled.
pub fn bake_implicit_stand(plants: &[StandPlant], settings: &ImplicitSettings) -> StandBake {
    let settings = settings.sanitized();
    let usable = |plant: &&StandPlant| {
        plant.position.is_finite() && plant.yaw.is_finite() && plant.scale.is_finite() && plant.scale > 0.0
    };
    let points: Vec<DVec3> = plants.iter().filter(usable).map(|plant| plant.position).collect();
    let origin = points.iter().copied().sum::<DVec3>() / points.len().max(1) as f64;
    let origin = if origin.is_finite() { origin } else { DVec3::ZERO };

    let moved: Vec<Vec<Part>> = plants.iter().filter(usable).map(|plant| in_stand(plant, origin)).collect();
    let leaves: Vec<Vec<Generator>> = moved.iter().map(|parts| foliage_generators(parts, settings.weighting)).collect();
    let (parameters, extent) = common_parameters(&moved, &leaves, &settings);
    let leaves = leaves.concat();
    let generators = even_share(&leaves, settings.generator_share);
    let field = DensityField::new(&generators, parameters.radius, settings.weighting);
    let parts: Vec<Part> = moved.into_iter().flatten().collect();
    let depth = depth_field(&parts, leaves, &parameters, extent, &settings);
    let ImplicitBake { normals, ambient, surface, report } =
        bake_parts(&parts, generators.len(), &field, depth.as_ref(), parameters, &settings);

    let (mut normals, mut ambient) = (normals.into_iter(), ambient.into_iter());
    let shadings = plants.iter().map(|plant| {
        if !usable(&plant) {
            let alone = super::bake_implicit(plant.plant, &settings);
            return PlantShading { normals: alone.normals, ambient: alone.ambient };
        }
        let count = plant.plant.parts.len();
        let back = Quat::from_rotation_y(-plant.yaw);
        let turn = |part: Vec<Vec3>| part.into_iter().map(|n| (back * n).normalize_or(Vec3::Y)).collect();
        PlantShading {
            normals: normals.by_ref().take(count).map(turn).collect(),
            ambient: ambient.by_ref().take(count).collect(),
        }
    });
    StandBake { plants: shadings.collect(), origin, surface, report }
}

/// The parts of a plant where they stand, relative to `origin`.
fn in_stand<'a>(plant: &StandPlant<'a>, origin: DVec3) -> Vec<Part<'a>> {
    let foot = (plant.position - origin).as_vec3();
    let turn = Quat::from_rotation_y(plant.yaw);
    let moved = |mesh: &PlantMesh| PlantMesh {
        positions: mesh.positions.iter().map(|p| foot + turn * (plant.scale * p)).collect(),
        normals: mesh.normals.iter().map(|n| turn * n).collect(),
        uvs: mesh.uvs.clone(),
        triangles: mesh.triangles.clone(),
    };
    plant.plant.parts.iter().map(|part| Part { source: part, mesh: Cow::Owned(moved(&part.mesh)) }).collect()
}

/// Means, weighted by leaf area, of what each plant would have alone, and of the plants' longest extents in metres.
fn common_parameters(
    plants: &[Vec<Part>],
    leaves: &[Vec<Generator>],
    settings: &ImplicitSettings,
) -> (ImplicitParameters, f32) {
    let areas: Vec<f64> =
        leaves.iter().map(|of_plant| of_plant.iter().map(|g| f64::from(g.area)).sum::<f64>()).collect();
    let total: f64 = areas.iter().sum();
    let mean = |values: &[f32]| {
        let sum: f64 = values.iter().zip(&areas).map(|(value, area)| f64::from(*value) * area).sum();
        if total > 0.0 { (sum / total) as f32 } else { 0.0 }
    };
    let extents: Vec<f32> = plants.iter().map(|parts| extent(parts)).collect();
    let radii: Vec<f32> =
        extents.iter().zip(leaves).map(|(&extent, own)| parameters::radius(own, extent, settings)).collect();
    let radius = settings.radius.unwrap_or_else(|| mean(&radii));
    let extent = if total > 0.0 { mean(&extents) } else { extents.iter().copied().fold(0.0, f32::max) };
    let ambient_radius = parameters::ambient_radius(radius, extent, settings);
    let alone = |own: &Vec<Generator>| {
        let chosen = even_share(own, settings.generator_share);
        let field = DensityField::new(&chosen, radius, settings.weighting);
        parameters::parameters(own, &field, ambient_radius, settings)
    };
    let alone: Vec<ImplicitParameters> = leaves.iter().map(alone).collect();
    let of = |value: fn(&ImplicitParameters) -> f32| mean(&alone.iter().map(value).collect::<Vec<_>>());
    // What does not depend on a plant is the same for all, also where there is no plant.
    let none = parameters::parameters(&[], &DensityField::default(), ambient_radius, settings);
    let common = ImplicitParameters {
        radius,
        threshold: settings.threshold.unwrap_or_else(|| of(|p| p.threshold)),
        core: settings.core.unwrap_or_else(|| of(|p| p.core)),
        ..none
    };
    (common, extent)
}
