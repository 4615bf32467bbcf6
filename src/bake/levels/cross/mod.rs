//! Crossed billboards made from the model itself [Franzke 2005, 4.3, "Kreuzebenen"].
//!
//! Upright planes through the trunk's axis, four by default, and a level one through the foliage's centre.
//! Each plane's texture shows the *whole* plant seen along the plane's normal, so a few quads represent the tree from
//! every side. More upright planes are more views of it: of any number, the one or two are shown that face the viewer best. A texel has
//! a base colour, normal, ambient term and a fraction of foliage; how much of the sun's light it shows,
//! for every sun (`sun.rs`); and if the plant is lit by radiance transfer, the transfer of the sky's light (`light.rs`).
//!
//! ```text
//! plant, lighting --rasterise (rasterize.rs)--> samples --resolve--> texels --color.rs-----> base colour, alpha
//!                                                           |               \-properties.rs-> normal, ambient term, foliage
//!                                                           \-one sample of each texel--sun.rs--> light of the sun
//! ```
//!
//! Cost: an image for each plane, of (resolution * supersampling)² samples. Limits: a plane looks right along its normal and
//! lacks parallax in other directions; a plane seen from behind shows the texture of its front, mirrored.

pub(super) mod color;
pub(super) mod light;
pub(super) mod properties;
mod signed_mips;
mod sun;

pub use light::LIGHT_SCALE;
pub use sun::{SUN_SCALE, basis as sun_basis};

use std::sync::Arc;

use glam::{Mat3, Vec3, Vec4};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::{light::VertexLight, properties::IsotropicSum};
use super::rasterize::{Hit, Raster, View};
use super::texture::BlockEncoding::{Pairs, Whole};
use super::texture::{LevelTexture, square_bytes};
use crate::bake::lighting::{AmbientTerm, BakedLighting};
use crate::math::{hash::mix32, luminance};
use crate::plant::{Bounds, PartKind, Plant, PlantMaterial, geometry, texture::AlphaFade};

/// Crossed billboards of one plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cross {
    /// The upright planes, evenly turned from the one that faces +Z over +X; the last one faces up.
    pub planes: Vec<CrossPlane>,
    /// Their textures, in the order of the planes.
    pub textures: CrossTextures,
    /// Transmission of the foliage (mean over its area), a factor as in [`PlantMaterial::transmission`]. It applies to
    /// a texel in proportion to its fraction of foliage.
    pub transmission: Vec3,
    /// Per mip: fraction of a texel's leaf area whose normals are isotropic, 0..1, which averaging the normals hides
    /// (compare [Toksvig 2005, "Mipmapping Normal Maps"]). 0: all leaves share the texel's normal. The last entry
    /// serves all coarser mips.
    pub isotropic_fraction: [f32; ISOTROPIC_LEVELS],
}

impl Cross {
    /// The upright planes.
    pub fn uprights(&self) -> &[CrossPlane] {
        self.planes.split_last().map_or(&[], |(_, uprights)| uprights)
    }

    /// Area that the plant hides from above, m²: that of the level plane's outline.
    pub fn area_from_above(&self) -> f32 {
        let (Some(plane), Some(color)) = (self.planes.last(), self.textures.color.last()) else { return 0.0 };
        4.0 * plane.u.length() * plane.v.length() * color.texels.coverage(0, 0.5)
    }

    /// Bytes of all textures, in blocks or as texels.
    pub fn texture_bytes(&self, in_blocks: bool) -> usize {
        self.textures.all().map(|texture| texture.bytes(in_blocks)).sum()
    }

    /// Whether the lists go together, of a plant that is lit by radiance transfer or not, and all values are in their
    /// ranges.
    pub fn is_whole(&self, of_transfer: bool) -> bool {
        let CrossTextures { color, properties, sun, light } = &self.textures;
        let planes = self.planes.len();
        let finite = |plane: &CrossPlane| [plane.center, plane.u, plane.v, plane.normal].iter().all(|v| v.is_finite());
        self.planes.iter().all(finite)
            && (2..=MOST_UPRIGHTS as usize + 1).contains(&planes)
            && [color.len(), properties.len(), sun.len()] == [planes, planes, 2 * planes]
            && light.len() == if of_transfer { planes } else { 0 }
            && self.textures.all().all(LevelTexture::is_whole)
            && self.transmission.is_finite()
            && self.isotropic_fraction.iter().all(|share| (0.0..=1.0).contains(share))
    }
}

