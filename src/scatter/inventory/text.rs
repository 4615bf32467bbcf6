//! From bytes to a table of text: encodings, separators, the header line.

use csv::StringRecord;

use super::super::ScatterError;
use super::names;
use super::place;

/// A table of text.
pub(super) struct Table {
    pub header: StringRecord,
    pub rows: Vec<Row>,
    /// Rows with another number of cells than the header: line and number of cells.
    pub ragged: Vec<(u64, usize)>,
    /// Whether a comma between digits is a decimal sign.
    pub decimal_comma: bool,
    /// The EPSG code of the coordinates, if the file states it.
    pub epsg: Option<u32>,
    /// What had to be assumed about the text.
    pub notes: Vec<String>,
}

/// A row of a table.
pub(super) struct Row {
    pub line: u64,
    pub cells: StringRecord,
}

/// Lines at the beginning of a file among which the header is looked for.
const PREAMBLE: usize = 40;

/// Formats that are no text, by their first bytes, with the way to a table.
const BINARY: &[(&[u8], &str)] = &[
    #[cfg(not(feature = "geopackage"))]
    (
        b"SQLite format 3\0",
        "a GeoPackage, which a program with the cargo feature `geopackage` reads, or another SQLite database",
    ),
    (b"PK\x03\x04", "a ZIP archive, such as a spreadsheet (.xlsx, .ods) or a packed shapefile"),
    (b"\xD0\xCF\x11\xE0", "a spreadsheet of an old Excel (.xls)"),
    (b"\x00\x00\x27\x0A", "a shapefile without the files beside it"),
    (b"fgb\x03", "a FlatGeobuf file"),
    (b"PAR1", "a Parquet file"),
];

/// Reads the table in the bytes of a text file called `name`.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Table, ScatterError> {
    let record = |line: u64, message: String| ScatterError::Record { name: name.to_owned(), line, message };
    if let Some((_, what)) = BINARY.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        let message = format!(
            "the file is {what}, not a table of text: export it as CSV or GeoJSON (`ogr2ogr -f GeoJSON trees.geojson FILE`)"
        );
        return Err(record(1, message));
    }
    let text = decode(bytes);
    let lines: Vec<&str> = text.lines().take(PREAMBLE).collect();
    let mut notes = Vec::new();

    // A line `sep=;` is a hint for Excel.
    let hint = lines.iter().position(|line| !line.trim().is_empty()).and_then(|at| Some((at, hinted(lines.get(at)?)?)));
    let first = hint.map_or(0, |(at, _)| at + 1);
    let found = header_line(&lines, first, hint.map(|(_, separator)| separator));
    let (at, commented) = found.unwrap_or((first, false));
    let line = lines.get(at).copied().unwrap_or("");
    let header_text = if commented { line.trim_start_matches(['#', ' ', '\t']) } else { line };
    let separator = hint.map_or_else(|| separator(header_text), |(_, separator)| separator);
    if at > first && !commented {
        let skipped = lines.iter().take(at).skip(first).filter(|line| !is_blank(line)).count();
        if skipped > 0 {
            notes.push(format!("{skipped} line(s) before the header in line {} are not used", at + 1));
        }
    }

    // The header and what follows it; lines of a comment become empty, so that positions stay those of the file.
    let start = text.split_inclusive('\n').take(at).map(str::len).sum::<usize>();
    let mut body = text.get(start..).unwrap_or("").to_owned();
    if commented {
        let marks = line.len() - header_text.len();
        body = format!("{}{}", " ".repeat(marks), body.get(marks..).unwrap_or(""));
    }
    if separator == b' ' {
        body = body.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ") + "\n").collect();
    }
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(body.as_bytes());
    let unreadable = |error: &csv::Error| {
        let line = line_of(error.position(), &body, at);
        record(line, format!("{error}: the file must be a table of text with one header line"))
    };
    let header = reader.headers().map_err(|error| unreadable(&error))?.clone();
    let width =
        (0..header.len()).rfind(|at| header.get(*at).is_some_and(|cell| !cell.is_empty())).map_or(1, |at| at + 1);
    let (mut rows, mut ragged) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let cells = record.map_err(|error| unreadable(&error))?;
        if cells.iter().all(str::is_empty) {
            continue;
        }
        let line = line_of(cells.position(), &body, at);
        // Cells behind the header that are empty come from a separator at the end of the line.
        let surplus = cells.iter().skip(width.max(header.len())).any(|cell| !cell.is_empty());
        if cells.len() < width || surplus {
            ragged.push((line, cells.len()));
        } else {
            rows.push(Row { line, cells });
        }
    }
    let decimal_comma = separator != b',' || has_decimal_commas(&rows);
    Ok(Table { header, rows, ragged, decimal_comma, epsg: None, notes })
}

/// The text: UTF-16 by its byte-order mark or its zeros, UTF-8 with or without a mark, otherwise Windows-1252. Line
/// ends are those of Unix: the reader would assign the two halves of CRLF to different records.
pub(super) fn decode(bytes: &[u8]) -> String {
    let wide = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect::<String>()
    };
    let text = match bytes {
        [0xFF, 0xFE, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => wide(rest, u16::from_be_bytes),
        // Latin letters without a mark: every second byte is zero.
        [a, 0, b, 0, ..] if *a != 0 && *b != 0 => wide(bytes, u16::from_le_bytes),
        [0, a, 0, b, ..] if *a != 0 && *b != 0 => wide(bytes, u16::from_be_bytes),
        _ => {
            let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
            std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|&b| windows_1252(b)).collect(), str::to_owned)
        }
    };
    if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text }
}

