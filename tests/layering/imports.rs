//! Which module names which: the paths that begin with `crate`, `super`, `self`, `canopy` or a module beside, in `use`
//! declarations and everywhere else in the code. Comments, strings and macros' definitions are no imports, tests are.

use std::collections::BTreeSet;

/// A place in the code that names something of the crate.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Import {
    /// The file, relative to `src`, with forward slashes.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// The full path from the crate's root, such as `["bake", "cache", "Cache"]`. Globs end before the `*`.
    pub path: Vec<String>,
}

/// The module that `file` (relative to `src`) defines, from the crate's root: `bake/mod.rs` is `["bake"]`.
pub fn module_of(file: &str) -> Vec<String> {
    let mut parts: Vec<String> = file.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if matches!(parts.last().map(String::as_str), Some("mod")) || file == "lib.rs" || file == "main.rs" {
        parts.pop();
    }
    parts
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String),
    /// `::`
    Path,
    Other(char),
}

/// The code's words and signs, with their lines; without comments and what is between quotes.
fn tokens(source: &str) -> Vec<(usize, Token)> {
    let characters: Vec<char> = source.chars().collect();
    let at = |index: usize| characters.get(index).copied().unwrap_or('\0');
    let mut found = Vec::new();
    let (mut i, mut line) = (0, 1);
    // Steps over everything up to `end`, counting lines.
    let skip = |i: &mut usize, line: &mut usize, end: usize| {
        let end = end.min(characters.len());
        *line += characters[*i..end].iter().filter(|c| **c == '\n').count();
        *i = end;
    };
    while i < characters.len() {
        let c = characters[i];
        if c == '/' && at(i + 1) == '/' {
            let end = (i..characters.len()).find(|&k| at(k) == '\n').unwrap_or(characters.len());
            skip(&mut i, &mut line, end);
        } else if c == '/' && at(i + 1) == '*' {
            let (mut depth, mut k) = (1, i + 2);
            while depth > 0 && k < characters.len() {
                match (at(k), at(k + 1)) {
                    ('/', '*') => (depth, k) = (depth + 1, k + 2),
                    ('*', '/') => (depth, k) = (depth - 1, k + 2),
                    _ => k += 1,
                }
            }
            skip(&mut i, &mut line, k);
        } else if c.is_alphabetic() || c == '_' {
            let end = (i..characters.len()).find(|&k| !(at(k).is_alphanumeric() || at(k) == '_'));
            let end = end.unwrap_or(characters.len());
            let word: String = characters[i..end].iter().collect();
            let hashes = (end..characters.len()).take_while(|&k| at(k) == '#').count();
            if matches!(word.as_str(), "r" | "br") && at(end + hashes) == '"' {
                let close: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
                let start = end + hashes + 1;
                let k = (start..characters.len()).find(|&k| characters[k..].starts_with(&close));
                skip(&mut i, &mut line, k.map_or(characters.len(), |k| k + close.len()));
            } else {
                found.push((line, Token::Word(word)));
                i = end;
            }
        } else if c == '"' {
            let mut k = i + 1;
            while k < characters.len() && at(k) != '"' {
                k += 1 + usize::from(at(k) == '\\');
            }
            skip(&mut i, &mut line, k + 1);
        } else if c == '\'' && (at(i + 1) == '\\' || at(i + 2) == '\'') {
            // A character; anything else after a quote is a lifetime.
            let start = if at(i + 1) == '\\' { i + 3 } else { i + 2 };
            let end = (start..characters.len()).find(|&k| at(k) == '\'').unwrap_or(characters.len());
            skip(&mut i, &mut line, end + 1);
        } else if c == ':' && at(i + 1) == ':' {
            found.push((line, Token::Path));
            i += 2;
        } else {
            if c == '\n' {
                line += 1;
            } else if !c.is_whitespace() {
                found.push((line, Token::Other(c)));
            }
            i += 1;
        }
    }
    found
}

/// Everything of the crate that `source`, the text of `file`, names. `modules` are those of the crate's files: of these the
/// ones below a module can be named without `self`.
pub fn imports(file: &str, source: &str, modules: &BTreeSet<Vec<String>>) -> Vec<Import> {
    let tokens = tokens(source);
    let mut reader = Reader { file, tokens: &tokens, modules, found: Vec::new() };
    // The module that each open inline module has, and the depth of braces at which it began.
    let mut module = module_of(file);
    let mut open: Vec<usize> = Vec::new();
    let mut depth = 0;
    let mut i = 0;
    while i < tokens.len() {
        match &tokens[i].1 {
            Token::Other('{') => depth += 1,
            Token::Other('}') => {
                depth -= 1;
                if open.last() == Some(&depth) {
                    open.pop();
                    module.pop();
                }
            }
            Token::Word(word) => {
                if word == "mod"
                    && let (Some((_, Token::Word(name))), Some((_, Token::Other('{')))) =
                        (tokens.get(i + 1), tokens.get(i + 2))
                {
                    module.push(name.clone());
                    open.push(depth);
                    depth += 1;
                    i += 3;
                    continue;
                }
                let continues = i > 0 && tokens[i - 1].1 == Token::Path;
                if !continues && let Some(next) = reader.path(i, &module) {
                    i = next;
                    continue;
                }
            }
            _ => {}
        }
        i += 1;
    }
    reader.found.sort();
    reader.found.dedup();
    reader.found
}

