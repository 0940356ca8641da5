//! Sections and fenced blocks of `CONTRIBUTING.md` that tests hold the tree against.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::held_by::project;

/// Returns the text of `CONTRIBUTING.md`.
pub fn contributing() -> String {
    std::fs::read_to_string(project().join("CONTRIBUTING.md")).unwrap()
}

/// Returns the lines of the first fenced block whose fence names `kind`, without empty lines.
pub fn block<'a>(text: &'a str, kind: &str) -> Result<Vec<&'a str>, String> {
    let fence = format!("```{kind}");
    let mut lines = text.lines().skip_while(|line| line.trim_end() != fence);
    if lines.next().is_none() {
        return Err(format!("CONTRIBUTING.md has no fenced block that begins with {fence}"));
    }
    let (mut found, mut is_closed) = (Vec::new(), false);
    for line in lines {
        is_closed = line.trim_end() == "```";
        if is_closed {
            break;
        }
        found.push(line.trim());
    }
    found.retain(|line| !line.is_empty());
    if is_closed { Ok(found) } else { Err(format!("the block {fence} of CONTRIBUTING.md is not closed")) }
}

/// Returns the lines from the heading named `title` to the next heading of the same or a higher level.
pub fn section<'a>(text: &'a str, title: &str) -> Result<Vec<&'a str>, String> {
    let level = |line: &str| line.len() - line.trim_start_matches('#').len();
    let is_heading = |line: &&str| line.trim_start_matches('#').trim() == title && line.starts_with('#');
    let mut lines = text.lines().skip_while(|line| !is_heading(line));
    let Some(heading) = lines.next() else {
        return Err(format!("CONTRIBUTING.md has no section named {title:?}"));
    };
    let depth = level(heading);
    Ok(lines.take_while(|line| !(1..=depth).contains(&level(line))).collect())
}

/// Returns the words of a line that stand in backticks.
pub fn code_words(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

#[test]
fn a_block_ends_at_its_fence_and_a_missing_one_is_named() {
    let text = "a\n```layers\nx: y\n\nz: w\n```\nb\n```open\nc\n";
    assert_eq!(block(text, "layers").unwrap(), ["x: y", "z: w"]);
    assert!(block(text, "map").unwrap_err().contains("```map"));
    assert!(block(text, "open").unwrap_err().contains("not closed"));
}

#[test]
fn a_section_ends_at_the_next_heading_of_its_level() {
    let text = "# a\n1\n## Glossary\n2\n### deeper\n3\n## b\n4\n";
    assert_eq!(section(text, "Glossary").unwrap(), ["2", "### deeper", "3"]);
    assert_eq!(section(text, "b").unwrap(), ["4"]);
    assert!(section(text, "c").unwrap_err().contains("\"c\""));
}

#[test]
fn code_words_stand_in_backticks() {
    assert_eq!(code_words("never `of`, tell or `note`.").collect::<Vec<_>>(), ["of", "note"]);
}

#[test]
fn every_slow_check_is_listed() {
    let script = std::fs::read_to_string(project().join(".ci/slow")).unwrap();
    let (_, checks) = script.split_once("\nreadonly checks=(").unwrap();
    let checks: Vec<&str> = checks.split(')').next().unwrap().split_whitespace().collect();
    let page = contributing();
    let (_, listed) = page.split_once("`.ci/slow` runs the checks ").unwrap();
    let listed: Vec<&str> = code_words(listed.split(" and ends at").next().unwrap()).collect();
    assert_eq!(listed, checks);
}
