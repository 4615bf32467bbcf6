//! Sun textures of crosses: how much of the sun's light the leaves of a texel show, for every sun above the horizon.
//!
//! What makes a far crown look like a crown is its own shade: clumps in the sun beside gaps in the dark. Shadow maps are too
//! coarse for it, and the planes of a cross do not lie where the leaves were. So a texel has it, as a function of the
//! direction to the sun: the lighting texture of [Franzke 2005, 4.3.3] for a sun instead of a sky.
//!
//! For a sample of a texel, with `V(w)` the visibility of the direction `w` behind the plant's other leaves:
//!
//! ```text
//!  S(w) = (V(w) (d max(n.w, 0) + t max(-n.w, 0)) + pi (1 + t) I(w)) / (d + t)
//!  radiance under the sun = base colour (d + t) E / pi S(w), and the gloss
//! ```
//!
//! `n` points towards the viewer. `d` and `t` are shares of the base colour (luminance): what is reflected diffusely, the rest of which is the
//! gloss ([`crate::plant::Gloss`]), and what comes through. `I` is the light that other leaves scatter to the sample, of a plant that is
//! lit by transfer ([`crate::bake::lighting::transfer::indirect_sun_share`]); as the light of the sky, it is reflected with all of the base
//! colour. Its colour is taken to be that of the light itself.
//!
//! Averaged over leaves, `S` is smooth in `w`, and eight polynomials over the hemisphere hold it ([`basis`]), fitted by least
//! squares to [`DIRECTIONS`] directions. A sun below the horizon needs none, so half of the sphere is all that is fitted.
//! The other trees' shade is not in it: the shadow map adds that, looked up where the light enters the crown.
//!
//! Cost: 8 bytes per texel plus a third for mips: 0.7 MB per plane at 256² texels, and one ray per direction and texel.

use std::f32::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{Mat3, Vec3, Vec4};
use rayon::prelude::*;

use super::{CrossPlane, Image, signed_mips::signed_mips};
use crate::bake::lighting::transfer::indirect_sun_share;
use crate::math::{MipChain, cholesky, hammersley};
use crate::plant::Plant;
use crate::trace::PlantTracer;

/// The value of a byte of 255. A leaf that faces the sun without any other has a first coefficient of 0.5 at most.
pub const SUN_SCALE: f32 = 0.5;

/// Functions of the basis.
pub const SUN_FUNCTIONS: usize = 8;

/// Directions of the sun that are traced.
const DIRECTIONS: usize = 64;

/// Distance between a sample and the origin of its rays, as a fraction of the plant's extent.
const START: f32 = 1.0 / 65_536.0;

/// The basis over the hemisphere for a sun in the direction `(right, up, front)`, where `up` is the zenith: the second-order
/// polynomials on the sphere but for the zonal one. The twin of `sunlight` in `shaders/forest/cross.wgsl`.
pub fn basis(direction: Vec3) -> [f32; SUN_FUNCTIONS] {
    let Vec3 { x, y, z } = direction;
    let high = 2.0 * y - 1.0;
    [1.0, high, x, z, x * high, z * high, x * z, x * x - z * z]
}

/// The axes in which a plane's basis is: right, zenith and front; for a level plane, whose front is the zenith, its up is
/// the third. As rows, so that it takes directions of the plant's frame there.
pub(super) fn axes(plane: &CrossPlane) -> Mat3 {
    let frame = plane.frame();
    let [right, up, front] = [frame.x_axis, frame.y_axis, frame.z_axis];
    let level = plane.normal.y.abs() > 0.5;
    let (zenith, front) = if level { (front, up) } else { (up, front) };
    Mat3::from_cols(right, zenith, front).transpose()
}

/// A point of the plant that a texel shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Metres, in the plant's frame.
    pub position: Vec3,
    /// Unit length, towards the viewer.
    pub normal: Vec3,
    /// Luminance of what is reflected diffusely, as a share of the base colour, 0..1.
    pub diffuse: f32,
    /// Luminance of the light that comes through, as a share of the base colour.
    pub transmission: f32,
    /// The sun's light that other leaves scatter to it ([`super::light::VertexLight::indirect_sun`]).
    pub indirect: Vec4,
}

impl Sample {
    fn shown(&self, sun: Vec3) -> f32 {
        let cosine = self.normal.dot(sun);
        let shown = (self.diffuse * cosine.max(0.0) + self.transmission * (-cosine).max(0.0)) / self.both();
        if shown.is_finite() { shown } else { 0.0 }
    }

