//! What the name of a column means, in English, German, French, Spanish, Italian, Dutch and Latin.
//!
//! A name is split into words (`DBH (cm)`, `dbh_cm` and `treeDbhCm` have the word `dbh`), letters lose their accents, and
//! the words are looked up. Compound words (`Stammumfang`, `boomhoogte`) are found by their parts.

use super::LengthUnit;
use crate::math;

/// Letters without accents, in lower case: `Höhe` becomes `hohe`.
pub(super) fn folded(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars().flat_map(char::to_lowercase) {
        match c {
            'á' | 'à' | 'â' | 'ä' | 'ã' | 'å' => plain.push('a'),
            'é' | 'è' | 'ê' | 'ë' => plain.push('e'),
            'í' | 'ì' | 'î' | 'ï' => plain.push('i'),
            'ó' | 'ò' | 'ô' | 'ö' | 'õ' | 'ø' => plain.push('o'),
            'ú' | 'ù' | 'û' | 'ü' => plain.push('u'),
            'ç' => plain.push('c'),
            'ñ' => plain.push('n'),
            'ß' => plain.push_str("ss"),
            'œ' => plain.push_str("oe"),
            'æ' => plain.push_str("ae"),
            // Combining accents, as some systems write them.
            '\u{300}'..='\u{36f}' => {}
            c => plain.push(c),
        }
    }
    plain
}

/// The words of a name, [folded].
pub(super) fn words(name: &str) -> Vec<String> {
    math::names::words(name, folded)
}

/// A quantity that a column may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Diameter of the trunk.
    Diameter,
    /// Circumference of the trunk.
    Girth,
    /// Height of the tree.
    Height,
    /// Scientific name, genus and epithet.
    ScientificName,
    /// A name of which it is not said whether it is scientific.
    Species,
    /// Name in the language of the country.
    CommonName,
    /// Genus alone.
    Genus,
    /// Whether the tree lives or is there at all.
    Status,
}

/// What a name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Meaning {
    pub quantity: Quantity,
    /// Of two columns with the same quantity the lower one is used.
    pub rank: u8,
    /// The unit of a length, if the name states one.
    pub unit: Option<LengthUnit>,
    /// Whether the cells are numbers of classes rather than measurements, unless they have units.
    pub classes: bool,
}

/// The unit that a word names.
pub(super) fn unit_of(word: &str) -> Option<LengthUnit> {
    Some(match word {
        "m" | "meter" | "meters" | "metre" | "metres" | "metern" | "metro" | "metros" | "metri" | "mt" | "mts"
        | "mtr" => LengthUnit::Metres,
        "dm" => LengthUnit::Decimetres,
        "cm" | "cms" | "centimeter" | "centimeters" | "centimetre" | "centimetres" | "zentimeter" | "zentimetern"
        | "centimetro" | "centimetros" | "centimetri" => LengthUnit::Centimetres,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" | "millimetern" | "milimetros"
        | "millimetri" => LengthUnit::Millimetres,
        "in" | "inch" | "inches" | "zoll" | "pouce" | "pouces" | "pulgada" | "pulgadas" | "pollici" => {
            LengthUnit::Inches
        }
        "ft" | "foot" | "feet" | "fuss" | "pied" | "pieds" | "pie" | "pies" | "piedi" | "voet" => LengthUnit::Feet,
        _ => return None,
    })
}

/// The last unit among `words`; one behind a number (`at 1.3 m`) is where was measured, not in what.
fn stated_unit(words: &[String]) -> Option<LengthUnit> {
    let number = |word: &str| word.chars().all(|c| c.is_ascii_digit());
    let mut found = None;
    for (index, word) in words.iter().enumerate() {
        let behind_number = index.checked_sub(1).and_then(|at| words.get(at)).is_some_and(|word| number(word));
        if !behind_number && let Some(unit) = unit_of(word) {
            found = Some(unit);
        }
    }
    found
}

const CROWN: [&str; 11] =
    ["crown", "canopy", "spread", "kron", "couronne", "houppier", "copa", "chiom", "kroon", "foliage", "capcada"];