/// The most upright planes.
pub const MOST_UPRIGHTS: u32 = 8;

/// Mips for which [`Cross::isotropic_fraction`] is known.
pub const ISOTROPIC_LEVELS: usize = 8;

/// A rectangle `center + s u + t v` with s and t in -1..=1; its texture's upper left corner is at `center - u + v`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossPlane {
    /// Middle, metres, in the plant's frame.
    pub center: Vec3,
    /// From the centre to the right border of the texture, metres. Zero where the plant has no extent.
    pub u: Vec3,
    /// From the centre to the upper border of the texture, metres. Zero where the plant has no extent.
    pub v: Vec3,
    /// Unit normal, towards the side from which the texture was rendered; right-handed with u and v.
    pub normal: Vec3,
}

impl CrossPlane {
    /// Unit vectors to the right, up and to the front as columns: takes the normals stored in
    /// [`CrossTextures::properties`] into the plant's frame. Columns without extent are completed from the others.
    pub fn frame(&self) -> Mat3 {
        let unit = |axis: Vec3| axis.try_normalize();
        let (right, up) = match (unit(self.u), unit(self.v)) {
            (Some(right), Some(up)) => (right, up),
            (Some(right), None) => (right, self.normal.cross(right)),
            (None, Some(up)) => (up.cross(self.normal), up),
            (None, None) => self.normal.any_orthonormal_pair(),
        };
        Mat3::from_cols(right, up, self.normal)
    }
}

/// The textures of crossed billboards: one of each kind per plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossTextures {
    /// Base colour: sRGB-encoded RGB, to be drawn with an alpha test at 0.5 or above. At 0.5 the outline covers what
    /// the full model covers (in every mip); towards 1 the crown vanishes in the order of [`CrossSettings::fade`]
    /// ([`crate::plant::texture::fade_alpha`]), without popping. Colours are dilated.
    pub color: Vec<LevelTexture>,
    /// RG: the normal, octahedral [Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit
    /// Vectors"; Bevy's `octahedral_decode`], **in the plane's frame** (x right, y up, z to the front): decode, flip
    /// z where the plane is seen from behind, then multiply with [`CrossPlane::frame`]. In that frame the seam of
    /// the encoding lies behind the plane, where no normal points, so the texture can be filtered.
    /// B: ambient term (ambient occlusion). A: fraction of foliage (1 leaf, 0 wood), the weight of transmission.
    /// Linear 8 bit; texels outside the outline continue those inside.
    pub properties: Vec<LevelTexture>,
    /// The sun's light, two textures per plane: bytes, of which 128 stands for 0 and 255 for [`SUN_SCALE`], the coefficients of eight
    /// functions of the direction to the sun (the page of `sun.rs`) in the plane's frame, whose third axis is flipped
    /// like the normal's where the plane is seen from behind. The radiance of a texel under the sun is its base colour times
    /// what of it is reflected diffusely or comes through, times illuminance over pi, times their sum; and the gloss.
    pub sun: Vec<LevelTexture>,
    /// Radiance transfer of the sky's light, for plants that are lit by it; empty for others. Bytes, of which
    /// 128 stands for 0 and 255 for [`LIGHT_SCALE`]. RGB: a vector in the plane's frame, whose third component is flipped like the
    /// normal's where the plane is seen from behind. A: the mean over all directions. The radiance of a texel under the
    /// sky is its base colour times `1 + transmission` times (mean times the sky's first coefficient, plus the vector's
    /// dot product with the sky's second band).
    pub light: Vec<LevelTexture>,
}

impl CrossTextures {
    fn all(&self) -> impl Iterator<Item = &LevelTexture> {
        let Self { color, properties, sun, light } = self;
        color.iter().chain(properties).chain(sun).chain(light)
    }
}

