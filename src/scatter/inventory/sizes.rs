//! Columns of sizes: which there are, and in which unit.

use csv::StringRecord;

use super::super::ScatterError;
use super::cells::{Length, is_missing, length};
use super::names::{self, Meaning, Quantity};
use super::text::Table;
use super::{InventoryOptions, LengthUnit};

/// Columns of one size, of which the largest value of a row counts: usually one, several for the stems of a tree.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SizeColumns {
    pub indices: Vec<usize>,
    pub quantity: Quantity,
    /// Unit of cells that state none.
    pub unit: LengthUnit,
    /// How the unit is known.
    pub known: Known,
}

impl SizeColumns {
    /// What is read from the columns.
    pub fn meaning(&self) -> String {
        let quantity = match self.quantity {
            Quantity::Girth => "circumference of the trunk",
            Quantity::Height => "height",
            _ => "diameter at breast height",
        };
        let known = match self.known {
            Known::Stated => String::new(),
            Known::Cells => return format!("{quantity}, its unit in each cell"),
            Known::Guessed => " (assumed: the name states no unit)".to_owned(),
        };
        format!("{quantity} in {}{known}", self.unit.name())
    }
}

/// How a unit is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// The name of the column or the caller states it.
    Stated,
    /// Every cell states it.
    Cells,
    /// It was guessed.
    Guessed,
}

/// The columns of the sizes of trees.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sizes {
    pub diameter: Option<SizeColumns>,
    pub girth: Option<SizeColumns>,
    pub height: Option<SizeColumns>,
    /// What was decided, a sentence each.
    pub notes: Vec<String>,
}

/// Smallest share of the cells of a column that must be lengths for it to be one of lengths.
const LEAST_SHARE: f64 = 0.2;

/// Finds the columns of sizes in `table`; `in_usa`: the trees stand in the United States, by their positions.
///
/// # Errors
/// [`ScatterError::AmbiguousColumn`] for two columns that differ only in their unit.
pub(super) fn find(table: &Table, options: InventoryOptions, in_usa: bool, name: &str) -> Result<Sizes, ScatterError> {
    let mut sizes = Sizes::default();
    let header = &table.header;
    let column = |quantity, sizes: &mut Sizes| choose(table, quantity, &mut sizes.notes, name);
    let diameter = column(Quantity::Diameter, &mut sizes)?;
    let girth = column(Quantity::Girth, &mut sizes)?;
    let height = column(Quantity::Height, &mut sizes)?;
    let inches = names::is_in_inches(header.iter()) || in_usa;

    let heights = height.map(|(indices, stated)| {
        let values = Values::of(table, &indices);
        let guess = if inches && values.median < 130.0 { LengthUnit::Feet } else { values.height_unit() };
        decide(Quantity::Height, indices, stated, options.height_unit, &values, guess)
    });
    let diameters = diameter.map(|(indices, stated)| {
        let values = Values::of(table, &indices);
        let slender = heights.as_ref().is_some_and(|height| is_slender(table, &indices, height));
        let guess = match values.diameter_unit() {
            LengthUnit::Centimetres if inches || slender => LengthUnit::Inches,
            unit => unit,
        };
        decide(Quantity::Diameter, indices, stated, options.dbh_unit, &values, guess)
    });
    let girths = girth.map(|(indices, stated)| {
        let values = Values::of(table, &indices);
        let guess = values.girth_unit();
        decide(Quantity::Girth, indices, stated, None, &values, guess)
    });
    sizes.diameter = diameters;
    sizes.girth = girths;
    sizes.height = heights;
    for columns in [&sizes.diameter, &sizes.girth, &sizes.height].into_iter().flatten() {
        if columns.known == Known::Guessed {
            let values = Values::of(table, &columns.indices);
            if values.count > 0 {
                let column = columns.indices.first().and_then(|index| header.get(*index)).unwrap_or("");
                sizes.notes.push(guessed(columns, column, &values));
            }
        }
    }
    Ok(sizes)
}

/// Says what was assumed of a column whose name states no unit.
fn guessed(columns: &SizeColumns, column: &str, values: &Values) -> String {
    let option = match columns.quantity {
        Quantity::Height => "state `height_unit` in the scene, or name the column as in height_m",
        Quantity::Girth => "name the column as in girth_cm if they are not",
        _ => "state `dbh_unit` in the scene, or name the column as in dbh_cm",
    };
    format!(
        "`{column}` states no unit: its values, {} to {}, half of them below {}, are taken as {}; {option}",
        short(values.least),
        short(values.most),
        short(values.median),
        columns.unit.name()
    )
}

fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn decide(
    quantity: Quantity,
    indices: Vec<usize>,
    stated: Option<LengthUnit>,
    option: Option<LengthUnit>,
    values: &Values,
    guess: LengthUnit,
) -> SizeColumns {
    let (unit, known) = match stated.or(option) {
        Some(unit) => (unit, Known::Stated),
        None if values.count == 0 => (guess, Known::Cells),
        None => (guess, Known::Guessed),
    };
    SizeColumns { indices, quantity, unit, known }
}