/// Words of columns about a tree that hold no measure of it.
const ASIDE: [&str; 58] = [
    "id",
    "nr",
    "no",
    "num",
    "code",
    "key",
    "year",
    "jahr",
    "annee",
    "ano",
    "anno",
    "jaar",
    "date",
    "datum",
    "fecha",
    "data",
    "method",
    "methode",
    "unit",
    "units",
    "einheit",
    "unite",
    "quality",
    "accuracy",
    "genauigkeit",
    "source",
    "count",
    "number",
    "anzahl",
    "nombre",
    "stump",
    "plot",
    "pit",
    "soil",
    "guard",
    "elevation",
    "elev",
    "altitude",
    "altitud",
    "asl",
    "nn",
    "nhn",
    "terrain",
    "ground",
    "gelande",
    "gelaende",
    "base",
    "clear",
    "merch",
    "log",
    "volume",
    "volumen",
    "price",
    "url",
    "photo",
    "time",
    "user",
    "by",
];
const CLASSES: [&str; 14] = [
    "class",
    "klasse",
    "classe",
    "clase",
    "range",
    "group",
    "gruppe",
    "groupe",
    "grupo",
    "gruppo",
    "category",
    "categorie",
    "categoria",
    "kategorie",
];

fn any_word(words: &[String], list: &[&str]) -> bool {
    words.iter().any(|word| list.contains(&word.as_str()))
}

fn contains_any(text: &str, list: &[&str]) -> bool {
    list.iter().any(|part| text.contains(part))
}

/// What a column of this name holds; `None` if the name says nothing.
pub(super) fn meaning(name: &str) -> Option<Meaning> {
    let words = words(name);
    let whole = words.concat();
    length(&words, &whole).or_else(|| species(&words, &whole)).or_else(|| status(&words))
}

fn length(words: &[String], whole: &str) -> Option<Meaning> {
    let classes = any_word(words, &CLASSES) || contains_any(whole, &["klasse", "classe"]);
    if contains_any(whole, &CROWN) || (any_word(words, &ASIDE) && !contains_any(whole, &["txt", "text"])) {
        return None;
    }
    // A short name may have its unit at its end: `dbhcm`.
    let (stem, joined) = match words {
        [only] => ["cm", "mm", "in", "ft", "m"]
            .iter()
            .find_map(|unit| {
                let stem = only.strip_suffix(unit)?;
                (SHORT.contains(&stem) || stem == "height" || stem == "hoehe").then(|| (stem.to_owned(), unit_of(unit)))
            })
            .unwrap_or_else(|| (only.clone(), None)),
        _ => (String::new(), None),
    };
    let unit = joined.or_else(|| stated_unit(words));
    let trunk = contains_any(whole, &["trunk", "stem", "stam", "tronc", "fust", "bole", "breast", "brust", "poitrine"]);
    let word = |list: &[&str]| any_word(words, list) || list.contains(&stem.as_str());
    let without_digits = |word: &String| word.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
    let bare: Vec<String> = words.iter().map(without_digits).collect();
    let meaning = |quantity, rank| Some(Meaning { quantity, rank: rank + 3 * u8::from(classes), unit, classes });
    let girth = [
        "circumference",
        "umfang",
        "stammumf",
        "circonf",
        "circunferencia",
        "perimetr",
        "perimeter",
        "omtrek",
        "girth",
    ];
    if contains_any(whole, &girth) || word(&["gbh", "cbh", "circ", "cap", "umf", "stu"]) {
        return meaning(Quantity::Girth, u8::from(!trunk));
    }
    if any_word(&bare, &BREAST) || BREAST.contains(&stem.as_str()) || whole.ends_with("dbh") {
        return meaning(Quantity::Diameter, 0);
    }
    let diameter = ["diameter", "durchmesser", "diametre", "diametro", "doorsnede"];
    if contains_any(whole, &diameter) || words.iter().any(|word| word.starts_with("diam")) || word(&["dia"]) {
        return meaning(Quantity::Diameter, if trunk { 0 } else { 1 });
    }
    let measured_at = ["breast", "brust", "poitrine", "pecho", "mess", "measure", "hohenlage", "seehohe", "meeres"];
    if contains_any(whole, &measured_at) {
        return None;
    }
    let height = ["height", "hoehe", "hohe", "hauteur", "altura", "altezza", "hoogte"];
    if contains_any(whole, &height) || word(&["h", "ht", "hgt", "haut"]) {
        let tree = contains_any(whole, &["tree", "baum", "arbre", "arbol", "albero", "boom", "total", "gesamt"]);
        let exact = words.len() == 1 || unit.is_some() && words.len() == 2;
        return meaning(Quantity::Height, if tree { 0 } else { u8::from(!exact) });
    }
    None
}

