//! Terrain files as they are found: what their numbers mean, what of them is valid, where they lie.

use std::fs;
use std::path::Path;

use canopy::terrain::{
    CoordinateSystem, GeoReference, ReadOptions, Terrain, TerrainError, Warning, read_terrain, read_terrain_bytes,
    read_terrain_tiles,
};
use glam::DVec2;

// ---------------------------------------------------------------- files made by hand

/// Values of a tag.
#[derive(Clone)]
enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Double(Vec<f64>),
    Text(String),
}

use Value::{Double, Long, Short, Text};

/// An image of a TIFF: its tags and its strips or tiles.
#[derive(Clone)]
struct Image {
    tags: Vec<(u16, Value)>,
    chunks: Vec<Vec<u8>>,
    tiled: bool,
}

impl Image {
    fn set(mut self, tag: u16, value: Value) -> Self {
        self.tags.retain(|(other, _)| *other != tag);
        self.tags.push((tag, value));
        self
    }

    fn without(mut self, tag: u16) -> Self {
        self.tags.retain(|(other, _)| *other != tag);
        self
    }
}

/// A little-endian TIFF of these images.
fn tiff(images: &[Image]) -> Vec<u8> {
    let mut bytes = b"II*\0\0\0\0\0".to_vec();
    let mut link = 4;
    for image in images {
        let mut offsets = Vec::new();
        for chunk in &image.chunks {
            offsets.push(if chunk.is_empty() { 0 } else { bytes.len() as u32 });
            bytes.extend(chunk);
            bytes.resize(bytes.len().next_multiple_of(2), 0);
        }
        let sizes = image.chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let (offset_tag, size_tag) = if image.tiled { (324, 325) } else { (273, 279) };
        let mut tags = image.tags.clone();
        tags.push((offset_tag, Long(offsets)));
        tags.push((size_tag, Long(sizes)));
        tags.sort_by_key(|(tag, _)| *tag);
        let mut entries = Vec::new();
        for (tag, value) in &tags {
            let (kind, count, data): (u16, usize, Vec<u8>) = match value {
                Short(list) => (3, list.len(), list.iter().flat_map(|v| v.to_le_bytes()).collect()),
                Long(list) => (4, list.len(), list.iter().flat_map(|v| v.to_le_bytes()).collect()),
                Double(list) => (12, list.len(), list.iter().flat_map(|v| v.to_le_bytes()).collect()),
                Text(text) => (2, text.len() + 1, [text.as_bytes(), b"\0"].concat()),
            };
            let field = if data.len() <= 4 {
                let mut inline = data.clone();
                inline.resize(4, 0);
                inline
            } else {
                let at = bytes.len() as u32;
                bytes.extend(&data);
                bytes.resize(bytes.len().next_multiple_of(2), 0);
                at.to_le_bytes().to_vec()
            };
            entries.extend(tag.to_le_bytes());
            entries.extend(kind.to_le_bytes());
            entries.extend((count as u32).to_le_bytes());
            entries.extend(field);
        }
        let directory = bytes.len() as u32;
        bytes[link..link + 4].copy_from_slice(&directory.to_le_bytes());
        bytes.extend((tags.len() as u16).to_le_bytes());
        bytes.extend(entries);
        link = bytes.len();
        bytes.extend([0; 4]);
    }
    bytes
}

const COLUMNS: usize = 16;
const ROWS: usize = 12;

fn floats(value: impl Fn(usize) -> f32) -> Vec<u8> {
    (0..COLUMNS * ROWS).flat_map(|at| value(at).to_le_bytes()).collect()
}

fn shorts(value: impl Fn(usize) -> i16) -> Vec<u8> {
    (0..COLUMNS * ROWS).flat_map(|at| value(at).to_le_bytes()).collect()
}

/// Heights from 280 to 380.
fn ground(at: usize) -> f32 {
    280.0 + 100.0 * at as f32 / (COLUMNS * ROWS - 1) as f32
}

