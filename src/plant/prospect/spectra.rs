//! The constants of leaf tissue over wavelengths, as the program ships them or from a file.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use super::OpticalConstants;

/// The rows of the published table that light up a colour: 400 to 800 nm in steps of 5 nm. MIT licence, © Jean-Baptiste
/// Féret; `assets/spectra/README.md` says where from.
const VISIBLE: &str = include_str!("../../../assets/spectra/prospect_d.tsv");
/// Maximum size of a file: a table of 400 to 2500 nm in steps of 1 nm has 230 kB.
const MAX_BYTES: u64 = 16 << 20;
/// Columns that are needed, by the names that published tables use, each with its position where a file has no names.
const COLUMNS: [(&str, &[&str]); 8] = [
    ("wavelength", &["lambda", "wavelength", "wl", "nm"]),
    ("refractive index", &["nrefrac", "refractive_index", "n", "nr"]),
    ("chlorophyll", &["sac_chl", "chlorophyll", "kab", "kcab"]),
    ("carotenoids", &["sac_car", "carotenoid", "carotenoids", "kcar"]),
    ("anthocyanins", &["sac_ant", "anthocyanin", "anthocyanins", "kant"]),
    ("brown pigments", &["sac_brown", "brown", "kbrown"]),
    ("water", &["sac_ewt", "water", "kw"]),
    ("dry matter", &["sac_lma", "dry_matter", "km"]),
];

/// Optical constants at ascending wavelengths.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectra {
    rows: Vec<OpticalConstants>,
}

/// Why a table of optical constants cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SpectraError {
    /// The file cannot be read.
    #[error("cannot read the spectra {path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is larger than any table of spectra.
    #[error("the spectra {path} have {bytes} bytes, more than any table of a leaf's constants: name another file",
        path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// A line is not a row of the table.
    #[error("{path}:{line}: {message}", path = path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong and what to do.
        message: String,
    },
    /// There are fewer than two rows.
    #[error(
        "{path} has {rows} rows of constants, but a spectrum needs at least 2: it must have a row for each wavelength \
         with {expected}",
        path = path.display(),
        expected = "wavelength, refractive index and the absorption of chlorophyll, carotenoids, anthocyanins, brown pigments, water and dry matter"
    )]
    TooFew {
        /// The file.
        path: PathBuf,
        /// Rows found.
        rows: usize,
    },
}

impl Spectra {
    /// The table that the program ships: 400 to 800 nm in steps of 5 nm.
    pub fn visible() -> &'static Self {
        static SHIPPED: LazyLock<Spectra> = LazyLock::new(|| {
            // The text is valid: a test reads it.
            Spectra::parse(VISIBLE, Path::new("prospect_d.tsv")).unwrap_or(Spectra { rows: Vec::new() })
        });
        &SHIPPED
    }

    /// The constants, by ascending wavelength.
    pub fn rows(&self) -> &[OpticalConstants] {
        &self.rows
    }

    /// Reads a table such as `dataSpec_PRO.txt` of the R package prospect, or `prospect_d_spectra.txt` and
    /// `dataSpec_PDB` of the original programs: a row of numbers for each wavelength, separated by blanks, tabs, commas
    /// or semicolons. Where the first row has names, columns are found by name. Where it has none, they are wavelength
    /// (nm), refractive index, chlorophyll, carotenoids, anthocyanins, brown pigments, water, dry matter; further columns
    /// are ignored. Lines that start with `#` or `%` are comments.
    ///
    /// # Errors
    /// [`SpectraError`] for a file that is missing, too large or no table; with the line where there is one.
    pub fn read(path: &Path) -> Result<Self, SpectraError> {
        let failed = |source| SpectraError::Read { path: path.to_owned(), source };
        let bytes = std::fs::metadata(path).map_err(failed)?.len();
        if bytes > MAX_BYTES {
            return Err(SpectraError::TooLarge { path: path.to_owned(), bytes });
        }
        Self::parse(&std::fs::read_to_string(path).map_err(failed)?, path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, SpectraError> {
        let wrong =
            |line: usize, message: String| SpectraError::Line { path: path.to_owned(), line: line + 1, message };
        let mut columns: Option<[usize; 8]> = None;
        let mut rows: Vec<OpticalConstants> = Vec::new();
        for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with(['#', '%']) {
                continue;
            }
            let fields: Vec<&str> = line
                .split([' ', '\t', ',', ';'])
                .map(|field| field.trim_matches('"'))
                .filter(|f| !f.is_empty())
                .collect();
            let has_names = fields.first().is_some_and(|field| field.parse::<f64>().is_err());
            let order = match columns {
                Some(order) => order,
                None => {
                    let order = if has_names {
                        by_name(&fields).map_err(|message| wrong(number, message))?
                    } else {
                        std::array::from_fn(|column| column)
                    };
                    columns = Some(order);
                    if has_names {
                        continue;
                    }
                    order
                }
            };
            let mut values = [0.0; 8];
            for ((value, column), (name, _)) in values.iter_mut().zip(order).zip(COLUMNS) {
                let Some(field) = fields.get(column) else {
                    return Err(wrong(number, format!("has {} columns; the {name} is missing", fields.len())));
                };
                *value = match field.parse::<f64>() {
                    Ok(number) if number.is_finite() && number >= 0.0 => number,
                    _ => {
                        return Err(wrong(number, format!("`{field}` is not a number from 0 for the {name}")));
                    }
                };
            }
            let [wavelength, refraction, chlorophyll, carotenoid, anthocyanin, brown, water, dry_matter] = values;
            if rows.last().is_some_and(|before| before.wavelength >= wavelength) {
                return Err(wrong(number, format!("the wavelength {wavelength} nm does not follow the one before")));
            }
            if !(1.0..=3.0).contains(&refraction) {
                return Err(wrong(number, format!("the refractive index {refraction} is not between 1 and 3")));
            }
            rows.push(OpticalConstants {
                wavelength,
                refraction,
                chlorophyll,
                carotenoid,
                anthocyanin,
                brown,
                water,
                dry_matter,
            });
        }
        if rows.len() < 2 {
            return Err(SpectraError::TooFew { path: path.to_owned(), rows: rows.len() });
        }
        Ok(Self { rows })
    }
}

