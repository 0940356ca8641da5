//! The section of `docs/bad-input.md` about calls that return no `lvk::Result`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;

use crate::bad_input::{INTERFACE, PAGE, WITHOUT_ERROR, has_test, quoted, source};
use crate::held_by::cells;

/// Types whose calls count.
const TYPES: [&str; 3] = ["Context", "CommandBuffer", "RenderPass"];

/// Returns the call of a line of the interface, without its result, if it takes something, or changes something, and returns no
/// `Result`.
fn infallible_call(line: &str) -> Option<String> {
    let (_, function) = line.split_once("fn lvk::")?;
    let (of, method) = function.split_once("::")?;
    let of = of.strip_suffix("<'_>").unwrap_or(of);
    let (name, _) = method.split_once(['(', '<'])?;
    let is_bare = method.contains("(&self)") || matches!(name, "drop" | "fmt");
    let counts =
        TYPES.contains(&of) && method.contains("self") && !is_bare && !method.contains("lvk::Result<");
    counts.then(|| format!("{of}::{name}"))
}

/// Returns the rows of the section.
fn rows(page: &str) -> Vec<Vec<&str>> {
    let (_, section) = page.split_once(WITHOUT_ERROR).unwrap();
    let section = section.split("\n## ").next().unwrap();
    section.lines().filter_map(cells).skip(2).collect()
}

#[test]
fn every_call_without_an_error_has_a_row() {
    let calls: BTreeSet<String> = INTERFACE.lines().filter_map(infallible_call).collect();
    let rows = rows(PAGE);
    let named: BTreeSet<String> = rows.iter().flat_map(|row| quoted(row[0])).map(str::to_owned).collect();
    assert!(calls.len() > 15, "{calls:?}");
    assert_eq!(calls, named);
}

#[test]
fn tests_of_calls_without_an_error_exist_and_make_the_call() {
    for row in rows(PAGE) {
        let [_, _, _, test] = row[..] else { unreachable!("a row has four cells: {row:?}") };
        if test.starts_with("none") {
            continue;
        }
        for path in quoted(test) {
            let path: Vec<&str> = path.split("::").collect();
            let (name, module) = path.split_last().unwrap();
            let source = source(module).unwrap_or_default();
            assert!(has_test(&source, name), "there is no test {path:?}");
            for call in quoted(row[0]).into_iter().filter_map(|call| call.rsplit("::").next()) {
                assert!(source.contains(&format!(".{call}(")), "{path:?} does not call {call}");
            }
        }
    }
}

#[test]
fn calls_are_told_from_questions_and_fallible_calls() {
    let found = |line| infallible_call(&format!("pub fn lvk::{line}"));
    assert_eq!(found("Context::destroy<H: lvk::Destroy>(&self, H)").as_deref(), Some("Context::destroy"));
    assert_eq!(found("RenderPass<'_>::pop_label(&mut self)").as_deref(), Some("RenderPass::pop_label"));
    assert_eq!(found("Context::limits(&self) -> &lvk::Limits"), None);
    assert_eq!(found("Context::wait(&self, lvk::SubmitHandle) -> lvk::Result<()>"), None);
    assert_eq!(found("Format::bytes(self, [u32; 3]) -> u64"), None);
}
