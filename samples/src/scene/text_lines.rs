//! The text of scene files: encodings, line ends and continued lines.

use std::borrow::Cow;

/// Statements of an OBJ file by their first words. A line that begins with one of them continues no other line.
const KEYWORDS: [&[u8]; 45] = [
    b"v",
    b"vt",
    b"vn",
    b"vp",
    b"f",
    b"fo",
    b"p",
    b"l",
    b"g",
    b"o",
    b"s",
    b"mg",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"shadow_obj",
    b"trace_obj",
    b"ctech",
    b"stech",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"curv",
    b"curv2",
    b"surf",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"bzp",
    b"bsp",
    b"cdc",
    b"cdp",
    b"res",
    b"call",
    b"csh",
];

/// Statements whose argument is one name, which may end in a backslash: exporters continue none of them.
const NAMING: [&[u8]; 4] = [b"g", b"o", b"usemtl", b"usemap"];

/// The text without its byte order mark, with ASCII keywords as single bytes: UTF-16 becomes UTF-8. UTF-16 is told by its byte
/// order mark or by zeros beside its first two letters. Other encodings stay as they are.
pub(super) fn decoded(content: &[u8]) -> Cow<'_, [u8]> {
    let text = |units: Vec<u16>| -> Cow<'_, [u8]> {
        let letters = char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER));
        Cow::Owned(letters.collect::<String>().into_bytes())
    };
    let little = |bytes: &[u8]| bytes.as_chunks().0.iter().map(|unit| u16::from_le_bytes(*unit)).collect();
    let big = |bytes: &[u8]| bytes.as_chunks().0.iter().map(|unit| u16::from_be_bytes(*unit)).collect();
    let text = match content {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, rest @ ..] => text(little(rest)),
        [0xfe, 0xff, rest @ ..] => text(big(rest)),
        [1..=0xff, 0, 1..=0xff, 0, ..] => text(little(content)),
        [0, 1..=0xff, 0, 1..=0xff, ..] => text(big(content)),
        _ => Cow::Borrowed(content),
    };
    match text {
        Cow::Borrowed(bytes) => Cow::Borrowed(without_padding(bytes)),
        Cow::Owned(mut bytes) => {
            bytes.truncate(without_padding(&bytes).len());
            Cow::Owned(bytes)
        }
    }
}

/// True if a text that begins so is in UTF-16.
pub(super) fn is_utf16(start: &[u8]) -> bool {
    matches!(
        start,
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [1..=0xff, 0, 1..=0xff, 0, ..] | [0, 1..=0xff, 0, 1..=0xff, ..]
    )
}

/// The text without the zeros and the end marks of DOS (Ctrl-Z) that old programs fill the last block of a file with.
pub(super) fn without_padding(text: &[u8]) -> &[u8] {
    let last = text.iter().rposition(|byte| !matches!(byte, 0 | 0x1a));
    &text[..last.map_or(0, |last| last + 1)]
}

/// The first line and what follows it. A line ends at a line feed, a carriage return or both, or at the two carriage returns
/// and line feed that writing text twice as text makes on Windows.
pub(super) fn split_line(content: &[u8]) -> (&[u8], &[u8]) {
    let Some(end) = content.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
        return (content, &[]);
    };
    let ends: [&[u8]; 2] = [b"\r\r\n", b"\r\n"];
    let length =
        ends.into_iter().find(|end_of_line| content[end..].starts_with(end_of_line)).map_or(1, <[u8]>::len);
    (&content[..end], &content[end + length..])
}

/// All lines, without their ends.
pub(super) fn lines(content: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = content;
    std::iter::from_fn(move || {
        let (line, after) = (!rest.is_empty()).then(|| split_line(rest))?;
        rest = after;
        Some(line)
    })
}

/// The first word and what follows it, both without blanks around them, and without the byte order mark that stands in a
/// file put together from several.
pub(super) fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text).trim_ascii();
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_ascii_start())
}

/// A statement of an OBJ file, which may take several lines.
pub(super) struct LogicalLine<'a> {
    /// The text without line ends and continuations.
    pub text: Cow<'a, [u8]>,
    /// Lines of the file that it took, at least 1.
    pub line_count: usize,
    /// True if it ends in a backslash though the next line is a statement of its own.
    pub is_cut: bool,
}

/// Takes the first statement of `content`; also returns what follows it.
///
/// A backslash at a line's end, with or without blanks behind it, continues the line. A backslash in a comment does not, nor
/// one at the end of a name, and no line swallows another that begins with a keyword: exporters write folders such as
/// `C:\models\` into comments and names, and continue only lists of numbers and of files.
pub(super) fn next_logical_line(content: &[u8]) -> (LogicalLine<'_>, &[u8]) {
    let (first, mut rest) = split_line(content);
    let line = |text, line_count, is_cut| LogicalLine { text, line_count, is_cut };
    let Some(start) = before_backslash(first).filter(|start| may_continue(start)) else {
        return (line(Cow::Borrowed(first), 1, false), rest);
    };
    if begins_statement(split_line(rest).0) {
        return (line(Cow::Borrowed(start), 1, true), rest);
    }
    let mut joined = start.to_vec();
    let mut count = 1;
    while !rest.is_empty() {
        let (next, after) = split_line(rest);
        (rest, count) = (after, count + 1);
        joined.push(b' ');
        let continued = before_backslash(next);
        joined.extend_from_slice(continued.unwrap_or(next));
        if continued.is_none() {
            break;
        }
        if begins_statement(split_line(rest).0) {
            return (line(Cow::Owned(joined), count, true), rest);
        }
    }
    (line(Cow::Owned(joined), count, false), rest)
}

