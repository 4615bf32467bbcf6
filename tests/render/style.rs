//! Watercolour, lines and toon.

use std::collections::BTreeSet;

use bevy::ecs::entity::Entity;
use canopy::{
    app::{RenderedImage, Renderer},
    assets::Stage,
    bake::lighting::BakedLighting,
    light::{Observer, SunPosition},
    render::components::{CanopyCamera, CanopyStyle},
    style::{LineNormals, Lines, Style, Toon, Watercolour},
};
use glam::{DVec2, DVec3};

use super::{NIGHT, NOON, SIZE, again, draw, renderer, showing};
use crate::support::{
    gpu::gpu,
    image::{difference, keep},
    stage::{PLACE, build, grove, instant, project, quality, trees_at, trees_of_quality, view},
};

/// One tree near the camera, with normals of its implicit surface.
fn lone_tree(lighting: &str) -> Stage {
    let quality = quality(1);
    build(
        &format!(
            "(seed: 7, terrain: Flat(size: 200), species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, \
             individuals: 1, triangles: 5000, seed: 1), height: (9, 12), lighting: {lighting})], trees: Inventory(path: \
             \"trees.csv\"), {PLACE}, {quality})"
        ),
        &[("trees.csv", b"x,y\n0,0\n")],
    )
    .stage
}

fn styled(style: Style) -> CanopyStyle {
    CanopyStyle::new(style).expect("a palette of the program")
}

fn watercolour(change: impl FnOnce(&mut Watercolour)) -> CanopyStyle {
    let mut watercolour = Watercolour::default();
    change(&mut watercolour);
    styled(Style::Watercolour(watercolour))
}

/// The tree from the south at noon in a style.
fn portrait(renderer: &mut Renderer, stage: &Stage, style: CanopyStyle, name: &str) -> RenderedImage {
    renderer.set_style(style);
    let picture = draw(renderer, stage, &view(stage, (0.0, 6.0, 15.0), 0.0, 4.0), NOON);
    keep(&picture, name);
    picture
}

fn pixel(picture: &RenderedImage, column: u32, row: u32) -> [u8; 3] {
    let first = 3 * (row * picture.width + column) as usize;
    [0, 1, 2].map(|channel| picture.pixels[first + channel])
}

