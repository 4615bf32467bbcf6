//! The image of one object, cut out of its background, and how far one is from another.

use glam::{Vec3, Vec4};

use crate::math::{luminance, srgb_to_linear};

/// An image of one object alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Cutout {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Linear light that the object sends through each pixel (rgb), and how much of the pixel it covers (0..1), row by
    /// row from the top.
    pub pixels: Vec<Vec4>,
}

/// How far the image of a level is from that of the full model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelError {
    /// Root mean square error of linear light before black, over the pixels that either of them covers, as a fraction of
    /// the full model's mean luminance.
    pub rmse: f64,
    /// Covered area, as a fraction of the full model's.
    pub coverage: f64,
    /// Mean luminance of what is covered, as a fraction of the full model's.
    pub luminance: f64,
    /// Local contrast, the mean standard deviation of luminance in blocks of 8 × 8 pixels, as a fraction of the full
    /// model's. The object stands before its own mean luminance, so that its outline hardly counts.
    pub contrast: f64,
}

impl Cutout {
    /// The object in two images of the same view, of `width` pixels a row, before a black and a white background (sRGB,
    /// three bytes a pixel, without a tone curve).
    pub fn new(width: usize, before_black: &[u8], before_white: &[u8]) -> Self {
        let linear = |code: u8| srgb_to_linear(f32::from(code) / 255.0);
        let pixels: Vec<Vec4> = before_black
            .chunks_exact(3)
            .zip(before_white.chunks_exact(3))
            .map(|(black, white)| {
                let [own, bright] = [black, white].map(|rgb| Vec3::new(linear(rgb[0]), linear(rgb[1]), linear(rgb[2])));
                let through = (bright - own).element_sum() / 3.0;
                own.extend((1.0 - through).clamp(0.0, 1.0))
            })
            .collect();
        Self { width, height: pixels.len().checked_div(width).unwrap_or(0), pixels }
    }

    /// The image with the means of `times`² pixels; a rest at the right and lower border is cut off.
    #[must_use]
    pub fn averaged(&self, times: usize) -> Self {
        let times = times.max(1);
        let (width, height) = (self.width / times, self.height / times);
        let mean = |index: usize| {
            let (x, y) = (index % width * times, index / width * times);
            let row = |row: usize| self.pixels[(y + row) * self.width + x..][..times].iter().sum::<Vec4>();
            (0..times).map(row).sum::<Vec4>() / (times * times) as f32
        };
        Self { width, height, pixels: (0..width * height).map(mean).collect() }
    }

    /// The middle of the image, at most `width` by `height` pixels.
    #[must_use]
    pub fn middle(&self, width: usize, height: usize) -> Self {
        let (width, height) = (width.min(self.width), height.min(self.height));
        let (left, top) = ((self.width - width) / 2, (self.height - height) / 2);
        let row = |row: usize| &self.pixels[(top + row) * self.width + left..][..width];
        Self { width, height, pixels: (0..height).flat_map(row).copied().collect() }
    }

    /// Covered area in pixels.
    pub fn area(&self) -> f64 {
        self.pixels.iter().map(|pixel| f64::from(pixel.w)).sum()
    }

    /// Mean luminance of what is covered; 0 where nothing is.
    pub fn mean_luminance(&self) -> f64 {
        let light: f64 = self.pixels.iter().map(|pixel| f64::from(luminance(pixel.truncate()))).sum();
        if self.area() > 0.0 { light / self.area() } else { 0.0 }
    }

    /// The linear image before a background of one colour.
    pub fn before(&self, background: Vec3) -> Vec<Vec3> {
        self.pixels.iter().map(|pixel| pixel.truncate() + (1.0 - pixel.w) * background).collect()
    }