    /// What it shows of the light that other leaves scatter, at most 1.
    fn scattered(&self, sun: Vec3) -> f32 {
        let [x, y, z, w] = self.indirect.to_array();
        let shown = PI * indirect_sun_share(&[w, -x, y, -z], sun) * (1.0 + self.transmission) / self.both();
        if shown.is_finite() { shown.min(1.0) } else { 0.0 }
    }

    /// Of the light on both of its sides.
    fn both(&self) -> f32 {
        (self.diffuse + self.transmission).max(1e-3)
    }
}

/// The coefficients of each sample of each plane.
pub(super) fn coefficients(plant: &Arc<Plant>, planes: &[CrossPlane], samples: &[Vec<Sample>]) -> Vec<Vec<[Vec4; 2]>> {
    let suns = suns();
    let Some(weights) = weights() else {
        return samples.iter().map(|list| vec![[Vec4::ZERO; 2]; list.len()]).collect();
    };
    let tracer = PlantTracer::new(plant);
    let extent = tracer.bounds().map_or(0.0, |bounds| bounds.size().max_element());
    let start = START * extent;
    let of_plane = |(plane, samples): (&CrossPlane, &Vec<Sample>)| -> Vec<[Vec4; 2]> {
        let to_basis = axes(plane);
        let from_basis = to_basis.transpose();
        let lines = tracer.parallel(samples.iter().map(|sample| sample.position));
        let hidden: Vec<Vec<bool>> = suns
            .par_iter()
            .map(|&sun| {
                let mut hidden = vec![false; samples.len()];
                lines.crossings(from_basis * sun, |crossing| {
                    let is_hidden = &mut hidden[crossing.point as usize];
                    *is_hidden |= crossing.t > start && lines.covers(&crossing);
                    if *is_hidden { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                });
                hidden
            })
            .collect();
        let of_sample = |(index, sample): (usize, &Sample)| {
            let mut sum = [0.0f32; SUN_FUNCTIONS];
            for ((sun, hidden), weights) in suns.iter().zip(&hidden).zip(&weights) {
                let sun = from_basis * *sun;
                let shown = sample.scattered(sun) + if hidden[index] { 0.0 } else { sample.shown(sun) };
                sum.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * shown);
            }
            let [a, b, c, d, e, f, g, h] = sum;
            [Vec4::new(a, b, c, d), Vec4::new(e, f, g, h)]
        };
        samples.par_iter().enumerate().map(of_sample).collect()
    };
    planes.iter().zip(samples).map(of_plane).collect()
}

/// The two textures of a plane's coefficients, which are in the order of the image's samples.
pub(super) fn mips(image: &Image, coefficients: &[[Vec4; 2]], resolution: usize) -> [MipChain; 2] {
    [0, 1].map(|half| {
        let mut values = vec![(Vec4::ZERO, 0.0); image.texels.len()];
        for ((texel, _), coefficients) in image.seen.iter().zip(coefficients) {
            let coverage = image.texels[*texel as usize].coverage;
            values[*texel as usize] = (coverage * coefficients[half], coverage);
        }
        signed_mips(values, resolution, SUN_SCALE, Vec4::ZERO)
    })
}

/// The traced directions, evenly spread over the hemisphere, in the axes of the basis.
fn suns() -> Vec<Vec3> {
    let count = DIRECTIONS as u64;
    (0..count)
        .map(|index| {
            let point = hammersley(index, count);
            let y = point.x + 0.5 / count as f64;
            let (sin, cos) = (std::f64::consts::TAU * point.y).sin_cos();
            let across = (1.0 - y * y).max(0.0).sqrt();
            Vec3::new((across * sin) as f32, y as f32, (across * cos) as f32)
        })
        .collect()
}

/// What the value in each direction adds to each coefficient: the pseudo-inverse of the basis at the traced directions.
fn weights() -> Option<Vec<[f32; SUN_FUNCTIONS]>> {
    let rows: Vec<[f64; SUN_FUNCTIONS]> = suns().into_iter().map(|sun| basis(sun).map(f64::from)).collect();
    let mut normal = vec![0.0; SUN_FUNCTIONS * SUN_FUNCTIONS];
    for (i, row) in (0..SUN_FUNCTIONS).flat_map(|i| rows.iter().map(move |row| (i, row))) {
        (0..SUN_FUNCTIONS).for_each(|j| normal[i * SUN_FUNCTIONS + j] += row[i] * row[j]);
    }
    let factor = cholesky::cholesky(normal, SUN_FUNCTIONS)?;
    let solved = rows.into_iter().map(|mut row| {
        cholesky::solve(&factor, SUN_FUNCTIONS, &mut row);
        row.map(|weight| weight as f32)
    });
    Some(solved.collect())
}

