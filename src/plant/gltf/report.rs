//! A summary of a plant, for display.

use std::fmt;

use super::Warning;
use crate::plant::{PartKind, Plant};

/// A summary of a plant and of the warnings of its import.
#[derive(Clone, Debug)]
pub struct PlantReport {
    /// The plant's name.
    pub name: String,
    /// Triangles of wood.
    pub wood_triangles: usize,
    /// Triangles of foliage.
    pub foliage_triangles: usize,
    /// Extent along x, y and z in metres; `None` for an empty plant.
    pub size: Option<[f32; 3]>,
    /// Height above the foot, in metres.
    pub height: f32,
    /// The parts in the order in which they are drawn.
    pub parts: Vec<PartReport>,
    /// What was ignored, repaired or missing.
    pub warnings: Vec<Warning>,
}

/// A summary of one part.
#[derive(Clone, Debug)]
pub struct PartReport {
    /// Wood or foliage.
    pub kind: PartKind,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Area of its triangles in square metres: one side, without regard to alpha.
    pub area: f64,
    /// Width and height of the base colour texture in texels.
    pub color_texture: Option<(u32, u32)>,
    /// Fraction of the base colour texture, 0..1, that passes the alpha test.
    pub coverage: Option<f32>,
    /// Width and height of the normal texture in texels.
    pub normal_texture: Option<(u32, u32)>,
    /// Linear base colour factor.
    pub base_color: [f32; 3],
    /// Threshold of the alpha test.
    pub alpha_cutoff: f32,
}

impl PlantReport {
    /// Summarises `plant`; `warnings` are those of its import.
    pub fn new(plant: &Plant, warnings: &[Warning]) -> Self {
        let parts = plant.parts.iter().map(|part| {
            let at = |index: u32| part.mesh.positions.get(index as usize).map(|p| p.as_dvec3());
            let areas = part.mesh.triangles.iter().filter_map(|&[a, b, c]| {
                let (a, b, c) = (at(a)?, at(b)?, at(c)?);
                Some(0.5 * (b - a).cross(c - a).length())
            });
            let color = part.material.base_color_texture.as_deref();
            PartReport {
                kind: part.kind,
                vertices: part.mesh.positions.len(),
                triangles: part.mesh.triangles.len(),
                area: areas.sum(),
                color_texture: color.map(|image| image.dimensions()),
                coverage: color.filter(|image| !image.is_empty() && part.kind == PartKind::Foliage).map(|image| {
                    let passing = image.pixels().filter(|p| f32::from(p[3]) / 255.0 >= part.material.alpha_cutoff);
                    passing.count() as f32 / (image.as_raw().len() / 4) as f32
                }),
                normal_texture: part.material.normal_texture.as_deref().map(|image| image.dimensions()),
                base_color: part.material.base_color.to_array(),
                alpha_cutoff: part.material.alpha_cutoff,
            }
        });
        Self {
            name: plant.name.clone(),
            wood_triangles: plant.triangle_count(PartKind::Wood),
            foliage_triangles: plant.triangle_count(PartKind::Foliage),
            size: plant.bounds().map(|bounds| bounds.size().to_array()),
            height: plant.height(),
            parts: parts.collect(),
            warnings: warnings.to_vec(),
        }
    }
}

impl fmt::Display for PlantReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} triangles of wood, {} of foliage", self.name, self.wood_triangles, self.foliage_triangles)?;
        if let Some([x, y, z]) = self.size {
            writeln!(f, "  {:.2} m high; extent {x:.2} x {y:.2} x {z:.2} m", self.height)?;
        }
        for part in &self.parts {
            let kind = match part.kind {
                PartKind::Wood => "wood",
                PartKind::Foliage => "foliage",
            };
            write!(f, "  {kind}: {} triangles, {} vertices, {:.1} m2", part.triangles, part.vertices, part.area)?;
            match part.color_texture {
                Some((width, height)) => write!(f, ", colour texture {width} x {height}")?,
                None => write!(f, ", untextured")?,
            }
            if let Some(coverage) = part.coverage {
                write!(f, " ({:.1} % pass alpha {:.2})", 100.0 * coverage, part.alpha_cutoff)?;
            }
            if let Some((width, height)) = part.normal_texture {
                write!(f, ", normal map {width} x {height}")?;
            }
            let [r, g, b] = part.base_color;
            writeln!(f, ", base colour {r:.3} {g:.3} {b:.3}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "  {warning}")?;
        }
        Ok(())
    }
}
