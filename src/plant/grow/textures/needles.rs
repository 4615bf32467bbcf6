//! Paints the twig of a spruce, with side twigs full of needles.

use glam::{Vec2, Vec3};
use image::RgbaImage;

use super::Layer;
use super::canvas::Canvas;
use crate::plant::grow::random::Random;

/// Width and height of the texture.
const SIZE: usize = 1024;
/// Mean colour of a needle, sRGB.
const GREEN: Vec3 = Vec3::new(0.245, 0.335, 0.180);
/// Colour of the twigs, sRGB.
const TWIG: Vec3 = Vec3::new(0.36, 0.26, 0.17);

/// Thickness and absorption of a needle in its middle.
const NEEDLE: [f32; 2] = [0.85, 0.55];

/// Paints one layer of the spray. All layers have the same needles.
pub(super) fn paint(layer: Layer) -> RgbaImage {
    let mut random = Random::new(30);
    let mut canvas = Canvas::new(SIZE);
    let main = Shoot { base: Vec2::new(0.5, 1.0), angle: 0.0, length: 0.93, bend: 0.05 };
    let mut shoots = Vec::new();
    let pairs = 9;
    for index in 0..2 * pairs {
        let side = if index % 2 == 0 { 1.0 } else { -1.0 };
        let along = 0.05 + 0.76 * (index as f32 + 0.4 * random.signed()) / (2 * pairs) as f32;
        let (base, angle) = main.at(along);
        // Longest below the middle, because side shoots of earlier years have grown longer.
        let length = (0.60 - 0.44 * along) * (0.72 + 2.0 * along).min(1.0) * random.range(0.88, 1.04);
        let shoot = Shoot {
            base,
            angle: angle + side * random.range(0.92, 1.12),
            length,
            bend: -side * random.range(0.15, 0.4),
        };
        for fork in 0..2 {
            let (base, angle) = shoot.at(0.42 + 0.26 * fork as f32);
            let side = if fork == 0 { side } else { -side };
            shoots.push(Shoot {
                base,
                angle: angle + side * random.range(0.55, 0.8),
                length: length * random.range(0.30, 0.44),
                bend: -side * 0.2,
            });
        }
        shoots.push(shoot);
    }
    for shoot in shoots.iter().chain([&main]) {
        shoot.draw(&mut canvas, &mut random, layer);
    }
    canvas.finish()
}

/// A shoot in units of the width of the texture. Angles are clockwise from straight up.
struct Shoot {
    base: Vec2,
    angle: f32,
    length: f32,
    /// Rotation from base to tip, radians.
    bend: f32,
}

impl Shoot {
    fn at(&self, along: f32) -> (Vec2, f32) {
        let angle = self.angle + self.bend * along;
        let middle = self.angle + 0.5 * self.bend * along;
        (self.base + self.length * along * Vec2::new(middle.sin(), -middle.cos()), angle)
    }

    /// Draws needles to both sides behind the twig, the twig, and needles on it in front.
    fn draw(&self, canvas: &mut Canvas, random: &mut Random, layer: Layer) {
        let size = SIZE as f32;
        let steps = (self.length * size / 5.0).max(4.0) as usize;
        let young = random.unit();
        let value = random.range(0.86, 1.16);
        // Its shadow on the shoots below, towards the lower right.
        let offset = Vec2::new(9.0, 15.0);
        if layer == Layer::Front {
            canvas.shadow(self.at(0.0).0 * size + offset, self.at(1.0).0 * size + offset, 52.0, 0.55);
        }
        for pass in 0..2 {
            if pass == 1 {
                for step in 0..12 {
                    let (a, b) = (step as f32 / 12.0, (step + 1) as f32 / 12.0);
                    let radius = |t: f32| (1.8 + 4.0 * self.length) * (1.0 - 0.6 * t);
                    canvas.stroke(self.at(a).0 * size, self.at(b).0 * size, radius(a), radius(b), layer.twig(TWIG));
                }
            }
            for step in 0..steps {
                let along = (step as f32 + random.unit()) / steps as f32;
                let (base, angle) = self.at(along);
                for side in [-1.0, 1.0] {
                    let open = if pass == 0 { random.range(0.65, 1.15) } else { random.range(0.1, 0.7) };
                    // Needles are shorter and closer to the twig at its tip.
                    let taper = 1.0 - 0.45 * along.powi(3);
                    let length = size * 0.044 * taper * random.range(0.75, 1.1) * if pass == 0 { 1.0 } else { 0.8 };
                    let angle = angle + side * open * taper;
                    let base = base * size;
                    let tip = base + length * Vec2::new(angle.sin(), -angle.cos());
                    let light = value * if pass == 0 { 0.84 } else { 1.10 } * random.range(0.8, 1.2);
                    let fresh = 0.5 * young * along + 0.25 * random.unit();
                    let color = GREEN * light * (Vec3::ONE + fresh * Vec3::new(0.42, 0.30, 0.02));
                    canvas.stroke(base, tip, 3.0, 1.5, needle(layer, color));
                }
            }
        }
    }
}

/// The value of a layer for a needle that has this colour on the front.
fn needle(layer: Layer, color: Vec3) -> Vec3 {
    let own = (color / GREEN).powf(2.2);
    match layer {
        Layer::Front => color,
        Layer::Back | Layer::Through => 0.5 * own,
        Layer::Thickness => Vec3::splat(NEEDLE[0]),
        Layer::Absorption => Vec3::splat(NEEDLE[1]),
        Layer::Relief => Vec3::splat(0.5),
    }
}
