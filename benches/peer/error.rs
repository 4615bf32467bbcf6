//! What the speed costs in error: each side against its own full models, and the lag of the rounded light.

use std::{fmt::Write, path::Path, sync::Arc};

use canopy::{
    bake::BakedPlant,
    components::Sun,
    cull::cascades::{CascadeBox, cascade_radii},
    light::sun::SunPosition,
    math::srgb_to_linear,
    render::components::SunShadowSettings,
};
use chrono::TimeDelta;
use glam::DVec3;
use image::RgbImage;
use nv_flip::{FlipImageRgb8, FlipPool, flip};

use super::{
    field::{Field, Look},
    ours::Ours,
    stock::Stock,
};

/// Pixels per degree of the usual observer: 0.7 m before a screen of 3840 pixels over 0.7 m.
const PIXELS_PER_DEGREE: f32 = 67.0;
/// Frames of the camera's way that are compared.
const FRAMES: [usize; 2] = [0, 7];

/// The table's head.
pub const HEADING: &str = "\
| trees | hour, UTC | frame of the way | ours against its full models: mean FLIP, relative RMSE, light | stock against its full models | ours after a flight against drawn afresh, mean FLIP |
|--:|--:|--:|---|---|--:|";

fn mean_flip(reference: &RgbImage, test: &RgbImage) -> f32 {
    let image = |picture: &RgbImage| FlipImageRgb8::with_data(picture.width(), picture.height(), picture);
    FlipPool::from_image(&flip(image(reference), image(test), PIXELS_PER_DEGREE)).mean()
}

/// How far an image is from its side's full models.
struct Difference {
    flip: f32,
    /// Root mean square of the difference over that of the reference, in linear light, over the pixels that differ:
    /// unlike FLIP it does not grow with an image's brightness, and stock's images are darker.
    relative: f64,
    /// Light of those pixels, as a share of the reference's.
    light: f64,
}

impl Difference {
    fn new(reference: &RgbImage, test: &RgbImage) -> Self {
        let (mut squared, mut square, mut sum, mut reference_sum) = (0.0, 0.0, 0.0, 0.0);
        for (a, b) in reference.pixels().zip(test.pixels()).filter(|(a, b)| a != b) {
            for (a, b) in a.0.into_iter().zip(b.0) {
                let [a, b] = [a, b].map(|code| f64::from(srgb_to_linear(f32::from(code) / 255.0)));
                squared += (a - b).powi(2);
                square += a * a;
                sum += b;
                reference_sum += a;
            }
        }
        Self { flip: mean_flip(reference, test), relative: (squared / square).sqrt(), light: sum / reference_sum }
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:.4}, {:.2}, {:.2}", self.flip, self.relative, self.light)
    }
}

/// Rows of the table for `field` at each of `hours` (UTC); images go into `out`.
pub fn compare(field: &Field, hours: &[f64], out: Option<&Path>) -> anyhow::Result<String> {
    let full = field.full()?;
    let (mut ours, mut ours_full) = (Ours::new(field)?, Ours::new(&full)?);
    let (mut stock, mut stock_full) = (Stock::new(field)?, Stock::new(&full)?);
    let mut rows = Vec::new();
    for (hour, frame) in hours.iter().flat_map(|hour| (0..=FRAMES[1]).map(move |frame| (hour, frame))) {
        let sky = field.sky_at(*hour);
        let light = field.light(&sky)?;
        let view = field.view(frame);
        let draw = |side: &mut Ours| {
            side.light(&sky);
            side.place(&view);
            side.frame()?;
            side.read()
        };
        // Every frame of the way is flown, so that ours has cached what it would have cached.
        let flown = draw(&mut ours)?;
        if !FRAMES.contains(&frame) {
            continue;
        }
        let truth = draw(&mut ours_full)?;
        let afresh = draw(&mut Ours::new(field)?)?;
        let draw = |side: &mut Stock| {
            side.light(&light);
            side.place(&view);
            side.frame()?;
            side.read()
        };
        let (peer, peer_truth) = (draw(&mut stock)?, draw(&mut stock_full)?);
        if let Some(folder) = out {
            for (name, picture) in
                [("ours", &flown), ("ours-full", &truth), ("stock", &peer), ("stock-full", &peer_truth)]
            {
                picture.save(folder.join(format!("error-{hour}-{frame}-{name}.png")))?;
            }
        }
        rows.push(format!(
            "| {} | {hour} | {frame} | {} | {} | {:.4} |",
            field.stand.trees.len(),
            Difference::new(&truth, &flown),
            Difference::new(&peer_truth, &peer),
            mean_flip(&afresh, &flown),
        ));
    }
    Ok(rows.join("\n"))
}

/// How far the shadow of a cached map is from that of the true sun, at most, over a midsummer day.
pub fn shadow_lag(plant: &Arc<BakedPlant>, look: &Look) -> anyhow::Result<String> {
    let sky = Sun::default();
    let height = f64::from(plant.plant.height()).max(10.0);
    let radii = cascade_radii(look.cascades, look.shadow_distance, SunShadowSettings::default().finest_radius);
    let mut table = String::from(
        "| cascade, m | texel, m | largest lag of the shadow over a day, texels | maps drawn in that day |\n|--:|--:|--:|--:|",
    );
    for radius in radii {
        let (mut worst, mut texel, mut maps, mut last) = (0.0f64, 0.0, 0, DVec3::ZERO);
        for step in 0..24 * 60 * 4 {
            let instant = sky.instant + TimeDelta::seconds(15 * step);
            let direction = SunPosition::at(instant, &sky.observer)?.direction().as_dvec3();
            if direction.y <= 0.0 {
                continue;
            }
            let cascade = CascadeBox::new(DVec3::ZERO, radius, look.shadow_size, direction, height);
            // A shadow from the tree's top falls this far, as far as the map reaches.
            let ray = (height / direction.y).min(2.0 * cascade.half_depth);
            worst = worst.max(direction.angle_between(cascade.direction) * ray / cascade.texel);
            texel = cascade.texel;
            maps += usize::from(cascade.direction != last);
            last = cascade.direction;
        }
        write!(table, "\n| {radius:.0} | {texel:.3} | {worst:.3} | {maps} |")?;
    }
    Ok(table)
}
