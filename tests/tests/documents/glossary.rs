//! Names in the code, those of tests included, use the words of the glossary in `CONTRIBUTING.md`, not those that its
//! third column rules out.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::ops::Range;

use crate::contributing::{code_words, contributing, section};
use crate::held_by::{cells, project};
use crate::rust_tokens::{Kind, Token, group_end, nesting, tokens};

/// Folders whose names are checked.
const FOLDERS: [&str; 4] = ["lvk/src", "samples", "tests/src", "tests/tests"];
/// Folders whose GLSL files have checked names.
const GLSL_FOLDERS: [&str; 2] = ["lvk/src", "shaders"];
const BARE_NAMES: &str = "Never a function's whole name:";
/// The kind of a function that only its own file calls: it may be named by any word but a bare one.
const PRIVATE_FN: &str = "private fn";
const TEST_FN: &str = "test fn";
const FIRST_WORDS: &str = "Never the first word of a test's name:";
const KEPT: &str = "kept: ";
const MOST_KEPT: usize = 12;

/// The section "Glossary".
#[derive(Debug, Default)]
struct Glossary {
    /// Each as lower-case words that follow each other in a name.
    private: Vec<Vec<String>>,
    bare: BTreeSet<String>,
    /// Words that begin no name of a test.
    first: BTreeSet<String>,
    kept: BTreeSet<String>,
}

impl Glossary {
    fn parse(text: &str) -> Result<Self, String> {
        let mut glossary = Self::default();
        for line in section(text, "Glossary")? {
            if let Some(names) = line.strip_prefix(BARE_NAMES) {
                glossary.bare.extend(code_words(names).map(str::to_owned));
            } else if let Some(names) = line.strip_prefix(FIRST_WORDS) {
                glossary.first.extend(code_words(names).map(str::to_owned));
            } else if let Some(rest) = line.trim_start_matches("- ").strip_prefix(KEPT) {
                let name = code_words(rest).next().ok_or(format!("no name in backticks: {line:?}"))?;
                let reason = rest.split_once("`: ").map_or("", |(_, reason)| reason);
                if reason.trim().is_empty() {
                    return Err(format!("no reason to keep `{name}`"));
                }
                glossary.kept.insert(name.to_owned());
            } else if let Some([_term, _meaning, not]) = cells(line).as_deref() {
                glossary.private.extend(code_words(not).map(words).filter(|words| !words.is_empty()));
            }
        }
        match glossary {
            _ if glossary.private.is_empty() => Err("the glossary rules out no word".to_owned()),
            _ if glossary.bare.is_empty() => {
                Err(format!("the glossary has no line that begins with {BARE_NAMES:?}"))
            }
            _ if glossary.first.is_empty() => {
                Err(format!("the glossary has no line that begins with {FIRST_WORDS:?}"))
            }
            _ if glossary.kept.len() > MOST_KEPT => {
                Err(format!("{} kept names of {MOST_KEPT}", glossary.kept.len()))
            }
            _ => Ok(glossary),
        }
    }

    /// Returns what is wrong with a name.
    fn complaint(&self, name: &Name) -> Option<String> {
        if name.kind.ends_with("fn") && self.bare.contains(&name.text) {
            return Some(format!("{}: fn {} says nothing of its effect", name.place, name.text));
        }
        if name.kind == PRIVATE_FN {
            return None;
        }
        let parts = words(&name.text);
        if let Some(first) = parts.first().filter(|word| name.kind == TEST_FN && self.first.contains(*word)) {
            return Some(format!("{}: {} {} begins with {first:?}", name.place, name.kind, name.text));
        }
        let is_in = |private: &&Vec<String>| {
            parts.windows(private.len()).any(|part| part.iter().zip(*private).all(is_same_or_plural))
        };
        let private = self.private.iter().find(is_in)?;
        Some(format!("{}: {} {} has the word {:?}", name.place, name.kind, name.text, private.join(" ")))
    }

    /// Returns what is wrong with all names of `files`, and names that are kept without need.
    fn complaints(&self, files: &[(String, String)]) -> Vec<String> {
        let mut unused = self.kept.clone();
        let mut found = BTreeSet::new();
        for (file, text) in files {
            for name in names(file, text) {
                match self.complaint(&name) {
                    Some(_) if self.kept.contains(&name.text) => drop(unused.remove(&name.text)),
                    complaint => found.extend(complaint),
                }
            }
        }
        let mut found: Vec<_> = found.into_iter().collect();
        found.extend(unused.iter().map(|name| format!("kept: `{name}`: no such name needs it")));
        found
    }
}

fn is_same_or_plural((word, private): (&String, &String)) -> bool {
    word == private || word.strip_suffix('s') == Some(private)
}

/// The name of a module, a type, a function or a GLSL file.
#[derive(Debug)]
struct Name {
    kind: String,
    text: String,
    /// The file, and the line where it is in one.
    place: String,
}

