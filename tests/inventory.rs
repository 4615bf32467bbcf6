//! Inventories as cities and foresters publish them: read as they are, and nothing dropped in silence.

use std::collections::BTreeMap;

use canopy::app::info;
use canopy::scatter::{
    Allometry, Coordinates, Ground, Inventory, InventoryOptions, InventorySpecies, InventoryTree, LengthUnit,
    ScatterError, Tree, parse_inventory, stand_from_inventory,
};
use glam::{DVec2, DVec3};

const ROWS: usize = 1000;

fn read(bytes: &[u8]) -> Inventory {
    parse_inventory(bytes, "trees.csv", InventoryOptions::default()).expect("an inventory")
}

fn parse(text: &str) -> Inventory {
    read(text.as_bytes())
}

#[track_caller]
fn says(inventory: &Inventory, words: &[&str]) {
    let all = inventory.notes.join("\n");
    for word in words {
        assert!(all.contains(word), "no `{word}` in:\n{all}");
    }
}

#[track_caller]
fn near(found: Option<f64>, expected: f64) {
    assert!(found.is_some_and(|value| (value - expected).abs() < 1e-9), "{found:?} instead of {expected}");
}

/// A table of this header with one line for each tree.
fn table(header: &str, row: impl Fn(usize) -> String) -> String {
    let mut text = format!("{header}\n");
    for n in 0..ROWS {
        text.push_str(&row(n));
        text.push('\n');
    }
    text
}

const LATIN: [&str; 4] = ["Quercus robur", "Picea abies", "Acer platanoides", "Tilia cordata"];

// ---------------------------------------------------------------- whole layouts, invented values

#[test]
fn the_layout_of_new_york() {
    let header = "tree_id,block_id,created_at,tree_dbh,stump_diam,curb_loc,status,health,spc_latin,spc_common,steward,\
                  guards,sidewalk,user_type,problems,root_stone,address,zipcode,zip_city,borough,latitude,longitude,x_sp,\
                  y_sp,council district,census tract,bin,bbl";
    let text = table(header, |n| {
        let (status, dbh, species) = match n % 50 {
            48 => ("Stump", 0, ""),
            49 => ("Dead", 9, ""),
            _ => ("Alive", 3 + n % 30, LATIN[n % 4]),
        };
        format!(
            "{},3,08/27/2015,{dbh},{},OnCurb,{status},Fair,{species},\"oak, common\",None,None,NoDamage,Volunteer,None,No,\
             \"{n} STREET\",10001,New York,Manhattan,{:.8},{:.8},{:.5},{:.5},{},,,{}",
            180_000 + n,
            if status == "Stump" { 14 } else { 0 },
            40.72 + 1e-5 * n as f64,
            -73.99 + 1e-5 * n as f64,
            986_000.0 + n as f64,
            200_000.0 + n as f64,
            n % 51,
            n
        )
    });
    let inventory = parse(&text);
    assert_eq!(inventory.coordinates, Coordinates::Geographic);
    assert_eq!(inventory.rows.len(), ROWS - 40);
    let first = &inventory.rows[0];
    assert_eq!((first.x, first.y, first.species.as_deref()), (-73.99, 40.72, Some("Quercus robur")));
    near(first.dbh_m, 3.0 * 0.0254);
    says(
        &inventory,
        &["40 row(s) are no living trees", "20 stumps, 20 dead", "inches", "`tree_dbh`", "not used: tree_id"],
    );
}

#[test]
fn the_layout_of_paris() {
    let header = "IDBASE;TYPE EMPLACEMENT;DOMANIALITE;ARRONDISSEMENT;COMPLEMENT ADRESSE;NUMERO;LIEU / ADRESSE;\
                  IDEMPLACEMENT;LIBELLE FRANCAIS;GENRE;ESPECE;VARIETE OU CULTIVAR;CIRCONFERENCE (cm);HAUTEUR (m);\
                  STADE DE DEVELOPPEMENT;REMARQUABLE;geo_point_2d";
    let text = table(header, |n| {
        let (genus, epithet) = [("Platanus", "x hispanica"), ("Quercus", "robur"), ("Acer", "sp.")][n % 3];
        format!(
            "{n};Arbre;Alignement;PARIS 12E ARRDT;;;RUE DE L'ÉTÉ;{n};Platane;{genus};{epithet};;{};{};Adulte;NON;{:.10}, {:.10}",
            40 + n % 200,
            4 + n % 20,
            48.85 + 1e-5 * n as f64,
            2.35 + 2e-5 * n as f64
        )
    });
    let inventory = parse(&text);
    assert_eq!((inventory.rows.len(), inventory.coordinates), (ROWS, Coordinates::Geographic));
    let [plane, oak, ..] = &inventory.rows[..] else { panic!("rows") };
    assert_eq!((plane.x, plane.y), (2.35, 48.85));
    assert_eq!(plane.species.as_deref(), Some("Platanus x hispanica"));
    assert_eq!(oak.species.as_deref(), Some("Quercus robur"));
    near(plane.dbh_m, 0.4 / std::f64::consts::PI);
    near(plane.height_m, 4.0);
    says(&inventory, &["`GENRE` and `ESPECE` joined", "ARRONDISSEMENT", "STADE DE DEVELOPPEMENT"]);
    assert!(!inventory.notes.iter().any(|note| note.contains("states no unit")), "{:?}", inventory.notes);
}

