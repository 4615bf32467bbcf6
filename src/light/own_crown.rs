//! How much of the sky a tree's own crown leaves, and which part: what its neighbours hide counts only there.
//!
//! A trunk sees no zenith behind its own crown, and what it sees, the horizon, its neighbours hide most. A leaf at the rim of
//! the crown sees the zenith. So the neighbours' transmittance for the light of the sky is a mean over the directions that
//! the own crown leaves open. The product of two means, over all directions each, gives trunks in a dense wood ten times
//! their light of the sky and more.
//!
//! The own crown is the cylinder of the stand's mean tree, filled evenly: seen straight up, all of it hides as much as
//! crowns do. Places are means over the disc at a depth, for leaves, or the axis, for trunks.

use std::f32::consts::PI;

/// Discs of equal area, and directions across each.
const DISCS: usize = 3;
const SECTORS: usize = 4;

/// Where light from an elevation enters the own crown on its way to a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Entry {
    /// Fraction of the light that the own crown lets through from there to the place.
    pub transmittance: f32,
    /// Depth in the stand at which it enters, not below 0.
    pub depth: f32,
}

/// A tree's crown: a cylinder from the tops downwards, in units of the tree's height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnCrown {
    /// Its radius.
    pub radius: f32,
    /// Its length.
    pub length: f32,
    /// Extinction of the light inside of it.
    pub extinction: f32,
}

impl OwnCrown {
    /// Entries of light from an elevation of this tangent that goes to leaves at `depth`.
    pub fn entries_of_leaves(&self, depth: f32, tangent: f32) -> impl Iterator<Item = Entry> {
        let crown = *self;
        let places = (0..DISCS).flat_map(|disc| (0..SECTORS).map(move |sector| (disc, sector)));
        places.map(move |(disc, sector)| {
            let out = crown.radius * ((disc as f32 + 0.5) / DISCS as f32).sqrt();
            let (sin, cos) = (PI * (sector as f32 + 0.5) / SECTORS as f32).sin_cos();
            let to_rim = (crown.radius.powi(2) - (out * sin).powi(2)).max(0.0).sqrt() - out * cos;
            crown.entry(depth, tangent, to_rim)
        })
    }

    /// The entry of light that goes to the trunk at `depth`.
    pub fn entry_of_trunk(&self, depth: f32, tangent: f32) -> Entry {
        self.entry(depth, tangent, self.radius)
    }

    /// `to_rim`: horizontal distance to the side of the cylinder.
    fn entry(&self, depth: f32, tangent: f32, to_rim: f32) -> Entry {
        // Steeper than this is straight up.
        let tangent = tangent.clamp(1e-3, 1e4);
        let below = (depth - self.length).max(0.0) / tangent;
        let inside = (to_rim.min(depth / tangent) - below).max(0.0);
        let path = inside * (1.0 + tangent * tangent).sqrt();
        Entry { transmittance: (-self.extinction * path).exp(), depth: (depth - to_rim * tangent).max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CROWN: OwnCrown = OwnCrown { radius: 0.25, length: 0.7, extinction: 3.6 };

    #[test]
    fn below_the_crown_the_horizon_is_open_and_the_zenith_is_not() {
        let steep = CROWN.entry_of_trunk(1.0, 50.0);
        assert!((steep.transmittance - (-3.6f32 * 0.7).exp()).abs() < 0.01 && steep.depth == 0.0, "{steep:?}");
        let low = CROWN.entry_of_trunk(1.0, 0.2);
        assert!(low.transmittance == 1.0 && (low.depth - 0.95).abs() < 1e-6, "{low:?}");
    }

    #[test]
    fn the_top_sees_everything() {
        for tangent in [0.0, 0.5, 100.0, f32::INFINITY] {
            assert_eq!(CROWN.entry_of_trunk(0.0, tangent), Entry { transmittance: 1.0, depth: 0.0 });
        }
    }

    #[test]
    fn leaves_at_the_rim_see_more_than_those_inside() {
        let entries: Vec<f32> = CROWN.entries_of_leaves(0.3, 0.7).map(|entry| entry.transmittance).collect();
        let (least, most) = entries.iter().fold((1f32, 0f32), |(low, high), value| (low.min(*value), high.max(*value)));
        assert!(least < 0.5 && most > 0.8, "{least} to {most}");
        assert!(entries.iter().all(|value| (0.0..=1.0).contains(value)));
    }
}