struct Reader<'a> {
    file: &'a str,
    tokens: &'a [(usize, Token)],
    modules: &'a BTreeSet<Vec<String>>,
    found: Vec<Import>,
}

impl Reader<'_> {
    fn word(&self, index: usize) -> Option<&str> {
        match self.tokens.get(index) {
            Some((_, Token::Word(word))) => Some(word),
            _ => None,
        }
    }

    fn is(&self, index: usize, token: &Token) -> bool {
        self.tokens.get(index).is_some_and(|(_, found)| found == token)
    }

    /// Reads the path or tree of paths that begins with the word at `index`, inside `module`. Where it ends; `None` where it is
    /// none of the crate's.
    fn path(&mut self, index: usize, module: &[String]) -> Option<usize> {
        if !self.is(index + 1, &Token::Path) {
            return None;
        }
        let mut base = module.to_vec();
        let mut next = index;
        match self.word(index)? {
            "crate" | "canopy" => base.clear(),
            "self" => {}
            "super" => {
                base.pop();
                while self.word(next + 2) == Some("super") {
                    base.pop();
                    next += 2;
                }
            }
            first => {
                base.push(first.to_owned());
                if !self.modules.contains(&base) {
                    return None;
                }
            }
        }
        Some(self.rest(next + 1, base))
    }

    /// Reads what follows a path so far, `base`, from the token at `index` on.
    fn rest(&mut self, index: usize, mut base: Vec<String>) -> usize {
        let mut i = index;
        while self.is(i, &Token::Path) {
            if let Some(word) = self.word(i + 1) {
                base.push(word.to_owned());
                i += 2;
            } else if self.is(i + 1, &Token::Other('{')) {
                return self.tree(i + 2, &base);
            } else {
                // A glob, or generic arguments.
                self.add(i, base);
                return i + 1;
            }
        }
        self.add(i - 1, base);
        i
    }

    /// Reads the branches between the braces of a tree, of which the first token is at `index`.
    fn tree(&mut self, index: usize, base: &[String]) -> usize {
        let mut i = index;
        loop {
            match self.tokens.get(i).map(|(_, token)| token.clone()) {
                Some(Token::Word(word)) if word == "as" => i += 2,
                Some(Token::Word(word)) => {
                    let mut path = base.to_vec();
                    if word != "self" {
                        path.push(word);
                    }
                    i = self.rest(i + 1, path);
                }
                Some(Token::Other('}')) => return i + 1,
                Some(Token::Other('*')) => {
                    self.add(i, base.to_vec());
                    i += 1;
                }
                Some(_) => i += 1,
                None => return i,
            }
        }
    }

    fn add(&mut self, index: usize, path: Vec<String>) {
        let line = self.tokens.get(index).map_or(0, |(line, _)| *line);
        self.found.push(Import { file: self.file.to_owned(), line, path });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(file: &str, source: &str) -> Vec<(usize, String)> {
        let modules = [vec!["render", "gpu"], vec!["render", "frame"], vec!["render", "frame", "light"]];
        let modules = modules.into_iter().map(|path| path.into_iter().map(str::to_owned).collect()).collect();
        imports(file, source, &modules).into_iter().map(|import| (import.line, import.path.join("::"))).collect()
    }

    #[test]
    fn all_forms_of_paths_are_read() {
        let source = r##"
            //! [`crate::app::fly`] is a link.
            use crate::{light::{LightState, sh::{self, basis as b}}, bake::BakedPlant};
            pub(crate) use super::super::terrain::*;
            fn f<'a>(x: &'a crate::plant::Plant) -> char {
                let text = "crate::scene::Scene"; /* crate::scene /* nested */ */
                let raw = r#"use crate::scene::"Scene"#;
                light::beam(std::f32::consts::PI, '"');
                self::light::beam('\'')
            }
            mod tests { use super::*; use super::super::gpu; use crate::lod::FadeBand; }
        "##;
        let expected = [
            (3, "bake::BakedPlant"),
            (3, "light::LightState"),
            (3, "light::sh"),
            (3, "light::sh::basis"),
            (4, "terrain"),
            (5, "plant::Plant"),
            (8, "render::frame::light::beam"),
            (9, "render::frame::light::beam"),
            (11, "lod::FadeBand"),
            (11, "render::frame"),
            (11, "render::gpu"),
        ];
        let found = found("render/frame/mod.rs", source);
        let found: Vec<(usize, &str)> = found.iter().map(|(line, path)| (*line, path.as_str())).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn files_have_their_modules() {
        for (file, module) in
            [("lib.rs", ""), ("main.rs", ""), ("files.rs", "files"), ("a/mod.rs", "a"), ("a/b.rs", "a::b")]
        {
            assert_eq!(module_of(file).join("::"), module, "{file}");
        }
    }
}