/// One strip of samples of `bits` in the sample format `format`, in UTM zone 33 with cells of 10 m.
fn raster(bits: u16, format: u16, data: Vec<u8>) -> Image {
    Image { tags: Vec::new(), chunks: vec![data], tiled: false }
        .set(256, Short(vec![COLUMNS as u16]))
        .set(257, Short(vec![ROWS as u16]))
        .set(258, Short(vec![bits]))
        .set(259, Short(vec![1]))
        .set(262, Short(vec![1]))
        .set(277, Short(vec![1]))
        .set(278, Short(vec![ROWS as u16]))
        .set(339, Short(vec![format]))
        .set(33550, Double(vec![10.0, 10.0, 0.0]))
        .set(33922, Double(vec![0.0, 0.0, 0.0, 500_000.0, 5_400_000.0, 0.0]))
        .set(34735, keys(&[[1024, 0, 1, 1], [1025, 0, 1, 1], [3072, 0, 1, 32633], [3076, 0, 1, 9001]]))
}

fn keys(entries: &[[u16; 4]]) -> Value {
    Short([1, 1, 0, entries.len() as u16].into_iter().chain(entries.iter().flatten().copied()).collect())
}

fn float_raster() -> Image {
    raster(32, 3, floats(ground))
}

fn read(bytes: &[u8]) -> Result<(Terrain, Vec<Warning>), TerrainError> {
    read_terrain_bytes(bytes, Path::new("dem.tif"), &ReadOptions::default())
}

#[track_caller]
fn heights(image: Image, low: f32, high: f32) -> Vec<Warning> {
    let (terrain, warnings) = read(&tiff(&[image])).expect("a terrain");
    let found = terrain.field().min_max();
    assert!((found.0 - low).abs() < 0.2 && (found.1 - high).abs() < 0.2, "{found:?}, {warnings:?}");
    warnings
}

// ---------------------------------------------------------------- what the numbers mean

fn metadata(items: &[(&str, &str)]) -> Value {
    let items: String = items
        .iter()
        .map(|(role, value)| format!("<Item name=\"X\" sample=\"0\" role=\"{role}\">{value}</Item>"))
        .collect();
    Text(format!("<GDALMetadata>{items}</GDALMetadata>\n"))
}

#[test]
fn scale_offset_and_unit_of_the_band_are_applied() {
    let decimetres = raster(16, 2, shorts(|at| (10.0 * ground(at)) as i16));
    let warnings = heights(decimetres.clone().set(42112, metadata(&[("scale", "0.1"), ("offset", "0")])), 280.0, 380.0);
    assert!(matches!(&warnings[..], [Warning::HeightsConverted { factor, .. }] if (*factor - 0.1).abs() < 1e-12));
    heights(decimetres.set(42112, metadata(&[("scale", "0.1"), ("offset", "100")])), 380.0, 480.0);
    for (unit, metres) in [("ft", 0.3048), ("US survey foot", 1200.0 / 3937.0), ("cm", 0.01), ("foot", 0.3048)] {
        let image = raster(32, 3, floats(|at| ground(at) / metres as f32)).set(42112, metadata(&[("unittype", unit)]));
        let warnings = heights(image, 280.0, 380.0);
        assert!(warnings[0].to_string().contains(unit), "{warnings:?}");
    }
    assert_eq!(heights(float_raster().set(42112, metadata(&[("unittype", "m")])), 280.0, 380.0), []);
    let warnings = heights(float_raster().set(42112, metadata(&[("unittype", "parsec")])), 280.0, 380.0);
    assert_eq!(warnings, [Warning::UnknownHeightUnit { unit: "parsec".to_owned() }]);
    // A no-data value is one of the stored numbers.
    let marked = raster(16, 2, shorts(|at| if at < 5 { -32_768 } else { (10.0 * ground(at)) as i16 }))
        .set(42112, metadata(&[("scale", "0.1")]))
        .set(42113, Text("-32768".to_owned()));
    let warnings = heights(marked, 282.6, 380.0);
    assert!(warnings.contains(&Warning::HolesFilled { filled: 5, total: COLUMNS * ROWS }), "{warnings:?}");
}

