//! The veins of a leaf: strokes for the midrib and its branches, cells for the net between them.

use std::f32::consts::PI;

use glam::Vec2;

use super::outline::Rim;
use super::{BladeStyle, Venation};
use crate::math::smoothstep;

/// A piece of a vein, in heights of the texture from the joint, y towards the tip.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: Vec2,
    to: Vec2,
    /// Half widths at both ends.
    radii: [f32; 2],
    /// 0 for main veins, 1 for side veins.
    order: usize,
}

/// Distances of side veins over which tissue rises from a vein, in heights of the texture.
const DOME: f32 = 0.030;

/// The veins at each texel.
pub(super) struct VeinMap {
    /// Main veins, side veins: 1 in the middle, 0 beside them.
    pub lines: [Vec<f32>; 2],
    /// How high the tissue stands between veins: 0 on a vein, 1 far from all.
    pub dome: Vec<f32>,
}

/// Draws the veins of `style`.
pub(super) fn draw(style: &BladeStyle) -> VeinMap {
    let [width, height] = style.size.map(|side| side as usize);
    let mut map =
        VeinMap { lines: [vec![0.0; width * height], vec![0.0; width * height]], dome: vec![1.0; width * height] };
    let texel = 1.0 / height.max(1) as f32;
    for piece in pieces(style) {
        let reach = piece.radii[0].max(piece.radii[1]).max(DOME) + 2.0 * texel;
        let (low, high) = (piece.from.min(piece.to) - reach, piece.from.max(piece.to) + reach);
        // Rows run down, y up.
        let column = |x: f32| (x + style.outline.joint.x * style.aspect()) * height as f32;
        let row = |y: f32| (style.outline.joint.y - y) * height as f32;
        let clamp = |value: f32, most: usize| value.clamp(0.0, most as f32) as usize;
        let edge = piece.to - piece.from;
        for y in clamp(row(high.y), height)..clamp(row(low.y).ceil(), height) {
            for x in clamp(column(low.x), width)..clamp(column(high.x).ceil(), width) {
                let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                let to = style.flat(uv) - piece.from;
                let t = (to.dot(edge) / edge.length_squared().max(1e-12)).clamp(0.0, 1.0);
                let distance = to.distance(edge * t);
                let radius = piece.radii[0] + (piece.radii[1] - piece.radii[0]) * t;
                // A vein thinner than a texel is fainter.
                let line = 1.0 - smoothstep(0.25 * radius, radius.max(texel) + 0.5 * texel, distance);
                let line = line * (2.0 * radius / texel).min(1.0);
                let at = y * width + x;
                let slot = &mut map.lines[piece.order][at];
                *slot = slot.max(line);
                // Wide veins hold down more of the tissue beside them.
                let dome = smoothstep(0.0, DOME, distance - 0.5 * radius);
                map.dome[at] = map.dome[at].min(dome);
            }
        }
    }
    map
}

