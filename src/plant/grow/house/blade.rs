//! Single leaves as curved meshes.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::plant::PlantMesh;
use crate::plant::grow::textures::blade::BladeStyle;

/// How a leaf is attached and curved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    /// Where the petiole joins, metres.
    pub joint: Vec3,
    /// Direction of the midrib there, unit length.
    pub along: Vec3,
    /// The upper side's normal there, unit length.
    pub up: Vec3,
    /// Height of the texture, metres.
    pub height: f32,
    /// Angle by which the leaf bends down from the joint to its tip, radians.
    pub bend: f32,
    /// How much more of that at the tip than at the joint: 0 an even arc, 1 straight at the joint.
    pub late: f32,
    /// Angle by which each half is folded up along the midrib, radians.
    pub fold: f32,
    /// How far the sides curl down, as a fraction of the half width.
    pub curl: f32,
    /// Height of the waves of the rim, as a fraction of the height, and their number.
    pub waves: (f32, f32),
    /// Rotation of the tip about the midrib, radians.
    pub twist: f32,
    /// Phase of the waves.
    pub phase: f32,
}

impl Default for Pose {
    fn default() -> Self {
        Self {
            joint: Vec3::ZERO,
            along: Vec3::Z,
            up: Vec3::Y,
            height: 0.1,
            bend: 0.4,
            late: 0.4,
            fold: 0.15,
            curl: 0.1,
            waves: (0.0, 3.0),
            twist: 0.0,
            phase: 0.0,
        }
    }
}

/// The flat grid of a kind of leaf: the cells of its texture that hold leaf.
#[derive(Clone, Debug)]
pub(super) struct BladeGrid {
    columns: usize,
    rows: usize,
    /// For each row line: left and right end in texture coordinates.
    spans: Vec<[f32; 2]>,
    joint: Vec2,
    aspect: f32,
    /// Distance from the joint to the tip in heights of the texture.
    length: f32,
    half_width: f32,
}

/// Margin around the leaf in texture coordinates, so that the alpha test and not the mesh cuts the rim.
const MARGIN: f32 = 0.012;

impl BladeGrid {
    /// A grid for leaves of `style` with `columns` by `rows` cells.
    pub fn new(style: &BladeStyle, columns: usize, rows: usize) -> Self {
        let (columns, rows) = (columns.max(2), rows.max(2));
        let corners = &style.outline.corners;
        let (low, high) =
            corners.iter().fold((f32::MAX, f32::MIN), |(low, high), corner| (low.min(corner.y), high.max(corner.y)));
        let (low, high) = ((low - MARGIN).max(0.0), (high + MARGIN).min(1.0));
        let v = |row: usize| high + (low - high) * row as f32 / rows as f32;
        // The widest of the outline within a row's neighbours.
        let spans = (0..=rows)
            .map(|row| {
                let reach = (high - low) / rows as f32;
                let mut span = [f32::MAX, f32::MIN];
                for i in 0..corners.len() {
                    let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                    // The edge cut to the rows beside.
                    let (top, bottom) = (v(row) - reach, v(row) + reach);
                    if a.y.max(b.y) < top || a.y.min(b.y) > bottom {
                        continue;
                    }
                    for corner in [a, b] {
                        span = [span[0].min(corner.x), span[1].max(corner.x)];
                    }
                }
                if span[0] > span[1] { [style.outline.tip.x; 2] } else { [span[0] - MARGIN, span[1] + MARGIN] }
            })
            .collect();
        let half_width =
            corners.iter().map(|corner| (corner.x - style.outline.joint.x).abs()).fold(0.0, f32::max) * style.aspect();
        let joint = Vec2::new(style.outline.joint.x, style.outline.joint.y);
        Self {
            columns,
            rows,
            spans,
            joint,
            aspect: style.aspect(),
            length: style.flat(style.outline.tip).length().max(1e-3),
            half_width: half_width.max(1e-3),
        }
        .between(low, high)
    }

    fn between(mut self, low: f32, high: f32) -> Self {
        // The spans keep their order; their heights follow from the ends.
        self.spans.push([low, high]);
        self
    }

    fn height_of(&self, row: usize) -> f32 {
        let [low, high] = self.spans[self.rows + 1];
        high + (low - high) * row as f32 / self.rows as f32
    }