#[test]
fn vertical_units_come_from_keys_and_codes() {
    let feet = |entry: [u16; 4]| {
        let data = floats(|at| ground(at) / 0.3048);
        raster(32, 3, data).set(34735, keys(&[[1024, 0, 1, 1], [3072, 0, 1, 32633], entry]))
    };
    // The unit, or the vertical system: NAVD88 in US survey feet, in feet.
    for entry in [[4099, 0, 1, 9002], [4099, 0, 1, 9003], [4096, 0, 1, 6360], [4096, 0, 1, 8228]] {
        heights(feet(entry), 280.0, 380.0);
    }
    let warnings = heights(feet([4099, 0, 1, 9999]), 918.6, 1246.7);
    assert!(matches!(&warnings[..], [Warning::UnknownHeightUnit { .. }]), "{warnings:?}");
    // A compound code: a state plane with heights, both in feet.
    let compound =
        raster(32, 3, floats(|at| ground(at) / 0.3048)).set(34735, keys(&[[1024, 0, 1, 1], [3072, 0, 1, 8703]]));
    let (terrain, _) = read(&tiff(&[compound])).expect("a terrain");
    assert!((terrain.field().min_max().0 - 280.0).abs() < 0.2, "{:?}", terrain.field().min_max());
    assert!((terrain.field().spacing().x - 3.048).abs() < 0.01, "{}", terrain.field().spacing());
}

#[test]
fn horizontal_units_follow_from_the_code() {
    // New York, Long Island: US survey feet without a key of the unit.
    let state = |code: u16| {
        float_raster()
            .set(34735, keys(&[[1024, 0, 1, 1], [3072, 0, 1, code]]))
            .set(33922, Double(vec![0.0, 0.0, 0.0, 986_000.0, 200_000.0, 0.0]))
    };
    let (terrain, warnings) = read(&tiff(&[state(2263)])).expect("a terrain");
    assert_eq!(warnings, []);
    assert!((terrain.field().spacing().x - 3.048_006).abs() < 1e-5);
    let (latitude, longitude) = terrain.reference().and_then(GeoReference::latitude_longitude).expect("a place");
    assert!((latitude - 40.716).abs() < 0.01 && (longitude + 73.99).abs() < 0.02, "{latitude}, {longitude}");
    // The same where the scene states the code.
    let options = ReadOptions { coordinate_system: CoordinateSystem::from_epsg(2263), ..ReadOptions::default() };
    let plain = tiff(&[state(2263).without(34735)]);
    let (stated, _) = read_terrain_bytes(&plain, Path::new("dem.tif"), &options).expect("a terrain");
    assert_eq!(stated.field().spacing(), terrain.field().spacing());
    // A code from 4001 to 4999 that is no system of degrees: ETRS89 / UTM 32N with the zone before the easting.
    let zoned = state(4647).set(33922, Double(vec![0.0, 0.0, 0.0, 32_500_000.0, 5_400_000.0, 0.0]));
    let (terrain, _) = read(&tiff(&[zoned])).expect("a terrain");
    assert_eq!(terrain.field().spacing(), DVec2::splat(10.0));
    let (latitude, longitude) = terrain.reference().and_then(GeoReference::latitude_longitude).expect("a place");
    assert!((latitude - 48.75).abs() < 0.02 && (longitude - 9.0).abs() < 0.02, "{latitude}, {longitude}");
}

#[test]
fn zero_may_be_white_without_turning_heights_over() {
    for (bits, format, data) in
        [(32, 3, floats(ground)), (16, 2, shorts(|at| ground(at) as i16)), (16, 1, shorts(|at| ground(at) as i16))]
    {
        let image = raster(bits, format, data).set(262, Short(vec![0]));
        let (terrain, _) = read(&tiff(&[image])).expect("a terrain");
        assert_eq!(terrain.field().heights()[0].round(), 280.0, "{bits} bits");
        assert_eq!(terrain.field().heights().last().map(|height| height.round()), Some(380.0), "{bits} bits");
    }
}

