//! Light in the foliage by implicit surfaces [Luft 2007, "Expressive Illumination of Foliage Based on Implicit
//! Surfaces"]: normals that follow the shape of the crown, and an ambient term that follows its density.
//!
//! ```text
//! plant ─ generators ─ parameters ─┬─ density field ─┬─ isosurface ─┬─ normals of the foliage (as published)
//!                                  │                 │              └─ simplified, for other styles
//!                                  │                 ├─ gradient ──── normals of the foliage (smooth)
//!                                  │                 └─ ambient term, all parts (as published)
//!                                  └─ depth field ───── ambient term, all parts
//! ```
//!
//! | module | section |
//! |---|---|
//! | [`generators`] | generator points, an even share of them (3.1) |
//! | [`density`] | density field and gradient (2.3, eq. 2 and 3) |
//! | [`isosurface`], [`simplify_surface`] | the surface as a closed mesh (2.3, 3.1) |
//! | [`ambient_term`](mod@ambient_term) | ambient term (k_a) from the density (3.2, eq. 4) |
//! | [`depth_field`] | the density over all radii, for the ambient term: not in the publication |
//! | [`foliage_normals`] | realigned normals (3.3) |
//! | [`packing`] | ambient term as the length of the normal (3.2) |
//! | [`parameters`] | settings, and values that follow from the model (3.1) |
//! | [`stand`] | several plants that darken each other (5) |
//!
//! Realigned normals point out of the crown: they must not be flipped by the side of a leaf that faces the camera.
//!
//! Departures from the paper, and how to draw it as published:
//!
//! | here | as published |
//! |---|---|
//! | generators count their leaf area | [`Weighting::Primitives`]; the vertices of [Luft 2006]: [`Weighting::Vertices`] |
//! | ρ, τ, k_a_min, d_min and n follow from the model | state them: [`ImplicitSettings`] |
//! | k_a by depth, a floor under the ambient light, direct light dimmed by k_a, gloss alike in all directions, light through leaves | [`AmbientField::Published`]: eq. 1 to 4 alone |
//! | [`NormalSource::Gradient`], a choice | [`NormalSource::NearestVertex`], the default |
//! | k_a is packed as a length of 0.25 to 1 ([`packing`]) | the length is k_a; not to be had |
//!
//! Why: the published density is blind beyond ρ, so one ρ cannot both smooth the crown's shape and tell how much light comes
//! in, and a value of d_min suits one plant only. In either mode I_a of eq. 1 is the light of the sky and the ground by the
//! direction of the normal, dimmed by the trees around where a plant does not stand alone, and S_i holds the terrain's shadow.
//! Crosses, which the paper does not have, replace what the shadow map cannot know of their own crown by constants
//! (`shaders/forest/cross.wgsl`).
//!
//! Pure functions: the same plant and settings give the same bytes, with any number of threads. Cost:
//! `benches/README.md`.

pub mod ambient_term;
mod cube_table;
pub mod density;
pub mod depth_field;
pub mod foliage_normals;
pub mod generators;
pub mod isosurface;
mod moments;
pub mod packing;
pub mod parameters;
mod partition;
mod simplify;
pub mod stand;

use std::borrow::Cow;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::plant::{PartKind, Plant, PlantMesh, PlantPart, geometry};
use ambient_term::ambient_term;
use density::{DensityField, FieldSample};
use depth_field::DepthField;
use generators::Generator;
use partition::Aabb;

pub use generators::Weighting;
pub use isosurface::SurfaceMesh;
pub use parameters::{AmbientField, ImplicitParameters, ImplicitSettings, NormalSource};
pub use simplify::{COARSE_SHARE, FINE_SHARE};
pub use stand::{StandBake, StandPlant, bake_implicit_stand};

