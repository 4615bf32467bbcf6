//! Finds the position of a field's value in a RON text.
//!
//! `serde` hands over values without their positions, so a value that parses but is impossible (a latitude of 100
//! degrees) could only be reported by name. [`Outline`] is a second, independent parse of the same text: it
//! handles RON's brackets, names, strings and comments, is independent of scenes, and answers "where is
//! `species[1].height[0]`?".

use std::collections::HashMap;
use std::fmt;

/// Nesting deeper than any scene; a text beyond it gets no outline rather than a full stack.
const MAX_DEPTH: usize = 128;

/// A position in a text. Lines and columns count from 1, columns in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Position {
    /// The position of byte `offset` of `text` (clamped to the text).
    pub fn of_offset(text: &str, offset: usize) -> Self {
        Self::of_offsets(text.char_indices(), &[offset]).pop().unwrap_or(Self { line: 1, column: 1 })
    }

    /// The positions of byte `offsets` that grow, in a text of these `letters` with their offsets (clamped to the
    /// text). No letter is taken twice, however many offsets there are.
    pub(super) fn of_offsets(letters: impl Iterator<Item = (usize, char)>, offsets: &[usize]) -> Vec<Self> {
        let mut letters = letters.peekable();
        let mut at = Self { line: 1, column: 1 };
        let position = |offset: &usize| {
            while let Some((_, letter)) = letters.next_if(|(before, _)| before < offset) {
                at = if letter == '\n' {
                    Self { line: at.line + 1, column: 1 }
                } else {
                    Self { line: at.line, column: at.column + 1 }
                };
            }
            at
        };
        offsets.iter().map(position).collect()
    }

    /// This position, moved past blanks.
    pub(super) fn past_blanks(self, text: &str) -> Self {
        let offset = self.offset_in(text);
        let rest = text.get(offset..).unwrap_or("");
        Self::of_offset(text, offset + rest.len() - rest.trim_start().len())
    }

    /// The byte offset of this position in `text`; the text's length for one beyond it.
    fn offset_in(self, text: &str) -> usize {
        let line_start: usize = text.split_inclusive('\n').take(self.line.saturating_sub(1)).map(str::len).sum();
        let line = text.get(line_start..).unwrap_or("");
        line_start + line.char_indices().nth(self.column.saturating_sub(1)).map_or(line.len(), |(offset, _)| offset)
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// One value of the text with what it contains.
#[derive(Debug)]
struct Node {
    start: usize,
    /// After its last character.
    end: usize,
    /// The name before a bracket, or a bare name: `Scattered`, `Some`, `true`.
    tag: Option<String>,
    /// `(...)`, `[...]` or `{...}` rather than a single value.
    group: bool,
    /// Values by name, with the offset of the name.
    fields: Vec<(String, usize, Node)>,
    /// The first field of each name.
    by_name: HashMap<String, usize>,
    /// Values without names (list and tuple elements; a map's values follow their keys).
    items: Vec<Node>,
}

/// The positions of everything in a RON text.
#[derive(Debug)]
pub struct Outline<'a> {
    text: &'a str,
    root: Node,
}

impl<'a> Outline<'a> {
    /// Reads `text`; `None` if its brackets or quotes do not match.
    pub fn of(text: &'a str) -> Option<Self> {
        let mut scanner = Scanner { text, at: 0 };
        scanner.skip_blank()?;
        while scanner.rest().starts_with("#!") {
            let length = scanner.rest().find(']')? + 1;
            scanner.at += length;
            scanner.skip_blank()?;
        }
        Some(Self { text, root: scanner.value(0)? })
    }

    /// The byte offset of the value at `path` (fields by name, elements by number: `species[1].height[0]`), or of the
    /// innermost structure on the way to it that the text does contain. Choices are transparent: the fields of
    /// `trees: Scattered(...)` are `trees.min_distance` and so on.
    pub fn offset(&self, path: &str) -> usize {
        let mut node = &self.root;
        for step in path.split(['.', '[']) {
            let child = match step.strip_suffix(']') {
                Some(number) => number.parse().ok().and_then(|number: usize| node.element(number)),
                None => node.field(step),
            };
            match child {
                Some(child) => node = child,
                None => break,
            }
        }
        node.start
    }

