//! Which trees cast shadows into a cascade, and with which representation.

use std::ops::Range;

use glam::DVec3;

use super::{
    Frustum,
    cascades::{CascadeBox, LOWEST_SINE},
    lists::{DrawLists, Grouping, ListBuilder},
};
use crate::scatter::{PackedStand, PlantSize};

/// The shadows that a view can see: a caster counts only if the volume that it shades is visible.
#[derive(Clone, Debug)]
pub struct SeenShadows<'a> {
    /// The camera in scene metres.
    pub camera: DVec3,
    /// Its frustum, relative to it.
    pub frustum: &'a Frustum,
    /// Lowest ground in scene metres: a shadow goes no farther down.
    pub lowest: f64,
    /// Maximum distance between a visible point and the position at which it samples the map, metres.
    pub margin: f64,
}

impl SeenShadows<'_> {
    /// Whether the shadow of a caster within the sphere (scene metres) may be visible, for a light in `direction`
    /// (unit).
    fn includes(&self, center: DVec3, radius: f64, direction: DVec3) -> bool {
        let radius = radius + self.margin;
        let drop = (center.y + radius - self.lowest).max(0.0);
        let length = drop / direction.y.max(LOWEST_SINE);
        let start = (center - self.camera).as_vec3();
        let end = (center - direction * length - self.camera).as_vec3();
        self.frustum.sees_swept_sphere(start, end, radius as f32)
    }
}

/// Casters of one cascade, whose box lies in scene metres; `origin` is the stand's own origin there.
///
/// `casting` has a range of distances from the box's centre, metres, for each level: a tree casts in the first level
/// whose range contains it, and not at all if there is none. `groupings` has one entry per level. With `seen`, casters
/// whose shadow is visible in no pixel of the view are left out.
pub fn cull_cascade(
    stand: &PackedStand,
    sizes: &[PlantSize],
    origin: DVec3,
    cascade: &CascadeBox,
    casting: &[Range<f64>],
    groupings: &[Grouping],
    seen: Option<&SeenShadows>,
) -> DrawLists {
    let center = cascade.center - origin;
    let volume = cascade.caster_volume();
    let casts = |min: DVec3, max: DVec3| {
        let (middle, radius) = (0.5 * (min + max), 0.5 * (max - min).length());
        volume.includes(min, max) && seen.is_none_or(|seen| seen.includes(middle, radius, cascade.direction))
    };
    gather(stand, sizes, center, cascade.direction, casting, groupings, |min, max| casts(min + origin, max + origin))
}

/// Casters of a light whose view is bounded by `frustum`, which is relative to `anchor` (in the stand's own metres) and
/// unbounded along the light. `casting` counts from the anchor; the rest is as for [`cull_cascade`].
pub fn cull_light_view(
    stand: &PackedStand,
    sizes: &[PlantSize],
    anchor: DVec3,
    frustum: &Frustum,
    direction: DVec3,
    casting: &[Range<f64>],
    groupings: &[Grouping],
) -> DrawLists {
    gather(stand, sizes, anchor, direction, casting, groupings, |min, max| {
        frustum.sees_box((min - anchor).as_vec3(), (max - anchor).as_vec3())
    })
}

/// Trees whose boxes (in the stand's own metres) cast, by their distance from `center` and sorted from the light
/// outwards.
fn gather(
    stand: &PackedStand,
    sizes: &[PlantSize],
    center: DVec3,
    direction: DVec3,
    casting: &[Range<f64>],
    groupings: &[Grouping],
    casts: impl Fn(DVec3, DVec3) -> bool,
) -> DrawLists {
    let mut lists = ListBuilder::new(groupings, sizes.len());
    for cell in &stand.cells {
        if !casts(cell.min, cell.max) {
            continue;
        }
        for tree in cell.first..cell.first + cell.count {
            let Some(packed) = stand.trees.get(tree as usize) else { continue };
            let variant = packed.variant() as usize;
            let Some(size) = sizes.get(variant) else { continue };
            let scale = f64::from(packed.scale());
            let foot = packed.position(&stand.grid);
            let (radius, height) = (f64::from(size.radius) * scale, f64::from(size.height) * scale);
            let (min, max) = (foot - DVec3::new(radius, 0.0, radius), foot + DVec3::new(radius, height, radius));
            if !casts(min, max) {
                continue;
            }
            let offset = foot - center;
            let distance = offset.x.hypot(offset.z);
            let Some(level) = casting.iter().position(|range| range.contains(&distance)) else { continue };
            if let Some(list) = lists.list(level, variant) {
                list.push(((foot + DVec3::Y * height).dot(direction), tree));
            }
        }
    }
    // Nearest to the light first: what lies behind is hidden before its alpha is looked up.
    let sorted = |mut list: Vec<(f64, u32)>| -> Vec<u32> {
        list.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        list.into_iter().map(|(_, tree)| tree).collect()
    };
    let levels = lists.into_lists().into_iter().map(|groups| groups.into_iter().map(sorted).collect()).collect();
    DrawLists::assemble(levels)
}