/// Returns the lower-case words of a name in snake case or camel case.
fn words(name: &str) -> Vec<String> {
    let (mut found, mut is_new) = (Vec::<String>::new(), true);
    let letters: Vec<char> = name.chars().collect();
    for (at, &letter) in letters.iter().enumerate() {
        if !letter.is_alphanumeric() {
            is_new = true;
            continue;
        }
        let follows_small = at > 0 && !letters[at - 1].is_uppercase();
        let precedes_small = letters.get(at + 1).is_some_and(|next| next.is_lowercase());
        is_new |= letter.is_uppercase() && (follows_small || precedes_small);
        if is_new {
            found.push(String::new());
        }
        is_new = false;
        found.iter_mut().next_back().into_iter().for_each(|word| word.extend(letter.to_lowercase()));
    }
    found
}

/// Returns the names that a file declares, its own and those of its folders among them; of a GLSL file, its own.
fn names(file: &str, text: &str) -> Vec<Name> {
    if let Some(stem) = file.strip_suffix(".glsl") {
        let text = stem.rsplit('/').next().unwrap_or(stem).to_owned();
        return vec![Name { kind: "GLSL file".to_owned(), text, place: file.to_owned() }];
    }
    let own = file.trim_end_matches(".rs").trim_end_matches("/mod");
    let ends = own.match_indices('/').map(|(end, _)| end).chain([own.len()]);
    let modules = ends.map(|end| {
        let place = &own[..end];
        let text = place.rsplit('/').next().unwrap_or(place);
        Name { kind: "module".to_owned(), text: text.to_owned(), place: place.to_owned() }
    });
    let mut found: Vec<_> = modules.collect();
    let declares = |word: &str| ["fn", "mod", "struct", "enum", "union", "trait", "type"].contains(&word);
    let tokens = tokens(text);
    let traits = public_traits(&tokens);
    for (at, three) in tokens.windows(3).enumerate() {
        let [keyword, name, next] = three else { continue };
        let has_file = keyword.is_word("mod") && next.is_mark(";");
        if keyword.kind == Kind::Word && declares(keyword.text) && name.kind == Kind::Word && !has_file {
            let place = format!("{file}:{}", name.line);
            let kind = match keyword.text {
                "fn" if is_test(&tokens[..at]) => TEST_FN,
                "fn" if !is_public(&tokens[..at]) && !is_method_of(&traits, &tokens, at) => PRIVATE_FN,
                kind => kind,
            };
            found.push(Name { kind: kind.to_owned(), text: name.text.to_owned(), place });
        }
    }
    found
}

