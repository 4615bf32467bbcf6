//! Surfaces of leaves with layers, and the rays that leave them.

use glam::{Vec2, Vec3};

use super::PartLeaf;
use crate::plant::PlantPart;
use crate::reference::bsdf::Bsdf;
use crate::reference::camera::WorldRay;
use crate::reference::scene::{Anchor, LeafBody, Normals, ReferenceScene, Surface};
use crate::trace::{Hit, PlantTracer, Ray, SurfacePoint, leave};

/// Thicknesses of the tissue within which the other side of a volume is looked for, over its largest thickness.
const DEEPEST: f32 = 1e3;

impl ReferenceScene {
    /// The surface of a leaf with layers.
    pub(in crate::reference) fn layered(
        &self,
        leaf: &PartLeaf,
        instance: usize,
        hit: &Hit,
        point: &SurfacePoint,
        normals: Normals,
        to_viewer: Vec3,
    ) -> Surface {
        let placed = self.instances[instance];
        let tracer = self.tracer(instance);
        let gloss =
            tracer.and_then(|tracer| tracer.plant().parts.get(hit.part as usize)).map(|part| part.material.gloss);
        let viewer = placed.into_plant(to_viewer.as_dvec3()).as_vec3();
        let front = point.geometric_normal.dot(viewer) >= 0.0;
        let side = if front { point.geometric_normal } else { -point.geometric_normal };

        let given = leaf.thickness(point.uv);
        let measured =
            leaf.is_volume().then(|| tracer.and_then(|tracer| depth_of(tracer, point, side, given))).flatten();
        let body = LeafBody { thickness: measured.unwrap_or(given), volume: measured.is_some() };
        let optical_depth = if leaf.knows_texels() { leaf.optical_depth(point.uv, body.thickness) } else { 0.0 };

        let mut colored = *point;
        if !front && let Some(back) = leaf.back(point.uv) {
            colored.base_color = back;
        }
        let [before, behind] = leaf.perpendicular(front, optical_depth);
        colored.base_color *= before;
        colored.transmission *= behind;
        let smooth = if normals == Normals::Interpolated { point.shading_normal } else { point.geometric_normal };
        let bumped = tracer.and_then(|tracer| bumped(tracer, hit, point.uv, smooth, leaf));
        colored.shading_normal = bumped.unwrap_or(point.shading_normal);
        let normals = if bumped.is_some() { Normals::Interpolated } else { normals };

        let mut surface = self.on_plant(instance, &colored, normals, |placed, geometric, shading| {
            let shares = placed.shares(&colored, gloss.unwrap_or_default());
            let shares = shares.with_room_for(leaf.most(front));
            Bsdf::new(geometric, shading, shares, to_viewer)
                .with_tissue(|cosine| leaf.view(front, optical_depth, cosine))
        });
        if let Anchor::Plant { leaf, .. } = &mut surface.anchor {
            *leaf = Some(body);
        }
        surface
    }

    /// A ray without end that leaves a leaf with layers in a direction, from the test point that `choice`, 0..1, picks.
    pub(in crate::reference) fn leave_leaf(&self, surface: &Surface, direction: Vec3, choice: f32) -> WorldRay {
        let (Anchor::Plant { instance, position, normal, error, leaf: Some(body) }, Some((view, seen, to_viewer))) =
            (surface.anchor, surface.bsdf.tissue())
        else {
            return self.leave(surface, direction);
        };
        let placed = self.instances[instance];
        let local = |v: Vec3| placed.into_plant(v.as_dvec3()).as_vec3();
        let (towards, to_viewer) = (local(direction), local(to_viewer));
        let side = if local(seen).dot(normal) < 0.0 { -normal } else { normal };
        let exit = view.exit(side, to_viewer, towards, body.thickness, choice);
        let error = error.unwrap_or(0.0);
        let behind = side.dot(towards) < 0.0;
        let other_side = (body.volume && behind)
            .then(|| self.tracer(instance))
            .flatten()
            .and_then(|tracer| exit_of(tracer, position + exit.inside, towards, body.thickness));
        let origin = other_side.unwrap_or_else(|| leave(position + exit.outside, normal, error, towards));
        let direction = placed.into_scene(towards.as_dvec3()).normalize_or(glam::DVec3::Y);
        WorldRay::new(placed.position + placed.into_scene(origin.as_dvec3()) * placed.scale, direction)
    }
}

/// Metres from a point of a closed volume to its other side, against the normal `side`; `None` where there is none within
/// reach of `thickness`.
fn depth_of(tracer: &PlantTracer, point: &SurfacePoint, side: Vec3, thickness: f32) -> Option<f32> {
    let origin = leave(point.position, side, point.error, -side);
    let hit = tracer.closest(&Ray { origin, direction: -side, t_max: thickness * DEEPEST })?;
    Some(hit.t + point.error)
}

/// Where a ray from a point in a closed volume has left it.
fn exit_of(tracer: &PlantTracer, inside: Vec3, direction: Vec3, thickness: f32) -> Option<Vec3> {
    let hit = tracer.closest(&Ray { origin: inside, direction, t_max: thickness * DEEPEST })?;
    Some(tracer.point(&hit).leave(direction))
}

/// The normal of the bump texture in the plant's frame about the unit vector `smooth`, both on the front; `None` without one.
fn bumped(tracer: &PlantTracer, hit: &Hit, uv: Vec2, smooth: Vec3, leaf: &PartLeaf) -> Option<Vec3> {
    let bump = leaf.bump(uv)?;
    let [right, up] = tangents(tracer.plant().parts.get(hit.part as usize)?, hit, smooth)?;
    (right * bump.x + up * bump.y + smooth * bump.z).try_normalize()
}

/// Unit vectors in a triangle's plane in which its texture coordinates run to the right and up (the texture's v runs down), on its
/// front. `None` where its texture coordinates have no area.
fn tangents(part: &PlantPart, hit: &Hit, normal: Vec3) -> Option<[Vec3; 2]> {
    let corners = part.mesh.triangles.get(hit.triangle as usize)?.map(|corner| corner as usize);
    let [a, b, c] = corners.map(|corner| part.mesh.positions.get(corner).copied());
    let [ta, tb, tc] = corners.map(|corner| part.mesh.uvs.get(corner).copied());
    let (along, across) = (b? - a?, c? - a?);
    let (s, t) = (tb? - ta?, tc? - ta?);
    let area = s.perp_dot(t);
    if area == 0.0 || !area.is_finite() {
        return None;
    }
    let right = (along * t.y - across * s.y) * area.signum();
    let right = (right - normal * normal.dot(right)).try_normalize()?;
    let down = (across * s.x - along * t.x) * area.signum();
    let down = down - normal * normal.dot(down);
    Some([right, -(down - right * right.dot(down)).try_normalize()?])
}
