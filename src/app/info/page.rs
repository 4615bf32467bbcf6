//! Text in two columns: labels and what belongs to them.

use std::fmt::Display;

/// Characters of the column of labels.
const LABELS: usize = 14;

/// A page of text that grows line by line.
#[derive(Debug, Default)]
pub(super) struct Page {
    text: String,
    depth: usize,
}

impl Page {
    pub fn new() -> Self {
        Self::default()
    }

    /// A line of its own; what [`inset`](Self::inset) adds belongs to it.
    pub fn title(&mut self, text: impl Display) {
        self.line("", text);
    }

    /// A label and what belongs to it. Further lines of the text stand below its first.
    pub fn row(&mut self, label: &str, text: impl Display) {
        let text = text.to_string();
        let mut lines = text.lines();
        self.line(&format!("{label:<LABELS$}"), lines.next().unwrap_or(""));
        for line in lines {
            self.line(&" ".repeat(LABELS), line);
        }
    }

    fn line(&mut self, label: &str, text: impl Display) {
        let line = format!("{:indent$}{label}{text}", "", indent = 2 * self.depth);
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    /// Adds what `add` adds two characters further in.
    pub fn inset<T>(&mut self, add: impl FnOnce(&mut Self) -> T) -> T {
        self.depth += 1;
        let result = add(self);
        self.depth -= 1;
        result
    }

    /// All lines.
    pub fn finish(self) -> String {
        self.text
    }
}

/// A length in the unit in which people would say it.
pub(super) fn length(metres: f64) -> String {
    match metres.abs() {
        size if size >= 10_000.0 => format!("{:.1} km", metres * 1e-3),
        size if size >= 2_000.0 => format!("{:.2} km", metres * 1e-3),
        size if size >= 100.0 => format!("{metres:.0} m"),
        size if size >= 10.0 => format!("{metres:.1} m"),
        _ => format!("{metres:.2} m"),
    }
}

/// Latitude and longitude in degrees, as atlases write them.
pub(super) fn place((latitude, longitude): (f64, f64)) -> String {
    let half = |value: f64, positive: char, negative: char| {
        format!("{:.4}° {}", value.abs(), if value < 0.0 { negative } else { positive })
    };
    format!("{}, {}", half(latitude, 'N', 'S'), half(longitude, 'E', 'W'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_places_read_well() {
        assert_eq!(length(6123.4), "6.12 km");
        assert_eq!(length(0.126), "0.13 m");
        assert_eq!(place((36.5, -84.25)), "36.5000° N, 84.2500° W");
    }

    #[test]
    fn rows_line_up_and_insets_end() {
        let mut page = Page::new();
        page.title("a");
        page.inset(|page| page.row("size", "one\ntwo"));
        page.title("b");
        assert_eq!(page.finish(), "a\n  size          one\n                two\nb\n");
    }
}