fn pieces(style: &BladeStyle) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let leaf = Measure::new(style);
    let tip = style.flat(style.outline.tip);
    let mut stroke = |points: &[Vec2], from: f32, to: f32, order: usize| {
        let last = points.len().saturating_sub(1).max(1) as f32;
        for (i, pair) in points.windows(2).enumerate() {
            let radius = |i: usize| from + (to - from) * i as f32 / last;
            pieces.push(Piece { from: pair[0], to: pair[1], radii: [radius(i), radius(i + 1)], order });
        }
    };
    match style.venation {
        Venation::Pinnate { pairs, angle } => {
            let midrib: Vec<Vec2> = (0..=16).map(|i| tip * (i as f32 / 16.0)).collect();
            stroke(&midrib, style.midrib, 0.12 * style.midrib, 0);
            for pair in 0..pairs {
                for side in [-1.0, 1.0] {
                    // The sides alternate a little, and leave closer to each other towards the tip.
                    let share = (pair as f32 + 0.35 + 0.22 * side) / pairs as f32;
                    let start = tip * (0.035 + 0.90 * share.powf(0.92));
                    let rise = 2.4 * tip.y / pairs as f32 + 0.75 * leaf.half_width(start) / angle.tan().max(0.2);
                    let curve = leaf.side_vein(start, side, angle * (1.0 - 0.25 * share), rise);
                    stroke(&curve, 0.42 * style.midrib * (1.0 - 0.45 * share), 0.07 * style.midrib, 1);
                }
            }
        }
        Venation::Palmate { pairs } => {
            let midrib: Vec<Vec2> = (0..=16).map(|i| tip * (i as f32 / 16.0)).collect();
            stroke(&midrib, style.midrib, 0.15 * style.midrib, 0);
            let axis = tip.normalize_or(Vec2::Y);
            let mut rays = vec![(axis, tip.length())];
            for pair in 1..=pairs {
                for side in [-1.0, 1.0] {
                    let turn = side * (0.15 + 0.85 * pair as f32 / pairs as f32) * 0.80 * PI;
                    let ray = Vec2::from_angle(-turn).rotate(axis);
                    let length = leaf.reach(0.02 * ray, ray) + 0.02;
                    let bend = 0.10 * side;
                    let curve: Vec<Vec2> = (0..=12)
                        .map(|i| {
                            let t = i as f32 / 12.0;
                            Vec2::from_angle(bend * t).rotate(ray) * (0.95 * length * t)
                        })
                        .collect();
                    stroke(&curve, 0.75 * style.midrib, 0.12 * style.midrib, 0);
                    rays.push((ray, length));
                }
            }
            // Forks of the main veins.
            for (ray, length) in rays {
                for step in 1..6 {
                    for side in [-1.0, 1.0] {
                        let start = ray * length * (0.06 + 0.145 * (step as f32 + 0.2 * side));
                        let fork = Vec2::from_angle(0.80 * side).rotate(ray);
                        let long = 0.40 * length * (1.0 - 0.13 * step as f32);
                        let curve: Vec<Vec2> = (0..=6)
                            .map(|i| {
                                let t = i as f32 / 6.0;
                                start + Vec2::from_angle(-0.22 * side * t).rotate(fork) * (long * t)
                            })
                            .collect();
                        stroke(&curve, 0.34 * style.midrib, 0.07 * style.midrib, 1);
                    }
                }
            }
        }
        Venation::Parallel { count } => {
            for i in 0..count {
                let across = 2.0 * (i as f32 + 0.5) / count as f32 - 1.0;
                let middle = across.abs() < 0.9 / count as f32;
                let curve: Vec<Vec2> = (0..=40)
                    .map(|step| {
                        let along = tip * (step as f32 / 40.0);
                        along + Vec2::X * (across * leaf.half_width(along) * 0.94)
                    })
                    .collect();
                let radius = if middle { style.midrib } else { 0.30 * style.midrib };
                stroke(&curve, radius, 0.4 * radius, usize::from(!middle));
            }
        }
    }
    pieces
}

/// The leaf, to measure it.
struct Measure<'a> {
    style: &'a BladeStyle,
    rim: Rim,
}

impl<'a> Measure<'a> {
    fn new(style: &'a BladeStyle) -> Self {
        Self { style, rim: style.outline.rim(Vec2::new(style.aspect(), 1.0)) }
    }

    /// Distance from a point to the rim along a unit direction, in heights of the texture: 0 if it is outside.
    fn reach(&self, from: Vec2, direction: Vec2) -> f32 {
        let inside = |distance: f32| {
            let flat = from + direction * distance;
            let joint = self.style.outline.joint;
            let uv = Vec2::new(joint.x + flat.x / self.style.aspect(), joint.y - flat.y);
            self.rim.distance(uv) > 0.0
        };
        let step = 0.02;
        let mut distance = 0.0;
        while distance < 1.2 && inside(distance + step) {
            distance += step;
        }
        let mut outside = distance + step;
        for _ in 0..8 {
            let middle = 0.5 * (distance + outside);
            if inside(middle) { distance = middle } else { outside = middle }
        }
        distance
    }

    /// The leaf's half width at a height of the midrib.
    fn half_width(&self, at: Vec2) -> f32 {
        self.reach(at, Vec2::X)
    }

    /// A side vein: it leaves the midrib at `angle`, bends towards the tip and ends where it has risen by `rise`.
    fn side_vein(&self, start: Vec2, side: f32, angle: f32, rise: f32) -> Vec<Vec2> {
        let mut points = vec![start];
        let mut angle = angle;
        let whole = self.half_width(start + Vec2::Y * 0.04).max(0.02);
        let step = 0.010;
        while points.len() < 90 {
            let next = points[points.len() - 1] + Vec2::new(side * angle.sin(), angle.cos()) * step;
            let left = self.reach(next, Vec2::X * side);
            if left < 0.008 || next.y - start.y > rise {
                break;
            }
            points.push(next);
            // The closer to the rim, the more it follows it.
            let near = 1.0 - (left / whole).clamp(0.0, 1.0);
            angle = (angle - 0.004 - 0.16 * near.powi(6)).max(-0.35);
        }
        points
    }
}