    /// Mean standard deviation of luminance in blocks of 8 × 8 pixels (smaller at the right and lower border), each
    /// weighted with its covered area, before a background of `luminance`.
    fn local_contrast(&self, background: f32) -> f64 {
        const BLOCK: usize = 8;
        let (mut sum, mut weight) = (0.0, 0.0);
        for top in (0..self.height).step_by(BLOCK) {
            for left in (0..self.width).step_by(BLOCK) {
                let (mut count, mut first, mut second, mut covered) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
                for y in top..(top + BLOCK).min(self.height) {
                    for x in left..(left + BLOCK).min(self.width) {
                        let pixel = self.pixels[y * self.width + x];
                        let value = f64::from(luminance(pixel.truncate()) + (1.0 - pixel.w) * background);
                        count += 1.0;
                        first += value;
                        second += value * value;
                        covered += f64::from(pixel.w);
                    }
                }
                let mean = first / count;
                sum += covered * (second / count - mean * mean).max(0.0).sqrt();
                weight += covered;
            }
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// How far this image is from that of the full model, `truth`, of the same size. Ratios to nothing are 1.
    pub fn error(&self, truth: &Self) -> LevelError {
        let ratio = |own: f64, other: f64| if other > 0.0 { own / other } else { 1.0 };
        let mean = truth.mean_luminance();
        let (mut square, mut covered) = (0.0, 0.0);
        for (own, other) in self.pixels.iter().zip(&truth.pixels) {
            square += f64::from((own.truncate() - other.truncate()).length_squared()) / 3.0;
            covered += f64::from(own.w.max(other.w));
        }
        let rmse = if covered > 0.0 { (square / covered).sqrt() } else { 0.0 };
        LevelError {
            rmse: if mean > 0.0 { rmse / mean } else { 0.0 },
            coverage: ratio(self.area(), truth.area()),
            luminance: ratio(self.mean_luminance(), mean),
            contrast: ratio(self.local_contrast(mean as f32), truth.local_contrast(mean as f32)),
        }
    }
}

impl LevelError {
    /// The mean of several errors.
    pub fn mean(errors: &[Self]) -> Self {
        let count = errors.len().max(1) as f64;
        let of = |value: fn(&Self) -> f64| errors.iter().map(value).sum::<f64>() / count;
        Self {
            rmse: of(|error| error.rmse),
            coverage: of(|error| error.coverage),
            luminance: of(|error| error.luminance),
            contrast: of(|error| error.contrast),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(size: usize, light: f32, radius: f32) -> Cutout {
        let half = 0.5 * size as f32;
        let inside = |i: usize| ((i % size) as f32 + 0.5 - half).hypot((i / size) as f32 + 0.5 - half) < radius;
        let pixels = (0..size * size).map(|i| if inside(i) { Vec3::splat(light).extend(1.0) } else { Vec4::ZERO });
        Cutout { width: size, height: size, pixels: pixels.collect() }
    }

    #[test]
    fn an_object_is_cut_out_of_its_backgrounds() {
        // Half covered by grey, then nothing, then all.
        let code = |linear: f32| (255.0 * crate::math::linear_to_srgb(linear)).round() as u8;
        let black = [code(0.1), 0, code(0.4)].map(|grey| [grey; 3]).concat();
        let white = [code(0.6), 255, code(0.4)].map(|grey| [grey; 3]).concat();
        let cutout = Cutout::new(3, &black, &white);
        for (pixel, (light, coverage)) in cutout.pixels.iter().zip([(0.1, 0.5), (0.0, 0.0), (0.4, 1.0)]) {
            assert!((pixel.x - light).abs() < 0.01 && (pixel.w - coverage).abs() < 0.01, "{pixel}");
        }
        assert!((cutout.before(Vec3::ONE)[0].x - 0.6).abs() < 0.01);
    }

    #[test]
    fn the_same_has_no_error_and_other_discs_have_theirs() {
        let truth = disc(64, 0.2, 20.0);
        let same = truth.error(&truth);
        assert!(same.rmse == 0.0 && same.coverage == 1.0 && same.luminance == 1.0);
        let brighter = disc(64, 0.3, 20.0).error(&truth);
        assert!((brighter.luminance - 1.5).abs() < 1e-5 && (brighter.rmse - 0.5).abs() < 1e-5, "{brighter:?}");
        let smaller = disc(64, 0.2, 10.0).error(&truth);
        assert!((smaller.coverage - 0.25).abs() < 0.02 && (smaller.luminance - 1.0).abs() < 1e-5);
        let nothing = disc(64, 0.2, 0.0);
        assert!(nothing.error(&nothing).coverage == 1.0 && truth.error(&nothing).rmse.is_finite());
    }

    #[test]
    fn noise_has_contrast_and_its_mean_has_less() {
        let mut noisy = disc(64, 0.2, 30.0);
        for (index, pixel) in noisy.pixels.iter_mut().enumerate().filter(|(_, pixel)| pixel.w > 0.0) {
            let light = if (index + index / 64) % 2 == 0 { 0.1 } else { 0.3 };
            *pixel = Vec3::splat(light).extend(1.0);
        }
        let flat = disc(64, 0.2, 30.0).error(&noisy);
        assert!(flat.contrast < 0.2 && (flat.luminance - 1.0).abs() < 0.01, "{flat:?}");
        let (small, middle) = (noisy.averaged(2), noisy.middle(8, 8));
        assert_eq!((small.width, small.height), (32, 32));
        assert!((small.area() * 4.0 - noisy.area()).abs() < 1e-3);
        assert!(middle.pixels.len() == 64 && middle.area() == 64.0);
    }
}