// ---------------------------------------------------------------- what is valid

#[test]
fn marks_beside_sound_heights_become_holes_with_a_warning() {
    for mark in [-9999.0, -32_767.0, -32_768.0, 0.0, -3.4e38, f32::MIN, 9999.0] {
        let image = raster(32, 3, floats(|at| if at % 7 == 0 { mark } else { ground(at) }));
        let warnings = heights(image, 280.5, 380.0);
        assert!(
            warnings.len() == 2 && matches!(warnings[1], Warning::HolesFilled { filled: 28, .. }),
            "{mark}: {warnings:?}"
        );
        assert!(warnings[0].to_string().contains("no-data value"), "{mark}: {warnings:?}");
    }
    // A coast is no hole.
    assert_eq!(heights(raster(32, 3, floats(|at| (ground(at) - 330.0).max(0.0))), 0.0, 50.0), []);
    // In feet, too.
    let feet = raster(32, 3, floats(|at| if at % 7 == 0 { -9999.0 } else { ground(at) / 0.3048 }))
        .set(42112, metadata(&[("unittype", "ft")]));
    heights(feet, 280.5, 380.0);
}

#[test]
fn grids_of_text_have_a_default_mark() {
    let grid = |header: &str, value: &str| {
        let rows = format!("280 290 {value}\n300 {value} 320\n330 340 350\n");
        format!("ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 10\n{header}{rows}")
    };
    for (header, value, filled) in
        [("", "-9999", 2), ("", "-9999.0", 2), ("NODATA_value -1\n", "-1", 2), ("NODATA_value -1\n", "-9999", 2)]
    {
        let bytes = grid(header, value);
        let (terrain, warnings) =
            read_terrain_bytes(bytes.as_bytes(), Path::new("dem.asc"), &ReadOptions::default()).expect("a terrain");
        assert!(terrain.field().min_max().0 >= 280.0, "{header}{value}");
        assert!(warnings.contains(&Warning::HolesFilled { filled, total: 9 }), "{header}{value}: {warnings:?}");
    }
}

#[test]
fn masks_and_alpha_bands_make_holes() {
    let hidden = |at: usize| at % COLUMNS < 3;
    let noisy = raster(32, 3, floats(|at| if hidden(at) { 300.0 } else { ground(at) }));
    let bytes = (0..COLUMNS * ROWS).map(|at| if hidden(at) { 0 } else { 255 }).collect::<Vec<u8>>();
    let bits = (0..ROWS)
        .flat_map(|row| {
            (0..COLUMNS / 8).map(move |byte| {
                (0..8).fold(0u8, |bits, bit| bits << 1 | u8::from(!hidden(row * COLUMNS + 8 * byte + bit)))
            })
        })
        .collect::<Vec<u8>>();
    let mask = |width: u16, data: Vec<u8>| raster(width, 1, data).set(254, Long(vec![4])).set(262, Short(vec![4]));
    let masked = Warning::Masked { count: 3 * ROWS };
    for image in [mask(8, bytes.clone()), mask(1, bits), mask(8, bytes.clone()).set(262, Short(vec![1]))] {
        let (_, warnings) = read(&tiff(&[noisy.clone(), image])).expect("a terrain");
        assert_eq!(warnings, [masked.clone(), Warning::HolesFilled { filled: 3 * ROWS, total: COLUMNS * ROWS }]);
    }
    // An overview is no mask, nor is the mask of one.
    let overview = mask(8, bytes.clone()).set(254, Long(vec![5]));
    assert_eq!(read(&tiff(&[float_raster(), overview])).expect("a terrain").1, []);

    // An alpha band beside each sample, and apart.
    let interleaved: Vec<u8> = (0..COLUMNS * ROWS)
        .flat_map(|at| [(ground(at) as i16).to_le_bytes(), i16::from(!hidden(at)).to_le_bytes()].concat())
        .collect();
    let two = |data: Vec<u8>| {
        raster(16, 2, data)
            .set(258, Short(vec![16, 16]))
            .set(277, Short(vec![2]))
            .set(338, Short(vec![2]))
            .set(339, Short(vec![2, 2]))
    };
    let mut apart = two(shorts(|at| ground(at) as i16)).set(284, Short(vec![2]));
    apart.chunks.push(shorts(|at| i16::from(!hidden(at))));
    for image in [two(interleaved.clone()), apart] {
        let (terrain, warnings) = read(&tiff(&[image])).expect("a terrain");
        assert_eq!(warnings[0], masked, "{warnings:?}");
        assert_eq!(terrain.field().heights()[5], ground(5).trunc());
    }
    // Two bands of which none is alpha: which has the heights?
    let error = read(&tiff(&[two(interleaved).set(338, Short(vec![0]))])).expect_err("two bands").to_string();
    assert!(error.contains("one band"), "{error}");
}

