//! The sections of `docs/bad-input.md` about calls that return no `lvk::Result`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;

use crate::bad_input::{
    Call, INTERFACE, PAGE, WITHOUT_ERROR, call, has_test, has_words, list, quoted, reached_text, source,
};
use crate::held_by::cells;

/// Functions of traits of the standard library, which generic code calls.
const OF_TRAITS: [&str; 11] =
    ["clone", "cmp", "default", "deref", "drop", "eq", "fmt", "from", "from_iter", "hash", "source"];

/// Returns the functions of an interface that return no `lvk::Result`, without those of traits of the standard library and of sets of
/// flags, which a macro makes.
fn infallible_calls(interface: &str) -> Vec<Call<'_>> {
    let calls = || interface.lines().filter_map(call);
    let flags: BTreeSet<String> =
        calls().filter_map(|call| call.name.strip_suffix("::from_bits_retain").map(str::to_owned)).collect();
    let is_own = |call: &Call<'_>| match call.name.rsplit_once("::") {
        Some((of, name)) => !flags.contains(of) && !OF_TRAITS.contains(&name),
        None => true,
    };
    calls().filter(|call| !call.is_fallible && is_own(call)).collect()
}

/// True if a call takes something or changes something.
fn can_be_wrong(call: &Call<'_>) -> bool {
    !matches!(call.arguments, "()" | "(self)" | "(&self)")
}

/// Returns the rows of the section.
fn rows(page: &str) -> Vec<Vec<&str>> {
    let (_, section) = page.split_once(WITHOUT_ERROR).unwrap();
    let section = section.split("\n## ").next().unwrap();
    section.lines().filter_map(cells).skip(2).collect()
}

/// Calls that take nothing may have a row and need none.
#[test]
fn every_call_without_an_error_has_a_row_or_takes_any_value() {
    let calls = infallible_calls(INTERFACE);
    let known: BTreeSet<&str> = calls.iter().map(|call| &*call.name).collect();
    let needed: BTreeSet<&str> =
        calls.iter().filter(|call| can_be_wrong(call)).map(|call| &*call.name).collect();
    assert!(needed.len() > 50, "{needed:?}");
    let with_rows: BTreeSet<&str> = rows(PAGE).iter().flat_map(|row| quoted(row[0])).collect();
    let of_any_value: BTreeSet<&str> = list(PAGE, "Calls that take any value").into_iter().collect();
    let named: BTreeSet<&str> = with_rows.union(&of_any_value).copied().collect();
    for (what, wrong) in [
        ("without a row", &needed - &named),
        ("no such call", &named - &known),
        ("in a row and in the list", &with_rows & &of_any_value),
        ("in the list, but takes nothing", &of_any_value - &needed),
    ] {
        assert!(wrong.is_empty(), "{what}: {wrong:#?}");
    }
}

#[test]
fn tests_of_calls_without_an_error_exist_and_make_the_call() {
    for row in rows(PAGE) {
        let [calls, _, what_happens, test] = row[..] else { unreachable!("a row has four cells: {row:?}") };
        if test == "none" {
            continue;
        }
        for path in quoted(test) {
            let path: Vec<&str> = path.split("::").collect();
            let (name, module) = path.split_last().unwrap();
            let source = source(module).unwrap_or_default();
            assert!(has_test(&source, name), "there is no test {path:?}");
            let text = reached_text(&source, name);
            for call in quoted(calls).into_iter().filter_map(|call| call.rsplit("::").next()) {
                assert!(has_words(&text, &format!("{call}(")), "{path:?} does not call {call}");
            }
            let is_heard = !what_happens.starts_with("a warning") || has_words(&text, "take_warnings(");
            assert!(is_heard, "{path:?} does not hear the warning");
        }
    }
}

#[test]
fn calls_are_told_from_questions_and_fallible_calls() {
    let found = |line: &str| {
        let interface = format!("pub fn lvk::Flags::from_bits_retain(u32) -> Self\npub fn lvk::{line}");
        infallible_calls(&interface).iter().map(can_be_wrong).next()
    };
    assert_eq!(found("Context::destroy<H: lvk::Destroy>(&self, H)"), Some(true));
    assert_eq!(found("RenderPass<'_>::pop_label(&mut self)"), Some(true));
    assert_eq!(found("Format::bytes(self, [u32; 3]) -> u64"), Some(true));
    assert_eq!(found("transform_rows([f32; 16]) -> [f32; 12]"), Some(true));
    assert_eq!(found("Context::limits(&self) -> &lvk::Limits"), Some(false));
    assert_eq!(found("Context::wait(&self, lvk::SubmitHandle) -> lvk::Result<()>"), None);
    assert_eq!(found("Flags::insert(&mut self, Self)"), None);
    assert_eq!(found("Holder<H>::drop(&mut self)"), None);
}
