//! Plants: glTF files as they are.

use std::path::Path;

use super::page::{Page, length};
use crate::{
    app::{
        AppError,
        bake::{LevelBytes, mesh_bytes},
    },
    bake::{BakeSettings, lighting::LightingSettings},
    math::digits::grouped,
    plant::{
        PartKind, Plant,
        gltf::{GltfOptions, PlantReport, Warning, load_plant},
    },
};

pub(super) fn describe_file(page: &mut Page, path: &Path) -> Result<(), AppError> {
    let (plant, warnings) = load_plant(path, &GltfOptions::default())?;
    page.title(format!("{}: a plant", path.display()));
    page.inset(|page| describe(page, &plant, &warnings));
    Ok(())
}

/// One plant; `warnings` are those of its import.
pub(super) fn describe(page: &mut Page, plant: &Plant, warnings: &[Warning]) {
    let report = PlantReport::new(plant, warnings);
    page.row(
        "triangles",
        format!(
            "{}: {} of wood, {} of foliage",
            grouped(report.wood_triangles + report.foliage_triangles),
            grouped(report.wood_triangles),
            grouped(report.foliage_triangles)
        ),
    );
    match report.size {
        Some([x, y, z]) => page.row(
            "extent",
            format!(
                "{} high; {} (east) x {} (up) x {} (south)",
                length(f64::from(report.height)),
                length(f64::from(x)),
                length(f64::from(y)),
                length(f64::from(z))
            ),
        ),
        None => page.row("extent", "none: the plant has no vertices"),
    }
    for part in &report.parts {
        let kind = match part.kind {
            PartKind::Wood => "wood",
            PartKind::Foliage => "foliage",
        };
        let color = match part.color_texture {
            Some((width, height)) => format!("colour texture {width} x {height}"),
            None => "no colour texture".to_owned(),
        };
        let coverage = part.coverage.map_or(String::new(), |share| {
            format!(" ({:.0} % of it pass the alpha test at {:.2})", 100.0 * share, part.alpha_cutoff)
        });
        let normal = part.normal_texture.map_or(String::new(), |(w, h)| format!(", normal texture {w} x {h}"));
        let [r, g, b] = part.base_color;
        page.row(
            kind,
            format!(
                "{} triangles, {} vertices, {:.1} m²\n{color}{coverage}{normal}\nbase colour {r:.3} {g:.3} {b:.3}",
                grouped(part.triangles),
                grouped(part.vertices),
                part.area
            ),
        );
    }
    page.row("memory", memory(plant));
    for warning in &report.warnings {
        page.row("note", warning);
    }
}

/// Bytes on the device of the levels whose size does not depend on a bake.
fn memory(plant: &Plant) -> String {
    let BakeSettings { lighting, cross, cloud, .. } = BakeSettings::default();
    let model = plant.parts.iter().map(|part| {
        let transfer = lighting.vertex_bytes(part.kind) * part.mesh.positions.len();
        mesh_bytes(&part.mesh) + transfer
    });
    let of_transfer = matches!(lighting, LightingSettings::Transfer(_));
    format!(
        "with the default settings, without its own textures:\n{} as a full model\n{} as crossed billboards\n{} as a billboard cloud, \
         without its wood",
        LevelBytes::of_meshes(model.sum()),
        LevelBytes::default().with_textures(|in_blocks| cross.texture_bytes(of_transfer, in_blocks)),
        LevelBytes::default().with_textures(|in_blocks| cloud.texture_bytes(of_transfer, in_blocks)),
    )
}
