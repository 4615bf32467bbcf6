//! Tables of several times or alternatives: a survey that was repeated, a stand before and after a felling. One of them is
//! shown.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use csv::StringRecord;

use super::cells::is_missing;
use super::names::words;
use super::place::PlaceColumns;
use super::text::Table;
use super::{InventoryOptions, LISTED};

/// Least share of rows that must stand where another year has a tree, for a column that is only called "year".
const LEAST_SHARE: f64 = 0.2;

/// The times and the alternatives of an inventory, and which of them is shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surveys {
    /// The years of a repeated survey, in order; none for a single one.
    pub years: Vec<i32>,
    /// The year that is shown.
    pub year: Option<i32>,
    /// The variants or scenarios as written, in the order of the file; none for a single one.
    pub variants: Vec<String>,
    /// The one that is shown.
    pub variant: Option<String>,
}

impl Surveys {
    /// The year after the one that is shown, or before it; after the last comes the first.
    pub fn next_year(&self, forward: bool) -> Option<i32> {
        next(&self.years, self.year.as_ref(), forward).copied()
    }

    /// The variant after the one that is shown, or before it.
    pub fn next_variant(&self, forward: bool) -> Option<&str> {
        next(&self.variants, self.variant.as_ref(), forward).map(String::as_str)
    }
}

/// The neighbour of `shown` in a list that begins again after its end.
fn next<'a, T: PartialEq>(list: &'a [T], shown: Option<&T>, forward: bool) -> Option<&'a T> {
    let at = list.iter().position(|one| Some(one) == shown)?;
    let count = list.len();
    list.get((if forward { at + 1 } else { at + count - 1 }) % count)
}

/// Which rows of a table are shown.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Selection {
    year: Option<(usize, i32)>,
    variant: Option<(usize, String)>,
    /// What was decided, a sentence each.
    pub notes: Vec<String>,
    /// What there is to choose from.
    pub surveys: Surveys,
}

impl Selection {
    /// Chooses the year and the variant of `options`, otherwise the last year and the first variant.
    pub fn find(table: &Table, place: &PlaceColumns, options: InventoryOptions) -> Self {
        let mut selection = Self::default();
        selection.choose_year(table, place, options.year);
        selection.choose_variant(table, options.variant);
        selection
    }

    fn choose_year(&mut self, table: &Table, place: &PlaceColumns, wanted: Option<i32>) {
        let column = table.header.iter().enumerate().find_map(|(index, name)| {
            let kind = kind_of_year(name)?;
            let years: BTreeSet<i32> = years(table, index).collect();
            // A year of planting differs from tree to tree; a survey has few years, and the same places in each.
            let repeats = kind == YearName::Survey || repeats(table, place, index);
            (years.len() > 1 && repeats).then_some((index, years))
        });
        let Some((column, years)) = column else {
            if let Some(year) = wanted {
                self.notes.push(format!("the year {year} is not chosen: no column has years of surveys"));
            }
            return;
        };
        let (Some(first), Some(last)) = (years.first().copied(), years.last().copied()) else { return };
        let chosen = wanted.map_or(last, |wanted| years.range(..=wanted).next_back().copied().unwrap_or(first));
        let name = table.header.get(column).unwrap_or("");
        let list: Vec<String> = years.iter().take(2 * LISTED).map(i32::to_string).collect();
        self.notes.push(format!(
            "of the years {}{} in `{name}`, {chosen} is shown; choose another by `year` in the scene or --year",
            list.join(", "),
            if years.len() > 2 * LISTED { ", ..." } else { "" }
        ));
        self.year = Some((column, chosen));
        (self.surveys.years, self.surveys.year) = (years.into_iter().collect(), Some(chosen));
    }

