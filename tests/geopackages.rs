//! Inventories in GeoPackages, as geographic information systems write them.

use std::path::{Path, PathBuf};

use canopy::app::info;
use canopy::scatter::{Coordinates, Inventory, InventoryOptions, ScatterError, parse_inventory, read_inventory};
use rusqlite::{Connection, MAIN_DB, params};
use tempfile::TempDir;

use crate::support::inventory::listed;

const UTM_32: &str = "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\",DATUM[\"ETRS_1989\",SPHEROID[\"GRS 1980\",6378137,\
                      298.257222101]]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"central_meridian\",9],PARAMETER[\
                      \"scale_factor\",0.9996],PARAMETER[\"false_easting\",500000],UNIT[\"metre\",1]]";
const WGS_84: &str = "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]]]";

/// A GeoPackage in memory with its tables and the systems that all have, EPSG:25832, and one without a code.
fn empty() -> Connection {
    let database = Connection::open_in_memory().unwrap();
    database
        .execute_batch(
            "PRAGMA page_size = 512;
             PRAGMA application_id = 0x47504B47;
             CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, organization TEXT NOT NULL,
                 organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
             CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
                 srs_id INTEGER);
             CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL,
                 geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL);",
        )
        .unwrap();
    let systems = [
        (-1, "NONE", -1, "undefined"),
        (0, "NONE", 0, "undefined"),
        (4326, "EPSG", 4326, WGS_84),
        (25832, "epsg", 25832, UTM_32),
        (100_001, "NONE", 100_001, UTM_32),
        (100_002, "EPSG", 25832, "undefined"),
        (99_999, "GDAL", 99_999, "LOCAL_CS[\"Undefined SRS\",UNIT[\"unknown\",0]]"),
    ];
    for (number, organization, code, definition) in systems {
        let insert = "INSERT INTO gpkg_spatial_ref_sys VALUES ('a system', ?1, ?2, ?3, ?4, NULL)";
        database.execute(insert, params![number, organization, code, definition]).unwrap();
    }
    database
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// Announces a table.
fn announce(database: &Connection, name: &str, kind: &str, system: i64) {
    database.execute("INSERT INTO gpkg_contents VALUES (?1, 'features', ?1, ?2)", params![name, system]).unwrap();
    let insert = "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, 0, 0)";
    database.execute(insert, params![name, kind, system]).unwrap();
}

/// A layer with these columns beside its geometries.
fn layer(database: &Connection, name: &str, kind: &str, system: i64, columns: &str) {
    let table = format!("CREATE TABLE {} (fid INTEGER PRIMARY KEY, geom BLOB {columns})", quoted(name));
    database.execute_batch(&table).unwrap();
    announce(database, name, kind, system);
}

/// Adds a feature without attributes.
fn add(database: &Connection, layer: &str, geometry: Option<&[u8]>) {
    database.execute(&format!("INSERT INTO {} (geom) VALUES (?1)", quoted(layer)), [geometry]).unwrap();
}

/// The header of a geometry and its well-known binary, with these flags.
fn blob(flags: u8, envelope: &[f64], binary: &[u8]) -> Vec<u8> {
    let envelope: Vec<u8> = envelope.iter().flat_map(|value| value.to_le_bytes()).collect();
    [&[b'G', b'P', 0, flags, 0xE8, 0x64, 0, 0][..], &envelope, binary].concat()
}

/// A point as most programs write it: little endian, without envelope.
fn point(x: f64, y: f64) -> Vec<u8> {
    blob(1, &[], &[&[1, 1, 0, 0, 0][..], &x.to_le_bytes(), &y.to_le_bytes()].concat())
}

/// A polygon without rings.
fn polygon() -> Vec<u8> {
    blob(1, &[], &[1, 3, 0, 0, 0, 0, 0, 0, 0])
}

fn bytes(database: Connection) -> Vec<u8> {
    database.serialize(MAIN_DB).unwrap().to_vec()
}

fn read(database: Connection, layer: Option<&str>) -> Result<Inventory, ScatterError> {
    parse_inventory(&bytes(database), "trees.gpkg", InventoryOptions { layer, ..InventoryOptions::default() })
}

