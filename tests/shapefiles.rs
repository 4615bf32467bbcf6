//! Inventories in shapefiles, as geographic information systems write them.

use std::path::{Path, PathBuf};

use canopy::app::info;
use canopy::scatter::{Coordinates, InventoryOptions, ScatterError, read_inventory};
use shapefile::dbase::{Record, TableWriterBuilder, encoding::Unicode};
use shapefile::{Point, PointZ, Polyline, Writer};
use tempfile::TempDir;

use crate::support::inventory::listed;

const UTM_32: &str = "PROJCS[\"ETRS_1989_UTM_Zone_32N\",GEOGCS[\"GCS_ETRS_1989\",DATUM[\"D_ETRS_1989\",SPHEROID[\"GRS_1980\",\
                      6378137.0,298.257222101]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\
                      \"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],PARAMETER[\"False_Northing\",0.0],\
                      PARAMETER[\"Central_Meridian\",9.0],PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",\
                      0.0],UNIT[\"Meter\",1.0]]";

fn writer(path: &Path) -> Writer<std::io::BufWriter<std::fs::File>> {
    let table = TableWriterBuilder::with_encoding(Unicode)
        .add_numeric_field("BHD_CM".try_into().unwrap(), 8, 1)
        .add_numeric_field("HOEHE_M".try_into().unwrap(), 8, 2)
        .add_character_field("BAUMART".try_into().unwrap(), 40);
    Writer::from_path(path, table).unwrap()
}

fn record(dbh: Option<f64>, height: Option<f64>, species: Option<&str>) -> Record {
    let mut record = Record::default();
    record.insert("BHD_CM".to_owned(), dbh.into());
    record.insert("HOEHE_M".to_owned(), height.into());
    record.insert("BAUMART".to_owned(), species.map(str::to_owned).into());
    record
}

/// Three trees, the last without sizes.
fn trees(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("trees.shp");
    let mut writer = writer(&path);
    let rows = [
        (500_010.5, 5_400_020.25, record(Some(32.5), Some(18.25), Some("Quercus robur"))),
        (500_030.0, 5_400_040.0, record(Some(12.0), None, Some("Stiel-Eiche, südlich"))),
        (500_050.0, 5_400_060.0, record(None, None, None)),
    ];
    for (x, y, record) in rows {
        writer.write_shape_and_record(&Point::new(x, y), &record).unwrap();
    }
    drop(writer);
    std::fs::write(path.with_extension("cpg"), "UTF-8").unwrap();
    std::fs::write(path.with_extension("prj"), UTM_32).unwrap();
    path
}

#[test]
fn a_shapefile_is_an_inventory_with_its_columns_its_encoding_and_its_system() {
    let folder = tempfile::tempdir().unwrap();
    let path = trees(&folder);
    let inventory = read_inventory(&path, InventoryOptions::default()).unwrap();
    let expected = [
        (500_010.5, 5_400_020.25, Some(0.325), Some(18.25), Some("Quercus robur"), 1),
        (500_030.0, 5_400_040.0, Some(0.12), None, Some("Stiel-Eiche, südlich"), 2),
        (500_050.0, 5_400_060.0, None, None, None, 3),
    ];
    assert_eq!(listed(&inventory), expected);
    assert_eq!(inventory.coordinates, Coordinates::Planar);
    assert!(inventory.wkt.is_some_and(|text| text.contains("UTM_Zone_32N")));

    let page = info(&path).unwrap();
    for word in ["3 trees", "BHD_CM", "HOEHE_M", "BAUMART"] {
        assert!(page.contains(word), "no `{word}` in:\n{page}");
    }
}

/// Systems that do not tell letters apart write `TREES.SHP` and `TREES.DBF`.
#[test]
fn endings_may_have_any_case() {
    let folder = tempfile::tempdir().unwrap();
    let path = trees(&folder);
    for ending in ["shp", "dbf", "cpg", "prj"] {
        let upper = path.with_extension(ending.to_ascii_uppercase());
        std::fs::rename(path.with_extension(ending), upper).unwrap();
    }
    let inventory = read_inventory(&path.with_extension("SHP"), InventoryOptions::default()).unwrap();
    assert_eq!((inventory.rows.len(), inventory.rows[0].dbh_m), (3, Some(0.325)));
    assert!(inventory.wkt.is_some());
}

#[test]
fn missing_side_files_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = trees(&folder);
    for ending in ["dbf", "prj"] {
        std::fs::remove_file(path.with_extension(ending)).unwrap();
    }
    let inventory = read_inventory(&path, InventoryOptions::default()).unwrap();
    let notes = inventory.notes.join("\n");
    assert!(notes.contains("no .dbf") && notes.contains("no .prj") && notes.contains("metres"), "{notes}");
    assert_eq!((inventory.rows.len(), inventory.rows[0].dbh_m), (3, None));

    // Degrees are known by their values.
    let path = folder.path().join("degrees.shp");
    let mut writer = writer(&path);
    writer.write_shape_and_record(&PointZ::new(9.1, 48.7, 300.0, 0.0), &record(Some(40.0), None, None)).unwrap();
    drop(writer);
    let inventory = read_inventory(&path, InventoryOptions::default()).unwrap();
    assert_eq!((inventory.coordinates, inventory.rows[0].y), (Coordinates::Geographic, 48.7));
}

#[test]
fn shapes_that_are_no_points_are_refused_with_their_kind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("roads.shp");
    let mut writer = writer(&path);
    let line = Polyline::new(vec![Point::new(0.0, 0.0), Point::new(1.0, 1.0)]);
    writer.write_shape_and_record(&line, &record(None, None, None)).unwrap();
    drop(writer);
    let error = read_inventory(&path, InventoryOptions::default()).unwrap_err().to_string();
    assert!(error.contains("roads.shp") && error.contains("Polyline") && error.contains("as points"), "{error}");
}

/// Whatever is cut off or overwritten, there are trees or an error.
#[test]
fn damaged_shapefiles_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = trees(&folder);
    for ending in ["shp", "dbf"] {
        let file = path.with_extension(ending);
        let whole = std::fs::read(&file).unwrap();
        for length in (4..whole.len()).step_by(3) {
            std::fs::write(&file, &whole[..length]).unwrap();
            let _ = read_inventory(&path, InventoryOptions::default());
        }
        for at in 4..whole.len().min(260) {
            let mut wrong = whole.clone();
            wrong[at] = 0xFF;
            std::fs::write(&file, &wrong).unwrap();
            let _ = read_inventory(&path, InventoryOptions::default());
        }
        std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
        let error = read_inventory(&path, InventoryOptions::default()).unwrap_err();
        assert!(matches!(error, ScatterError::Record { .. }), "{error}");
        assert!(error.to_string().contains("trees.shp"), "{error}");
        std::fs::write(&file, &whole).unwrap();
    }
}
