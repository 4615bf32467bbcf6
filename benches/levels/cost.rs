//! A frame of many trees, all of them as one level. The contestants take turns.

use std::sync::Arc;
use std::time::Instant;

use canopy::app::Renderer;
use canopy::components::Sun;
use canopy::lod::{Levels, Representation};
use canopy::render::components::{Forest, SunShadowSettings};
use canopy::scatter::{PackedStand, Stand, Tree, packed::DEFAULT_CELL_SIZE};
use canopy::scene::Pose;
use glam::DVec3;

use super::{errors::baked, trees};

/// Trees along a side of the square that they stand in.
const SIDE: usize = 20;
const ROUNDS: usize = 7;
/// Size of the images.
const SIZE: (u32, u32) = (640, 360);

pub fn cost() {
    println!();
    println!("| tree | shadows | level | frame, ms | more than none, ms | per tree, µs |");
    println!("|---|---|---|--:|--:|--:|");
    for (name, plant) in trees() {
        let plant = baked(plant);
        let spacing = 1.2 * f64::from(plant.plant.bounds().map_or(1.0, |bounds| bounds.size().x.max(bounds.size().z)));
        let place = |index: usize| Tree {
            position: DVec3::new((index % SIDE) as f64, 0.0, (index / SIDE) as f64) * spacing,
            yaw: index as f32,
            scale: 1.0,
            variant: 0,
            tint: 0.0,
            index: index as u32,
        };
        let stand = Stand { trees: (0..SIDE * SIDE).map(place).collect() };
        let stand = Arc::new(PackedStand::new(&stand, DEFAULT_CELL_SIZE, &[plant.size()]).expect("a stand"));
        let plants = Arc::new(vec![plant.clone()]);
        for cascades in [0, 4] {
            let mut renderer = Renderer::new(SIZE, None, 4).expect("a renderer");
            renderer.set_shadow(SunShadowSettings { cascades, ..SunShadowSettings::default() });
            renderer.set_sun(Sun::default());
            let middle = 0.5 * SIDE as f64 * spacing;
            let levels = [
                None,
                Some(Representation::MODEL),
                Some(Representation::THINNED),
                Some(Representation::CLOUD),
                Some(Representation::CROSS),
            ];
            let mut times = vec![Vec::new(); levels.len()];
            for round in 0..ROUNDS {
                for (level, times) in levels.iter().zip(&mut times) {
                    let forest = level.map(|level| {
                        let forest = Forest {
                            stand: stand.clone(),
                            plants: plants.clone(),
                            suns: Arc::from([]),
                            origin: DVec3::ZERO,
                            levels: Levels::only(level),
                            view_distance: 1e5,
                        };
                        renderer.app().world_mut().spawn(forest).id()
                    });
                    // From above the trees' height, so that most are seen; another place in each frame.
                    let view = |step: usize| {
                        let x = middle + 0.5 * step as f64;
                        let height = 2.0 * f64::from(plant.size().height);
                        Pose { position: (x, height, middle + 1.4 * SIDE as f64 * spacing), yaw: 0.0, pitch: -12.0 }
                            .viewpoint(0.0, 40.0)
                    };
                    for step in 0..2 {
                        renderer.set_view(&view(2 * round + step));
                        let started = Instant::now();
                        renderer.update().expect("a frame");
                        // The first frame uploads.
                        if step == 1 && round > 0 {
                            times.push(started.elapsed().as_secs_f64() * 1e3);
                        }
                    }
                    if let Some(forest) = forest {
                        renderer.app().world_mut().despawn(forest);
                    }
                }
            }
            let median = |times: &[f64]| {
                let mut sorted = times.to_vec();
                sorted.sort_by(f64::total_cmp);
                sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
            };
            let none = median(&times[0]);
            for (level, times) in levels.iter().zip(&times) {
                let frame = median(times);
                println!(
                    "| {name} | {} | {} | {frame:.0} | {:.0} | {:.0} |",
                    if cascades == 0 { "no" } else { "yes" },
                    level.map_or("none", Representation::name),
                    frame - none,
                    (frame - none) * 1e3 / (SIDE * SIDE) as f64,
                );
            }
        }
    }
}
