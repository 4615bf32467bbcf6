//! Readers of files against inputs that are damaged at random: each is answered, none is suffered.
//!
//! The seed is fixed, so that a run repeats itself. `CANOPY_FUZZ=1000` runs a thousand times as many rounds, which takes an
//! hour or more; a round that fails names its input, which is kept.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use canopy::{
    math::hash::hash64,
    plant::{
        gltf::{GltfOptions, external_files, load_plant_bytes},
        grow::GrowParameters,
    },
    scatter::{InventoryOptions, parse_inventory},
    scene::Scene,
    terrain::{HeightField, ImageScale, ReadOptions, Surroundings, Terrain, read_drape_bytes, read_terrain_bytes},
};
use tiff::{
    encoder::{TiffEncoder, colortype},
    tags::Tag,
};

use crate::support::glb::TreeFile;

/// Rounds of each reader in an ordinary run.
const ROUNDS: u64 = 40_000;
const SEED: u64 = 0x5eed_f0e5;

/// Numbers at which counts, sizes and offsets break.
const EDGES: [u64; 10] = [0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, u64::MAX];
/// Words at which texts break.
const WORDS: [&str; 12] =
    ["NaN", "inf", "-1", "1e308", "1e-308", "99999999999999999999", "\"", "(", "]", "\n", "\u{feff}", "-"];

/// Numbers by lot, the same in every run.
struct Lots {
    seed: u64,
    drawn: u64,
}

impl Lots {
    fn next(&mut self) -> u64 {
        self.drawn += 1;
        hash64(self.seed, self.drawn, 0u64)
    }

    /// A number below `end`; 0 if that is 0.
    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// Damages `bytes` in one way.
fn damage(bytes: &mut Vec<u8>, others: &[Vec<u8>], lots: &mut Lots) {
    let at = lots.below(bytes.len());
    let length = 1 + lots.below(16).pow(2);
    let end = (at + length).min(bytes.len());
    match lots.below(9) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..end)),
        2 => {
            let copied = bytes[at..end].to_vec();
            let to = lots.below(bytes.len() + 1);
            bytes.splice(to..to, copied);
        }
        3 | 4 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << lots.below(8);
            }
        }
        5 | 6 => {
            let edge = EDGES[lots.below(EDGES.len())];
            let size = [1, 2, 4, 8][lots.below(4)];
            let value =
                if lots.below(2) == 0 { edge.to_le_bytes().to_vec() } else { edge.to_be_bytes()[8 - size..].to_vec() };
            bytes.iter_mut().skip(at).zip(value).take(size).for_each(|(to, from)| *to = from);
        }
        7 => {
            let word = WORDS[lots.below(WORDS.len())].as_bytes();
            let kept = if lots.below(2) == 0 { at } else { end };
            bytes.splice(at..kept, word.iter().copied());
        }
        _ => {
            let other = &others[lots.below(others.len())];
            let from = lots.below(other.len());
            bytes.truncate(at);
            bytes.extend_from_slice(&other[from..]);
        }
    }
}

/// Feeds `read` with damaged inputs.
#[track_caller]
fn fuzz(name: &str, inputs: &[Vec<u8>], read: impl Fn(&[u8])) {
    let times = std::env::var("CANOPY_FUZZ").ok().and_then(|times| times.parse::<u64>().ok()).unwrap_or(1);
    for input in inputs {
        read(input);
    }
    for round in 0..ROUNDS.saturating_mul(times) {
        let mut lots = Lots { seed: SEED ^ round, drawn: 0 };
        let mut bytes = inputs[lots.below(inputs.len())].clone();
        for _ in 0..=lots.below(5) {
            damage(&mut bytes, inputs, &mut lots);
        }
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| read(&bytes))) {
            let kept = std::env::temp_dir().join(format!("canopy-fuzz-{name}-{round}"));
            let _ = std::fs::write(&kept, &bytes);
            eprintln!("{name}, round {round}: the input is {}", kept.display());
            std::panic::resume_unwind(panic);
        }
    }
}

/// A GeoTIFF of 9 × 7 pixels of 10 m in UTM.
fn geotiff_of<C>(missing: &str, samples: &[C::Inner]) -> Vec<u8>
where
    C: colortype::ColorType,
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut write = || -> tiff::TiffResult<()> {
        let mut encoder = TiffEncoder::new(&mut bytes)?;
        let mut image = encoder.new_image::<C>(9, 7)?;
        image.encoder().write_tag(Tag::ModelPixelScaleTag, &[10.0, 10.0, 0.0][..])?;
        image.encoder().write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 500_000.0, 4_000_000.0, 0.0][..])?;
        image.encoder().write_tag(Tag::GeoKeyDirectoryTag, &[1u16, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32617][..])?;
        image.encoder().write_tag(Tag::GdalNodata, missing)?;
        image.write_data(samples)
    };
    write().expect("a GeoTIFF");
    bytes.into_inner()
}