/// Settings of the crossed billboards. Values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossSettings {
    /// Upright planes, 1..=[`MOST_UPRIGHTS`], each seen from another side: the outline is that of the tree within a quarter of a turn
    /// over their number. All trees draw as many triangles; memory and the time of the bake grow in proportion.
    pub uprights: u32,
    /// Edge of the square textures in texels, 64..=1024, rounded up to a power of two. Larger textures allow crosses
    /// nearer to the viewer; memory grows with the square (256: 7.0 MB per plant, 8.7 MB if it is lit by transfer; in blocks 2.6
    /// and 3.1).
    pub resolution: u32,
    /// Samples per texel along each axis, 1..=8. More give smoother colours and normals; time grows with the square.
    pub supersampling: u32,
    /// Standard deviation of the blur of the normals, as a fraction of the texture's width, 0..=0.1. 0: every leaf
    /// keeps its normal. Larger: the crown is lit as a rounded body. [`Cross::isotropic_fraction`] keeps what averaging
    /// loses.
    pub normal_smoothing: f32,
    /// Which texels appear first while a cross fades in. The default is more accurate where nothing fades; the
    /// published order pops less (`docs/measurements/alpha-fade.md`).
    pub fade: AlphaFade,
}

impl Default for CrossSettings {
    fn default() -> Self {
        Self { uprights: 4, resolution: 256, supersampling: 4, normal_smoothing: 0.0, fade: AlphaFade::default() }
    }
}

impl CrossSettings {
    /// The settings with every value clamped to its range; a value that is not finite becomes the default.
    pub fn sanitized(self) -> Self {
        let smoothing =
            if self.normal_smoothing.is_finite() { self.normal_smoothing } else { Self::default().normal_smoothing };
        Self {
            uprights: self.uprights.clamp(1, MOST_UPRIGHTS),
            resolution: self.resolution.clamp(64, 1024).next_power_of_two(),
            supersampling: self.supersampling.clamp(1, 8),
            normal_smoothing: smoothing.clamp(0.0, 0.1),
            fade: self.fade,
        }
    }

    /// Bytes of the textures that [`bake_cross`] makes, in blocks or as texels, of a plant that is lit by radiance transfer or not.
    pub fn texture_bytes(self, of_transfer: bool, in_blocks: bool) -> usize {
        let Self { uprights, resolution, .. } = self.sanitized();
        let (planes, levels) = (uprights as usize + 1, resolution.ilog2() + 1);
        let bytes = |encoding| square_bytes(resolution, levels, in_blocks.then_some(encoding));
        planes * ((2 + usize::from(of_transfer)) * bytes(Whole) + 2 * bytes(Pairs))
    }
}

/// Makes the crossed billboards of `plant` with the normals and the ambient term of its `lighting`; missing values are
/// the plant's own, or 1. The planes cover the plant exactly; an empty plant gets planes without extent and wholly transparent textures.
pub fn bake_cross(plant: &Arc<Plant>, lighting: &BakedLighting, settings: &CrossSettings) -> Cross {
    let settings = settings.sanitized();
    let planes = planes(plant, settings.uprights);
    let resolution = settings.resolution as usize;
    let light = light::vertex_light(lighting);
    let render = |plane| render_plane(plant, lighting, light.as_deref(), plane, &settings);
    let images: Vec<Image> = planes.par_iter().map(render).collect();
    let samples: Vec<Vec<sun::Sample>> = images.iter().map(Image::samples).collect();
    let coefficients = sun::coefficients(plant, &planes, &samples);
    let textures: Vec<_> = images
        .par_iter()
        .zip(&coefficients)
        .map(|(image, coefficients)| {
            let texels = &image.texels;
            let (properties, isotropy) = properties::mips(texels, resolution, settings.normal_smoothing);
            let light = light.is_some().then(|| LevelTexture::compressed(light::mips(texels, resolution), Whole));
            let sun = sun::mips(image, coefficients, resolution).map(|sun| LevelTexture::compressed(sun, Pairs));
            let color = LevelTexture::compressed(color::mips(texels, resolution, settings.fade), Whole);
            (color, ((LevelTexture::compressed(properties, Whole), isotropy), (sun, light)))
        })
        .collect();
    let (color, rest): (Vec<_>, Vec<_>) = textures.into_iter().unzip();
    let (properties, rest): (Vec<_>, Vec<_>) = rest.into_iter().unzip();
    let (sun, light): (Vec<_>, Vec<_>) = rest.into_iter().unzip();
    let (properties, isotropy): (Vec<_>, Vec<_>) = properties.into_iter().unzip();
    let sun = sun.into_iter().flatten().collect();
    let light = light.into_iter().flatten().collect();
    Cross {
        planes,
        textures: CrossTextures { color, properties, sun, light },
        transmission: mean_transmission(plant),
        isotropic_fraction: mean_isotropic_fraction(&isotropy),
    }
}