#[test]
fn the_layout_of_berlin() {
    let header = "gml_id,standortnr,kennzeich,namenr,art_bot,art_dtsch,gattung_deutsch,gattung,art_gruppe,strname,hausnr,\
                  zusatz,pflanzjahr,standalter,stammumfg,kronedurch,baumhoehe,bezirk,eigentuemer,geom";
    let text = table(header, |n| {
        format!(
            "s_wfs_baumbestand.{n},{n},04711,Straße,{},Stiel-Eiche,EICHE,QUERCUS,Laubbäume,Straße,{n},,1975,48,{},{:.1},{:.1},\
             Mitte,Land Berlin,POINT ({:.4} {:.4})",
            LATIN[n % 4],
            60 + n % 150,
            3.0 + (n % 10) as f64,
            6.0 + (n % 18) as f64,
            390_000.0 + n as f64,
            5_820_000.0 + 2.0 * n as f64
        )
    });
    let inventory = parse(&text);
    assert_eq!((inventory.rows.len(), inventory.coordinates), (ROWS, Coordinates::Planar));
    let first = &inventory.rows[0];
    assert_eq!((first.x, first.y, first.species.as_deref()), (390_000.0, 5_820_000.0, Some("Quercus robur")));
    near(first.dbh_m, 0.6 / std::f64::consts::PI);
    near(first.height_m, 6.0);
    says(
        &inventory,
        &["`stammumfg` states no unit", "centimetres", "`baumhoehe` states no unit", "metres", "kronedurch"],
    );
}

#[test]
fn the_layout_of_vienna() {
    let header = "FID,OBJECTID,SHAPE,BAUM_ID,DATENFUEHRUNG,BEZIRK,OBJEKT_STRASSE,GEBIET_GRUPPE,GATTUNG_ART,PFLANZJAHR,\
                  PFLANZJAHR_TXT,STAMMUMFANG,STAMMUMFANG_TXT,BAUMHOEHE,BAUMHOEHE_TXT,KRONENDURCHMESSER,\
                  KRONENDURCHMESSER_TXT,BAUMNUMMER,SE_ANNO_CAD_DATA";
    let text = table(header, |n| {
        let class = 1 + n % 4;
        let range = ["0-5 m", "6-10 m", "11-15 m", "16-20 m"][class - 1];
        let girth = 30 + n % 170;
        format!(
            "BAUMKATOGD.{n},{n},POINT (16.{:07} 48.2{:06}),{n},magistrat,19,Straße,Park,Acer platanoides 'Globosum' \
             (Kugelspitzahorn),1999,1999,{girth},{girth} cm,{class},{range},2,4-6 m,{n},",
            3_700_000 + 11 * n,
            10 * n
        )
    });
    let inventory = parse(&text);
    assert_eq!((inventory.rows.len(), inventory.coordinates), (ROWS, Coordinates::Geographic));
    let first = &inventory.rows[0];
    assert!((first.x - 16.37).abs() < 1e-9 && (first.y - 48.2).abs() < 1e-9, "{first:?}");
    near(first.dbh_m, 0.3 / std::f64::consts::PI);
    near(first.height_m, 2.5);
    near(inventory.rows[3].height_m, 18.0);
    says(&inventory, &["ranges, of which the middle is taken", "KRONENDURCHMESSER", "BAUMHOEHE_TXT"]);
    // The entry of the species without its cultivar serves.
    let maple = InventorySpecies {
        name: "Acer platanoides".to_owned(),
        variants: 0..1,
        plant_heights_m: vec![10.0],
        default_height_m: 10.0,
        allometry: Allometry::default(),
        trunk_radius_m: 0.2,
    };
    let local = |x: f64, y: f64| DVec3::new(1e5 * (x - 16.37), 0.0, 1e5 * (48.2 - y));
    let stand = stand_from_inventory(&inventory.rows, local, &Flat, &[maple], 1).expect("a stand");
    assert!(stand.warnings.unknown_species.is_empty(), "{}", stand.warnings);
    assert!(stand.warnings.to_string().contains("as acer platanoides (1000)"), "{}", stand.warnings);
}

