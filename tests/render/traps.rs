//! Cameras and stands at the end of what is possible: an image of finite colours, and no complaint of the device.

use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    scene::Pose,
};
use glam::DVec2;

use super::{NOON, draw, showing};
use crate::support::{
    gpu::gpu,
    image::{keep, luminance, mean_color},
    stage::{Built, trees_at},
};

/// Draws `stage` from a pose, with a vertical field of view in degrees, and checks that the image is one.
#[track_caller]
fn sensible(stage: &Stage, name: &str, pose: Pose, field_of_view: f64) -> RenderedImage {
    let gpu = gpu();
    let (x, _, z) = pose.position;
    let view = pose.viewpoint(stage.terrain.height(x, z), field_of_view);
    let picture = draw(&mut showing(stage), stage, &view, NOON);
    keep(&picture, &format!("trap-{name}"));
    assert_eq!(gpu.messages(), Vec::<String>::new(), "{name}");
    let light = luminance(mean_color(&picture, |_, _| true));
    assert!((0.003..0.95).contains(&light), "{name}: mean luminance {light}");
    // Colours that are not finite are drawn black.
    let black = picture.pixels.chunks(3).filter(|pixel| *pixel == [0, 0, 0]).count();
    assert!(black * 50 < picture.pixels.len() / 3, "{name}: {black} black pixels");
    picture
}

fn pose(position: (f64, f64, f64), yaw: f64, pitch: f64) -> Pose {
    Pose { position, yaw, pitch }
}

fn few() -> Built {
    trees_at(&[DVec2::new(0.0, 0.0), DVec2::new(6.0, -9.0), DVec2::new(-7.0, -14.0)], 1)
}

#[test]
fn one_tree_and_many_at_one_point_are_drawn() {
    let one = trees_at(&[DVec2::ZERO], 1);
    sensible(&one.stage, "one", pose((0.0, 4.0, 22.0), 0.0, 2.0), 50.0);
    // Rows of one place are one tree, so they are two centimetres apart.
    let places: Vec<DVec2> = (0..40).map(|number| DVec2::new(0.02 * f64::from(number), 0.0)).collect();
    let heap = trees_at(&places, 1);
    assert_eq!(heap.stage.stand.trees.len(), 40);
    sensible(&heap.stage, "heap", pose((0.0, 4.0, 22.0), 0.0, 2.0), 50.0);
}

#[test]
fn straight_down_and_straight_up_are_directions_too() {
    let built = few();
    for (name, pitch) in [("down", -90.0), ("up", 90.0)] {
        for height in [1.7, 30.0] {
            sensible(&built.stage, &format!("{name}-{height}"), pose((2.0, height, 3.0), 30.0, pitch), 50.0);
        }
    }
}

#[test]
fn fields_of_view_of_one_and_of_170_degrees_are_drawn() {
    let built = few();
    let narrow = sensible(&built.stage, "narrow", pose((0.0, 5.0, 60.0), 0.0, 0.0), 1.0);
    let wide = sensible(&built.stage, "wide", pose((0.0, 5.0, 20.0), 0.0, 0.0), 170.0);
    // The one sees leaves alone, the other mostly sky and ground.
    assert!(narrow != wide);
}

#[test]
fn a_million_metres_from_the_origin_there_is_ground() {
    let built = few();
    let far = sensible(&built.stage, "million-ground", pose((1.0e6, 3.0, -1.0e6), 45.0, -20.0), 50.0);
    // The ground there is of the same kind, and neither stripes nor one colour.
    let rows = far.height / 2..far.height;
    let row = |row: u32| mean_color(&far, |_, at| at == row).map(|c| (c * 1e3) as u32);
    let different: std::collections::HashSet<_> = rows.map(row).collect();
    assert!(different.len() > 5, "{} different rows", different.len());
}

#[test]
fn a_camera_inside_a_trunk_is_drawn_without_a_complaint() {
    let gpu = gpu();
    let built = few();
    let stage = &built.stage;
    let tree = stage.stand.trees[0].position(&stage.stand.grid);
    for height in [0.3, 1.5, 5.0] {
        let view = pose((tree.x, height, tree.z), 0.0, 0.0).viewpoint(stage.terrain.height(tree.x, tree.z), 50.0);
        let picture = draw(&mut showing(stage), stage, &view, NOON);
        keep(&picture, &format!("trap-trunk-{height}"));
        // Bark from within may be dark, but it is no hole in the picture.
        let light = luminance(mean_color(&picture, |_, _| true));
        assert!((1e-5..0.95).contains(&light), "mean luminance {light}");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Pixels in the lower half that are far brighter than the four around them.
fn specks(picture: &RenderedImage) -> usize {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let at = |x: usize, y: usize| {
        picture.pixels[3 * (y * width + x)..][..3].iter().map(|&code| i32::from(code)).sum::<i32>()
    };
    let bright = |x: usize, y: usize| {
        let around = [at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)];
        at(x, y) > around.into_iter().max().unwrap_or_default() + 60
    };
    (height / 2 + 4..height - 1).map(|y| (1..width - 1).filter(|&x| bright(x, y)).count()).sum()
}

/// Tiles round the vertices of a common edge differently: the bright sky once shone through single pixels of the ground.
#[test]
fn the_sky_does_not_shine_through_the_seams_of_the_ground() {
    let _gpu = gpu();
    let stage = few().stage;
    let mut renderer = Renderer::new((480, 270), None, 1).unwrap_or_else(|error| panic!("{error}"));
    renderer.show(&stage);
    let mut last = None;
    for number in 0..6 {
        let along = f64::from(number);
        // Away from the trees, towards the low sun.
        let pose = pose((-40.0 - 17.7 * along, 6.0 + along, 5.0 - 31.0 * along), 290.0, 0.0);
        let picture = draw(&mut renderer, &stage, &pose.viewpoint(0.0, 50.0), "2026-06-21T19:00+01:00");
        keep(&picture, &format!("trap-seams-{number}"));
        assert_eq!(specks(&picture), 0, "{number}");
        last = Some(picture);
    }
    // A control.
    let mut picture = last.expect("pictures");
    picture.pixels[3 * (200 * 480 + 100)..][..3].fill(255);
    assert_eq!(specks(&picture), 1);
}