fn refusal(database: Connection, layer: Option<&str>) -> String {
    let error = read(database, layer).unwrap_err();
    assert!(matches!(error, ScatterError::Record { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("trees.gpkg"), "{text}");
    text
}

/// The positions and the numbers of the features.
fn places(inventory: &Inventory) -> Vec<(f64, f64, u64)> {
    inventory.rows.iter().map(|tree| (tree.x, tree.y, tree.line)).collect()
}

#[track_caller]
fn says(inventory: &Inventory, words: &[&str]) {
    let notes = inventory.notes.join("\n");
    for word in words {
        assert!(notes.contains(word), "no `{word}` in:\n{notes}");
    }
}

/// Three trees with sizes, the last without.
fn trees() -> Connection {
    let database = empty();
    let columns = ", BHD_CM REAL, hoehe_m MEDIUMINT, \"Baumart\" TEXT, planted DATE, photo BLOB";
    layer(&database, "trees", "POINT", 25832, columns);
    let rows = [
        (500_010.5, 5_400_020.25, Some(32.5), Some(18), Some("Quercus robur"), Some(&b"JPEG"[..])),
        (500_030.0, 5_400_040.0, Some(12.0), None, Some("Stiel-Eiche, südlich"), None),
        (500_050.0, 5_400_060.0, None, None, None, None),
    ];
    for (x, y, dbh, height, species, photo) in rows {
        let insert = "INSERT INTO trees VALUES (NULL, ?1, ?2, ?3, ?4, '2019-04-01', ?5)";
        database.execute(insert, params![point(x, y), dbh, height, species, photo]).unwrap();
    }
    database
}

/// The bytes of a small GeoPackage, for damage at random.
pub fn small() -> Vec<u8> {
    bytes(trees())
}

/// Writes a GeoPackage and returns its path.
fn written(folder: &TempDir, database: Connection) -> PathBuf {
    let path = folder.path().join("trees.gpkg");
    std::fs::write(&path, bytes(database)).unwrap();
    path
}

#[test]
fn a_geopackage_is_an_inventory_with_its_columns_and_its_system() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(&folder, trees());
    let inventory = read_inventory(&path, InventoryOptions::default()).unwrap();
    let expected = [
        (500_010.5, 5_400_020.25, Some(0.325), Some(18.0), Some("Quercus robur"), 1),
        (500_030.0, 5_400_040.0, Some(0.12), None, Some("Stiel-Eiche, südlich"), 2),
        (500_050.0, 5_400_060.0, None, None, None, 3),
    ];
    assert_eq!(listed(&inventory), expected);
    assert_eq!((inventory.coordinates, inventory.epsg), (Coordinates::Planar, Some(25832)));
    assert_eq!(inventory.wkt.as_deref(), Some(UTM_32));
    let blobs = "blobs are not used, as in the column(s) `photo`";
    assert_eq!(inventory.notes, [blobs, "columns that are not used: fid, planted, photo"]);

    let page = info(&path).unwrap();
    for word in ["3 trees", "BHD_CM", "hoehe_m", "Baumart", "metres"] {
        assert!(page.contains(word), "no `{word}` in:\n{page}");
    }
    let upper = folder.path().join("TREES.GPKG");
    std::fs::rename(&path, &upper).unwrap();
    assert!(info(&upper).unwrap().contains("3 trees"));
}

#[test]
fn values_of_all_types_become_cells() {
    let database = empty();
    layer(&database, "trees", "POINT", 25832, ", dbh_cm, height_m, species");
    let rows = "(NULL, :p, '32.5', 18.25, ' oak '), (NULL, :p, 40, '19', 7), (NULL, :p, x'0102', 'high', 'dead')";
    let insert = format!("INSERT INTO trees VALUES {rows}");
    database.execute(&insert, rusqlite::named_params! {":p": point(1.0, 2.0)}).unwrap();
    database.execute(&insert, rusqlite::named_params! {":p": point(3.0, 4.0)}).unwrap();
    let inventory = read(database, None).unwrap();
    let found: Vec<_> =
        inventory.rows.iter().map(|tree| (tree.dbh_m, tree.height_m, tree.species.as_deref(), tree.line)).collect();
    let one = |line| [(Some(0.325), Some(18.25), Some("oak"), line), (Some(0.4), Some(19.0), Some("7"), line + 1)];
    assert_eq!(found, [one(1), one(4)].concat());
    says(&inventory, &["blobs are not used, as in the column(s) `dbh_cm`", "2 dead trees"]);
}

/// A point, or the first of several, in either order of bytes, with and without envelope and heights.
#[test]
fn points_are_read_in_every_encoding() {
    let (x, y) = (16.372_512_5, 48.208_756_25);
    let big = |values: &[f64]| values.iter().flat_map(|value| value.to_be_bytes()).collect::<Vec<u8>>();
    let little = |values: &[f64]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let header = |kind: u32| [&[1][..], &kind.to_le_bytes()].concat();
    let several =
        [header(1004), vec![2, 0, 0, 0], header(1001), little(&[x, y, 171.0]), header(1001), little(&[0.0; 3])];
    let geometries = [
        point(x, y),
        blob(0, &[], &[&[0, 0, 0, 0, 1][..], &big(&[x, y])].concat()),
        blob(0b11, &[x, x, y, y], &[header(1), little(&[x, y])].concat()),
        blob(0b1001, &[x, x, y, y, 1.0, 1.0, 2.0, 2.0], &[header(3001), little(&[x, y, 1.0, 2.0])].concat()),
        blob(1, &[], &[header(0x8000_0001), little(&[x, y, 171.0])].concat()),
        blob(0b101, &[x, x, y, y, 0.0, 171.0], &several.concat()),
    ];
    let database = empty();
    layer(&database, "trees", "MULTIPOINT", 4326, "");
    for geometry in &geometries {
        add(&database, "trees", Some(geometry));
    }
    let inventory = read(database, None).unwrap();
    assert_eq!(places(&inventory), (1..=6).map(|line| (x, y, line)).collect::<Vec<_>>());
    assert_eq!((inventory.coordinates, inventory.epsg), (Coordinates::Geographic, Some(4326)));
}

#[test]
fn features_without_a_position_are_counted() {
    let database = empty();
    layer(&database, "trees", "GEOMETRY", 25832, "");
    let whole = point(500_010.0, 5_400_020.0);
    let empty_point = blob(0b1_0001, &[], &point(f64::NAN, f64::NAN)[8..]);
    for geometry in
        [Some(&whole[..]), None, Some(&empty_point[..]), Some(&polygon()[..]), Some(&whole[..20]), Some(&[][..])]
    {
        add(&database, "trees", geometry);
    }
    for number in 0..4 {
        add(&database, "trees", Some(&point(500_020.0 + f64::from(number), 5_400_030.0)));
    }
    let copy = bytes(database);
    let inventory = parse_inventory(&copy, "trees.gpkg", InventoryOptions::default()).unwrap();
    assert_eq!(inventory.rows.iter().map(|tree| tree.line).collect::<Vec<_>>(), [1, 7, 8, 9, 10]);
    says(
        &inventory,
        &[
            "5 row(s) without a usable position are left out",
            "line 2, column `geometry x`: \"\" is missing",
            "line 5, column `geometry x`: \"damaged geometry\" is not a number",
            "1 geometries are no points (the first: Polygon)",
        ],
    );
    let strict = InventoryOptions { strict: true, ..InventoryOptions::default() };
    let error = parse_inventory(&copy, "trees.gpkg", strict).unwrap_err();
    assert!(matches!(error, ScatterError::BadValues { .. }), "{error}");
}

#[test]
fn geometries_that_are_no_points_are_refused_with_their_kind() {
    let database = empty();
    layer(&database, "stands", "POLYGON", 25832, "");
    add(&database, "stands", Some(&polygon()));
    let text = refusal(database, None);
    assert!(text.contains("no layer of points (it has `stands` (POLYGON))") && text.contains("as points"), "{text}");

    let database = empty();
    layer(&database, "stands", "GEOMETRY", 25832, "");
    add(&database, "stands", Some(&polygon()));
    let text = refusal(database, None);
    assert!(text.contains("layer `stands`") && text.contains("Polygon") && text.contains("as points"), "{text}");

    let database = empty();
    layer(&database, "trees", "POINT", 25832, "");
    let text = refusal(database, None);
    assert!(text.contains("none of the 0 features") && text.contains("it is empty"), "{text}");
}

/// Polygons first, then two layers of points and a table without geometry.
fn several_layers() -> Connection {
    let database = empty();
    layer(&database, "stands", "POLYGON", 25832, "");
    layer(&database, "notes", "GEOMETRY", 4326, "");
    layer(&database, "trees 2024", "POINT", 25832, ", dbh_cm REAL");
    layer(&database, "new trees", "MULTIPOINT", 4326, "");
    database
        .execute_batch(
            "CREATE TABLE visits (id INTEGER PRIMARY KEY);
             INSERT INTO gpkg_contents VALUES ('visits', 'attributes', 'visits', NULL);",
        )
        .unwrap();
    add(&database, "notes", Some(&point(9.0, 48.0)));
    add(&database, "trees 2024", Some(&point(500_010.0, 5_400_020.0)));
    add(&database, "new trees", Some(&point(9.5, 48.5)));
    database
}

#[test]
fn the_first_layer_of_points_is_read_unless_one_is_named() {
    let inventory = read(several_layers(), None).unwrap();
    assert_eq!(places(&inventory), [(500_010.0, 5_400_020.0, 1)]);
    says(
        &inventory,
        &[
            "of its layers `trees 2024` is read, not `stands` (POLYGON), `notes` (GEOMETRY), `new trees` (MULTIPOINT), `visits` (no \
           geometry); choose another by `layer` in the scene",
        ],
    );
    for name in ["new trees", "NEW Trees"] {
        let inventory = read(several_layers(), Some(name)).unwrap();
        assert_eq!((places(&inventory), inventory.epsg), (vec![(9.5, 48.5, 1)], Some(4326)));
        assert!(!inventory.notes.iter().any(|note| note.contains("layer")), "{:?}", inventory.notes);
    }
    assert_eq!(places(&read(several_layers(), Some("notes")).unwrap()), [(9.0, 48.0, 1)]);
    let text = refusal(several_layers(), Some("tree 2024"));
    assert!(text.contains("did you mean `trees 2024`?") && text.contains("`new trees` (MULTIPOINT)"), "{text}");
    for name in ["stands", "visits"] {
        let text = refusal(several_layers(), Some(name));
        assert!(text.contains(&format!("the layer `{name}`")) && text.contains("no points"), "{text}");
    }
    // A format without layers says that the choice has no effect.
    let options = InventoryOptions { layer: Some("trees"), ..InventoryOptions::default() };
    says(&parse_inventory(b"x,y\n1,2\n", "trees.csv", options).unwrap(), &["the layer trees is not chosen"]);
}

#[test]
fn a_scene_chooses_the_layer() {
    let folder = tempfile::tempdir().unwrap();
    written(&folder, several_layers());
    let said = |layer: &str| {
        let scene = format!(
            "(terrain: Flat(size: 400), species: [(name: \"oak\", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000, \
             seed: 1))], trees: Inventory(path: \"trees.gpkg\", layer: \"{layer}\", anchor: StandCentre), place: (latitude: 48.5, \
             longitude: 9.5))"
        );
        let path = folder.path().join("scene.ron");
        std::fs::write(&path, scene).unwrap();
        info(&path).map_err(|error| error.to_string())
    };
    assert!(said("new trees").unwrap().contains("1 from the inventory"));
    let text = said("new tree").unwrap_err();
    assert!(text.contains("did you mean `new trees`?"), "{text}");
}

#[test]
fn a_layer_may_be_a_view_and_have_any_name() {
    let database = empty();
    let name = "Bäume \"alt\"; DROP TABLE x --";
    layer(&database, name, "POINT", 25832, ", \"Höhe \"\"m\"\"\" REAL, \"BHD in cm\" REAL");
    let insert = format!("INSERT INTO {} VALUES (NULL, ?1, 18.5, 30)", quoted(name));
    database.execute(&insert, [point(500_010.0, 5_400_020.0)]).unwrap();
    let view = "CREATE VIEW [tall trees] AS SELECT geom, fid * 10 AS number, \"Höhe \"\"m\"\"\" AS height_m FROM ";
    database.execute_batch(&format!("{view} {}", quoted(name))).unwrap();
    announce(&database, "tall trees", "POINT", 25832);
    let copy = bytes(database);
    let read = |layer| {
        parse_inventory(&copy, "trees.gpkg", InventoryOptions { layer, ..InventoryOptions::default() }).unwrap()
    };
    let (table, view) = (read(None), read(Some("tall trees")));
    assert_eq!(places(&table), [(500_010.0, 5_400_020.0, 1)]);
    assert_eq!((table.rows[0].height_m, table.rows[0].dbh_m), (Some(18.5), Some(0.3)));
    assert_eq!(places(&view), places(&table));
    assert_eq!(view.rows[0].height_m, Some(18.5));
    says(&view, &["not used: number"]);
}

/// Columns that a table computes are values like others, and columns that were added are empty in the rows before.
#[test]
fn computed_and_added_columns_have_their_own_values() {
    let database = empty();
    layer(&database, "trees", "POINT", 25832, ", girth_m REAL, dbh_cm REAL AS (girth_m * 25.0), crown REAL");
    let insert = "INSERT INTO trees (geom, girth_m, crown) VALUES (?1, 2.0, 9.0)";
    database.execute(insert, [point(500_010.0, 5_400_020.0)]).unwrap();
    database.execute_batch("ALTER TABLE trees ADD COLUMN height_m REAL").unwrap();
    database.execute("INSERT INTO trees (geom, height_m) VALUES (?1, 12.5)", [point(1.0, 2.0)]).unwrap();
    let inventory = read(database, None).unwrap();
    let [first, second] = &inventory.rows[..] else { panic!("two trees") };
    assert_eq!((first.dbh_m, first.height_m, second.dbh_m, second.height_m), (Some(0.5), None, None, Some(12.5)));
}

#[test]
fn systems_are_known_by_code_or_by_definition_or_assumed() {
    let read = |system: i64, x: f64, y: f64| {
        let database = empty();
        layer(&database, "trees", "POINT", system, "");
        for number in 0..6 {
            add(&database, "trees", Some(&point(x + f64::from(number) * 1e-4, y)));
        }
        let inventory = read(database, None).unwrap();
        assert_eq!(inventory.rows.len(), 6);
        let assumed = inventory.notes.iter().find(|note| note.contains("coordinate system is not defined")).cloned();
        (inventory.coordinates, inventory.epsg, inventory.wkt.is_some(), assumed)
    };
    let (planar, degrees) = (Coordinates::Planar, Coordinates::Geographic);
    assert_eq!(read(25832, 500_010.0, 5_400_020.0), (planar, Some(25832), true, None));
    // A plot near the origin of a projected system is not in degrees.
    assert_eq!(read(25832, 9.0, 48.0), (planar, Some(25832), true, None));
    assert_eq!(read(100_001, 500_010.0, 5_400_020.0), (planar, None, true, None));
    assert_eq!(read(100_002, 500_010.0, 5_400_020.0), (planar, Some(25832), false, None));
    let assumed = |coordinates, word: &str| {
        let read_as = if coordinates == degrees { "degrees" } else { "metres of a system that is not stated" };
        assert!(read_as.contains(word));
        let note = format!("its coordinate system is not defined: the positions are read as {read_as}");
        (coordinates, None, false, Some(note))
    };
    for system in [-1, 0, 99_999, 31_337] {
        assert_eq!(read(system, 500_010.0, 5_400_020.0), assumed(planar, "metres"), "{system}");
        assert_eq!(read(system, 9.1234, 48.5678), assumed(degrees, "degrees"), "{system}");
    }
    // Trees of a plot: a Cartesian system has metres where the numbers may be either.
    let plot = |system: i64| {
        let database = empty();
        layer(&database, "trees", "POINT", system, "");
        for number in 0..10 {
            add(&database, "trees", Some(&point(f64::from(number) * 5.5, 12.0)));
        }
        self::read(database, None).unwrap().coordinates
    };
    assert_eq!((plot(-1), plot(0)), (planar, degrees));
}

/// All files of a folder with their bytes.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let files = crate::support::program::listing(folder).into_iter();
    files.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

/// A database with a log beside it is read as it stands without the log, which is told, and nothing is written.
#[test]
fn files_that_other_programs_have_open_are_read_and_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(&folder, trees());
    let other = Connection::open(&path).unwrap();
    other.query_row("PRAGMA journal_mode = WAL", [], |_| Ok(())).unwrap();
    other.execute("INSERT INTO trees (geom) VALUES (?1)", [point(500_070.0, 5_400_080.0)]).unwrap();
    assert_eq!(std::fs::read(&path).unwrap()[18..20], [2, 2]);
    let before = contents(folder.path());
    assert_eq!(before.len(), 3);
    let inventory = read_inventory(&path, InventoryOptions::default()).unwrap();
    assert_eq!(inventory.rows.len(), 3);
    says(&inventory, &["the changes in", "trees.gpkg-wal are not read"]);
    assert!(contents(folder.path()) == before);
    drop(other);
    let inventory = read_inventory(&path, InventoryOptions::default()).unwrap();
    assert!(!inventory.notes.join("\n").contains("not read"));
    assert_eq!((inventory.rows.len(), contents(folder.path()).len()), (4, 1));
}