#[test]
fn the_layout_of_melbourne() {
    let header = "CoM ID,Common Name,Scientific Name,Genus,Family,Diameter Breast Height,Year Planted,Date Planted,\
                  Age Description,Useful Life Expectency,Useful Life Expectency Value,Precinct,Located in,UploadDate,\
                  CoordinateLocation,Latitude,Longitude,Easting,Northing";
    let text = table(header, |n| {
        let name = LATIN[n % 4];
        let genus = name.split(' ').next().unwrap_or("");
        let (latitude, longitude) = (-37.8 - 1e-5 * n as f64, 144.95 + 1e-5 * n as f64);
        let dbh = if n % 10 == 9 { String::new() } else { (15 + n % 60).to_string() };
        format!(
            "{n},Some tree,{name},{genus},Fam,{dbh},2001,01/01/2001,Mature,31-60 years,60,,Park,01/01/2020,\"({latitude}, \
             {longitude})\",{latitude},{longitude},{:.2},{:.2}",
            320_000.0 + n as f64,
            5_815_000.0 - n as f64
        )
    });
    let inventory = parse(&text);
    assert_eq!((inventory.rows.len(), inventory.coordinates), (ROWS, Coordinates::Planar));
    let first = &inventory.rows[0];
    assert_eq!((first.x, first.y, first.species.as_deref()), (320_000.0, 5_815_000.0, Some("Quercus robur")));
    near(first.dbh_m, 0.15);
    assert_eq!(inventory.rows[9].dbh_m, None);
    says(&inventory, &["`Diameter Breast Height` states no unit", "centimetres", "Precinct", "Common Name"]);
    // A terrain in degrees takes the degrees.
    let options = InventoryOptions { positions: Some(Coordinates::Geographic), ..InventoryOptions::default() };
    let inventory = parse_inventory(text.as_bytes(), "trees.csv", options).expect("an inventory");
    assert_eq!((inventory.coordinates, inventory.rows[0].x), (Coordinates::Geographic, 144.95));
}

#[test]
fn layouts_of_further_cities_are_read() {
    // San Francisco, Vancouver, Montreal, Madrid, Turin, Amsterdam, London.
    for (text, species, dbh, height) in [
        (
            "TreeID,qLegalStatus,qSpecies,qAddress,PlantDate,DBH,PlotSize,XCoord,YCoord,Latitude,Longitude\n\
             1,DPW,Quercus agrifolia :: Coast Live Oak,5 St,,12,3x3,6000000,2100000,37.77,-122.42\n",
            "Quercus agrifolia :: Coast Live Oak",
            Some(12.0 * 0.0254),
            None,
        ),
        (
            "TREE_ID;GENUS_NAME;SPECIES_NAME;COMMON_NAME;HEIGHT_RANGE_ID;HEIGHT_RANGE;DIAMETER;geo_point_2d\n\
             1;QUERCUS;ROBUR;ENGLISH OAK;2;20' - 30';10;49.26, -123.11\n",
            "QUERCUS robur",
            Some(0.254),
            Some(25.0 * 0.3048),
        ),
        (
            "INV_TYPE,EMP_NO,ARROND,Essence_latin,Essence_fr,ESSENCE_ANG,DHP,Date_releve,Longitude,Latitude\n\
             H,1,Ahuntsic,Acer saccharinum,Érable argenté,Silver maple,30,2018-01-01,-73.65,45.54\n",
            "Acer saccharinum",
            Some(0.3),
            None,
        ),
        (
            "ESPECIE;NOMBRE CIENTÍFICO;PERÍMETRO (cm);ALTURA (m);X_ETRS89;Y_ETRS89\n\
             Plátano;Platanus x hispanica;94,2;12,5;440000,5;4474000,25\n",
            "Platanus x hispanica",
            Some(0.942 / std::f64::consts::PI),
            Some(12.5),
        ),
        (
            "genere,specie,diam_tronco,altezza,est,nord\nTilia,cordata,35 cm,12 m,394000,4990000\n",
            "Tilia cordata",
            Some(0.35),
            Some(12.0),
        ),
        (
            "Soortnaam;Boomhoogte;Stamdiameterklasse;LNG;LAT\nUlmus hollandica;e. 15 tot 18 m.;0,3 tot 0,5 m.;4,9;52,37\n",
            "Ulmus hollandica",
            Some(0.4),
            Some(16.5),
        ),
        (
            "gla_tree_name,taxon_name,common_name,age,height_m,spread_m,diameter_at_breast_height_cm,easting,northing\n\
             Oak,Quercus robur,Oak,Mature,14.5,6,42,530000,180000\n",
            "Quercus robur",
            Some(0.42),
            Some(14.5),
        ),
    ] {
        let inventory = parse(text);
        let tree = &inventory.rows[0];
        assert_eq!(tree.species.as_deref(), Some(species), "{text}");
        let close = |found: Option<f64>, expected: Option<f64>| match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() < 1e-9,
            (found, expected) => found == expected,
        };
        assert!(close(tree.dbh_m, dbh), "{:?} instead of {dbh:?}: {text}", tree.dbh_m);
        assert!(close(tree.height_m, height), "{:?} instead of {height:?}: {text}", tree.height_m);
    }
}

// ---------------------------------------------------------------- text

