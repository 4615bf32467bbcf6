//! Numbers and lengths in the cells of a table.

use super::LengthUnit;
use super::names::{folded, unit_of};

/// Whether a cell says that its value is not known.
pub(super) fn is_missing(cell: &str) -> bool {
    const LIST: [&str; 36] = [
        "",
        "na",
        "n/a",
        "n.a.",
        "nd",
        "n.d.",
        "nan",
        "null",
        "nil",
        "none",
        "-",
        "--",
        "---",
        "?",
        ".",
        "unknown",
        "not recorded",
        "not known",
        "unbekannt",
        "nicht bekannt",
        "keine angabe",
        "k.a.",
        "k. a.",
        "ka",
        "inconnu",
        "inconnue",
        "non renseigne",
        "desconocido",
        "sconosciuto",
        "onbekend",
        "-1",
        "-99",
        "-999",
        "-9999",
        "#n/a",
        "#wert!",
    ];
    let plain = cell.trim();
    if plain.len() > 16 {
        return false;
    }
    let plain = folded(plain);
    LIST.contains(&plain.as_str()) || ["-9999.0", "-999.0", "-99.0", "-1.0"].contains(&plain.as_str())
}

/// A plain number; with a decimal comma where `decimal_comma` allows it. Separators of thousands are not guessed.
pub(super) fn number(cell: &str, decimal_comma: bool) -> Option<f64> {
    let plain = cell.parse::<f64>();
    if plain.is_err() && decimal_comma && cell.matches(',').count() == 1 && !cell.contains('.') {
        return cell.replace(',', ".").parse().ok();
    }
    plain.ok()
}

/// A length as a cell writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Length {
    pub value: f64,
    /// The unit that the cell states.
    pub unit: Option<LengthUnit>,
    /// Whether the cell is a range, whose middle the value is.
    pub range: bool,
    /// Number of values, of which the largest counts: the stems of a tree.
    pub stems: usize,
}

/// A part of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Number(f64),
    Unit(LengthUnit),
    /// `-`, `to`, `bis` between the ends of a range.
    To,
    /// `+`, `/`, `;` between stems.
    And,
}

/// Reads a cell such as `12`, `12,5 m`, `35cm`, `14"`, `5' 6"`, `6-10 m`, `ca. 20`, `< 5 m` or `20+25+30`; `None` if it is
/// something else.
pub(super) fn length(cell: &str, decimal_comma: bool) -> Option<Length> {
    let one = |value: f64| Length { value, unit: None, range: false, stems: 1 };
    if let Some(value) = number(cell, decimal_comma) {
        return Some(one(value));
    }
    let parts = parts(cell, decimal_comma)?;
    let numbers: Vec<f64> =
        parts.iter().filter_map(|part| if let Part::Number(value) = part { Some(*value) } else { None }).collect();
    let units: Vec<LengthUnit> =
        parts.iter().filter_map(|part| if let Part::Unit(unit) = part { Some(*unit) } else { None }).collect();
    let unit = units.last().copied();
    let values = match *numbers.as_slice() {
        [] => return None,
        [value] => one(value),
        [feet, inches] if units == [LengthUnit::Feet, LengthUnit::Inches] => {
            return Some(Length { unit: Some(LengthUnit::Feet), ..one(feet + inches / 12.0) });
        }
        [low, high] if parts.contains(&Part::To) && low <= high => Length { range: true, ..one(0.5 * (low + high)) },
        // Several numbers without a word between them are not understood.
        _ if !parts.contains(&Part::And) => return None,
        _ => Length { stems: numbers.len(), ..one(numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max)) },
    };
    Some(Length { unit, ..values })
}

