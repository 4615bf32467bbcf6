//! Which columns hold the species.

use csv::StringRecord;

use super::super::ScatterError;
use super::cells::is_missing;
use super::names::{self, Quantity};
use super::text::Table;

/// The columns of the species.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SpeciesColumns {
    /// The name, or the epithet if `genus` is to be put before it.
    name: Option<usize>,
    /// The genus: before the epithet, or where there is no name.
    genus: Option<usize>,
    /// Whether the name is only the epithet.
    epithet: bool,
    /// What was decided, a sentence each.
    pub notes: Vec<String>,
}

/// Rows that are looked at to tell epithets from names.
const LOOKED_AT: usize = 1000;

impl SpeciesColumns {
    /// Finds them by their names and contents.
    ///
    /// # Errors
    /// [`ScatterError::AmbiguousColumn`] for two columns of the same name.
    pub fn find(table: &Table, name: &str) -> Result<Self, ScatterError> {
        let header = &table.header;
        let meanings: Vec<_> = header.iter().map(names::meaning).collect();
        let of = |quantity: Quantity| {
            let mut found: Vec<(u8, usize)> = meanings
                .iter()
                .enumerate()
                .filter_map(|(index, meaning)| {
                    Some((meaning.filter(|meaning| meaning.quantity == quantity)?.rank, index))
                })
                .collect();
            found.sort_unstable();
            found
        };
        let has_values = |index: &usize| {
            table.rows.is_empty()
                || table.rows.iter().any(|row| row.cells.get(*index).is_some_and(|cell| !is_missing(cell)))
        };
        let mut candidates: Vec<usize> = [Quantity::ScientificName, Quantity::Species, Quantity::CommonName]
            .into_iter()
            .flat_map(of)
            .map(|(_, index)| index)
            .collect();
        for (at, first) in candidates.iter().enumerate() {
            let words = |index: usize| header.get(index).map(names::words);
            if let Some(second) = candidates.iter().skip(at + 1).find(|second| words(**second) == words(*first)) {
                return Err(ScatterError::AmbiguousColumn {
                    name: name.to_owned(),
                    quantity: "species",
                    first: header.get(*first).unwrap_or("").to_owned(),
                    second: header.get(*second).unwrap_or("").to_owned(),
                });
            }
        }
        candidates.retain(has_values);
        let genus = of(Quantity::Genus).into_iter().map(|(_, index)| index).find(has_values);
        let is_common = |index: usize| {
            meanings.get(index).copied().flatten().is_some_and(|meaning| meaning.quantity == Quantity::CommonName)
        };
        // A genus says more than a common name: scenes name species in Latin.
        let name = candidates.first().copied().filter(|index| genus.is_none() || !is_common(*index));
        let epithet = name.zip(genus).is_some_and(|(name, genus)| are_epithets(table, name, genus));
        let mut notes = Vec::new();
        let title = |index: usize| header.get(index).unwrap_or("");
        if let Some((name, genus)) = name.zip(genus).filter(|_| epithet) {
            notes.push(format!("species are `{}` and `{}` joined", title(genus), title(name)));
        }
        Ok(Self { name, genus, epithet, notes })
    }

    /// Whether the table has no species.
    pub fn is_empty(&self) -> bool {
        self.name.is_none() && self.genus.is_none()
    }

    /// The cells that name a species.
    pub fn cells<'a>(&self, cells: &'a StringRecord) -> impl Iterator<Item = &'a str> + use<'a> {
        let columns = [self.name, self.genus];
        columns.into_iter().flatten().filter_map(|index| cells.get(index))
    }

    /// The species of a row.
    pub fn of(&self, cells: &StringRecord) -> Option<String> {
        let cell = |index: Option<usize>| index.and_then(|index| cells.get(index)).filter(|cell| !is_missing(cell));
        match (cell(self.genus), cell(self.name)) {
            (Some(genus), Some(epithet)) if self.epithet => {
                let epithet = if epithet.chars().all(|c| !c.is_lowercase()) {
                    epithet.to_lowercase()
                } else {
                    epithet.to_owned()
                };
                Some(format!("{genus} {epithet}"))
            }
            (_, Some(name)) => Some(name.to_owned()),
            (genus, None) => genus.map(str::to_owned),
        }
    }

    /// What is read from column `index`.
    pub fn meaning(&self, index: usize) -> Option<&'static str> {
        if self.name == Some(index) {
            Some(if self.epithet { "species (its second word)" } else { "species" })
        } else if self.genus == Some(index) && (self.epithet || self.name.is_none()) {
            Some("species (its genus)")
        } else if self.genus == Some(index) {
            Some("species where it is not named (its genus)")
        } else {
            None
        }
    }
}

/// Whether the names are only epithets: they do not begin with the genus beside them, and are of one word, begin with a
/// small letter, or with the sign of a hybrid.
fn are_epithets(table: &Table, name: usize, genus: usize) -> bool {
    let (mut epithets, mut all) = (0usize, 0usize);
    for row in table.rows.iter().take(LOOKED_AT) {
        let cell = |index: usize| row.cells.get(index).filter(|cell| !is_missing(cell));
        let (Some(genus), Some(name)) = (cell(genus), cell(name)) else { continue };
        all += 1;
        let begins = names::folded(name).starts_with(&names::folded(genus));
        let small = name.chars().next().is_some_and(|c| !c.is_uppercase());
        epithets += usize::from(!begins && (small || name.split_whitespace().count() == 1));
    }
    all > 0 && 2 * epithets > all
}