/// A letter of the code page of western Windows [WHATWG Encoding Standard, windows-1252].
fn windows_1252(byte: u8) -> char {
    const UPPER: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9F => UPPER.get(usize::from(byte - 0x80)).copied().unwrap_or(char::from(byte)),
        _ => char::from(byte),
    }
}

fn is_blank(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with('#')
}

/// The separator that a line such as `sep=;` names.
fn hinted(line: &str) -> Option<u8> {
    let line = line.trim_start_matches('\u{feff}').trim_matches('"');
    let start = line.get(..4)?;
    if !start.eq_ignore_ascii_case("sep=") {
        return None;
    }
    match line.get(4..)?.trim_end_matches('\n') {
        "\\t" | "\t" => Some(b'\t'),
        one => one.bytes().next().filter(|_| one.trim_end().len() <= 1).filter(u8::is_ascii),
    }
}

/// The index of the header among the lines from `first` on, and whether it is a comment. A header has columns of a
/// position. The first line that has them is it; otherwise the first line that is not blank.
fn header_line(lines: &[&str], first: usize, separator: Option<u8>) -> Option<(usize, bool)> {
    let mut plain = None;
    let mut comment = None;
    for (at, line) in lines.iter().enumerate().skip(first) {
        if line.trim().is_empty() {
            continue;
        }
        let uncommented = line.trim_start_matches(['#', ' ', '\t']);
        if line.starts_with('#') {
            if has_position(uncommented, separator) {
                comment = Some(at);
            }
            continue;
        }
        if has_position(line, separator) {
            return Some((at, false));
        }
        // Numbers below a comment that names columns: the comment is the header.
        if plain.is_none() {
            if let Some(comment) = comment {
                return Some((comment, true));
            }
            plain = Some(at);
        }
    }
    plain.map(|at| (at, false))
}

fn has_position(line: &str, separator: Option<u8>) -> bool {
    let separator = separator.unwrap_or_else(|| self::separator(line));
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(line.as_bytes());
    let Some(Ok(cells)) = reader.records().next() else { return false };
    let named = |cell: &str| cell.chars().any(char::is_alphabetic) && !cell.contains("://") && cell.len() < 80;
    let split: Vec<Vec<String>> = cells.iter().map(names::words).collect();
    place::pair_by_name(&split).is_some()
        || cells.len() > 2
            && cells.iter().filter(|cell| named(cell)).count() * 4 > cells.len() * 3
            && cells.iter().any(names::may_be_place)
}

/// The most frequent separator in the header, outside quotes; blanks if there is none and several words, else a comma.
fn separator(header: &str) -> u8 {
    let mut counts = [(b'|', 0), (b',', 0), (b'\t', 0), (b';', 0)];
    let mut quoted = false;
    for byte in header.bytes() {
        quoted ^= byte == b'"';
        for (separator, count) in &mut counts {
            *count += u32::from(!quoted && byte == *separator);
        }
    }
    // `max_by_key` returns the last of equal elements, so the semicolon wins over the tab, and the tab over the comma.
    let best = counts.into_iter().max_by_key(|&(_, count)| count).filter(|&(_, count)| count > 0);
    let blanks = !header.contains('"') && header.split_whitespace().nth(1).is_some();
    best.map_or(if blanks { b' ' } else { b',' }, |(separator, _)| separator)
}

/// Whether cells of a table with commas between them have commas in their numbers: `"68,08"`, not only three digits
/// behind them.
fn has_decimal_commas(rows: &[Row]) -> bool {
    let decimal = |cell: &str| {
        let Some((whole, part)) = cell.split_once(',') else { return false };
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        digits(whole.trim_start_matches('-')) && digits(part) && part.len() != 3
    };
    rows.iter().take(1000).any(|row| row.cells.iter().any(decimal))
}

/// Line of a record in the file, whose header is line `before` + 1. The reader reports the position before the empty
/// lines and comments that it skips to get there.
fn line_of(position: Option<&csv::Position>, body: &str, before: usize) -> u64 {
    let Some(position) = position else { return 0 };
    let rest = usize::try_from(position.byte()).ok().and_then(|byte| body.get(byte..)).unwrap_or("");
    let skipped = rest.lines().take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() + skipped as u64 + before as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_become_text_in_every_encoding() {
        let text = "x;Höhe\n1;2–3\n";
        let utf_16 = |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<u8>>();
        assert_eq!(decode(text.as_bytes()), text);
        assert_eq!(decode(&[b"\xEF\xBB\xBF", text.as_bytes()].concat()), text);
        assert_eq!(decode(&[b"\xFF\xFE", &utf_16(u16::to_le_bytes)[..]].concat()), text);
        assert_eq!(decode(&[b"\xFE\xFF", &utf_16(u16::to_be_bytes)[..]].concat()), text);
        assert_eq!(decode(&utf_16(u16::to_le_bytes)), text);
        assert_eq!(decode(b"x;H\xf6he\r\n1;2\x963\r"), text);
    }

    #[test]
    fn hints_name_separators() {
        for (line, expected) in [
            ("sep=;", Some(b';')),
            ("SEP=,", Some(b',')),
            ("\"sep=;\"", Some(b';')),
            ("sep=\t", Some(b'\t')),
            ("sep=\\t", Some(b'\t')),
            ("separator=;", None),
            ("x;y", None),
            ("ö", None),
        ] {
            assert_eq!(hinted(line), expected, "{line}");
        }
    }
}
