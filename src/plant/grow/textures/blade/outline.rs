//! The rim of a leaf as a polygon.

use std::f32::consts::{PI, TAU};

use glam::Vec2;

use crate::math::smoothstep;

/// Corners on each side.
const STEPS: usize = 240;
/// Bands of rows, each with the edges of the polygon near it.
const BANDS: usize = 64;
/// Distance from the rim, in heights of the texture, beyond which it does not matter how far it is.
pub(super) const NEAR_RIM: f32 = 0.06;

/// A closed polygon in texture coordinates, and where the petiole joins.
#[derive(Clone, Debug)]
pub(in crate::plant::grow) struct Outline {
    /// The corners, in order around the leaf.
    pub corners: Vec<Vec2>,
    /// Where the petiole joins.
    pub joint: Vec2,
    /// Where the midrib ends.
    pub tip: Vec2,
}

impl Outline {
    /// A leaf of the half widths `half(t)` in widths of the texture, at the fractions `t` of its length from the base;
    /// the midrib is upright.
    fn upright(half: impl Fn(f32) -> f32) -> Self {
        let (base, tip) = (0.985, 0.015);
        let at = |side: f32, i: usize| {
            // Denser at both ends.
            let t = 0.5 - 0.5 * (PI * i as f32 / STEPS as f32).cos();
            Vec2::new(0.5 + side * half(t).clamp(0.0, 0.49), base + (tip - base) * t)
        };
        let left = (0..=STEPS).map(|i| at(-1.0, i));
        let right = (1..STEPS).rev().map(|i| at(1.0, i));
        Self { corners: left.chain(right).collect(), joint: Vec2::new(0.5, base), tip: Vec2::new(0.5, tip) }
    }

    /// Broad with a drawn-out tip and saw teeth, as of a lime or a pear.
    pub fn ovate() -> Self {
        Self::upright(|t| {
            let body = (PI * t.powf(0.80)).sin().max(0.0).powf(0.86);
            let tip = 1.0 - 0.42 * smoothstep(0.58, 0.96, t);
            // They point to the tip.
            let teeth = (t * 46.0).fract();
            0.475 * body * tip * (1.0 - 0.030 * teeth * smoothstep(0.06, 0.2, t))
        })
    }

    /// A long oval with a short point, as of a rubber plant.
    pub fn elliptic() -> Self {
        Self::upright(|t| {
            let body = (PI * t.powf(0.94)).sin().max(0.0).powf(0.68);
            0.47 * body * (1.0 - 0.40 * smoothstep(0.70, 1.0, t))
        })
    }

    /// A small oval with a long drip tip, as of a weeping fig.
    pub fn drip_tip() -> Self {
        Self::upright(|t| {
            let body = (PI * t.powf(0.72)).sin().max(0.0).powf(0.78);
            0.47 * body * (1.0 - 0.62 * smoothstep(0.58, 0.90, t))
        })
    }

    /// A strap that narrows to its tip, as of a spider plant.
    pub fn strap() -> Self {
        Self::upright(|t| {
            let foot = 0.62 + 0.38 * smoothstep(0.0, 0.25, t);
            0.47 * foot * (1.0 - t.powf(3.2)).max(0.0).powf(0.8)
        })
    }

    /// A lopsided heart with a toothed rim, as of a begonia.
    pub fn lopsided_heart() -> Self {
        let joint = Vec2::new(0.46, 0.605);
        let count = 3 * STEPS;
        let radius = |angle: f32| {
            // The angle runs from the tip, clockwise; the notch is opposite.
            let from_notch = (angle - PI).abs();
            let notch = 1.0 - 0.82 * (-(from_notch / 0.26).powi(2)).exp();
            let tip = 1.0 + 0.46 * (-(angle.min(TAU - angle) / 0.34).powi(2)).exp();
            let lobe = 1.0 + 0.12 * angle.sin() + 0.12 * (-angle.cos()).max(0.0);
            let turn = angle / TAU;
            let teeth = 1.0 + 0.016 * (TAU * 15.0 * turn).sin() + 0.010 * (TAU * 53.0 * turn).sin();
            0.325 * notch * tip * lobe * teeth
        };
        let lean = 0.10;
        let at = |angle: f32| joint + radius(angle) * Vec2::new(1.1 * (angle + lean).sin(), -(angle + lean).cos());
        let corners = (0..count).map(|i| at(TAU * i as f32 / count as f32));
        let corners = corners.map(|corner| corner.clamp(Vec2::splat(0.012), Vec2::splat(0.988))).collect();
        Self { corners, joint, tip: joint.lerp(at(0.0), 0.98) }
    }

    /// Finds the edges near each row.
    pub(super) fn rim(&self, scale: Vec2) -> Rim {
        let count = self.corners.len();
        let edges = (0..count).map(|i| [self.corners[i], self.corners[(i + 1) % count]]);
        let mut bands = vec![Vec::new(); BANDS];
        for edge in edges {
            let (low, high) = (edge[0].y.min(edge[1].y) - NEAR_RIM, edge[0].y.max(edge[1].y) + NEAR_RIM);
            let band = |y: f32| (y * BANDS as f32).clamp(0.0, BANDS as f32 - 1.0) as usize;
            bands[band(low)..=band(high)].iter_mut().for_each(|edges| edges.push(edge));
        }
        Rim { bands, scale }
    }
}

/// A polygon whose edges are sorted by rows.
pub(super) struct Rim {
    bands: Vec<Vec<[Vec2; 2]>>,
    scale: Vec2,
}

impl Rim {
    /// Distance to the rim in units of `scale` times texture coordinates, positive inside, at most [`NEAR_RIM`].
    pub fn distance(&self, uv: Vec2) -> f32 {
        let (mut nearest, mut inside) = (NEAR_RIM * NEAR_RIM, false);
        for &[a, b] in &self.bands[(uv.y * BANDS as f32).clamp(0.0, BANDS as f32 - 1.0) as usize] {
            if (a.y > uv.y) != (b.y > uv.y) && uv.x < a.x + (uv.y - a.y) / (b.y - a.y) * (b.x - a.x) {
                inside = !inside;
            }
            let (edge, to) = ((b - a) * self.scale, (uv - a) * self.scale);
            let t = (to.dot(edge) / edge.length_squared().max(1e-12)).clamp(0.0, 1.0);
            nearest = nearest.min(to.distance_squared(edge * t));
        }
        if inside { nearest.sqrt() } else { -nearest.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_hold_their_midrib_and_stay_inside_the_texture() {
        for outline in
            [Outline::ovate(), Outline::elliptic(), Outline::drip_tip(), Outline::strap(), Outline::lopsided_heart()]
        {
            for corner in &outline.corners {
                assert!(corner.min_element() > 0.0 && corner.max_element() < 1.0, "{corner}");
            }
            for step in 1..20 {
                let at = outline.joint.lerp(outline.tip, 0.05 * step as f32);
                assert!(outline.rim(Vec2::ONE).distance(at) > 0.0, "{at}");
            }
            assert_eq!(outline.rim(Vec2::ONE).distance(Vec2::ZERO), -NEAR_RIM);
        }
    }
}