/// Why the foliage keeps its own normals. In the first two cases the published ambient term is 1 everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
pub enum NoSurface {
    /// No leaf has an area, or ρ is 0.
    #[error("there is no density field: the plant has no foliage with an area, or the radius is 0; normals are kept")]
    NoField,
    /// τ is above the field.
    #[error(
        "there is no implicit surface: the threshold {threshold} is not below the greatest density, {greatest}; \
         normals are kept; lower the threshold or raise the radius"
    )]
    Threshold {
        /// τ.
        threshold: f32,
        /// The greatest density at a vertex or generator.
        greatest: f32,
    },
    /// The whole surface is smaller than a cell.
    #[error("the implicit surface is finer than its cells of {cell} m; normals are kept; raise the radius")]
    BelowResolution {
        /// Edge of a cell, metres.
        cell: f32,
    },
}

impl NoSurface {
    /// Whether all numbers of the reason are finite.
    pub fn is_finite(self) -> bool {
        match self {
            Self::NoField => true,
            Self::Threshold { threshold, greatest } => threshold.is_finite() && greatest.is_finite(),
            Self::BelowResolution { cell } => cell.is_finite(),
        }
    }
}

/// Report of a bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplicitReport {
    /// The values that were used.
    pub parameters: ImplicitParameters,
    /// Number of generators.
    pub generators: usize,
    /// Edge of the cells from which the returned surface was extracted, metres; 0 where no surface was asked for.
    pub cell: f32,
    /// Why the foliage kept its normals; `None` if they were realigned.
    pub no_surface: Option<NoSurface>,
}

/// A plant lit by implicit surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct ImplicitBake {
    /// Unit normals: one list per part in the plant's order, one value per vertex. Wood keeps its own normals, and so
    /// does foliage that could not be realigned (no surface, a position that is not finite).
    pub normals: Vec<Vec<Vec3>>,
    /// Ambient term, k_a_min..=1: one list per part in the plant's order, one value per vertex.
    pub ambient: Vec<Vec<f32>>,
    /// The implicit surface in the plant's frame; `None` where there is none or none was asked for.
    pub surface: Option<SurfaceMesh>,
    /// Report of the bake.
    pub report: ImplicitReport,
}

/// Bakes the implicit surface of `plant`, the normals of its foliage and the ambient term of all its vertices. A plant
/// without a surface keeps its own normals, and the report says why.
pub fn bake_implicit(plant: &Plant, settings: &ImplicitSettings) -> ImplicitBake {
    let settings = settings.sanitized();
    let (parts, origin) = centered(parts_of(plant));
    let Basis { leaves, generators, field, parameters, extent } = basis(&parts, &settings);
    let depth = depth_field(&parts, leaves, &parameters, extent, &settings);
    let mut baked = bake_parts(&parts, generators, &field, depth.as_ref(), parameters, &settings);
    let positions = baked.surface.iter_mut().flat_map(|surface| surface.positions.iter_mut());
    positions.for_each(|position| *position += origin);
    baked
}

/// The parameters that a bake of `plant` with `settings` would use, in a tenth of its time or less.
pub fn implicit_parameters(plant: &Plant, settings: &ImplicitSettings) -> ImplicitParameters {
    basis(&centered(parts_of(plant)).0, &settings.sanitized()).parameters
}

/// ρ in metres for `plant` as a share of its longest extent, and at least as many mean distances between neighbouring leaves as
/// `spacings`. 0 where there is no foliage.
pub fn relative_radius(plant: &Plant, share: f32, spacings: f32) -> f32 {
    let parts = centered(parts_of(plant)).0;
    parameters::relative_radius(&generators_of(&parts, PartKind::Foliage), extent(&parts), share, spacings)
}

fn parts_of(plant: &Plant) -> Vec<Part<'_>> {
    plant.parts.iter().map(|source| Part { source, mesh: Cow::Borrowed(&source.mesh) }).collect()
}

/// What a bake stands on.
struct Basis {
    /// One for each primitive or vertex of the foliage.
    leaves: Vec<Generator>,
    /// How many of them make the field.
    generators: usize,
    field: DensityField,
    parameters: ImplicitParameters,
    extent: f32,
}

