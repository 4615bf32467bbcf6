//! How wrong a transfer is.

use canopy::bake::lighting::transfer::{TransferBake, exitant_radiance, share};
use canopy::light::LightState;
use canopy::math::luminance;
use glam::Vec3;

use crate::truth::Truth;
use crate::vertices::Vertex;

/// The luminance of what vertices with a white base colour send out from each side, against the truth.
pub struct Judge<'a> {
    pub vertices: &'a [Vertex],
    pub truths: &'a [Truth],
    pub lights: &'a [LightState],
}

/// What a judge finds, percent.
pub struct Verdict {
    /// Over the day: root of the sum of squared errors over vertices and hours, over that of squared truths.
    pub day: f64,
    /// Each hour counting alike: root mean square over the hours of `by_hour`.
    pub hours: f64,
    /// RMS error over the mean of the truth, hour by hour.
    pub by_hour: Vec<f64>,
    /// As `day`, of red, green and blue.
    pub rgb: f64,
    /// Light that clamping added, as a share of all.
    pub clamped: f64,
}

/// Sums of one hour.
#[derive(Default)]
struct Sums {
    errors: f64,
    rgb_errors: f64,
    squares: f64,
    rgb_squares: f64,
    truth: f64,
    count: f64,
}

impl Judge<'_> {
    /// Judges what `of` says that the sides of the vertex (first argument) send out under the light (second).
    pub fn judge_with(
        &self,
        of: impl Fn(usize, usize) -> [Vec3; 2],
        truth: impl Fn(&Truth, usize) -> [Vec3; 2],
    ) -> Verdict {
        let mut all = Vec::new();
        for light in 0..self.lights.len() {
            let mut sums = Sums::default();
            for (index, (v, t)) in self.vertices.iter().zip(self.truths).enumerate() {
                let [front, back] = truth(t, light);
                let want = [front + v.transmission * back, back + v.transmission * front];
                let got = of(index, light);
                for (want, got) in want.into_iter().zip(got).take(1 + usize::from(v.two_sided)) {
                    sums.errors += f64::from(luminance(got - want)).powi(2);
                    sums.rgb_errors += f64::from((got - want).length_squared());
                    sums.squares += f64::from(luminance(want)).powi(2);
                    sums.rgb_squares += f64::from(want.length_squared());
                    sums.truth += f64::from(luminance(want));
                    sums.count += 1.0;
                }
            }
            all.push(sums);
        }
        let total = |f: fn(&Sums) -> f64| all.iter().map(f).sum::<f64>();
        let by_hour: Vec<f64> = all.iter().map(|s| 100.0 * (s.errors * s.count).sqrt() / s.truth).collect();
        Verdict {
            day: 100.0 * (total(|s| s.errors) / total(|s| s.squares)).sqrt(),
            hours: (by_hour.iter().map(|e| e * e).sum::<f64>() / by_hour.len() as f64).sqrt(),
            by_hour,
            rgb: 100.0 * (total(|s| s.rgb_errors) / total(|s| s.rgb_squares)).sqrt(),
            clamped: 0.0,
        }
    }

    /// Judges coefficients of `bands` bands under the skies; `sides_of` gives those of a vertex, front and back.
    pub fn judge<'b>(&self, bands: usize, sides_of: impl Fn(usize) -> [&'b [f32]; 2]) -> Verdict {
        let projected: Vec<Vec<Vec3>> = self.lights.iter().map(|light| light.surroundings().project(bands)).collect();
        let verdict = self.judge_with(
            |index, light| self.exitant(index, &projected[light], sides_of(index)),
            |truth, light| truth.sky[light],
        );
        let (mut added, mut total) = (0.0, 0.0);
        for light in &projected {
            let luminances: Vec<Vec3> = light.iter().map(|l| Vec3::splat(luminance(*l))).collect();
            for side in (0..self.vertices.len()).flat_map(&sides_of) {
                let negative: Vec<f32> = side.iter().map(|c| -c).collect();
                added += f64::from(luminance(share(&luminances, &negative)));
                total += f64::from(luminance(share(&luminances, side)));
            }
        }
        Verdict { clamped: 100.0 * added / total, ..verdict }
    }

    /// What both sides of a vertex send out under the coefficients `light`.
    pub fn exitant(&self, index: usize, light: &[Vec3], [front, back]: [&[f32]; 2]) -> [Vec3; 2] {
        let t = self.vertices[index].transmission;
        [exitant_radiance(light, front, back, Vec3::ONE, t), exitant_radiance(light, back, front, Vec3::ONE, t)]
    }

    /// Judges a bake.
    pub fn judge_bake(&self, bake: &TransferBake) -> Verdict {
        self.judge(usize::from(bake.settings.bands), |index| {
            let v = &self.vertices[index];
            let part = &bake.parts[v.part];
            [part.front_of(v.vertex, &bake.settings), part.back_of(v.vertex, &bake.settings)]
        })
    }

    /// Judges the transfer that is free of noise: what is lost by few bands.
    pub fn judge_truncation(&self, projection: usize, place: usize) -> Verdict {
        self.judge(crate::truth::BANDS[place], |index| {
            let [front, back] = &self.truths[index].transfer[projection][place];
            [front, back]
        })
    }
}
