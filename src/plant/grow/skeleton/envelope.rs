//! The outline of a crown: the envelope that prunes it (Weber & Penn 1995, 4.6), and the differences between its sides.

use glam::Vec3;

use super::Grower;

/// A wave around the crown that makes its sides differ.
pub(super) struct Side {
    pub waves: f32,
    pub phase: f32,
    pub twist: f32,
    pub weight: f32,
}

impl Grower<'_> {
    /// Whether a point is outside the envelope of 4.6, widened by `slack`. The envelope lies around the middle between
    /// the trunk and the vertical axis of the paper, so that a bent tree keeps its top. The sides of the crown differ.
    pub(super) fn is_outside(&self, point: Vec3, slack: f32) -> bool {
        self.species.pruning.is_some_and(|pruning| {
            let ratio = (self.height - point.y) / (self.height * (1.0 - self.species.trunk.bare));
            let above = self.axis.partition_point(|p| p.y < point.y).min(self.axis.len() - 1);
            let (low, high) = (self.axis[above.saturating_sub(1)], self.axis[above]);
            let t = ((point.y - low.y) / (high.y - low.y).max(1e-3)).clamp(0.0, 1.0);
            let out = (point - 0.5 * low.lerp(high, t)) * Vec3::new(1.0, 0.0, 1.0);
            out.length() > slack * self.height * pruning.radius(ratio) * self.side(out, ratio)
        })
    }

    /// Factor on the length of the boughs on one side of the crown.
    pub(super) fn side(&self, direction: Vec3, ratio: f32) -> f32 {
        let azimuth = direction.x.atan2(direction.z);
        let (sum, weights) = self.sides.iter().fold((0.0, 0.0), |(sum, weights), side| {
            let wave = (side.waves * azimuth + side.phase + side.twist * ratio).sin();
            (sum + side.weight * wave, weights + side.weight)
        });
        1.0 + self.species.irregularity * sum / weights
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::random::Random;
    use super::super::super::{GrowParameters, Pruning};
    use super::super::grow;

    #[test]
    fn pruned_tips_stay_in_the_envelope() {
        let mut species = GrowParameters::broadleaf();
        species.pruning = Some(Pruning { width: 0.12, width_peak: 0.4, power_low: 0.5, power_high: 0.5 });
        species.irregularity = 0.0;
        species.lean_deg = 0.0;
        species.trunk.curve_variation_deg = 0.0;
        species.trunk.splits = 0.0;
        species.branches.truncate(1);
        let skeleton = grow(&species, &Random::new(11));
        assert!(skeleton.stems.len() > 10);
        let widest = 0.12 * species.height * skeleton.scale;
        let radii = skeleton.stems[1..]
            .iter()
            .filter_map(|stem| stem.nodes.last())
            .map(|tip| tip.position.x.hypot(tip.position.z));
        let reached = radii.fold(0.0, f32::max);
        assert!(reached <= 1.16 * widest + 0.01 && reached > 0.7 * widest, "{reached} of {widest}");
    }
}
