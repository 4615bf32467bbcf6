//! Materials and their textures.

use std::sync::Arc;

use glam::{Affine2, Mat2, Vec2, Vec3};
use gltf::json::Value;
use gltf::json::material::{AlphaMode, Material, NormalTexture};
use gltf::json::texture::{Info, WrappingMode};
use gltf::json::validation::Checked;
use image::{ImageReader, Limits, RgbaImage};

use super::GltfOptions;
use super::container::Document;
use super::diffuse_transmission::DiffuseTransmission;
use super::error::{WarningKind, Warnings};
use super::leaf_extras::{self, LeafExtras};
use crate::plant::{Gloss, PartKind, PlantMaterial};

/// Maximum side of an image in texels. Larger images are not decoded.
const LONGEST_SIDE: u32 = 16_384;

/// A material, and which texture coordinates it uses.
#[derive(Clone)]
pub(super) struct Surface {
    pub name: String,
    pub kind: PartKind,
    pub material: PlantMaterial,
    /// Index of the set of texture coordinates that the textures use.
    pub uv_set: u32,
    /// Transform of those coordinates (KHR_texture_transform).
    pub uv_transform: Affine2,
    /// Whether its sampler does not repeat the texture.
    pub clamped: bool,
}

impl Surface {
    /// Whether it has a texture, so that texture coordinates matter.
    pub fn is_textured(&self) -> bool {
        self.material.base_color_texture.is_some() || self.material.normal_texture.is_some()
    }
}

/// Decoded images by index. Each image is decoded once, however many materials use it.
#[derive(Default)]
pub(super) struct Images(Vec<Option<Option<Arc<RgbaImage>>>>);

/// A reference to a texture, with or without KHR_texture_transform.
struct Reference {
    texture: usize,
    uv_set: u32,
    transform: Affine2,
}

impl Reference {
    /// Of a normal texture, whose extensions have no type of their own.
    fn of_normal(normal: &NormalTexture) -> Self {
        let extension =
            normal.extensions.as_ref().and_then(|extensions| extensions.others.get("KHR_texture_transform"));
        let numbers = |name: &str, default: [f32; 2]| {
            let list = extension.and_then(|extension| extension.get(name)).and_then(Value::as_array);
            let number = |at: usize| list.and_then(|list| list.get(at)).and_then(Value::as_f64).map(|v| v as f32);
            [number(0).unwrap_or(default[0]), number(1).unwrap_or(default[1])]
        };
        let member = |name: &str| extension.and_then(|extension| extension.get(name));
        let rotation = member("rotation").and_then(Value::as_f64).unwrap_or(0.0) as f32;
        let uv_set = member("texCoord").and_then(Value::as_u64).and_then(|set| u32::try_from(set).ok());
        let transform = match extension {
            Some(_) => transform(numbers("offset", [0.0; 2]), rotation, numbers("scale", [1.0; 2])),
            None => Affine2::IDENTITY,
        };
        Self { texture: normal.index.value(), uv_set: uv_set.unwrap_or(normal.tex_coord), transform }
    }

    fn new(info: &Info) -> Self {
        let extension = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
        let transform = extension.map_or(Affine2::IDENTITY, |t| transform(t.offset.0, t.rotation.0, t.scale.0));
        let uv_set = extension.and_then(|extension| extension.tex_coord).unwrap_or(info.tex_coord);
        Self { texture: info.index.value(), uv_set, transform }
    }
}