/// Short names of the diameter at breast height.
const BREAST: [&str; 6] = ["dbh", "bhd", "dhp", "dap", "d130", "dbhob"];
/// Short names to which a unit may be joined.
const SHORT: [&str; 8] = ["dbh", "bhd", "dhp", "dap", "diam", "circ", "ht", "h"];

fn species(words: &[String], whole: &str) -> Option<Meaning> {
    let aside = [
        "id",
        "nr",
        "no",
        "num",
        "number",
        "count",
        "year",
        "date",
        "family",
        "familie",
        "famille",
        "familia",
        "famiglia",
        "order",
        "authority",
        "author",
        "group",
        "gruppe",
        "url",
        "rank",
    ];
    if any_word(words, &aside) || whole.is_empty() {
        return None;
    }
    let meaning = |quantity, rank| Some(Meaning { quantity, rank, unit: None, classes: false });
    let code = u8::from(any_word(words, &["code", "cod", "kurz", "abbr", "short"]));
    let common = [
        "common",
        "vernac",
        "vulg",
        "comun",
        "deutsch",
        "dtsch",
        "francais",
        "nederlands",
        "espanol",
        "castell",
        "italian",
        "popular",
        "english",
        "cmmn",
    ];
    let genus = ["genus", "gattung", "genre", "genero", "genere", "geslacht"];
    let kind = [
        "species",
        "spec",
        "spp",
        "sp",
        "spc",
        "especie",
        "espece",
        "specie",
        "art",
        "soort",
        "baumart",
        "boomsoort",
        "epithet",
        "essence",
        "essenza",
    ];
    let has_genus = any_word(words, &genus) || contains_any(whole, &["gattung", "genus"]);
    let has_kind = any_word(words, &kind) || contains_any(whole, &["species", "baumart", "boomsoort", "soortnaam"]);
    if contains_any(whole, &common) || any_word(words, &["fr", "de", "nl", "es"]) && (has_genus || has_kind) {
        let named = has_kind || contains_any(whole, &["name", "nom", "libelle", "naam"]);
        return (named || words.len() == 1 || has_genus)
            .then(|| meaning(Quantity::CommonName, u8::from(has_genus) + code))
            .flatten();
    }
    if has_genus && !has_kind {
        return meaning(Quantity::Genus, code);
    }
    let scientific =
        ["scientific", "latin", "latein", "botan", "wissenschaft", "cientific", "wetenschap", "taxon", "sciname"];
    let latin = contains_any(whole, &scientific)
        || any_word(words, &["bot", "sci", "qspecies"])
        || (whole.ends_with("lat") && contains_any(whole, &["baum", "art", "name"]));
    if latin || (has_genus && has_kind) {
        return meaning(Quantity::ScientificName, code);
    }
    let exact = ["treename", "baumname", "namenlat", "treetype", "boomnaam", "speciesname"];
    if has_kind || exact.contains(&whole) {
        return meaning(Quantity::Species, 2 * code + u8::from(words.len() > 2));
    }
    None
}

fn status(words: &[String]) -> Option<Meaning> {
    let list = [
        "status",
        "condition",
        "health",
        "zustand",
        "vitalitat",
        "vitalitaet",
        "vitality",
        "etat",
        "estado",
        "stato",
        "conditie",
        "kondition",
        "situation",
        "alive",
        "dead",
        "removed",
        "felled",
        "stump",
        "vacant",
        "lebend",
        "tot",
    ];
    let rank = u8::from(!any_word(words, &["status", "alive", "dead", "removed", "felled", "vacant"]));
    (any_word(words, &list) && !any_word(words, &["diam", "diameter", "date", "datum", "year", "id"]))
        .then_some(Meaning { quantity: Quantity::Status, rank, unit: None, classes: false })
}