/// Mean over the planes' images, level by level; levels beyond the coarsest mip repeat it.
pub(in crate::bake::levels) fn mean_isotropic_fraction(images: &[Vec<IsotropicSum>]) -> [f32; ISOTROPIC_LEVELS] {
    std::array::from_fn(|level| {
        let (mut isotropic, mut weight) = (0.0, 0.0);
        for sum in images.iter().filter_map(|levels| levels.get(level).or(levels.last())) {
            isotropic += sum.isotropic;
            weight += sum.weight;
        }
        if weight > 0.0 { (isotropic / weight) as f32 } else { 0.0 }
    })
}

fn planes(plant: &Plant, uprights: u32) -> Vec<CrossPlane> {
    let bounds = plant.bounds().filter(|bounds| bounds.min.is_finite() && bounds.max.is_finite());
    let bounds = bounds.unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
    let half = 0.5 * bounds.size();
    let middle = bounds.center();
    let height = foliage_height(plant).unwrap_or(middle.y).clamp(bounds.min.y, bounds.max.y);
    let upright = |index: u32| {
        let (sin, cos) = quarter_exact(f64::from(index) / f64::from(uprights));
        let right = Vec3::new(cos, 0.0, -sin);
        let (least, most) = reach(plant, right);
        CrossPlane {
            center: right * (0.5 * (least + most)) + Vec3::Y * middle.y,
            u: right * (0.5 * (most - least)),
            v: Vec3::Y * half.y,
            normal: Vec3::new(sin, 0.0, cos),
        }
    };
    let level =
        CrossPlane { center: middle.with_y(height), u: Vec3::X * half.x, v: Vec3::NEG_Z * half.z, normal: Vec3::Y };
    (0..uprights).map(upright).chain([level]).collect()
}

/// Sine and cosine of a part of half a turn; exactly 0 and 1 for half of it.
fn quarter_exact(part: f64) -> (f32, f32) {
    let (sin, cos) = (part * std::f64::consts::PI).sin_cos();
    if part == 0.5 { (1.0, 0.0) } else { (sin as f32, cos as f32) }
}

/// How far the plant reaches along `axis`, metres from its foot: least and most. 0 where it is not finite.
fn reach(plant: &Plant, axis: Vec3) -> (f32, f32) {
    let positions = plant.parts.iter().flat_map(|part| &part.mesh.positions);
    let reached = positions.map(|position| position.dot(axis));
    let (least, most) = reached.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    if least.is_finite() && most.is_finite() { (least, most) } else { (0.0, 0.0) }
}

/// Height of the centre of the foliage's area, metres.
fn foliage_height(plant: &Plant) -> Option<f32> {
    let (mut moment, mut total) = (0.0f64, 0.0f64);
    for part in plant.parts.iter().filter(|part| part.kind == PartKind::Foliage) {
        for (_, corners) in geometry::triangles(&part.mesh) {
            let area = f64::from(geometry::area(&part.mesh, corners));
            let heights: f64 = corners.iter().map(|&c| f64::from(part.mesh.positions[c].y)).sum();
            moment += area * heights / 3.0;
            total += area;
        }
    }
    let height = (moment / total) as f32;
    height.is_finite().then_some(height)
}

pub(in crate::bake::levels) fn mean_transmission(plant: &Plant) -> Vec3 {
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for part in plant.parts.iter().filter(|part| part.kind == PartKind::Foliage) {
        let area: f64 = geometry::triangles(&part.mesh).map(|(_, c)| f64::from(geometry::area(&part.mesh, c))).sum();
        sum += area as f32 * part.material.transmission;
        total += area as f32;
    }
    let mean = sum / total;
    let most = Vec3::splat(PlantMaterial::MOST_TRANSMISSION);
    if mean.is_finite() { mean.clamp(Vec3::ZERO, most) } else { Vec3::ZERO }
}

