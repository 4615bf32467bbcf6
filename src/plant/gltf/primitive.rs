//! Reads a primitive of a mesh as a clean triangle mesh in its own frame.

use glam::{DVec3, Vec2, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Elements, Expected, MOST_ELEMENTS, claimed_count, read_any, read_attribute, read_indices};
use super::container::Document;
use super::error::{EXPORT_AGAIN, Fault, WarningKind, Warnings};
use super::material::Surface;
use super::skin::{self, Deformation};
use crate::plant::PlantMesh;

/// A triangle whose area is below this fraction of the square of its longest edge is degenerate. Its width is about
/// 10^-7 of its length, so its normal is rounding noise.
const SLIVER: f64 = 1e-7;

/// Number of indices (or of vertices, if there are no indices) that `primitive` claims to have.
pub(super) fn claimed_size(document: &Document, primitive: &Primitive) -> u64 {
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    primitive.indices.or(positions.copied()).map_or(0, |accessor| claimed_count(document, accessor.value()))
}

/// A primitive as it is read.
pub(super) struct Piece {
    pub mesh: PlantMesh,
    /// Linear colours of the vertices; empty if there are none.
    pub colors: Vec<Vec3>,
    /// Whether bones have moved it, so that its node does not count.
    pub skinned: bool,
}

