//! Photographs over the ground: where their pixels lie, and what is drawn of them.

use std::fs;
use std::path::{Path, PathBuf};

use canopy::{
    assets::StageError,
    math::srgb_to_linear,
    reference::Soil,
    scene::Scene,
    terrain::{
        CoordinateSystem, Drape, GeoReference, HeightField, Surroundings, SystemMap, Terrain, TerrainError, Warning,
        read_drape,
    },
};
use glam::{DVec2, DVec3, Vec3};
use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};
use tempfile::TempDir;
use tiff::{
    encoder::{TiffEncoder, colortype},
    tags::Tag,
};

use crate::support::stage::{Heard, PLACE, built};

const UTM: CoordinateSystem = CoordinateSystem::Utm { zone: 33, south: false };
/// Easting and northing of the terrain's centre.
const CENTRE: DVec2 = DVec2::new(500_000.0, 5_400_000.0);
/// Half of the terrain's side, metres.
const HALF: f64 = 32.0;
/// Side of a pixel, metres.
const PIXEL: f64 = 0.5;
/// Pixels along a side of a photograph of the whole terrain.
const SIDE: u32 = 128;

/// Level ground of 64 m in UTM.
fn terrain() -> Terrain {
    on(GeoReference::new(UTM, CENTRE).ok())
}

fn on(reference: Option<GeoReference>) -> Terrain {
    let field = HeightField::new(3, 3, DVec2::splat(HALF), vec![0.0; 9]).unwrap();
    Terrain::new(field, reference, Surroundings::Mirror)
}

/// A colour that tells its column and row.
fn color(x: u32, y: u32) -> [u8; 3] {
    [(2 * x.min(127)) as u8, (2 * y.min(127)) as u8, 40]
}

fn photo() -> RgbImage {
    RgbImage::from_fn(SIDE, SIDE, |x, y| Rgb(color(x, y)))
}

/// A world file of a photograph whose north-western corner is `corner`.
fn world(corner: DVec2) -> String {
    let middle = corner + DVec2::new(0.5, -0.5) * PIXEL;
    format!("{PIXEL}\n0\n0\n-{PIXEL}\n{}\n{}\n", middle.x, middle.y)
}

fn north_west() -> DVec2 {
    CENTRE + DVec2::new(-HALF, HALF)
}

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn image(&self, name: &str, format: ImageFormat) -> PathBuf {
        let path = self.0.path().join(name);
        photo().save_with_format(&path, format).unwrap();
        path
    }
}

fn read(paths: &[PathBuf], terrain: &Terrain) -> Result<(Drape, Vec<Warning>), TerrainError> {
    read_drape(paths, None, terrain)
}

/// Column and row that the colour at a local position tells, and the coverage.
fn told(drape: &Drape, x: f64, z: f64) -> (DVec2, f32) {
    let found = drape.sample(DVec2::new(x, z));
    let code = |linear: f32| f64::from(canopy::math::linear_to_srgb(linear / found.w.max(1e-6))) * 127.5;
    (DVec2::new(code(found.x), code(found.y)), found.w)
}

/// Checks that the photograph lies where it should, to `tolerance` pixels, away from its border.
#[track_caller]
fn assert_placed(drape: &Drape, tolerance: f64) {
    for (x, z) in [(0.0, 0.0), (-20.1, 13.7), (25.0, -25.0), (3.3, 28.0), (-28.0, -9.0)] {
        let (found, coverage) = told(drape, x, z);
        let expected = (DVec2::new(x, z) + HALF) / PIXEL - 0.5;
        assert!(coverage > 0.999, "{coverage} at {x}, {z}");
        assert!((found - expected).abs().max_element() < tolerance, "{found} instead of {expected} at {x}, {z}");
    }
}

