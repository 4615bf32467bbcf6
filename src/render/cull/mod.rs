//! Which trees a view or a cascade draws, and in which representation. Pure functions over a packed stand.
//!
//! Trees are sorted into square cells. Cells are tested against the frustum and sorted front to back, so that near
//! crowns hide what lies behind before it is shaded; only cells that the fade band reaches are looked into tree by
//! tree. The lists are a function of the camera alone: no atomics, no race in their order.
//!
//! Cost: one test a cell (8,800 cells for 36 km²) and one append a visible tree.

use std::ops::Range;

use glam::{DVec3, Mat4, Vec3, Vec4, Vec4Swizzles};

use crate::{
    lod::FadeBand,
    render::sun_shadow::cascades::{CascadeBox, LOWEST_SINE},
    scatter::{Cell, PackedStand},
};

/// Planes of a frustum, relative to the camera: `normal · p + w >= 0` inside.
#[derive(Clone, Debug)]
pub struct Frustum {
    planes: Vec<Vec4>,
}

impl Frustum {
    /// The four side planes of `clip_from_relative`. They meet in the camera, so what lies behind it is outside of them.
    pub fn new(clip_from_relative: &Mat4) -> Self {
        let rows = clip_from_relative.transpose();
        let planes = [
            rows.w_axis + rows.x_axis,
            rows.w_axis - rows.x_axis,
            rows.w_axis + rows.y_axis,
            rows.w_axis - rows.y_axis,
        ];
        let normalised = |plane: Vec4| {
            let length = plane.xyz().length();
            (length > 1e-12).then(|| plane / length)
        };
        Self { planes: planes.into_iter().filter_map(normalised).collect() }
    }

    /// Whether the camera-relative axis-aligned box may be seen.
    pub fn sees_box(&self, min: Vec3, max: Vec3) -> bool {
        let (middle, half) = (0.5 * (min + max), 0.5 * (max - min));
        self.planes.iter().all(|plane| plane.xyz().dot(middle) + plane.w + plane.xyz().abs().dot(half) >= 0.0)
    }

    /// Whether a camera-relative sphere that is swept from `start` to `end` may be seen.
    pub fn sees_swept_sphere(&self, start: Vec3, end: Vec3, radius: f32) -> bool {
        let above = |plane: &Vec4, point: Vec3| plane.xyz().dot(point) + plane.w;
        self.planes.iter().all(|plane| above(plane, start).max(above(plane, end)) >= -radius)
    }

    /// Whether the camera-relative sphere may be seen.
    pub fn sees_sphere(&self, center: Vec3, radius: f32) -> bool {
        self.planes.iter().all(|plane| plane.xyz().dot(center) + plane.w >= -radius)
    }
}

/// What one view draws of one stand: ranges into `visible`, which holds indices of trees.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawLists {
    /// Indices into the stand's trees.
    pub visible: Vec<u32>,
    /// For each variant, the trees drawn as full models (or as shadow proxies).
    pub models: Vec<Range<u32>>,
    /// Trees drawn as crosses.
    pub crosses: Range<u32>,
}

impl DrawLists {
    fn assemble(models: Vec<Vec<u32>>, mut crosses: Vec<u32>) -> Self {
        let mut visible = Vec::with_capacity(crosses.len() + models.iter().map(Vec::len).sum::<usize>());
        let models = models
            .into_iter()
            .map(|list| {
                let first = visible.len() as u32;
                visible.extend(list);
                first..visible.len() as u32
            })
            .collect();
        let first = visible.len() as u32;
        visible.append(&mut crosses);
        let last = visible.len() as u32;
        Self { visible, models, crosses: first..last }
    }

    /// Number of trees drawn as full models.
    pub fn model_count(&self) -> usize {
        self.models.iter().map(|range| range.len()).sum()
    }

    /// Number of trees drawn as crosses.
    pub fn cross_count(&self) -> usize {
        self.crosses.len()
    }
}

/// Size of a variant for culling, in metres at scale 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VariantSize {
    /// Height above the foot.
    pub height: f32,
    /// Horizontal radius around the trunk.
    pub radius: f32,
}

/// The nearest and the farthest horizontal distance from `point` to a cell.
fn flat_distances(cell: &Cell, point: DVec3) -> (f64, f64) {
    let low = glam::DVec2::new(cell.min.x - point.x, cell.min.z - point.z);
    let high = glam::DVec2::new(cell.max.x - point.x, cell.max.z - point.z);
    (low.max(-high).max(glam::DVec2::ZERO).length(), low.abs().max(high.abs()).length())
}

