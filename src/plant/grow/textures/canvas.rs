//! A canvas of sRGB colours with coverage, and its conversion to a texture.

use glam::{Vec2, Vec3, Vec4};
use image::{Rgba, RgbaImage};

/// A square canvas. A pixel holds colour times coverage, and coverage.
pub(super) struct Canvas {
    size: usize,
    pixels: Vec<Vec4>,
}

impl Canvas {
    /// An empty canvas.
    pub fn new(size: usize) -> Self {
        Self { size, pixels: vec![Vec4::ZERO; size * size] }
    }

    /// The pixels whose centres lie in the box, each with its centre.
    pub fn within(&self, low: Vec2, high: Vec2) -> impl Iterator<Item = (usize, Vec2)> + use<> {
        let size = self.size;
        let clamp = |x: f32| x.clamp(0.0, size as f32) as usize;
        let (x0, x1) = (clamp(low.x.floor()), clamp(high.x.ceil()));
        let (y0, y1) = (clamp(low.y.floor()), clamp(high.y.ceil()));
        (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (y * size + x, Vec2::new(x as f32 + 0.5, y as f32 + 0.5))))
    }

    /// Blends a colour over a pixel.
    pub fn over(&mut self, pixel: usize, color: Vec3, coverage: f32) {
        let coverage = coverage.clamp(0.0, 1.0);
        self.pixels[pixel] = self.pixels[pixel] * (1.0 - coverage) + color.extend(1.0) * coverage;
    }

    /// Blends a colour over a pixel that is seen through: what lies there already dims it, to its own value times `pass`
    /// relative to white.
    pub fn over_filter(&mut self, pixel: usize, color: Vec3, pass: f32, coverage: f32) {
        let behind = self.pixels[pixel].w;
        self.over(pixel, color * (1.0 - behind + behind * pass), coverage);
    }

    /// Darkens a pixel.
    pub fn shade(&mut self, pixel: usize, factor: f32) {
        let old = self.pixels[pixel];
        self.pixels[pixel] = (old.truncate() * factor).extend(old.w);
    }

    /// Darkens the pixels within `reach` of the line between two points: by `factor` at the line, less farther away.
    pub fn shadow(&mut self, a: Vec2, b: Vec2, reach: f32, factor: f32) {
        let (axis, margin) = (b - a, Vec2::splat(reach));
        let along = axis / axis.length_squared().max(1e-6);
        for (pixel, center) in self.within(a.min(b) - margin, a.max(b) + margin) {
            let to = center - a;
            let near = 1.0 - (to.distance(axis * to.dot(along).clamp(0.0, 1.0)) / reach).min(1.0);
            self.shade(pixel, 1.0 - (1.0 - factor) * near * near * (3.0 - 2.0 * near));
        }
    }

    /// Draws a stroke between two points with the half widths `r0` and `r1`, shaded as a round body. `color` is that of
    /// its middle.
    pub fn stroke(&mut self, a: Vec2, b: Vec2, r0: f32, r1: f32, color: Vec3) {
        let reach = Vec2::splat(r0.max(r1) + 1.0);
        let axis = b - a;
        let along = axis / axis.length_squared().max(1e-6);
        let across = axis.perp().normalize_or(Vec2::X);
        for (pixel, center) in self.within(a.min(b) - reach, a.max(b) + reach) {
            let to = center - a;
            let t = to.dot(along).clamp(0.0, 1.0);
            let radius = r0 + (r1 - r0) * t;
            let distance = to.distance(axis * t);
            // A stroke that is thinner than a pixel is fainter.
            let coverage = (radius - distance + 0.5).clamp(0.0, 1.0) * (2.0 * radius).min(1.0);
            if coverage > 0.0 {
                let round = 1.0 - 0.28 * (to.dot(across) / radius.max(0.5)).clamp(-1.0, 1.0).abs().powi(2);
                self.over(pixel, color * round, coverage);
            }
        }
    }

    /// The finished texture. A pyramid of averages spreads colours from covered pixels into transparent ones (Gortler
    /// et al. 1996, "The Lumigraph", pull-push), so that filtering and mipmaps do not pick up other colours.
    pub fn finish(self) -> RgbaImage {
        let mut levels = vec![self.pixels];
        let mut size = self.size;
        while size > 1 {
            let half = size / 2;
            let fine = &levels[levels.len() - 1];
            let at = |x: usize, y: usize| fine[y * size + x];
            let coarse = (0..half * half)
                .map(|i| {
                    let (x, y) = (2 * (i % half), 2 * (i / half));
                    0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
                })
                .collect();
            levels.push(coarse);
            size = half;
        }
        let mut fill = levels.pop().unwrap_or_default();
        while let Some(level) = levels.pop() {
            let (width, half) = (size * 2, size);
            fill = level
                .iter()
                .enumerate()
                .map(|(i, &pixel)| {
                    let below = fill[(i / width / 2).min(half - 1) * half + (i % width / 2).min(half - 1)];
                    let below = below.truncate() / below.w.max(1e-6);
                    // A partly covered pixel keeps its own colour.
                    let known = if pixel.w > 0.02 { 1.0 } else { pixel.w / 0.02 };
                    (below * (1.0 - known) + pixel.truncate() / pixel.w.max(1e-6) * known).extend(1.0)
                })
                .collect();
            if levels.is_empty() {
                let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                return RgbaImage::from_fn(width as u32, width as u32, |x, y| {
                    let i = y as usize * width + x as usize;
                    Rgba([byte(fill[i].x), byte(fill[i].y), byte(fill[i].z), byte(level[i].w)])
                });
            }
            size = width;
        }
        RgbaImage::new(1, 1)
    }
}