/// Splits a cell; `None` if it has a word that says something else.
fn parts(cell: &str, decimal_comma: bool) -> Option<Vec<Part>> {
    const ABOUT: [&str; 36] = [
        "ca",
        "circa",
        "env",
        "environ",
        "approx",
        "about",
        "est",
        "estimated",
        "geschatzt",
        "geschaetzt",
        "von",
        "from",
        "de",
        "entre",
        "between",
        "zwischen",
        "uber",
        "ueber",
        "over",
        "under",
        "unter",
        "up",
        "mehr",
        "more",
        "als",
        "than",
        "plus",
        "moins",
        "less",
        "mas",
        "menos",
        "max",
        "min",
        "meer",
        "dan",
        "class",
    ];
    const TO: [&str; 9] = ["to", "bis", "a", "tot", "hasta", "until", "et", "und", "and"];
    let text = folded(cell);
    let mut parts = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        if first.is_ascii_digit()
            || (first == '.' && rest.get(1..).is_some_and(|t| t.starts_with(|c: char| c.is_ascii_digit())))
        {
            let end = rest
                .char_indices()
                .find(|(at, c)| {
                    let decimal = (*c == '.' || *c == ',')
                        && rest.get(at + 1..).is_some_and(|t| t.starts_with(|c: char| c.is_ascii_digit()));
                    !c.is_ascii_digit() && !decimal
                })
                .map_or(rest.len(), |(at, _)| at);
            let digits = rest.get(..end)?;
            let thousands = !decimal_comma && digits.split_once(',').is_some_and(|(_, part)| part.len() == 3);
            if thousands || digits.matches([',', '.']).count() > 1 {
                return None;
            }
            parts.push(Part::Number(digits.replace(',', ".").parse().ok()?));
            rest = rest.get(end..)?;
        } else if first.is_alphabetic() {
            let end = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
            let word = rest.get(..end)?;
            rest = rest.get(end..)?;
            let between = matches!(parts.last(), Some(Part::Number(_) | Part::Unit(_)));
            if let Some(unit) = unit_of(word).filter(|_| matches!(parts.last(), Some(Part::Number(_)))) {
                parts.push(Part::Unit(unit));
            } else if between && TO.contains(&word) {
                parts.push(Part::To);
            } else if between && word == "x" {
                parts.push(Part::And);
            } else if !(ABOUT.contains(&word) || TO.contains(&word) || word.len() == 1 && parts.is_empty()) {
                return None;
            }
        } else {
            let mut ends = rest.char_indices().skip(1).map(|(at, _)| at);
            let after = ends.next().unwrap_or(rest.len());
            match first {
                '-' | '–' | '—' if !parts.is_empty() => parts.push(Part::To),
                '+' | '/' | ';' | '&' | '|' => parts.push(Part::And),
                '"' | '″' | '”' => parts.push(Part::Unit(LengthUnit::Inches)),
                '\'' | '′' | '’' => parts.push(Part::Unit(LengthUnit::Feet)),
                '<' | '>' | '=' | '≤' | '≥' | '~' | '≈' | '±' | '.' | ',' | '(' | ')' | '[' | ']' | ':' => {}
                c if c.is_whitespace() => {}
                _ => return None,
            }
            rest = rest.get(after..)?;
        }
    }
    Some(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_as_people_write_them() {
        use LengthUnit::{Centimetres, Feet, Inches, Metres};
        let read = |cell: &str| length(cell, true).map(|found| (found.value, found.unit, found.range, found.stems));
        for (cell, value, unit) in [
            ("12", 12.0, None),
            ("12,5", 12.5, None),
            ("12 m", 12.0, Some(Metres)),
            ("12,5m", 12.5, Some(Metres)),
            ("35cm", 35.0, Some(Centimetres)),
            ("35 CM", 35.0, Some(Centimetres)),
            ("14\"", 14.0, Some(Inches)),
            ("14 in", 14.0, Some(Inches)),
            ("14 inches", 14.0, Some(Inches)),
            ("30 ft", 30.0, Some(Feet)),
            ("30'", 30.0, Some(Feet)),
            ("ca. 20", 20.0, None),
            ("~20 cm", 20.0, Some(Centimetres)),
            ("< 5 m", 5.0, Some(Metres)),
            ("> 35 m", 35.0, Some(Metres)),
            ("2e1", 20.0, None),
        ] {
            assert_eq!(read(cell), Some((value, unit, false, 1)), "{cell}");
        }
        assert_eq!(read("6-10 m"), Some((8.0, Some(Metres), true, 1)));
        assert_eq!(read("6 – 10 m"), Some((8.0, Some(Metres), true, 1)));
        assert_eq!(read("de 5 à 10 m"), Some((7.5, Some(Metres), true, 1)));
        assert_eq!(read("e. 15 tot 18 m."), Some((16.5, Some(Metres), true, 1)));
        assert_eq!(read("0,3 tot 0,5 m."), Some((0.4, Some(Metres), true, 1)));
        assert_eq!(read("20+25+30"), Some((30.0, None, false, 3)));
        assert_eq!(read("20/25 cm"), Some((25.0, Some(Centimetres), false, 2)));
        assert_eq!(read("5' 6\""), Some((5.5, Some(Feet), false, 1)));
        for cell in ["thick", "1.000,5", "12 trees", "x", "", "3 4", "north"] {
            assert_eq!(read(cell), None, "{cell}");
        }
    }

    #[test]
    fn missing_values_have_many_names() {
        for cell in ["", "NA", " n/a ", "-", "unbekannt", "Non renseigné", "-9999", "-9999.0", "k.A."] {
            assert!(is_missing(cell), "{cell}");
        }
        for cell in ["0", "12", "-4", "Quercus"] {
            assert!(!is_missing(cell), "{cell}");
        }
    }
}