#[test]
fn separators_hints_comments_and_encodings_do_not_matter() {
    let plain = "x,y,species,height\n-68.08,-47.79,Höhe,6.5\n10,20,Eiche,7.25\n";
    let expected = parse(plain);
    let semicolons = plain.replace(',', ";").replace('.', ",");
    let variants = [
        format!("sep=;\r\n{}", semicolons.replace('\n', "\r\n")),
        format!("\u{feff}sep=;\r\n{}", semicolons.replace('\n', "\r\n")),
        format!("\"sep=;\"\n{semicolons}"),
        format!("sep=,\n{plain}"),
        plain.replace(',', "\t"),
        plain.replace(',', "|"),
        plain.replace(',', " "),
        plain.replace(',', "   "),
        format!("\n\n{plain}\n\n"),
        format!("# exported today\n# by hand\n{plain}"),
        format!("# {plain}"),
        format!("#{}", plain.replace(',', ";")),
        format!("Trees of the park\nas of 2020\n\n{plain}"),
        "x,y,species,height\n\"-68,08\",\"-47,79\",Höhe,\"6,5\"\n\"10,0\",\"20,0\",Eiche,\"7,25\"\n".to_owned(),
        "x,y,species,height,\n-68.08,-47.79,Höhe,6.5,\n10,20,Eiche,7.25,\n".to_owned(),
    ];
    let values = |inventory: &Inventory| {
        inventory.rows.iter().map(|row| (row.x, row.y, row.species.clone(), row.height_m)).collect::<Vec<_>>()
    };
    for text in &variants {
        assert_eq!(values(&parse(text)), values(&expected), "{text}");
    }
    let western: Vec<u8> = plain.chars().map(|c| u32::from(c) as u8).collect();
    let wide = |mark: bool, order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        let mark = if mark { "\u{feff}" } else { "" };
        format!("{mark}{plain}").encode_utf16().flat_map(order).collect()
    };
    for bytes in [
        western,
        wide(true, u16::to_le_bytes),
        wide(true, u16::to_be_bytes),
        wide(false, u16::to_le_bytes),
        wide(false, u16::to_be_bytes),
    ] {
        assert_eq!(values(&read(&bytes)), values(&expected));
    }
    let lines: Vec<u64> = parse(&format!("sep=,\n# note\n\n{plain}")).rows.iter().map(|row| row.line).collect();
    assert_eq!(lines, [5, 6]);
}

#[test]
fn single_bad_rows_are_left_out_counted_and_named() {
    let text = "x,y,species,dbh_cm\n1,1,a,20\n,,b,21\n3,3,c,22,surplus\n4,4,d\n5,north,e,23\n6,6,f,thick\n7,7,g,24\n8,8,h,\
                9000\n9,9,i,30\n10,10,j,31\n11,11,k,32\n0,0,l,33\n12,12,m,34\n13,13,n,35\n";
    let inventory = parse(text);
    let names: String = inventory.rows.iter().filter_map(|row| row.species.as_deref()).collect();
    assert_eq!(names, "afghijklmn");
    assert_eq!((inventory.rows[1].dbh_m, inventory.rows[3].dbh_m), (None, None));
    says(
        &inventory,
        &[
            "2 row(s) have another number of cells than the header's 4 and are left out; the first in line(s) 4, 5",
            "2 row(s) without a usable position are left out",
            "line 3, column `x`",
            "line 6, column `y`: \"north\" is not a number",
            "2 size(s) cannot be used",
            "line 7, column `dbh_cm`: \"thick\"",
            "\"9000\" is too large",
        ],
    );
    let strict = InventoryOptions { strict: true, ..InventoryOptions::default() };
    assert!(matches!(parse_inventory(text.as_bytes(), "t", strict), Err(ScatterError::BadValues { total: 5, .. })));
    let ragged = "x,y\n1,2\n3,4\n5,6,7\n";
    assert!(matches!(parse_inventory(ragged.as_bytes(), "t", strict), Err(ScatterError::Record { line: 4, .. })));
    assert_eq!(parse(ragged).rows.len(), 2);
    // Nothing right can be read from a table without any position.
    let nowhere = parse_inventory(b"x,y\n,\n,\n1,\n", "t", InventoryOptions::default());
    assert!(matches!(nowhere, Err(ScatterError::BadValues { .. })), "{nowhere:?}");
}

#[test]
fn files_that_are_no_text_are_named() {
    for (bytes, word) in [
        (&b"PK\x03\x04rest"[..], "spreadsheet"),
        (b"SQLite format 3\0rest", "GeoPackage"),
        (b"\x00\x00\x27\x0a\x00\x00", "shapefile"),
        (b"{\"type\":\"FeatureCollection\",\"features\":[]}", "no features"),
        (b"{\"type\":\"Feature\",\"geometry\":{\"type\":\"Polygon\",\"coordinates\":[]}}", "Polygon"),
        (b"{\"type\":", "JSON"),
    ] {
        let error = parse_inventory(bytes, "trees", InventoryOptions::default()).expect_err("no table").to_string();
        assert!(error.contains(word) && error.contains("export"), "{error}");
    }
}

// ---------------------------------------------------------------- positions

