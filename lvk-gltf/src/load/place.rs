//! Names of objects for messages: `mesh 3 'Body'`.

use std::path::Path;

/// Returns a name for messages: without control characters, and of bounded length.
pub(super) fn shortened(name: &str) -> String {
    shortened_to(name, 80)
}

/// Returns a text for messages: without control characters, and of at most this many characters.
pub(super) fn shortened_to(name: &str, most: usize) -> String {
    let readable = |character: char| if character.is_control() { '\u{fffd}' } else { character };
    let mut text: String = name.chars().take(most).map(readable).collect();
    if name.chars().nth(most).is_some() {
        text.push_str("...");
    }
    text
}

/// Returns the end of a path for messages, without control characters.
pub(super) fn shortened_path(path: &Path) -> String {
    const MOST: usize = 300;
    let text = path.display().to_string();
    let readable = |character: char| if character.is_control() { '\u{fffd}' } else { character };
    text.chars().skip(text.chars().count().saturating_sub(MOST)).map(readable).collect()
}

/// Returns kind, index and name of an object.
pub(super) fn place(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {index} '{}'", shortened(name)),
        _ => format!("{kind} {index}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_readable_and_short() {
        assert_eq!(place("mesh", 3, Some("Body")), "mesh 3 'Body'");
        assert_eq!(place("mesh", 3, Some("")), "mesh 3");
        assert_eq!(place("mesh", 3, None), "mesh 3");
        assert_eq!(shortened("a\u{1b}[31m\n"), "a\u{fffd}[31m\u{fffd}");
        assert_eq!(shortened(&"ä".repeat(100)), format!("{}...", "ä".repeat(80)));
    }
}