/// Generators, field and values of a lone plant, by `settings` that are in range.
fn basis(parts: &[Part], settings: &ImplicitSettings) -> Basis {
    let extent = extent(parts);
    let leaves = foliage_generators(parts, settings.weighting);
    let radius = parameters::radius(&leaves, extent, settings);
    let ambient_radius = parameters::ambient_radius(radius, extent, settings);
    let generators = generators::even_share(&leaves, settings.generator_share);
    let field = DensityField::new(&generators, radius, settings.weighting);
    let parameters = parameters::parameters(&leaves, &field, ambient_radius, settings);
    Basis { generators: generators.len(), leaves, field, parameters, extent }
}

/// The surface with at most `target` triangles, or as near to it as its separate lobes allow, and with normals of
/// `field` again. It stays closed. A surface that has fewer triangles keeps them.
pub fn simplify_surface(surface: &SurfaceMesh, field: &DensityField, target: usize) -> SurfaceMesh {
    let (positions, triangles) = simplify::simplify(&surface.positions, &surface.triangles, target);
    with_normals(positions, triangles, field)
}

/// A part of a plant, in the frame of the bake.
struct Part<'a> {
    /// Kind and material.
    source: &'a PlantPart,
    /// Its mesh where the bake has it.
    mesh: Cow<'a, PlantMesh>,
}

impl Part<'_> {
    /// Its normals as unit vectors, one a vertex; up where it has none.
    fn own_normals(&self) -> impl Iterator<Item = Vec3> + '_ {
        let normals = self.mesh.normals.iter().map(|normal| normal.try_normalize().unwrap_or(Vec3::Y));
        normals.chain(std::iter::repeat(Vec3::Y)).take(self.mesh.positions.len())
    }
}

/// The box around all triangles that have an area: a stray vertex does not make a plant larger.
fn bounds(parts: &[Part]) -> Aabb {
    let of_part = |part: &Part| {
        let mesh = &*part.mesh;
        let triangles = geometry::triangles(mesh).filter(|(_, corners)| geometry::area(mesh, *corners) > 0.0);
        Aabb::around(triangles.flat_map(|(_, corners)| corners.map(|corner| mesh.positions[corner])))
    };
    parts.iter().map(of_part).fold(Aabb::EMPTY, Aabb::join)
}

/// Longest extent of all parts, metres; not above 0 where there is nothing.
fn extent(parts: &[Part]) -> f32 {
    bounds(parts).size().max_element()
}

/// Parts that lie far from the origin are moved there (differences of neighbouring f32 are exact), so that the places
/// between them that the surface needs can be told apart. With the vector that leads back.
fn centered(mut parts: Vec<Part>) -> (Vec<Part>, Vec3) {
    let bounds = bounds(&parts);
    let center = Vec3::from(bounds.center());
    if !center.is_finite() || center.abs().max_element() <= 4.0 * bounds.size().max_element() {
        return (parts, Vec3::ZERO);
    }
    for part in &mut parts {
        part.mesh.to_mut().positions.iter_mut().for_each(|position| *position -= center);
    }
    (parts, center)
}

/// The foliage's generators, as `weighting` counts them.
fn foliage_generators(parts: &[Part], weighting: Weighting) -> Vec<Generator> {
    match weighting {
        Weighting::Primitives | Weighting::LeafArea => generators_of(parts, PartKind::Foliage),
        Weighting::Vertices => {
            let foliage = parts.iter().filter(|part| part.source.kind == PartKind::Foliage);
            foliage.flat_map(|part| generators::vertex_generators_of(part.source, &part.mesh)).collect()
        }
    }
}

/// A generator for each primitive of the parts of one kind.
fn generators_of(parts: &[Part], kind: PartKind) -> Vec<Generator> {
    let parts = parts.iter().filter(|part| part.source.kind == kind);
    parts.flat_map(|part| generators::generators_of(part.source, &part.mesh)).collect()
}