/// The position of each needed column in a row of names.
fn by_name(fields: &[&str]) -> Result<[usize; 8], String> {
    let mut order = [0; 8];
    for (place, (what, names)) in order.iter_mut().zip(COLUMNS) {
        *place = fields
            .iter()
            .position(|field| names.iter().any(|name| field.eq_ignore_ascii_case(name)))
            .ok_or_else(|| format!("no column for the {what}: name it {}", names.join(" or ")))?;
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        Spectra::parse(text, Path::new("a.txt")).map_or_else(|error| error.to_string(), |_| "none".into())
    }

    #[test]
    fn the_shipped_table_covers_the_visible_spectrum() {
        let rows = Spectra::visible().rows();
        assert_eq!(rows.len(), 81);
        assert_eq!((rows[0].wavelength, rows[80].wavelength), (400.0, 800.0));
        assert!(rows.windows(2).all(|pair| pair[1].wavelength - pair[0].wavelength == 5.0));
        assert_eq!((rows[0].refraction, rows[0].dry_matter), (1.5115, 109.7));
    }

    #[test]
    fn columns_are_found_by_name_or_by_position() {
        let named = "n;extra;lambda;SAC_CHL;SAC_CAR;SAC_ANT;SAC_BROWN;SAC_EWT;SAC_LMA\n1.5;9;400;1;2;3;4;5;6\n1.4;9;405;1;2;3;4;5;6\n";
        let plain = "# PROSPECT\n% also a comment\n 400 \t 1.5 1 2 3 4 5 6 \n\n405 1.4 1 2 3 4 5 6 7 8\n";
        let parsed = Spectra::parse(named, Path::new("")).unwrap();
        assert_eq!(parsed, Spectra::parse(plain, Path::new("")).unwrap());
        assert_eq!((parsed.rows()[1].refraction, parsed.rows()[1].dry_matter), (1.4, 6.0));
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        assert!(error("").contains("0 rows"));
        assert!(error("400 1.5 1 2 3 4 5 6").contains("1 rows"));
        assert!(error("400 1.5 1 2 3 4 5 6\n400 1.5 1 2 3 4 5 6").contains("a.txt:2: the wavelength 400 nm"));
        assert!(error("400 1.5 1 2 3 4 5").contains("a.txt:1: has 7 columns; the dry matter"));
        assert!(error("lambda nrefrac sac_chl").contains("a.txt:1: no column for the carotenoids"));
        assert!(error("400 1.5 1 2 x 4 5 6").contains("`x` is not a number"));
        assert!(error("400 1.5 1 2 NaN 4 5 6").contains("`NaN`"));
        assert!(error("400 0.5 1 2 3 4 5 6").contains("refractive index 0.5"));
        let missing = Spectra::read(Path::new("/no/such/file")).unwrap_err().to_string();
        assert!(missing.contains("/no/such/file"), "{missing}");
    }
}