#[test]
fn world_files_and_projections_beside_images_place_them() {
    for (name, format, ending, tolerance) in [
        ("a.png", ImageFormat::Png, "pgw", 0.6),
        ("b.jpg", ImageFormat::Jpeg, "jgw", 3.0),
        ("c.webp", ImageFormat::WebP, "wld", 0.6),
        ("d.jpeg", ImageFormat::Jpeg, "jpgw", 3.0),
    ] {
        let folder = Folder::new();
        let path = folder.image(name, format);
        folder.write(&format!("{}.{ending}", &name[..1]), world(north_west()));
        let (drape, warnings) = read(std::slice::from_ref(&path), &terrain()).unwrap();
        assert_placed(&drape, tolerance);
        // Its system is not stated anywhere.
        assert_eq!(warnings, [Warning::PhotoSystemAssumed { path: path.clone() }]);
        assert!(drape.is_mirrored() && drape.size() == (SIDE, SIDE));
        folder.write(&format!("{}.prj", &name[..1]), "PROJCS[\"WGS 84 / UTM zone 33N\",AUTHORITY[\"EPSG\",\"32633\"]]");
        let (same, warnings) = read(&[path], &terrain()).unwrap();
        assert!(warnings.is_empty() && same == drape, "{warnings:?}");
    }
}

#[test]
fn the_auxiliary_file_of_gdal_places_an_image_too() {
    let folder = Folder::new();
    let path = folder.image("a.png", ImageFormat::Png);
    let corner = north_west();
    folder.write(
        "a.png.aux.xml",
        format!(
            "<PAMDataset><SRS>PROJCS[&quot;x&quot;,AUTHORITY[&quot;EPSG&quot;,&quot;32633&quot;]]</SRS><GeoTransform> {}, {PIXEL}, 0, \
             {}, 0, -{PIXEL}</GeoTransform></PAMDataset>",
            corner.x, corner.y
        ),
    );
    let (drape, warnings) = read(&[path], &terrain()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_placed(&drape, 0.6);
}

/// A GeoTIFF of these samples in UTM zone 33.
fn geotiff<C>(side: u32, corner: DVec2, samples: &[C::Inner], more: &[(Tag, &str)]) -> Vec<u8>
where
    C: colortype::ColorType,
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut write = || -> tiff::TiffResult<()> {
        let mut encoder = TiffEncoder::new(&mut bytes)?;
        let mut image = encoder.new_image::<C>(side, side)?;
        image.encoder().write_tag(Tag::ModelPixelScaleTag, &[PIXEL, PIXEL, 0.0][..])?;
        image.encoder().write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, corner.x, corner.y, 0.0][..])?;
        image.encoder().write_tag(Tag::GeoKeyDirectoryTag, &[1u16, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32633][..])?;
        for (tag, text) in more {
            image.encoder().write_tag(*tag, *text)?;
        }
        image.write_data(samples)
    };
    write().unwrap();
    bytes.into_inner()
}