/// The mean of a texel's samples. All but `coverage` are weighted with it: sums over the samples that see the plant,
/// divided by the number of all samples.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::bake::levels) struct Texel {
    /// Share of the samples that see the plant, 0..1.
    pub coverage: f32,
    /// Linear base colour.
    color: Vec3,
    /// Normal in the plane's frame; that of a leaf is flipped towards the viewer.
    normal: Vec3,
    /// Ambient visibility.
    ambient: f32,
    /// Share of leaves.
    foliage: f32,
    /// How the sky's light reaches it, in the plane's frame ([`light::stored`]).
    light: Vec4,
}

/// What a plane shows.
pub(in crate::bake::levels) struct Image {
    /// Row by row from the top.
    pub texels: Vec<Texel>,
    /// Of each texel that shows the plant: which one, and one of its samples, chosen at random.
    seen: Vec<(u32, sun::Sample)>,
}

impl Image {
    fn samples(&self) -> Vec<sun::Sample> {
        self.seen.iter().map(|(_, sample)| *sample).collect()
    }
}

/// Renders the plant onto one plane.
fn render_plane(
    plant: &Plant,
    lighting: &BakedLighting,
    light: Option<&[Vec<VertexLight>]>,
    plane: &CrossPlane,
    settings: &CrossSettings,
) -> Image {
    const ROWS: u32 = 8;
    let view = View { center: plane.center, right: plane.u, up: plane.v, toward: plane.normal };
    let side = settings.resolution * settings.supersampling;
    let raster = Raster::new(plant, &view, side, side, ROWS * settings.supersampling);
    let shader =
        Shader { plant, lighting, light, raster: &raster, to_plane: plane.frame().transpose(), toward: plane.normal };
    shader.image(settings.supersampling as usize)
}

/// Looks up what a sample sees.
pub(in crate::bake::levels) struct Shader<'a> {
    pub plant: &'a Plant,
    pub lighting: &'a BakedLighting,
    pub raster: &'a Raster,
    pub light: Option<&'a [Vec<VertexLight>]>,
    pub to_plane: Mat3,
    pub toward: Vec3,
}

/// The surface that a sample sees.
struct Seen {
    part: usize,
    corners: [usize; 3],
    weights: [f32; 3],
    /// Whether it is seen from behind.
    from_behind: bool,
    /// Unit length, towards the viewer.
    normal: Vec3,
    /// Linear base colour.
    color: Vec3,
    /// Luminance of what is reflected diffusely, as a share of the base colour.
    diffuse: f32,
    /// Luminance of the light that comes through, as a share of the base colour.
    transmission: f32,
}

impl Seen {
    fn weighted(&self) -> impl Iterator<Item = (usize, f32)> {
        self.corners.into_iter().zip(self.weights)
    }
}