#[test]
fn sparse_tiles_are_holes() {
    // Three tiles of 16 x 16 are empty, of a raster of 32 x 32.
    let tile: Vec<u8> = (0..256).flat_map(|at| (280.0 + at as f32).to_le_bytes()).collect();
    let mut image = raster(32, 3, Vec::new())
        .set(256, Short(vec![32]))
        .set(257, Short(vec![32]))
        .set(322, Short(vec![16]))
        .set(323, Short(vec![16]))
        .without(278);
    image.tiled = true;
    image.chunks = vec![tile, Vec::new(), Vec::new(), Vec::new()];
    let (terrain, warnings) = read(&tiff(&[image.clone()])).expect("a terrain");
    assert_eq!(warnings, [Warning::HolesFilled { filled: 768, total: 1024 }]);
    assert!(terrain.field().min_max().0 >= 280.0);
    // A large raster of which a single tile has data.
    let side = 16 * 60;
    let mut large = image.set(256, Short(vec![side])).set(257, Short(vec![side]));
    large.chunks = (0..3600).map(|n| if n == 7 { large.chunks[0].clone() } else { Vec::new() }).collect();
    let (terrain, _) = read(&tiff(&[large])).expect("a terrain");
    assert_eq!(terrain.field().columns(), usize::from(side));
}

// ---------------------------------------------------------------- compressions

#[test]
fn zstandard_is_read_and_others_are_named() {
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};
    let packed = |data: Vec<u8>| compress_to_vec(&data[..], CompressionLevel::Fastest);
    let plain = read(&tiff(&[float_raster()])).expect("a terrain").0;
    let image = raster(32, 3, packed(floats(ground))).set(259, Short(vec![50_000]));
    let (terrain, warnings) = read(&tiff(std::slice::from_ref(&image))).expect("a terrain");
    assert_eq!((terrain.field().heights(), warnings), (plain.field().heights(), Vec::new()));
    // Several strips, with differences between neighbours.
    let mut strips =
        raster(16, 2, Vec::new()).set(259, Short(vec![50_000])).set(278, Short(vec![5])).set(317, Short(vec![2]));
    let row = |row: usize| {
        let value = move |column: usize| ground(row * COLUMNS + column) as i16;
        (0..COLUMNS).flat_map(move |column| {
            if column == 0 { value(0) } else { value(column) - value(column - 1) }.to_le_bytes()
        })
    };
    strips.chunks =
        [0..5, 5..10, 10..ROWS].into_iter().map(|rows| packed(rows.flat_map(row).collect::<Vec<u8>>())).collect();
    let (terrain, _) = read(&tiff(&[strips])).expect("a terrain");
    for at in [0, 17, 100, COLUMNS * ROWS - 1] {
        assert_eq!(terrain.field().heights()[at], ground(at).trunc());
    }
    let mut damaged = image;
    damaged.chunks[0][10..].iter_mut().for_each(|byte| *byte ^= 0x5a);
    assert!(read(&tiff(&[damaged])).is_err());
    for (compression, name) in [(34_887, "LERC"), (34_925, "LZMA"), (50_001, "WebP"), (12_345, "12345")] {
        let error = read(&tiff(&[float_raster().set(259, Short(vec![compression]))])).expect_err("not read");
        let text = error.to_string();
        assert!(matches!(error, TerrainError::Unsupported { .. }), "{text}");
        assert!(text.contains(name) && text.contains("gdal_translate") && !text.contains("damaged"), "{text}");
    }
}