    /// The last field called `name` whose name starts before `end`.
    pub fn last_field_before(&self, name: &str, end: Position) -> Option<Position> {
        self.last_before(end, |node, found| {
            found.extend(node.fields.iter().filter(|(field, _, _)| field == name).map(|(_, start, _)| *start));
        })
    }

    /// The last value whose tag (the name before its bracket, or the bare name) is `tag` and that starts before `end`.
    pub fn last_tag_before(&self, tag: &str, end: Position) -> Option<Position> {
        self.last_before(end, |node, found| found.extend((node.tag.as_deref() == Some(tag)).then_some(node.start)))
    }

    /// The last single value (no bracketed group) that starts before `end`.
    pub fn last_leaf_before(&self, end: Position) -> Option<Position> {
        self.last_before(end, |node, found| found.extend((!node.group).then_some(node.start)))
    }

    /// The innermost bracketed group in which `at` lies.
    pub fn group_around(&self, at: Position) -> Option<Position> {
        let group = self.around(at).into_iter().rfind(|node| node.group)?;
        Some(Position::of_offset(self.text, group.start))
    }

    /// The single value in whose middle `at` lies: where it starts, and its text.
    pub fn leaf_around(&self, at: Position) -> Option<(Position, &'a str)> {
        let leaf = self.around(at).pop().filter(|node| !node.group)?;
        Some((Position::of_offset(self.text, leaf.start), self.text.get(leaf.start..leaf.end)?))
    }

    /// Whether `at` lies inside the brackets of a value tagged `tag`, however deep.
    pub fn is_within(&self, tag: &str, at: Position) -> bool {
        self.around(at).iter().any(|node| node.group && node.tag.as_deref() == Some(tag))
    }

    /// The values that contain `at` after their first character, from the outermost to the innermost.
    fn around(&self, at: Position) -> Vec<&Node> {
        let at = at.offset_in(self.text);
        let contains = |node: &&Node| node.start < at && at < node.end;
        let mut chain: Vec<&Node> = Some(&self.root).filter(contains).into_iter().collect();
        while let Some(inner) = chain.last().and_then(|node| node.children().find(contains)) {
            chain.push(inner);
        }
        chain
    }

    fn last_before(&self, end: Position, mut pick: impl FnMut(&Node, &mut Vec<usize>)) -> Option<Position> {
        let end = end.offset_in(self.text);
        let mut offsets = Vec::new();
        let mut open = vec![&self.root];
        while let Some(node) = open.pop() {
            pick(node, &mut offsets);
            open.extend(node.children());
        }
        let last = offsets.into_iter().filter(|offset| *offset < end).max()?;
        Some(Position::of_offset(self.text, last))
    }
}

impl Node {
    fn leaf(start: usize, end: usize, tag: Option<String>) -> Self {
        Self { start, end, tag, group: false, fields: Vec::new(), by_name: HashMap::new(), items: Vec::new() }
    }

    fn push_field(&mut self, name: String, start: usize, value: Self) {
        self.by_name.entry(name.clone()).or_insert(self.fields.len());
        self.fields.push((name, start, value));
    }

    fn children(&self) -> impl Iterator<Item = &Node> {
        self.items.iter().chain(self.fields.iter().map(|(_, _, value)| value))
    }

    /// `Some(x)` and `Choice((x: ...))` stand for what they wrap.
    fn wrapped(&self) -> Option<&Node> {
        match (self.tag.as_deref(), self.fields.len(), self.items.as_slice()) {
            (Some(_), 0, [only]) => Some(only),
            _ => None,
        }
    }

    fn field(&self, name: &str) -> Option<&Node> {
        let named = self.by_name.get(name).and_then(|at| self.fields.get(*at)).map(|(_, _, value)| value);
        named.or_else(|| self.wrapped().and_then(|inner| inner.field(name)))
    }

    fn element(&self, number: usize) -> Option<&Node> {
        match self.wrapped().filter(|inner| inner.group) {
            Some(inner) => inner.element(number),
            None => self.items.get(number),
        }
    }
}

struct Scanner<'a> {
    text: &'a str,
    at: usize,
}