/// The columns of `quantity` with the stated unit; columns that hold other things than lengths are passed over, with a
/// note.
fn choose(
    table: &Table,
    quantity: Quantity,
    notes: &mut Vec<String>,
    name: &str,
) -> Result<Option<(Vec<usize>, Option<LengthUnit>)>, ScatterError> {
    let header = &table.header;
    let mut candidates: Vec<(usize, Meaning)> = header
        .iter()
        .enumerate()
        .filter_map(|(index, name)| Some((index, names::meaning(name)?)))
        .filter(|(_, meaning)| meaning.quantity == quantity)
        .collect();
    candidates.retain(|(index, meaning)| {
        let contents = Contents::of(table, *index);
        let column = header.get(*index).unwrap_or("");
        if contents.known == 0 && contents.filled > 0 {
            return true;
        }
        let few = contents.filled >= 5 && (contents.known as f64) < LEAST_SHARE * contents.filled as f64;
        let codes = meaning.classes && contents.plain * 2 > contents.filled && contents.filled > 0;
        if few {
            notes.push(format!(
                "`{column}` is not used: most of its cells are no lengths, such as \"{}\"",
                contents.example
            ));
        } else if codes {
            notes.push(format!("`{column}` is not used: its cells seem to be numbers of classes"));
        }
        !few && !codes
    });
    let all_text = |index: usize| {
        let contents = Contents::of(table, index);
        contents.filled >= 5 && contents.known == 0
    };
    candidates.retain(|(index, _)| {
        let text = all_text(*index);
        if text {
            let example = Contents::of(table, *index).example;
            let column = header.get(*index).unwrap_or("");
            notes.push(format!("`{column}` is not used: its cells are no lengths, such as \"{example}\""));
        }
        !text
    });
    // A column of texts with units goes before the numbers of classes beside it: BAUMHOEHE_TXT before BAUMHOEHE.
    let base = |index: usize| -> Vec<String> {
        let mut words = header.get(index).map(names::words).unwrap_or_default();
        words.retain(|word| !["txt", "text"].contains(&word.as_str()));
        words
    };
    let is_text = |index: usize| header.get(index).map(names::words).unwrap_or_default().len() > base(index).len();
    let rank = |(index, meaning): &(usize, Meaning)| {
        let spelled = is_text(*index) && Contents::of(table, *index).with_units > 0;
        let twin =
            !is_text(*index) && candidates.iter().any(|(other, _)| is_text(*other) && base(*other) == base(*index));
        (if spelled && !twin { 0 } else { meaning.rank }, usize::from(twin), *index)
    };
    let mut ranked = candidates.clone();
    ranked.sort_by_key(rank);
    let Some((first, meaning)) = ranked.first().copied() else { return Ok(None) };
    let without_units = |index: usize| -> Vec<String> {
        let mut words = base(index);
        if words.len() > 1 {
            words.retain(|word| names::unit_of(word).is_none());
        }
        words
    };
    // The same name twice, or with two units: either could be meant.
    if let Some((second, _)) = ranked
        .iter()
        .skip(1)
        .find(|(other, _)| without_units(*other) == without_units(first) && is_text(*other) == is_text(first))
    {
        return Err(ScatterError::AmbiguousColumn {
            name: name.to_owned(),
            quantity: quantity.name(),
            first: header.get(first.min(*second)).unwrap_or("").to_owned(),
            second: header.get(first.max(*second)).unwrap_or("").to_owned(),
        });
    }
    // dbh1, dbh2: stems. dbh_1994, dbh_2004: the latest counts.
    let numbered = |index: usize| numbered_name(&without_units(index));
    let family: Vec<(usize, u32)> = match numbered(first) {
        Some((stem, _)) => candidates
            .iter()
            .filter_map(|(other, _)| numbered(*other).filter(|(name, _)| *name == stem).map(|(_, n)| (*other, n)))
            .collect(),
        None => {
            let stem = without_units(first).concat();
            let others = candidates.iter().filter_map(|(other, _)| {
                numbered(*other).filter(|(name, number)| *name == stem && *number < 100).map(|(_, n)| (*other, n))
            });
            std::iter::once((first, 1)).chain(others).collect()
        }
    };
    let years = family.iter().all(|(_, number)| (1800..2200).contains(number));
    let indices = if family.len() > 1 && years {
        family.iter().max_by_key(|(_, year)| *year).map(|(index, _)| vec![*index]).unwrap_or_default()
    } else if family.len() > 1 {
        family.into_iter().map(|(index, _)| index).collect()
    } else {
        vec![first]
    };
    for (other, _) in ranked.iter().filter(|(other, _)| !indices.contains(other)) {
        let (used, other) =
            (indices.first().and_then(|at| header.get(*at)).unwrap_or(""), header.get(*other).unwrap_or(""));
        notes.push(format!("the {} is read from `{used}`, not from `{other}`", quantity.name()));
    }
    Ok(Some((indices, meaning.unit)))
}