    /// Adds a leaf to `mesh`.
    pub fn add(&self, mesh: &mut PlantMesh, pose: &Pose) {
        let along = pose.along.normalize_or(Vec3::Z);
        let up = (pose.up - along * pose.up.dot(along)).normalize_or(along.any_orthonormal_vector());
        let side = along.cross(up);
        let first = mesh.positions.len();
        let stride = self.columns + 1;
        for row in 0..=self.rows {
            let v = self.height_of(row);
            let y = self.joint.y - v;
            let (center, direction, normal) = self.spine(pose, along, up, y);
            let twist = pose.twist * (y / self.length).clamp(-0.5, 1.0);
            let across = side * twist.cos() + normal * twist.sin();
            let normal = across.cross(direction).normalize_or(normal);
            let [left, right] = self.spans[row];
            for column in 0..=self.columns {
                let u = left + (right - left) * column as f32 / self.columns as f32;
                let x = (u - self.joint.x) * self.aspect;
                let outer = x / self.half_width;
                let wave = pose.waves.0
                    * outer
                    * outer
                    * (pose.waves.1 * TAU * y / self.length + pose.phase + if x < 0.0 { 1.7 } else { 0.0 }).sin();
                let folded = (x * x + 1e-5).sqrt() - 3.2e-3;
                let lift = folded * pose.fold.sin() - pose.curl * self.half_width * outer * outer + wave;
                let position = center + (across * (x * pose.fold.cos()) + normal * lift) * pose.height;
                mesh.positions.push(position);
                mesh.uvs.push(Vec2::new(u, v));
                mesh.normals.push(normal);
            }
        }
        for row in 0..=self.rows {
            for column in 0..=self.columns {
                let at = |row: usize, column: usize| mesh.positions[first + row * stride + column];
                let du = at(row, (column + 1).min(self.columns)) - at(row, column.saturating_sub(1));
                let dv = at((row + 1).min(self.rows), column) - at(row.saturating_sub(1), column);
                let index = first + row * stride + column;
                mesh.normals[index] = du.cross(dv).normalize_or(mesh.normals[index]);
            }
        }
        for row in 0..self.rows {
            for column in 0..self.columns {
                let corner = |r: usize, c: usize| (first + (row + r) * stride + column + c) as u32;
                mesh.triangles.push([corner(0, 0), corner(0, 1), corner(1, 1)]);
                mesh.triangles.push([corner(0, 0), corner(1, 1), corner(1, 0)]);
            }
        }
    }

    /// Position, direction and normal of the midrib at the height `y` from the joint, in heights of the texture.
    fn spine(&self, pose: &Pose, along: Vec3, up: Vec3, y: f32) -> (Vec3, Vec3, Vec3) {
        let angle = |y: f32| {
            let t = y / self.length;
            pose.bend * (t * (1.0 - pose.late) + pose.late * t * t.abs())
        };
        let steps = 24;
        let mut position = pose.joint;
        for step in 0..steps {
            let middle = angle(y * (step as f32 + 0.5) / steps as f32);
            position += (along * middle.cos() - up * middle.sin()) * (pose.height * y / steps as f32);
        }
        let (sin, cos) = angle(y).sin_cos();
        (position, along * cos - up * sin, up * cos + along * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::super::kinds;
    use super::*;

    #[test]
    fn a_flat_leaf_faces_up_and_has_its_size() {
        let style = kinds::single_leaf(None);
        let grid = BladeGrid::new(&style, 6, 12);
        let mut mesh = PlantMesh::default();
        let flat = Pose { height: 0.2, bend: 0.0, fold: 0.0, curl: 0.0, ..Pose::default() };
        grid.add(&mut mesh, &flat);
        assert!(mesh.is_whole());
        assert_eq!(mesh.triangles.len(), 2 * 6 * 12);
        assert!(mesh.normals.iter().all(|normal| normal.y > 0.99));
        for &[a, b, c] in &mesh.triangles {
            let [a, b, c] = [a, b, c].map(|corner| mesh.positions[corner as usize]);
            assert!((b - a).cross(c - a).y >= 0.0);
        }
        let (low, high) = mesh.positions.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.z), h.max(p.z)));
        assert!((high - low - 0.2).abs() < 0.01, "{low} {high}");
    }

    #[test]
    fn a_bent_leaf_hangs_and_stays_as_long() {
        let style = kinds::single_leaf(None);
        let grid = BladeGrid::new(&style, 4, 40);
        let mut mesh = PlantMesh::default();
        let bent = Pose { height: 1.0, bend: 1.5, fold: 0.2, curl: 0.1, waves: (0.02, 3.0), ..Pose::default() };
        grid.add(&mut mesh, &bent);
        assert!(mesh.is_whole());
        let middle: Vec<Vec3> = (0..=40).map(|row| mesh.positions[row * 5 + 2]).collect();
        let length: f32 = middle.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        assert!((length - 1.0).abs() < 0.03, "{length}");
        assert!(middle[40].y < -0.3, "{}", middle[40]);
    }
}