#[test]
fn geotiffs_of_several_kinds_of_samples_are_photographs() {
    let folder = Folder::new();
    let places: Vec<(u32, u32)> = (0..SIDE * SIDE).map(|at| (at % SIDE, at / SIDE)).collect();
    let rgb: Vec<u8> = places.iter().flat_map(|(x, y)| color(*x, *y)).collect();
    let rgba: Vec<u8> = places
        .iter()
        .flat_map(|(x, y)| {
            let [r, g, b] = color(*x, *y);
            [r, g, b, if *x < 4 { 0 } else { 255 }]
        })
        .collect();
    let wide: Vec<u16> = rgb.iter().map(|code| u16::from(*code) * 257).collect();
    let eight = folder.write("8.tif", geotiff::<colortype::RGB8>(SIDE, north_west(), &rgb, &[]));
    let sixteen = folder.write("16.tif", geotiff::<colortype::RGB16>(SIDE, north_west(), &wide, &[]));
    for path in [eight.clone(), sixteen] {
        let (drape, warnings) = read(&[path], &terrain()).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_placed(&drape, 0.6);
    }
    let clear = folder.write("rgba.tif", geotiff::<colortype::RGBA8>(SIDE, north_west(), &rgba, &[]));
    let (drape, _) = read(std::slice::from_ref(&clear), &terrain()).unwrap();
    assert_placed(&drape, 0.6);
    assert_eq!(drape.sample(DVec2::new(-31.0, 0.0)).w, 0.0, "transparent pixels show the ground");
    // Another tile fills what is transparent.
    let (drape, _) = read(&[clear, eight], &terrain()).unwrap();
    let (found, coverage) = told(&drape, -31.0, 0.0);
    assert!(coverage == 1.0 && (found.x - 1.5).abs() < 0.6, "{found} {coverage}");
    // Pixels without data.
    let black: Vec<u8> =
        rgb.chunks(3).enumerate().flat_map(|(at, c)| if at < 512 { [0; 3] } else { [c[0], c[1], c[2]] }).collect();
    let path =
        folder.write("black.tif", geotiff::<colortype::RGB8>(SIDE, north_west(), &black, &[(Tag::GdalNodata, "0")]));
    let (drape, _) = read(&[path], &terrain()).unwrap();
    assert_eq!(drape.sample(DVec2::new(0.0, -31.5)).w, 0.0);
    assert_placed(&drape, 0.6);
    let gray: Vec<u8> = places.iter().map(|(x, _)| 2 * *x as u8).collect();
    let path = folder.write("gray.tif", geotiff::<colortype::Gray8>(SIDE, north_west(), &gray, &[]));
    let (drape, _) = read(&[path], &terrain()).unwrap();
    let grey = drape.sample(DVec2::new(0.25, 0.25)).truncate();
    assert!(grey.abs_diff_eq(Vec3::splat(srgb_to_linear(128.0 / 255.0)), 1e-4), "{grey}");
    let floats = vec![0.5f32; (SIDE * SIDE) as usize];
    let path = folder.write("float.tif", geotiff::<colortype::Gray32Float>(SIDE, north_west(), &floats, &[]));
    let error = read(&[path], &terrain()).unwrap_err().to_string();
    assert!(error.contains("gdal_translate -ot Byte -scale"), "{error}");
}

#[test]
fn tiles_join_and_those_elsewhere_are_named() {
    let folder = Folder::new();
    let mut paths = Vec::new();
    for (name, column, row) in [("nw", 0, 0), ("ne", 64, 0), ("sw", 0, 64), ("se", 64, 64), ("far", 6400, 0)] {
        let part = RgbImage::from_fn(64, 64, |x, y| Rgb(color(column % 128 + x, row + y)));
        let path = folder.0.path().join(format!("{name}.png"));
        part.save(&path).unwrap();
        folder.write(
            &format!("{name}.pgw"),
            world(north_west() + DVec2::new(f64::from(column), -f64::from(row)) * PIXEL),
        );
        paths.push(path);
    }
    let whole = folder.image("whole.png", ImageFormat::Png);
    folder.write("whole.pgw", world(north_west()));
    let stated = |paths: &[PathBuf]| read_drape(paths, Some(UTM), &terrain()).unwrap();
    let (drape, warnings) = stated(&paths);
    assert_eq!(warnings, [Warning::PhotoTileUnused { path: paths[4].clone() }]);
    assert!(drape == stated(&[whole]).0, "four tiles are not the whole");
    // One alone covers a quarter, and ends softly.
    let (quarter, _) = stated(&paths[..1]);
    assert!(!quarter.is_mirrored() && quarter.size() == (64, 64));
    assert_eq!((quarter.sample(DVec2::new(-16.0, -16.0)).w, quarter.sample(DVec2::new(1.0, -16.0)).w), (1.0, 0.0));
    let error = read_drape(&paths[4..], Some(UTM), &terrain()).unwrap_err();
    assert!(matches!(error, TerrainError::PhotoOutside { .. }) && error.to_string().contains("500000"), "{error}");
}