impl Scanner<'_> {
    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or("")
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        if found {
            self.at += wanted.len_utf8();
        }
        found
    }

    /// Skips white space, `// line` and nested `/* block */` comments.
    fn skip_blank(&mut self) -> Option<()> {
        loop {
            let rest = self.rest();
            let trimmed = rest.trim_start();
            self.at += rest.len() - trimmed.len();
            if self.rest().starts_with("//") {
                self.at += self.rest().find('\n').unwrap_or(self.rest().len());
            } else if self.rest().starts_with("/*") {
                self.block_comment()?;
            } else {
                return Some(());
            }
        }
    }

    fn block_comment(&mut self) -> Option<()> {
        let mut depth = 0_usize;
        loop {
            if self.rest().starts_with("/*") {
                depth += 1;
                self.at += 2;
            } else if self.rest().starts_with("*/") {
                depth -= 1;
                self.at += 2;
                if depth == 0 {
                    return Some(());
                }
            } else {
                self.at += self.peek()?.len_utf8();
            }
        }
    }

    fn name(&mut self) -> Option<String> {
        let rest = self.rest();
        let rest = rest.strip_prefix("r#").filter(|rest| !rest.starts_with(['"', '#'])).unwrap_or(rest);
        let skipped = self.rest().len() - rest.len();
        let first = rest.chars().next().filter(|letter| letter.is_alphabetic() || *letter == '_')?;
        let length = rest.find(|letter: char| !(letter.is_alphanumeric() || letter == '_')).unwrap_or(rest.len());
        let length = length.max(first.len_utf8());
        let name = rest.get(..length)?.to_owned();
        self.at += skipped + length;
        Some(name)
    }

    fn value(&mut self, depth: usize) -> Option<Node> {
        if depth > MAX_DEPTH {
            return None;
        }
        let start = self.at;
        match self.peek()? {
            '"' => self.quoted().map(|()| Node::leaf(start, self.at, None)),
            '\'' => self.character().map(|()| Node::leaf(start, self.at, None)),
            '(' | '[' | '{' => self.group(start, None, depth),
            _ if self.raw_text()? => Some(Node::leaf(start, self.at, None)),
            'b' if self.rest().starts_with("b\"") => {
                self.at += 1;
                self.quoted().map(|()| Node::leaf(start, self.at, None))
            }
            letter if letter.is_alphabetic() || letter == '_' => {
                let tag = self.name()?;
                let after_name = self.at;
                self.skip_blank()?;
                if self.peek() == Some('(') {
                    self.group(start, Some(tag), depth)
                } else {
                    self.at = after_name;
                    Some(Node::leaf(start, self.at, Some(tag)))
                }
            }
            _ => {
                let end = |letter: char| letter.is_whitespace() || ",:()[]{}\"/".contains(letter);
                let length = self.rest().find(end).unwrap_or(self.rest().len());
                self.at += length;
                (length > 0).then(|| Node::leaf(start, self.at, None))
            }
        }
    }

    fn quoted(&mut self) -> Option<()> {
        self.at += 1;
        loop {
            let letter = self.peek()?;
            self.at += letter.len_utf8();
            match letter {
                '"' => return Some(()),
                '\\' => self.at += self.peek()?.len_utf8(),
                _ => {}
            }
        }
    }

    fn character(&mut self) -> Option<()> {
        self.at += 1;
        if self.take('\\') {
            self.at += self.peek()?.len_utf8();
        }
        self.at += self.rest().find('\'')? + 1;
        Some(())
    }

    /// Skips `r"..."`, `r#"..."#` and their byte forms; false if none starts here.
    fn raw_text(&mut self) -> Option<bool> {
        let rest = self.rest();
        let Some(after) = rest.strip_prefix("br").or_else(|| rest.strip_prefix('r')) else { return Some(false) };
        let hashes = after.len() - after.trim_start_matches('#').len();
        let Some(body) = after.get(hashes..).and_then(|after| after.strip_prefix('"')) else { return Some(false) };
        let close = format!("\"{}", "#".repeat(hashes));
        let length = rest.len() - body.len() + body.find(&close)? + close.len();
        self.at += length;
        Some(true)
    }

    fn group(&mut self, start: usize, tag: Option<String>, depth: usize) -> Option<Node> {
        let close = match self.peek()? {
            '(' => ')',
            '[' => ']',
            _ => '}',
        };
        self.at += 1;
        let mut node = Node { group: true, ..Node::leaf(start, start, tag) };
        loop {
            self.skip_blank()?;
            if self.take(close) {
                node.end = self.at;
                return Some(node);
            }
            let element_start = self.at;
            let named = match self.name() {
                Some(name) => {
                    self.skip_blank()?;
                    self.take(':').then_some(name)
                }
                None => None,
            };
            match named {
                Some(name) => {
                    self.skip_blank()?;
                    let value = self.value(depth + 1)?;
                    node.push_field(name, element_start, value);
                }
                None => {
                    self.at = element_start;
                    let value = self.value(depth + 1)?;
                    self.skip_blank()?;
                    if self.take(':') {
                        self.map_value(element_start, value, &mut node, depth)?;
                    } else {
                        node.items.push(value);
                    }
                }
            }
            self.skip_blank()?;
            if !self.take(',') && self.peek() != Some(close) {
                return None;
            }
        }
    }

    /// The value after a map's key: a field named as the key is written, without its quotes.
    fn map_value(&mut self, key_start: usize, key: Node, node: &mut Node, depth: usize) -> Option<()> {
        let written = self.text.get(key.start..self.at)?.trim_end_matches(':').trim_end();
        let name = written.trim_matches('"').to_owned();
        self.skip_blank()?;
        let value = self.value(depth + 1)?;
        node.push_field(name, key_start, value);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r###"#![enable(implicit_some)]
// a comment with ( brackets
Scene(
    name: "quotes \" and (brackets", /* nested /* comment */ , */
    raw: r#"a " b"#,
    trees: Scattered(
        area: Some((west: -1, east: 2)), min: 3.5,
    ),
    species: [
        (name: "a", height: (12, 24)),
        (name: "ü", height: (
            1,
            2)),
    ],
    map: { "x y": 'c', "z": true },
)
"###;

    fn position(path: &str) -> (usize, usize) {
        let at = Outline::of(TEXT).map(|outline| Position::of_offset(TEXT, outline.offset(path)));
        at.map_or((0, 0), |at| (at.line, at.column))
    }

    #[test]
    fn finds_values_behind_comments_texts_and_wrappers() {
        assert_eq!(position("name"), (4, 11));
        assert_eq!(position("raw"), (5, 10));
        assert_eq!(position("trees"), (6, 12));
        assert_eq!(position("trees.area.east"), (7, 37));
        assert_eq!(position("trees.min"), (7, 47));
        assert_eq!(position("species[0].height[1]"), (10, 34));
        assert_eq!(position("species[1].height"), (11, 29));
        assert_eq!(position("species[1].height[1]"), (13, 13));
        assert_eq!(position("map.z"), (15, 29));
    }

    #[test]
    fn a_missing_value_is_reported_at_its_structure() {
        assert_eq!(position("trees.absent"), (6, 12));
        assert_eq!(position("species[7].name"), (9, 14));
        assert_eq!(position("absent"), (3, 1));
    }

    #[test]
    fn broken_texts_have_no_outline_and_do_not_hang_or_overflow() {
        for text in ["", "(", "(a: \"", "[1, 2", "/* open", "(a: r#\"x\")", "(a b)", "'"] {
            assert!(Outline::of(text).is_none(), "{text}");
        }
        assert!(Outline::of(&"(".repeat(1_000_000)).is_none());
    }

    #[test]
    fn a_text_is_searched_once_for_all_its_positions() {
        let text = "(\n  ü: 1,\n".repeat(10_000);
        let offsets: Vec<usize> = (0..20_000).map(|line| 6 * line).collect();
        let mut taken = 0;
        let positions = Position::of_offsets(text.char_indices().inspect(|_| taken += 1), &offsets);
        assert!(taken <= text.len(), "{taken} letters of {}", text.len());
        for (offset, position) in offsets.iter().zip(positions).step_by(997) {
            assert_eq!(Position::of_offset(&text, *offset), position);
        }
    }

    #[test]
    fn last_before_takes_the_nearest_occurrence() {
        let outline = Outline::of("(a: (x: 1), b: (x: 2), c: (x: 3))");
        let end = Position { line: 1, column: 20 };
        assert_eq!(outline.and_then(|o| o.last_field_before("x", end)), Some(Position { line: 1, column: 17 }));
    }
}
