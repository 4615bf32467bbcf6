//! Reads plants ([`Plant`]) from glTF and GLB files.
//!
//! The files are glTF 2.0 [Khronos 2021], JSON or GLB, with buffers and images in the file, in data URIs or in external
//! files. The reader uses the triangles of the default scene with position, normal and one set of texture coordinates;
//! base colour (factor and texture), normal texture, alpha mode and cutoff; vertex colours; skins and morph targets as they
//! stand at rest; KHR_texture_transform, KHR_materials_pbrSpecularGlossiness (its diffuse part),
//! KHR_materials_diffuse_transmission, the tissue of leaves in extras (`leaf_extras.rs`), KHR_mesh_quantization,
//! EXT_meshopt_compression, EXT_mesh_gpu_instancing, EXT_texture_webp and MSFT_lod (its finest level). Coarser levels, collision
//! hulls and ground planes are told by their names and left out; a tree whose z axis points up is turned upright; trees side by
//! side are told apart ([`trees_of`]). A [`Warning`] names everything else.
//!
//! Files come from anywhere, so nothing in them is trusted. Every index, length and count is checked before it is used.
//! No file makes this module panic, or allocate more than its own size and fixed limits allow. Damaged geometry is a
//! [`PlantError`]. Anything else (a missing texture, a broken normal) is repaired or omitted, with a warning.

mod accessor;
mod back_faces;
mod container;
mod diffuse_transmission;
mod error;
mod instancing;
mod leaf_extras;
mod material;
mod meshopt;
mod nodes;
mod primitive;
mod report;
mod roles;
mod skin;
mod tints;
mod upright;

use std::collections::BTreeMap;
use std::path::Path;

use glam::Vec3;

pub use error::{PlantError, Warning, WarningKind};
pub use report::{PartReport, PlantReport};

use super::{Gloss, LeafKind, PartKind, Plant, PlantMesh, PlantPart};
use container::Beside;
use error::{EXPORT_AGAIN, Fault, Warnings};
use material::{Images, Surface};
use primitive::Piece;
use skin::Deformation;
use upright::SideBySide;

/// A plant that stands farther from the origin than this fraction of its height is moved there.
const FAR_OFF: f32 = 0.1;
/// Fraction of the height of the wood, from its lowest point, whose mean position is the foot.
const FOOT_SHARE: f32 = 0.02;
/// Plausible heights in metres. A plant outside this range probably has other units.
const PLAUSIBLE_HEIGHTS: std::ops::RangeInclusive<f32> = 0.02..=130.0;

/// How a file becomes a plant.
#[derive(Clone, Debug, Default)]
pub struct GltfOptions {
    /// Height in metres to which the plant is scaled about its foot (> 0); `None` keeps the file's.
    pub height: Option<f32>,
    /// Names of materials that are foliage whatever their alpha mode.
    pub foliage_materials: Vec<String>,
    /// Names of materials that are wood whatever their alpha mode.
    pub wood_materials: Vec<String>,
    /// Kind of the leaves. It decides how much light passes through them if the file does not say so.
    pub leaf: LeafKind,
    /// Transmission of leaves, as [`super::PlantMaterial::transmission`], 0..2 each. `None` takes that of the file's
    /// materials (KHR_materials_diffuse_transmission), or else the typical one of `leaf`.
    pub transmission: Option<Vec3>,
    /// Gloss of leaves; `None` is [`Gloss::LEAF`]. The file's roughness and specular terms are not used: they are
    /// mostly the defaults of an exporter.
    pub gloss: Option<Gloss>,
    /// Name of the plant; `None` takes the file's name without its ending.
    pub name: Option<String>,
    /// The axis of the file that points up. `None` takes y, as glTF demands, unless the tree clearly stands along z.
    pub up: Option<UpAxis>,
    /// Names of the nodes or meshes that are the plant, with what is below them; empty takes all.
    pub node: Vec<String>,
    /// Names of nodes, meshes or materials that are left out.
    pub ignore: Vec<String>,
}

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
pub enum UpAxis {
    /// As glTF demands.
    Y,
    /// As Blender and other programs have it, before they export.
    Z,
}

