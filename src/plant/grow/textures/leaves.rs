//! Paints a twig with broad leaves: ovate like those of a beech, or lobed like those of an oak.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use image::RgbaImage;

use super::Layer;
use super::canvas::Canvas;
use super::lattice::noise;
use crate::math::smoothstep;
use crate::plant::grow::parameters::LeafShape;
use crate::plant::grow::random::Random;

/// Width and height of the texture.
const SIZE: usize = 1024;
/// Mean colour of a leaf's upper side, sRGB.
const GREEN: Vec3 = Vec3::new(0.298, 0.402, 0.178);
/// Colour of the twig, sRGB.
const TWIG: Vec3 = Vec3::new(0.34, 0.27, 0.19);

/// Half the thickness texture of a blade without veins, and its absorption.
const LAMINA: [f32; 2] = [0.42, 0.38];
/// Fraction of the light through one leaf that a second leaf behind it lets pass, relative to its own.
const SECOND: f32 = 0.45;

/// Paints one layer of the cluster. All layers have the same leaves.
pub(super) fn paint(shape: LeafShape, layer: Layer) -> RgbaImage {
    let (twigs, leaves) = arrange(shape);
    let outline = Outline::new(shape);
    let mut canvas = Canvas::new(SIZE);
    let draw_twigs = |canvas: &mut Canvas| {
        for (index, twig) in twigs.iter().enumerate() {
            let (r0, r1) = if index == 0 { (7.0, 3.0) } else { (4.5, 2.0) };
            twig.draw(canvas, r0, r1, layer.twig(TWIG));
        }
    };
    let size = SIZE as f32;
    if layer == Layer::Back {
        // From behind the order is the other way round.
        for (index, leaf) in leaves.iter().enumerate().rev() {
            leaf.draw(&mut canvas, &outline, index as u32, size, layer);
        }
        draw_twigs(&mut canvas);
    } else {
        draw_twigs(&mut canvas);
        for (index, leaf) in leaves.iter().enumerate() {
            leaf.draw(&mut canvas, &outline, index as u32, size, layer);
        }
    }
    canvas.finish()
}

/// The twigs of the cluster, the main one first, and its leaves, the deepest first.
fn arrange(shape: LeafShape) -> (Vec<Twig>, Vec<Leaf>) {
    let mut random = Random::new(match shape {
        LeafShape::Lobed => 20,
        _ => 10,
    });
    let mut leaves = Vec::new();
    let main = Twig { base: Vec2::new(0.5, 1.0), angle: 0.03, length: 0.68, bend: -0.10 };
    main.leaves(&mut random, 3, 0.30, 0.25, &mut leaves);
    let mut twigs = Vec::new();
    for index in 0..6 {
        let side = if index % 2 == 0 { 1.0 } else { -1.0 };
        let along = 0.16 + 0.12 * index as f32 + 0.02 * random.signed();
        let (base, angle) = main.at(along);
        let twig = Twig {
            base,
            angle: angle + side * random.range(0.72, 0.98),
            length: (0.37 - 0.10 * along) * random.range(0.92, 1.05),
            bend: -side * random.range(0.06, 0.16),
        };
        twig.leaves(&mut random, 4, 0.22, 0.24, &mut leaves);
        twigs.push(twig);
    }
    twigs.insert(0, main);
    // Deepest leaves first, so that those at the tips of twigs are on top.
    leaves.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    (twigs, leaves)
}

/// A twig in units of the width of the texture. Angles are clockwise from straight up.
struct Twig {
    base: Vec2,
    angle: f32,
    length: f32,
    /// Rotation from base to tip, radians.
    bend: f32,
}

impl Twig {
    /// Position and direction at a fraction of the length.
    fn at(&self, along: f32) -> (Vec2, f32) {
        let angle = self.angle + self.bend * along;
        let middle = self.angle + 0.5 * self.bend * along;
        (self.base + self.length * along * Vec2::new(middle.sin(), -middle.cos()), angle)
    }

    fn draw(&self, canvas: &mut Canvas, r0: f32, r1: f32, color: Vec3) {
        let (steps, size) = (8, SIZE as f32);
        for step in 0..steps {
            let (a, b) = (step as f32 / steps as f32, (step + 1) as f32 / steps as f32);
            let radius = |t: f32| r0 + (r1 - r0) * t;
            canvas.stroke(self.at(a).0 * size, self.at(b).0 * size, radius(a), radius(b), color);
        }
    }

    /// Places leaves alternately left and right from the fraction `from` on, and one at the tip.
    fn leaves(&self, random: &mut Random, count: usize, from: f32, size: f32, leaves: &mut Vec<Leaf>) {
        for index in 0..count {
            let along = from + (0.95 - from) * (index as f32 + 0.3 * random.unit()) / count as f32;
            let side = if index % 2 == 0 { 1.0 } else { -1.0 };
            let (base, angle) = self.at(along);
            let angle = angle + side * random.range(0.7, 1.15);
            leaves.push(Leaf::new(random, base, angle, size, along));
        }
        let (base, angle) = self.at(1.0);
        let angle = angle + 0.2 * random.signed();
        leaves.push(Leaf::new(random, base, angle, 1.05 * size, 1.2));
    }
}