/// The field of the ambient term for parts with the generators `leaves` of their foliage; `None` where it is the
/// density.
fn depth_field(
    parts: &[Part],
    leaves: Vec<Generator>,
    parameters: &ImplicitParameters,
    extent: f32,
    settings: &ImplicitSettings,
) -> Option<DepthField> {
    (settings.ambient == AmbientField::Depth).then(|| {
        // Leaves hide each other by their area, wherever their vertices are.
        let mut occluders = match settings.weighting {
            Weighting::Primitives | Weighting::LeafArea => leaves,
            Weighting::Vertices => generators_of(parts, PartKind::Foliage),
        };
        occluders.extend(generators_of(parts, PartKind::Wood));
        DepthField::new(&occluders, parameters.ambient_radius, extent)
    })
}

/// The depth at each vertex of all parts in one list: around a leaf, above the surface of wood.
fn depths(parts: &[Part], field: &DepthField) -> Vec<f32> {
    let of = |kind: PartKind| parts.iter().filter(move |part| part.source.kind == kind);
    let positions = |kind: PartKind| of(kind).flat_map(|part| &part.mesh.positions).copied().collect::<Vec<Vec3>>();
    let normals: Vec<Vec3> = of(PartKind::Wood).flat_map(|part| part.own_normals()).collect();
    let mut leaves = field.depths(&positions(PartKind::Foliage)).into_iter();
    let mut wood = field.depths_above(&positions(PartKind::Wood), &normals).into_iter();
    let mut all = Vec::new();
    for part in parts {
        let count = part.mesh.positions.len();
        match part.source.kind {
            PartKind::Foliage => all.extend(leaves.by_ref().take(count)),
            PartKind::Wood => all.extend(wood.by_ref().take(count)),
        }
    }
    all
}

/// The bake itself, in the frame of the parts.
fn bake_parts(
    parts: &[Part],
    generators: usize,
    field: &DensityField,
    depth: Option<&DepthField>,
    parameters: ImplicitParameters,
    settings: &ImplicitSettings,
) -> ImplicitBake {
    // All parts at once: one list keeps all threads busy to its end.
    let points: Vec<Vec3> = parts.iter().flat_map(|part| &part.mesh.positions).copied().collect();
    let smooth = settings.normals == NormalSource::Gradient;
    let samples = if smooth { field.samples(&points) } else { Vec::new() };
    let values = || {
        let of_samples = || samples.iter().map(|sample| sample.value).collect();
        if smooth { of_samples() } else { field.values(&points) }
    };
    let densities = match depth {
        Some(depth) => depths(parts, depth),
        None => values().into_iter().map(|value| value - parameters.threshold).collect(),
    };
    let ambient = split(parts, densities.into_iter().map(|density| ambient_term(density, &parameters)));

    let (surface, cell) = if settings.surface || !smooth {
        let cell = parameters.radius / settings.resolution;
        let found = isosurface::extract(field, &field.extent(), parameters.threshold, cell);
        (with_normals(found.positions, found.triangles, field), found.cell)
    } else {
        (SurfaceMesh::default(), 0.0)
    };
    let no_surface = no_surface(field, values, &surface, smooth, parameters.threshold, cell);

    let realigned = match (no_surface, settings.normals) {
        (Some(_), _) => vec![None; points.len()],
        (None, NormalSource::NearestVertex) => {
            of_foliage(parts, |points| foliage_normals::nearest_vertex_normals(points, &surface))
        }
        (None, NormalSource::Gradient) => foliage_normals::gradient_normals(&points, &samples, field),
    };
    let mut realigned = realigned.into_iter();
    let normals = parts.iter().map(|part| own_or_realigned(part, &mut realigned, settings.own_normal)).collect();

    let leaves: usize =
        parts.iter().filter(|part| part.source.kind == PartKind::Foliage).map(|part| part.mesh.triangles.len()).sum();
    let (surface, cell) = match settings.surface_share {
        Some(share) if !surface.triangles.is_empty() => {
            let target = (f64::from(share) * leaves as f64).round() as usize;
            let (surface, cell) = with_triangles(surface, cell, target, field, parameters.threshold);
            (simplify_surface(&surface, field, target), cell)
        }
        _ => (surface, cell),
    };
    let surface = (!surface.triangles.is_empty()).then_some(surface);
    let report = ImplicitReport { parameters, generators, cell, no_surface };
    ImplicitBake { normals, ambient, surface, report }
}

