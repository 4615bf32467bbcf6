//! The colour of the renderer's ground: the twin of `shaders/terrain/ground_color.wgsl`.
//!
//! The renderer leaves out noise that is finer than a pixel. A reference has all of it, because its samples average it.
//! The detail of the normal and the shade between clods, which the renderer adds near the camera, are left out.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use crate::math::luminance;
use crate::scatter::{Area, CoverMap, distance_beyond, surroundings_density};
use crate::terrain::Terrain;
use crate::terrain::drape::{DETAIL_TEXELS, Drape, LEAST_DETAIL, MOST_DETAIL};
use crate::terrain::ground_noise::{LEAF_OCTAVE, noise_band, noise_step, scattered_leaves, visible_part};

/// Points along an axis of the terrain from which its mean cover is taken.
const MEAN_POINTS: u32 = 64;

/// Albedo of crowns where nothing is known of the trees.
const GREEN_CROWNS: Vec3 = Vec3::new(0.010, 0.025, 0.005);

/// Everything that the colour of the ground depends on.
#[derive(Clone, Debug)]
pub struct Soil {
    cover: Option<Arc<CoverMap>>,
    extent: DVec2,
    mean_cover: f32,
    /// Metres beyond the terrain's data on which trees stand too.
    surroundings: f64,
    /// A photograph over the ground, and the factor from its values to reflectance.
    drape: Option<(Arc<Drape>, f32)>,
    /// Albedo of crowns that are seen together.
    crowns: Vec3,
}

impl Soil {
    /// The soil of `terrain`, with the canopy cover `cover`. Trees stand up to `surroundings` metres beyond the data, and
    /// thin out there; farther out the ground has the colour of crowns.
    pub fn new(terrain: &Terrain, cover: Option<Arc<CoverMap>>, surroundings: f64) -> Self {
        let extent = terrain.extent();
        let mut soil = Self { cover, extent, mean_cover: 0.0, surroundings, drape: None, crowns: GREEN_CROWNS };
        let step = |i: u32| (f64::from(i) + 0.5) / f64::from(MEAN_POINTS) - 0.5;
        let points = (0..MEAN_POINTS).flat_map(|z| (0..MEAN_POINTS).map(move |x| DVec2::new(step(x), step(z))));
        soil.mean_cover = points.map(|p| soil.cover_at(p * extent)).sum::<f32>() / (MEAN_POINTS * MEAN_POINTS) as f32;
        soil
    }

    /// The same with crowns of this albedo ([`StandTrees::crown_albedo`](crate::light::StandTrees::crown_albedo)) where trees are seen
    /// together, beyond those that stand there.
    pub fn with_crowns(self, crowns: Vec3) -> Self {
        Self { crowns, ..self }
    }

    /// The same under a photograph, whose values times `brightness` are reflectances.
    pub fn with_drape(self, drape: Arc<Drape>, brightness: f32) -> Self {
        Self { drape: Some((drape, brightness)), ..self }
    }

    /// Canopy cover around a position, bilinear.
    fn cover_at(&self, position: DVec2) -> f32 {
        self.cover.as_ref().map_or(0.0, |cover| cover.smooth_at(position))
    }

