//! The distance by which a tree's levels are chosen: the true one, divided by the tree's size, with a shift of its own.
//!
//! What counts is how large a tree is in the picture. So the distances of [`Levels`](super::Levels) are those of a tree
//! of [`NOMINAL_HEIGHT`]: a tree half as high changes at half the distance, and has the same size in the picture when it
//! does. A longer focal length has the same effect as coming nearer. The number of pixels has none, so that a small
//! preview shows what a large picture will. Each tree also changes up to 19 % earlier or later than its size asks, by a hash of where it stands: trees of
//! one size would change on a circle around the camera, a front that travels through the wood with it.
//!
//! All in whole numbers, so that the processor, the compute pass and the vertex shaders agree about every tree.
//! `shaders/forest/instance.wgsl` has the same function.

use crate::{
    math::hash,
    scatter::{
        PackedTree,
        packed::{CELL_BITS, SCALE_BITS, SCALE_SHIFT, scale_of_code},
    },
};

/// Height of the trees for which the distances of levels are stated, metres.
pub const NOMINAL_HEIGHT: f32 = 20.0;
/// Vertical field of view of the cameras for which the distances of levels are stated, radians: 50°.
pub const NOMINAL_FIELD_OF_VIEW: f32 = 50.0 * std::f32::consts::PI / 180.0;
/// Factors on distances are multiples of one over this.
pub const FACTOR_ONE: u32 = 256;
/// Smallest factor on a distance: of trees of eight times the nominal height, and higher.
pub const LEAST_FACTOR: u32 = FACTOR_ONE / 8;
/// Largest factor on a distance: of trees of an eighth of the nominal height, and lower.
pub const GREATEST_FACTOR: u32 = FACTOR_ONE * 8;
/// Smallest of the 64 factors of the hash. They are 3/512 apart, 1 in the mean.
pub const LEAST_SHIFT: u32 = 209;

/// One over the height of a plant at scale 1, relative to [`NOMINAL_HEIGHT`] and times [`FACTOR_ONE`].
pub fn inverse_height(height: f32) -> u32 {
    // A conversion saturates, and turns what is not a number into 0.
    let inverse = FACTOR_ONE as f32 * NOMINAL_HEIGHT / height.max(1e-3);
    (inverse.round() as u32).clamp(1, FACTOR_ONE << 12)
}

/// Factor on the distance of a tree, times [`FACTOR_ONE`]: [`LEAST_FACTOR`] to [`GREATEST_FACTOR`].
///
/// `inverse_height` is that of its plant.
pub fn distance_factor(tree: &PackedTree, inverse_height: u32) -> u32 {
    let code = tree.look >> SCALE_SHIFT & SCALE_MASK;
    let inverse_scale = scale_of_code(SCALE_MASK - code);
    let place = hash::mix32(tree.xz ^ hash::mix32(tree.cell & CELL_MASK));
    let shift = LEAST_SHIFT + ((3 * (place >> 26)) >> 1);
    let factor = (inverse_scale * inverse_height / FACTOR_ONE).min(2 * GREATEST_FACTOR) * shift / FACTOR_ONE;
    factor.clamp(LEAST_FACTOR, GREATEST_FACTOR)
}

const SCALE_MASK: u32 = (1 << SCALE_BITS) - 1;
const CELL_MASK: u32 = (1 << (2 * CELL_BITS)) - 1;

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(scale: f32, xz: u32) -> PackedTree {
        let code = ((scale.log2() + 4.0) / 8.0 * 4095.0).round() as u32;
        PackedTree { xz, y: 0.0, cell: 5, look: code << SCALE_SHIFT }
    }

    fn factors(scale: f32, height: f32) -> Vec<f32> {
        (0..4000)
            .map(|place| distance_factor(&tree(scale, place * 104_729), inverse_height(height)) as f32 / 256.0)
            .collect()
    }

    #[test]
    fn trees_of_the_nominal_height_change_at_the_stated_distance_in_the_mean() {
        let factors = factors(1.0, NOMINAL_HEIGHT);
        let mean = factors.iter().sum::<f32>() / factors.len() as f32;
        assert!((mean - 1.0).abs() < 0.01, "{mean}");
        let (least, most) = factors.iter().fold((9f32, 0f32), |(low, high), f| (low.min(*f), high.max(*f)));
        assert!((0.80..0.83).contains(&least) && (1.17..1.20).contains(&most), "{least} to {most}");
    }

    #[test]
    fn a_tree_of_half_the_height_changes_at_half_the_distance() {
        for (scale, height) in [(0.5, 20.0), (1.0, 10.0), (2.0, 5.0)] {
            let mean = factors(scale, height).iter().sum::<f32>() / 4000.0;
            assert!((mean - 2.0).abs() < 0.02, "{scale} of {height} m: {mean}");
        }
    }

    #[test]
    fn extreme_sizes_have_bounded_factors() {
        for height in [0.0, 1e-30, 1e30, f32::NAN, f32::INFINITY, -3.0] {
            for code in [0, SCALE_MASK] {
                let tree = PackedTree { look: code << SCALE_SHIFT, ..PackedTree::default() };
                let factor = distance_factor(&tree, inverse_height(height));
                assert!((LEAST_FACTOR..=GREATEST_FACTOR).contains(&factor), "{height}: {factor}");
            }
        }
    }

    #[test]
    fn neighbours_change_independently() {
        let factors = factors(1.0, NOMINAL_HEIGHT);
        let pairs = factors.windows(2).map(|pair| (pair[0] - 1.0) * (pair[1] - 1.0)).sum::<f32>();
        let squares = factors.iter().map(|factor| (factor - 1.0).powi(2)).sum::<f32>();
        assert!((pairs / squares).abs() < 0.05, "correlation {}", pairs / squares);
    }
}