/// Lists for a camera at `camera`, in the stand's own metres.
///
/// `frustum` is relative to the camera; trees beyond `view_distance` metres are left out.
pub fn cull_view(
    stand: &PackedStand,
    sizes: &[VariantSize],
    camera: DVec3,
    frustum: &Frustum,
    fade: FadeBand,
    view_distance: f32,
) -> DrawLists {
    let mut cells: Vec<(f64, f64, usize)> = stand
        .cells
        .iter()
        .enumerate()
        .filter_map(|(index, cell)| {
            let (near, far) = flat_distances(cell, camera);
            let seen = near <= f64::from(view_distance)
                && frustum.sees_box((cell.min - camera).as_vec3(), (cell.max - camera).as_vec3());
            seen.then_some((near, far, index))
        })
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));

    let mut models = vec![Vec::new(); sizes.len()];
    let mut crosses = Vec::new();
    for (near, far, index) in cells {
        let cell = &stand.cells[index];
        let trees = cell.first..cell.first + cell.count;
        if near > f64::from(fade.end) && far <= f64::from(view_distance) {
            crosses.extend(trees);
            continue;
        }
        for tree in trees {
            let Some(packed) = stand.trees.get(tree as usize) else { continue };
            let relative = (packed.position(stand.cell_size) - camera).as_vec3();
            let distance = glam::Vec2::new(relative.x, relative.z).length();
            if distance > view_distance {
                continue;
            }
            let variant = packed.variant() as usize;
            let Some(size) = sizes.get(variant) else { continue };
            let scale = packed.scale();
            let half = 0.5 * size.height * scale;
            let radius = half.hypot(size.radius * scale);
            if !frustum.sees_sphere(relative + Vec3::Y * half, radius) {
                continue;
            }
            if fade.draws_model(distance) {
                models[variant].push(tree);
            }
            if fade.draws_cross(distance) {
                crosses.push(tree);
            }
        }
    }
    DrawLists::assemble(models, crosses)
}

/// What a view can see of shadows: a caster counts only if the volume that it shades can be seen.
#[derive(Clone, Debug)]
pub struct SeenShadows<'a> {
    /// The camera in scene metres.
    pub camera: DVec3,
    /// Its frustum, relative to it.
    pub frustum: &'a Frustum,
    /// Lowest ground in scene metres: a shadow goes no farther down.
    pub lowest: f64,
    /// How far from its own place a visible point may look the map up, metres.
    pub margin: f64,
}

impl SeenShadows<'_> {
    /// Whether the shadow of a caster in the sphere (scene metres) may be seen, for a light in `direction` (unit).
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
/// Trees at a distance of the box's centre in `proxies`, metres, cast as proxies, the others as billboards. With `seen`,
/// casters whose shadow no pixel of the view can show are left out.
pub fn cull_cascade(
    stand: &PackedStand,
    sizes: &[VariantSize],
    origin: DVec3,
    cascade: &CascadeBox,
    proxies: Range<f64>,
    seen: Option<&SeenShadows>,
) -> DrawLists {
    let mut models = vec![Vec::new(); sizes.len()];
    let mut crosses = Vec::new();
    let center = cascade.center - origin;
    let reach = cascade.reach();
    let casts = |min: DVec3, max: DVec3| {
        let (middle, radius) = (0.5 * (min + max), 0.5 * (max - min).length());
        reach.includes(min, max) && seen.is_none_or(|seen| seen.includes(middle, radius, cascade.direction))
    };
    for cell in &stand.cells {
        if !casts(cell.min + origin, cell.max + origin) {
            continue;
        }
        for tree in cell.first..cell.first + cell.count {
            let Some(packed) = stand.trees.get(tree as usize) else { continue };
            let variant = packed.variant() as usize;
            let Some(size) = sizes.get(variant) else { continue };
            let scale = f64::from(packed.scale());
            let foot = packed.position(stand.cell_size);
            let (radius, height) = (f64::from(size.radius) * scale, f64::from(size.height) * scale);
            let (min, max) = (foot - DVec3::new(radius, 0.0, radius), foot + DVec3::new(radius, height, radius));
            if !casts(min + origin, max + origin) {
                continue;
            }
            let offset = foot - center;
            let top = (foot + DVec3::Y * height).dot(cascade.direction);
            if proxies.contains(&offset.x.hypot(offset.z)) {
                models[variant].push((top, tree));
            } else {
                crosses.push((top, tree));
            }
        }
    }
    // Nearest to the light first: what lies behind is hidden before its alpha is looked up.
    let sorted = |mut list: Vec<(f64, u32)>| -> Vec<u32> {
        list.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        list.into_iter().map(|(_, tree)| tree).collect()
    };
    DrawLists::assemble(models.into_iter().map(sorted).collect(), sorted(crosses))
}