#[test]
fn positions_have_many_forms() {
    let degrees = [
        "lon,lat\n16.37,48.2\n",
        "lat;lng\n48,2;16,37\n",
        "Longitude (WGS84),Latitude (WGS84)\n16.37,48.2\n",
        "Längengrad;Breitengrad\n16,37;48,2\n",
        "X,Y\n16.370000,48.200000\n16.370100,48.200100\n16.370200,48.200200\n16.3703,48.2003\n16.3704,48.2004\n",
        "the_geom,id\nPOINT (16.37 48.2),1\n",
        "geo_shape,id\n\"{\"\"type\"\": \"\"Point\"\", \"\"coordinates\"\": [16.37, 48.2]}\",1\n",
        "location,id\n\"(48.2, 16.37)\",1\n",
        "Geo Point;id\n48.2,16.37;1\n",
        "lat,lon\n48°12'00\"N,16°22'12\"E\n",
    ];
    for text in degrees {
        let inventory = parse(text);
        assert_eq!(inventory.coordinates, Coordinates::Geographic, "{text}");
        let first = &inventory.rows[0];
        assert!((first.x - 16.37).abs() < 1e-9 && (first.y - 48.2).abs() < 1e-9, "{text}: {first:?}");
    }
    for text in [
        "x,y\n16.37,48.2\n16.5,48.1\n17.1,47.3\n22.9,50\n",
        "Rechtswert;Hochwert\n16,37;48,2\n",
        "UTM_X;UTM_Y\n16,37;48,2\n",
        "coord_x,coord_y\n16.37,48.2\n",
        "E,N\n16.37,48.2\n",
        "geom\nPOINT(16.37 48.2)\nPOINT(500 600)\n",
        "geom,id\nPOINT(16.37 48.2),1\nPOINT(50.5 60.25),2\nPOINT(0 0),3\n",
    ] {
        let inventory = parse(text);
        assert_eq!(inventory.coordinates, Coordinates::Planar, "{text}");
        assert_eq!((inventory.rows[0].x, inventory.rows[0].y), (16.37, 48.2), "{text}");
    }
    // Degrees beside them tell that the metres are feet.
    let mut text = "XCoord,YCoord,Latitude,Longitude\n".to_owned();
    for n in 0..10 {
        let metres = 50.0 * f64::from(n);
        text.push_str(&format!("{},{},{},-122.4\n", 6e6, 2e6 + metres / 0.3048, 37.77 + metres / 111_000.0));
    }
    let both = parse(&text);
    assert_eq!(both.coordinates, Coordinates::Planar);
    assert!((both.rows[9].y - both.rows[0].y - 450.0).abs() < 0.1, "{:?}", both.rows);
    let feet = parse("x_sp,y_sp\n1000000,200000\n");
    assert!((feet.rows[0].x - 304_800.609_6).abs() < 1e-3, "{:?}", feet.rows);
}

#[test]
fn unknown_and_stray_positions_do_not_move_the_stand() {
    let mut text = "x,y,species\n".to_owned();
    for n in 0..40 {
        text.push_str(&format!("{},{},oak\n", 500_000 + n, 5_400_000 + 2 * n));
    }
    text.push_str("0,0,oak\n0.0,0.0,oak\n9500000,5400000,oak\n");
    let inventory = parse(&text);
    assert_eq!(inventory.rows.len(), 40);
    says(
        &inventory,
        &["2 row(s) have the position 0, 0", "line(s) 42, 43", "1 tree(s) lie more than twenty times", "44"],
    );
    // A plot may have a tree at its corner.
    assert_eq!(parse("x,y\n0,0\n1,5\n7,3\n").rows.len(), 3);
}

// ---------------------------------------------------------------- sizes, species, status

#[test]
fn units_come_from_the_name_the_cell_the_option_or_the_values() {
    use LengthUnit::{Centimetres, Feet, Inches, Metres, Millimetres};
    let of = |header: &str, cells: [&str; 3]| {
        let rows: String = cells.iter().enumerate().map(|(n, cell)| format!("{n};{n};{cell}\n")).collect();
        parse(&format!("x;y;{header}\n{rows}"))
    };
    for (header, unit) in [
        ("dbh_mm", Millimetres),
        ("DBH (cm)", Centimetres),
        ("Diameter [m]", Metres),
        ("dbh_in", Inches),
        ("trunk diameter inches", Inches),
        ("dbh ft", Feet),
    ] {
        near(of(header, ["1", "1", "1"]).rows[0].dbh_m, unit.metres());
    }
    for (cells, metres, word) in [
        (["35 cm", "0.4 m", "14 in"], 0.35, ""),
        (["250", "310", "1200"], 0.25, "millimetres"),
        (["25", "31", "120"], 0.25, "centimetres"),
        (["0.25", "0.31", "1.2"], 0.25, "metres"),
    ] {
        let inventory = of("dbh", cells);
        near(inventory.rows[0].dbh_m, metres);
        assert_eq!(inventory.notes.iter().any(|note| note.contains("states no unit")), !word.is_empty());
        says(&inventory, &[word]);
    }
    for (cells, metres) in
        [(["12", "20", "31"], 12.0), (["1200", "2000", "3100"], 12.0), (["12 m", "40 ft", "9,5 m"], 12.0)]
    {
        near(of("height", cells).rows[0].height_m, metres);
    }
    near(of("height", ["70", "80", "90"]).rows[0].height_m, 70.0 * 0.3048);
    near(of("Umfang (cm)", ["100", "100", "100"]).rows[0].dbh_m, 1.0 / std::f64::consts::PI);
    near(of("girth", ["1,5", "2,25", "0,9"]).rows[0].dbh_m, 1.5 / std::f64::consts::PI);
    // Trees of 20 m that were 10 cm thick would be too slender.
    let rows: String = (0..12).map(|n| format!("{n},{n},{},{}\n", 8 + n % 4, 18 + n % 3)).collect();
    let slender = parse(&format!("x,y,dbh,height_m\n{rows}"));
    near(slender.rows[0].dbh_m, 8.0 * 0.0254);
    says(&slender, &["taken as inches"]);
    // The option decides, whatever the values look like.
    let options = InventoryOptions { dbh_unit: Some(Centimetres), ..InventoryOptions::default() };
    let stated = parse_inventory(b"x,y,dbh\n1,2,250\n3,4,310\n5,6,400\n", "t", options).expect("an inventory");
    near(stated.rows[0].dbh_m, 2.5);
    assert!(stated.notes.is_empty(), "{:?}", stated.notes);
}