/// A photograph in degrees, in web Mercator or in another zone, on a terrain in UTM, and the other way round.
#[test]
fn photographs_in_other_coordinates_are_brought_to_the_terrain() {
    let lambert = CoordinateSystem::from_epsg(3035).unwrap();
    let systems = [CoordinateSystem::Geographic, CoordinateSystem::WebMercator, lambert, UTM];
    for (own, other) in systems.iter().flat_map(|a| systems.iter().map(move |b| (*a, *b))).filter(|(a, b)| a != b) {
        let utm = SystemMap::new(UTM).unwrap();
        let (latitude, longitude) = utm.to_earth(CENTRE).unwrap();
        let map = |system| SystemMap::new(system).unwrap();
        let centre = map(own).coordinates_of(longitude, latitude).unwrap();
        let terrain = on(GeoReference::new(own, centre).ok());
        let reference = terrain.reference().unwrap();
        // The rectangle around the terrain in the photograph's coordinates.
        let to_photo = |local: DVec2| {
            let file = reference.to_file(local.x, local.y);
            let (latitude, longitude) = map(own).to_earth(file).unwrap();
            map(other).coordinates_of(longitude, latitude).unwrap()
        };
        let corners =
            [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, z)| to_photo(1.1 * HALF * DVec2::new(x, z)));
        let low = corners.iter().copied().reduce(DVec2::min).unwrap();
        let high = corners.iter().copied().reduce(DVec2::max).unwrap();
        let step = (high - low) / f64::from(SIDE);
        let folder = Folder::new();
        let path = folder.image("a.png", ImageFormat::Png);
        let first = DVec2::new(low.x + 0.5 * step.x, high.y - 0.5 * step.y);
        folder.write("a.pgw", format!("{:.12}\n0\n0\n-{:.12}\n{:.9}\n{:.9}\n", step.x, step.y, first.x, first.y));
        let (drape, warnings) = read_drape(&[path], Some(other), &terrain).unwrap();
        assert!(warnings.is_empty() && drape.is_mirrored(), "{own:?} {other:?}: {warnings:?}");
        for local in [DVec2::ZERO, DVec2::new(-20.0, 13.0), DVec2::new(25.0, -28.0)] {
            let point = to_photo(local);
            let expected = DVec2::new(point.x - first.x, first.y - point.y) / step;
            let (found, coverage) = told(&drape, local.x, local.y);
            assert!(coverage > 0.99, "{own:?} {other:?}: {coverage}");
            assert!((found - expected).abs().max_element() < 0.8, "{own:?} {other:?}: {found} instead of {expected}");
        }
    }
}

#[test]
fn without_a_place_a_photograph_covers_the_terrain_and_says_so() {
    let folder = Folder::new();
    let path = folder.image("a.png", ImageFormat::Png);
    let (drape, warnings) = read(std::slice::from_ref(&path), &terrain()).unwrap();
    assert_placed(&drape, 0.6);
    assert_eq!(warnings, [Warning::PhotoStretched { path: path.clone(), has_place: false }]);
    folder.write("a.pgw", world(north_west()));
    folder.write("a.prj", "PROJCS[\"WGS 84 / UTM zone 33N\",AUTHORITY[\"EPSG\",\"32633\"]]");
    let (drape, warnings) = read(std::slice::from_ref(&path), &on(None)).unwrap();
    assert_placed(&drape, 0.6);
    assert_eq!(warnings, [Warning::PhotoStretched { path, has_place: true }]);
}

#[test]
fn what_cannot_be_placed_right_is_refused_with_a_remedy() {
    let folder = Folder::new();
    let path = folder.image("a.png", ImageFormat::Png);
    for (text, expected) in [
        ("0.5\n0.1\n0.1\n-0.5\n0\n0\n", "gdalwarp"),
        ("0.5\n0\n0\n-0.5\n0\n", "six numbers"),
        ("0.5\n0\n0\n0.5\n500000\n5400000\n", "turned over"),
    ] {
        folder.write("a.pgw", text);
        let error = read(std::slice::from_ref(&path), &terrain()).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("a.png"), "{error}");
    }
    let text = folder.write("a.txt", "no photograph");
    let error = read(&[text], &terrain()).unwrap_err().to_string();
    assert!(error.contains("GeoTIFF, PNG, JPEG or WebP"), "{error}");
    assert!(read(&[folder.0.path().join("none.png")], &terrain()).is_err());
    // Unknown places on earth on both sides.
    folder.write("a.pgw", world(north_west()));
    let unknown = CoordinateSystem::Projected { epsg: None, metres_per_unit: 1.0 };
    let error = read_drape(&[path], Some(unknown), &terrain()).unwrap_err().to_string();
    assert!(error.contains("those of the photograph lie") && error.contains("gdalwarp"), "{error}");
}

