//! A point of a leaf with layers, seen from somewhere.

use glam::Vec3;

use super::layers::Layers;
use crate::plant::tissue_light::{AngleFactor, LEAST_LAYER_COSINE, LeafSide};

/// Height over the shift along the surface by which the start of a ray is raised, so that a curved leaf does not shade
/// itself: its triangles may meet at up to this slope.
const RAISED: f32 = 0.25;

/// The tissue under a point of a leaf, on the viewer's side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LeafView {
    layers: Layers,
    /// Ways over depths of the view ray in the layers.
    view: [f32; 3],
    response: Response,
}

/// How a leaf's light depends on its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Response {
    /// As three slabs that scatter.
    Slabs {
        /// Factors of the angle of light from before and from behind.
        light: [AngleFactor; 2],
        /// The factors of the viewer's angle.
        view: [f32; 2],
    },
    /// As the thesis has it: by its way to test points and from there.
    TestPoints {
        optical_depth: f32,
        /// What is left of perpendicular light from before and from behind; above 0.
        perpendicular: [f32; 2],
    },
}

impl LeafView {
    /// A leaf whose sides, the one that is seen first, are these, seen at the cosine `to_viewer`, 0..=1.
    pub fn slabs(layers: Layers, [seen, other]: [LeafSide; 2], to_viewer: f32) -> Self {
        let response = Response::Slabs {
            light: [seen.reflected, other.transmitted],
            view: [seen.reflected.at(to_viewer), seen.transmitted.at(to_viewer)],
        };
        Self { layers, view: layers.view(to_viewer), response }
    }

    /// The thesis's leaf of an optical depth.
    pub fn test_points(layers: Layers, optical_depth: f32, to_viewer: f32) -> Self {
        let least = f32::MIN_POSITIVE;
        let perpendicular = [false, true].map(|behind| layers.perpendicular(optical_depth, behind).max(least));
        let response = Response::TestPoints { optical_depth, perpendicular };
        Self { layers, view: layers.view(to_viewer), response }
    }

    /// Factor on the light from the cosine `light`, 0..=1, over that on perpendicular light seen perpendicularly.
    pub fn factor(&self, light: f32, behind: bool) -> f32 {
        let side = usize::from(behind);
        match &self.response {
            Response::Slabs { light: factors, view } => view[side] * factors[side].at(light),
            Response::TestPoints { optical_depth, perpendicular } => {
                let left = self.layers.attenuation(*optical_depth, self.view, light, behind);
                (left / perpendicular[side]).min(1.0)
            }
        }
    }

    /// Where a ray in `direction` leaves the leaf that comes from a test point, relative to the point that is seen.
    /// `normal` is on the viewer's side, `thickness` in metres, and `choice`, 0..1, picks the point.
    pub fn exit(&self, normal: Vec3, to_viewer: Vec3, direction: Vec3, thickness: f32, choice: f32) -> Exit {
        let cosine = normal.dot(direction);
        let behind = cosine < 0.0;
        let point = match self.response {
            Response::Slabs { .. } => self.layers.even_point(self.view, choice),
            Response::TestPoints { optical_depth, .. } => {
                self.layers.point(optical_depth, self.view, cosine.abs().min(1.0), behind, choice)
            }
        };
        let away = -(to_viewer - normal * normal.dot(to_viewer)).normalize_or_zero();
        let inside = thickness * (away * point.lateral - normal * point.depth);
        let rest = if behind { 1.0 - point.depth } else { point.depth };
        let outside = inside + direction * (thickness * rest / cosine.abs().max(LEAST_LAYER_COSINE));
        let shift = (outside - normal * normal.dot(outside)).length();
        // On the plane exactly, whatever was clamped.
        let height = if behind { -thickness - RAISED * shift } else { RAISED * shift };
        let plane = outside - normal * normal.dot(outside);
        Exit { inside, outside: plane + normal * height }
    }
}

/// Where a ray comes from that leaves a leaf: offsets in metres from the point that is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Exit {
    /// Of the test point.
    pub inside: Vec3,
    /// Of the point where it leaves a leaf that is a plane.
    pub outside: Vec3,
}
