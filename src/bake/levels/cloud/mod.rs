//! Billboard cloud: a plant as some hundred textured planes, and its trunk and limbs as cylinders with few sides
//! [Franzke 2005, 4.3.1; Décoret et al. 2003, "Billboard Clouds for Extreme Model Simplification"; Behrendt et al. 2005,
//! "Realistic Real-Time Rendering of Landscapes Using Billboard Clouds"].
//!
//! ```text
//! wood --tubes.rs--> limbs as cylinders, in the light of the nearest vertices
//!    \--the rest--.
//! foliage --------+-> pieces (items.rs) --> planes (cluster.rs) --> rectangles of an atlas (atlas.rs) --> textures
//! ```
//!
//! A plane shows its own pieces only, seen along its normal, so the cloud has the depth and the parallax that crossed
//! billboards lack. Its texels are those of [crosses](super::cross): base colour with an alpha that fades, normal,
//! ambient occlusion and share of foliage, and for plants with radiance transfer a lighting texture. They are lit by the
//! same functions.
//!
//! Leaves that are laid into a plane hide each other, and planes that are seen at an angle show less. So leaves are
//! enlarged until the whole cloud covers as much as the plant does, in the mean over five directions
//! ([Cook et al. 2007, 3.2], as [shadow proxies](super::shadow_proxy) do it).
//!
//! Cost: [`CloudSettings::resolution`]² texels of 8 bytes, 9 for plants with transfer, and a third for mips. Limits: a
//! plane seen from behind shows the mirrored image of its front, as crosses do.

mod atlas;
mod cluster;
mod items;

pub use cluster::Clustering;

use glam::{Mat3, Vec2, Vec3};
use image::{RgbaImage, imageops};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::atlas::{Cell, Flattening, Sheet};
use self::items::Item;
use super::cross::{self, ISOTROPIC_LEVELS, Shader, Texel, color, light, properties};
use super::rasterize::{Raster, View, surfaces};
use super::reduced::{ReducedPart, ReducedPlant};
use super::shadow_proxy::calibrate;
use super::texture::BlockEncoding::Whole;
use super::texture::{LevelTexture, square_bytes};
use super::tubes::{self, TubeSettings};
use crate::bake::lighting::BakedLighting;
use crate::math::MipChain;
use crate::plant::texture::{AlphaFade, alpha_tested_mips, dilate_colors};
use crate::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};

/// A billboard cloud of one plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cloud {
    /// The planes.
    pub planes: Vec<CloudPlane>,
    /// Their textures.
    pub textures: CloudTextures,
    /// Trunk and limbs as cylinders, in the place of their parts; foliage has no triangles.
    pub wood: ReducedPlant,
    /// Mean transmission of the foliage, as [`Cross::transmission`](cross::Cross::transmission).
    pub transmission: Vec3,
    /// As [`Cross::isotropic_fraction`](cross::Cross::isotropic_fraction), by mip of the atlas.
    pub isotropic_fraction: [f32; ISOTROPIC_LEVELS],
    /// Distance between a point of the plant and its image in its plane, metres: root mean square over the surface.
    pub deviation: f32,
    /// Linear factor by which leaves are enlarged.
    pub leaf_scale: f32,
}

/// A rectangle `center + s u + t v` with s and t in -1..=1, and its part of the atlas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudPlane {
    /// Middle, metres, in the plant's frame.
    pub center: Vec3,
    /// From the centre to the right border, metres. Zero where it has no extent.
    pub u: Vec3,
    /// From the centre to the upper border, metres. Zero where it has no extent.
    pub v: Vec3,
    /// Unit normal, towards the side from which the texture was rendered; right-handed with u and v.
    pub normal: Vec3,
    /// Texture coordinates of the upper left corner, `center - u + v`.
    pub texture_min: Vec2,
    /// Texture coordinates of the lower right corner.
    pub texture_max: Vec2,
}

/// The atlases of a cloud, square. Contents and encoding are those of
/// [`CrossTextures`](cross::CrossTextures); directions are in the frame of the plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudTextures {
    /// Base colour and alpha.
    pub color: LevelTexture,
    /// Normal, ambient occlusion, share of foliage.
    pub properties: LevelTexture,
    /// Transfer of the sky's light, for plants that are lit by it, with half as many texels along a side: it changes little within
    /// a leaf.
    pub light: Option<LevelTexture>,
}