#[test]
fn databases_that_are_no_geopackages_are_told_so() {
    let database = Connection::open_in_memory().unwrap();
    database.execute_batch("CREATE TABLE trees (x REAL, y REAL)").unwrap();
    let text = refusal(database, None);
    assert!(text.contains("no GeoPackage") && text.contains("ogr2ogr"), "{text}");

    let database = empty();
    database.execute_batch("DROP TABLE gpkg_geometry_columns").unwrap();
    let text = refusal(database, None);
    assert!(text.contains("no layer of points (it has no layer)"), "{text}");

    let database = empty();
    announce(&database, "lost", "POINT", 25832);
    let text = refusal(database, None);
    assert!(text.contains("no column `geom`") && text.contains("`lost`"), "{text}");
}

/// Views that never end, or whose text does not.
#[test]
fn endless_views_are_refused() {
    for (view, word) in [
        (
            "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT geom, i FROM n CROSS JOIN trees",
            "more text",
        ),
        (
            "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT geom, (SELECT max(i) FROM n) FROM trees",
            "too many steps",
        ),
        (
            "SELECT trees.geom, replace(hex(zeroblob(400000)), '0', 'long') AS note FROM trees, trees t, trees u, trees v",
            "too big",
        ),
        ("SELECT trees.geom, hex(zeroblob(400000)) AS note FROM trees, trees t, trees u, trees v", "more text"),
    ] {
        let database = trees();
        database.execute_batch(&format!("CREATE VIEW endless AS {view}")).unwrap();
        announce(&database, "endless", "POINT", 25832);
        let text = refusal(database, Some("endless"));
        assert!(text.contains(word) && text.contains("export"), "{view}: {text}");
    }
}

/// Whatever is cut off or overwritten, there are trees or an error.
#[test]
fn damaged_geopackages_are_answered() {
    let whole = small();
    let read = |bytes: &[u8]| parse_inventory(bytes, "trees.gpkg", InventoryOptions::default());
    assert_eq!(read(&whole).unwrap().rows.len(), 3);
    for length in (16..whole.len()).step_by(101) {
        let error = read(&whole[..length]).unwrap_err();
        assert!(matches!(&error, ScatterError::Record { name, .. } if name == "trees.gpkg"), "{length}: {error}");
    }
    for at in (16..whole.len()).step_by(7) {
        for value in [0, 0x7F, 0xFF] {
            let mut wrong = whole.clone();
            wrong[at] = value;
            if let Ok(inventory) = read(&wrong) {
                assert!(inventory.rows.iter().all(|tree| tree.x.is_finite() && tree.y.is_finite()), "{at}");
            }
        }
    }
}
