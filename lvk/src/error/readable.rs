//! Names and texts as messages show them.

use std::ffi::OsStr;
use std::fmt::Write as _;

/// Most bytes of a name that are shown whole.
const MAX_NAME_BYTES: usize = 300;
/// Bytes shown of the start and of the end of a longer name.
const NAME_ENDS: [usize; 2] = [200, 80];
/// Most bytes of a message that are shown whole, and those shown of the start and of the end of a longer one.
const MAX_LINE_BYTES: usize = 8_000;
const LINE_ENDS: [usize; 2] = [4_000, 3_000];

/// Returns a name as messages show it: of a file, an object or anything that users or files name.
///
/// Control characters, line breaks and marks that change the direction of writing become escapes such as `\u{1b}` or
/// `\n`, and bytes that are no UTF-8 become `\xe9`. A name of more than 300 bytes is shown by its start, its end and
/// its length. Backslashes stay as they are, as paths have them.
#[must_use]
pub fn readable_name(name: impl AsRef<OsStr>) -> String {
    readable_bytes(name.as_ref().as_encoded_bytes())
}

/// Returns a name of any encoding as messages show it ([`readable_name`]).
#[must_use]
pub fn readable_bytes(name: &[u8]) -> String {
    shorten(name, MAX_NAME_BYTES, NAME_ENDS)
}

/// Returns a text of one or more lines as messages show it: as [`readable_name`], but with its line breaks and tabs, and of any
/// length.
#[must_use]
pub fn readable_text(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    push_escaped(&mut shown, text.as_bytes(), true);
    shown
}

/// Returns a message of one line, in which names may stand. The middle of a message of more than 8,000 bytes is left out.
#[must_use]
pub fn readable_line(text: &str) -> String {
    shorten(text.as_bytes(), MAX_LINE_BYTES, LINE_ENDS)
}

fn shorten(bytes: &[u8], most: usize, [head, tail]: [usize; 2]) -> String {
    let mut shown = String::with_capacity(bytes.len().min(most));
    if bytes.len() <= most {
        push_escaped(&mut shown, bytes, false);
        return shown;
    }
    push_escaped(&mut shown, &bytes[..char_start(bytes, head)], false);
    shown.push_str("..");
    push_escaped(&mut shown, &bytes[char_start(bytes, bytes.len() - tail)..], false);
    // Writing to a String cannot fail.
    let _ = write!(shown, " ({} bytes)", bytes.len());
    shown
}

/// Returns the start of the UTF-8 character that has byte `at`; `at` itself in other encodings.
pub(crate) fn char_start(bytes: &[u8], at: usize) -> usize {
    let is_start = |index: &usize| bytes.get(*index).is_none_or(|byte| byte & 0xc0 != 0x80);
    (at.saturating_sub(3)..=at).rev().find(is_start).unwrap_or(at)
}

/// Appends the text of `bytes`. With `keeps_lines`, line breaks and tabs stay.
fn push_escaped(shown: &mut String, bytes: &[u8], keeps_lines: bool) {
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            match c {
                '\n' | '\t' if keeps_lines => shown.push(c),
                c if c.is_control() || is_invisible_mark(c) => shown.extend(c.escape_default()),
                c => shown.push(c),
            }
        }
        for byte in chunk.invalid() {
            // Writing to a String cannot fail.
            let _ = write!(shown, "\\x{byte:02x}");
        }
    }
}

/// True for characters that show nothing of themselves and change how other text is shown or read: marks and overrides of
/// the direction of writing, line and paragraph separators, the byte order mark, and tags.
fn is_invisible_mark(c: char) -> bool {
    matches!(
        c,
        '\u{61c}'
            | '\u{200e}'
            | '\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2066}'..='\u{2069}'
            | '\u{feff}'
            | '\u{e0000}'..='\u{e007f}'
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_names_stay_as_they_are() {
        for name in ["wall", "C:\\art\\a b.png", "Straße", "色.png", "'quoted'", "👩‍🚀", ""] {
            assert_eq!(readable_name(name), name);
        }
    }

    #[test]
    fn characters_that_steer_a_terminal_are_escaped() {
        for (name, shown) in [
            ("\u{1b}[2Jred", "\\u{1b}[2Jred"),
            ("a\r\nb\tc", "a\\r\\nb\\tc"),
            ("bell\u{7}\u{8}\u{7f}\u{9b}", "bell\\u{7}\\u{8}\\u{7f}\\u{9b}"),
            ("a\u{202e}gnp.exe", "a\\u{202e}gnp.exe"),
            ("\u{2066}x\u{2069}\u{200f}", "\\u{2066}x\\u{2069}\\u{200f}"),
            ("a\u{2028}b\u{feff}", "a\\u{2028}b\\u{feff}"),
        ] {
            assert_eq!(readable_name(name), shown);
        }
    }

    #[test]
    fn bytes_of_other_encodings_are_told_apart() {
        assert_eq!(readable_bytes(b"caf\xe9 \xff"), "caf\\xe9 \\xff");
        assert_eq!(readable_bytes("caf\u{e9}".as_bytes()), "caf\u{e9}");
    }

    #[test]
    fn long_names_keep_both_ends_and_tell_their_length() {
        assert_eq!(readable_name("n".repeat(300)), "n".repeat(300));
        let long = readable_name(format!("start{}end.png", "x".repeat(1 << 20)));
        assert!(long.len() < 320, "{}", long.len());
        assert!(long.starts_with("startxxx") && long.ends_with("xxxend.png (1048588 bytes)"), "{long}");
        let umlauts = readable_name("\u{fc}".repeat(1_000));
        assert!(!umlauts.contains("\\x") && umlauts.contains(".."), "{umlauts}");
        let bytes = readable_bytes(&[0x80; 1_000]);
        assert_eq!(bytes.matches("\\x80").count(), 280);
    }

    #[test]
    fn texts_keep_their_lines_and_messages_their_ends() {
        assert_eq!(readable_text("a\n\tb\u{1b}"), "a\n\tb\\u{1b}");
        assert_eq!(readable_line("a\nb"), "a\\nb");
        let long = readable_line(&format!("wall: {}; use fewer", "x".repeat(1 << 20)));
        assert!(long.starts_with("wall: xxx") && long.contains("x; use fewer ("), "{}", &long[..50]);
        assert!(long.len() < 8_000);
    }
}