// ---------------------------------------------------------------- places

#[test]
fn rounding_in_a_transformation_is_no_rotation() {
    let matrix = |turn: f64| {
        let rows =
            vec![10.0, turn, 0.0, 500_000.0, -turn, -10.0, 0.0, 5_400_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        float_raster().without(33550).without(33922).set(34264, Double(rows))
    };
    for turn in [0.0, 1e-16, -3e-14, 1e-9] {
        let (terrain, _) = read(&tiff(&[matrix(turn)])).expect("a terrain");
        assert_eq!(terrain.field().spacing(), DVec2::splat(10.0), "{turn}");
    }
    assert!(read(&tiff(&[matrix(0.5)])).expect_err("rotated").to_string().contains("rotated"));
}

#[test]
fn files_beside_a_raster_say_where_it_lies() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("a temporary file");
        path
    };
    let utm = "PROJCS[\"WGS_1984_UTM_Zone_33N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,\
               298.257223563]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\
               \"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],PARAMETER[\"False_Northing\",0.0],PARAMETER[\
               \"Central_Meridian\",15.0],PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT[\
               \"Meter\",1.0]]";
    let bare = tiff(&[float_raster().without(33550).without(33922).without(34735)]);
    let path = write("bare.tif", &bare);
    let error = read_terrain(&path, &ReadOptions::default()).expect_err("no place").to_string();
    assert!(error.contains("unknown coordinate system"), "{error}");
    write("bare.tfw", b"10.0\n0.0\n0.0\n-10.0\n500005.0\n5399995.0\n");
    write("bare.prj", utm.as_bytes());
    let (terrain, warnings) = read_terrain(&path, &ReadOptions::default()).expect("a terrain");
    assert_eq!(warnings, []);
    let (keyed, _) = read(&tiff(&[float_raster()])).expect("a terrain");
    assert_eq!(terrain.reference(), keyed.reference());

    let grid = "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 5400000\ncellsize 10\n1 2 3\n4 5 6\n";
    let path = write("grid.asc", grid.as_bytes());
    write("grid.prj", utm.as_bytes());
    let (terrain, warnings) = read_terrain(&path, &ReadOptions::default()).expect("a terrain");
    assert_eq!(warnings, []);
    assert_eq!(terrain.reference().map(GeoReference::system), Some(CoordinateSystem::Utm { zone: 33, south: false }));
}