impl CloudTextures {
    fn all(&self) -> impl Iterator<Item = &LevelTexture> {
        let Self { color, properties, light } = self;
        [color, properties].into_iter().chain(light)
    }
}

/// Mips of an atlas. In coarser ones neighbours would mix.
pub const LEVELS: usize = 5;

/// Settings of billboard clouds. Values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudSettings {
    /// Planes, 1..=[`MOST_PLANES`]; a plant of fewer pieces has fewer. More: nearer to the plant, slower.
    pub planes: u32,
    /// Allowed [`Cloud::deviation`] as a fraction of the plant's height, 0..=1. Planes are added until it is kept, at
    /// most [`MOST_PLANES`]. 0: no limit.
    pub deviation: f32,
    /// How pieces are clustered into planes.
    pub clustering: Clustering,
    /// Edge of the atlas in texels, 128..=4096, rounded up to a power of two. Memory grows with the square (1024: 11 MB
    /// per plant, 13 MB with transfer; a quarter of it in blocks).
    pub resolution: u32,
    /// Samples per texel along each axis, 1..=8.
    pub supersampling: u32,
    /// How far leaves turn into their plane, 0..=1. 0 projects them along the plane's normal, and loses as much of a
    /// leaf's area as it is tilted; 1 lays them flat.
    pub turn: f32,
    /// Triangles of trunk and limbs as a fraction of the planes' number, 0..=100. 0: all wood is in the planes.
    pub wood: f32,
    /// Sides of the trunk, 3..=32. Thinner limbs have fewer.
    pub sides: u32,
    /// Which texels appear first while a cloud fades in.
    pub fade: AlphaFade,
}

/// The most planes of a cloud.
pub const MOST_PLANES: u32 = 1000;

impl Default for CloudSettings {
    fn default() -> Self {
        Self {
            planes: 100,
            deviation: 0.0,
            clustering: Clustering::default(),
            resolution: 1024,
            supersampling: 4,
            turn: 0.5,
            wood: 1.0,
            sides: 6,
            fade: AlphaFade::default(),
        }
    }
}

impl CloudSettings {
    /// The settings with every value clamped to its range; a value that is not finite becomes the default.
    pub fn sanitized(self) -> Self {
        let default = Self::default();
        let sane =
            |value: f32, default: f32, most: f32| if value.is_finite() { value.clamp(0.0, most) } else { default };
        Self {
            planes: self.planes.clamp(1, MOST_PLANES),
            deviation: sane(self.deviation, default.deviation, 1.0),
            clustering: self.clustering,
            resolution: self.resolution.clamp(128, 4096).next_power_of_two(),
            supersampling: self.supersampling.clamp(1, 8),
            turn: sane(self.turn, default.turn, 1.0),
            wood: sane(self.wood, default.wood, 100.0),
            sides: self.sides.clamp(3, 32),
            fade: self.fade,
        }
    }
}

impl Cloud {
    /// Whether the lists go together, fit `plant`, which is lit by radiance transfer or not, and all values are in their
    /// ranges.
    pub fn fits(&self, plant: &Plant, of_transfer: bool) -> bool {
        let CloudTextures { color, properties, light } = &self.textures;
        let finite = |plane: &CloudPlane| {
            [plane.center, plane.u, plane.v, plane.normal].iter().all(|vector| vector.is_finite())
                && plane.texture_min.is_finite()
                && plane.texture_max.is_finite()
        };
        let size = |texture: &LevelTexture| {
            let MipChain { width, height, ref levels } = texture.texels;
            (width, height, levels.len())
        };
        let (width, height, levels) = size(color);
        self.planes.iter().all(finite)
            && light.is_some() == of_transfer
            && size(properties) == (width, height, levels)
            && light.as_ref().is_none_or(|light| size(light) == (width / 2, height / 2, levels.saturating_sub(1)))
            && self.textures.all().all(LevelTexture::is_whole)
            && self.wood.fits(plant)
            && self.transmission.is_finite()
            && self.isotropic_fraction.iter().all(|share| (0.0..=1.0).contains(share))
            && self.deviation.is_finite()
            && self.leaf_scale.is_finite()
    }

