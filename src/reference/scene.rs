//! The scene of a reference render: instances of plants on a ground.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::boxes::{BoxTree, MOST_ITEMS, WorldBox};
use super::bsdf::{Bsdf, Shares};
use super::camera::WorldRay;
use super::error::ReferenceError;
use super::ground::{Crossing, GroundShape};
use super::leaf::{LeafModel, PartLeaf};
use super::soil::Soil;
use crate::plant::{Gloss, PartKind, Plant};
use crate::scatter::PackedStand;
use crate::trace::{Hit, PlantTracer, Ray, SurfacePoint, leave, offset_origin};

/// Distance in front of a plant's box at which its rays start, as a fraction of the plant's size.
const MARGIN: f64 = 0.01;
/// Largest coordinate of a foot, metres.
const FARTHEST: f64 = 1e8;

/// One plant of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the plant.
    pub plant: usize,
    /// Its foot, scene metres, each within ±1e8.
    pub position: DVec3,
    /// Rotation about the vertical in radians, counter-clockwise seen from above.
    pub yaw: f32,
    /// Factor on the plant's size, 1e-6 to 1e6.
    pub scale: f32,
    /// Deviation of the foliage's colour, -1 to 1.
    pub tint: f32,
}

impl Instance {
    /// The trees of a stand as the renderer draws them, rounded to their 16 bytes. `origin` is the scene position of
    /// the stand's own origin.
    pub fn of_stand(stand: &PackedStand, origin: DVec3) -> Vec<Self> {
        let tree = |tree: &crate::scatter::PackedTree| Self {
            plant: tree.variant().into(),
            position: origin + tree.position(&stand.grid),
            yaw: tree.yaw(),
            scale: tree.scale(),
            tint: tree.tint().max(-1.0),
        };
        stand.trees.iter().map(tree).collect()
    }

    fn check(&self, instance: usize, plants: usize) -> Result<(), ReferenceError> {
        if self.plant >= plants {
            return Err(ReferenceError::UnknownPlant { instance, plant: self.plant, count: plants });
        }
        let fail = |what, value: f64, remedy| Err(ReferenceError::Instance { instance, what, value, remedy });
        if let Some(&wrong) = self.position.to_array().iter().find(|c| c.is_nan() || c.abs() > FARTHEST) {
            return fail("a coordinate", wrong, "give metres within 1e8 of the scene's origin");
        }
        if !(-1e6..=1e6).contains(&self.yaw) {
            return fail("the yaw", self.yaw.into(), "give radians");
        }
        if !(1e-6..=1e6).contains(&self.scale) {
            return fail("the scale", self.scale.into(), "give 1e-6 to 1e6");
        }
        if !(-1.0..=1.0).contains(&self.tint) {
            return fail("the tint", self.tint.into(), "give -1 to 1");
        }
        Ok(())
    }
}

/// Colour of the ground.
#[derive(Clone, Debug)]
pub enum GroundColor {
    /// One albedo, 0..1 per channel.
    Even(Vec3),
    /// The same colours as the renderer's terrain.
    Soil(Arc<Soil>),
}

/// The ground of a scene.
#[derive(Clone, Debug)]
pub struct Ground {
    /// Its shape.
    pub shape: GroundShape,
    /// Its colour.
    pub color: GroundColor,
    /// Maximum distance at which rays find it, metres. More shows more, and costs time for rays that run along the
    /// ground. The renderer draws the ground to its view distance.
    pub max_distance: f64,
}

/// The normals that shading uses. Where they are interpolated, light from behind the flat triangle is ignored, and the
/// diffuse rest is raised so that a white surface returns all of even light. Of sunlight a surface with few sides returns
/// somewhat too little in front and too much aside: a prism of `n` sides that stands for a cylinder is off by 2.1, 1.2,
/// 0.5 and 0.1 % in front and 2.5, 1.3, 0.6 and 0.1 % from the side, for 6, 8, 12 and 24 sides, in the mean over its
/// rotations. Reflection is not exactly reciprocal there. Decision 0031 has the figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Normals {
    /// Those of the triangles: exact for the mesh as it is, facets included.
    Flat,
    /// Interpolated on wood, so that a trunk with few sides looks round; leaves, which are flat, use those of their
    /// triangles.
    #[default]
    RoundWood,
    /// Interpolated everywhere, as the renderer's `local` lighting has them.
    Interpolated,
}

