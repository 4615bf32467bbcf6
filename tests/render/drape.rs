//! A photograph over the ground.

use canopy::scene::Viewpoint;
use glam::DVec3;

use super::{NOON, SIZE, draw, showing};
use crate::{
    drape::{FLAT, four},
    support::{
        gpu::gpu,
        image::{keep, mean_color},
        stage::{Built, PLACE, build, project, view},
    },
};

/// The mean colour of the picture around a point of the ground.
fn color_at(built: &Built, from: &Viewpoint, x: f64, z: f64, name: &str) -> [f64; 3] {
    let mut renderer = showing(&built.stage);
    let picture = draw(&mut renderer, &built.stage, from, NOON);
    keep(&picture, name);
    let at = project(from, SIZE, DVec3::new(x, 0.0, z)).unwrap();
    mean_color(&picture, |x, y| (f64::from(x) - at.x).abs() < 6.0 && (f64::from(y) - at.y).abs() < 6.0)
}

/// From high above the pixels of the photograph are smaller than those of the picture, from near they are larger.
#[test]
fn the_ground_has_the_colours_of_its_photograph() {
    let _gpu = gpu();
    let draped =
        build(&format!("({FLAT}, {PLACE}, quality: (msaa: 1), drape: (path: \"four.png\"))"), &[("four.png", &four())]);
    assert_eq!(draped.warnings.len(), 1, "{:?}", draped.warnings);
    for height in [150.0, 12.0] {
        let from = view(&draped.stage, (0.0, height, 0.1), 0.0, -89.9);
        let off = 0.25 * height;
        for (x, z, strongest) in [(-off, -off, Some(0)), (off, -off, Some(1)), (-off, off, Some(2)), (off, off, None)] {
            let found = color_at(&draped, &from, x, z, &format!("drape-{height}"));
            let (low, high) = found.iter().fold((f64::MAX, 0.0f64), |(low, high), c| (low.min(*c), high.max(*c)));
            match strongest {
                Some(channel) => {
                    assert!(found[channel] == high && high > 1.5 * low, "{found:?} at {x}, {z} from {height} m")
                }
                None => assert!(high < 1.5 * low, "{found:?} at {x}, {z} from {height} m"),
            }
        }
    }
    // Without the photograph the ground has none of these colours: a control.
    let bare = build(&format!("({FLAT}, {PLACE}, quality: (msaa: 1))"), &[]);
    let from = view(&bare.stage, (0.0, 150.0, 0.1), 0.0, -89.9);
    let found = color_at(&bare, &from, -37.5, 37.5, "drape-without");
    assert!(found[2] < found[1], "{found:?}");
}