/// Reads `primitive`; `None`, with a warning, if it does not consist of triangles.
///
/// Unused vertices and degenerate triangles are dropped.
pub(super) fn read(
    document: &mut Document,
    primitive: &Primitive,
    location: &str,
    surface: &Surface,
    deformation: &Deformation,
    warnings: &mut Warnings,
) -> Result<Option<Piece>, Fault> {
    let Some(positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).copied() else {
        warnings.push(WarningKind::Ignored, location, "has no POSITION, so there is nothing to draw");
        return Ok(None);
    };
    let mode = match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        Checked::Valid(mode) => {
            warnings.push(WarningKind::Ignored, location, format!("consists of {mode:?}, only triangles are drawn"));
            return Ok(None);
        }
        Checked::Invalid => return Err(Fault::new(location, "unknown mode", EXPORT_AGAIN)),
    };
    mention_unused(primitive, location, deformation, warnings);

    // Quantised attributes are valid only with the extension, which the caller has accepted if it is required.
    let quantized = document.root.extensions_used.iter().any(|name| name == "KHR_mesh_quantization");
    let vector = |name| Expected { name, shape: Type::Vec3, integers: quantized };
    let mut points = read_attribute(document, positions.value(), &vector("POSITION"), warnings)?;
    let indices = match primitive.indices {
        Some(indices) => read_indices(document, indices.value(), warnings)?,
        None => (0..points.len() as u32).collect(),
    };
    if let Some((at, index)) = indices.iter().enumerate().find(|&(_, &index)| index as usize >= points.len()) {
        let what = format!("index {at} refers to vertex {index}, there are {}", points.len());
        return Err(Fault::new(format!("{location}/indices"), what, EXPORT_AGAIN));
    }
    let triangles = triangulate(&indices, mode, location, warnings);

    let mut lookup = |semantic: Semantic, expected: Expected, warnings: &mut Warnings| -> Option<Elements> {
        let accessor = primitive.attributes.get(&Checked::Valid(semantic)).copied()?;
        let problem = match read_attribute(document, accessor.value(), &expected, warnings) {
            Ok(elements) if elements.len() >= points.len() => return Some(elements),
            Ok(elements) => format!("{} has {} elements for {} vertices", expected.name, elements.len(), points.len()),
            Err(fault) => format!("{}: {}: {}", expected.name, fault.location, fault.what),
        };
        warnings.push(WarningKind::Repaired, location, format!("{problem}; done without"));
        None
    };
    let mut normals = lookup(Semantic::Normals, vector("NORMAL"), warnings);
    let uvs = if surface.is_textured() {
        let expected = Expected { name: "TEXCOORD", shape: Type::Vec2, integers: quantized };
        let uvs = lookup(Semantic::TexCoords(surface.uv_set), expected, warnings);
        if uvs.is_none() {
            let message = format!("has no usable TEXCOORD_{} for the texture of '{}'", surface.uv_set, surface.name);
            warnings.push(WarningKind::Missing, location, message);
        }
        uvs
    } else {
        None
    };

    let skinned = skin::apply(document, primitive, location, deformation, &mut points, normals.as_mut(), warnings)?;
    let colors = colors(document, primitive, location, points.len(), warnings);
    let mut piece_colors = Vec::new();

    let mut builder = Builder::new(points.len());
    let (mut broken_uvs, mut slivers) = (0usize, 0usize);
    for triangle in &triangles {
        let corners = triangle.map(|vertex| vec3(points.get(vertex as usize)));
        if let Some((vertex, point)) = triangle.iter().zip(corners).find(|(_, point)| !point.is_finite()) {
            let what = format!("vertex {vertex} has a position that is not finite: {point}");
            return Err(Fault::new(format!("/accessors/{}", positions.value()), what, EXPORT_AGAIN));
        }
        if is_sliver(corners.map(|corner| corner.as_dvec3())) {
            slivers += 1;
            continue;
        }
        builder.triangle(*triangle, |vertex| {
            let normal = normals.as_ref().map_or(Vec3::ZERO, |normals| vec3(normals.get(vertex as usize)));
            let uv = uvs.as_ref().map_or(Vec2::ZERO, |uvs| match *uvs.get(vertex as usize) {
                [u, v] => surface.uv_transform.transform_point2(Vec2::new(u, v)),
                _ => Vec2::ZERO,
            });
            broken_uvs += usize::from(!uv.is_finite());
            if let Some(colors) = &colors {
                piece_colors.push(vec3(colors.get(vertex as usize).get(..3).unwrap_or_default()));
            }
            Vertex {
                position: vec3(points.get(vertex as usize)),
                normal: normal.try_normalize().unwrap_or(Vec3::ZERO),
                uv: if uv.is_finite() { uv } else { Vec2::ZERO },
            }
        });
    }
    if slivers > 0 {
        let message = format!("{slivers} of {} triangles have no area; left out", triangles.len());
        warnings.push(WarningKind::Repaired, location, message);
    }
    let beyond = |uv: &Vec2| uv.min_element() < -0.01 || uv.max_element() > 1.01;
    if surface.clamped && builder.mesh.uvs.iter().any(beyond) {
        let message =
            format!("the texture of '{}' is not repeated beyond its border in the file; here it is", surface.name);
        warnings.push(WarningKind::Ignored, location, message);
    }
    if broken_uvs > 0 {
        let message = format!("{broken_uvs} texture coordinates are not finite; set to 0");
        warnings.push(WarningKind::Repaired, location, message);
    }
    Ok(Some(Piece { mesh: finish(builder.mesh, location, warnings), colors: piece_colors, skinned }))
}

/// The colours of the vertices, if there are usable ones.
fn colors(
    document: &mut Document,
    primitive: &Primitive,
    location: &str,
    vertices: usize,
    warnings: &mut Warnings,
) -> Option<Elements> {
    let accessor = primitive.attributes.get(&Checked::Valid(Semantic::Colors(0))).copied()?;
    let problem = match read_any(document, accessor.value(), &[Type::Vec3, Type::Vec4], warnings) {
        Ok(elements) if elements.len() >= vertices => return Some(elements),
        Ok(elements) => format!("COLOR_0 has {} elements for {vertices} vertices", elements.len()),
        Err(fault) => format!("COLOR_0: {}: {}", fault.location, fault.what),
    };
    warnings.push(WarningKind::Repaired, location, format!("{problem}; done without"));
    None
}

/// A vertex. A zero normal means that the normal is missing.
struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
}

/// Collects the vertices that triangles use, in the order of their first use.
struct Builder {
    mesh: PlantMesh,
    renumbered: Vec<u32>,
}