/// An instance, ready for rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) position: DVec3,
    /// Sine and cosine of the yaw.
    yaw_sin_cos: (f64, f64),
    pub(super) scale: f64,
    plant: u32,
    tint: f32,
}

impl Placed {
    pub(super) fn into_plant(self, v: DVec3) -> DVec3 {
        let (s, c) = self.yaw_sin_cos;
        DVec3::new(c * v.x - s * v.z, v.y, s * v.x + c * v.z)
    }

    pub(super) fn into_scene(self, v: DVec3) -> DVec3 {
        let (s, c) = self.yaw_sin_cos;
        DVec3::new(c * v.x + s * v.z, v.y, c * v.z - s * v.x)
    }

    /// The ray in the plant's frame, from `start` metres along it to `end`.
    fn ray(&self, ray: &WorldRay, start: f64, end: f64) -> Ray {
        let origin = self.into_plant(ray.at(start) - self.position) / self.scale;
        Ray {
            origin: origin.as_vec3(),
            direction: self.into_plant(ray.direction).as_vec3(),
            t_max: ((end - start) / self.scale) as f32,
        }
    }
}

/// A scene that rays can be sent through.
pub struct ReferenceScene {
    tracers: Vec<PlantTracer>,
    /// For each plant, its parts that have leaves with layers; empty where no plant has.
    leaves: Vec<Vec<Option<PartLeaf>>>,
    model: LeafModel,
    /// For each plant, metres before its box from which rays are traced in its own frame, at scale 1.
    margins: Vec<f64>,
    pub(super) instances: Vec<Placed>,
    tree: BoxTree,
    ground: Option<Ground>,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Found {
    Plant {
        instance: usize,
        hit: Hit,
    },
    Ground {
        position: DVec3,
    },
    /// The ray starts under the ground, where no light is.
    Buried,
}

/// A surface at a point, and how rays leave it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// Scene metres.
    pub position: DVec3,
    pub bsdf: Bsdf,
    pub(super) anchor: Anchor,
}

/// The body of a leaf with layers, under a point of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafBody {
    /// Metres in the plant's frame.
    pub thickness: f32,
    /// Whether it is a closed volume, whose other side the mesh has.
    pub volume: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    /// Point and flat normal in the plant's frame, where the point is exact but for `error` metres, if that is known.
    Plant {
        instance: usize,
        position: Vec3,
        normal: Vec3,
        error: Option<f32>,
        /// Of a leaf with layers.
        leaf: Option<LeafBody>,
    },
    Ground,
}