/// The surface F = `threshold` with `target` triangles or more, for [`simplify_surface`] to reach the target from
/// above: `surface`, extracted with cells of `cell` metres, or one with finer cells. As near to it as
/// [`isosurface::MOST_CELLS`] allows. With the edge of its cells; a finer surface has no normals yet.
fn with_triangles(
    surface: SurfaceMesh,
    cell: f32,
    target: usize,
    field: &DensityField,
    threshold: f32,
) -> (SurfaceMesh, f32) {
    /// Triangles that a finer surface aims at, as a multiple of the target: the simplification is to choose where they
    /// go, not the lattice.
    const SURPLUS: f32 = 2.0;
    /// Triangles grow with the square of the resolution, and somewhat faster where finer cells find more lobes: the
    /// first attempt is enough as a rule.
    const ATTEMPTS: usize = 4;
    let (mut surface, mut cell) = (surface, cell);
    for _ in 0..ATTEMPTS {
        let count = surface.triangles.len();
        if count >= target {
            break;
        }
        let finer = cell * (count as f32 / (SURPLUS * target as f32)).sqrt();
        let found = isosurface::extract(field, &field.extent(), threshold, finer);
        // Where there would be too many cells the extraction takes larger ones.
        if found.cell >= cell || found.triangles.len() <= count {
            break;
        }
        cell = found.cell;
        surface = SurfaceMesh { positions: found.positions, normals: Vec::new(), triangles: found.triangles };
    }
    (surface, cell)
}

/// Why there is no surface; `values` gives the density at all vertices, which is only asked for where it matters.
fn no_surface(
    field: &DensityField,
    values: impl FnOnce() -> Vec<f32>,
    surface: &SurfaceMesh,
    smooth: bool,
    threshold: f32,
    cell: f32,
) -> Option<NoSurface> {
    if !surface.triangles.is_empty() {
        return None;
    }
    let greatest = values().into_iter().fold(0.0f32, f32::max);
    if smooth && greatest > threshold {
        None
    } else if field.memory() == 0 {
        Some(NoSurface::NoField)
    } else if greatest <= threshold {
        Some(NoSurface::Threshold { threshold, greatest })
    } else {
        Some(NoSurface::BelowResolution { cell })
    }
}

/// Normals by `find` for the foliage's vertices, none for the wood's, in one list.
fn of_foliage(parts: &[Part], find: impl Fn(&[Vec3]) -> Vec<Option<Vec3>>) -> Vec<Option<Vec3>> {
    let mut found = Vec::new();
    for part in parts {
        match part.source.kind {
            PartKind::Foliage => found.extend(find(&part.mesh.positions)),
            PartKind::Wood => found.resize(found.len() + part.mesh.positions.len(), None),
        }
    }
    found
}

/// The normals of a part, which takes its share of the list `realigned`.
fn own_or_realigned(part: &Part, realigned: &mut impl Iterator<Item = Option<Vec3>>, own_share: f32) -> Vec<Vec3> {
    let realigned = realigned.take(part.mesh.positions.len());
    part.own_normals()
        .zip(realigned)
        .map(|(own, realigned)| match part.source.kind {
            PartKind::Foliage => foliage_normals::blend(own, realigned, own_share),
            PartKind::Wood => own,
        })
        .collect()
}

/// Cuts a list with a value for each vertex of all parts into one list a part.
fn split<T>(parts: &[Part], values: impl IntoIterator<Item = T>) -> Vec<Vec<T>> {
    let mut values = values.into_iter();
    parts.iter().map(|part| values.by_ref().take(part.mesh.positions.len()).collect()).collect()
}

/// A mesh with the field's outward normals; up where the field is level.
fn with_normals(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, field: &DensityField) -> SurfaceMesh {
    let outward = |sample: &FieldSample| (-sample.gradient * field.radius()).try_normalize().unwrap_or(Vec3::Y);
    let normals = field.samples(&positions).iter().map(outward).collect();
    SurfaceMesh { positions, normals, triangles }
}