/// The line in front of the backslash that ends it.
fn before_backslash(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\")
}

fn may_continue(line: &[u8]) -> bool {
    let (keyword, rest) = split_word(line);
    let has_comment =
        keyword.starts_with(b"#") || (!keyword.eq_ignore_ascii_case(b"mtllib") && rest.contains(&b'#'));
    !has_comment && !NAMING.contains(&&*keyword.to_ascii_lowercase())
}

fn begins_statement(line: &[u8]) -> bool {
    let (keyword, _) = split_word(line);
    keyword.starts_with(b"#") || is_keyword(&keyword.to_ascii_lowercase())
}

/// True if OBJ has such a statement.
pub(super) fn is_keyword(word: &[u8]) -> bool {
    KEYWORDS.contains(&word)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every statement with its number of lines, and whether it was cut.
    fn statements(text: &str) -> Vec<(String, usize, bool)> {
        let mut rest = text.as_bytes();
        let mut found = Vec::new();
        while !rest.is_empty() {
            let (line, after) = next_logical_line(rest);
            let words: Vec<String> =
                String::from_utf8_lossy(&line.text).split_whitespace().map(str::to_owned).collect();
            found.push((words.join(" "), line.line_count, line.is_cut));
            rest = after;
        }
        found
    }

    fn whole(text: &str) -> (String, usize, bool) {
        (text.to_owned(), 1, false)
    }

    #[test]
    fn capitals_do_not_matter_to_continuations() {
        let line = |text: &str, is_cut| (text.to_owned(), 1, is_cut);
        assert_eq!(statements("G PARTS\\\nF 1 2 3"), [line("G PARTS\\", false), line("F 1 2 3", false)]);
        assert_eq!(statements("v 1 0 1\\\nV 2 0 1"), [line("v 1 0 1", true), line("V 2 0 1", false)]);
    }

    #[test]
    fn lists_of_numbers_and_files_are_continued() {
        for end in ["\\\n", "\\ \t\n", "\\\r\n", "\\ \r\n", "\\\r"] {
            assert_eq!(
                statements(&format!("f 1 2 {end} 3 {end}4\nv 0")),
                [("f 1 2 3 4".into(), 3, false), whole("v 0")]
            );
        }
        assert_eq!(statements("mtllib a.mtl \\\nb.mtl\n"), [("mtllib a.mtl b.mtl".into(), 2, false)]);
        assert_eq!(statements("f 1 2 3\\"), [("f 1 2 3".into(), 1, false)], "at the end of the file");
    }

    #[test]
    fn comments_and_names_that_end_in_a_backslash_swallow_nothing() {
        for line in ["# exported from C:\\models\\", "g parts\\", "usemtl wall\\", "o a\\", "v 0 0 0 # C:\\"]
        {
            assert_eq!(statements(&format!("{line}\nv 1 2 3\n")), [whole(line), whole("v 1 2 3")]);
            assert_eq!(statements(&format!("{line}\r\n\r\nv 1\r\n"))[2], whole("v 1"), "{line}");
        }
    }

    #[test]
    fn a_statement_in_place_of_a_continuation_stands_for_itself() {
        assert_eq!(statements("f 1 2 3 \\\nf 4 5 6\n"), [("f 1 2 3".into(), 1, true), whole("f 4 5 6")]);
        let found = statements("f 1 2 \\\n3\\\n# end\n");
        assert_eq!(found, [("f 1 2 3".into(), 2, true), whole("# end")]);
    }

    #[test]
    fn lines_end_as_on_any_system() {
        for end in ["\n", "\r\n", "\r\r\n", "\r"] {
            let text = ["a", "", "b"].join(end);
            assert_eq!(lines(text.as_bytes()).collect::<Vec<_>>(), [b"a".as_slice(), b"", b"b"]);
        }
        assert_eq!(lines(b"").count(), 0);
    }

    #[test]
    fn text_of_16_bits_is_decoded() {
        let text = "v 1 2 3\nusemtl h\u{f6}he \u{1f600}\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        let marked = |mark: &[u8], bytes: &[u8]| [mark, bytes].concat();
        for bytes in [marked(b"\xff\xfe", &little), marked(b"\xfe\xff", &big), little, big] {
            assert_eq!(decoded(&bytes), text.as_bytes());
        }
        assert_eq!(decoded(&marked(b"\xef\xbb\xbf", text.as_bytes())), text.as_bytes());
        assert_eq!(decoded(b"caf\xe9"), b"caf\xe9".as_slice());
        assert_eq!(decoded(b"v 1\n\x1a\0\0"), b"v 1\n".as_slice());
        assert_eq!(decoded(b"v\0 1"), b"v\0 1".as_slice());
        assert_eq!(decoded(b"\xff\xfeo\0\0"), b"o".as_slice(), "half a letter is left out");
    }
}