impl ReferenceScene {
    /// Builds the trees over plants and instances.
    ///
    /// # Errors
    /// [`ReferenceError::Instance`] and [`ReferenceError::UnknownPlant`] for the first instance that is impossible,
    /// [`ReferenceError::TooManyInstances`], [`ReferenceError::Value`] for the ground.
    pub fn new(plants: &[Arc<Plant>], instances: &[Instance], ground: Option<Ground>) -> Result<Self, ReferenceError> {
        if instances.len() > MOST_ITEMS {
            return Err(ReferenceError::TooManyInstances { count: instances.len(), limit: MOST_ITEMS });
        }
        for (index, instance) in instances.iter().enumerate() {
            instance.check(index, plants.len())?;
        }
        if let Some(ground) = &ground {
            if !(0.0..=1e7).contains(&ground.max_distance) {
                return Err(ReferenceError::value(
                    "the max distance of the ground",
                    ground.max_distance,
                    "metres from 0 to 1e7",
                ));
            }
            if let GroundShape::Plane(height) = ground.shape
                && !(-FARTHEST..=FARTHEST).contains(&height)
            {
                return Err(ReferenceError::value("the height of the ground", height, "metres within 1e8"));
            }
        }
        let tracers: Vec<PlantTracer> = plants.par_iter().map(PlantTracer::new).collect();
        let placed: Vec<Placed> = instances
            .iter()
            .map(|instance| Placed {
                position: instance.position,
                yaw_sin_cos: f64::from(instance.yaw).sin_cos(),
                scale: instance.scale.into(),
                plant: instance.plant as u32,
                tint: instance.tint,
            })
            .collect();
        let boxes: Vec<WorldBox> = placed.iter().map(|placed| placed_box(placed, &tracers)).collect();
        let margin = |tracer: &PlantTracer| {
            tracer.bounds().map_or(0.0, |bounds| MARGIN * f64::from(bounds.size().max_element()))
        };
        let margins = tracers.iter().map(margin).collect();
        let tree = BoxTree::new(&boxes);
        Ok(Self { tracers, leaves: Vec::new(), model: LeafModel::Standard, margins, tree, instances: placed, ground })
    }

    /// The same with leaves that scatter light by `model`.
    #[must_use]
    pub fn with_leaves(mut self, model: LeafModel) -> Self {
        let parts = |tracer: &PlantTracer| -> Vec<_> {
            tracer.plant().parts.iter().map(|part| PartLeaf::new(part, model)).collect()
        };
        self.leaves = match model {
            LeafModel::Standard => Vec::new(),
            _ => self.tracers.par_iter().map(parts).collect(),
        };
        self.model = model;
        self
    }

    /// The leaves of a part of an instance, if they have layers.
    pub(super) fn leaf(&self, instance: usize, part: u32) -> Option<&PartLeaf> {
        let plant = self.instances.get(instance)?.plant;
        self.leaves.get(plant as usize)?.get(part as usize)?.as_ref()
    }

    /// Number of instances.
    pub fn instances(&self) -> usize {
        self.instances.len()
    }

    /// The plant of an instance.
    pub fn plant(&self, instance: usize) -> Option<&Arc<Plant>> {
        self.tracer(instance).map(PlantTracer::plant)
    }

    /// The ground.
    pub fn ground(&self) -> Option<&Ground> {
        self.ground.as_ref()
    }

    pub(crate) fn tracer(&self, instance: usize) -> Option<&PlantTracer> {
        self.tracers.get(self.instances.get(instance)?.plant as usize)
    }

    /// The ray in the frame of an instance whose box it enters at `near`, with where it starts there.
    ///
    /// It is moved up to the plant, and in f64: in f32 the ray of a camera a kilometre away would be off by a tenth of
    /// a millimetre. It starts a little before the box, on whose very side there may be a leaf.
    fn at_instance(&self, ray: &WorldRay, index: usize, near: f64, max_distance: f64) -> (&Placed, Ray, f64) {
        let placed = &self.instances[index];
        let start = (near - self.margins[placed.plant as usize] * placed.scale).max(0.0);
        (placed, placed.ray(ray, start, max_distance), start)
    }

    /// Metres to what the ray meets first; 0 under the ground, `None` where it meets nothing.
    pub fn distance(&self, ray: &WorldRay) -> Option<f64> {
        let found = self.closest(ray)?;
        self.surface(found, ray.direction, Normals::Flat)
            .map_or(Some(0.0), |s| Some((s.position - ray.origin).length()))
    }

    /// What the ray meets first.
    pub(crate) fn closest(&self, ray: &WorldRay) -> Option<Found> {
        let mut found = None;
        let mut end = ray.t_max;
        self.tree.walk(ray, |index, near, max_distance| {
            let (placed, local, start) = self.at_instance(ray, index, near, max_distance);
            let Some(hit) = self.tracers[placed.plant as usize].closest(&local) else { return max_distance };
            found = Some(Found::Plant { instance: index, hit });
            end = start + f64::from(hit.t) * placed.scale;
            end
        });
        let Some(ground) = &self.ground else { return found };
        match ground.shape.crossing(&WorldRay { t_max: end, ..*ray }, ground.max_distance) {
            Some(Crossing::At(t)) => Some(Found::Ground { position: ray.at(t) }),
            Some(Crossing::Buried) => Some(Found::Buried),
            None => found,
        }
    }

