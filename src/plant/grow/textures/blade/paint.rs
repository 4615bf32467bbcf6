//! From veins and tissue to textures.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::{GrayImage, Luma, Rgba, RgbaImage};
use rayon::prelude::*;

use super::{BladeStyle, BladeTextures, Tissue, Venation, letters, veins};
use crate::math::{linear_to_srgb, smoothstep};
use crate::plant::LeafTextures;
use crate::plant::grow::textures::lattice::{cell, noise};

/// What a texel of a leaf is made of.
#[derive(Clone, Copy, Default)]
struct Texel {
    /// Coverage of the mask, 0..=1.
    mask: f32,
    /// Linear colours.
    front: Vec3,
    back: Vec3,
    transmission: Vec3,
    /// The same without veins and unevenness.
    plain: [Vec3; 3],
    thickness: f32,
    absorption: f32,
    /// Height of the upper side, 0..=1.
    relief: f32,
}

/// Values of thickness and absorption of tissue without veins.
const LAMINA: [f32; 2] = [0.40, 0.36];
/// Height of the stamped letters in heights of the texture, and their half stroke in heights of a letter.
const STAMP: [f32; 2] = [0.115, 0.085];

/// Paints a kind of leaf.
pub(in crate::plant::grow) fn paint(style: &BladeStyle) -> BladeTextures {
    let [width, height] = style.size;
    let map = veins::draw(style);
    let rim = style.outline.rim(Vec2::new(style.aspect(), 1.0));
    let texels: Vec<Texel> = (0..(width * height) as usize)
        .into_par_iter()
        .map(|at| {
            let uv = Vec2::new(
                ((at as u32 % width) as f32 + 0.5) / width as f32,
                ((at as u32 / width) as f32 + 0.5) / height as f32,
            );
            texel(style, uv, rim.distance(uv), [map.lines[0][at], map.lines[1][at]], map.dome[at])
        })
        .collect();
    // The means over the leaf stay those of its tissue.
    let factor = |of: &dyn Fn(&Texel) -> [Vec3; 2]| {
        let [mut painted, mut plain] = [Vec3::ZERO; 2];
        for texel in &texels {
            let [value, base] = of(texel);
            painted += texel.mask * value;
            plain += texel.mask * base;
        }
        plain / painted.max(Vec3::splat(1e-6))
    };
    let front = factor(&|texel| [texel.front, texel.plain[0]]);
    let back = factor(&|texel| [texel.back, texel.plain[1]]);
    let transmission = factor(&|texel| [texel.transmission, texel.plain[2]]);
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let color = |of: &dyn Fn(&Texel) -> Vec3| {
        Arc::new(RgbaImage::from_fn(width, height, |x, y| {
            let texel = &texels[(y * width + x) as usize];
            let [r, g, b] = of(texel).to_array().map(|value| byte(linear_to_srgb(value.clamp(0.0, 1.0))));
            Rgba([r, g, b, byte(texel.mask)])
        }))
    };
    let grey = |of: &dyn Fn(&Texel) -> f32| {
        Arc::new(GrayImage::from_fn(width, height, |x, y| Luma([byte(of(&texels[(y * width + x) as usize]))])))
    };
    BladeTextures {
        front: color(&|texel| texel.front * front),
        normal: Arc::new(normals(style, &texels)),
        layers: LeafTextures {
            back: Some(color(&|texel| texel.back * back)),
            transmission: Some(color(&|texel| texel.transmission * transmission)),
            thickness: Some(grey(&|texel| texel.thickness)),
            absorption: Some(grey(&|texel| texel.absorption)),
        },
    }
}

