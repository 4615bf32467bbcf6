//! Which plants share a layer of watercolour.
//!
//! [Luft 2006, 3.1] lets the user give objects an identifier. A scene of many species gets one without being asked: plants
//! whose leaves have nearly the same colour share a layer, as a painter mixes one pigment for them.

use glam::Vec3;

use crate::math::luminance;

/// Identifier of the sky.
pub const SKY: u8 = 0;
/// Identifier of the ground.
pub const GROUND: u8 = 1;
/// Identifier of wood.
pub const WOOD: u8 = 2;
/// Identifier of the first layer of foliage.
pub const FIRST_FOLIAGE: u8 = 3;
/// Most layers of foliage: an identifier is one byte.
pub const MOST_FOLIAGE: usize = 252;

/// Distance of two colours at which they are mixed apart.
const APART: f32 = 0.05;

/// The layer of foliage (0, 1, ...) of each plant by the mean linear colour of its leaves, at most `most` layers (at least
/// one). The first plant has layer 0. The numbers of plants do not depend on those that follow.
pub fn foliage_groups(colors: &[Vec3], most: usize) -> Vec<u8> {
    let mut kinds: Vec<Vec3> = Vec::new();
    let most = most.clamp(1, MOST_FOLIAGE);
    let mut groups = Vec::with_capacity(colors.len());
    for color in colors {
        let hue = pigment(*color);
        let near = |kind: &Vec3| kind.distance(hue);
        let nearest = kinds.iter().enumerate().min_by(|a, b| near(a.1).total_cmp(&near(b.1)));
        let group = match nearest {
            Some((index, kind)) if near(kind) < APART || kinds.len() >= most => index,
            _ => {
                kinds.push(hue);
                kinds.len() - 1
            }
        };
        groups.push(group as u8);
    }
    groups
}

/// Hue and brightness of a colour, in which equal distances are about equally different: chromaticity, and the cube root of the
/// luminance.
fn pigment(color: Vec3) -> Vec3 {
    let color = if color.is_finite() { color.max(Vec3::ZERO) } else { Vec3::ZERO };
    let sum = color.element_sum().max(1e-6);
    Vec3::new(color.x / sum, color.y / sum, luminance(color).cbrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const BROADLEAF: Vec3 = Vec3::new(0.065, 0.127, 0.033);
    const CONIFER: Vec3 = Vec3::new(0.03, 0.05, 0.035);
    const AUTUMN: Vec3 = Vec3::new(0.277, 0.172, 0.032);

    #[test]
    fn plants_of_one_colour_share_a_layer_and_others_do_not() {
        let colors = [BROADLEAF, BROADLEAF * 1.05, CONIFER, AUTUMN, CONIFER];
        assert_eq!(foliage_groups(&colors, 8), [0, 0, 1, 2, 1]);
        assert_eq!(foliage_groups(&colors, 1), [0; 5]);
        // More than there is room for: the nearest layer is taken.
        assert_eq!(foliage_groups(&colors, 2), [0, 0, 1, 0, 1]);
        assert!(foliage_groups(&[], 8).is_empty());
        assert_eq!(foliage_groups(&[Vec3::NAN, Vec3::ZERO], 8), [0, 0]);
    }

    #[test]
    fn more_than_64_colours_have_more_than_64_layers() {
        let colors: Vec<Vec3> = (0..1000u16)
            .map(|i| Vec3::new(f32::from(i % 10), f32::from(i / 10 % 10), f32::from(i / 100)) / 9.0 + 0.01)
            .collect();
        let most = foliage_groups(&colors, 1000).into_iter().max().unwrap_or(0);
        assert!((64..MOST_FOLIAGE as u8).contains(&most), "{most}");
    }
}