/// What a row stands for that is no living tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum NoTree {
    /// A place without a tree, or whose tree was felled.
    Vacant,
    /// A stump.
    Stump,
    /// A dead tree.
    Dead,
}

/// Whether a cell of a species or of a status says that there is no living tree: all of its words are about that.
pub(super) fn no_tree(cell: &str) -> Option<NoTree> {
    const DEAD: [&str; 14] = [
        "dead",
        "tot",
        "toter",
        "abgestorben",
        "mort",
        "morte",
        "muerto",
        "muerta",
        "morto",
        "morta",
        "dood",
        "dode",
        "snag",
        "deceased",
    ];
    const STUMP: [&str; 15] = [
        "stump",
        "stumps",
        "stubben",
        "stubbe",
        "baumstumpf",
        "stumpf",
        "baumstubben",
        "wurzelstock",
        "souche",
        "tocon",
        "ceppo",
        "ceppaia",
        "stobbe",
        "stronk",
        "boomstronk",
    ];
    const VACANT: [&str; 34] = [
        "vacant",
        "vacancy",
        "empty",
        "unplanted",
        "leerstelle",
        "leer",
        "unbesetzt",
        "vide",
        "vacio",
        "vacia",
        "vuoto",
        "vuota",
        "leeg",
        "lege",
        "removed",
        "felled",
        "gefallt",
        "gefaellt",
        "gerodet",
        "entfernt",
        "abattu",
        "abattue",
        "supprime",
        "talado",
        "apeado",
        "abbattuto",
        "abbattuta",
        "rimosso",
        "geveld",
        "gerooid",
        "verwijderd",
        "retired",
        "nonexistent",
        "planting",
    ];
    const FILLER: [&str; 34] = [
        "tree",
        "trees",
        "site",
        "sites",
        "standing",
        "only",
        "unknown",
        "spot",
        "space",
        "place",
        "well",
        "available",
        "baum",
        "baumscheibe",
        "standort",
        "arbre",
        "emplacement",
        "arbol",
        "alcorque",
        "albero",
        "posto",
        "boom",
        "plantplaats",
        "for",
        "planted",
        "to",
        "be",
        "potential",
        "location",
        "and",
        "the",
        "was",
        "is",
        "new",
    ];
    let words = words(cell);
    if words.is_empty() || words.len() > 5 {
        return None;
    }
    let has = |list: &[&str]| any_word(&words, list);
    let known = |word: &String| [&DEAD[..], &STUMP, &VACANT, &FILLER].iter().any(|list| list.contains(&word.as_str()));
    if !words.iter().all(known) {
        return None;
    }
    let planting = words.first().is_some_and(|word| word == "planting") && words.len() == 1;
    if has(&STUMP) {
        Some(NoTree::Stump)
    } else if has(&DEAD) {
        Some(NoTree::Dead)
    } else if has(&VACANT) && !planting {
        Some(NoTree::Vacant)
    } else {
        None
    }
}

/// What a column named after a question, such as `dead` or `alive`, answers.
pub(super) fn flagged(name: &str, cell: &str) -> Option<NoTree> {
    let yes = ["yes", "y", "true", "t", "1", "ja", "j", "oui", "si", "x"].contains(&folded(cell.trim()).as_str());
    let no = ["no", "n", "false", "f", "0", "nein", "non", "nee"].contains(&folded(cell.trim()).as_str());
    let words = words(name);
    let has = |list: &[&str]| any_word(&words, list);
    if has(&["dead", "tot"]) && yes || has(&["alive", "lebend"]) && no {
        Some(NoTree::Dead)
    } else if has(&["stump"]) && yes {
        Some(NoTree::Stump)
    } else if has(&["removed", "felled", "vacant"]) && yes {
        Some(NoTree::Vacant)
    } else {
        None
    }
}

/// Words for the two axes of a position, in the order of preference.
pub(super) struct AxisWords {
    pub x: &'static str,
    pub y: &'static str,
    pub geographic: bool,
}

const fn axes(x: &'static str, y: &'static str, geographic: bool) -> AxisWords {
    AxisWords { x, y, geographic }
}

