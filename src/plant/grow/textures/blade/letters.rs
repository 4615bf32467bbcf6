//! Letters as strokes, to be stamped into a leaf.

use glam::Vec2;

/// The letters that can be stamped; others are left out.
pub const LETTERS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 -";

/// Whether `letter` can be stamped; small letters become capitals.
pub fn can_stamp(letter: char) -> bool {
    LETTERS.contains(letter.to_ascii_uppercase())
}

/// Width of a letter with its gap, in heights of a letter.
const ADVANCE: f32 = 0.86;

/// The strokes of a letter: polylines of points `xy`, x 0..4 to the right and y 0..6 upwards.
fn strokes(letter: char) -> &'static str {
    match letter.to_ascii_uppercase() {
        'A' => "00 26 40|12 32",
        'B' => "00 06 26 35 34 23 03|23 33 42 41 30 00",
        'C' => "41 30 10 01 05 16 36 45",
        'D' => "00 06 26 44 42 20 00",
        'E' => "40 00 06 46|03 33",
        'F' => "00 06 46|03 33",
        'G' => "45 36 16 05 01 10 30 41 43 23",
        'H' => "00 06|40 46|03 43",
        'I' => "20 26",
        'J' => "01 10 20 31 36",
        'K' => "00 06|46 02|13 40",
        'L' => "06 00 40",
        'M' => "00 06 23 46 40",
        'N' => "00 06 40 46",
        'O' => "10 01 05 16 36 45 41 30 10",
        'P' => "00 06 36 45 44 33 03",
        'Q' => "10 01 05 16 36 45 41 30 10|22 40",
        'R' => "00 06 36 45 44 33 03|23 40",
        'S' => "01 10 30 41 42 33 13 04 05 16 36 45",
        'T' => "06 46|26 20",
        'U' => "06 01 10 30 41 46",
        'V' => "06 20 46",
        'W' => "06 10 24 30 46",
        'X' => "00 46|06 40",
        'Y' => "06 23 46|23 20",
        'Z' => "06 46 00 40",
        '0' => "10 01 05 16 36 45 41 30 10|01 45",
        '1' => "05 26 20|10 30",
        '2' => "05 16 36 45 44 00 40",
        '3' => "05 16 36 45 44 33 13|33 42 41 30 10 01",
        '4' => "30 36 02 42",
        '5' => "46 06 03 33 42 41 30 10 01",
        '6' => "36 16 05 01 10 30 41 42 33 03",
        '7' => "06 46 10",
        '8' => "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
        '9' => "10 30 41 45 36 16 05 04 13 43",
        '-' => "03 43",
        _ => "",
    }
}

/// Distance of `at` from the nearest stroke of `text`, in heights of a letter. The text is centred at the origin, x along
/// its line, y upwards.
pub(super) fn distance(text: &str, at: Vec2) -> f32 {
    let count = text.chars().count() as f32;
    let mut nearest = f32::MAX;
    for (index, letter) in text.chars().enumerate() {
        let origin = Vec2::new((index as f32 - 0.5 * count) * ADVANCE + 0.5 * (ADVANCE - 4.0 / 6.0), -0.5);
        for line in strokes(letter).split('|') {
            let mut before = None;
            for point in line.split(' ') {
                let mut digits = point.bytes().map(|digit| f32::from(digit.saturating_sub(b'0')) / 6.0);
                let (Some(x), Some(y)) = (digits.next(), digits.next()) else { continue };
                let end = origin + Vec2::new(x, y);
                let start = before.unwrap_or(end);
                let (edge, to) = (end - start, at - start);
                let t = (to.dot(edge) / edge.length_squared().max(1e-12)).clamp(0.0, 1.0);
                nearest = nearest.min(to.distance(edge * t));
                before = Some(end);
            }
        }
    }
    nearest
}

/// Width of a text in heights of a letter.
pub(super) fn width(text: &str) -> f32 {
    text.chars().count() as f32 * ADVANCE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_has_strokes_of_its_own() {
        let mut seen = std::collections::BTreeSet::new();
        for letter in LETTERS.chars() {
            assert!(can_stamp(letter) && can_stamp(letter.to_ascii_lowercase()));
            assert!(seen.insert(strokes(letter)), "{letter}");
        }
        assert!(!can_stamp('é') && !can_stamp('|'));
    }

    #[test]
    fn a_text_is_centred() {
        // The bar of an I runs through the middle.
        assert!(distance("I", Vec2::ZERO) < 0.05);
        assert!(distance("OO", Vec2::ZERO) > 0.05);
        assert_eq!(distance("", Vec2::ZERO), f32::MAX);
        assert_eq!(width("ABC"), 3.0 * ADVANCE);
    }
}