#[test]
fn several_stems_are_one_tree_of_the_thickest() {
    for text in [
        "x,y,dbh1_cm,dbh2_cm,dbh3_cm\n1,2,20,35,\n",
        "x,y,dbh_cm,dbh_cm_2\n1,2,20,35\n",
        "x,y,dbh_cm\n1,2,20+35+10\n",
        "x,y,dbh_cm\n1,2,20/35\n",
    ] {
        let inventory = parse(text);
        near(inventory.rows[0].dbh_m, 0.35);
        says(&inventory, &["several stems"]);
    }
    near(parse("x,y,dbh_1994,dbh_2004\n1,2,20 cm,35 cm\n").rows[0].dbh_m, 0.35);
    // In rows of their own at one place.
    let rows = parse("x,y,dbh_cm,height_m\n1,2,20,10\n1,2,35,17\n1,2,30,15\n9,9,12,8\n").rows;
    let oak = InventorySpecies {
        name: "oak".to_owned(),
        variants: 0..1,
        plant_heights_m: vec![10.0],
        default_height_m: 10.0,
        allometry: Allometry::default(),
        trunk_radius_m: 0.2,
    };
    let stand = stand_from_inventory(&rows, |x, y| DVec3::new(x, 0.0, -y), &Flat, &[oak], 1).expect("a stand");
    let scales: Vec<f32> = stand.stand.trees.iter().map(|tree| tree.scale).collect();
    assert_eq!(scales, [1.7, 0.8]);
    assert_eq!(stand.warnings.duplicates, [(3, 2), (4, 2)]);
}

#[test]
fn what_is_no_living_tree_is_left_out() {
    for (header, cells) in [
        ("status", ["Alive", "Dead", "Stump", "Vacant site"]),
        ("Zustand", ["gut", "abgestorben", "Stubben", "gefällt"]),
        ("condition", ["Good", "Dead", "Stump only", "Removed"]),
        ("species", ["Quercus robur", "Standing dead tree", "Stump", "Planting site vacant"]),
        ("dead", ["no", "yes", "true", "1"]),
    ] {
        let rows: String = cells.iter().enumerate().map(|(n, cell)| format!("{n},{n},{cell}\n")).collect();
        let inventory = parse(&format!("x,y,{header}\n{rows}"));
        assert_eq!(inventory.rows.len(), 1, "{header}");
        says(&inventory, &["3 row(s) are no living trees", "line(s) 3, 4, 5"]);
    }
    assert_eq!(parse("x,y,condition\n1,2,\"Poor, dead branches\"\n3,4,fair\n").rows.len(), 2);
}

#[test]
fn letters_of_forest_plots_tell_the_dead() {
    let inventory = parse("x,y,status\n1,2,A\n3,4,D\n5,6,A\n");
    assert_eq!(inventory.rows.len(), 2);
    says(&inventory, &["1 dead trees"]);
    assert_eq!(parse("x,y,condition\n1,2,B\n3,4,D\n5,6,C\n").rows.len(), 3, "grades are no letters of life");
}

#[test]
fn one_year_and_one_variant_are_shown() {
    let options = |year: Option<i32>| InventoryOptions { year, ..InventoryOptions::default() };
    let text = "x,y,year,dbh_cm\n1,2,2000,10\n5,6,2000,11\n1,2,2010,15\n5,6,2010,16\n9,9,2020,5\n1,2,2020,20\n";
    let read = |year: Option<i32>| parse_inventory(text.as_bytes(), "t", options(year)).expect("an inventory");
    let thick = |inventory: &Inventory| {
        inventory.rows.iter().map(|row| (100.0 * row.dbh_m.unwrap_or(0.0)).round()).collect::<Vec<_>>()
    };
    assert_eq!(thick(&read(None)), [5.0, 20.0]);
    assert_eq!(thick(&read(Some(2000))), [10.0, 11.0]);
    assert_eq!(thick(&read(Some(2015))), [15.0, 16.0]);
    assert_eq!(thick(&read(Some(1900))), [10.0, 11.0]);
    says(&read(None), &["of the years 2000, 2010, 2020 in `year`, 2020 is shown", "--year"]);
    // Years of planting are no surveys.
    assert_eq!(parse("x,y,year\n1,2,1990\n3,4,2001\n5,6,2005\n").rows.len(), 3);
    assert_eq!(parse("x,y,Pflanzjahr\n1,2,1990\n1,3,2001\n").rows.len(), 2);
    assert_eq!(parse("x;y;Aufnahmejahr\n1;2;1990\n1;3;2001\n").rows.len(), 1);

    let text = "x,y,scenario\n1,2,before\n3,4,before\n1,2,after\n";
    let read =
        |variant| parse_inventory(text.as_bytes(), "t", InventoryOptions { variant, ..InventoryOptions::default() });
    assert_eq!(read(None).expect("an inventory").rows.len(), 2);
    assert_eq!(read(Some("After")).expect("an inventory").rows.len(), 1);
    says(
        &read(Some("never")).expect("an inventory"),
        &["of the variants before, after", "there is no `never`", "--variant"],
    );
}

