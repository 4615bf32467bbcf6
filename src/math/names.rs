//! Names that people write: which there are, their words, and what a misspelt one was meant to be.

/// The names among which a text is chosen. A field of a setting that can be reflected states them as an attribute,
/// `#[reflect(@Names(&["rough", "smooth"]))]`, and a panel lists them.
#[derive(Clone, Copy, Debug, PartialEq, bevy::reflect::Reflect)]
#[reflect(from_reflect = false)]
pub struct Names(#[reflect(ignore)] pub &'static [&'static str]);

/// The name of `known` with the least edit distance from `name`, whatever their case; of equally near ones the first.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let letters = |name: &str| name.trim().to_lowercase().chars().collect::<Vec<_>>();
    let found = letters(name);
    known.into_iter().min_by_key(|known| edit_distance(&found, &letters(known)))
}

/// The words of a name, each made plain (its case, its accents): runs of letters and digits, split also where a small letter
/// meets a capital one.
pub fn words(name: &str, plain: impl Fn(&str) -> String) -> Vec<String> {
    let mut split = String::with_capacity(name.len() + 4);
    let mut before = ' ';
    for c in name.chars() {
        if c.is_uppercase() && before.is_lowercase() {
            split.push(' ');
        }
        split.push(c);
        before = c;
    }
    plain(&split).split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// Number of insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b` [Damerau 1964].
pub fn edit_distance(a: &[char], b: &[char]) -> usize {
    let width = b.len() + 1;
    let mut table = vec![0_usize; (a.len() + 1) * width];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            table[i * width + j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replace = table[(i - 1) * width + j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let mut best = replace.min(table[(i - 1) * width + j] + 1).min(table[i * width + j - 1] + 1);
                if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    best = best.min(table[(i - 2) * width + j - 2] + 1);
                }
                best
            }
        }
    }
    table[a.len() * width + b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_the_edits() {
        let letters = |name: &str| name.chars().collect::<Vec<_>>();
        for (a, b, edits) in
            [("", "", 0), ("", "abc", 3), ("sepai", "sepia", 1), ("natral", "natural", 1), ("ab", "cd", 2)]
        {
            let [a, b] = [a, b].map(letters);
            assert_eq!((edit_distance(&a, &b), edit_distance(&b, &a)), (edits, edits));
        }
    }

    #[test]
    fn the_nearest_name_is_suggested() {
        let known = ["natural", "sepia", "cool-to-warm"];
        assert_eq!(nearest("Sepai", known), Some("sepia"));
        assert_eq!(nearest("cool to warm", known), Some("cool-to-warm"));
        assert_eq!(nearest("anything", []), None);
    }
}