    fn choose_variant(&mut self, table: &Table, wanted: Option<&str>) {
        let column = table.header.iter().position(|name| {
            let list = ["variant", "variante", "scenario", "szenario", "escenario", "alternative", "alternativa"];
            words(name).iter().any(|word| list.contains(&word.as_str()))
        });
        let Some(column) = column else {
            if let Some(variant) = wanted {
                self.notes
                    .push(format!("the variant {variant} is not chosen: no column is called variant or scenario"));
            }
            return;
        };
        let mut variants: Vec<&str> = Vec::new();
        for cell in cells(table, column) {
            if !variants.iter().any(|known| known.eq_ignore_ascii_case(cell)) {
                variants.push(cell);
            }
        }
        let stated = wanted.and_then(|wanted| variants.iter().find(|known| known.eq_ignore_ascii_case(wanted)));
        let Some(chosen) = stated.or(variants.first()).filter(|_| variants.len() > 1) else { return };
        let name = table.header.get(column).unwrap_or("");
        let missing = match wanted {
            Some(wanted) if stated.is_none() => format!(" (there is no `{wanted}`)"),
            _ => String::new(),
        };
        self.notes.push(format!(
            "of the variants {} in `{name}`, {chosen} is shown{missing}; choose another by `variant` in the scene or --variant",
            variants.iter().take(2 * LISTED).copied().collect::<Vec<_>>().join(", ")
        ));
        self.variant = Some((column, (*chosen).to_owned()));
        self.surveys.variant = Some((*chosen).to_owned());
        self.surveys.variants = variants.into_iter().map(str::to_owned).collect();
    }

    /// Whether there is more than what is shown.
    pub fn is_choice(&self) -> bool {
        self.year.is_some() || self.variant.is_some()
    }

    /// Whether a row is shown: of this year and variant, or of none.
    pub fn keeps(&self, row: &StringRecord) -> bool {
        let cell = |column: usize| row.get(column).filter(|cell| !is_missing(cell));
        let of_year =
            self.year.is_none_or(|(column, chosen)| cell(column).and_then(year_of).is_none_or(|year| year == chosen));
        let of_variant = self
            .variant
            .as_ref()
            .is_none_or(|(column, chosen)| cell(*column).is_none_or(|variant| variant.eq_ignore_ascii_case(chosen)));
        of_year && of_variant
    }

    /// What is read from column `index`.
    pub fn meaning(&self, index: usize) -> Option<&'static str> {
        if self.year.is_some_and(|(column, _)| column == index) {
            return Some("year of the survey");
        }
        self.variant.as_ref().is_some_and(|(column, _)| *column == index).then_some("variant")
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum YearName {
    /// It says that it is the year of a survey.
    Survey,
    /// It says only "year".
    Plain,
}

fn kind_of_year(name: &str) -> Option<YearName> {
    let words = words(name);
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    let whole = words.concat();
    let year = has(&["year", "jahr", "annee", "ano", "anno", "jaar", "census"]) || whole.ends_with("jahr");
    let survey = has(&["survey", "census", "inventory", "measurement", "inventur", "releve", "rilievo", "opname"])
        || ["aufnahme", "messjahr", "inventur", "inventaire"].iter().any(|part| whole.contains(part));
    let planted = ["plant", "pflanz", "plantation", "felled", "birth", "built"].iter().any(|part| whole.contains(part));
    match (year && !planted, survey) {
        (true, true) => Some(YearName::Survey),
        (true, false) if words.len() == 1 => Some(YearName::Plain),
        _ => None,
    }
}

/// The first number of four digits in a cell that is a year.
fn year_of(cell: &str) -> Option<i32> {
    let numbers = cell.split(|c: char| !c.is_ascii_digit()).filter(|digits| digits.len() == 4);
    numbers.filter_map(|digits| digits.parse().ok()).find(|year| (1800..2300).contains(year))
}

fn cells(table: &Table, column: usize) -> impl Iterator<Item = &str> {
    table.rows.iter().filter_map(move |row| row.cells.get(column)).filter(|cell| !is_missing(cell))
}

fn years(table: &Table, column: usize) -> impl Iterator<Item = i32> {
    cells(table, column).filter_map(year_of)
}

/// Whether many places have rows of several years.
fn repeats(table: &Table, place: &PlaceColumns, column: usize) -> bool {
    let [x, y] = place.columns();
    let mut places: HashMap<(&str, &str), BTreeMap<i32, usize>> = HashMap::new();
    for row in &table.rows {
        let cell = |at: usize| row.cells.get(at).filter(|cell| !is_missing(cell));
        if let (Some(x), Some(y), Some(year)) = (cell(x), cell(y), row.cells.get(column).and_then(year_of)) {
            *places.entry((x, y)).or_default().entry(year).or_default() += 1;
        }
    }
    let repeated: usize = places.values().filter(|years| years.len() > 1).flat_map(BTreeMap::values).sum();
    repeated as f64 > LEAST_SHARE * table.rows.len() as f64
}