#[test]
fn a_tree_keeps_its_look_and_its_place_from_survey_to_survey() {
    let text = "x,y,survey_year,height_m\n9,9,2000,12\n1,2,2000,10\n5,6,2000,11\n5,6,2010,14\n1,2,2010,13\n30,3,2010,5\n\
                0,0,2010,dead\n";
    let read = |year: i32| {
        let options = InventoryOptions { year: Some(year), ..InventoryOptions::default() };
        parse_inventory(text.as_bytes(), "t", options).expect("an inventory")
    };
    let pine = InventorySpecies {
        name: "pine".to_owned(),
        variants: 0..1000,
        plant_heights_m: vec![10.0; 1000],
        default_height_m: 10.0,
        allometry: Allometry::default(),
        trunk_radius_m: 0.2,
    };
    let looks = |rows: &[InventoryTree]| {
        let stand = stand_from_inventory(rows, |x, y| DVec3::new(x, 0.0, -y), &Flat, std::slice::from_ref(&pine), 1);
        let look = |tree: &Tree| (tree.yaw.to_bits(), tree.tint.to_bits(), tree.variant);
        let trees = stand.expect("a stand").stand.trees;
        trees.iter().map(|tree| (tree.position.x as i32, look(tree))).collect::<BTreeMap<_, _>>()
    };
    let (early, late) = (read(2000), read(2010));
    let (before, after) = (looks(&early.rows), looks(&late.rows));
    assert_eq!((before.len(), after.len()), (3, 4));
    assert!(before[&1] == after[&1] && before[&5] == after[&5], "{before:?} {after:?}");
    assert!(before[&1] != before[&5] && before[&9] != before[&5] && after[&30] != after[&5]);
    // By their numbers in the list they would be others.
    let unnumbered: Vec<InventoryTree> =
        late.rows.iter().map(|row| InventoryTree { place: None, ..row.clone() }).collect();
    assert!(looks(&unnumbered)[&5] != before[&5]);
    // What stands at the edge in one survey alone moves no middle.
    assert_eq!(early.extent, Some((DVec2::ZERO, DVec2::new(30.0, 9.0))));
    assert_eq!(late.extent, early.extent);
    let single = parse("x,y\n1,2\n3,4\n");
    assert!(single.extent.is_none() && single.rows.iter().all(|row| row.place.is_none()));
}

#[test]
fn names_of_species_are_joined_and_found() {
    let species = |text: &str| parse(text).rows[0].species.clone().unwrap_or_default();
    assert_eq!(species("x,y,genus,species\n1,2,Quercus,robur\n"), "Quercus robur");
    assert_eq!(species("x,y,GENUS,SPECIES\n1,2,QUERCUS,ROBUR\n"), "QUERCUS robur");
    assert_eq!(species("x,y,Gattung,Art\n1,2,Quercus,Quercus robur\n"), "Quercus robur");
    assert_eq!(species("x,y,genus\n1,2,Quercus\n"), "Quercus");
    assert_eq!(species("x,y,common_name\n1,2,oak\n"), "oak");
    assert_eq!(species("x,y,common_name,latin_name\n1,2,oak,Quercus robur\n"), "Quercus robur");
    assert_eq!(species("x,y,Baumart\n1,2,Stieleiche\n"), "Stieleiche");
    let unknown = parse("x,y,height_m,wood\n1,2,12,oak\n");
    says(&unknown, &["not used: wood", "none holds the species"]);
}

#[test]
fn features_of_geojson_are_trees() {
    let feature = |x: f64, y: f64, more: &str| {
        format!(
            "{{\"type\":\"Feature\",\"geometry\":{{\"type\":\"Point\",\"coordinates\":[{x},{y}]}},\"properties\":{{{more}}}}}"
        )
    };
    let first =
        feature(16.37, 48.2, "\"art_bot\":\"Quercus robur\",\"stammumfg\":\"100 cm\",\"baumhoehe\":12.5,\"id\":7");
    let second = feature(16.38, 48.21, "\"art_bot\":null,\"dead\":false");
    let nowhere = "{\"type\":\"Feature\",\"geometry\":null,\"properties\":{}}".to_owned();
    let collection = |crs: &str, features: &[&String]| {
        let list = features.iter().map(|text| text.as_str()).collect::<Vec<_>>().join(",");
        format!("{{\"type\":\"FeatureCollection\",{crs}\"features\":[{list}]}}")
    };
    for text in [
        collection("", &[&first, &second, &nowhere]),
        format!("\u{feff}\n{}", collection("", &[&first, &second, &nowhere])),
        format!("{first}\n{second}\n{nowhere}\n"),
    ] {
        let inventory = parse(&text);
        assert_eq!((inventory.rows.len(), inventory.coordinates), (2, Coordinates::Geographic), "{text}");
        let oak = &inventory.rows[0];
        assert_eq!((oak.x, oak.y, oak.line, oak.species.as_deref()), (16.37, 48.2, 1, Some("Quercus robur")));
        near(oak.height_m, 12.5);
        near(oak.dbh_m, 1.0 / std::f64::consts::PI);
        says(&inventory, &["1 row(s) without a usable position", "not used: id"]);
    }
    let crs = "\"crs\":{\"type\":\"name\",\"properties\":{\"name\":\"urn:ogc:def:crs:EPSG::25833\"}},";
    let metres = parse(&collection(crs, &[&feature(390_000.0, 5_820_000.0, "\"art\":\"Quercus\"")]));
    assert_eq!(metres.coordinates, Coordinates::Planar);
    says(&metres, &["EPSG:25833"]);
    let esri = "{\"spatialReference\":{\"wkid\":4326},\"features\":[{\"attributes\":{\"DBH_CM\":30},\"geometry\":{\"x\":8,\"y\":47}}]}";
    near(parse(esri).rows[0].dbh_m, 0.3);
}

