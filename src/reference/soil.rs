//! The colour of the renderer's ground: the twin of the albedo in `shaders/terrain/terrain.wgsl`.
//!
//! The renderer samples its noise through mips. A reference samples it at full resolution, because its samples average
//! it. Where a pixel covers several texels, terms that depend on the noise by a smooth step therefore differ slightly.
//! The detail of the normal, which the renderer adds near the camera, is left out.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use image::RgbaImage;

use crate::math::smoothstep;
use crate::scatter::CoverMap;
use crate::terrain::Terrain;
use crate::terrain::ground_noise::{NOISE_SIDE, noise_image};

/// Points along an axis of the terrain from which its mean cover is taken.
const MEAN_POINTS: u32 = 64;

/// Everything that the colour of the ground depends on.
#[derive(Clone, Debug)]
pub struct Soil {
    noise: RgbaImage,
    cover: Option<Arc<CoverMap>>,
    extent: DVec2,
    mean_cover: f32,
}

impl Soil {
    /// The soil of `terrain`, with the canopy cover `cover`.
    pub fn new(terrain: &Terrain, cover: Option<Arc<CoverMap>>) -> Self {
        let extent = terrain.extent();
        let mut soil = Self { noise: noise_image(), cover, extent, mean_cover: 0.0 };
        let step = |i: u32| (f64::from(i) + 0.5) / f64::from(MEAN_POINTS) - 0.5;
        let points = (0..MEAN_POINTS).flat_map(|z| (0..MEAN_POINTS).map(move |x| DVec2::new(step(x), step(z))));
        soil.mean_cover = points.map(|p| soil.cover_at(p * extent)).sum::<f32>() / (MEAN_POINTS * MEAN_POINTS) as f32;
        soil
    }

    /// Canopy cover around a position, bilinear.
    fn cover_at(&self, position: DVec2) -> f32 {
        let Some(cover) = &self.cover else { return 0.0 };
        let at = (position - cover.origin) / cover.texel - 0.5;
        let low = at.floor();
        let f = (at - low).as_vec2();
        let texel = |x: f64, z: f64| cover.at(cover.origin + (low + DVec2::new(x + 0.5, z + 0.5)) * cover.texel);
        let row = |z: f64| texel(0.0, z) * (1.0 - f.x) + texel(1.0, z) * f.x;
        row(0.0) * (1.0 - f.y) + row(1.0) * f.y
    }

    /// Noise of a period in metres: smooth, fine, patchy, ridged, each 0..1; bilinear, repeating.
    fn noise(&self, xz: DVec2, period: f64) -> Vec4 {
        let side = f64::from(NOISE_SIDE);
        let at = (xz / period).map(|c| c.rem_euclid(1.0)) * side - 0.5;
        let low = at.floor();
        let f: Vec2 = (at - low).as_vec2();
        let texel = |x: f64, y: f64| {
            let position = (low + DVec2::new(x, y)).map(|c| c.rem_euclid(side));
            let pixel =
                self.noise.get_pixel((position.x as u32).min(NOISE_SIDE - 1), (position.y as u32).min(NOISE_SIDE - 1));
            Vec4::from(pixel.0.map(f32::from)) / 255.0
        };
        let row = |y: f64| texel(0.0, y).lerp(texel(1.0, y), f.x);
        row(0.0).lerp(row(1.0), f.y)
    }