/// True if the attributes in front of a declaration have `#[test]`.
fn is_test(mut before: &[Token<'_>]) -> bool {
    while before.last().is_some_and(|token| token.is_mark("]")) {
        let open = before.iter().rposition(|token| token.is_mark("#")).unwrap_or(0);
        if before[open..].get(2).is_some_and(|token| token.is_word("test")) && before.len() == open + 4 {
            return true;
        }
        before = &before[..open];
    }
    false
}

/// True if a declaration behind these tokens is `pub`, as far as the crate or all over.
fn is_public(before: &[Token<'_>]) -> bool {
    let is_qualifier = |token: &Token<'_>| {
        token.kind == Kind::Literal || ["const", "async", "unsafe", "extern"].iter().any(|q| token.is_word(q))
    };
    let qualifiers = before.iter().rev().take_while(|token| is_qualifier(token)).count();
    let mut before = &before[..before.len() - qualifiers];
    if before.last().is_some_and(|token| token.is_mark(")")) {
        let open = before.iter().rposition(|token| token.is_mark("("));
        before = &before[..open.unwrap_or(0)];
    }
    before.last().is_some_and(|token| token.is_word("pub"))
}

/// Returns where the bodies of public traits lie, without their braces.
fn public_traits(tokens: &[Token<'_>]) -> Vec<Range<usize>> {
    let traits = (0..tokens.len()).filter(|&at| tokens[at].is_word("trait") && is_public(&tokens[..at]));
    let bodies = traits.filter_map(|at| {
        let open = at + tokens[at..].iter().position(|token| token.is_mark("{"))?;
        Some(open + 1..group_end(tokens, open) - 1)
    });
    bodies.collect()
}

/// True if the declaration at `at` stands directly in one of the bodies.
fn is_method_of(bodies: &[Range<usize>], tokens: &[Token<'_>], at: usize) -> bool {
    let is_direct = |body: &Range<usize>| tokens[body.start..at].iter().map(nesting).sum::<i32>() == 0;
    bodies.iter().any(|body| body.contains(&at) && is_direct(body))
}

/// Returns the files below a folder of the project with this ending, by path below the project.
pub fn files(folder: &str, ending: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(project().join(folder)).unwrap() {
        let entry = entry.unwrap();
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.file_type().unwrap().is_dir() {
            found.extend(files(&path, ending));
        } else if path.ends_with(ending) {
            let text = std::fs::read_to_string(entry.path()).unwrap();
            found.push((path, text));
        }
    }
    found.sort();
    found
}

#[test]
fn names_use_the_words_of_the_glossary() {
    let glossary = Glossary::parse(&contributing()).unwrap();
    let rust = FOLDERS.into_iter().flat_map(|folder| files(folder, ".rs"));
    let glsl = GLSL_FOLDERS.into_iter().flat_map(|folder| files(folder, ".glsl"));
    let complaints = glossary.complaints(&rust.chain(glsl).collect::<Vec<_>>());
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECTION: &str = "# Glossary
| term | meaning | not |
|---|---|---|
| queue | a `VkQueue` | `lane`, `lanes`, `hand over`, clock |
| BLAS | a level | `shown` |

Never a function's whole name: `of`, `tell`.
Never the first word of a test's name: `what`
- kept: `lane_width`: the width of a SIMD lane
# Next
| a | b | `fine` |";

    fn complaints(file: &str, text: &str) -> Vec<String> {
        let kept = ("kept.rs".to_owned(), "pub fn lane_width() {}".to_owned());
        Glossary::parse(SECTION).unwrap().complaints(&[(file.to_owned(), text.to_owned()), kept])
    }

    #[test]
    fn names_are_split_into_words() {
        for (name, expected) in [
            ("to_lanes2", vec!["to", "lanes2"]),
            ("TlasUpdates", vec!["tlas", "updates"]),
            ("GPUInfo", vec!["gpu", "info"]),
            ("BVH", vec!["bvh"]),
            ("hand over", vec!["hand", "over"]),
        ] {
            assert_eq!(words(name), expected, "{name}");
        }
    }

    #[test]
    fn private_words_are_noticed_in_modules_types_and_functions() {
        assert_eq!(complaints("a/lanes.rs", ""), ["a/lanes: module lanes has the word \"lane\""]);
        assert_eq!(complaints("shown/mod.rs", "").len(), 1);
        for (text, word) in [
            ("\npub(crate) struct ShownSet;", "shown"),
            ("\nenum Lane { A }", "lane"),
            ("\n    pub fn hand_over_texture() {}", "hand over"),
            ("\nmod shown {}", "shown"),
            ("\nenum Showns { A }", "shown"),
            ("\n#[inline] pub(in crate::a::b::c) const unsafe extern \"C\" fn lane() {}", "lane"),
            ("\npub(crate) trait A: B<C> { type D; fn lane(&self) { fn shown() {} } }", "lane"),
        ] {
            let found = complaints("a.rs", text);
            assert!(
                found.len() == 1 && found[0].starts_with("a.rs:2: ") && found[0].contains(word),
                "{found:?}"
            );
        }
        assert_eq!(complaints("a.rs", "fn of() {}"), ["a.rs:1: fn of says nothing of its effect"]);
    }

    #[test]
    fn names_of_tests_are_checked() {
        let tests = "#[test]\n#[ignore = \"slow\"]\nfn shown_is_read() {}\n#[test] fn what_is_read() {}";
        let expected = [
            "a.rs:3: test fn shown_is_read has the word \"shown\"",
            "a.rs:4: test fn what_is_read begins with \"what\"",
        ];
        assert_eq!(complaints("a.rs", tests), expected);
        assert_eq!(
            complaints("a.rs", "#[cfg(test)] fn shown() {} fn what_is_read() {}"),
            Vec::<String>::new()
        );
    }

    #[test]
    fn names_of_glsl_files_are_checked_without_their_folders() {
        let found = complaints("lanes/shown.comp.glsl", "void of() {}");
        assert_eq!(found, ["lanes/shown.comp.glsl: GLSL file shown.comp has the word \"shown\""]);
    }

    #[test]
    fn other_words_and_parts_of_words_pass() {
        let text = "struct Planes; fn clock() { let shown = lanes; } fn hand_it_over() {} fn type_of() {} type Fine = u8;
            // fn shown
            trait A { fn lane(); } pub trait B { fn b() { fn lane() {} } } struct P(pub u8); fn shown() {}
            fn lane_width() {}";
        assert_eq!(complaints("a.rs", text), Vec::<String>::new());
    }

    #[test]
    fn sections_that_cannot_hold_anything_are_refused() {
        let without = |part: &str| Glossary::parse(&SECTION.replace(part, "")).unwrap_err();
        assert!(Glossary::parse("").unwrap_err().contains("Glossary"));
        assert!(without(BARE_NAMES).contains("begins with") && without(FIRST_WORDS).contains("begins with"));
        assert!(without(": the width of a SIMD lane").contains("no reason"));
        assert!(Glossary::parse("# Glossary\nNever a function's whole name: `of`").is_err());
        let unneeded = Glossary::parse(SECTION).unwrap().complaints(&[]);
        assert_eq!(unneeded, ["kept: `lane_width`: no such name needs it"]);
    }
}
