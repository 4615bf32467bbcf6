//! Alternating frames, and what their times say.

use std::{
    fmt,
    time::{Duration, Instant},
};

use anyhow::ensure;
use clap::ValueEnum;

use super::{field::Field, ours::Ours, stock::Stock};

/// Largest difference between the sum of the frames' times and the wall time, as a share.
const TOLERANCE: f64 = 0.03;

/// What moves besides the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Series {
    /// The sun rests.
    SunFixed,
    /// The sun moves five minutes a frame, so that every cascade is drawn again.
    SunMoving,
}

impl fmt::Display for Series {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::SunFixed => "sun-fixed",
            Self::SunMoving => "sun-moving",
        })
    }
}

/// The table's head.
pub const HEADING: &str = "\
| trees | sun | ours, ms: median (min to max; mean) | stock, ms: median (min to max; mean) | ratio of medians | median of pairs | ratio of means |
|--:|---|---|---|--:|--:|--:|";

/// Frame times in milliseconds; a side that was not run has none.
pub struct Runs {
    ours: Vec<f64>,
    stock: Vec<f64>,
}

/// Draws `warm_up` frames untimed, then `frames` timed ones of each side, in turn.
pub fn alternate(
    field: &Field,
    series: Series,
    warm_up: usize,
    frames: usize,
    ours: &mut Option<Ours>,
    stock: &mut Option<Stock>,
) -> anyhow::Result<Runs> {
    let moving = series == Series::SunMoving;
    let skies: Vec<_> = (0..warm_up + frames).map(|frame| field.sky(frame, moving)).collect();
    // Stock Bevy has no sky model: what its user turns is a light, and this costs no frame time.
    let lights = skies.iter().map(|sky| field.light(sky)).collect::<Result<Vec<_>, _>>()?;
    let mut runs = Runs { ours: Vec::new(), stock: Vec::new() };
    let mut wall = Duration::ZERO;
    for (frame, (sky, light)) in skies.iter().zip(&lights).enumerate() {
        let view = field.view(frame);
        let both = Instant::now();
        if let Some(ours) = ours {
            let start = Instant::now();
            ours.light(sky);
            ours.place(&view);
            ours.frame()?;
            runs.ours.push(milliseconds(start.elapsed()));
        }
        if let Some(stock) = stock {
            let start = Instant::now();
            stock.light(light);
            stock.place(&view);
            stock.frame()?;
            runs.stock.push(milliseconds(start.elapsed()));
        }
        if frame >= warm_up {
            wall += both.elapsed();
        }
    }
    runs.ours.drain(..warm_up.min(runs.ours.len()));
    runs.stock.drain(..warm_up.min(runs.stock.len()));
    // What is still queued after the last frame would have been missed by the frames' own times.
    let start = Instant::now();
    if let Some(stock) = stock {
        stock.wait()?;
    }
    wall += start.elapsed();
    let summed: f64 = runs.ours.iter().chain(&runs.stock).sum();
    let wall = milliseconds(wall);
    ensure!(
        (summed - wall).abs() <= TOLERANCE * wall,
        "the frames' times add up to {summed:.1} ms, but {wall:.1} ms went by"
    );
    Ok(runs)
}

fn milliseconds(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn summary(times: &[f64]) -> String {
    if times.is_empty() {
        return "not run".to_owned();
    }
    let least = times.iter().copied().fold(f64::INFINITY, f64::min);
    let most = times.iter().copied().fold(0.0, f64::max);
    format!("{:.0} ({least:.0} to {most:.0}; {:.0})", median(times), mean(times))
}

impl Runs {
    /// The table's row.
    pub fn row(&self, trees: u32, series: Series) -> String {
        let pairs: Vec<f64> = self.ours.iter().zip(&self.stock).map(|(ours, stock)| stock / ours).collect();
        let ratios = if pairs.is_empty() {
            "- | - | -".to_owned()
        } else {
            let medians = median(&self.stock) / median(&self.ours);
            let means = mean(&self.stock) / mean(&self.ours);
            format!("{medians:.2} | {:.2} | {means:.2}", median(&pairs))
        };
        format!("| {trees} | {series} | {} | {} | {ratios} |", summary(&self.ours), summary(&self.stock))
    }
}