// ---------------------------------------------------------------- on a terrain

/// Level ground everywhere.
struct Flat;

impl Ground for Flat {
    fn height(&self, _x: f64, _z: f64) -> f64 {
        0.0
    }

    fn slope(&self, _x: f64, _z: f64) -> f32 {
        0.0
    }
}

/// What is said of a scene with this inventory and anchor on this terrain.
fn described(terrain: &str, table: &str, anchor: &str, place: &str) -> Result<String, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = format!(
        "(terrain: {terrain}, species: [(name: \"oak\", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000, seed: \
         1))], trees: Inventory(path: \"trees.csv\", anchor: {anchor}), place: ({place}))"
    );
    std::fs::write(folder.path().join("scene.ron"), scene).expect("a temporary file");
    std::fs::write(folder.path().join("trees.csv"), table).expect("a temporary file");
    let grid: String = (0..21).map(|_| "300 301 302 303 304 305 306 307 308 309 310\n").collect();
    let utm = format!("ncols 11\nnrows 21\nxllcenter 500000\nyllcenter 5394000\ncellsize 10\n{grid}");
    let degrees = format!("ncols 11\nnrows 21\nxllcenter 15.0\nyllcenter 48.7\ncellsize 0.0001\n{grid}");
    std::fs::write(folder.path().join("utm.asc"), utm).expect("a temporary file");
    std::fs::write(folder.path().join("degrees.asc"), degrees).expect("a temporary file");
    info(&folder.path().join("scene.ron")).map_err(|error| error.to_string())
}

#[test]
fn degrees_and_metres_meet_on_any_terrain() {
    let utm = "File(path: \"utm.asc\", coordinates: Utm(zone: 33))";
    let degrees = "File(path: \"degrees.asc\", coordinates: Geographic)";
    let flat = "Flat(size: 400)";
    let lonlat = "lon,lat\n15.0003,48.7002\n15.0006,48.7006\n";
    let metres = "x,y\n500020,5394130\n500050,5394170\n";
    for (terrain, table, anchor, place) in [
        (utm, lonlat, "Terrain", ""),
        (utm, lonlat, "TerrainCentre", ""),
        (utm, metres, "Terrain", ""),
        (degrees, lonlat, "Terrain", ""),
        (degrees, metres, "Terrain", ""),
        (degrees, lonlat, "StandCentre", ""),
        (flat, lonlat, "StandCentre", "latitude: 10, longitude: 10"),
        (flat, lonlat, "TerrainCentre", "latitude: 48.7, longitude: 15.0"),
        (flat, metres, "StandCentre", "latitude: 10, longitude: 10"),
    ] {
        let text =
            described(terrain, table, anchor, place).unwrap_or_else(|error| panic!("{terrain}, {anchor}: {error}"));
        assert!(text.contains("2 from the inventory"), "{terrain}, {anchor}, {table}: {text}");
    }
}

#[test]
fn a_stand_outside_names_both_extents_and_the_anchors_that_fit() {
    let utm = "File(path: \"utm.asc\", coordinates: Utm(zone: 33))";
    let metres = "x,y\n500020,5394040\n500050,5394100\n";
    let error = described(utm, metres, "TerrainCentre", "").expect_err("outside");
    for words in [
        "none of its 2 trees",
        "x 500020 to 500050",
        "x 500000 to 500100",
        "`anchor: StandCentre`",
        "`anchor: Terrain`",
    ] {
        assert!(error.contains(words), "no `{words}` in: {error}");
    }
    let error = described("Flat(size: 50)", "x,y\n500,0\n900,900\n", "TerrainCentre", "latitude: 1, longitude: 1");
    assert!(error.expect_err("outside").contains("no other `anchor`"));
    let exchanged = described(utm, "y,x\n500020,5394040\n500050,5394100\n", "Terrain", "").expect_err("outside");
    assert!(exchanged.contains("if x and y were exchanged"), "{exchanged}");
    // Most outside is a warning with the same words.
    let text = described("Flat(size: 100)", "x,y\n0,0\n90,90\n95,99\n", "TerrainCentre", "latitude: 1, longitude: 1");
    let text = text.expect("one tree stands");
    assert!(text.contains("2 tree(s) outside the terrain") && text.contains("`anchor: SouthWest`"), "{text}");
}
