//! The sun's shadow: that it is there, where it must be, whatever was drawn before.

use std::sync::{Arc, OnceLock};

use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition},
    render::components::{Daylight, Forest, Ground, SunShadowSettings},
    scene::Viewpoint,
};
use glam::{DVec2, DVec3};

use super::{NOON, SIZE, again, draw, showing};
use crate::support::{
    gpu::gpu,
    image::{difference, keep, linear, luminance, mean_color},
    stage::{grove, project, trees_at, view},
};

/// The light of a sun at this bearing and elevation, degrees.
fn daylight(azimuth: f64, elevation: f64) -> Daylight {
    static AIR: OnceLock<Atmosphere> = OnceLock::new();
    let air = AIR.get_or_init(|| Atmosphere::new(AtmosphereParams::with_visibility_km(60.0)).expect("the air"));
    let sun = SunPosition::from_degrees(azimuth, elevation).expect("a sun");
    Daylight(Arc::new(LightState::new(air, sun, None, &LightSettings::default()).expect("its light")))
}

/// Straight down from 45 m over the middle: 75 m by 42 m of ground.
fn from_above(stage: &Stage) -> Viewpoint {
    view(stage, (0.0, 45.0, 0.0), 0.0, -90.0)
}

#[track_caller]
fn lit(renderer: &mut Renderer, view: &Viewpoint, light: Daylight, shadow: SunShadowSettings) -> RenderedImage {
    renderer.set_view(view);
    renderer.app().world_mut().insert_resource(light);
    renderer.set_shadow(shadow);
    again(renderer)
}

fn settings(cascades: usize) -> SunShadowSettings {
    SunShadowSettings {
        map_size: 1024,
        cascades,
        finest_radius: 100.0,
        distance: 100.0,
        proxy_distance: 0.0,
        softness: 0.0,
    }
}

#[track_caller]
fn patch(picture: &RenderedImage, view: &Viewpoint, point: DVec3) -> f64 {
    let at = project(view, SIZE, point).expect("before the camera");
    luminance(mean_color(picture, |column, row| {
        (DVec2::new(f64::from(column), f64::from(row)) + 0.5 - at).abs().max_element() <= 2.5
    }))
}

/// Shows trees that cast and are not seen: nothing hides their shadow. Large, so that a shadow's rim is little of it.
fn shadow_alone(stage: &Stage) -> Renderer {
    let mut renderer = Renderer::new((480, 270), None, 1).expect("a renderer");
    let unseen = Forest { view_distance: -1.0, ..stage.forest().expect("a forest") };
    renderer.app().world_mut().spawn(unseen);
    renderer.app().world_mut().spawn(Ground { cover: None, ..stage.ground() });
    renderer
}

/// The part of the light that each pixel has lost, 0..=1.
fn lost(with: &RenderedImage, without: &RenderedImage) -> Vec<f64> {
    let part = |(with, without): (&[u8], &[u8])| {
        1.0 - (luminance(linear(with)) / luminance(linear(without)).max(1e-6)).min(1.0)
    };
    with.pixels.chunks(3).zip(without.pixels.chunks(3)).map(part).collect()
}

