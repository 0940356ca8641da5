//! The first line of a docstring says what the item is or does: it does not begin with a pronoun or a loose genitive.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::glossary::files;

/// Folders whose docstrings are checked.
const FOLDERS: [&str; 3] = ["lvk", "samples", "tests"];
/// Words that begin no docstring.
const FIRST_WORDS: [&str; 8] = ["Of", "They", "That", "So", "Has", "It", "Its", "There"];
/// Other beginnings that a docstring does not have.
const BEGINNINGS: [&str; 1] = ["One that "];

/// Returns the text of a docstring's line.
fn docstring(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix("///").or_else(|| line.strip_prefix("//!")).filter(|text| !text.starts_with('/'))
}

fn has_wrong_beginning(text: &str) -> bool {
    let word = text.split(|letter: char| !letter.is_alphanumeric()).next();
    word.is_some_and(|word| FIRST_WORDS.contains(&word))
        || BEGINNINGS.iter().any(|words| text.starts_with(words))
}

/// Returns the docstrings of a file whose first line says nothing of the item.
fn complaints(file: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut follows = false;
    for (number, line) in text.lines().enumerate() {
        let docs = docstring(line);
        if let Some(first) = docs.map(str::trim).filter(|first| !follows && has_wrong_beginning(first)) {
            found.push(format!("{file}:{}: {first}", number + 1));
        }
        follows = docs.is_some();
    }
    found
}

#[test]
fn docstrings_begin_with_what_the_item_is_or_does() {
    let files = FOLDERS.into_iter().flat_map(|folder| files(folder, ".rs"));
    let complaints: Vec<_> = files.flat_map(|(file, text)| complaints(&file, &text)).collect();
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_beginnings_are_refused() {
        for wrong in ["Of a sample.", "Its name.", "One that is there.", "It's here."] {
            assert_eq!(
                complaints("a.rs", &format!("fn a() {{}}\n    /// {wrong}\n")),
                [format!("a.rs:2: {wrong}")]
            );
        }
        assert_eq!(complaints("a.rs", "//! There is one.").len(), 1);
    }

    #[test]
    fn other_lines_pass() {
        for right in [
            "/// Sets it.\n/// It is set.",
            "// Of the caller.",
            "//// Its",
            "/// Office",
            "/// One of many.",
        ] {
            assert_eq!(complaints("a.rs", right), Vec::<String>::new(), "{right}");
        }
    }
}