/// Pairs of words; the first pair that a table has is used.
pub(super) const AXES: [AxisWords; 45] = [
    axes("x", "y", false),
    axes("gx", "gy", false),
    axes("easting", "northing", false),
    axes("eastings", "northings", false),
    axes("east", "north", false),
    axes("rechtswert", "hochwert", false),
    axes("ostwert", "nordwert", false),
    axes("ost", "nord", false),
    axes("este", "norte", false),
    axes("est", "nord", false),
    axes("rw", "hw", false),
    axes("e", "n", false),
    axes("xcoord", "ycoord", false),
    axes("coordx", "coordy", false),
    axes("xkoord", "ykoord", false),
    axes("koordx", "koordy", false),
    axes("xcoordinate", "ycoordinate", false),
    axes("xkoordinate", "ykoordinate", false),
    axes("pointx", "pointy", false),
    axes("posx", "posy", false),
    axes("utmx", "utmy", false),
    axes("rdx", "rdy", false),
    axes("xutm", "yutm", false),
    axes("xpos", "ypos", false),
    axes("geox", "geoy", false),
    axes("lon", "lat", true),
    axes("lng", "lat", true),
    axes("long", "lat", true),
    axes("longitude", "latitude", true),
    axes("longitud", "latitud", true),
    axes("longitudine", "latitudine", true),
    axes("laengengrad", "breitengrad", true),
    axes("langengrad", "breitengrad", true),
    axes("laenge", "breite", true),
    axes("lange", "breite", true),
    axes("lengtegraad", "breedtegraad", true),
    axes("lengte", "breedte", true),
    axes("decimallongitude", "decimallatitude", true),
    axes("geolon", "geolat", true),
    axes("geolong", "geolat", true),
    axes("gpslon", "gpslat", true),
    axes("gpslong", "gpslat", true),
    axes("xlon", "ylat", true),
    axes("lon", "latitude", true),
    axes("long", "latitude", true),
];

/// Whether a name may be that of a column with both coordinates in one cell.
pub(super) fn may_be_place(name: &str) -> bool {
    let list = [
        "geo",
        "point",
        "coord",
        "location",
        "latlng",
        "latlon",
        "position",
        "geom",
        "wkt",
        "shape",
        "koord",
        "standort",
        "lage",
        "place",
        "ubicacion",
        "localisation",
        "locatie",
    ];
    contains_any(&words(name).concat(), &list)
}

/// Tables whose layout is known to measure in inches and feet: names that must all be there.
const IN_INCHES: [&[&str]; 7] = [
    // New York, street tree census.
    &["tree dbh", "spc latin"],
    &["tree dbh", "stump diam"],
    // San Francisco, street tree list.
    &["q species", "dbh"],
    // Vancouver, public trees.
    &["height range id", "diameter"],
    // Washington, urban forestry street trees.
    &["sci nm", "dbh"],
    &["cmmn nm", "dbh"],
    // Seattle, combined tree point.
    &["unitid", "diam"],
];