fn geotiff() -> Vec<u8> {
    geotiff_of::<colortype::Gray32Float>("-9999", &(0..63u8).map(f32::from).collect::<Vec<_>>())
}

fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::ImageBuffer::<image::Luma<u16>, _>::new(9, 9);
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG");
    bytes.into_inner()
}

#[test]
fn damaged_terrains_are_answered() {
    let grid = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n1 2 3\n4 -9999 6\n";
    let options = ReadOptions {
        image_scale: Some(ImageScale { spacing: 1.0, lowest: 0.0, highest: 10.0 }),
        ..ReadOptions::default()
    };
    fuzz("terrain", &[geotiff(), png(), grid.as_bytes().to_vec()], |bytes| {
        if let Ok((terrain, _)) = read_terrain_bytes(bytes, Path::new("terrain"), &options) {
            assert!(terrain.height(1.0, 2.0).is_finite() && terrain.extent().is_finite());
        }
    });
}

#[test]
fn damaged_photographs_are_answered() {
    let photo = |format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = image::RgbImage::from_fn(24, 16, |x, y| image::Rgb([10 * x as u8, 10 * y as u8, 77]));
        image.write_to(&mut bytes, format).expect("a photograph");
        bytes.into_inner()
    };
    let tiff = geotiff_of::<colortype::RGBA8>("0", &(0..252u8).collect::<Vec<_>>());
    let (terrain, _) =
        read_terrain_bytes(&geotiff(), Path::new("terrain"), &ReadOptions::default()).expect("a terrain");
    let bare = HeightField::new(2, 2, glam::DVec2::splat(50.0), vec![0.0; 4]).expect("a plane");
    let bare = Terrain::new(bare, None, Surroundings::Mirror);
    let files = [tiff, photo(image::ImageFormat::Png), photo(image::ImageFormat::Jpeg)];
    for terrain in [&terrain, &bare] {
        assert!(read_drape_bytes(files[0].clone(), Path::new("photo"), None, terrain).is_ok(), "a control");
    }
    fuzz("photograph", &files, |bytes| {
        for terrain in [&terrain, &bare] {
            if let Ok((drape, _)) = read_drape_bytes(bytes.to_vec(), Path::new("photo"), None, terrain) {
                assert!(drape.sample(glam::DVec2::new(1.0, 2.0)).is_finite() && drape.texel().is_finite());
            }
        }
    });
}

#[test]
fn damaged_inventories_are_answered() {
    let tables = [
        "x,y,dbh_cm,height_m,species\n1,2,30,12,oak\n-4.5,1e3,,7,\"Quercus; alba\"\n5,5,12,,beech\n",
        "lon;lat;height\n9.2;47.5;12\n9.3;47.6;\n",
        "tree\teasting\tnorthing\n1\t500000\t4000000\n",
    ];
    fuzz("inventory", &tables.map(|table| table.as_bytes().to_vec()), read_inventory);
}

/// Reads an inventory, whose numbers must be sound if there are any.
fn read_inventory(bytes: &[u8]) {
    if let Ok(inventory) = parse_inventory(bytes, "inventory", InventoryOptions::default()) {
        for row in &inventory.rows {
            assert!(row.x.is_finite() && row.y.is_finite(), "{row:?}");
            assert!(row.height_m.is_none_or(|height| height > 0.0 && height.is_finite()), "{row:?}");
            assert!(row.dbh_m.is_none_or(|dbh| dbh > 0.0 && dbh.is_finite()), "{row:?}");
        }
    }
}

#[cfg(feature = "geopackage")]
#[test]
fn damaged_geopackages_are_answered() {
    fuzz("geopackage", &[crate::geopackages::small()], read_inventory);
}

#[test]
fn damaged_plants_are_answered() {
    let whole = TreeFile::default().bytes();
    let pale = TreeFile { absent_texture: true, ..TreeFile::default() }.bytes();
    fuzz("plant", &[whole, pale], |bytes| {
        let name = Path::new("plant.glb");
        let _ = external_files(bytes, name);
        if let Ok((plant, _)) = load_plant_bytes(bytes, name, &BTreeMap::new(), &GltfOptions::default()) {
            assert!(plant.bounds().is_some_and(|bounds| bounds.min.is_finite() && bounds.max.is_finite()));
        }
    });
}

#[test]
fn damaged_scenes_and_species_are_answered() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let ron = |path: &Path| path.extension().is_some_and(|extension| extension == "ron");
    let mut files: Vec<_> = crate::support::program::listing(&folder).into_iter().filter(|path| ron(path)).collect();
    files.sort();
    let texts: Vec<Vec<u8>> = files.iter().map(|path| std::fs::read(path).expect("a file")).collect();
    assert!(texts.len() >= 2);
    fuzz("scene", &texts, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let _ = GrowParameters::from_ron(&text);
        match Scene::parse(&text, Path::new("scene.ron")) {
            Ok(scene) => assert!(scene.validate().is_ok()),
            Err(error) => assert!(error.to_string().starts_with("scene.ron:"), "{error}"),
        }
    });
}
