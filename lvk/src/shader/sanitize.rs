//! Prepares a GLSL text for the compiler: ASCII only, no NUL, no `#version` of its own.

/// An error in a text, and its line (from 1).
#[derive(Debug, PartialEq, Eq)]
pub(super) struct SourceError {
    pub(super) line: usize,
    pub(super) message: String,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum ScanState {
    Code,
    Text,
    LineComment,
    BlockComment,
}

/// Returns the text with every non-ASCII character in a comment replaced by one `?`; lines stay the same.
///
/// The compiler cuts messages at bytes, which can split other characters into invalid UTF-8.
pub(super) fn to_ascii(text: &str) -> Result<String, SourceError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut out = String::with_capacity(text.len());
    let (mut state, mut previous, mut line) = (ScanState::Code, ' ', 1);
    for c in text.chars() {
        if c == '\0' {
            return Err(SourceError { line, message: "a NUL character; GLSL is plain text".to_owned() });
        }
        let in_comment = matches!(state, ScanState::LineComment | ScanState::BlockComment);
        if !c.is_ascii() && !in_comment {
            let message = format!("the character '{}' is only allowed in comments", c.escape_debug());
            return Err(SourceError { line, message });
        }
        out.push(if c.is_ascii() { c } else { '?' });
        let next = next_state(state, previous, c);
        previous = match c {
            _ if next != state => ' ',
            '\r' => previous,
            c => c,
        };
        state = next;
        line += usize::from(c == '\n');
    }
    Ok(out)
}

fn next_state(state: ScanState, previous: char, c: char) -> ScanState {
    match (state, previous, c) {
        (ScanState::Code, '/', '/') => ScanState::LineComment,
        (ScanState::Code, '/', '*') => ScanState::BlockComment,
        (ScanState::Code, _, '"') => ScanState::Text,
        (ScanState::Text, _, '"' | '\n') => ScanState::Code,
        (ScanState::LineComment, '\\', '\n') => ScanState::LineComment,
        (ScanState::LineComment, _, '\n') => ScanState::Code,
        (ScanState::BlockComment, '*', '/') => ScanState::Code,
        _ => state,
    }
}

/// Removes a leading `#version 450` or `#version 460` and keeps its line.
pub(super) fn without_version(text: &str) -> Result<String, SourceError> {
    let start = first_code(text);
    let Some(directive) = version_directive(&text[start..]) else {
        return Ok(text.to_owned());
    };
    let words: Vec<&str> = directive.split_whitespace().collect();
    let number =
        words.iter().skip_while(|word| !word.ends_with("version")).skip(1).copied().collect::<Vec<_>>();
    if !matches!(number[..], ["450" | "460"] | ["450" | "460", "core"]) {
        let line = 1 + text[..start].matches('\n').count();
        let message = format!(
            "#version {} is not supported: shaders are GLSL 460 for Vulkan; write #version 460 or leave the line out",
            number.join(" ")
        );
        return Err(SourceError { line, message });
    }
    Ok(format!("{}{}", &text[..start], &text[start + directive.len()..]))
}

/// Returns the offset of the first byte that is neither white space nor part of a comment.
fn first_code(text: &str) -> usize {
    let mut rest = text.trim_start();
    loop {
        let after = if let Some(comment) = rest.strip_prefix("//") {
            comment.split_once('\n').map(|(_, after)| after)
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.split_once("*/").map(|(_, after)| after)
        } else {
            return text.len() - rest.len();
        };
        match after {
            Some(after) => rest = after.trim_start(),
            None => return text.len(),
        }
    }
}

/// Returns the `#version` directive at the start of `text`, without a comment after it.
fn version_directive(text: &str) -> Option<&str> {
    let line = text.lines().next()?;
    let rest = line.strip_prefix('#')?.trim_start().strip_prefix("version")?;
    if !rest.is_empty() && !rest.starts_with([' ', '\t', '/']) {
        return None;
    }
    let end = [line.find("//"), line.find("/*")].into_iter().flatten().min().unwrap_or(line.len());
    Some(&line[..end])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn comments_may_hold_any_character() {
        let ok = to_ascii("\u{feff}int a; // é\n/* ü\n*/ int b;").unwrap();
        assert_eq!(ok, "int a; // ?\n/* ?\n*/ int b;");
    }

    #[test]
    fn code_may_not() {
        assert_eq!(to_ascii("int a;\nint é;").unwrap_err().line, 2);
        assert!(to_ascii("/*/ é */").is_ok());
        assert!(to_ascii("/* /*/ é").is_err());
        assert!(to_ascii("/**// é").is_err());
        assert!(to_ascii("// é \\\n é").is_ok());
        assert!(to_ascii("a\0b").unwrap_err().message.contains("NUL"));
    }

    #[test]
    fn version_line_keeps_its_place() {
        assert_eq!(without_version("// x\n#version 460 core // y\nvoid").unwrap(), "// x\n// y\nvoid");
        assert_eq!(without_version(" #  version\t450\r\nvoid").unwrap(), " \r\nvoid");
        assert_eq!(without_version("/* #version 330 */ void").unwrap(), "/* #version 330 */ void");
        assert_eq!(without_version("// only a comment").unwrap(), "// only a comment");
    }

    #[test]
    fn other_versions_are_refused_with_their_line() {
        let complaint = without_version("\n/*\n*/\n#version 330 es").unwrap_err();
        assert_eq!(complaint.line, 4);
        assert!(complaint.message.contains("#version 330 es"), "{}", complaint.message);
        assert!(without_version("#version").is_err());
    }

    proptest! {
        #[test]
        fn lines_never_move(text in "[#/*a \"\\\\\n\r\t0-9é]{0,60}|(#version 460|// |/\\*|\\*/|\n| ){0,20}") {
            if let Ok(ascii) = to_ascii(&text) {
                prop_assert!(ascii.is_ascii());
                prop_assert_eq!(ascii.matches('\n').count(), text.matches('\n').count());
                if let Ok(clean) = without_version(&ascii) {
                    prop_assert_eq!(clean.matches('\n').count(), text.matches('\n').count());
                }
            }
        }
    }
}