/// Whether a header is that of a table known to measure in inches and feet.
pub(super) fn is_in_inches<'a>(header: impl Iterator<Item = &'a str>) -> bool {
    let names: Vec<String> = header.map(|name| words(name).join(" ")).collect();
    let has = |wanted: &&str| names.iter().any(|name| name == wanted);
    IN_INCHES.iter().any(|layout| layout.iter().all(has))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(name: &str) -> Option<(Quantity, Option<LengthUnit>)> {
        meaning(name).map(|meaning| (meaning.quantity, meaning.unit))
    }

    #[test]
    fn names_of_many_tables_are_understood() {
        use LengthUnit::{Centimetres, Feet, Inches, Metres, Millimetres};
        use Quantity::{CommonName, Diameter, Genus, Girth, Height, ScientificName, Species, Status};
        for (name, expected) in [
            ("DBH", Some((Diameter, None))),
            ("DBH (cm)", Some((Diameter, Some(Centimetres)))),
            ("dbhcm", Some((Diameter, Some(Centimetres)))),
            ("dbh_in", Some((Diameter, Some(Inches)))),
            ("tree_dbh", Some((Diameter, None))),
            ("DBH_TRUNK", Some((Diameter, None))),
            ("BHD [mm]", Some((Diameter, Some(Millimetres)))),
            ("Diameter Breast Height", Some((Diameter, None))),
            ("diameter_at_breast_height_cm", Some((Diameter, Some(Centimetres)))),
            ("Diameter at 1.3 m (cm)", Some((Diameter, Some(Centimetres)))),
            ("Stammdurchmesser in cm", Some((Diameter, Some(Centimetres)))),
            ("diam_tronco", Some((Diameter, None))),
            ("Stamdiameter", Some((Diameter, None))),
            ("DHP", Some((Diameter, None))),
            ("stump_diam", None),
            ("CIRCONFERENCE (cm)", Some((Girth, Some(Centimetres)))),
            ("stammumfg", Some((Girth, None))),
            ("STAMMUMFANG_TXT", Some((Girth, None))),
            ("Perímetro", Some((Girth, None))),
            ("trunkGirthCm", Some((Girth, Some(Centimetres)))),
            ("Stamomtrek", Some((Girth, None))),
            ("HAUTEUR (m)", Some((Height, Some(Metres)))),
            ("h_m", Some((Height, Some(Metres)))),
            ("Baumhöhe", Some((Height, None))),
            ("baumhoehe", Some((Height, None))),
            ("Tree height ft", Some((Height, Some(Feet)))),
            ("Altezza", Some((Height, None))),
            ("Höhe in Metern", Some((Height, Some(Metres)))),
            ("kronendurchmesser", None),
            ("kronedurch", None),
            ("Crown diameter (m)", None),
            ("height_above_sea_elevation", None),
            ("HEIGHT_RANGE_ID", None),
            ("weight", None),
            ("Scientific Name", Some((ScientificName, None))),
            ("spc_latin", Some((ScientificName, None))),
            ("art_bot", Some((ScientificName, None))),
            ("GATTUNG_ART", Some((ScientificName, None))),
            ("nombre_cientifico", Some((ScientificName, None))),
            ("Wetenschappelijke naam", Some((ScientificName, None))),
            ("Essence_latin", Some((ScientificName, None))),
            ("baumnamelat", Some((ScientificName, None))),
            ("species", Some((Species, None))),
            ("ESPECE", Some((Species, None))),
            ("Baumart", Some((Species, None))),
            ("Specie", Some((Species, None))),
            ("species_id", None),
            ("Common Name", Some((CommonName, None))),
            ("LIBELLE FRANCAIS", Some((CommonName, None))),
            ("art_dtsch", Some((CommonName, None))),
            ("gattung_deutsch", Some((CommonName, None))),
            ("spc_common", Some((CommonName, None))),
            ("GENRE", Some((Genus, None))),
            ("gattung", Some((Genus, None))),
            ("Family", None),
            ("status", Some((Status, None))),
            ("Zustand", Some((Status, None))),
            ("Year Planted", None),
            ("Precinct", None),
            ("ARRONDISSEMENT", None),
        ] {
            assert_eq!(found(name), expected, "{name}");
        }
    }

    #[test]
    fn only_cells_about_absence_are_no_trees() {
        for (cell, expected) in [
            ("Dead", Some(NoTree::Dead)),
            ("Standing dead tree", Some(NoTree::Dead)),
            ("Stump", Some(NoTree::Stump)),
            ("Baumstumpf", Some(NoTree::Stump)),
            ("Vacant site", Some(NoTree::Vacant)),
            ("Planting site vacant", Some(NoTree::Vacant)),
            ("Leerstelle", Some(NoTree::Vacant)),
            ("gefällt", Some(NoTree::Vacant)),
            ("Alive", None),
            ("Poor, dead branches", None),
            ("Quercus robur", None),
            ("Good", None),
            ("", None),
        ] {
            assert_eq!(no_tree(cell), expected, "{cell}");
        }
    }

    #[test]
    fn layouts_in_inches_are_known() {
        assert!(is_in_inches(["tree_id", "tree_dbh", "spc_latin"].into_iter()));
        assert!(is_in_inches(["TreeID", "qSpecies", "DBH"].into_iter()));
        assert!(!is_in_inches(["x", "y", "dbh"].into_iter()));
    }
}