/// Mean of a channel-wise mean, 0..255, over a part of the image.
fn brightness(picture: &RenderedImage, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for row in rows {
        for column in columns.clone() {
            sum += pixel(picture, column, row).iter().map(|value| f64::from(*value)).sum::<f64>() / 3.0;
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn a_style_that_is_off_costs_nothing() {
    let gpu = gpu();
    let stage = lone_tree("Local");
    let mut renderer = showing(&stage);
    let plain = portrait(&mut renderer, &stage, CanopyStyle::default(), "style-off");
    assert!(!renderer.explain().iter().any(|line| line.contains("palette")), "{:?}", renderer.explain());
    // Without the component it is the same to the bit.
    let world = renderer.app().world_mut();
    let camera =
        world.query_filtered::<Entity, bevy::ecs::query::With<CanopyCamera>>().single(world).expect("a camera");
    world.entity_mut(camera).remove::<CanopyStyle>();
    assert!(again(&mut renderer) == plain);
    // A control: with a style it is another picture, and after it the photograph again.
    let painted = portrait(&mut renderer, &stage, watercolour(|_| ()), "style-on");
    assert!(painted != plain && renderer.explain().iter().any(|line| line.contains("palette")));
    assert!(portrait(&mut renderer, &stage, CanopyStyle::default(), "style-off-again") == plain);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_watercolour_has_darkened_rims_paper_and_a_margin() {
    let gpu = gpu();
    let stage = lone_tree("Expressive()");
    let mut renderer = showing(&stage);
    let bare = |w: &mut Watercolour| {
        (w.granulation, w.flow, w.dabs, w.sketch, w.shadow) = (0.0, 0.0, 0.0, 0.0, 0.0);
    };
    let mut rims = |edges: f32| {
        let style = watercolour(|w| {
            bare(w);
            w.edges = edges;
        });
        portrait(&mut renderer, &stage, style, &format!("watercolour-edges-{edges}"))
    };
    // Rims make the picture darker where a wash ends; a control without them is not.
    let (none, strong) = (rims(0.0), rims(3.0));
    let change = |(none, strong): (&u8, &u8)| i16::from(*strong) - i16::from(*none);
    let changes = || none.pixels.iter().zip(&strong.pixels).map(change);
    let darker = changes().filter(|change| *change < -12).count();
    let lighter = changes().filter(|change| *change > 12).count();
    assert!(darker > 300 && lighter * 20 < darker, "{darker} darker, {lighter} lighter");
    // The paper shows in a flat wash of the sky, and not without granulation on a smooth paper.
    let grain = |picture: &RenderedImage| {
        let mean = brightness(picture, 10..60, 4..14);
        let squares = (4..14).flat_map(|row| (10..60).map(move |column| (column, row)));
        let deviation = |(column, row)| (brightness(picture, column..column + 1, row..row + 1) - mean).powi(2);
        (squares.map(deviation).sum::<f64>() / 500.0).sqrt()
    };
    let rough = watercolour(|w| {
        bare(w);
        (w.granulation, w.paper) = (2.0, "rough".to_owned());
    });
    let (rough, smooth) = (portrait(&mut renderer, &stage, rough, "watercolour-rough"), &none);
    assert!(grain(&rough) > 1.5 * grain(smooth), "{} and {}", grain(&rough), grain(smooth));
    // The margin is paper.
    let margin = portrait(&mut renderer, &stage, watercolour(|w| w.margin = 0.2), "watercolour-margin");
    assert!(brightness(&margin, 0..SIZE.0, 0..6) > 235.0 && brightness(&margin, 80..110, 40..60) < 220.0);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn realigned_and_scaled_normals_have_fewer_lines_inside_a_crown() {
    let gpu = gpu();
    let (own, realigned) = (lone_tree("Local"), lone_tree("Expressive()"));
    assert!(matches!(*realigned.plants[0].lighting, BakedLighting::Expressive(_)));
    let ink = |stage: &Stage, normals: LineNormals, name: &str| {
        let mut renderer = larger(stage);
        let style = styled(Style::Lines(Lines { normals, hatching: 0.0, ..Lines::default() }));
        let picture = portrait(&mut renderer, stage, style, name);
        // Inside the crown, where there is no silhouette.
        255.0 - brightness(&picture, 290..340, 160..260)
    };
    let own = ink(&own, LineNormals::Own, "lines-own");
    let aligned = ink(&realigned, LineNormals::Realigned, "lines-realigned");
    let scaled = ink(&realigned, LineNormals::Scaled, "lines-scaled");
    let paper = 255.0 - 250.0;
    assert!(
        own - paper > 1.5 * (aligned - paper) && aligned > 1.02 * scaled,
        "{own} own, {aligned} realigned, {scaled} scaled"
    );
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A renderer of 640 by 480 pixels that shows `stage`.
fn larger(stage: &Stage) -> Renderer {
    let mut renderer = match Renderer::new((640, 480), None, 1) {
        Ok(renderer) => renderer,
        Err(error) => panic!("{error}"),
    };
    renderer.show(stage);
    renderer
}

/// Lines were as broad as the Gaussian that simplifies shapes: the horizon was a bar.
#[test]
fn a_line_is_as_wide_as_it_should_be_at_any_simplification() {
    let gpu = gpu();
    let stage = trees_at(&[DVec2::new(0.0, 90.0)], 1).stage;
    let mut renderer = larger(&stage);
    // Pixels of the horizon's line: its ink in all rows over that in the darkest.
    let mut thickness = |simplification: f32, width: f32| {
        let lines = Lines { width, simplification, hatching: 0.0, ..Lines::default() };
        renderer.set_style(styled(Style::Lines(lines)));
        let picture = draw(&mut renderer, &stage, &view(&stage, (0.0, 2.0, 0.0), 0.0, 0.0), NOON);
        keep(&picture, &format!("horizon-{simplification}-{width}"));
        let ink = |row: u32| (250.0 - brightness(&picture, 200..440, row..row + 1)).max(0.0);
        let rows = || (160..320).map(ink);
        let darkest = rows().fold(0.0, f64::max);
        assert!(darkest > 20.0, "no horizon at simplification {simplification}");
        rows().sum::<f64>() / darkest
    };
    for simplification in [0.0, 2.0, 6.0, 20.0] {
        // 4.5 and 15 of 720 lines are 3 and 10 pixels here.
        let (narrow, wide) = (thickness(simplification, 4.5), thickness(simplification, 10.0));
        println!("simplification {simplification}: {narrow:.1} and {wide:.1} pixels");
        assert!((1.0..6.0).contains(&narrow), "{narrow} pixels at simplification {simplification}");
        assert!(wide > 1.3 * narrow, "{wide} pixels are not wider than {narrow} at simplification {simplification}");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Without a Gaussian, depths of 16 bits had steps on flat ground.
#[test]
fn flat_ground_has_no_contours() {
    let gpu = gpu();
    let stage = trees_at(&[DVec2::new(0.0, 90.0)], 1).stage;
    let mut renderer = larger(&stage);
    for (simplification, height) in [(0.0, 2.0), (0.0, 40.0), (2.0, 2.0), (20.0, 2.0)] {
        let lines = Lines { simplification, detail: 4.0, hatching: 0.0, ..Lines::default() };
        renderer.set_style(styled(Style::Lines(lines)));
        let picture = draw(&mut renderer, &stage, &view(&stage, (0.0, height, 0.0), 0.0, -20.0), NOON);
        keep(&picture, &format!("flat-{simplification}-{height}"));
        // Below the horizon; the control is the horizon itself.
        let darkest = |rows: std::ops::Range<u32>| {
            rows.flat_map(|row| (0..640).map(move |column| (column, row)))
                .map(|(column, row)| pixel(&picture, column, row)[1])
                .min()
                .unwrap()
        };
        let (ground, horizon) = (darkest(220..480), darkest(0..160));
        println!("simplification {simplification} from {height} m: {ground} on the ground, {horizon} at the horizon");
        assert!(ground > 235 && horizon < 215, "{ground} on the ground, {horizon} at the horizon");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Ink had its colour of the day, and shone at night.
#[test]
fn contours_at_night_are_darker_than_what_they_outline() {
    let gpu = gpu();
    let stage = lone_tree("Expressive()");
    let mut renderer = larger(&stage);
    let mut at_night = |style: CanopyStyle, name: &str| {
        renderer.set_style(style);
        let picture = draw(&mut renderer, &stage, &view(&stage, (0.0, 6.0, 15.0), 0.0, 4.0), NIGHT);
        keep(&picture, name);
        picture
    };
    let toon = |width: f32| styled(Style::Toon(Toon { width, ..Toon::default() }));
    let sketched = |sketch: f32| watercolour(|w| w.sketch = sketch);
    let pairs = [
        (at_night(toon(0.0), "night-toon-without"), at_night(toon(3.0), "night-toon-with")),
        (at_night(sketched(0.0), "night-watercolour-without"), at_night(sketched(2.0), "night-watercolour-with")),
    ];
    for (without, with) in pairs {
        let changes = || without.pixels.iter().zip(&with.pixels).map(|(a, b)| i16::from(*b) - i16::from(*a));
        let (darker, lighter) = (changes().filter(|c| *c < -4).count(), changes().filter(|c| *c > 4).count());
        println!("{darker} values are darker, {lighter} lighter");
        assert!(darker > 1000 && 50 * lighter < darker, "{darker} values are darker, {lighter} lighter");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_toon_has_few_tones() {
    let gpu = gpu();
    let stage = lone_tree("Expressive()");
    let mut renderer = showing(&stage);
    let mut colors = |tones: u32| {
        let style = styled(Style::Toon(Toon { tones, width: 0.0, ..Toon::default() }));
        let picture = portrait(&mut renderer, &stage, style, &format!("toon-{tones}"));
        // The sky has no texture: its tones can be counted.
        (0..20)
            .flat_map(|row| (0..40).map(move |column| (column, row)))
            .map(|(c, r)| pixel(&picture, c, r))
            .collect::<BTreeSet<_>>()
    };
    let (few, many) = (colors(2).len(), colors(8).len());
    // Two tones of the light are four of the sky, with what lies between two of them.
    assert!(few <= 7 && many > few + 3, "{few} and {many}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn styles_withstand_nothing_night_and_small_pictures() {
    let gpu = gpu();
    let empty = trees_at(&[DVec2::new(0.0, 90.0)], 1).stage;
    let styles = || {
        [
            watercolour(|w| (w.shadow_softness, w.simplification) = (0.0, 0.0)),
            watercolour(|w| (w.shadow_softness, w.wetness, w.margin) = (20.0, 1.0, 0.3)),
            styled(Style::Lines(Lines::default())),
            styled(Style::Toon(Toon::default())),
        ]
    };
    let mut renderer = showing(&empty);
    for (index, style) in styles().into_iter().enumerate() {
        renderer.set_style(style);
        for (time, at) in [("noon", NOON), ("night", NIGHT)] {
            // Away from the only tree, and straight up.
            for pitch in [0.0, 90.0] {
                let picture = draw(&mut renderer, &empty, &view(&empty, (0.0, 2.0, 0.0), 0.0, pitch), at);
                keep(&picture, &format!("style-{index}-{time}-{pitch}"));
                assert!(again(&mut renderer) == picture, "a resting picture changes");
            }
        }
    }
    for size in [(1, 1), (3, 2)] {
        let mut small = match Renderer::new(size, None, 1) {
            Ok(renderer) => renderer,
            Err(error) => panic!("{error}"),
        };
        small.show(&empty);
        for style in styles() {
            small.set_style(style);
            let picture = draw(&mut small, &empty, &view(&empty, (0.0, 2.0, 70.0), 180.0, 0.0), NOON);
            assert_eq!(picture.pixels.len(), (3 * size.0 * size.1) as usize);
        }
    }
    // No scene at all.
    let mut nothing = renderer_of_nothing();
    for style in styles() {
        nothing.set_style(style);
        assert!(nothing.update().is_ok());
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

fn renderer_of_nothing() -> Renderer {
    renderer(1)
}

/// Mean FLIP of successive frames of an orbit of 1 degree a frame around a grove.
fn unrest(renderer: &mut Renderer, stage: &Stage, style: CanopyStyle, name: &str) -> f32 {
    renderer.set_style(style);
    let frames: Vec<RenderedImage> = (0..4)
        .map(|frame| {
            let yaw = f64::from(frame);
            let (sin, cos) = yaw.to_radians().sin_cos();
            let picture = draw(renderer, stage, &view(stage, (-26.0 * sin, 7.0, 26.0 * cos), yaw, -4.0), NOON);
            keep(&picture, &format!("orbit-{name}-{frame}"));
            picture
        })
        .collect();
    frames.windows(2).map(|pair| difference(&pair[0], &pair[1])).sum::<f32>() / 3.0
}

#[test]
fn an_orbit_is_as_calm_in_watercolour_as_in_the_photograph() {
    let gpu = gpu();
    let stage = grove(1).stage;
    let mut renderer = showing(&stage);
    let photograph = unrest(&mut renderer, &stage, CanopyStyle::default(), "photograph");
    let painted = unrest(&mut renderer, &stage, watercolour(|_| ()), "watercolour");
    println!("mean FLIP of successive frames: {photograph} photographed, {painted} painted");
    assert!(painted <= 1.5 * photograph, "{painted} painted, {photograph} photographed");
    // A control: an orbit with another paper in every frame is no calm one.
    let papers = ["rough", "canvas", "laid", "hot-pressed"].map(|paper| {
        let style = watercolour(|w| (w.paper, w.granulation) = (paper.to_owned(), 3.0));
        portrait(&mut renderer, &stage, style, &format!("paper-{paper}"))
    });
    let restless = papers.windows(2).map(|pair| difference(&pair[0], &pair[1])).sum::<f32>() / 3.0;
    assert!(restless > 0.5 * painted, "{restless} is no control");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A leaf half a metre high in front of the camera, with a file of strokes or without.
fn leaf(strokes: Option<&str>) -> crate::support::stage::Built {
    let quality = quality(1);
    let named = strokes.map_or("", |_| "strokes: [\"leaf.strokes.ron\"],");
    build(
        &format!(
            "(seed: 36183, terrain: Flat(size: 200), species: [(name: \"leaf\", plant: Grown(form: House(Leaf), individuals: 1), \
             {named} height: (0.48, 0.48))], trees: Inventory(path: \"trees.csv\"), {PLACE}, {quality})"
        ),
        &[("trees.csv", b"x,y\n0,0\n"), ("leaf.strokes.ron", strokes.unwrap_or("(strokes: [])").as_bytes())],
    )
}

#[test]
fn strokes_on_a_leaf_are_seen_near_in_all_styles_and_in_no_photograph() {
    let gpu = gpu();
    let cross = "(materials: [\"Leaf\"], strokes: [(points: [(0.5, 0.1), (0.5, 0.9)], width: (0.04, 0.04)), \
                 (points: [(0.2, 0.5), (0.8, 0.5)], width: (0.04, 0.04)), (points: [(0.5, 1.5)])])";
    let (plain, drawn) = (leaf(None), leaf(Some(cross)));
    assert!(drawn.warnings.iter().any(|what| what.contains("1 of 5 points")), "{:?}", drawn.warnings);
    let misnamed = leaf(Some("(materials: [\"petal\"], strokes: [])"));
    assert!(misnamed.warnings.iter().any(|what| what.contains("called `petal`") && what.contains("`leaf`")));
    let (mut without, mut with) = (showing(&plain.stage), showing(&drawn.stage));
    let mut darker = |style: CanopyStyle, distance: f64, name: &str| {
        let seen = |renderer: &mut Renderer, stage: &Stage, kind: &str| {
            renderer.set_style(style.clone());
            let picture = draw(renderer, stage, &view(stage, (0.0, 0.45, distance), 0.0, -14.0), NOON);
            keep(&picture, &format!("strokes-{name}-{distance}-{kind}"));
            picture
        };
        let (without, with) = (seen(&mut without, &plain.stage, "without"), seen(&mut with, &drawn.stage, "with"));
        let darker = |(without, with): (&u8, &u8)| i16::from(*without) - i16::from(*with) > 40;
        without.pixels.iter().zip(&with.pixels).filter(|pair| darker(*pair)).count() / 3
    };
    for (name, style) in [
        ("watercolour", watercolour(|_| ())),
        ("lines", styled(Style::Lines(Lines::default()))),
        ("toon", styled(Style::Toon(Toon::default()))),
    ] {
        let (near, far) = (darker(style.clone(), 0.24, name), darker(style, 30.0, name));
        println!("{name}: {near} pixels darker near, {far} far");
        assert!(near > 100, "{name}: only {near} pixels are darker");
        assert_eq!(far, 0, "{name}");
    }
    assert_eq!(darker(CanopyStyle::default(), 0.24, "photograph"), 0);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// The depths of a trunk near its foot and of the ground differ by less than the band of the blurred depth test, so that shadows of lone
/// trees lay apart from them.
#[test]
fn a_soft_shadow_begins_at_the_foot_of_its_trunk() {
    let gpu = gpu();
    // Texels of 6 cm: a trunk is several of them wide.
    let quality = "quality: (shadow_map_size: 2048, cascades: 2, shadow_distance: 60, near_distance: 67, msaa: 1)";
    let stage = trees_of_quality(&[DVec2::ZERO], quality).stage;
    let size = (640, 480);
    let mut renderer = larger(&stage);
    renderer.set_style(watercolour(|w| {
        (w.granulation, w.flow, w.dabs, w.sketch, w.edges) = (0.0, 0.0, 0.0, 0.0, 0.0);
    }));
    // The sun in the east: the shadow lies to the left.
    let at = "2026-06-21T09:00+01:00";
    let view = view(&stage, (0.0, 2.5, 5.0), 0.0, -20.0);
    let picture = draw(&mut renderer, &stage, &view, at);
    keep(&picture, "watercolour-foot");
    let sun = SunPosition::at(instant(at), &Observer::new(48.0, 9.0, 0.0).unwrap()).unwrap().direction().as_dvec3();
    // The ground in the shadow of the trunk so far above it; negative: as far on the lit side.
    let ground = |metres: f64| {
        let point = DVec3::new(-sun.x / sun.y * metres, stage.terrain.height(0.0, 0.0), -sun.z / sun.y * metres);
        let place = project(&view, size, point).unwrap();
        let (column, row) = (place.x.round() as u32, place.y.round() as u32);
        brightness(&picture, column - 2..column + 3, row - 1..row + 2)
    };
    for metres in [0.4, 0.7, 1.0] {
        let (shade, light) = (ground(metres), ground(-metres));
        println!("{metres} m: {shade:.0} in the shadow, {light:.0} beside it");
        assert!(shade < light - 25.0, "{metres} m: {shade} in the shadow, {light} on the lit side");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn a_crown_surface_has_the_outline_of_its_leaves_and_fewer_lines_inside() {
    let gpu = gpu();
    let tree = |level: &str| {
        let quality = format!("quality: (levels: [(draw: \"{level}\")], msaa: 1)");
        build(
            &format!(
                "(seed: 7, terrain: Flat(size: 200), species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, individuals: 1, \
                 triangles: 5000, seed: 1), height: (9, 12), lighting: Local)], trees: Inventory(path: \"trees.csv\"), {PLACE}, \
                 {quality})"
            ),
            &[("trees.csv", b"x,y\n0,0\n")],
        )
        .stage
    };
    let lines = styled(Style::Lines(Lines { normals: LineNormals::Own, hatching: 0.0, ..Lines::default() }));
    let drawn = |level: &str| {
        let stage = tree(level);
        let mut renderer = larger(&stage);
        let photograph = portrait(&mut renderer, &stage, CanopyStyle::default(), &format!("crown-{level}"));
        let lines = portrait(&mut renderer, &stage, lines.clone(), &format!("crown-{level}-lines"));
        portrait(&mut renderer, &stage, watercolour(|_| ()), &format!("crown-{level}-watercolour"));
        (photograph, lines)
    };
    let ((leaves, cluttered), (surface, clear)) = (drawn("model"), drawn("surface"));
    // The sky is blue, and leaves are green.
    let area = |picture: &RenderedImage| {
        let rows = 0..picture.height / 2;
        rows.flat_map(|row| (0..picture.width).map(move |column| pixel(picture, column, row)))
            .filter(|[_, green, blue]| green > blue)
            .count() as f64
    };
    let ratio = area(&surface) / area(&leaves);
    println!("the surface covers {ratio:.3} of the leaves");
    assert!((0.8..1.5).contains(&ratio), "the surface covers {ratio} of the leaves");
    let dark = |picture: &RenderedImage| picture.pixels.iter().filter(|value| **value < 200).count();
    println!("{} and {} dark values", dark(&cluttered), dark(&clear));
    // The horizon counts in both.
    assert!(3 * dark(&clear) < 2 * dark(&cluttered), "{} and {} dark values", dark(&cluttered), dark(&clear));
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Where a style draws trees together, its picture has the tones of the trees: their light and their variety. Bare ground is the control.
#[test]
fn the_surface_of_a_forest_is_painted_as_the_trees_that_end_there() {
    let gpu = gpu();
    let wood = |stems: u32, size: f64| {
        let plants = "individuals: 1, triangles: 5000, seed: 1";
        // As the program lights plants for a style.
        let realigned = "lighting: Expressive()";
        build(
            &format!(
                "(seed: 7, terrain: Flat(size: 2400), species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, {plants}), \
                 height: (14, 20), {realigned}), (name: \"conifer\", plant: Grown(form: Conifer, {plants}), height: (16, 24), {realigned})], trees: \
                 Scattered(stems_per_hectare: {stems}, min_distance: 2, surroundings: 0), {PLACE}, quality: (shadow_map_size: 512, \
                 cascades: 2, shadow_distance: 300, near_distance: 30, msaa: 1, cross_resolution: 64, surface_size: {size}))"
            ),
            &[],
        )
        .stage
    };
    let painted = |stems: u32, size: f64| {
        let stage = wood(stems, size);
        let mut renderer = showing(&stage);
        renderer.set_style(watercolour(|_| ()));
        let picture = draw(&mut renderer, &stage, &view(&stage, (0.0, 90.0, 1100.0), 0.0, -8.0), NOON);
        keep(&picture, &format!("forest-{stems}-{size}"));
        picture
    };
    // What lies 350 to 1,200 m away.
    let (columns, rows) = (8..184, 46..66);
    let deviation = |picture: &RenderedImage| {
        let mean = brightness(picture, columns.clone(), rows.clone());
        let all = rows.clone().flat_map(|row| columns.clone().map(move |column| (row, column)));
        let squares: Vec<f64> =
            all.map(|(row, column)| (brightness(picture, column..column + 1, row..row + 1) - mean).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let (trees, surface, ground) = (painted(400, 0.0), painted(400, 10.0), painted(1, 10.0));
    let [trees_light, light, bare] = [&trees, &surface, &ground].map(|p| brightness(p, columns.clone(), rows.clone()));
    let [trees_variety, variety, even] = [&trees, &surface, &ground].map(&deviation);
    println!("light {trees_light:.1} {light:.1} {bare:.1}, variety {trees_variety:.1} {variety:.1} {even:.1}");
    assert!(difference(&trees, &surface) > 0.0, "the surface is not drawn");
    assert!((light - trees_light).abs() < 10.0, "{light} for {trees_light}");
    assert!((0.6..1.4).contains(&(variety / trees_variety)), "{variety} for {trees_variety}");
    assert!((bare - trees_light).abs() > 20.0, "the control, bare ground, has {bare} too");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