impl Builder {
    fn new(vertices: usize) -> Self {
        Self { mesh: PlantMesh::default(), renumbered: vec![u32::MAX; vertices] }
    }

    /// Appends a triangle. `vertex` reads the vertices that are new.
    fn triangle(&mut self, corners: [u32; 3], mut vertex: impl FnMut(u32) -> Vertex) {
        let corners = corners.map(|corner| {
            let number = &mut self.renumbered[corner as usize];
            if *number == u32::MAX {
                *number = self.mesh.positions.len() as u32;
                let Vertex { position, normal, uv } = vertex(corner);
                self.mesh.positions.push(position);
                self.mesh.normals.push(normal);
                self.mesh.uvs.push(uv);
            }
            *number
        });
        self.mesh.triangles.push(corners);
    }
}

fn vec3(values: &[f32]) -> Vec3 {
    match *values {
        [x, y, z] => Vec3::new(x, y, z),
        _ => Vec3::ZERO,
    }
}

/// Warns of the parts of a primitive that are not used.
fn mention_unused(primitive: &Primitive, location: &str, deformation: &Deformation, warnings: &mut Warnings) {
    let morphs = primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty());
    if morphs && deformation.weights.iter().all(|weight| *weight == 0.0) {
        warnings.push(WarningKind::Ignored, location, "its morph targets; the plant stands in its base shape");
    }
    let more = |key: &Checked<Semantic>| matches!(key, Checked::Valid(Semantic::Colors(set)) if *set > 0);
    if primitive.attributes.keys().any(more) {
        warnings.push(WarningKind::Ignored, location, "its second set of vertex colours");
    }
}

/// The corners of the triangles of a list, a strip or a fan [glTF 2.0, section 3.7.2.1].
fn triangulate(indices: &[u32], mode: Mode, location: &str, warnings: &mut Warnings) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => match indices {
            [hub, rim @ ..] => rim.windows(2).map(|w| [w[0], w[1], *hub]).collect(),
            [] => Vec::new(),
        },
        _ => {
            if !indices.len().is_multiple_of(3) {
                let message =
                    format!("{} indices are not a whole number of triangles; the rest is left out", indices.len());
                warnings.push(WarningKind::Repaired, location, message);
            }
            indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
        }
    }
}

/// Computes missing normals.
fn finish(mut mesh: PlantMesh, location: &str, warnings: &mut Warnings) -> PlantMesh {
    let missing = mesh.normals.iter().filter(|normal| **normal == Vec3::ZERO).count();
    if missing > 0 {
        let message = format!("{missing} of {} vertices have no normal; smooth ones are computed", mesh.normals.len());
        warnings.push(WarningKind::Repaired, location, message);
        fill_normals(&mut mesh);
    }
    mesh
}

/// Whether a triangle has (almost) no area.
fn is_sliver([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    let doubled_area = (b - a).cross(c - a).length();
    !doubled_area.is_finite() || doubled_area <= SLIVER * longest || doubled_area == 0.0
}

/// Sets missing normals to the mean of the normals of their triangles, weighted by area.
///
/// glTF requires flat shading here. Bark and leaves look better smooth, and hard edges have split vertices anyway.
fn fill_normals(mesh: &mut PlantMesh) {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        let normal = (b - a).cross(c - a);
        for &corner in triangle {
            sums[corner as usize] += normal;
        }
    }
    for (normal, sum) in mesh.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == Vec3::ZERO) {
        *normal = sum.try_normalize().unwrap_or(DVec3::Y).as_vec3();
    }
}

/// Limits the total size of all primitives, since nodes may use a mesh many times.
pub(super) fn check_budget(total: u64, location: &str) -> Result<(), Fault> {
    if total > MOST_ELEMENTS {
        let what = format!("with it the plant has more than {MOST_ELEMENTS} vertices or indices");
        return Err(Fault::new(location, what, "use a simplified plant"));
    }
    Ok(())
}