/// Reads the plant in `path` (.gltf or .glb).
///
/// - Materials with alpha mode MASK or BLEND are [`PartKind::Foliage`], others [`PartKind::Wood`], unless `options`
///   names them. All primitives with the same material become one part; wood comes first.
/// - The foot of the plant is the mean position of the lowest 2 % of its wood (or of the whole plant, if it has no
///   wood). If the foot is farther from the origin than 10 % of the height, horizontally or vertically, it is moved to
///   the origin. Otherwise the plant stays as modelled, so that roots stay below the ground.
/// - With [`GltfOptions::height`] the plant is then scaled to that height.
///
/// # Errors
/// [`PlantError`] if the file cannot be read, is not glTF 2.0, requires an unknown extension, has unusable geometry or
/// no triangles, or if an option is out of range.
pub fn load_plant(path: &Path, options: &GltfOptions) -> Result<(Plant, Vec<Warning>), PlantError> {
    let bytes = std::fs::read(path).map_err(|source| PlantError::Io { path: path.to_path_buf(), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    read_plant(&bytes, path, Beside::Folder(folder), options)
}

/// Names of the trees that the file holds side by side, each of which [`GltfOptions::node`] can choose; none for a file of one
/// tree, of trees that no name tells apart, of more than 64, and for one that cannot be read, of which [`load_plant`] says why.
pub fn trees_of(path: &Path, options: &GltfOptions) -> Vec<String> {
    let Ok(bytes) = std::fs::read(path) else { return Vec::new() };
    let mut warnings = Warnings::default();
    let folder = path.parent().unwrap_or(Path::new(""));
    let Ok(mut document) = container::open(&bytes, path, Beside::Folder(folder), &mut warnings) else {
        return Vec::new();
    };
    if document.root.nodes.len() < 2 {
        return Vec::new();
    }
    // Where the trees stand does not depend on textures, which take the most time to read.
    document.root.images.clear();
    match gather(&mut document, options, &mut warnings) {
        Ok((_, trees)) if trees.can_be_chosen && trees.names.len() <= upright::MOST_INDIVIDUALS => trees.names,
        _ => Vec::new(),
    }
}

/// External files of a .gltf file, by the relative paths that [`external_files`] lists: their bytes, or why they cannot
/// be read.
pub type ExternalFiles = BTreeMap<String, Result<Vec<u8>, String>>;

/// The external files that the bytes of a glTF file name for buffers and images: relative paths, sorted, each once.
/// Most GLB files name none. `name` is the name of the file, for messages.
///
/// # Errors
/// [`PlantError`] if the bytes are not glTF 2.0.
pub fn external_files(bytes: &[u8], name: &Path) -> Result<Vec<String>, PlantError> {
    container::external_files(bytes, name)
}

/// Reads the plant in the `bytes` of a glTF file, as [`load_plant`] reads the file itself. `name` is the name of the
/// file, for messages and for the name of the plant. `files` are its external files.
///
/// # Errors
/// Those of [`load_plant`]. A missing file is an error for a buffer and a warning for an image.
pub fn load_plant_bytes(
    bytes: &[u8],
    name: &Path,
    files: &ExternalFiles,
    options: &GltfOptions,
) -> Result<(Plant, Vec<Warning>), PlantError> {
    read_plant(bytes, name, Beside::Memory(files), options)
}

fn read_plant(
    bytes: &[u8],
    path: &Path,
    beside: Beside,
    options: &GltfOptions,
) -> Result<(Plant, Vec<Warning>), PlantError> {
    if let Some(height) = options.height.filter(|height| !(height.is_finite() && *height > 0.0)) {
        let what = format!("height = {height} m cannot be; give a height above 0 or leave it out");
        return Err(PlantError::Option { path: path.to_path_buf(), what });
    }
    let mut warnings = Warnings::default();
    let mut document = container::open(bytes, path, beside, &mut warnings)?;
    check_extensions(&document.root, path, &mut warnings)?;
    let gathered = gather(&mut document, options, &mut warnings).map_err(|fault| fault.into_error(path))?;
    let (mut gathered, _) = gathered;
    gathered.retain(|(_, mesh)| !mesh.triangles.is_empty());
    back_faces::join(&mut gathered, &mut warnings);
    if gathered.is_empty() {
        let root = &document.root;
        let scanned = format!("{} scenes, {} nodes, {} meshes", root.scenes.len(), root.nodes.len(), root.meshes.len());
        return Err(PlantError::Empty { path: path.to_path_buf(), scanned });
    }
    mention_unused(&document.root, options, &mut warnings);

    let stem = path.file_stem().map_or_else(|| "plant".into(), |stem| stem.to_string_lossy().into_owned());
    let mut plant = Plant { name: options.name.clone().unwrap_or(stem), parts: Vec::new() };
    gathered.sort_by_key(|(surface, _)| surface.kind == PartKind::Foliage);
    for (surface, mesh) in gathered {
        let mut material = surface.material;
        if let Some(tissue) = material.tissue.as_mut().filter(|tissue| tissue.volume)
            && !mesh.is_closed()
        {
            tissue.volume = false;
            let message =
                format!("'{}' is no closed volume: edges are open; its leaves are drawn as planes", surface.name);
            warnings.push(WarningKind::Repaired, "", message);
        }
        plant.parts.push(PlantPart { kind: surface.kind, mesh, material });
    }
    mention_absent_kind(&plant, &mut warnings);
    stand(&mut plant, options, &mut warnings).map_err(|fault| fault.into_error(path))?;
    Ok((plant, warnings.finish()))
}

/// Whether an extension adds only to what is drawn here anyway, so that a file that requires it can be read without it: the
/// gloss of materials, lights, notes.
fn is_harmless(extension: &str) -> bool {
    const PREFIXES: [&str; 5] = ["KHR_materials_", "EXT_materials_", "KHR_lights_", "KHR_xmp", "KHR_animation_"];
    PREFIXES.iter().any(|prefix| extension.starts_with(prefix))
}

/// Whether an extension is supported.
fn is_understood(extension: &str) -> bool {
    let others = [
        "KHR_texture_transform",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_mesh_quantization",
        "EXT_texture_webp",
        "MSFT_lod",
        container::MESHOPT,
        instancing::NAME,
    ];
    extension == diffuse_transmission::NAME || others.contains(&extension)
}

fn check_extensions(root: &gltf::json::Root, path: &Path, warnings: &mut Warnings) -> Result<(), PlantError> {
    if let Some(required) = root.extensions_required.iter().find(|name| !is_harmless(name) && !is_understood(name)) {
        let remedy = match required.as_str() {
            "KHR_draco_mesh_compression" => {
                "decompress it (`gltf-transform copy IN.glb OUT.glb`), or export with compression off"
            }
            name if name.contains("_texture_") => {
                "save its textures as PNG or WebP (`gltf-transform png IN.glb OUT.glb`), or export with them"
            }
            _ => "export without it",
        };
        return Err(PlantError::Unsupported {
            path: path.to_path_buf(),
            what: format!("the extension {required}"),
            remedy,
        });
    }
    for name in root.extensions_used.iter().filter(|name| !is_understood(name)) {
        warnings.push(WarningKind::Ignored, "/extensionsUsed", format!("the extension {name}"));
    }
    Ok(())
}

/// A part of a mesh where its node places it.
struct Placed {
    /// The placement that it belongs to.
    placement: usize,
    material: Option<usize>,
    piece: Piece,
}

/// Reads all meshes of the tree and merges them by material and vertex colour, in the order of the materials.
fn gather(
    document: &mut container::Document,
    options: &GltfOptions,
    warnings: &mut Warnings,
) -> Result<(Vec<(Surface, PlantMesh)>, SideBySide), Fault> {
    let (mut placements, globals) = nodes::placements(&document.root, warnings)?;
    if document.root.nodes.is_empty() && !document.root.meshes.is_empty() {
        // The file is a collection of meshes without a scene. Together they are the plant.
        warnings.push(WarningKind::Repaired, "/nodes", "there are no nodes; all meshes are used as they are");
        let meshes = 0..document.root.meshes.len();
        placements.extend(meshes.map(|mesh| nodes::Placement {
            node: mesh,
            mesh,
            transform: glam::DMat4::IDENTITY,
            path: Vec::new(),
        }));
    }
    let placements = roles::keep_tree(&document.root, placements, options, warnings);
    let placements = instancing::expand(document, placements, warnings)?;

    let mut images = Images::default();
    let mut surfaces: BTreeMap<Option<usize>, Surface> = BTreeMap::new();
    let mut placed = Vec::new();
    let mut total = 0u64;
    for (number, placement) in placements.iter().enumerate() {
        let location = format!("/meshes/{}", placement.mesh);
        let Some(mesh) = document.root.meshes.get(placement.mesh).cloned() else {
            return Err(Fault::new(location, format!("does not exist, node {} uses it", placement.node), EXPORT_AGAIN));
        };
        let deformation = deformation_of(document, placement, &mesh, &globals, warnings)?;
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            let location = format!("{location}/primitives/{index}");
            total = total.saturating_add(primitive::claimed_size(document, primitive));
            primitive::check_budget(total, &location)?;
            let material = primitive.material.map(|material| material.value());
            let surface = surfaces
                .entry(material)
                .or_insert_with(|| material::read(document, material, options, &mut images, warnings));
            if options.ignore.contains(&surface.name) {
                continue;
            }
            let piece = primitive::read(document, primitive, &location, surface, &deformation, warnings)?;
            let Some(mut piece) = piece else { continue };
            let transform = if piece.skinned { glam::DMat4::IDENTITY } else { placement.transform };
            let node = format!("/nodes/{}", placement.node);
            let flattened = nodes::apply(&mut piece.mesh, &transform, &node)?;
            if flattened > 0 {
                let message = format!("its transform flattens {flattened} triangles; left out");
                warnings.push(WarningKind::Repaired, node, message);
            }
            placed.push(Placed { placement: number, material, piece });
        }
    }
    let up_is_z = upright::up_is_z(&placed, &surfaces, options, warnings);
    leave_out_ground(&document.root, &placements, &mut placed, &surfaces, up_is_z, warnings);
    if up_is_z {
        placed.iter_mut().for_each(|placed| upright::turn(&mut placed.piece.mesh));
    }
    let trees = upright::side_by_side(&document.root, &placements, &placed);
    trees.mention(warnings);

    let mut parts: BTreeMap<(Option<usize>, [u32; 3]), (Surface, PlantMesh)> = BTreeMap::new();
    for Placed { material, piece, .. } in placed {
        let Some(surface) = surfaces.get(&material) else { continue };
        let plain = piece.colors.is_empty();
        let tinted = if plain {
            vec![tints::Tinted { mesh: piece.mesh, color: Vec3::ONE }]
        } else {
            tints::divide(piece.mesh, &piece.colors, surface.material.base_color_texture.is_some())
        };
        if !plain && (tinted.len() > 1 || tinted.iter().any(|part| part.color != Vec3::ONE)) {
            let message = match tinted.len() {
                1 => "its vertex colours are used as their mean".to_owned(),
                count => format!("its vertex colours are used as {count} colours, each a part of its own"),
            };
            warnings.push(
                WarningKind::Repaired,
                material.map_or_else(String::new, |n| format!("/materials/{n}")),
                message,
            );
        }
        for part in tinted {
            let key = part.color.to_array().map(|channel| (channel * 255.0).round() as u32);
            let (_, merged) = parts.entry((material, key)).or_insert_with(|| {
                let mut surface = surface.clone();
                surface.material.base_color *= part.color;
                (surface, PlantMesh::default())
            });
            append(merged, part.mesh);
        }
    }
    Ok((parts.into_values().collect(), trees))
}

/// What bones and morph targets do to a mesh at rest.
fn deformation_of(
    document: &mut container::Document,
    placement: &nodes::Placement,
    mesh: &gltf::json::Mesh,
    globals: &[glam::DMat4],
    warnings: &mut Warnings,
) -> Result<Deformation, Fault> {
    let node = document.root.nodes.get(placement.node).filter(|_| !placement.path.is_empty());
    let weights = node.and_then(|node| node.weights.clone()).or_else(|| mesh.weights.clone()).unwrap_or_default();
    let skin = node.and_then(|node| node.skin.map(|skin| skin.value()));
    let joints = match skin {
        Some(skin) => skin::joints(document, skin, globals, warnings)?,
        None => Vec::new(),
    };
    Ok(Deformation { weights, joints })
}

/// Leaves out the meshes that are ground by their name, shape and place.
fn leave_out_ground(
    root: &gltf::json::Root,
    placements: &[nodes::Placement],
    placed: &mut Vec<Placed>,
    surfaces: &BTreeMap<Option<usize>, Surface>,
    up_is_z: bool,
    warnings: &mut Warnings,
) {
    let candidate = |placed: &Placed| {
        let by_name = placements.get(placed.placement).is_some_and(|p| roles::may_be_ground(&roles::label(root, p)));
        by_name || surfaces.get(&placed.material).is_some_and(|surface| roles::may_be_ground(&surface.name))
    };
    let tree = upright::bounds(placed.iter().filter(|placed| !candidate(placed)));
    let Some(tree) = tree else { return };
    let mut names = Vec::new();
    placed.retain(|placed| {
        let ground = candidate(placed)
            && upright::bounds(std::iter::once(placed)).is_some_and(|bounds| roles::is_ground(bounds, tree, up_is_z));
        if ground && let Some(placement) = placements.get(placed.placement) {
            names.push(roles::label(root, placement));
        }
        !ground
    });
    if !names.is_empty() {
        let message = format!("ground planes, which are not drawn: {}", roles::shortened(&names));
        warnings.push(WarningKind::Ignored, "/nodes", message);
    }
}

/// Appends `mesh` to `merged`.
fn append(merged: &mut PlantMesh, mesh: PlantMesh) {
    let first = merged.positions.len() as u32;
    merged.positions.extend(mesh.positions);
    merged.normals.extend(mesh.normals);
    merged.uvs.extend(mesh.uvs);
    merged.triangles.extend(mesh.triangles.into_iter().map(|triangle| triangle.map(|index| index + first)));
}

/// Warns of parts of the file that a plant does not use, and of options that match nothing.
fn mention_unused(root: &gltf::json::Root, options: &GltfOptions, warnings: &mut Warnings) {
    let unused = [("animations", root.animations.len()), ("cameras", root.cameras.len())];
    for (name, count) in unused.into_iter().filter(|(_, count)| *count > 0) {
        warnings.push(WarningKind::Ignored, format!("/{name}"), format!("{count} {name}; the plant stands still"));
    }
    for name in options.foliage_materials.iter().chain(&options.wood_materials) {
        if !root.materials.iter().any(|material| material.name.as_ref() == Some(name)) {
            let known: Vec<&str> = root.materials.iter().filter_map(|material| material.name.as_deref()).collect();
            let message = format!("the options name a material '{name}'; the file has: {}", known.join(", "));
            warnings.push(WarningKind::Missing, "/materials", message);
        }
    }
}

fn mention_absent_kind(plant: &Plant, warnings: &mut Warnings) {
    if plant.triangle_count(PartKind::Foliage) == 0 {
        let message =
            "no foliage: no used material has alpha mode MASK or BLEND; name the leaves' materials as foliage";
        warnings.push(WarningKind::Missing, "/materials", message);
    }
    if plant.triangle_count(PartKind::Wood) == 0 {
        let message = "no wood: all used materials are alpha tested; name the bark's materials as wood if there is any";
        warnings.push(WarningKind::Missing, "/materials", message);
    }
}

/// Moves the foot of the plant to the origin if it is far from it, and scales the plant.
fn stand(plant: &mut Plant, options: &GltfOptions, warnings: &mut Warnings) -> Result<(), Fault> {
    let Some(bounds) = plant.bounds() else {
        return Ok(());
    };
    let tall = bounds.size().y;
    let foot = foot(plant);
    let sideways = Vec3::new(foot.x, 0.0, foot.z).length();
    let limit = FAR_OFF * tall.max(f32::MIN_POSITIVE);
    if sideways > limit || foot.y.abs() > limit {
        for position in plant.parts.iter_mut().flat_map(|part| part.mesh.positions.iter_mut()) {
            *position -= foot;
        }
        let message = format!("its foot stood at ({:.2}, {:.2}, {:.2}) m; moved to the origin", foot.x, foot.y, foot.z);
        warnings.push(WarningKind::Repaired, "", message);
    }
    let height = plant.height();
    match options.height {
        Some(wanted) => {
            let factor = wanted / height;
            if !(factor.is_finite() && factor > 0.0) {
                let what = format!("a plant {height} m high cannot be scaled to {wanted} m");
                return Err(Fault::new("", what, "leave its height out, or correct the model"));
            }
            plant.scale(factor);
        }
        None if !PLAUSIBLE_HEIGHTS.contains(&height) => {
            let message = format!("the plant is {height} m high; if the file is not in metres, give its height");
            warnings.push(WarningKind::Missing, "", message);
        }
        None => {}
    }
    let finite = plant.parts.iter().flat_map(|part| &part.mesh.positions).all(|position| position.is_finite());
    if finite { Ok(()) } else { Err(Fault::new("", "positions leave the range of numbers", EXPORT_AGAIN)) }
}

/// The mean position of the lowest 2 % of the wood (or of the plant, if it has no wood), at the height of its lowest
/// point.
fn foot(plant: &Plant) -> Vec3 {
    let has_wood = plant.triangle_count(PartKind::Wood) > 0;
    let counts = |kind: PartKind| !has_wood || kind == PartKind::Wood;
    let Some(bounds) = plant.bounds_of(counts) else {
        return Vec3::ZERO;
    };
    let limit = bounds.min.y + FOOT_SHARE * bounds.size().y;
    let parts = plant.parts.iter().filter(|part| counts(part.kind));
    let low = parts.flat_map(|part| &part.mesh.positions).filter(|position| position.y <= limit);
    let (sum, count) = low.fold((glam::DVec2::ZERO, 0.0), |(sum, count), p| {
        (sum + p.as_dvec3().truncate().with_y(f64::from(p.z)), count + 1.0)
    });
    let middle = if count > 0.0 { (sum / count).as_vec2() } else { glam::Vec2::ZERO };
    Vec3::new(middle.x, bounds.min.y, middle.y)
}
