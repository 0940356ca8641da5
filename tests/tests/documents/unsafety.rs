//! `docs/reliability.md` states how often the library says `unsafe`, for each module: every new block is a visible decision.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::iter::Sum;
use std::ops::Add;

use crate::held_by::{cells, project};
use crate::rust_modules::Crate;
use crate::rust_tokens::{Token, tokens, without_tests};

/// First line of the table.
const HEAD: &str = "| module of `lvk/src` | blocks | functions | implementations |";

/// Uses of `unsafe` in code that is not for tests alone. Declarations of foreign functions count as functions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Uses {
    blocks: usize,
    functions: usize,
    impls: usize,
}

impl Uses {
    fn of_source(text: &str) -> Self {
        let tokens = without_tests(&tokens(text));
        let next = |at: usize| tokens.get(at + 1).map_or("", |token: &Token<'_>| token.text);
        let mut found = Self::default();
        for (at, _) in tokens.iter().enumerate().filter(|(_, token)| token.is_word("unsafe")) {
            match next(at) {
                "{" => found.blocks += 1,
                "impl" => found.impls += 1,
                _ => found.functions += 1,
            }
        }
        found
    }

    /// Returns the row of the table.
    fn row(self, module: &str) -> String {
        format!("| {module} | {} | {} | {} |", self.blocks, self.functions, self.impls)
    }
}

impl Add for Uses {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let Self { blocks, functions, impls } = other;
        Self {
            blocks: self.blocks + blocks,
            functions: self.functions + functions,
            impls: self.impls + impls,
        }
    }
}

impl Sum for Uses {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// Returns the uses of each top-level module of the library, without modules that only builds of tests contain.
fn uses_of_library() -> BTreeMap<String, Uses> {
    let src = project().join("lvk/src");
    let mut found = BTreeMap::<String, Uses>::new();
    for (path, module) in Crate::read(&src).modules {
        let uses = Uses::of_source(&std::fs::read_to_string(src.join(&module.file)).unwrap());
        let all = found.entry(path.first().map_or("lib", String::as_str).to_owned()).or_default();
        *all = *all + uses;
    }
    found.retain(|_, uses| *uses != Uses::default());
    found
}

/// Returns the rows of the table in a page, without its head.
fn rows(page: &str) -> Vec<String> {
    let lines = page.lines().skip_while(|line| *line != HEAD).skip(2);
    lines.map_while(cells).map(|cells| format!("| {} |", cells.join(" | "))).collect()
}

#[test]
fn the_page_counts_the_unsafe_code() {
    let uses = uses_of_library();
    let total: Uses = uses.values().copied().sum();
    let mut expected: Vec<_> = uses.iter().map(|(module, uses)| uses.row(module)).collect();
    expected.push(total.row("all"));
    let page = std::fs::read_to_string(project().join("docs/reliability.md")).unwrap();
    let (found, expected) = (rows(&page).join("\n"), expected.join("\n"));
    assert!(
        found == expected,
        "the table below `{HEAD}` of docs/reliability.md does not say what the sources have. Review the new code, then \
         write:\n{expected}"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_functions_and_implementations_are_told_apart() {
        let source = "
            // unsafe { comment }
            unsafe impl Send for A {}
            unsafe extern \"system\" fn a() { unsafe { b() } }
            pub unsafe fn c() { d(|| unsafe { e(\"unsafe { text }\") }) }
            unsafe extern \"C\" { fn f(); }
            #[cfg(test)] mod tests { fn g() { unsafe { h() } } }";
        assert_eq!(Uses::of_source(source), Uses { blocks: 2, functions: 3, impls: 1 });
    }

    #[test]
    fn a_table_ends_at_the_first_other_line() {
        let page = format!("| a |\n\n{HEAD}\n|---|---|---|---|\n| gpu  | 1 | 2 | 3 |\n\n| other |\n");
        assert_eq!(rows(&page), [Uses { blocks: 1, functions: 2, impls: 3 }.row("gpu")]);
    }
}