    /// Albedo at a position (scene metres) where the smooth ground has this unit normal.
    pub fn albedo(&self, position: DVec3, normal: Vec3) -> Vec3 {
        let xz = DVec2::new(position.x, position.z);
        if !xz.is_finite() {
            return Vec3::ZERO;
        }
        let half = 0.5 * self.extent;
        let distance = distance_beyond(&Area { min: -half, max: half }, xz);
        let drawn = surroundings_density(distance, self.surroundings) as f32;
        let undrawn = self.mean_cover * (1.0 - drawn);
        let planted = if distance > self.surroundings { 0.0 } else { self.cover_at(xz) };
        let cover = undrawn + planted;
        let color =
            |footprint: f32| ground_color(xz, 1.0 - normal.y, cover, undrawn / cover.max(1e-3), footprint, self.crowns);
        let own = color(0.0);
        let Some((drape, brightness)) = &self.drape else { return own };
        let photo = drape.sample(xz);
        if photo.w <= 0.0 {
            return own;
        }
        // What the photograph is too coarse for, it has from the ground's own colour.
        let detail = luminance(own) / luminance(color(DETAIL_TEXELS * drape.texel() as f32)).max(1e-4);
        let shown = photo.truncate() * (brightness * detail.clamp(LEAST_DETAIL, MOST_DETAIL));
        (own * (1.0 - photo.w) + shown).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Everything that the colour depends on, as bytes for a fingerprint.
    pub(crate) fn feed(&self, hasher: &mut blake3::Hasher) {
        hasher.update(bytemuck::bytes_of(&self.extent));
        hasher.update(&self.surroundings.to_le_bytes());
        hasher.update(bytemuck::bytes_of(&self.crowns));
        if let Some((drape, brightness)) = &self.drape {
            drape.feed(hasher);
            hasher.update(&brightness.to_le_bytes());
        }
        if let Some(cover) = &self.cover {
            hasher.update(&cover.cover);
            hasher.update(format!("{:?} {} {} {}", cover.origin, cover.texel, cover.columns, cover.rows).as_bytes());
        }
    }
}

/// Albedo of the ground at a position in metres (x east, y south), as the shader has it: `steepness` is 1 less the normal's
/// height, `cover` the canopy cover, of which the part `far` is seen as crowns (of the albedo `crowns`), and `footprint`
/// the width of a pixel on the ground, metres; 0 shows everything.
pub(crate) fn ground_color(xz: DVec2, steepness: f32, cover: f32, far: f32, footprint: f32, crowns: Vec3) -> Vec3 {
    let wide = noise_band(xz, 0, 4, footprint);
    let middle = noise_band(xz, 4, 4, footprint);
    let fine = noise_band(xz, 8, 3, footprint);
    let grain = noise_band(xz, 11, 4, footprint);
    let mix = |from: [f32; 3], to: [f32; 3], share: f32| Vec3::from(from).lerp(to.into(), share);

    let at_margin = cover + 0.05 * middle.value.y + 0.03 * fine.value.x;
    let wooded = noise_step(0.275, 0.175, at_margin, 0.0025 * middle.lost + 0.0009 * fine.lost);
    // Leaves are broad, blades of grass narrow.
    let leaf = scattered_leaves(xz, 0.10 + 0.24 * wooded, footprint);
    let leaf_lost = 1.0 - visible_part(512.0 * (-LEAF_OCTAVE as f32).exp2(), footprint);

    let moisture = 0.4 * fine.value.x + 0.55 * grain.value.x + 0.95 * leaf;
    let dryness = noise_step(0.0, 1.1, moisture, 0.16 * fine.lost + 0.30 * grain.lost + 0.25 * leaf_lost);
    let bleached = noise_step(1.0, 0.25, leaf + 0.25 * grain.value.y, 0.06 * grain.lost + 0.25 * leaf_lost);
    let leaves = mix([0.033, 0.028, 0.015], [0.098, 0.078, 0.040], dryness);
    let litter = leaves.lerp(Vec3::new(0.128, 0.110, 0.068), 0.75 * bleached);
    let herb_tone = noise_step(0.0, 1.2, 0.8 * grain.value.y + 0.6 * leaf, 0.64 * grain.lost + 0.1 * leaf_lost);
    let herbs = mix([0.026, 0.044, 0.012], [0.058, 0.088, 0.023], herb_tone);
    let growth = 0.6 * middle.value.y + 0.65 * fine.value.y + 0.3 * grain.value.y;
    let green = noise_step(0.6, 0.5, growth, 0.36 * middle.lost + 0.42 * fine.lost + 0.09 * grain.lost);
    let forest_floor = litter.lerp(herbs, 0.85 * green);

    let blade_lost = 0.16 * fine.lost + 0.49 * grain.lost + 0.1 * leaf_lost;
    let blade = |fine: f32, grain: f32| noise_step(0.0, 1.4, 0.4 * fine + 0.7 * grain + 0.9 * leaf, blade_lost);
    let lush = mix([0.042, 0.076, 0.016], [0.090, 0.134, 0.033], blade(fine.value.x, grain.value.x));
    let dry = mix([0.100, 0.098, 0.040], [0.185, 0.164, 0.078], blade(fine.value.y, grain.value.y));
    let drought = 0.7 * wide.value.x + 0.6 * middle.value.x + 0.35 * fine.value.y + 0.25 * grain.value.x;
    let drought_lost = 0.49 * wide.lost + 0.36 * middle.lost + 0.12 * fine.lost + 0.06 * grain.lost;
    let meadow = lush.lerp(dry, noise_step(0.35, 1.3, drought, drought_lost));

    let rock_lost = 0.36 * fine.lost + 0.36 * grain.lost;
    let rock_tone = noise_step(0.0, 1.3, 0.6 * fine.value.y + 0.6 * grain.value.y, rock_lost);
    let rock = mix([0.13, 0.12, 0.105], [0.25, 0.235, 0.21], rock_tone);

    let crown_lost = 0.06 * middle.lost + 0.81 * fine.lost;
    let crown_tone = noise_step(0.0, 1.4, 0.25 * middle.value.x + 0.9 * fine.value.y, crown_lost);
    let crowns = crowns * (0.62 + 0.76 * crown_tone);
    let at_cliff = steepness + 0.025 * middle.value.x + 0.015 * fine.value.x;
    let stony = noise_step(0.36, 0.06, at_cliff, 0.0006 * middle.lost + 0.0002 * fine.lost);

    let soil = meadow.lerp(forest_floor, wooded).lerp(crowns, wooded * far).lerp(rock, stony);
    soil * (1.0 + 0.07 * (wide.value.y + middle.value.x) + 0.05 * fine.value.x).clamp(0.5, 1.6)
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
        let (bare, wooded) = (Soil::new(&terrain, None, 0.0), Soil::new(&terrain, Some(Arc::new(cover)), 0.0));
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
