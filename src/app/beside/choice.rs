//! Which years and variants of an inventory are shown.

use std::path::{Path, PathBuf};

use crate::{
    app::{AppError, Beside},
    scatter::{Coordinates, InventoryOptions, Surveys, read_inventory},
    scene::{InventoryTrees, Scene, Trees},
};

/// Years and variants that a message lists.
const LISTED: usize = 20;

/// Why years or variants cannot be shown side by side.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BesideError {
    /// Trees that are not listed.
    #[error(
        "{scene}: its trees are of no inventory, so there are no years or variants of them; name one in the scene, `trees: \
         Inventory(path: \"plot.csv\")`, or leave out --year and --variant"
    )]
    NoInventory {
        /// The scene file, or the label of a scene that was built in code.
        scene: String,
    },
    /// An inventory that cannot be read more than once.
    #[error("{}: this is not an ordinary file, and must be one where several years or variants are read from it", .0.display())]
    NoFile(PathBuf),
    /// A single survey.
    #[error(
        "{}: no column has years of surveys, so there is one picture only; call such a column `survey_year`, or leave out --year",
        .0.display()
    )]
    NoYears(PathBuf),
    /// No variants.
    #[error(
        "{}: no column has several variants, so there is one picture only; call such a column `variant`, or leave out --variant",
        .0.display()
    )]
    NoVariants(PathBuf),
    /// A year without a survey.
    #[error("{}: there is no survey of {year}; its years are {years}", file.display())]
    UnknownYear {
        /// The inventory.
        file: PathBuf,
        /// The year.
        year: i32,
        /// Those that there are.
        years: String,
    },
    /// A variant that the inventory does not have.
    #[error("{}: there is no variant `{variant}`; its variants are {variants}", file.display())]
    UnknownVariant {
        /// The inventory.
        file: PathBuf,
        /// Its name.
        variant: String,
        /// Those that there are.
        variants: String,
    },
    /// The same panel twice.
    #[error("{0} is named twice; name each year and each variant once")]
    Twice(String),
    /// A picture that is too large.
    #[error(
        "{columns} x {rows} panels are a picture of {width} x {height} pixels, more than a PNG file should have; choose a smaller \
         --size, or show fewer of them"
    )]
    TooLarge {
        /// Panels beside each other.
        columns: usize,
        /// Panels above each other.
        rows: usize,
        /// Width of the whole in pixels.
        width: u64,
        /// Its height.
        height: u64,
    },
}

/// What is shown beside each other and above each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The panels, row by row. There is at least one.
    pub panels: Vec<PanelChoice>,
    /// How many of them make a row.
    pub columns: usize,
}

/// One panel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PanelChoice {
    /// The year, unless the scene chooses it.
    pub year: Option<i32>,
    /// The variant, unless the scene chooses it.
    pub variant: Option<String>,
}

impl PanelChoice {
    /// What its caption says.
    pub fn caption(&self) -> String {
        let year = self.year.map(|year| year.to_string());
        year.into_iter().chain(self.variant.clone()).collect::<Vec<_>>().join(", ")
    }

    /// `scene` with this year and variant.
    pub fn applied(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        if let Trees::Inventory(trees) = &mut scene.trees {
            trees.year = self.year.or(trees.year);
            trees.variant = self.variant.clone().or(trees.variant.take());
        }
        scene
    }
}

impl Choice {
    /// What `beside` asks for of `scene`, whose inventory is read for it; the scene as it is where it asks for nothing.
    ///
    /// # Errors
    /// [`AppError::Beside`], and [`AppError::Stand`] for an inventory that cannot be read.
    pub fn new(beside: &Beside, scene: &Scene) -> Result<Self, AppError> {
        if beside.years.is_empty() && beside.variants.is_empty() {
            return Ok(Self { panels: vec![PanelChoice::default()], columns: 1 });
        }
        let Trees::Inventory(trees) = &scene.trees else {
            return Err(BesideError::NoInventory { scene: scene.label() }.into());
        };
        Ok(Self::of(beside, &surveys(trees)?, &trees.path)?)
    }

    /// The years beside each other and the variants above each other; one of the two alone beside each other.
    fn of(beside: &Beside, surveys: &Surveys, file: &Path) -> Result<Self, BesideError> {
        let years = known_years(&beside.years, surveys, file)?;
        let variants = known_variants(&beside.variants, surveys, file)?;
        let columns = if years.is_empty() { variants.len() } else { years.len() };
        let years: Vec<Option<i32>> = if years.is_empty() { vec![None] } else { years.into_iter().map(Some).collect() };
        let variants = if variants.is_empty() { vec![None] } else { variants.into_iter().map(Some).collect() };
        let row = |variant: Option<String>| years.iter().map(move |year| (*year, variant.clone()));
        let panels = variants.into_iter().flat_map(row).map(|(year, variant)| PanelChoice { year, variant });
        Ok(Self { panels: panels.collect(), columns: columns.max(1) })
    }
}

/// The years and variants of an inventory.
fn surveys(trees: &InventoryTrees) -> Result<Surveys, AppError> {
    if trees.path.exists() && !trees.path.is_file() {
        return Err(BesideError::NoFile(trees.path.clone()).into());
    }
    let read = |positions: Option<Coordinates>| {
        read_inventory(&trees.path, InventoryOptions { positions, ..InventoryOptions::default() })
    };
    // Of a table with two kinds of positions one may not do, which its place on the terrain decides later.
    let inventory = read(None).or_else(|error| read(Some(Coordinates::Geographic)).map_err(|_| error))?;
    Ok(inventory.surveys)
}

