//! The tables of a GeoPackage that describe the others: its layers, their columns and their coordinate systems.
//!
//! A name or a number that has another type than it should counts as missing: any file may call itself a GeoPackage.

use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, OptionalExtension};

use super::super::LISTED;
use crate::math::names::nearest;

/// Layers that are looked at; real files have some dozens.
const MOST: usize = 1000;
/// Codes of EPSG for degrees, for files that define them by their codes alone: WGS84, ETRS89, NAD83.
const DEGREES: [u32; 3] = [4326, 4258, 4269];

/// A layer: what `gpkg_contents` and `gpkg_geometry_columns` say of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layer {
    pub name: String,
    /// The column of the geometries; empty in a table without any.
    pub column: String,
    /// The type of the geometries in capital letters, such as `POINT`.
    pub kind: Option<String>,
    /// The number of the coordinate system in this file.
    pub system: Option<i64>,
}

impl Layer {
    /// The rank among layers that may have points, the first is 0.
    fn rank(&self) -> Option<u8> {
        match self.kind.as_deref()? {
            "POINT" | "MULTIPOINT" => Some(0),
            "GEOMETRY" | "GEOMETRYCOLLECTION" => Some(1),
            _ => None,
        }
    }
}

impl std::fmt::Display for Layer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` ({})", self.name, self.kind.as_deref().unwrap_or("no geometry"))
    }
}

fn text(value: ValueRef) -> Option<String> {
    match value {
        ValueRef::Text(text) => Some(String::from_utf8_lossy(text).into_owned()),
        _ => None,
    }
}

fn whole(value: ValueRef) -> Option<i64> {
    match value {
        ValueRef::Integer(number) => Some(number),
        _ => None,
    }
}

/// A name as an identifier of SQL.
pub(super) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// Whether there is a table or view of this name, in small letters.
pub(super) fn has_table(database: &Connection, name: &str) -> Result<bool, Error> {
    database.prepare("SELECT 1 FROM sqlite_schema WHERE lower(name) = ?1")?.exists([name])
}

/// The columns of a table or view.
pub(super) fn columns(database: &Connection, table: &str) -> Result<Vec<String>, Error> {
    // Those that are hidden belong to virtual tables, and `SELECT *` does not give them.
    let mut statement = database.prepare("SELECT name FROM pragma_table_xinfo(?1) WHERE hidden <> 1")?;
    statement.query_map([table], |row| Ok(text(row.get_ref(0)?).unwrap_or_default()))?.collect()
}

/// The layers in the order of `gpkg_contents`.
pub(super) fn all(database: &Connection) -> Result<Vec<Layer>, Error> {
    let mut layers: Vec<Layer> = database
        .prepare("SELECT table_name, srs_id FROM gpkg_contents")?
        .query_map([], |row| {
            let (name, system) = (text(row.get_ref(0)?).unwrap_or_default(), whole(row.get_ref(1)?));
            Ok(Layer { name, system, ..Layer::default() })
        })?
        .take(MOST)
        .collect::<Result<_, Error>>()?;
    if !has_table(database, "gpkg_geometry_columns")? {
        return Ok(layers);
    }
    let mut statement =
        database.prepare("SELECT table_name, column_name, geometry_type_name, srs_id FROM gpkg_geometry_columns")?;
    let geometries = statement.query_map([], |row| {
        let value = |index: usize| Ok::<_, Error>(text(row.get_ref(index)?).unwrap_or_default());
        Ok((value(0)?, value(1)?, value(2)?, whole(row.get_ref(3)?)))
    })?;
    for geometry in geometries.take(MOST) {
        let (table, column, kind, system) = geometry?;
        let described = |layer: &&mut Layer| layer.kind.is_none() && layer.name.eq_ignore_ascii_case(&table);
        if let Some(layer) = layers.iter_mut().find(described) {
            (layer.column, layer.kind) = (column, Some(kind.to_uppercase()));
            layer.system = system.or(layer.system);
        }
    }
    Ok(layers)
}

/// The layer of this name, else the first of the best rank, and a note that names the others. The error says what there is.
pub(super) fn choose<'a>(layers: &'a [Layer], wanted: Option<&str>) -> Result<(&'a Layer, Option<String>), String> {
    let Some(wanted) = wanted else {
        let Some((_, layer)) =
            layers.iter().filter_map(|layer| Some((layer.rank()?, layer))).min_by_key(|found| found.0)
        else {
            let list = listed(layers.iter());
            return Err(format!("the GeoPackage has no layer of points (it has {list}): export the trees as points"));
        };
        let others = || layers.iter().filter(|other| *other != layer);
        let choice = others().any(|other| other.rank().is_some());
        let choice = if choice { "; choose another by `layer` in the scene" } else { "" };
        let note = format!("of its layers `{}` is read, not {}{choice}", layer.name, listed(others()));
        return Ok((layer, (layers.len() > 1).then_some(note)));
    };
    let found = layers
        .iter()
        .find(|layer| layer.name == wanted)
        .or_else(|| layers.iter().find(|layer| layer.name.eq_ignore_ascii_case(wanted)));
    match found {
        Some(layer) if layer.rank().is_some() => Ok((layer, None)),
        Some(layer) => {
            Err(format!("the layer {layer} has no points: export the trees as points, or choose another layer"))
        }
        None => {
            let meant = nearest(wanted, layers.iter().map(|layer| layer.name.as_str()));
            let meant = meant.map(|name| format!("did you mean `{name}`? ")).unwrap_or_default();
            Err(format!("there is no layer `{wanted}`: {meant}The GeoPackage has {}", listed(layers.iter())))
        }
    }
}

/// The first few layers, for a message.
fn listed<'a>(layers: impl Iterator<Item = &'a Layer>) -> String {
    let all: Vec<String> = layers.map(ToString::to_string).collect();
    match all.get(..2 * LISTED) {
        _ if all.is_empty() => "no layer".to_owned(),
        Some(first) if all.len() > first.len() => format!("{} and {} more", first.join(", "), all.len() - first.len()),
        _ => all.join(", "),
    }
}

/// What the coordinates are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Degrees.
    Geographic,
    /// Metres or feet.
    Planar,
    /// Lengths from an unknown origin, by the words of the file.
    Cartesian,
    /// Not stated.
    Undefined,
}

/// A coordinate system.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct System {
    pub epsg: Option<u32>,
    pub wkt: Option<String>,
    pub kind: Kind,
}

impl System {
    /// The system of this number in `gpkg_spatial_ref_sys`. Number -1 stands for undefined Cartesian systems (1.1.2.1.2),
    /// 0 for undefined geographic ones; programs give 0 also to layers of which they know nothing.
    pub fn of(database: &Connection, number: Option<i64>) -> Result<Self, Error> {
        let query = |columns: &str| {
            database
                .prepare(&format!("SELECT {columns} FROM gpkg_spatial_ref_sys WHERE srs_id = ?1"))?
                .query_row([number], |row| {
                    let code = text(row.get_ref(0)?).filter(|name| name.trim().eq_ignore_ascii_case("EPSG"));
                    let code = code.and(whole(row.get_ref(1)?)).and_then(|code| u32::try_from(code).ok());
                    Ok((code, text(row.get_ref(2)?)))
                })
                .optional()
        };
        let defined = |definition: Option<String>| {
            definition.filter(|text| !text.trim().is_empty() && !text.trim().eq_ignore_ascii_case("undefined"))
        };
        let columns = "organization, organization_coordsys_id, definition";
        let (epsg, definition) = query(columns)?.unwrap_or_default();
        // The extension for the newer WKT has it in a column of its own, which few files have [OGC 21-057].
        let wkt = defined(definition).or_else(|| defined(query(&format!("{columns}_12_063")).ok()??.1));
        let kind = match (wkt.as_deref().and_then(kind_of_wkt), epsg) {
            (Some(Kind::Cartesian), None) => return Ok(Self { epsg: None, wkt: None, kind: Kind::Cartesian }),
            (Some(kind), _) => kind,
            (None, Some(code)) if DEGREES.contains(&code) => Kind::Geographic,
            (None, None) if number == Some(-1) => Kind::Cartesian,
            (None, _) => Kind::Undefined,
        };
        Ok(Self { epsg, wkt, kind })
    }
}

/// What the first system in a text of WKT is: a compound system begins with the horizontal one, a projected one has its
/// degrees inside.
fn kind_of_wkt(text: &str) -> Option<Kind> {
    const WORDS: [(&str, Kind); 9] = [
        ("PROJCS", Kind::Planar),
        ("PROJCRS", Kind::Planar),
        ("PROJECTEDCRS", Kind::Planar),
        ("GEOGCS", Kind::Geographic),
        ("GEOGCRS", Kind::Geographic),
        ("GEODCRS", Kind::Geographic),
        ("LOCAL_CS", Kind::Cartesian),
        ("ENGCRS", Kind::Cartesian),
        ("ENGINEERINGCRS", Kind::Cartesian),
    ];
    let text = text.to_ascii_uppercase();
    let first = WORDS.iter().filter_map(|(word, kind)| Some((text.find(word)?, *kind))).min_by_key(|found| found.0);
    first.map(|(_, kind)| kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_system_of_a_definition_counts() {
        for (text, kind) in [
            ("GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\"]]", Some(Kind::Geographic)),
            ("PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\"]]", Some(Kind::Planar)),
            ("COMPD_CS[\"a\",PROJCS[\"b\",GEOGCS[\"c\"]],VERT_CS[\"d\"]]", Some(Kind::Planar)),
            ("COMPOUNDCRS[\"a\",GEOGCRS[\"b\"],VERTCRS[\"d\"]]", Some(Kind::Geographic)),
            ("projcrs[\"a\",BASEGEOGCRS[\"b\"]]", Some(Kind::Planar)),
            ("LOCAL_CS[\"Undefined SRS\",UNIT[\"unknown\",0]]", Some(Kind::Cartesian)),
            ("GEOCCS[\"a\"]", None),
            ("undefined", None),
        ] {
            assert_eq!(kind_of_wkt(text), kind, "{text}");
        }
    }

    /// A choice is only offered where there is one.
    #[test]
    fn the_other_layers_are_named() {
        let layer = |name: &str, kind: Option<&str>| Layer {
            name: name.to_owned(),
            kind: kind.map(str::to_owned),
            ..Layer::default()
        };
        let (trees, stands) = (layer("trees", Some("POINT")), layer("stands", Some("POLYGON")));
        let notes = |layers: &[Layer]| choose(layers, None).map(|(layer, note)| (layer.name.clone(), note));
        let found = |note: Option<&str>| Ok(("trees".to_owned(), note.map(str::to_owned)));
        assert_eq!(notes(std::slice::from_ref(&trees)), found(None));
        let note = "of its layers `trees` is read, not `stands` (POLYGON), `visits` (no geometry)";
        assert_eq!(notes(&[stands.clone(), trees.clone(), layer("visits", None)]), found(Some(note)));
        let note = "of its layers `trees` is read, not `all` (GEOMETRY); choose another by `layer` in the scene";
        assert_eq!(notes(&[layer("all", Some("GEOMETRY")), trees]), found(Some(note)));
        assert!(notes(&[stands]).is_err() && notes(&[]).is_err());
        let many: Vec<Layer> = (0..12).map(|number| layer(&format!("l{number}"), None)).collect();
        assert!(choose(&many, None).is_err_and(|message| message.contains("`l9` (no geometry) and 2 more")));
    }

    #[test]
    fn names_are_quoted() {
        assert_eq!(quoted("a \"b\" c"), "\"a \"\"b\"\" c\"");
    }
}