#[cfg(test)]
mod tests {
    use super::super::{CrossSettings, planes, render_plane};
    use super::*;
    use crate::bake::lighting::BakedLighting;
    use crate::plant::grow::{GrowParameters, grow};
    use crate::trace::Ray;

    fn toward(azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let (height, across) = elevation_deg.to_radians().sin_cos();
        Vec3::new(across * sin, height, across * cos)
    }

    #[test]
    fn the_fit_gives_back_what_the_basis_holds() {
        let (suns, weights) = (suns(), weights().unwrap());
        let wanted = [0.3, -0.1, 0.2, 0.05, 0.1, -0.2, 0.02, 0.07];
        let value = |sun: Vec3| -> f32 { basis(sun).iter().zip(wanted).map(|(f, c)| f * c).sum() };
        let mut fitted = [0.0; SUN_FUNCTIONS];
        for (sun, weights) in suns.iter().zip(&weights) {
            fitted.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * value(*sun));
        }
        assert!(fitted.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-5), "{fitted:?}");
        assert!(suns.iter().all(|sun| sun.y > 0.0 && sun.is_normalized()));
    }

    #[test]
    fn the_axes_have_the_zenith_in_the_middle() {
        let plant = grow(&GrowParameters::broadleaf(), 1, 5000).unwrap();
        for plane in planes(&plant, 3) {
            let axes = axes(&plane);
            assert!((axes * Vec3::Y).abs_diff_eq(Vec3::Y, 1e-6), "{plane:?}");
            assert!((axes * plane.normal).y.abs() < 1e-6 || plane.normal.y == 1.0, "{plane:?}");
            assert!((axes * axes.transpose()).abs_diff_eq(Mat3::IDENTITY, 1e-6), "{plane:?}");
        }
    }

    /// Blocks of 8 × 8 texels against rays to suns that no fit has seen; a light that does not know where the sun is, is the
    /// control.
    #[test]
    fn clumps_of_a_crown_are_as_bright_as_rays_say() {
        for parameters in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
            let plant = Arc::new(grow(&parameters, 1, 5000).unwrap());
            let tracer = PlantTracer::new(&plant);
            let planes = planes(&plant, 2);
            let settings = CrossSettings { resolution: 64, supersampling: 2, ..CrossSettings::default() };
            let images: Vec<Image> =
                planes.iter().map(|p| render_plane(&plant, &BakedLighting::Local, None, p, &settings)).collect();
            let samples: Vec<Vec<Sample>> = images.iter().map(Image::samples).collect();
            let all = coefficients(&plant, &planes, &samples);
            let start = 1e-4 * tracer.bounds().unwrap().size().max_element();
            let mut light = [0.0f64; 2];
            let (mut error, mut control, mut square) = (0.0f64, 0.0f64, 0.0f64);
            for (azimuth, elevation) in [(20.0, 8.0), (140.0, 20.0), (260.0, 40.0), (75.0, 63.0)] {
                let sun = toward(azimuth, elevation);
                for (image, (plane, coefficients)) in images.iter().zip(planes.iter().zip(&all)) {
                    let functions = basis(axes(plane) * sun);
                    // Sums of light by the texture, by rays, by the mean over all suns; and of coverage.
                    let mut blocks = [[0.0f64; 4]; 64];
                    for ((texel, sample), coefficients) in image.seen.iter().zip(coefficients) {
                        let texel = *texel as usize;
                        let coverage = f64::from(image.texels[texel].coverage);
                        let [low, high] = coefficients.map(|c| c.to_array());
                        let by_texture: f32 = low.iter().chain(&high).zip(functions).map(|(c, f)| c * f).sum();
                        let origin = sample.position + start * sun;
                        let ray = Ray { origin, direction: sun, t_max: f32::INFINITY };
                        let by_rays = if tracer.occluded(&ray) { 0.0 } else { sample.shown(sun) };
                        let block = &mut blocks[texel / 64 / 8 * 8 + texel % 64 / 8];
                        let values = [by_texture, by_rays, low[0], 1.0];
                        block.iter_mut().zip(values).for_each(|(sum, value)| *sum += coverage * f64::from(value));
                    }
                    for [by_texture, by_rays, mean, coverage] in blocks.into_iter().filter(|block| block[3] > 4.0) {
                        light[0] += by_texture;
                        light[1] += by_rays;
                        error += (by_texture - by_rays).powi(2) / coverage;
                        control += (mean - by_rays).powi(2) / coverage;
                        square += by_rays.powi(2) / coverage;
                    }
                }
            }
            let ratio = light[0] / light[1];
            let [error, control] = [error, control].map(|sum| (sum / square).sqrt());
            assert!((0.93..1.07).contains(&ratio), "{ratio} of the light");
            assert!(error < 0.35 && error < 0.6 * control, "relative RMSE {error}, without direction {control}");
        }
    }

    #[test]
    fn a_lone_leaf_is_lit_from_both_sides() {
        let leaf =
            Sample { position: Vec3::ZERO, normal: Vec3::Z, diffuse: 1.0, transmission: 0.5, indirect: Vec4::ZERO };
        assert!((leaf.shown(Vec3::Z) - 1.0 / 1.5).abs() < 1e-6);
        assert!((leaf.shown(-Vec3::Z) - 0.5 / 1.5).abs() < 1e-6);
        let broken = Sample { transmission: f32::INFINITY, ..leaf };
        assert_eq!(broken.shown(Vec3::Z), 0.0);
        let black = Sample { diffuse: 0.0, transmission: 0.0, ..leaf };
        assert_eq!((black.shown(Vec3::Z), black.scattered(Vec3::Z)), (0.0, 0.0));
    }

    /// Of a glossy leaf, the lobe has a part of the direct light, and nothing of what other leaves scatter.
    #[test]
    fn gloss_takes_nothing_of_scattered_light() {
        let indirect = Vec4::new(0.0, 0.0, 0.0, 0.2);
        let matt = Sample { position: Vec3::ZERO, normal: Vec3::Z, diffuse: 1.0, transmission: 0.4, indirect };
        let glossy = Sample { diffuse: 0.5, ..matt };
        let radiance = |sample: &Sample, shown: f32| (sample.diffuse + sample.transmission) * shown;
        for sun in [Vec3::Z, -Vec3::Z, Vec3::Y, Vec3::new(0.6, 0.0, 0.8)] {
            let [all, less] = [&matt, &glossy].map(|sample| radiance(sample, sample.scattered(sun)));
            assert!((all - less).abs() < 1e-6, "{all} and {less}");
            let [all, less] = [&matt, &glossy].map(|sample| radiance(sample, sample.shown(sun)));
            let gloss = 0.5 * sun.z.max(0.0);
            assert!((all - less - gloss).abs() < 1e-6, "{all} and {less}");
        }
    }

    /// What other leaves scatter is shown in the shade too, and from the side that it comes from.
    #[test]
    fn scattered_light_is_added() {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000).unwrap());
        let planes = planes(&plant, 1);
        let dark = Sample { position: Vec3::Y, normal: Vec3::Z, diffuse: 1.0, transmission: 0.0, indirect: Vec4::ZERO };
        let lit = Sample { indirect: Vec4::new(0.0, 0.05, 0.0, 0.2), ..dark };
        let found = coefficients(&plant, &planes, &[vec![dark, lit], vec![]]);
        for (azimuth, elevation) in [(10.0, 15.0), (200.0, 40.0), (90.0, 85.0)] {
            let sun = toward(azimuth, elevation);
            let functions = basis(axes(&planes[0]) * sun);
            let value = |index: usize| -> f32 {
                let [low, high] = found[0][index].map(|c: Vec4| c.to_array());
                low.iter().chain(&high).zip(functions).map(|(c, f)| c * f).sum()
            };
            let wanted = PI * (0.282_094_8 * 0.2 + 0.488_602_5 * 0.05 * sun.y);
            assert!((value(1) - value(0) - wanted).abs() < 1e-5, "{} for {wanted}", value(1) - value(0));
        }
        let broken = Sample { indirect: Vec4::NAN, ..dark };
        assert_eq!(broken.scattered(Vec3::Y), 0.0);
        assert_eq!(Sample { indirect: Vec4::splat(1e30), ..dark }.scattered(Vec3::Y), 1.0);
    }

    #[test]
    fn an_empty_plant_has_no_light() {
        let plant = Arc::new(Plant::default());
        let planes = planes(&plant, 2);
        let none = coefficients(&plant, &planes, &[vec![], vec![], vec![]]);
        assert!(none.len() == 3 && none.iter().all(Vec::is_empty));
    }
}
