//! Colours for texels that nobody sees.

use image::RgbaImage;

use super::distance::nearest_sites;

/// Share of the image's largest alpha from which on a texel's colour is surely the leaf's own.
const SOLID: f32 = 0.93;
/// Share of the image's largest alpha from which on a texel is part of a leaf.
const VISIBLE: f32 = 0.5;
/// A visible texel takes the colour of a solid one that is at most this many texels away.
const REACH: f32 = 3.0;

/// Gives every transparent texel the colour of the nearest opaque one, so that filtering mixes no foreign colour
/// into a leaf's edge (no halo). Alpha stays as it is.
///
/// The texels of an antialiased edge are often blended with the background from which the leaf was cut out, so those
/// below 93 % of the image's largest alpha count as transparent too, unless nothing more solid is within 3 texels: a
/// needle that is thinner than a texel keeps the colour of its own texels from 50 % on. An image without any alpha
/// stays as it is.
pub fn dilate_colors(image: &mut RgbaImage) {
    let alphas: Vec<f32> = image.as_raw().chunks_exact(4).map(|texel| f32::from(texel[3])).collect();
    let largest = alphas.iter().copied().fold(0.0, f32::max);
    if largest == 0.0 {
        return;
    }
    let width = image.width() as usize;
    let solid: Vec<bool> = alphas.iter().map(|&alpha| alpha >= SOLID * largest).collect();
    if solid.iter().all(|&solid| solid) {
        return;
    }
    let to_solid = nearest_sites(&solid, width);
    let source = |at: usize| {
        let far = || to_solid.distance(at % width, at / width) > REACH;
        solid[at] || (alphas[at] >= VISIBLE * largest && far())
    };
    let sources: Vec<bool> = (0..alphas.len()).map(source).collect();
    let sites = nearest_sites(&sources, width);
    let colors = image.as_raw().clone();
    for (texel, site) in image.chunks_exact_mut(4).zip(&sites.nearest) {
        if let Some([x, y]) = *site {
            let at = 4 * (y as usize * width + x as usize);
            texel[..3].copy_from_slice(&colors[at..at + 3]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgba;

    #[test]
    fn a_white_matte_goes_and_a_lone_thin_needle_stays() {
        // A solid leaf with a matted edge on the left, a needle of 60 % far to its right.
        let mut image = RgbaImage::from_fn(24, 4, |x, _| match x {
            0..=3 => Rgba([20, 90, 10, 255]),
            4 => Rgba([140, 170, 130, 150]),
            20 => Rgba([60, 40, 20, 155]),
            _ => Rgba([255, 255, 255, 0]),
        });
        dilate_colors(&mut image);
        assert_eq!(*image.get_pixel(4, 1), Rgba([20, 90, 10, 150]));
        assert_eq!(*image.get_pixel(8, 1), Rgba([20, 90, 10, 0]));
        assert_eq!(*image.get_pixel(20, 1), Rgba([60, 40, 20, 155]));
        assert_eq!(*image.get_pixel(23, 1), Rgba([60, 40, 20, 0]));
    }
}
