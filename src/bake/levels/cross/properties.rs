//! The property texture of a cross: normal, ambient visibility, share of foliage.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::Texel;
use crate::math::{MipChain, color::unorm8, octahedral};

/// What a texel of any level holds, weighted with its coverage.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    /// As long as the normals that it stands for agree.
    normal: Vec3,
    ambient: f32,
    foliage: f32,
    coverage: f32,
}

impl Sum {
    /// Faces the viewer, unoccluded: the value of a texture without a plant.
    const OPEN: Self = Self { normal: Vec3::Z, ambient: 1.0, foliage: 1.0, coverage: 1.0 };

    fn code(&self) -> [u8; 4] {
        let normal = octahedral::encode_z(self.normal.try_normalize().unwrap_or(Vec3::Z));
        let [x, y] = (0.5 + 0.5 * normal).to_array();
        let mean = |value: f32| unorm8(value / self.coverage);
        [unorm8(x), unorm8(y), mean(self.ambient), mean(self.foliage)]
    }
}

/// Isotropic fraction summed over the texels of one level: the sum of the weights, and the weighted sum.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::bake::levels) struct IsotropicSum {
    pub weight: f64,
    pub isotropic: f64,
}

/// Isotropic fraction of a mixture of isotropic leaves and leaves that share one normal. `resultant`, 0..1, is the
/// length of the mean normal, where normals are flipped towards the viewer and weighted by projected area. It is 2/3
/// for isotropic leaves and 1 for parallel ones.
fn isotropic_fraction(resultant: f32) -> f32 {
    (3.0 - 3.0 * resultant).clamp(0.0, 1.0)
}

fn isotropic_sum(level: &[Sum]) -> IsotropicSum {
    level.iter().filter(|sum| sum.coverage > 0.0).fold(IsotropicSum::default(), |total, sum| IsotropicSum {
        weight: total.weight + f64::from(sum.foliage),
        isotropic: total.isotropic + f64::from(sum.foliage * isotropic_fraction(sum.normal.length() / sum.coverage)),
    })
}

/// Property mips of a texture of `resolution`² texels (a power of two), and the isotropic fraction level by level.
/// Means are weighted with the coverage, from level to level in floating point, so empty texels have no weight. An
/// empty texel takes the value of the coarser level.
pub(in crate::bake::levels) fn mips(
    texels: &[Texel],
    resolution: usize,
    smoothing: f32,
) -> (MipChain, Vec<IsotropicSum>) {
    let normals = smoothed(texels, resolution, smoothing * resolution as f32);
    let finest = texels.iter().zip(normals).map(|(texel, normal)| Sum {
        normal: texel.coverage * normal,
        ambient: texel.ambient,
        foliage: texel.foliage,
        coverage: texel.coverage,
    });
    let mut levels: Vec<Vec<Sum>> = vec![finest.collect()];
    let mut size = resolution;
    while size > 1 {
        let halved = levels.last().map(|finer| halve(finer, size)).unwrap_or_default();
        levels.push(halved);
        size /= 2;
    }
    let isotropy = levels.iter().map(|level| isotropic_sum(level)).collect();
    // From the coarsest level down: holes are filled from above.
    let mut coded: Vec<Vec<u8>> = Vec::with_capacity(levels.len());
    let mut above: Vec<Sum> = vec![Sum::OPEN];
    for (depth, mut level) in levels.into_iter().rev().enumerate() {
        let size = 1usize << depth;
        for (at, sum) in level.iter_mut().enumerate().filter(|(_, sum)| sum.coverage <= 0.0) {
            *sum = interpolated(&above, (size / 2).max(1), at % size, at / size);
        }
        coded.push(level.iter().flat_map(Sum::code).collect());
        above = level;
    }
    coded.reverse();
    (MipChain { width: resolution as u32, height: resolution as u32, levels: coded }, isotropy)
}

/// What a level of `size`² texels holds at texel (`x`, `y`) of the next finer one, bilinearly, borders continued.
fn interpolated(level: &[Sum], size: usize, x: usize, y: usize) -> Sum {
    // The near texel with three quarters, the one beyond the closer edge with one quarter.
    let axis = |at: usize| {
        let near = (at / 2).min(size - 1);
        let far = if at.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(size - 1) };
        [(near, 0.75f32), (far, 0.25)]
    };
    let mut sum = Sum::default();
    for ((row, wy), (column, wx)) in axis(y).into_iter().flat_map(|row| axis(x).map(|column| (row, column))) {
        let (weight, from) = (wx * wy, &level[row * size + column]);
        sum.normal += weight * from.normal;
        sum.ambient += weight * from.ambient;
        sum.foliage += weight * from.foliage;
        sum.coverage += weight * from.coverage;
    }
    sum
}