#[test]
fn a_tree_shades_the_ground_behind_it_and_no_other() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::ZERO], 1);
    let from = from_above(&built.stage);
    let mut renderer = showing(&built.stage);
    for (proxy_distance, name) in [(0.0, "cross"), (50.0, "model")] {
        let light = daylight(180.0, 35.0);
        let without = lit(&mut renderer, &from, light.clone(), settings(0));
        let with = lit(&mut renderer, &from, light, SunShadowSettings { proxy_distance, ..settings(1) });
        keep(&with, &format!("shadow-{name}"));
        let share = |point: DVec3| patch(&with, &from, point) / patch(&without, &from, point);
        // The crown's middle, seven metres up, falls ten metres north of the foot.
        let (shade, south, east) =
            (share(DVec3::new(0.0, 0.0, -10.0)), share(DVec3::new(0.0, 0.0, 12.0)), share(DVec3::new(14.0, 0.0, -2.0)));
        assert!(shade < 0.75, "{name}: {shade} of the light is left in the shadow");
        assert!((south - 1.0).abs() < 0.03 && (east - 1.0).abs() < 0.03, "{name}: {south} and {east} beside it");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn the_shadow_of_a_cross_keeps_its_area_whatever_the_suns_bearing() {
    let _gpu = gpu();
    let built = trees_at(&[DVec2::ZERO], 1);
    let from = from_above(&built.stage);
    let mut renderer = shadow_alone(&built.stage);
    for elevation in [25.0, 40.0, 55.0] {
        let areas: Vec<f64> = (0..12)
            .map(|step| {
                let light = daylight(f64::from(step) * 30.0 + 7.0, elevation);
                let without = lit(&mut renderer, &from, light.clone(), settings(0));
                let with = lit(&mut renderer, &from, light, settings(1));
                keep(&with, &format!("shadow-area-{elevation}-{step:02}"));
                lost(&with, &without).iter().sum()
            })
            .collect();
        let (low, high) = areas.iter().fold((f64::MAX, 0f64), |(low, high), &area| (low.min(area), high.max(area)));
        println!("{elevation} degrees: {areas:.1?}");
        assert!(low > 200.0, "at {elevation} degrees there is hardly a shadow: {areas:?}");
        let varies = (high - low) / (areas.iter().sum::<f64>() / areas.len() as f64);
        assert!(
            varies < 0.1,
            "at {elevation} degrees the shadow's area varies by {varies:.3} of its mean: {areas:.1?}"
        );
    }
}

#[test]
fn a_kept_shadow_is_the_one_that_would_be_drawn() {
    let _gpu = gpu();
    let built = grove(4);
    let stage = &built.stage;
    let here = view(stage, (10.0, 4.0, 30.0), 350.0, -6.0);
    let aside = Viewpoint { position: here.position + DVec3::new(0.05, 0.02, -0.04), ..here };
    let mut kept = showing(stage);
    draw(&mut kept, stage, &here, NOON);
    let ran = |lines: &[String]| {
        let cascades: Vec<_> = lines.iter().filter(|line| line.contains("sun_shadow cascade")).cloned().collect();
        assert_eq!(cascades.len(), 2, "{lines:?}");
        cascades.iter().filter(|line| line.contains(": ran")).count()
    };
    assert_eq!(ran(&kept.explain()), 2);
    // Under a new light the maps hold what the first view sees; the second completes them, the third finds them whole.
    let between = Viewpoint { position: here.position + DVec3::new(0.02, 0.01, -0.02), ..here };
    draw(&mut kept, stage, &between, NOON);
    assert_eq!(ran(&kept.explain()), 2, "{:?}", kept.explain());
    let picture = draw(&mut kept, stage, &aside, NOON);
    assert_eq!(ran(&kept.explain()), 0, "{:?}", kept.explain());
    let fresh = draw(&mut showing(stage), stage, &aside, NOON);
    assert!(picture == fresh, "mean FLIP {}", difference(&picture, &fresh));
    // A sun that moved is seen.
    draw(&mut kept, stage, &aside, "2026-06-21T12:40+01:00");
    assert_eq!(ran(&kept.explain()), 2, "{:?}", kept.explain());
}

#[test]
fn a_soft_shadow_keeps_its_light_and_has_the_edge_that_it_was_given() {
    let gpu = gpu();
    let built = trees_at(&[DVec2::ZERO], 1);
    let from = from_above(&built.stage);
    let mut renderer = shadow_alone(&built.stage);
    let light = daylight(180.0, 40.0);
    let without = lit(&mut renderer, &from, light.clone(), settings(0));
    let mut shadow = |softness: f64, cascades: usize| -> Vec<f64> {
        let with = lit(&mut renderer, &from, light.clone(), SunShadowSettings { softness, ..settings(cascades) });
        keep(&with, &format!("shadow-soft-{softness}-{cascades}"));
        lost(&with, &without)
    };
    // The greatest step between neighbours of a row, and the sum.
    let of = |lost: &[f64]| {
        let step =
            lost.chunks(480).flat_map(|row| row.windows(2)).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        (step, lost.iter().sum::<f64>())
    };
    let (sharp, whole) = of(&shadow(0.0, 1));
    for cascades in [1, 2] {
        let mut last = sharp;
        for softness in [0.5, 1.5] {
            let (step, sum) = of(&shadow(softness, cascades));
            println!(
                "{softness} m, {cascades} maps: greatest step {step:.3} of {sharp:.3}, light lost {:.3}",
                sum / whole
            );
            assert!(step < 0.9 * last, "{softness} m: {step} after {last}");
            assert!((sum / whole - 1.0).abs() < 0.08, "{softness} m: {sum} of {whole}");
            last = step;
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