/// A name that ends in a number, without it.
fn numbered_name(words: &[String]) -> Option<(String, u32)> {
    let whole = words.concat();
    let stem = whole.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = whole.get(stem.len()..)?.parse().ok()?;
    (!stem.is_empty() && stem != "d").then(|| (stem.to_owned(), number))
}

/// What the cells of a column are.
struct Contents {
    /// Cells that are not empty and not missing.
    filled: usize,
    /// Cells that are lengths.
    known: usize,
    /// Cells that are whole numbers from 0 to 20 without a unit.
    plain: usize,
    /// Cells that state their unit.
    with_units: usize,
    /// A cell that is no length.
    example: String,
}

impl Contents {
    /// Of the first thousand rows.
    fn of(table: &Table, index: usize) -> Self {
        let mut contents = Self { filled: 0, known: 0, plain: 0, with_units: 0, example: String::new() };
        for cell in table.rows.iter().take(1000).filter_map(|row| row.cells.get(index)) {
            if is_missing(cell) {
                continue;
            }
            contents.filled += 1;
            match length(cell, table.decimal_comma) {
                Some(Length { value, unit, range, .. }) => {
                    contents.known += 1;
                    contents.with_units += usize::from(unit.is_some());
                    let whole = value.fract() == 0.0 && (0.0..=20.0).contains(&value);
                    contents.plain += usize::from(unit.is_none() && !range && whole);
                }
                None if contents.example.is_empty() => contents.example = cell.chars().take(40).collect(),
                None => {}
            }
        }
        contents
    }
}

/// The numbers of columns whose cells state no unit.
struct Values {
    count: usize,
    least: f64,
    median: f64,
    most: f64,
    /// Whether some have a fraction.
    fractions: bool,
}

impl Values {
    fn of(table: &Table, indices: &[usize]) -> Self {
        let cells = table.rows.iter().flat_map(|row| indices.iter().filter_map(|index| row.cells.get(*index)));
        let mut values: Vec<f64> = cells
            .filter(|cell| !is_missing(cell))
            .filter_map(|cell| length(cell, table.decimal_comma))
            .filter(|found| found.unit.is_none() && found.value.is_finite() && found.value > 0.0)
            .map(|found| found.value)
            .collect();
        values.sort_by(f64::total_cmp);
        Self {
            count: values.len(),
            least: values.first().copied().unwrap_or(0.0),
            median: values.get(values.len() / 2).copied().unwrap_or(0.0),
            most: values.last().copied().unwrap_or(0.0),
            fractions: values.iter().any(|value| value.fract() != 0.0),
        }
    }

    /// Trunks are seldom thicker than 1.2 m, and half of a stand never is.
    fn diameter_unit(&self) -> LengthUnit {
        if self.median >= 120.0 {
            LengthUnit::Millimetres
        } else if self.count > 0 && self.median < 1.2 && self.most <= 5.0 && self.fractions {
            LengthUnit::Metres
        } else {
            LengthUnit::Centimetres
        }
    }

    fn girth_unit(&self) -> LengthUnit {
        if self.median >= 450.0 {
            LengthUnit::Millimetres
        } else if self.count > 0 && self.median < 4.0 && self.most <= 15.0 && self.fractions {
            LengthUnit::Metres
        } else {
            LengthUnit::Centimetres
        }
    }

    /// Half of a stand is never taller than 60 m.
    fn height_unit(&self) -> LengthUnit {
        match self.median {
            median if median >= 10_000.0 => LengthUnit::Millimetres,
            median if median >= 150.0 => LengthUnit::Centimetres,
            median if median >= 60.0 => LengthUnit::Feet,
            _ => LengthUnit::Metres,
        }
    }
}

/// Whether trees would be too slender for their heights if their diameters were centimetres, and usual if they were
/// inches: 160 times as tall as thick and more.
fn is_slender(table: &Table, indices: &[usize], height: &SizeColumns) -> bool {
    let value = |cells: &StringRecord, index: usize| {
        let found = length(cells.get(index)?, table.decimal_comma)?;
        (found.value > 0.0).then_some(found)
    };
    let Some((index, at)) = indices.first().copied().zip(height.indices.first().copied()) else { return false };
    let mut ratios: Vec<f64> = table
        .rows
        .iter()
        .filter_map(|row| {
            let (thick, tall) = (value(&row.cells, index)?, value(&row.cells, at)?);
            let metres = tall.value * tall.unit.unwrap_or(height.unit).metres();
            thick.unit.is_none().then_some(metres / (0.01 * thick.value))
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    // Few trees, or young ones, prove nothing.
    ratios.len() >= 10 && ratios.get(ratios.len() / 2).is_some_and(|ratio| (160.0..400.0).contains(ratio))
}

impl Quantity {
    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diameter => "dbh",
            Self::Girth => "girth",
            Self::Height => "height",
            Self::ScientificName | Self::Species | Self::CommonName => "species",
            Self::Genus => "genus",
            Self::Status => "status",
        }
    }
}