    /// Triangles of planes and wood.
    pub fn triangles(&self) -> usize {
        2 * self.planes.len() + self.wood.triangles()
    }

    /// Bytes of the textures, in blocks or as texels.
    pub fn texture_bytes(&self, in_blocks: bool) -> usize {
        self.textures.all().map(|texture| texture.bytes(in_blocks)).sum()
    }

    /// The cloud of `plant` as a plant: its wood, and a part of foliage with the planes. For tracers and measurements.
    pub fn plant(&self, plant: &Plant) -> Plant {
        let mut drawn = self.wood.plant(plant);
        let color = &self.textures.color.texels;
        let atlas = color
            .levels
            .first()
            .and_then(|texels| RgbaImage::from_raw(color.width, color.height, texels.clone()).map(std::sync::Arc::new));
        drawn.parts.push(PlantPart {
            kind: PartKind::Foliage,
            mesh: quads(&self.planes),
            material: PlantMaterial {
                base_color_texture: atlas,
                transmission: self.transmission,
                ..PlantMaterial::default()
            },
        });
        drawn
    }
}

impl CloudSettings {
    /// Bytes of the textures that [`bake_cloud`] makes, in blocks or as texels, of a plant that is lit by radiance transfer or not.
    pub fn texture_bytes(self, of_transfer: bool, in_blocks: bool) -> usize {
        let (edge, levels) = (self.sanitized().resolution, LEVELS as u32);
        let bytes = |edge, levels| square_bytes(edge, levels, in_blocks.then_some(Whole));
        2 * bytes(edge, levels) + if of_transfer { bytes(edge / 2, levels - 1) } else { 0 }
    }
}

