//! Light of the sun: the leaf shader with an ideal shadow map, and a sun in spherical harmonics.

use canopy::light::sh;
use glam::Vec3;

use crate::judge::Judge;
use crate::truth::{BANDS, PROJECTIONS};

/// The table of the sun.
pub fn sun(judge: &Judge) {
    println!("\n## Sun\n\n| | over the day, % | hours alike, % |\n|---|--:|--:|");
    let leaf = judge.judge_with(|index, light| leaf_shader(judge, index, light), |truth, light| truth.sun[light]);
    println!("| leaf shader times visibility | {:.1} | {:.1} |", leaf.day, leaf.hours);
    for (place, &bands) in BANDS.iter().enumerate() {
        for (projection, name) in PROJECTIONS.iter().enumerate() {
            let verdict = judge.judge_with(
                |index, light| {
                    let [front, back] = &judge.truths[index].transfer[projection][place];
                    let mut basis = vec![0.0; bands * bands];
                    let state = &judge.lights[light];
                    sh::basis_into(state.sun_direction, &mut basis);
                    let seen = f32::from(u8::from(judge.truths[index].sees_sun[light]));
                    let disc: Vec<Vec3> = basis.iter().map(|y| state.sun_illuminance * *y * seen).collect();
                    judge.exitant(index, &disc, [front, back])
                },
                |truth, light| truth.sun[light],
            );
            println!(
                "| sun in {bands} bands ({name:?}) times visibility | {:.1} | {:.1} |",
                verdict.day, verdict.hours
            );
        }
    }
}

/// What the shader's `shade` has for the key light, with a shadow map that knows what every vertex sees.
fn leaf_shader(judge: &Judge, index: usize, light: usize) -> [Vec3; 2] {
    let (v, state) = (&judge.vertices[index], &judge.lights[light]);
    if !judge.truths[index].sees_sun[light] {
        return [Vec3::ZERO; 2];
    }
    let cosine = v.normal.dot(state.sun_direction);
    let side = |cosine: f32| state.sun_illuminance * cosine.max(0.0) / std::f32::consts::PI;
    let (front, back) = (side(cosine), side(-cosine));
    [front + v.transmission * back, back + v.transmission * front]
}