fn halve(finer: &[Sum], size: usize) -> Vec<Sum> {
    let half = size / 2;
    (0..half * half)
        .map(|at| {
            let corner = 2 * (at / half) * size + 2 * (at % half);
            [corner, corner + 1, corner + size, corner + size + 1].iter().fold(Sum::default(), |sum, &i| Sum {
                normal: sum.normal + finer[i].normal,
                ambient: sum.ambient + finer[i].ambient,
                foliage: sum.foliage + finer[i].foliage,
                coverage: sum.coverage + finer[i].coverage,
            })
        })
        .collect()
}

/// Mean normals under a Gaussian of `deviation` texels over what is covered, as long as the normals agree; straight
/// ahead where nothing is.
fn smoothed(texels: &[Texel], resolution: usize, deviation: f32) -> Vec<Vec3> {
    let radius = (3.0 * deviation).ceil() as isize;
    let kernel: Vec<f32> = (-radius..=radius)
        .map(|offset| if radius == 0 { 1.0 } else { (-0.5 * (offset as f32 / deviation).powi(2)).exp() })
        .collect();
    // A pass along rows that writes columns: two of them are the two-dimensional filter.
    let pass = |source: &[Vec4]| -> Vec<Vec4> {
        (0..resolution * resolution)
            .into_par_iter()
            .map(|at| {
                let (x, y) = ((at / resolution) as isize, at % resolution);
                let row = &source[y * resolution..][..resolution];
                let first = (x - radius).max(0);
                let last = (x + radius).min(resolution as isize - 1);
                let weights = &kernel[(first - x + radius) as usize..];
                row[first as usize..=last as usize].iter().zip(weights).map(|(normal, weight)| *weight * *normal).sum()
            })
            .collect()
    };
    let normals: Vec<Vec4> = texels.iter().map(|texel| texel.normal.extend(texel.coverage)).collect();
    let mean = |sum: Vec4| if sum.w > 1e-6 { (sum.truncate() / sum.w).clamp_length_max(1.0) } else { Vec3::Z };
    pass(&pass(&normals)).into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    fn decode(code: [u8; 4]) -> Vec3 {
        octahedral::decode_z(Vec2::new(f32::from(code[0]), f32::from(code[1])) / 255.0 * 2.0 - 1.0)
    }

    #[test]
    fn normals_survive_eight_bits() {
        for i in 0..500 {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = (2.399_963 * i as f32).sin_cos();
            let normal = Vec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
            let code = Sum { normal, ..Sum::OPEN }.code();
            assert!(decode(code).angle_between(normal) < 0.0175, "{normal}");
        }
    }

    #[test]
    fn mips_average_vectors_and_air_has_no_say() {
        let mut texels = vec![Texel::default(); 64 * 64];
        // One covered column at the left leans left, one beside it leans right, half as dense.
        for y in 0..64 {
            let left = Vec3::new(-0.6, 0.0, 0.8);
            let right = Vec3::new(0.6, 0.0, 0.8);
            texels[y * 64] = Texel { coverage: 1.0, normal: left, ambient: 0.2, foliage: 1.0, ..Default::default() };
            texels[y * 64 + 1] =
                Texel { coverage: 0.5, normal: 0.5 * right, ambient: 0.4, foliage: 0.0, ..Default::default() };
        }
        let (chain, isotropy) = mips(&texels, 64, 0.0);
        assert_eq!(chain.levels.len(), 7);
        let texel = |level: usize, at: usize| -> [u8; 4] { std::array::from_fn(|c| chain.levels[level][4 * at + c]) };
        let mean = Vec3::new(-0.6 + 0.3, 0.0, 0.8 + 0.4).normalize();
        for level in 1..7 {
            assert!(decode(texel(level, 0)).angle_between(mean) < 0.015, "level {level}");
            assert_eq!(texel(level, 0)[2], unorm8(0.6 / 1.5));
            assert_eq!(texel(level, 0)[3], unorm8(1.0 / 1.5));
        }
        // Level 0 has one direction a texel, the others two that disagree; wood has no say.
        assert!(isotropy[0].isotropic.abs() < 1e-5 && isotropy[0].weight == 64.0);
        let expected = isotropic_fraction(Vec3::new(-0.3, 0.0, 1.2).length() / 1.5);
        for level in &isotropy[1..] {
            assert!((level.isotropic / level.weight - f64::from(expected)).abs() < 1e-5, "{level:?}");
        }
        // Air continues the coarser means.
        assert!(decode(texel(0, 63)).angle_between(mean) < 0.03);
    }
}