impl Shader<'_> {
    /// What the raster shows, row by row from the top: means of `samples`² of its samples. The rows of a band and the
    /// columns of the image must be multiples of `samples`.
    pub fn image(&self, samples: usize) -> Image {
        let side = self.raster.width();
        let row_texels = side / samples;
        let of_band = |band: usize| {
            let hits = self.raster.draw(band);
            let first = self.raster.first_row(band) / samples * row_texels;
            let mut texels = vec![Texel::default(); hits.len() / (samples * samples)];
            let mut chosen: Vec<Option<(u32, &Hit)>> = vec![None; texels.len()];
            for (at, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.is_some()) {
                let (row, column) = (at / side / samples, at % side / samples);
                let texel = row * row_texels + column;
                self.add(hit, &mut texels[texel]);
                let lot = mix32((first * samples * samples + at) as u32);
                if chosen[texel].is_none_or(|(other, _)| lot > other) {
                    chosen[texel] = Some((lot, hit));
                }
            }
            let share = 1.0 / (samples * samples) as f32;
            for texel in &mut texels {
                texel.coverage *= share;
                texel.color *= share;
                texel.normal *= share;
                texel.ambient *= share;
                texel.foliage *= share;
                texel.light *= share;
            }
            let chosen = chosen.into_iter().enumerate();
            let seen = chosen.filter_map(|(texel, chosen)| Some(((first + texel) as u32, self.sample(chosen?.1))));
            Image { texels, seen: seen.collect() }
        };
        let bands: Vec<Image> = (0..self.raster.band_count()).into_par_iter().map(of_band).collect();
        let (texels, seen): (Vec<_>, Vec<_>) = bands.into_iter().map(|band| (band.texels, band.seen)).unzip();
        Image { texels: texels.concat(), seen: seen.concat() }
    }

    fn seen(&self, hit: &Hit) -> Seen {
        let part = &self.plant.parts[hit.part as usize];
        let mesh = &part.mesh;
        let corners = mesh.triangles[hit.triangle as usize].map(|c| c as usize);
        let weights = Vec3::new(1.0 - hit.weights.x - hit.weights.y, hit.weights.x, hit.weights.y).to_array();
        let weighted = || corners.into_iter().zip(weights);

        let normals = self.lighting.normals(hit.part as usize).unwrap_or(&mesh.normals);
        let normal: Vec3 = weighted().map(|(c, w)| w * normals.get(c).copied().unwrap_or(Vec3::Y)).sum();
        let [a, b, c] = corners.map(|c| mesh.positions[c]);
        // A leaf has two sides, the viewer sees the one that faces him; a crown has only its outside. Bark has
        // one, but an open branch may be seen into; only then is its normal flipped, a smooth one may well look over
        // the edge.
        let from_behind = match part.kind {
            PartKind::Foliage => !self.lighting.is_realigned() && normal.dot(self.toward) < 0.0,
            PartKind::Wood => (b - a).cross(c - a).dot(self.toward) < 0.0,
        };
        let normal = if from_behind { -normal } else { normal };
        let normal = normal.try_normalize().unwrap_or(self.toward);
        let uv = weighted().map(|(c, w)| w * mesh.uvs[c]).sum();
        let color = self.raster.surface(hit.part).color(uv);
        // As [Luft 2007, eq. 1] lights leaves, nothing comes through them.
        let opaque = part.kind == PartKind::Wood || self.lighting.ambient_term() == AmbientTerm::Published;
        let through = part.material.transmitted(color);
        let share = |of_color: Vec3| luminance(of_color) / luminance(color).max(1e-6);
        let transmission = if opaque { 0.0 } else { share(through) };
        let matt = part.kind == PartKind::Wood;
        let diffuse =
            if matt { 1.0 } else { (1.0 - share(part.material.gloss.specular_albedo(color, through))).clamp(0.0, 1.0) };
        Seen { part: hit.part as usize, corners, weights, from_behind, normal, color, diffuse, transmission }
    }

    /// The sample for the sun's light.
    fn sample(&self, hit: &Hit) -> sun::Sample {
        let seen = self.seen(hit);
        let positions = &self.plant.parts[seen.part].mesh.positions;
        let position = seen.weighted().map(|(corner, weight)| weight * positions[corner]).sum();
        let light = self.light.and_then(|parts| parts.get(seen.part)).map_or(&[][..], Vec::as_slice);
        let scattered = |corner: usize| light.get(corner).map_or(Vec4::ZERO, |light| light.indirect_sun);
        let indirect = seen.weighted().map(|(corner, weight)| weight * scattered(corner)).sum();
        let Seen { normal, diffuse, transmission, .. } = seen;
        sun::Sample { position, normal, diffuse, transmission, indirect }
    }

    fn add(&self, hit: &Hit, texel: &mut Texel) {
        let seen = self.seen(hit);
        let kind = self.plant.parts[seen.part].kind;
        let values = self.lighting.ambient(seen.part);
        let ambient: f32 = seen.weighted().map(|(c, w)| w * values.get(c).copied().unwrap_or(1.0)).sum();
        if let Some(light) = self.light.and_then(|parts| parts.get(seen.part)) {
            let blended = |side: usize| -> Vec4 {
                seen.weighted().map(|(c, w)| w * light.get(c).map_or(Vec4::ZERO, |light| light.sides[side])).sum()
            };
            let front = usize::from(seen.from_behind && kind == PartKind::Foliage);
            texel.light += light::stored(blended(front), blended(1 - front), seen.transmission, &self.to_plane);
        }
        texel.coverage += 1.0;
        texel.color += if seen.color.is_finite() { seen.color.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO };
        texel.normal += self.to_plane * seen.normal;
        texel.ambient += if ambient.is_finite() { ambient.clamp(0.0, 1.0) } else { 1.0 };
        texel.foliage += if kind == PartKind::Foliage { 1.0 } else { 0.0 };
    }
}
