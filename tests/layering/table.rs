//! The table "who may use whom" of ARCHITECTURE.md.

use std::collections::{BTreeMap, BTreeSet};

/// The table's header, cell by cell.
const HEADER: [&str; 3] = ["room", "what", "may use"];

/// The rooms that each room may use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    rooms: BTreeMap<String, BTreeSet<String>>,
}

impl Table {
    /// The first table of a page of Markdown with the columns room, what and may use. In its last column there are names of
    /// rooms between backticks, or the word "nobody", or "all", which is every other room.
    pub fn parse(page: &str) -> Result<Self, String> {
        let cells = |line: &str| -> Option<Vec<String>> {
            let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
            Some(inner.split('|').map(|cell| cell.trim().to_owned()).collect())
        };
        let mut lines = page.lines().map(cells).skip_while(|row| row.as_deref().is_none_or(|row| row != HEADER));
        if lines.next().is_none() {
            return Err(format!("the page has no table with the columns {}", HEADER.join(", ")));
        }
        let mut rows = BTreeMap::new();
        for row in lines.map_while(|row| row).skip(1) {
            let [room, _, may_use] = row.as_slice() else {
                return Err(format!("a row of the table of rooms has {} cells: {}", row.len(), row.join(" | ")));
            };
            let room = names(room).into_iter().next().ok_or_else(|| format!("a row names no room: {room}"))?;
            if rows.insert(room.clone(), may_use.clone()).is_some() {
                return Err(format!("the room {room} has two rows"));
            }
        }
        let mut table = Self::default();
        for (room, may_use) in &rows {
            let named: BTreeSet<String> = match may_use.as_str() {
                "nobody" => BTreeSet::new(),
                "all" => rows.keys().filter(|other| *other != room).cloned().collect(),
                list => names(list).into_iter().collect(),
            };
            if named.is_empty() && may_use != "nobody" {
                return Err(format!("what {room} may use cannot be read: {may_use}"));
            }
            if let Some(unknown) = named.iter().find(|name| !rows.contains_key(*name)) {
                return Err(format!("{room} may use {unknown}, which has no row"));
            }
            table.rooms.insert(room.clone(), named);
        }
        Ok(table)
    }

    /// The rooms, in order of their names.
    pub fn rooms(&self) -> impl Iterator<Item = &str> {
        self.rooms.keys().map(String::as_str)
    }

    /// Whether `room` may use `other`; every room may use itself.
    pub fn allows(&self, room: &str, other: &str) -> bool {
        room == other || self.rooms.get(room).is_some_and(|may_use| may_use.contains(other))
    }

    /// Who may use whom, as a graph.
    pub fn graph(&self) -> BTreeMap<String, BTreeSet<String>> {
        self.rooms.clone()
    }
}

/// What a cell has between backticks, without a slash at the end.
fn names(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(|name| name.trim_end_matches('/').to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "\
# House

| no | table |
|---|---|

| room | what | may use |
|---|---|---|
| `math/` | numbers | nobody |
| `light/` | `sh.rs` and others | `math` |
| `app/` | the program | all |

after it
";

    #[test]
    fn the_table_is_read() {
        let table = Table::parse(PAGE).unwrap();
        assert_eq!(table.rooms().collect::<Vec<_>>(), ["app", "light", "math"]);
        for (room, other, allowed) in [
            ("math", "math", true),
            ("math", "light", false),
            ("light", "math", true),
            ("light", "app", false),
            ("app", "light", true),
            ("app", "math", true),
            ("cellar", "math", false),
        ] {
            assert_eq!(table.allows(room, other), allowed, "{room} {other}");
        }
    }

    #[test]
    fn a_table_that_cannot_be_trusted_is_refused() {
        for (from, to) in [
            ("may use", "uses"),
            ("| `math` |", "| `meth` |"),
            ("| nobody |", "| someone |"),
            ("| `light/` |", "| `math/` |"),
            ("| `light/` |", "| light |"),
            ("| the program |", "| the | program |"),
        ] {
            assert!(Table::parse(&PAGE.replace(from, to)).is_err(), "{from} -> {to}");
        }
    }
}
