//! The sheet of a leaf: its textures, and what they look like in the light, by layers and by the standard model.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use image::{DynamicImage, Rgb, RgbImage, imageops};

use super::{LeafOptions, textures};
use crate::{
    app::{AppError, text::Writer},
    math::{color::srgb8, luminance},
    plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart},
    progress::Progress,
    reference::{
        Camera, Disc, Film, Instance, LeafModel, Light, Normals, PathTracer, ReferenceScene, Shot, TraceSettings,
    },
    scene::Viewpoint,
};

/// Longer side of an image in pixels.
const CELL: u32 = 360;
/// Longer side of a texture in pixels.
const SMALL: u32 = 150;
/// Pixels between images.
const GAP: u32 = 14;
/// Width of the rows' names.
const NAMES: u32 = 150;
/// Height of the title.
const TITLE: u32 = 70;
/// Height of a line of captions.
const CAPTION: u32 = 30;
const PAPER: [u8; 3] = [244, 246, 248];
const INK: [u8; 3] = [32, 38, 44];
const FAINT: [u8; 3] = [96, 104, 112];
/// Radiance of the surroundings, where the sun alone gives a white leaf that faces it a radiance of 1.
const SURROUNDINGS: f32 = 0.06;
/// Linear luminance that the front in front light is shown with.
const SHOWN: f32 = 0.16;
/// Height of the camera over the width of the leaf.
const FAR: f64 = 40.0;

/// Where the sun is: degrees from the normal of the side that is seen.
const LIGHTS: [(&str, f32); 3] =
    [("front light, 25°", 25.0), ("grazing light, 80°", 80.0), ("light from behind, 155°", 155.0)];

/// Draws the sheet of the leaf of `material`, whose height over its width is `shape`. `lines` say where the textures are from.
///
/// # Errors
/// [`AppError`]; [`AppError::Interrupted`] where `progress` is cancelled.
pub fn draw(
    material: &PlantMaterial,
    options: &LeafOptions,
    shape: f32,
    lines: &[String],
    progress: &mut dyn Progress,
) -> Result<RgbImage, AppError> {
    let writer = Writer::new()?;
    let longer = shape.max(1.0);
    let cell = [1.0, shape].map(|side| ((CELL as f32 * side / longer).round() as u32).max(1));
    let plant = plant(material, options.width, shape);
    let columns = LIGHTS.len() as u32;
    let block = NAMES + columns * (cell[0] + GAP);
    let width = GAP + (2 * block).max(6 * (SMALL + GAP)) + GAP;
    let top = TITLE + SMALL + 2 * CAPTION + GAP;
    let height = top + CAPTION + 2 * (cell[1] + GAP) + lines.len() as u32 * 22 + 2 * GAP;
    let mut sheet = RgbImage::from_pixel(width, height, Rgb(PAPER));
    let name = options.file.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    writer.write(&mut sheet, (2.0 * GAP as f32, 14.0), 38.0, INK, &name);
    draw_textures(&mut sheet, &writer, material);

    progress.begin("Images", 2 * 2 * u64::from(columns));
    let mut exposure = None;
    for (index, (model, title)) in
        [(LeafModel::Layers, "layers of tissue"), (LeafModel::Standard, "standard model")].into_iter().enumerate()
    {
        let left = GAP + index as u32 * block;
        writer.write(&mut sheet, ((left + GAP) as f32, top as f32 + 2.0), 21.0, INK, title);
        let instance = Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 };
        let scene = ReferenceScene::new(std::slice::from_ref(&plant), &[instance], None)?.with_leaves(model);
        for (row, (side, below)) in [("front", false), ("back", true)].into_iter().enumerate() {
            let y = top + CAPTION + row as u32 * (cell[1] + GAP);
            writer.write(&mut sheet, ((left + GAP) as f32, (y + cell[1] / 2) as f32), 19.0, FAINT, side);
            for (column, (caption, degrees)) in LIGHTS.into_iter().enumerate() {
                let x = left + NAMES + column as u32 * (cell[0] + GAP);
                if row == 0 {
                    let start = x as f32 + 0.5 * (cell[0] as f32 - writer.width(17.0, caption));
                    writer.write(&mut sheet, (start, top as f32 + 5.0), 17.0, FAINT, caption);
                }
                let pixels = trace(&scene, options, shape, cell, below, degrees)?;
                let exposure = *exposure.get_or_insert_with(|| exposure_for(&pixels));
                for (at, pixel) in pixels.into_iter().enumerate() {
                    let (column, row) = (at as u32 % cell[0], at as u32 / cell[0]);
                    sheet.put_pixel(x + column, y + row, Rgb((pixel * exposure).to_array().map(srgb8)));
                }
                progress.advance(1);
                if progress.is_cancelled() {
                    return Err(AppError::Interrupted("the sheet was not written; the textures were".to_owned()));
                }
            }
        }
    }
    progress.end();
    let bottom = top + CAPTION + 2 * (cell[1] + GAP);
    for (index, line) in lines.iter().enumerate() {
        writer.write(&mut sheet, (2.0 * GAP as f32, (bottom + index as u32 * 22) as f32), 17.0, FAINT, line);
    }
    Ok(sheet)
}