struct Leaf {
    base: Vec2,
    angle: f32,
    length: f32,
    /// Factor on the width of the outline: a leaf that is seen at an angle is narrow.
    width: f32,
    bend: f32,
    depth: f32,
    color: Vec3,
    /// The half that faces the light.
    lit: f32,
}

impl Leaf {
    fn new(random: &mut Random, base: Vec2, angle: f32, size: f32, depth: f32) -> Self {
        let value = random.range(0.82, 1.14);
        let yellow = random.range(-0.5, 1.0);
        Self {
            base,
            angle,
            length: size * random.range(0.78, 1.12),
            width: random.range(0.72, 1.05),
            bend: 0.18 * random.signed(),
            depth: depth + 0.35 * random.signed(),
            color: GREEN * value * (Vec3::ONE + yellow * Vec3::new(0.10, 0.035, -0.04)),
            lit: 0.05 * random.signed(),
        }
    }

    fn draw(&self, canvas: &mut Canvas, outline: &Outline, seed: u32, size: f32, layer: Layer) {
        let (base, length) = (self.base * size, self.length * size);
        let axis = Vec2::new(self.angle.sin(), -self.angle.cos());
        let across = Vec2::new(-axis.y, axis.x);
        let petiole = 0.10 * length;
        canvas.stroke(base, base + axis * (petiole + 4.0), 2.2, 1.6, layer.twig(Vec3::new(0.42, 0.42, 0.22)));
        let foot = base + axis * petiole;
        let blade = length - petiole;

        // Its shadow on the leaves below, towards the lower right.
        let tip = foot + (axis + across * self.bend) * blade;
        let reach = Vec2::splat(0.36 * blade * self.width + 10.0);
        for (pixel, center) in canvas.within(foot.min(tip) - reach, foot.max(tip) + reach + Vec2::new(5.0, 9.0)) {
            let inside = |point: Vec2| {
                let place = Place::of(point - foot, axis, across, blade, self.bend);
                outline.distance(place, self.width) * blade
            };
            let shadow = inside(center - Vec2::new(5.0, 9.0));
            if layer == Layer::Front && shadow > -12.0 {
                canvas.shade(pixel, 1.0 - 0.34 * smoothstep(-12.0, 10.0, shadow));
            }
            let distance = inside(center);
            if distance > -0.5 {
                let place = Place::of(center - foot, axis, across, blade, self.bend);
                match layer {
                    Layer::Front => canvas.over(pixel, self.color_at(outline, place, seed), distance + 0.5),
                    Layer::Through => {
                        let value = self.layer_at(outline, place, seed, layer);
                        canvas.over_filter(pixel, value, SECOND, distance + 0.5);
                    }
                    _ => canvas.over(pixel, self.layer_at(outline, place, seed, layer), distance + 0.5),
                }
            }
        }
    }

    /// The veins at a position on the blade.
    fn veins_at(&self, outline: &Outline, place: Place) -> Veins {
        let half = (outline.half_width(place.along) * self.width).max(1e-3);
        let across = (place.across / half).clamp(-1.0, 1.0);
        let outer = across.abs();
        let midrib = (1.0 - smoothstep(0.0, 1.0, place.across.abs() / (0.016 - 0.011 * place.along))).max(0.0);
        // Side veins leave at 45 degrees and bend towards the tip.
        let vein =
            (place.along - 0.75 * place.across.abs() + 0.12 * outer * outer) * outline.veins + 0.25 * across.signum();
        let phase = vein - vein.floor();
        let nearest = phase.min(1.0 - phase);
        let line = (1.0 - smoothstep(0.02, 0.09, nearest)) * (1.0 - 0.75 * outer) * smoothstep(0.0, 0.08, place.along);
        Veins { across, midrib, line, phase, nearest }
    }

    /// The colour at a position on the blade: midrib, veins, bulges between them, mottling, a lighter rim.
    fn color_at(&self, outline: &Outline, place: Place, seed: u32) -> Vec3 {
        let Veins { across, midrib, line, phase, .. } = self.veins_at(outline, place);
        let outer = across.abs();
        let swelling = (TAU * phase).sin() * 0.045 * (1.0 - 0.5 * outer);
        let mottle = 0.06 * noise(24.0 * place.along, 24.0 * place.across, [256, 256], seed)
            + 0.04 * noise(90.0 * place.along, 90.0 * place.across, [1024, 1024], seed + 100);
        let half_lit = self.lit * across.signum() * (1.0 - midrib);
        let inner = 0.90 + 0.12 * smoothstep(0.0, 0.35, place.along);
        let value = inner + mottle + swelling + half_lit + 0.05 * smoothstep(0.8, 1.0, outer);
        let vein_color = self.color * 1.28 + Vec3::new(0.07, 0.06, 0.03);
        (self.color * value).lerp(vein_color, (0.75 * midrib).max(0.42 * line))
    }

