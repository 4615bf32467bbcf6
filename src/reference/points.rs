//! Exitant radiance of single points: the reference for bakes of radiance transfer.
//!
//! A point has no viewer, so it reflects diffusely, gloss included, as in a bake. The surfaces that light it have their
//! specular lobes.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::bsdf::Shares;
use super::error::ReferenceError;
use super::path::PathTracer;
use super::sampler::PathSampler;
use super::scene::Normals;
use crate::plant::{PartKind, geometry};
use crate::trace::Hit;

/// A point of an instance's surface, in its plant's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Position, metres.
    pub position: Vec3,
    /// Unit normal, from which cosines are counted and which tells the front from the back.
    pub normal: Vec3,
    /// Fraction of the light that is reflected. May be white, to get the light alone.
    pub reflected: Vec3,
    /// Fraction of the light that is transmitted; 0 for wood.
    pub transmitted: Vec3,
}

impl PathTracer<'_> {
    /// The vertices of a part of an instance as points, in the order of the mesh: colours from texture and material,
    /// not tinted; normals as the settings' [`Normals`] ask, the flat one of a vertex being the mean of its triangles'
    /// by their area. `None` for a vertex that no triangle with an area uses: there is no surface.
    ///
    /// # Errors
    /// [`ReferenceError::UnknownVertex`] where there is no such part.
    pub fn vertices(&self, instance: usize, part: usize) -> Result<Vec<Option<SurfaceSample>>, ReferenceError> {
        let unknown = ReferenceError::UnknownVertex { instance, part, vertex: 0 };
        let Some(tracer) = self.scene().tracer(instance) else { return Err(unknown) };
        let Some(plant_part) = tracer.plant().parts.get(part) else { return Err(unknown) };
        let mesh = &plant_part.mesh;
        let round = match self.settings().normals {
            Normals::Flat => false,
            Normals::RoundWood => plant_part.kind == PartKind::Wood,
            Normals::Interpolated => true,
        };
        let mut samples = vec![None; mesh.positions.len()];
        let mut flat = vec![DVec3::ZERO; mesh.positions.len()];
        for (triangle, corners) in geometry::triangles(mesh) {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner].as_dvec3());
            let area = (b - a).cross(c - a);
            if area == DVec3::ZERO {
                continue;
            }
            for (corner, (u, v)) in corners.into_iter().zip([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]) {
                flat[corner] += area;
                samples[corner].get_or_insert_with(|| {
                    let point = tracer.point(&Hit { t: 0.0, part: part as u32, triangle, u, v, front: true });
                    SurfaceSample {
                        position: mesh.positions[corner],
                        normal: mesh.normals[corner].normalize_or(point.geometric_normal),
                        reflected: point.base_color,
                        transmitted: point.transmission,
                    }
                });
            }
        }
        if !round {
            for (sample, flat) in samples.iter_mut().zip(flat) {
                if let Some(sample) = sample {
                    sample.normal = flat.try_normalize().map_or(sample.normal, DVec3::as_vec3);
                }
            }
        }
        Ok(samples)
    }

    /// Exitant radiance in nits of points of an instance, on the front (0) and the back (1), each the mean of `samples`
    /// paths. Points are independent of each other; a point's result depends on its index in the list.
    ///
    /// # Errors
    /// [`ReferenceError::UnknownVertex`] where there is no such instance.
    pub fn exitant_radiance(
        &self,
        instance: usize,
        points: &[SurfaceSample],
        samples: u32,
    ) -> Result<Vec<[Vec3; 2]>, ReferenceError> {
        if instance >= self.scene().instances() {
            return Err(ReferenceError::UnknownVertex { instance, part: 0, vertex: 0 });
        }
        let side = |index: usize, side: u64, point: &SurfaceSample| {
            let normal = if side == 0 { point.normal } else { -point.normal };
            let shares = Shares { reflected: point.reflected, transmitted: point.transmitted, lobe: None };
            let receiver = self.scene().receiver(instance, point.position, normal, shares);
            let Some(receiver) = receiver.filter(|_| point.position.is_finite() && point.normal.is_normalized()) else {
                return Vec3::ZERO;
            };
            let mut sum = DVec3::ZERO;
            for sample in 0..samples {
                let mut sampler = PathSampler::new(self.settings().seed, 2 * index as u64 + side, sample);
                sum += self.exitant(receiver, &mut sampler).as_dvec3();
            }
            (sum / f64::from(samples.max(1))).as_vec3()
        };
        Ok(points.par_iter().enumerate().map(|(index, point)| [side(index, 0, point), side(index, 1, point)]).collect())
    }

    /// Exitant radiance in nits of vertices of a part of an instance, front and back, as [`Self::vertices`] and
    /// [`Self::exitant_radiance`] have it. Black for a vertex without a surface.
    ///
    /// # Errors
    /// [`ReferenceError::UnknownVertex`].
    pub fn vertex_radiance(
        &self,
        instance: usize,
        part: usize,
        vertices: &[u32],
        samples: u32,
    ) -> Result<Vec<[Vec3; 2]>, ReferenceError> {
        let all = self.vertices(instance, part)?;
        let nowhere =
            SurfaceSample { position: Vec3::ZERO, normal: Vec3::ZERO, reflected: Vec3::ZERO, transmitted: Vec3::ZERO };
        let points = vertices
            .iter()
            .map(|&vertex| match all.get(vertex as usize) {
                Some(point) => Ok(point.unwrap_or(nowhere)),
                None => Err(ReferenceError::UnknownVertex { instance, part, vertex: vertex as usize }),
            })
            .collect::<Result<Vec<_>, _>>()?;
        self.exitant_radiance(instance, &points, samples)
    }
}