fn texel(style: &BladeStyle, uv: Vec2, inside: f32, [main, side]: [f32; 2], dome: f32) -> Texel {
    let mask = (inside * style.size[1] as f32 + 0.5).clamp(0.0, 1.0);
    let flat = style.flat(uv);
    // The tissue, striped where it is.
    let tissue = match &style.stripe {
        Some((stripe, share)) => {
            let rim = (inside / (0.47 * style.aspect())).clamp(0.0, 1.0);
            let edge = 0.06 * noise(6.0 * uv.x, 40.0 * uv.y, [64, 256], style.seed + 7);
            style.tissue.lerp(*stripe, smoothstep(1.0 - share - 0.06, 1.0 - share + 0.06, rim + edge))
        }
        None => style.tissue,
    };
    // The net: coarse cells between the side veins, fine ones within. Positive coordinates, far from the wrap.
    let wander = |frequency: f32, size: f32, seed: u32| {
        let at = frequency * (flat + 1.0);
        let along = |seed: u32| size * noise(at.x, at.y, [4096; 2], style.seed + seed);
        Vec2::new(along(seed), along(seed + 1))
    };
    let net = style.net * (flat + 1.0 + wander(16.0, 0.010, 20) + wander(60.0, 0.004, 22));
    let coarse = cell(0.36 * net.x, 0.36 * net.y, [4096; 2], 1.0, style.seed);
    let fine = cell(net.x, net.y, [4096; 2], 1.0, style.seed + 1);
    // Straps have no net.
    let netted = if matches!(style.venation, Venation::Parallel { .. }) { 0.0 } else { 1.0 - main.max(side) };
    let third = (1.0 - smoothstep(0.015, 0.075, coarse.border)) * netted * (0.55 + 0.45 * coarse.value);
    let fourth = (1.0 - smoothstep(0.02, 0.17, fine.border)) * netted * (1.0 - third) * (0.6 + 0.4 * fine.value);
    let patchy = 0.6 * noise(9.0 * (uv.x + 0.2), 14.0 * (uv.y + 0.2), [128, 128], style.seed + 2)
        + 0.4 * noise(40.0 * uv.x, 60.0 * uv.y, [256, 256], style.seed + 3);
    let grain = noise(300.0 * uv.x, 450.0 * uv.y, [2048, 2048], style.seed + 4);
    let rim = 1.0 - smoothstep(0.0, 0.012, inside);
    let k = style.contrast;

    let shade = 1.0 + k * (0.20 * (dome - 0.5) + 0.13 * patchy + 0.05 * grain + 0.05 * fine.value - 0.06 * fourth);
    let vein_front = (0.85 * main).max(0.62 * k * side).max(0.15 * k * third).max(0.05 * k * fourth).max(0.25 * rim);
    let front = (tissue.front * shade).lerp(style.vein.front, vein_front);
    let shade = 1.0 + k * (0.08 * patchy + 0.05 * grain - 0.06 * dome);
    let vein_back = (0.90 * main).max(0.75 * side).max(0.42 * k * third).max(0.18 * k * fourth).max(0.2 * rim);
    let back = (tissue.back * shade).lerp(style.vein.back, vein_back);
    // Against the light the tissue glows between the veins, each mesh of the net by itself.
    let glow = 1.0
        + k * (0.16 * patchy
            + 0.10 * (dome - 0.5)
            + 0.12 * (fine.value - 0.5)
            + 0.06 * (coarse.value - 0.5)
            + 0.04 * grain);
    let passes = |line: f32, share: f32| 1.0 - share * line;
    let through = passes(third, 0.42 * k) * passes(fourth, 0.28 * k) * passes(rim, 0.25);
    let transmission =
        (tissue.transmission * (glow * through)).lerp(style.vein.transmission, (0.92 * main).max(0.70 * side));

    let [lamina, absorbs] = LAMINA;
    let (thickness, absorption) = match &style.letters {
        // The letters alone: the colours have the veins already.
        Some(text) => (lamina, absorbs + (1.0 - absorbs) * stamp(style, text, flat)),
        None => {
            let swollen = main.max(0.62 * side).max(0.26 * third).max(0.10 * fourth);
            let dense = (0.95 * main).max(0.80 * side).max(0.45 * third).max(0.25 * fourth);
            (
                lamina + (1.0 - lamina) * swollen + 0.03 * patchy + 0.05 * (dome - 0.5),
                absorbs + (0.92 - absorbs) * dense + 0.05 * patchy,
            )
        }
    };
    let relief = 0.5 + 0.24 * (dome - 0.5) - 0.34 * main - 0.22 * side - 0.10 * third - 0.05 * fourth + 0.008 * grain;
    Texel {
        mask,
        front,
        back,
        transmission,
        plain: [tissue.front, tissue.back, tissue.transmission],
        thickness,
        absorption,
        relief,
    }
}

/// How strongly letters are stamped here, 0..=1: a line across the leaf, as wide as its middle at most.
fn stamp(style: &BladeStyle, text: &str, flat: Vec2) -> f32 {
    let center = 0.47 * style.flat(style.outline.tip);
    let room = 0.66 * style.aspect();
    let size = STAMP[0].min(room / letters::width(text).max(1e-3));
    let distance = letters::distance(text, (flat - center) / size);
    let soft = 1.5 / (size * style.size[1] as f32);
    1.0 - smoothstep(STAMP[1] - soft, STAMP[1] + soft, distance)
}