fn draw_textures(sheet: &mut RgbImage, writer: &Writer, material: &PlantMaterial) {
    for (index, (name, image)) in textures(material).into_iter().enumerate() {
        let x = 2 * GAP + index as u32 * (SMALL + GAP);
        writer.write(sheet, (x as f32, (TITLE + SMALL + 4) as f32), 17.0, FAINT, name);
        let Some(image) = image.map(DynamicImage::into_rgba8) else { continue };
        let scale = SMALL as f32 / image.width().max(image.height()) as f32;
        let side = |texels: u32| ((texels as f32 * scale).round() as u32).max(1);
        let small = imageops::resize(&image, side(image.width()), side(image.height()), imageops::FilterType::Triangle);
        for (at_x, at_y, texel) in small.enumerate_pixels() {
            let alpha = f32::from(texel[3]) / 255.0;
            let under: [u8; 3] = std::array::from_fn(|channel| {
                (f32::from(texel[channel]) * alpha + f32::from(PAPER[channel]) * (1.0 - alpha)).round() as u8
            });
            if x + at_x < sheet.width() {
                sheet.put_pixel(x + at_x, TITLE + at_y, Rgb(under));
            }
        }
    }
}

/// A level leaf around the origin, front up; its tip points north (-Z).
fn plant(material: &PlantMaterial, width: f32, shape: f32) -> Arc<Plant> {
    let mut mesh = PlantMesh::default();
    for (u, v) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)] {
        mesh.positions.push(width * Vec3::new(u - 0.5, 0.0, (v - 0.5) * shape));
        mesh.normals.push(Vec3::Y);
        mesh.uvs.push(Vec2::new(u, v));
    }
    mesh.triangles = vec![[0, 1, 2], [0, 2, 3]];
    let part = PlantPart { kind: PartKind::Foliage, mesh, material: material.clone() };
    Arc::new(Plant { name: "leaf".into(), parts: vec![part] })
}

/// Radiance of a view of the leaf from straight above, or from below, with the sun at an angle to the side that is seen.
fn trace(
    scene: &ReferenceScene,
    options: &LeafOptions,
    shape: f32,
    size: [u32; 2],
    below: bool,
    degrees: f32,
) -> Result<Vec<Vec3>, AppError> {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let up = if below { -cosine } else { cosine };
    let light = Light {
        key: Some(Disc {
            // From the upper left, across the midrib.
            direction: Vec3::new(-0.8 * sine, up, -0.6 * sine),
            illuminance: Vec3::splat(std::f32::consts::PI),
            angular_radius: 0.005,
        }),
        ..Light::even(Vec3::splat(SURROUNDINGS))
    };
    let (width, distance) = (f64::from(options.width), FAR * f64::from(options.width));
    let view = Viewpoint {
        position: DVec3::new(0.0, if below { -distance } else { distance }, 0.0),
        // The tip is up on both sides.
        yaw: if below { PI } else { 0.0 },
        pitch: if below { FRAC_PI_2 } else { -FRAC_PI_2 },
        field_of_view: 2.0 * (0.5 * width * f64::from(shape) / distance).atan(),
    };
    let shot = Shot { camera: Camera { view, size: (size[0], size[1]), near: 0.0 }, fog: None };
    let tracer = PathTracer::new(scene, &light, TraceSettings { normals: Normals::Flat, ..TraceSettings::default() })?;
    let mut film = Film::new(&shot)?;
    tracer.render(&shot, &mut film, options.samples.max(1), &mut |_| ControlFlow::Continue(()))?;
    Ok(film.radiance().to_vec())
}

/// The factor that shows the leaf with [`SHOWN`].
fn exposure_for(pixels: &[Vec3]) -> f32 {
    let leaf: Vec<f32> = pixels.iter().map(|pixel| luminance(*pixel)).filter(|value| *value != SURROUNDINGS).collect();
    let mean = leaf.iter().sum::<f32>() / leaf.len().max(1) as f32;
    if mean > 0.0 && mean.is_finite() { SHOWN / mean } else { 1.0 }
}