#[test]
fn tiles_of_one_raster_are_one_terrain() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("a temporary file");
        path
    };
    // Heights are the easting of a cell's middle minus 500,000 plus a tenth of the northing below 5,400,000.
    let tile = |east: f64, south: f64| {
        let value = move |at: usize| {
            let (column, row) = (at % COLUMNS, at / COLUMNS);
            (east + 10.0 * column as f64 + 5.0 + 0.1 * (south + 10.0 * row as f64 + 5.0)) as f32
        };
        raster(32, 3, floats(value)).set(33922, Double(vec![0.0, 0.0, 0.0, 500_000.0 + east, 5_400_000.0 - south, 0.0]))
    };
    let (wide, high) = (10.0 * COLUMNS as f64, 10.0 * ROWS as f64);
    let paths = [("a.tif", 0.0, 0.0), ("b.tif", wide, 0.0), ("c.tif", 0.0, high), ("d.tif", wide, high)]
        .map(|(name, east, south)| write(name, &tiff(&[tile(east, south)])));
    let check = |terrain: &Terrain| {
        let field = terrain.field();
        assert_eq!((field.columns(), field.rows()), (2 * COLUMNS, 2 * ROWS));
        for (column, row) in [(0, 0), (COLUMNS + 3, 2), (5, ROWS + 4), (2 * COLUMNS - 1, 2 * ROWS - 1)] {
            let expected = 10.0 * column as f32 + 5.0 + 0.1 * (10.0 * row as f32 + 5.0);
            assert!((field.heights()[row * field.columns() + column] - expected).abs() < 1e-3);
        }
    };
    let (terrain, warnings) = read_terrain_tiles(&paths, &ReadOptions::default()).expect("a terrain");
    assert_eq!(warnings, []);
    check(&terrain);
    let sources: String = ["a", "b", "c", "d"]
        .iter()
        .map(|name| {
            format!("<SimpleSource><SourceFilename relativeToVRT=\"1\">{name}.tif</SourceFilename></SimpleSource>")
        })
        .collect();
    let vrt = format!(
        "<VRTDataset rasterXSize=\"32\"><VRTRasterBand dataType=\"Float32\" band=\"1\">{sources}</VRTRasterBand></VRTDataset>"
    );
    let path = write("all.vrt", vrt.as_bytes());
    check(&read_terrain(&path, &ReadOptions::default()).expect("a terrain").0);
    // A crop reads what it needs; a gap is filled.
    let crop = canopy::terrain::Crop { west: 500_100.0, south: 5_399_950.0, east: 500_250.0, north: 5_400_000.0 };
    let options = ReadOptions { crop: Some(crop), ..ReadOptions::default() };
    let (terrain, _) = read_terrain(&path, &options).expect("a terrain");
    assert!(terrain.field().columns() >= 14, "{}", terrain.field().columns());
    let (_, warnings) = read_terrain_tiles(&paths[..3], &ReadOptions::default()).expect("a terrain");
    assert_eq!(warnings, [Warning::HolesFilled { filled: COLUMNS * ROWS, total: 4 * COLUMNS * ROWS }]);

    let odd = write("odd.tif", &tiff(&[tile(wide + 4.0, 0.0)]));
    let other = write("other.tif", &tiff(&[tile(wide, 0.0).set(34735, keys(&[[1024, 0, 1, 1], [3072, 0, 1, 32632]]))]));
    for (path, words) in [(odd, "one grid"), (other, "coordinate system")] {
        let error =
            read_terrain_tiles(&[paths[0].clone(), path], &ReadOptions::default()).expect_err("not one").to_string();
        assert!(error.contains(words) && error.contains("gdalwarp"), "{error}");
    }
    assert!(read_terrain_tiles(&[], &ReadOptions::default()).is_err());
    for text in ["<VRTDataset></VRTDataset>", "<VRTDataset subClass=\"VRTWarpedDataset\">", "<VRTDataset"] {
        assert!(read_terrain(&write("bad.vrt", text.as_bytes()), &ReadOptions::default()).is_err(), "{text}");
    }
}

#[test]
fn srtm_tiles_have_several_sizes() {
    for (columns, rows) in [(7201, 7201), (1801, 3601)] {
        let bytes: Vec<u8> =
            (0..columns * rows).flat_map(|at: usize| ((at / columns / 4) as i16).to_be_bytes()).collect();
        let options = ReadOptions {
            crop: Some(canopy::terrain::Crop { west: 15.0, south: 60.0, east: 15.01, north: 60.02 }),
            ..ReadOptions::default()
        };
        let (terrain, warnings) = read_terrain_bytes(&bytes, Path::new("N60E015.hgt"), &options).expect("a terrain");
        assert_eq!(warnings, []);
        let spacing = terrain.field().spacing();
        let expected = DVec2::new(55_800.0 / (columns - 1) as f64, 111_412.0 / (rows - 1) as f64);
        assert!((spacing / expected - 1.0).abs().max_element() < 0.01, "{spacing}");
    }
}