    /// Whether the ray meets anything.
    pub fn occluded(&self, ray: &WorldRay) -> bool {
        let mut met = false;
        self.tree.walk(ray, |index, near, max_distance| {
            let (placed, local, _) = self.at_instance(ray, index, near, max_distance);
            met = self.tracers[placed.plant as usize].occluded(&local);
            if met { -1.0 } else { max_distance }
        });
        met || self.ground.as_ref().is_some_and(|ground| ground.shape.crossing(ray, ground.max_distance).is_some())
    }

    /// The surface that was found, seen along the unit vector `direction`; `None` under the ground.
    pub(crate) fn surface(&self, found: Found, direction: DVec3, normals: Normals) -> Option<Surface> {
        match found {
            Found::Buried => None,
            Found::Ground { position } => {
                let ground = self.ground.as_ref()?;
                let normal = ground.shape.normal(position.x, position.z);
                let albedo = match &ground.color {
                    GroundColor::Even(albedo) => *albedo,
                    GroundColor::Soil(soil) => soil.albedo(position, normal),
                };
                let bsdf = Bsdf::new(normal, normal, Shares::matt(albedo, Vec3::ZERO), normal);
                Some(Surface { position, bsdf, anchor: Anchor::Ground })
            }
            Found::Plant { instance, hit } => {
                let tracer = self.tracer(instance)?;
                let point = tracer.point(&hit);
                let gloss = tracer.plant().parts.get(hit.part as usize)?.material.gloss;
                let to_viewer = -direction.as_vec3();
                if let Some(leaf) = self.leaf(instance, hit.part) {
                    return Some(self.layered(leaf, instance, &hit, &point, normals, to_viewer));
                }
                Some(self.on_plant(instance, &point, normals, |placed, geometric, shading| {
                    Bsdf::new(geometric, shading, placed.shares(&point, gloss), to_viewer)
                }))
            }
        }
    }

    /// A surface of an instance at a point in the plant's frame; `bsdf` gets the normals in the scene's.
    pub(super) fn on_plant(
        &self,
        instance: usize,
        point: &SurfacePoint,
        normals: Normals,
        bsdf: impl FnOnce(&Placed, Vec3, Vec3) -> Bsdf,
    ) -> Surface {
        let placed = &self.instances[instance];
        let rotated = |normal: Vec3| placed.into_scene(normal.as_dvec3()).as_vec3();
        let geometric = rotated(point.geometric_normal);
        let round = match normals {
            Normals::Flat => false,
            Normals::RoundWood => point.kind == PartKind::Wood,
            Normals::Interpolated => true,
        };
        let shading = if round { rotated(point.shading_normal) } else { geometric };
        Surface {
            position: placed.position + placed.into_scene(point.position.as_dvec3()) * placed.scale,
            bsdf: bsdf(placed, geometric, shading),
            anchor: Anchor::Plant {
                instance,
                position: point.position,
                normal: point.geometric_normal,
                error: Some(point.error),
                leaf: None,
            },
        }
    }

    /// A point of an instance whose light is asked for, seen from the side of `normal` (plant frame).
    pub(crate) fn receiver(&self, instance: usize, position: Vec3, normal: Vec3, shares: Shares) -> Option<Surface> {
        let placed = self.instances.get(instance)?;
        let rotated = placed.into_scene(normal.as_dvec3()).as_vec3();
        Some(Surface {
            position: placed.position + placed.into_scene(position.as_dvec3()) * placed.scale,
            bsdf: Bsdf::new(rotated, rotated, shares, rotated),
            anchor: Anchor::Plant { instance, position, normal, error: None, leaf: None },
        })
    }