fn known_years(wanted: &[i32], surveys: &Surveys, file: &Path) -> Result<Vec<i32>, BesideError> {
    if !wanted.is_empty() && surveys.years.is_empty() {
        return Err(BesideError::NoYears(file.to_owned()));
    }
    for (number, &year) in wanted.iter().enumerate() {
        if !surveys.years.contains(&year) {
            let years = listed(surveys.years.iter().map(i32::to_string));
            return Err(BesideError::UnknownYear { file: file.to_owned(), year, years });
        }
        if wanted.iter().take(number).any(|before| *before == year) {
            return Err(BesideError::Twice(format!("the year {year}")));
        }
    }
    Ok(wanted.to_vec())
}

/// The variants as the file writes them. A text that is no name of one may be several, separated by commas.
fn known_variants(wanted: &[String], surveys: &Surveys, file: &Path) -> Result<Vec<String>, BesideError> {
    if !wanted.is_empty() && surveys.variants.is_empty() {
        return Err(BesideError::NoVariants(file.to_owned()));
    }
    let known = |name: &str| surveys.variants.iter().find(|known| known.eq_ignore_ascii_case(name.trim()));
    let mut found: Vec<String> = Vec::new();
    for text in wanted {
        let names = if known(text).is_some() { vec![text.as_str()] } else { text.split(',').collect() };
        for name in names {
            let Some(variant) = known(name) else {
                let variants = listed(surveys.variants.iter().cloned());
                return Err(BesideError::UnknownVariant {
                    file: file.to_owned(),
                    variant: name.trim().to_owned(),
                    variants,
                });
            };
            if found.contains(variant) {
                return Err(BesideError::Twice(format!("the variant `{variant}`")));
            }
            found.push(variant.clone());
        }
    }
    Ok(found)
}

fn listed(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(LISTED);
    let list = names.take(LISTED).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{list} and {more} more") } else { list }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choose(years: &[i32], variants: &[&str]) -> Result<(Vec<String>, usize), String> {
        let surveys = Surveys {
            years: vec![2000, 2010, 2020],
            year: Some(2020),
            variants: ["kept", "Felled", "thinned, 30 %"].map(str::to_owned).to_vec(),
            variant: Some("kept".to_owned()),
        };
        choose_of(years, variants, &surveys)
    }

    fn choose_of(years: &[i32], variants: &[&str], surveys: &Surveys) -> Result<(Vec<String>, usize), String> {
        let variants = variants.iter().map(|name| (*name).to_owned()).collect();
        let choice = Choice::of(&Beside { years: years.to_vec(), variants }, surveys, "plot.csv".as_ref());
        let choice = choice.map_err(|error| error.to_string())?;
        Ok((choice.panels.iter().map(PanelChoice::caption).collect(), choice.columns))
    }

    fn expected(captions: &[&str], columns: usize) -> Result<(Vec<String>, usize), String> {
        Ok((captions.iter().map(|caption| (*caption).to_owned()).collect(), columns))
    }

    #[test]
    fn years_are_columns_and_variants_beside_them_are_rows() {
        assert_eq!(choose(&[2020, 2000], &[]), expected(&["2020", "2000"], 2));
        assert_eq!(choose(&[], &["felled", "kept"]), expected(&["Felled", "kept"], 2));
        assert_eq!(
            choose(&[2000, 2010], &["kept", "felled"]),
            expected(&["2000, kept", "2010, kept", "2000, Felled", "2010, Felled"], 2)
        );
    }

    #[test]
    fn variants_may_be_separated_by_commas_and_have_commas_in_their_names() {
        assert_eq!(choose(&[], &["kept, felled"]), expected(&["kept", "Felled"], 2));
        assert_eq!(choose(&[], &["thinned, 30 %"]), expected(&["thinned, 30 %"], 1));
        assert_eq!(choose(&[], &["thinned, 30 %", "kept"]), expected(&["thinned, 30 %", "kept"], 2));
    }

    #[test]
    fn what_the_inventory_does_not_have_is_refused_with_what_it_has() {
        let none = Surveys::default();
        for (outcome, words) in [
            (choose(&[2000, 2015], &[]), "plot.csv: there is no survey of 2015; its years are 2000, 2010, 2020"),
            (choose(&[2000, 2000], &[]), "the year 2000 is named twice"),
            (
                choose(&[], &["kept,cut"]),
                "plot.csv: there is no variant `cut`; its variants are kept, Felled, thinned, 30 %",
            ),
            (choose(&[], &["kept", "KEPT"]), "the variant `kept` is named twice"),
            (choose(&[], &["kept", ""]), "there is no variant ``"),
            (choose_of(&[2000, 2010], &[], &none), "no column has years of surveys"),
            (choose_of(&[], &["a", "b"], &none), "no column has several variants"),
        ] {
            assert!(outcome.as_ref().is_err_and(|error| error.contains(words)), "{words}: {outcome:?}");
        }
        let many = Surveys { years: (1900..1950).collect(), ..Surveys::default() };
        let outcome = choose_of(&[2000], &[], &many);
        assert!(outcome.is_err_and(|error| error.ends_with("1919 and 30 more")));
    }

    #[test]
    fn a_scene_without_an_inventory_has_no_years() {
        let scene = Scene::default();
        let asked = Beside { years: vec![2000, 2010], variants: Vec::new() };
        let error = Choice::new(&asked, &scene).map_or_else(|error| error.to_string(), |_| String::new());
        assert!(error.contains("its trees are of no inventory"), "{error}");
        let plain = Choice::new(&Beside::default(), &scene);
        assert!(plain.is_ok_and(|choice| choice.columns == 1 && choice.panels == [PanelChoice::default()]));
    }
}