/// A photograph of more pixels than a texture holds is drawn coarser, with the same mean light.
#[test]
fn large_photographs_are_reduced_and_say_so() {
    let side = 8192 + 4;
    let image = RgbImage::from_fn(side, 8, |x, _| if x % 2 == 0 { Rgb([255; 3]) } else { Rgb([0; 3]) });
    let folder = Folder::new();
    let path = folder.0.path().join("a.png");
    image.save(&path).unwrap();
    let (drape, warnings) = read(&[path], &terrain()).unwrap();
    assert!(warnings.iter().any(|warning| matches!(warning, Warning::PhotoReduced { .. })), "{warnings:?}");
    assert!(drape.size().0 <= 8192);
    for x in [-30.0, 0.0, 17.3] {
        assert!((drape.sample(DVec2::new(x, 0.0)).x - 0.5).abs() < 0.01, "{}", drape.sample(DVec2::new(x, 0.0)));
    }
}

pub(crate) const FLAT: &str = r#"terrain: Flat(size: 200)"#;

/// Red, green / blue, grey over 200 m.
pub(crate) fn four() -> Vec<u8> {
    let colors = [[200, 40, 40], [40, 180, 40], [40, 40, 220], [150, 150, 150]];
    let image = RgbaImage::from_fn(64, 64, |x, y| {
        let [r, g, b] = colors[usize::from(x >= 32) + 2 * usize::from(y >= 32)];
        Rgba([r, g, b, 255])
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn a_scene_states_a_photograph_and_hears_of_mistakes() {
    let parse = |drape: &str| Scene::parse(&format!("({FLAT}, {PLACE}, {drape})"), Path::new("scene.ron"));
    let scene =
        parse("drape: (path: \"a.png\", tiles: [\"b.png\"], coordinates: Utm(zone: 33), brightness: 0.7)").unwrap();
    let drape = scene.drape.unwrap();
    assert_eq!((drape.files().len(), drape.coordinates, drape.brightness), (2, Some(UTM), 0.7));
    for (text, expected) in
        [("drape: (path: \"\")", "drape.path"), ("drape: (path: \"a.png\", brightness: 9)", "drape.brightness")]
    {
        let error = parse(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let missing = parse("drape: (path: \"none.png\")").unwrap();
    let error = canopy::assets::Stage::build(&missing, &mut Heard::default()).err().unwrap();
    assert!(matches!(&error, StageError::Terrain(_)) && error.to_string().contains("none.png"), "{error}");
}

/// The path tracer's ground has the mean of the photograph, and the fine detail of the ground.
#[test]
fn the_ground_truth_has_the_photograph_too() {
    let mut heard = Heard::default();
    let folder = Folder::new();
    folder.write("four.png", four());
    let text = format!("({FLAT}, {PLACE}, drape: (path: \"four.png\"))");
    let stage = built(Scene::parse(&text, &folder.0.path().join("scene.ron")).unwrap(), &mut heard);
    let drape = stage.drape.clone().unwrap();
    let soil = Soil::new(&stage.terrain, None, 0.0).with_drape(drape.drape.clone(), 0.5);
    let places = (0..4096).map(|i| DVec3::new(-90.0 + f64::from(i % 64), 0.0, -90.0 + f64::from(i / 64)));
    let albedos: Vec<Vec3> = places.map(|place| soil.albedo(place, Vec3::Y)).collect();
    let mean = albedos.iter().sum::<Vec3>() / albedos.len() as f32;
    let expected = 0.5 * Vec3::new(200.0, 40.0, 40.0).map(|code| srgb_to_linear(code / 255.0));
    assert!((mean / expected - 1.0).abs().max_element() < 0.08, "{mean} instead of {expected}");
    let spread = albedos.iter().map(|albedo| (albedo.x - mean.x).powi(2)).sum::<f32>() / albedos.len() as f32;
    assert!((0.05..0.6).contains(&(spread.sqrt() / mean.x)), "{}", spread.sqrt() / mean.x);
}