    /// A ray without end that leaves `surface` in a direction and does not meet it again where it starts.
    pub(crate) fn leave(&self, surface: &Surface, direction: Vec3) -> WorldRay {
        let direction = direction.as_dvec3().normalize_or(DVec3::Y);
        let origin = match surface.anchor {
            Anchor::Ground => self.ground.as_ref().map_or(surface.position, |g| g.shape.lifted(surface.position)),
            Anchor::Plant { instance, position, normal, error, .. } => {
                let placed = &self.instances[instance];
                let local = placed.into_plant(direction).as_vec3();
                let origin = match error {
                    Some(error) => leave(position, normal, error, local),
                    None => offset_origin(position, normal, local),
                };
                placed.position + placed.into_scene(origin.as_dvec3()) * placed.scale
            }
        };
        WorldRay::new(origin, direction)
    }

    /// Everything that rays depend on, as bytes for a fingerprint.
    pub(crate) fn feed(&self, hasher: &mut blake3::Hasher) {
        for tracer in &self.tracers {
            tracer.plant().feed_baked_content(hasher);
            // What no bake reads.
            for part in &tracer.plant().parts {
                hasher.update(&part.material.gloss.roughness.to_le_bytes());
            }
        }
        // A scene that no leaf has layers in is the same whatever the model.
        if self.leaves.iter().flatten().any(Option::is_some) {
            hasher.update(format!("{:?}", self.model).as_bytes());
            let parts = self.tracers.iter().flat_map(|tracer| &tracer.plant().parts);
            parts.for_each(|part| part.material.feed_tissue(hasher));
        }
        for placed in &self.instances {
            let numbers =
                [placed.position.x, placed.position.y, placed.position.z, placed.yaw_sin_cos.0, placed.yaw_sin_cos.1];
            hasher.update(bytemuck::cast_slice(&numbers));
            hasher.update(&placed.scale.to_le_bytes());
            hasher.update(&placed.plant.to_le_bytes());
            hasher.update(&placed.tint.to_le_bytes());
        }
        let Some(ground) = &self.ground else { return };
        match &ground.shape {
            GroundShape::Plane(height) => hasher.update(&height.to_le_bytes()),
            GroundShape::Terrain(terrain) => {
                let field = terrain.field();
                hasher.update(bytemuck::cast_slice(field.heights()));
                hasher.update(format!("{:?} {:?}", terrain.surroundings(), field).as_bytes())
            }
        };
        hasher.update(&ground.max_distance.to_le_bytes());
        match &ground.color {
            GroundColor::Even(albedo) => {
                hasher.update(bytemuck::bytes_of(albedo));
            }
            GroundColor::Soil(soil) => soil.feed(hasher),
        }
    }
}

impl Placed {
    /// What the point reflects and transmits: the twin of `tint_foliage` in `shaders/forest/instance.wgsl`.
    pub(super) fn shares(&self, point: &SurfacePoint, gloss: Gloss) -> Shares {
        let tint = match point.kind {
            PartKind::Wood => Vec3::ONE,
            PartKind::Foliage => Vec3::ONE + self.tint * Vec3::new(0.18, 0.07, -0.05),
        };
        Shares::glossy(point.base_color * tint, point.transmission * tint, gloss)
    }
}

/// The box of an instance: its plant's, rotated. A plant without a surface has its foot.
fn placed_box(placed: &Placed, tracers: &[PlantTracer]) -> WorldBox {
    let Some(bounds) = tracers[placed.plant as usize].bounds() else {
        return WorldBox { min: placed.position, max: placed.position };
    };
    let corners = (0..8).map(|corner| {
        let pick = |bit: u32, axis: usize| if corner >> bit & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let corner = DVec3::new(pick(0, 0).into(), pick(1, 1).into(), pick(2, 2).into());
        placed.position + placed.into_scene(corner) * placed.scale
    });
    corners.fold(WorldBox { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY }, |b, corner| WorldBox {
        min: b.min.min(corner),
        max: b.max.max(corner),
    })
}
