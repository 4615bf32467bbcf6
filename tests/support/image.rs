//! Images against references, by mean FLIP [Andersson et al. 2020]: about 0.001 for a few changed pixels, 0.03 for
//! another lighting of the same scene, 0.3 for another scene.

use std::path::{Path, PathBuf};

use canopy::app::RenderedImage;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageFloat, FlipImageRgb8, FlipPool, flip, magma_lut};

/// Greatest mean FLIP between drivers that draw the same thing.
pub const SAME: f32 = 0.02;

fn references() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images")
}

fn failures() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("test-images")
}

/// Keeps an image for later inspection.
pub fn keep(picture: &RenderedImage, name: &str) {
    let _ = picture.save(&failures().join(format!("{name}.png")), &[]);
}

fn difference_map(actual: &RenderedImage, reference: &RenderedImage) -> FlipImageFloat {
    let image = |picture: &RenderedImage| FlipImageRgb8::with_data(picture.width, picture.height, &picture.pixels);
    flip(image(reference), image(actual), DEFAULT_PIXELS_PER_DEGREE)
}

/// Mean FLIP between two images, 0 to 1; 1 where their sizes differ.
pub fn difference(actual: &RenderedImage, reference: &RenderedImage) -> f32 {
    if (actual.width, actual.height) != (reference.width, reference.height) {
        return 1.0;
    }
    FlipPool::from_image(&difference_map(actual, reference)).mean()
}

fn load(path: &Path) -> Result<RenderedImage, String> {
    let image = image::open(path).map_err(|error| format!("{}: {error}; CANOPY_BLESS=1 writes it", path.display()))?;
    let image = image.to_rgb8();
    Ok(RenderedImage { width: image.width(), height: image.height(), pixels: image.into_raw() })
}

/// Compares an image with the reference `name`; a mean FLIP above `threshold` is an error that says where the
/// image and the map of its differences are. With `CANOPY_BLESS=1` the image becomes the reference.
pub fn check(actual: &RenderedImage, name: &str, threshold: f32) -> Result<(), String> {
    let path = references().join(format!("{name}.png"));
    if actual.pixels.chunks(3).all(|pixel| pixel == &actual.pixels[..3]) {
        return Err(format!("{name}: the image has one colour only, which checks nothing"));
    }
    if std::env::var_os("CANOPY_BLESS").is_some_and(|value| value == "1") {
        return actual.save(&path, &[]).map_err(|error| error.to_string());
    }
    let reference = load(&path)?;
    let difference = difference(actual, &reference);
    if difference <= threshold {
        return Ok(());
    }
    keep(actual, &format!("{name}-actual"));
    let mut shown = "sizes differ".to_owned();
    if (actual.width, actual.height) == (reference.width, reference.height) {
        let map = difference_map(actual, &reference).apply_color_lut(&magma_lut());
        let map = RenderedImage { width: actual.width, height: actual.height, pixels: map.to_vec() };
        keep(&map, &format!("{name}-difference"));
        shown = format!("mean FLIP {difference:.4}, above {threshold}");
    }
    Err(format!("{name}: {shown}; see {}", failures().display()))
}

/// [`check`] for a test.
#[track_caller]
pub fn compare(actual: &RenderedImage, name: &str, threshold: f32) {
    if let Err(message) = check(actual, name, threshold) {
        panic!("{message}");
    }
}

/// sRGB bytes of one pixel as linear light, 0 to 1.
pub fn linear(pixel: &[u8]) -> [f64; 3] {
    [0, 1, 2].map(|channel| {
        let value = f64::from(pixel[channel]) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    })
}

/// Mean linear colour over the pixels `select` (column, row) takes; panics where there are none.
#[track_caller]
pub fn mean_color(picture: &RenderedImage, select: impl Fn(u32, u32) -> bool) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0u32);
    for (index, pixel) in picture.pixels.chunks_exact(3).enumerate() {
        let (column, row) = (index as u32 % picture.width, index as u32 / picture.width);
        if select(column, row) {
            let color = linear(pixel);
            (0..3).for_each(|channel| sum[channel] += color[channel]);
            count += 1;
        }
    }
    assert!(count > 0, "no pixel was selected");
    sum.map(|channel| channel / f64::from(count))
}

/// Relative luminance of a linear Rec. 709 colour.
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

#[test]
fn a_comparison_fails_where_it_should() {
    let (width, height) = (64, 48);
    let pattern = |shift: u32| {
        let pixel = |i: u32| {
            let (x, y) = (i % width + shift, i / width);
            if (x / 8 + y / 8) % 2 == 0 { [40, 90, 30] } else { [200, 190, 160] }
        };
        RenderedImage { width, height, pixels: (0..width * height).flat_map(pixel).collect() }
    };
    assert_eq!(difference(&pattern(0), &pattern(0)), 0.0);
    assert!(difference(&pattern(0), &pattern(4)) > 5.0 * SAME, "a shifted pattern is another image");
    let mut darker = pattern(0);
    darker.pixels.iter_mut().for_each(|value| *value = (f32::from(*value) * 0.85) as u8);
    assert!(difference(&darker, &pattern(0)) > SAME, "{}", difference(&darker, &pattern(0)));
    let narrow = RenderedImage { width: 32, height: 48, pixels: vec![9; 32 * 48 * 3] };
    assert_eq!(difference(&narrow, &pattern(0)), 1.0);
    assert!(check(&narrow, "one-colour", 1.0).is_err_and(|message| message.contains("one colour only")));
}