    /// Albedo at a position (scene metres) where the smooth ground has this unit normal.
    pub fn albedo(&self, position: DVec3, normal: Vec3) -> Vec3 {
        let xz = DVec2::new(position.x, position.z);
        if !xz.is_finite() {
            return Vec3::ZERO;
        }
        let both = |period: f64, rotated: f64| {
            let rotated = self.noise(rotate(xz), rotated);
            Vec4::splat(0.5) + 0.72 * (self.noise(xz, period) + rotated - Vec4::ONE)
        };
        let wide = self.noise(xz, 512.0);
        let middle = both(64.0, 51.2);
        let fine = both(8.0, 12.8);
        let grain = both(2.0, 3.2);
        let outside = xz.abs().cmpgt(0.5 * self.extent).any();
        let cover = if outside { self.mean_cover } else { self.cover_at(xz) };

        let litter = Vec3::new(0.050, 0.040, 0.022)
            .lerp(Vec3::new(0.100, 0.078, 0.042), (fine.y * 1.4 - 0.2 + grain.y - 0.5).clamp(0.0, 1.0));
        let moss = Vec3::new(0.030, 0.048, 0.014).lerp(Vec3::new(0.055, 0.080, 0.022), grain.z);
        let floor_mix = smoothstep(0.45, 0.62, middle.z * 0.6 + fine.z * 0.4);
        let forest_floor = litter.lerp(moss, floor_mix * 0.75);
        let lush = Vec3::new(0.050, 0.085, 0.020).lerp(Vec3::new(0.095, 0.135, 0.035), fine.y);
        let dry = Vec3::new(0.120, 0.115, 0.045).lerp(Vec3::new(0.175, 0.155, 0.070), grain.y);
        let meadow = lush.lerp(dry, smoothstep(0.42, 0.68, wide.x * 0.5 + middle.x * 0.5)) * (0.8 + 0.4 * grain.x);
        let rock = Vec3::new(0.13, 0.12, 0.105).lerp(Vec3::new(0.26, 0.245, 0.22), fine.w * 0.6 + grain.w * 0.4);

        let wooded = smoothstep(0.10, 0.45, cover + (middle.y - 0.5) * 0.25);
        let mut albedo = meadow.lerp(forest_floor, wooded);
        // Wooded ground too far for its trees to be drawn is seen as crowns.
        if outside {
            let crowns = Vec3::new(0.028, 0.045, 0.013).lerp(Vec3::new(0.050, 0.072, 0.022), middle.y);
            albedo = albedo.lerp(crowns, wooded);
        }
        let steepness = 1.0 - normal.y;
        let stony = smoothstep(0.30, 0.42, steepness + (middle.w - 0.5) * 0.15 + (fine.w - 0.5) * 0.08);
        albedo.lerp(rock, stony) * (0.85 + 0.3 * middle.x)
    }

    /// Everything that the colour depends on, as bytes for a fingerprint.
    pub(crate) fn feed(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.noise.as_raw());
        hasher.update(bytemuck::bytes_of(&self.extent));
        if let Some(cover) = &self.cover {
            hasher.update(&cover.cover);
            hasher.update(format!("{:?} {} {} {}", cover.origin, cover.texel, cover.columns, cover.rows).as_bytes());
        }
    }
}

/// The position at which the second noise of a pair is read: rotated by the angle of a 3-4-5 triangle.
fn rotate(xz: DVec2) -> DVec2 {
    DVec2::new(0.6 * xz.x - 0.8 * xz.y, 0.8 * xz.x + 0.6 * xz.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{HeightField, Surroundings};

    #[test]
    fn colours_are_albedos_and_follow_cover_and_slope() {
        let field = HeightField::new(3, 3, DVec2::splat(100.0), vec![0.0; 9]).unwrap();
        let terrain = Terrain::new(field, None, Surroundings::Mirror);
        let cover =
            CoverMap { origin: DVec2::new(-100.0, -100.0), texel: 100.0, columns: 2, rows: 2, cover: vec![255; 4] };
        let (bare, wooded) = (Soil::new(&terrain, None), Soil::new(&terrain, Some(Arc::new(cover))));
        let mean = |soil: &Soil, normal: Vec3| {
            let albedo = |i: u32| {
                let position = DVec3::new(f64::from(i % 32) * 1.7 - 27.0, 0.0, f64::from(i / 32) * 1.9 - 30.0);
                let albedo = soil.albedo(position, normal);
                assert!(albedo.min_element() >= 0.0 && albedo.max_element() <= 1.0);
                albedo
            };
            (0..1024).map(albedo).sum::<Vec3>() / 1024.0
        };
        let (meadow, forest) = (mean(&bare, Vec3::Y), mean(&wooded, Vec3::Y));
        assert!(meadow.y > 1.3 * forest.y && meadow.y > 0.06, "{meadow} {forest}");
        let rock = mean(&bare, Vec3::new(0.9, 0.44, 0.0));
        assert!(rock.z > 2.0 * meadow.z, "{rock}");
        // Bilinear: half a texel inside the rim it begins to fall to the open ground outside.
        assert!((0.5..0.9).contains(&wooded.mean_cover), "{}", wooded.mean_cover);
        for strange in [f64::NAN, f64::INFINITY, 1e300] {
            assert!(bare.albedo(DVec3::splat(strange), Vec3::Y).is_finite());
        }
    }
}