fn quads(planes: &[CloudPlane]) -> PlantMesh {
    let mut mesh = PlantMesh::default();
    for plane in planes {
        let first = mesh.positions.len() as u32;
        let (low, high) = (plane.texture_min, plane.texture_max);
        for (s, t, uv) in [
            (-1.0, -1.0, Vec2::new(low.x, high.y)),
            (1.0, -1.0, high),
            (1.0, 1.0, Vec2::new(high.x, low.y)),
            (-1.0, 1.0, low),
        ] {
            mesh.positions.push(plane.center + s * plane.u + t * plane.v);
            mesh.normals.push(plane.normal);
            mesh.uvs.push(uv);
        }
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
}

/// Makes the billboard cloud of `plant` with the normals, ambient occlusion and transfer of its `lighting`. The same
/// input gives the same bytes on any number of threads. A plant without triangles has no planes.
pub fn bake_cloud(plant: &Plant, lighting: &BakedLighting, settings: &CloudSettings) -> Cloud {
    let settings = settings.sanitized();
    let (wood, rest) = limbs(plant, &settings);
    let items = items::items(plant, &rest);
    let (clusters, deviation) = clusters(&items, plant.height(), &settings);
    let crown = plant.bounds().map_or(Vec3::ZERO, |bounds| bounds.center());
    let sheets = |scale: f32| -> Vec<Sheet> {
        let flat = Flattening { scale, turn: settings.turn };
        clusters.par_iter().map(|cluster| atlas::sheet(plant, &items, cluster, crown, flat)).collect()
    };
    // Coarse clouds are good enough to find the scale.
    let probe = CloudSettings { resolution: settings.resolution.min(512), supersampling: 2, ..settings };
    let build = |scale: f32| {
        let sheets = sheets(scale);
        let (texels, cells) = draw(plant, &BakedLighting::Local, &sheets, &probe);
        let color = color_atlas(&texels, &cells, &probe);
        let planes =
            cells.iter().zip(&sheets).map(|(cell, sheet)| atlas::plane(sheet, cell, probe.resolution)).collect();
        let color = LevelTexture::plain(color);
        let textures = CloudTextures { properties: color.clone(), color, light: None };
        let cloud = Cloud {
            planes,
            textures,
            wood: wood.clone(),
            transmission: Vec3::ZERO,
            isotropic_fraction: [0.0; ISOTROPIC_LEVELS],
            deviation,
            leaf_scale: scale,
        };
        (scale, cloud.plant(plant))
    };
    let leaf_scale = if items.is_empty() { 1.0 } else { calibrate(plant, build, |(_, drawn)| drawn).0 };
    let sheets = sheets(leaf_scale);
    let (texels, cells) = draw(plant, lighting, &sheets, &settings);
    let edge = settings.resolution;
    let whole = whole_atlas(&texels, &cells, edge);
    let (properties, isotropy) = properties::mips(&whole, edge as usize, 0.0);
    let of_transfer = matches!(lighting, BakedLighting::Transfer(_));
    let light = of_transfer.then(|| light::mips(&whole, edge as usize));
    let textures = CloudTextures {
        color: LevelTexture::compressed(color_atlas(&texels, &cells, &settings), Whole),
        properties: LevelTexture::compressed(first_levels(properties), Whole),
        light: light.map(|light| LevelTexture::compressed(without_finest(first_levels(light)), Whole)),
    };
    Cloud {
        planes: cells.iter().zip(&sheets).map(|(cell, sheet)| atlas::plane(sheet, cell, edge)).collect(),
        textures,
        wood,
        transmission: cross::mean_transmission(plant),
        isotropic_fraction: cross::mean_isotropic_fraction(&[isotropy]),
        deviation,
        leaf_scale,
    }
}

/// Trunk and limbs as cylinders, and the triangles of wood that are left for the planes, part by part.
fn limbs(plant: &Plant, settings: &CloudSettings) -> (ReducedPlant, Vec<Vec<u32>>) {
    let wood: usize = plant.triangle_count(PartKind::Wood);
    let wanted = f64::from(settings.wood) * f64::from(settings.planes);
    let tubes = TubeSettings { sides: settings.sides as usize, tolerance: 0.5 };
    let part = |part: &PlantPart| {
        if part.kind != PartKind::Wood || settings.wood <= 0.0 {
            return (ReducedPart::default(), (0..part.mesh.triangles.len() as u32).collect());
        }
        let share = part.mesh.triangles.len() as f64 / wood.max(1) as f64;
        let branches = tubes::branches(&part.mesh);
        let (reduced, count) = tubes::reduce(&part.mesh, &branches, &tubes, (share * wanted) as usize);
        let mut rest: Vec<u32> = branches[count..].iter().flat_map(|branch| branch.triangles.iter().copied()).collect();
        rest.sort_unstable();
        (reduced, rest)
    };
    let (parts, rest) = plant.parts.par_iter().map(part).unzip();
    (ReducedPlant { parts }, rest)
}

/// The clusters, and their deviation in metres.
fn clusters(items: &[Item], height: f32, settings: &CloudSettings) -> (Vec<cluster::Cluster>, f32) {
    let mut count = settings.planes;
    loop {
        let clusters = cluster::cluster(items, count as usize, settings.clustering);
        let deviation = deviation(items, &clusters);
        let kept = settings.deviation <= 0.0 || deviation <= settings.deviation * height;
        if kept || count >= MOST_PLANES || clusters.len() >= items.len() {
            return (clusters, deviation);
        }
        count = (count + count.div_ceil(4)).min(MOST_PLANES);
    }
}

/// Root mean square distance between the points of the pieces and their projections, metres.
fn deviation(items: &[Item], clusters: &[cluster::Cluster]) -> f32 {
    let (mut sum, mut area) = (0.0f64, 0.0f64);
    for cluster in clusters {
        for item in cluster.items.iter().map(|&index| &items[index as usize]) {
            let away = (item.center - cluster.center).dot(cluster.normal);
            let tilt = cluster.normal.dot(item.spread * cluster.normal);
            sum += f64::from(item.area) * f64::from(away * away + tilt.max(0.0));
            area += f64::from(item.area);
        }
    }
    let deviation = (sum / area).sqrt() as f32;
    if deviation.is_finite() { deviation } else { 0.0 }
}

/// The texels of each sheet, and where they go.
fn draw(
    plant: &Plant,
    lighting: &BakedLighting,
    sheets: &[Sheet],
    settings: &CloudSettings,
) -> (Vec<Vec<Texel>>, Vec<Cell>) {
    const ROWS: u32 = 8;
    let cells = atlas::pack(sheets, settings.resolution);
    let light = light::vertex_light(lighting);
    let surfaces = surfaces(plant);
    let samples = settings.supersampling;
    let draw = |(sheet, cell): (&Sheet, &Cell)| {
        let view = View { center: sheet.center, right: sheet.u, up: sheet.v, toward: sheet.normal };
        let size = (samples * cell.size).to_array();
        let triangles = sheet.triangles.iter().copied();
        let raster = Raster::of_triangles(plant, surfaces.clone(), triangles, &view, size, ROWS * samples);
        let right = sheet.u.normalize_or(sheet.normal.any_orthonormal_vector());
        let to_plane = Mat3::from_cols(right, sheet.normal.cross(right), sheet.normal).transpose();
        let shader =
            Shader { plant, lighting, light: light.as_deref(), raster: &raster, to_plane, toward: sheet.normal };
        shader.image(samples as usize).texels
    };
    let texels = sheets.par_iter().zip(&cells).map(draw).collect();
    (texels, cells)
}

/// All texels of the atlas, row by row.
fn whole_atlas(texels: &[Vec<Texel>], cells: &[Cell], edge: u32) -> Vec<Texel> {
    let mut whole = vec![Texel::default(); (edge * edge) as usize];
    for (texels, cell) in texels.iter().zip(cells) {
        for (row, line) in texels.chunks_exact(cell.size.x as usize).enumerate() {
            let first = ((cell.corner.y as usize + row) * edge as usize) + cell.corner.x as usize;
            whole[first..first + line.len()].copy_from_slice(line);
        }
    }
    whole
}

/// The colours of all planes. Alpha is restructured plane by plane, so that each covers what its pieces do, and so that
/// an order from the centre outwards is that of the plane.
fn color_atlas(texels: &[Vec<Texel>], cells: &[Cell], settings: &CloudSettings) -> MipChain {
    let images: Vec<RgbaImage> = texels
        .par_iter()
        .zip(cells)
        .map(|(texels, cell)| color::outlined(texels, cell.size.x as usize, settings.fade))
        .collect();
    let mut atlas = RgbaImage::new(settings.resolution, settings.resolution);
    for (image, cell) in images.iter().zip(cells) {
        imageops::replace(&mut atlas, image, cell.corner.x.into(), cell.corner.y.into());
    }
    if texels.iter().flatten().any(|texel| texel.coverage > 0.0) {
        dilate_colors(&mut atlas);
    }
    first_levels(alpha_tested_mips(&atlas))
}

fn first_levels(mut chain: MipChain) -> MipChain {
    chain.levels.truncate(LEVELS);
    chain
}

/// The texture of half the size.
fn without_finest(chain: MipChain) -> MipChain {
    let (width, height) = chain.level_size(1);
    MipChain { width, height, levels: chain.levels.into_iter().skip(1).collect() }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::bake::levels::rasterize::projected_area;
    use crate::bake::lighting::{LightingSettings, transfer::TransferSettings};
    use crate::plant::grow::{GrowParameters, grow};

    fn small() -> CloudSettings {
        CloudSettings { planes: 40, resolution: 256, supersampling: 2, ..CloudSettings::default() }
    }

    #[test]
    fn a_cloud_covers_what_the_tree_covers_with_few_triangles_and_little_memory()
    -> Result<(), Box<dyn std::error::Error>> {
        for parameters in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
            let plant = grow(&parameters, 1, 6000)?;
            let cloud = bake_cloud(&plant, &BakedLighting::Local, &small());
            assert!(cloud.fits(&plant, false) && !cloud.fits(&plant, true));
            assert!((20..=40).contains(&cloud.planes.len()) && cloud.triangles() <= 130, "{}", cloud.triangles());
            for in_blocks in [false, true] {
                assert_eq!(cloud.texture_bytes(in_blocks), small().texture_bytes(false, in_blocks));
            }
            assert!((0.8..3.0).contains(&cloud.leaf_scale), "{}", cloud.leaf_scale);
            let bounds = plant.bounds().ok_or("no bounds")?;
            assert!(cloud.deviation > 0.0 && cloud.deviation < 0.1 * bounds.size().length());
            // From directions that the calibration does not know.
            let (mut ours, mut full) = (0.0, 0.0);
            for toward in [Vec3::new(0.5, 0.1, -0.8), Vec3::new(-0.9, 0.2, 0.3), Vec3::new(0.1, 0.9, 0.4)] {
                let view = View::framing(bounds, toward.normalize());
                let wide = View { right: 1.3 * view.right, up: 1.3 * view.up, ..view };
                ours += projected_area(&cloud.plant(&plant), &wide, 400);
                full += projected_area(&plant, &wide, 400);
            }
            assert!((ours / full - 1.0).abs() < 0.08, "{}: {}", plant.name, ours / full);
        }
        Ok(())
    }

    #[test]
    fn the_same_on_any_number_of_threads_and_with_a_lighting_texture_for_transfer()
    -> Result<(), Box<dyn std::error::Error>> {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 2, 5000)?);
        let transfer = TransferSettings { rays: 64, ..TransferSettings::default() };
        let lighting = BakedLighting::bake(&plant, &LightingSettings::Transfer(transfer));
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| bake_cloud(&plant, &lighting, &small()))
        };
        let cloud = on(1);
        assert!(cloud == on(3));
        assert!(cloud.fits(&plant, true) && cloud.textures.light.is_some());
        Ok(())
    }

    #[test]
    fn an_allowed_deviation_asks_for_more_planes() -> Result<(), Box<dyn std::error::Error>> {
        let plant = grow(&GrowParameters::broadleaf(), 1, 5000)?;
        let few = CloudSettings { planes: 5, wood: 0.0, resolution: 128, supersampling: 1, ..CloudSettings::default() };
        let coarse = bake_cloud(&plant, &BakedLighting::Local, &few);
        let allowed = 0.5 * coarse.deviation / plant.height();
        let fine = bake_cloud(&plant, &BakedLighting::Local, &CloudSettings { deviation: allowed, ..few });
        assert!(coarse.planes.len() <= 5 && fine.planes.len() > 5);
        assert!(fine.deviation <= allowed * plant.height());
        // Better than as published, at as many planes.
        let published = CloudSettings { clustering: Clustering::KMeans, planes: 40, ..few };
        let published = bake_cloud(&plant, &BakedLighting::Local, &published);
        let ours = bake_cloud(&plant, &BakedLighting::Local, &CloudSettings { planes: 40, ..few });
        assert!(ours.deviation < 0.8 * published.deviation, "{} {}", ours.deviation, published.deviation);
        assert_eq!(ours.wood.triangles(), 0);
        Ok(())
    }

    #[test]
    fn plants_of_nothing_one_triangle_no_leaves_and_no_wood_are_survived() -> Result<(), Box<dyn std::error::Error>> {
        let whole = grow(&GrowParameters::broadleaf(), 1, 5000)?;
        let only = |kind| {
            let parts = whole.parts.iter().filter(|part| part.kind == kind).cloned().collect();
            Plant { name: String::new(), parts }
        };
        let mut single = only(PartKind::Foliage);
        single.parts[0].mesh.triangles.truncate(1);
        let mut broken = only(PartKind::Foliage);
        broken.parts[0].mesh.positions.iter_mut().for_each(|position| *position = Vec3::ZERO);
        let tiny = CloudSettings { planes: 9, resolution: 128, supersampling: 1, ..CloudSettings::default() };
        for plant in [Plant::default(), single, only(PartKind::Wood), only(PartKind::Foliage), broken] {
            let cloud = bake_cloud(&plant, &BakedLighting::Local, &tiny);
            assert!(cloud.fits(&plant, false));
            let nonsense = CloudSettings { planes: 0, deviation: f32::NAN, turn: 9.0, wood: f32::INFINITY, ..tiny };
            assert!(bake_cloud(&plant, &BakedLighting::Local, &nonsense).fits(&plant, false));
        }
        Ok(())
    }
}
