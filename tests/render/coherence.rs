//! Coherence of a watercolour's noise over time, by what it is fixed to [Bénard et al. 2011, "State-of-the-art report on
//! temporal coherence for stylized animations"]: flatness, motion coherence, temporal continuity.

use canopy::{
    app::{RenderedImage, Renderer},
    render::components::CanopyStyle,
    scene::Viewpoint,
    style::{NoiseAnchor, Style, Watercolour},
};
use glam::{DVec2, DVec3};

use super::{NOON, draw};
use crate::support::{
    gpu::gpu,
    image::{keep, linear, luminance},
    stage::{PLACE, build, project, quality, view},
};

const SIZE: (u32, u32) = (384, 216);
/// Half the side of the window whose mean is taken off: what remains is the noise.
const WINDOW: i32 = 12;

/// Luminance less its mean around.
struct Grain {
    values: Vec<f64>,
}

impl Grain {
    fn of(picture: &RenderedImage) -> Self {
        let (width, height) = (SIZE.0 as i32, SIZE.1 as i32);
        let light: Vec<f64> = picture.pixels.chunks(3).map(|pixel| luminance(linear(pixel))).collect();
        let at = |x: i32, y: i32| light[(y * width + x) as usize];
        let mean = |x: i32, y: i32| {
            let (mut sum, mut count) = (0.0, 0.0);
            for row in (y - WINDOW).max(0)..(y + WINDOW + 1).min(height) {
                for column in (x - WINDOW).max(0)..(x + WINDOW + 1).min(width) {
                    sum += at(column, row);
                    count += 1.0;
                }
            }
            sum / count
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { values: places.map(|(x, y)| at(x, y) - mean(x, y)).collect() }
    }

    fn at(&self, place: DVec2) -> Option<f64> {
        let p = place - 0.5;
        let (x, y) = (p.x.floor(), p.y.floor());
        let inside = x >= 0.0 && y >= 0.0 && x + 1.0 < f64::from(SIZE.0) && y + 1.0 < f64::from(SIZE.1);
        inside.then(|| {
            let value = |dx: usize, dy: usize| self.values[(y as usize + dy) * SIZE.0 as usize + x as usize + dx];
            let t = p - DVec2::new(x, y);
            let row = |dy: usize| value(0, dy) * (1.0 - t.x) + value(1, dy) * t.x;
            row(0) * (1.0 - t.y) + row(1) * t.y
        })
    }

    /// Steps between neighbours over the deviation, in some rows: how fine the noise is.
    fn fineness(&self, rows: std::ops::Range<usize>) -> f64 {
        let width = SIZE.0 as usize;
        let rows = || rows.clone().map(|row| &self.values[row * width..(row + 1) * width]);
        let steps: f64 = rows().flat_map(|row| row.windows(2)).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
        let squares: f64 = rows().flatten().map(|value| value * value).sum();
        (steps / squares.max(1e-12)).sqrt()
    }
}

/// Where the point of level ground that `from` sees at `pixel` is seen by `other`.
fn moved(pixel: DVec2, from: &Viewpoint, other: &Viewpoint) -> Option<DVec2> {
    let focal = 0.5 * f64::from(SIZE.1) / (0.5 * from.field_of_view).tan();
    let center = 0.5 * DVec2::new(f64::from(SIZE.0), f64::from(SIZE.1));
    let offset = (pixel - center) / focal;
    let direction = from.rotation() * DVec3::new(offset.x, -offset.y, -1.0);
    let distance = -from.position.y / direction.y;
    (distance > 0.0).then(|| project(other, SIZE, from.position + distance * direction)).flatten()
}

/// Correlation of a frame with the one before, moved as the ground has moved; and the mean change over the deviation.
fn coherence(frames: &[(Viewpoint, Grain)]) -> (f64, f64) {
    let (mut product, mut square, mut other, mut change) = (0.0, 0.0, 0.0, 0.0);
    for pair in frames.windows(2) {
        let [(before_view, before), (view, now)] = pair else { continue };
        for row in (SIZE.1 * 11 / 20)..SIZE.1 - 13 {
            for column in 13..SIZE.0 - 13 {
                let pixel = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
                let (Some(a), Some(b)) =
                    (moved(pixel, view, before_view).and_then(|place| before.at(place)), now.at(pixel))
                else {
                    continue;
                };
                product += a * b;
                square += a * a;
                other += b * b;
                change += (a - b).powi(2);
            }
        }
    }
    (product / (square * other).sqrt().max(1e-12), (change / other.max(1e-12)).sqrt())
}

#[test]
fn noise_that_is_fixed_to_the_scene_is_flat_and_moves_with_it() {
    let gpu = gpu();
    let quality = quality(1);
    let stage = build(&format!("(terrain: Flat(size: 400), species: [], trees: None, {PLACE}, {quality})"), &[]).stage;
    let mut renderer = Renderer::new(SIZE, None, 1).expect("a renderer");
    renderer.show(&stage);
    let flight = |name: &str, frame: i32| {
        let t = f64::from(frame);
        match name {
            "turn" => view(&stage, (0.0, 6.0, 60.0), 1.0 * t, -8.0),
            "aside" => view(&stage, (0.15 * t, 6.0, 60.0), 0.0, -8.0),
            _ => view(&stage, (0.0, 6.0, 60.0 - 0.4 * t), 0.0, -8.0),
        }
    };
    let mut figures = Vec::new();
    for noise in [NoiseAnchor::Scene, NoiseAnchor::Page, NoiseAnchor::Solid] {
        let style = Watercolour {
            noise,
            flow: 2.0,
            paper: "hot-pressed".to_owned(),
            granulation: 0.0,
            sketch: 0.0,
            shadow: 0.0,
            air: 0.0,
            ..Watercolour::default()
        };
        renderer.set_style(CanopyStyle::new(Style::Watercolour(style)).expect("a style"));
        for name in ["turn", "aside", "approach"] {
            let frames: Vec<(Viewpoint, Grain)> = (0..4)
                .map(|frame| {
                    let from = flight(name, frame);
                    let picture = draw(&mut renderer, &stage, &from, NOON);
                    keep(&picture, &format!("coherence-{noise:?}-{name}-{frame}"));
                    (from, Grain::of(&picture))
                })
                .collect();
            let (motion, change) = coherence(&frames);
            let grain = &frames[0].1;
            let flatness = grain.fineness(90..104) / grain.fineness(185..205);
            println!("{noise:?}, {name}: motion coherence {motion:.3}, change {change:.3}, flatness {flatness:.2}");
            figures.push((noise, motion, flatness));
        }
    }
    for (noise, motion, flatness) in figures {
        match noise {
            NoiseAnchor::Scene => {
                assert!(motion > 0.95 && (0.6..1.3).contains(&flatness), "{noise:?}: {motion} {flatness}")
            }
            // Controls: what is fixed to the page does not move with the ground, what has one size in metres is no flat noise.
            NoiseAnchor::Page => {
                assert!(motion < 0.85 && (0.6..1.3).contains(&flatness), "{noise:?}: {motion} {flatness}")
            }
            NoiseAnchor::Solid => assert!(motion > 0.5 && flatness > 1.35, "{noise:?}: {motion} {flatness}"),
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