    /// The value of a layer other than the front, at a position on the blade.
    fn layer_at(&self, outline: &Outline, place: Place, seed: u32, layer: Layer) -> Vec3 {
        let Veins { midrib, line, nearest, .. } = self.veins_at(outline, place);
        let mottle = 0.6 * noise(24.0 * place.along, 24.0 * place.across, [256, 256], seed)
            + 0.4 * noise(90.0 * place.along, 90.0 * place.across, [1024, 1024], seed + 100);
        let between = smoothstep(0.05, 0.40, nearest);
        // How this leaf differs from the mean, as the front has it, in linear colour.
        let own = (self.color / GREEN).powf(2.2);
        let [lamina, absorbs] = LAMINA;
        match layer {
            Layer::Front => self.color_at(outline, place, seed),
            Layer::Back => {
                let tissue = own * (0.94 + 0.05 * mottle);
                (0.5 * tissue).lerp(Vec3::new(0.86, 0.80, 0.78), (0.85 * midrib).max(0.60 * line))
            }
            Layer::Through => {
                let glow = own * (0.86 + 0.20 * between + 0.10 * mottle);
                0.5 * glow * (1.0 - 0.72 * midrib) * (1.0 - 0.42 * line)
            }
            Layer::Thickness => Vec3::splat(lamina + (1.0 - lamina) * midrib.max(0.55 * line) + 0.03 * mottle),
            Layer::Absorption => {
                Vec3::splat(absorbs + (0.92 - absorbs) * (0.95 * midrib).max(0.75 * line) + 0.05 * mottle)
            }
            Layer::Relief => Vec3::splat(0.5 + 0.22 * between - 0.35 * midrib - 0.16 * line + 0.02 * mottle),
        }
    }
}

/// The veins at a position on a leaf.
struct Veins {
    /// Distance from the midrib over the half width there, -1..=1.
    across: f32,
    /// 1 on the midrib, 0 beside it.
    midrib: f32,
    /// 1 on a side vein, 0 beside it.
    line: f32,
    /// Position between two side veins, 0..1, and distance to the nearer one, 0..=0.5.
    phase: f32,
    nearest: f32,
}

/// A position on a leaf, in units of the length of its blade.
#[derive(Clone, Copy)]
struct Place {
    along: f32,
    across: f32,
}

impl Place {
    fn of(to: Vec2, axis: Vec2, across: Vec2, blade: f32, bend: f32) -> Self {
        let along = to.dot(axis) / blade;
        Self { along, across: to.dot(across) / blade - bend * along * along }
    }
}

/// The half width of a leaf along its midrib.
struct Outline {
    table: Vec<f32>,
    veins: f32,
}

/// Entries of the table.
const SAMPLES: usize = 256;

impl Outline {
    fn new(shape: LeafShape) -> Self {
        let lobed = shape == LeafShape::Lobed;
        let table = (0..=SAMPLES)
            .map(|i| {
                let u = i as f32 / SAMPLES as f32;
                if lobed {
                    // Obovate, with four rounded lobes per side and narrow sinuses between them.
                    let body = (PI * u.powf(1.25)).sin().max(0.0).powf(0.75) * 0.36;
                    let bay = 0.5 - 0.5 * (TAU * (4.3 * u.powf(1.08) - 0.42)).cos();
                    body * (1.0 - 0.42 * bay * bay * smoothstep(0.05, 0.3, u) * (1.0 - smoothstep(0.84, 0.98, u)))
                } else {
                    // Ovate, with a long tip and a wavy rim.
                    let body = (PI * u.powf(0.82)).sin().max(0.0).powf(0.92) * (1.0 - 0.22 * u) * 0.34;
                    body * (1.0 + 0.025 * (TAU * 8.0 * u).sin())
                }
            })
            .collect();
        Self { table, veins: if lobed { 5.0 } else { 9.0 } }
    }

    fn half_width(&self, along: f32) -> f32 {
        let x = (along.clamp(0.0, 1.0) * SAMPLES as f32).min(SAMPLES as f32 - 0.001);
        let i = x as usize;
        self.table[i] + (self.table[i + 1] - self.table[i]) * (x - i as f32)
    }

    /// Distance to the rim in blade lengths, positive inside; to first order in the slope of the rim.
    fn distance(&self, place: Place, width: f32) -> f32 {
        let beyond = (-place.along).max(place.along - 1.0);
        if beyond > 0.0 {
            return -beyond.hypot(place.across);
        }
        let slope = width * (self.half_width(place.along + 0.01) - self.half_width(place.along - 0.01)) / 0.02;
        (width * self.half_width(place.along) - place.across.abs()) / (1.0 + slope * slope).sqrt()
    }
}