/// Tangent-space normals of the relief.
fn normals(style: &BladeStyle, texels: &[Texel]) -> RgbaImage {
    let [width, height] = style.size;
    let at = |x: u32, y: u32| texels[(y * width + x) as usize].relief;
    let strength = 0.5 * style.relief * height as f32;
    RgbaImage::from_fn(width, height, |x, y| {
        let (left, right) = (at(x.saturating_sub(1), y), at((x + 1).min(width - 1), y));
        let (above, below) = (at(x, y.saturating_sub(1)), at(x, (y + 1).min(height - 1)));
        let normal = Vec3::new(strength * (left - right), strength * (below - above), 1.0).normalize_or(Vec3::Z);
        let [r, g, b] = (0.5 * normal + 0.5).to_array().map(|value| (value * 255.0 + 0.5) as u8);
        Rgba([r, g, b, 255])
    })
}

impl Tissue {
    /// Veins of this tissue: with little chlorophyll, so pale, and dark against the light because they are thick.
    pub(in crate::plant::grow) fn veins(self, pale: f32) -> Self {
        let cream = Vec3::new(0.34, 0.40, 0.17);
        Self {
            front: self.front.lerp(cream, pale),
            back: self.back.lerp(cream, (1.3 * pale).min(1.0)),
            transmission: self.transmission * Vec3::new(0.52, 0.44, 0.40),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Outline;
    use super::*;
    use crate::math::srgb_to_linear;
    use crate::plant::prospect::Constituents;

    fn style(letters: Option<&str>) -> BladeStyle {
        let tissue = Tissue::of(&Constituents::default(), 0.6);
        BladeStyle {
            size: [128, 192],
            outline: Outline::ovate(),
            venation: Venation::Pinnate { pairs: 8, angle: 0.9 },
            midrib: 0.010,
            net: 40.0,
            contrast: 1.0,
            tissue,
            vein: tissue.veins(0.5),
            stripe: None,
            relief: 0.01,
            letters: letters.map(str::to_owned),
            seed: 1,
        }
    }

    fn mean(image: &RgbaImage) -> Vec3 {
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for texel in image.pixels() {
            let [r, g, b, a] = texel.0.map(|code| f32::from(code) / 255.0);
            sum += a * Vec3::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b));
            weight += a;
        }
        sum / weight
    }

    #[test]
    fn the_means_are_those_of_the_tissue() {
        let style = style(None);
        let painted = paint(&style);
        let layers = &painted.layers;
        for (image, wanted) in [
            (&painted.front, style.tissue.front),
            (layers.back.as_ref().unwrap(), style.tissue.back),
            (layers.transmission.as_ref().unwrap(), style.tissue.transmission),
        ] {
            let got = mean(image);
            assert!((got - wanted).abs().max_element() < 0.004, "{got} {wanted}");
        }
    }

    #[test]
    fn veins_are_thicker_and_darker_against_the_light() {
        let style = style(None);
        let painted = paint(&style);
        let layers = &painted.layers;
        // On the midrib, and in the tissue beside it.
        let (vein, beside) = ((64, 150), (64 + 14, 150));
        let grey = |image: &Option<Arc<GrayImage>>, (x, y)| image.as_ref().unwrap().get_pixel(x, y)[0];
        assert!(grey(&layers.thickness, vein) > 2 * grey(&layers.thickness, beside));
        assert!(grey(&layers.absorption, vein) > grey(&layers.absorption, beside));
        let green = |(x, y)| layers.transmission.as_ref().unwrap().get_pixel(x, y)[1];
        assert!(green(vein) < green(beside));
    }

    #[test]
    fn letters_are_in_the_absorption_alone_and_nothing_else_is() {
        let (plain, stamped) = (paint(&style(None)), paint(&style(Some("I"))));
        assert_eq!(plain.front, stamped.front);
        assert_eq!(plain.layers.transmission, stamped.layers.transmission);
        let (thickness, absorption) = (stamped.layers.thickness.unwrap(), stamped.layers.absorption.unwrap());
        assert!(thickness.pixels().all(|texel| *texel == *thickness.get_pixel(0, 0)));
        let paper = absorption.get_pixel(0, 0)[0];
        let inked = absorption.pixels().filter(|texel| texel[0] > 200).count();
        let blank = absorption.pixels().filter(|texel| texel[0] == paper).count();
        assert!(inked > 30 && blank > 20_000 && paper < 120, "{inked} {blank} {paper}");
    }
}