/// The transform of KHR_texture_transform.
fn transform(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> Affine2 {
    // Counter-clockwise in a frame whose v axis points down, as in the reference viewers of the extension.
    let (sine, cosine) = rotation.sin_cos();
    let rotation = Mat2::from_cols(Vec2::new(cosine, -sine), Vec2::new(sine, cosine));
    let matrix = rotation * Mat2::from_diagonal(Vec2::from(scale));
    Affine2::from_mat2_translation(matrix, Vec2::from(offset))
}

/// Reads material `index`; `None` is the default material of glTF.
pub(super) fn read(
    document: &mut Document,
    index: Option<usize>,
    options: &GltfOptions,
    images: &mut Images,
    warnings: &mut Warnings,
) -> Surface {
    let default = Material::default();
    let given = index.and_then(|index| document.root.materials.get(index).cloned());
    if let (Some(index), None) = (index, &given) {
        let message = "does not exist; the default material (white, opaque) is used";
        warnings.push(WarningKind::Missing, format!("/materials/{index}"), message);
    }
    let location = index.map_or_else(String::new, |index| format!("/materials/{index}"));
    let source = given.as_ref().unwrap_or(&default);
    let name =
        source.name.clone().unwrap_or_else(|| index.map_or("default".into(), |index| format!("material {index}")));

    let legacy = source.extensions.as_ref().and_then(|extensions| extensions.pbr_specular_glossiness.as_ref());
    let (factor, base) = match legacy {
        Some(legacy) => (legacy.diffuse_factor.0, legacy.diffuse_texture.as_ref()),
        None => {
            let metallic = &source.pbr_metallic_roughness;
            (metallic.base_color_factor.0, metallic.base_color_texture.as_ref())
        }
    };
    let base = base.map(Reference::new);
    let texture =
        base.as_ref().and_then(|base| load(document, base.texture, &location, "base colour", images, warnings));

    let kind = kind_of(source, &name, options, &location, warnings);
    mention_cut_out(document, source, (&name, kind), base.as_ref(), texture.as_deref(), &location, warnings);
    let opacity = unit(factor[3]);
    let mut material = PlantMaterial {
        name: name.clone(),
        base_color: Vec3::new(unit(factor[0]), unit(factor[1]), unit(factor[2])),
        base_color_texture: texture,
        ..PlantMaterial::default()
    };
    if kind == PartKind::Foliage {
        material.gloss = options.gloss.unwrap_or(Gloss::LEAF).sanitized();
        let cutoff = unit(source.alpha_cutoff.as_ref().map_or(0.5, |cutoff| cutoff.0));
        // The alpha of the factor scales the alpha of the texture. Scaling the threshold instead has the same effect.
        let masked = source.alpha_mode == Checked::Valid(AlphaMode::Mask);
        if masked && opacity < cutoff {
            let message =
                format!("its alpha of {opacity} stays below its cutoff {cutoff}: glTF hides it, here it is drawn");
            warnings.push(WarningKind::Repaired, &location, message);
            material.alpha_cutoff = cutoff;
        } else {
            material.alpha_cutoff = if masked && opacity > 0.0 { unit(cutoff / opacity) } else { cutoff };
        }
        transmit(&mut material, source, document, options, &location, images, warnings);
    }

    let mut surface = Surface {
        name,
        kind,
        material,
        uv_set: base.as_ref().map_or(0, |base| base.uv_set),
        uv_transform: base.as_ref().map_or(Affine2::IDENTITY, |base| base.transform),
        clamped: base.as_ref().is_some_and(|base| is_clamped(document, base.texture)),
    };
    if let Some(normal) = &source.normal_texture {
        let own = Reference::of_normal(normal);
        if base.is_some() && (surface.uv_set != own.uv_set || !surface.uv_transform.abs_diff_eq(own.transform, 1e-5)) {
            let message = "its normal map has texture coordinates of its own; a part has one set, the map is left out";
            warnings.push(WarningKind::Ignored, &location, message);
        } else {
            surface.uv_set = own.uv_set;
            surface.uv_transform = own.transform;
            surface.material.normal_texture = load(document, own.texture, &location, "normal", images, warnings);
        }
    }
    if kind == PartKind::Foliage {
        let extras = index.and_then(|index| document.extras.get(index)).and_then(Option::as_ref).cloned();
        if let Some(leaf) = LeafExtras::of(extras.as_ref(), &location, warnings) {
            let mut image = |texture: Option<leaf_extras::Texture>, role: &str| {
                texture.and_then(|texture| load(document, texture.index, &location, role, images, warnings))
            };
            let transmission = image(leaf.transmission_texture, "transmission");
            let thickness = image(leaf.thickness_texture, "thickness");
            let absorption = image(leaf.absorption_texture, "absorption");
            let back = match (leaf.back_texture, leaf.back_material) {
                (Some(texture), _) => image(Some(texture), "back"),
                (None, Some(material)) => {
                    let material = document.root.materials.get(material);
                    let base =
                        material.and_then(|material| material.pbr_metallic_roughness.base_color_texture.as_ref());
                    let texture = base.map(|base| leaf_extras::Texture { index: base.index.value() });
                    if texture.is_none() {
                        let message =
                            "the material of its back does not exist or has no texture; the back is as the front";
                        warnings.push(WarningKind::Missing, &location, message);
                    }
                    texture.and_then(|texture| load(document, texture.index, &location, "back", images, warnings))
                }
                (None, None) => None,
            };
            leaf.apply(&mut surface.material, [back, transmission, thickness, absorption], &location, warnings);
        }
    }
    surface
}

/// Share of opaque wood's texture from which on holes in it are mentioned.
const MANY_HOLES: f32 = 0.2;

/// Warns where the cut-out of leaves is missing, so that they would be drawn as rectangles, and where a texture has one that
/// its material does not use.
fn mention_cut_out(
    document: &Document,
    source: &Material,
    (name, kind): (&str, PartKind),
    base: Option<&Reference>,
    texture: Option<&RgbaImage>,
    location: &str,
    warnings: &mut Warnings,
) {
    let Some(base) = base else { return };
    let file = texture_name(document, base.texture);
    let Some(image) = texture else {
        if kind == PartKind::Foliage {
            let message = format!(
                "'{name}': without its texture {file} its leaves have no outline: they are drawn as full cards"
            );
            warnings.push(WarningKind::Missing, location, message);
        }
        return;
    };
    let holes = image.pixels().filter(|pixel| pixel[3] < 128).count();
    match kind {
        PartKind::Foliage if holes == 0 && image.pixels().all(|pixel| pixel[3] > 250) => {
            let message = format!(
                "'{name}': its texture {file} has no transparent texels, so its leaves are drawn as full cards; save the \
                 picture with the cut-out in its alpha channel"
            );
            warnings.push(WarningKind::Missing, location, message);
        }
        PartKind::Wood
            if source.alpha_mode == Checked::Valid(AlphaMode::Opaque)
                && holes as f32 > MANY_HOLES * (image.width() * image.height()) as f32 =>
        {
            let message = format!(
                "'{name}' is opaque, but its texture {file} has transparent texels: if these are leaves, name the material as \
                 foliage"
            );
            warnings.push(WarningKind::Missing, location, message);
        }
        _ => {}
    }
}

/// Whether the sampler of a texture ends it at its border or mirrors it.
fn is_clamped(document: &Document, texture: usize) -> bool {
    let sampler = document.root.textures.get(texture).and_then(|texture| texture.sampler);
    let sampler = sampler.and_then(|sampler| document.root.samplers.get(sampler.value()));
    let repeats = |mode: &Checked<WrappingMode>| matches!(mode, Checked::Valid(WrappingMode::Repeat));
    sampler.is_some_and(|sampler| !(repeats(&sampler.wrap_s) && repeats(&sampler.wrap_t)))
}

/// What people call a texture: the name or the file of its image.
fn texture_name(document: &Document, texture: usize) -> String {
    let image = document.root.textures.get(texture).and_then(|texture| image_of(document, texture));
    let named = image.and_then(|index| document.root.images.get(index)).and_then(|image| {
        let uri = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
        image.name.as_deref().filter(|name| !name.is_empty()).or(uri).map(|name| format!("'{name}'"))
    });
    named
        .unwrap_or_else(|| format!("(image {})", image.map_or_else(|| "unknown".to_owned(), |index| index.to_string())))
}

/// The image of a texture: its PNG or JPEG, otherwise its WebP.
fn image_of(document: &Document, texture: &gltf::json::Texture) -> Option<usize> {
    let plain = texture.source.value();
    if plain < document.root.images.len() {
        return Some(plain);
    }
    let webp = texture.extensions.as_ref()?.others.get("EXT_texture_webp")?.get("source")?.as_u64()?;
    usize::try_from(webp).ok().filter(|image| *image < document.root.images.len())
}

/// Sets the transmission of foliage: the caller's, otherwise the file's, otherwise the typical one for the kind of
/// leaf.
fn transmit(
    material: &mut PlantMaterial,
    source: &Material,
    document: &mut Document,
    options: &GltfOptions,
    location: &str,
    images: &mut Images,
    warnings: &mut Warnings,
) {
    let usual = options.leaf.transmission();
    material.transmission = options.transmission.map_or(usual, |t| t.map(|factor| 2.0 * unit(0.5 * factor)));
    if options.transmission.is_some() {
        return;
    }
    if let Some(stated) = DiffuseTransmission::of(source, location, warnings) {
        let mut image = |info: &Option<Info>, role: &str| {
            info.as_ref().and_then(|info| load(document, info.index.value(), location, role, images, warnings))
        };
        let factor = image(&stated.factor_texture, "transmission");
        let color = image(&stated.color_texture, "transmission colour");
        stated.apply(material, [factor.as_deref(), color.as_deref()], location, warnings);
    }
}

/// Wood or foliage, by the caller's lists, otherwise by the alpha mode.
fn kind_of(source: &Material, name: &str, options: &GltfOptions, location: &str, warnings: &mut Warnings) -> PartKind {
    let listed = |names: &[String]| names.iter().any(|listed| listed == name);
    if listed(&options.foliage_materials) {
        return PartKind::Foliage;
    }
    if listed(&options.wood_materials) {
        return PartKind::Wood;
    }
    match source.alpha_mode {
        Checked::Valid(AlphaMode::Mask) => PartKind::Foliage,
        Checked::Valid(AlphaMode::Blend) => {
            let message = format!("'{name}' is alpha blended; it is drawn as foliage with an alpha test at 0.5");
            warnings.push(WarningKind::Repaired, location, message);
            PartKind::Foliage
        }
        Checked::Valid(AlphaMode::Opaque) | Checked::Invalid => PartKind::Wood,
    }
}

/// The decoded image of texture `index`; `None`, with a warning, if there is none.
fn load(
    document: &mut Document,
    index: usize,
    location: &str,
    role: &str,
    images: &mut Images,
    warnings: &mut Warnings,
) -> Option<Arc<RgbaImage>> {
    let Some(texture) = document.root.textures.get(index) else {
        let message = format!("its {role} texture {index} does not exist; drawn untextured");
        warnings.push(WarningKind::Missing, location, message);
        return None;
    };
    let Some(image) = image_of(document, texture) else {
        let message = format!(
            "its {role} texture {index} has no PNG, JPEG or WebP image{}; drawn untextured: save the image as PNG",
            texture_extensions(document)
        );
        warnings.push(WarningKind::Missing, location, message);
        return None;
    };
    if images.0.len() <= image {
        images.0.resize(image + 1, None);
    }
    if images.0[image].is_none() {
        let decoded = document.image(image).map_err(|fault| fault.what).and_then(decode);
        let kept = decoded.map_err(|reason| {
            let message = format!("{reason}; what it is on is drawn untextured");
            warnings.push(WarningKind::Missing, format!("/images/{image}"), message);
        });
        images.0[image] = Some(kept.ok().map(Arc::new));
    }
    images.0[image].clone().flatten()
}

/// The texture formats that the file uses besides PNG and JPEG, in parentheses.
fn texture_extensions(document: &Document) -> String {
    let used: Vec<&str> =
        document.root.extensions_used.iter().map(String::as_str).filter(|name| name.contains("_texture_")).collect();
    if used.is_empty() { String::new() } else { format!(" (the file uses {})", used.join(", ")) }
}

/// Decodes a PNG, JPEG or WebP image, whatever its declared type.
fn decode(bytes: Vec<u8>) -> Result<RgbaImage, String> {
    let mut reader = ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() {
        return Err("is neither a PNG nor a JPEG nor a WebP".into());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    reader.limits(limits);
    let image = reader.decode().map_err(|error| format!("cannot be decoded: {error}"))?;
    Ok(image.into_rgba8())
}

/// A factor, clamped to 0..1. NaN becomes 1.
fn unit(value: f32) -> f32 {
    if value.is_nan() { 1.0 } else { value.clamp(0.0, 1.0) }
}
