//! The page of bad input: it has every call that can fail and every error, and its tests exist.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use crate::glossary::files;
use crate::held_by::{cells, project};

pub const PAGE: &str = include_str!("../../../docs/bad-input.md");
/// The title of the section about calls that return no `lvk::Result`, behind the tables of those that do.
pub const WITHOUT_ERROR: &str = "\n## Calls without an error\n";
/// The title of the section about other crates than the library, which is the last.
pub const CRATES: &str = "\n## Models and interfaces\n";
/// The public interface, one item a line; `.ci/api` holds it to the sources.
pub const INTERFACE: &str = include_str!("../../../lvk/public-api.txt");
/// The title of the section about values that every call takes.
const CLAMPED: &str = "\n## Values that are clamped\n";
/// The title of the list of calls without rows.
const WITHOUT_ROWS: &str = "Calls that no input makes fail";
/// The title of the list of errors of other causes than input.
const OTHER_CAUSES: &str = "Errors of other causes";
/// The title of the list of calls that have rows, but none of an error that their docstrings name.
const NO_DRIVER: &str = "Errors that no driver at hand makes";
const ERRORS: &str = include_str!("../../../lvk/src/error/mod.rs");
/// Handles of objects. A submission has none.
const HANDLES: [&str; 12] = [
    "AccelStructHandle",
    "BufferHandle",
    "ComputePipelineHandle",
    "OpacityMicromapHandle",
    "QueryPoolHandle",
    "RayTracingLibraryHandle",
    "RayTracingPipelineHandle",
    "RenderPipelineHandle",
    "SamplerHandle",
    "ShaderModuleHandle",
    "SwapchainHandle",
    "TextureHandle",
];

/// Public types whose fields or variants hold a handle, themselves or by another such type.
static HOLDERS_OF_HANDLES: LazyLock<BTreeSet<&'static str>> = LazyLock::new(|| {
    let parts: Vec<_> = INTERFACE.lines().filter_map(part).collect();
    let mut holders = BTreeSet::new();
    loop {
        let known = holders.len();
        let holds = |text: &str| words(text).any(|word| HANDLES.contains(&word) || holders.contains(word));
        let found: Vec<_> = parts.iter().filter(|(_, text)| holds(text)).map(|(name, _)| *name).collect();
        holders.extend(found);
        if holders.len() == known {
            return holders;
        }
    }
});

/// Returns the type of a line with a public field or variant, and the types of what it holds.
fn part(line: &str) -> Option<(&str, &str)> {
    let rest = line.strip_prefix("pub lvk::")?;
    let (name, of) = rest.split_once("::")?;
    let held = of.split_once(": ").or_else(|| of.split_once('('))?.1;
    Some((name.split('<').next()?, held))
}

/// Errors of handles without an object.
const OF_HANDLES: [&str; 2] = ["StaleHandle", "ForeignHandle"];

/// Functions of the harness that expect an error of a variant.
const EXPECTING: [(&str, &str); 4] = [
    ("InvalidUsage", "usage_error("),
    ("InvalidUsage", "expect_refused("),
    ("Unsupported", "unsupported("),
    ("Unsupported", "expect_refused("),
];

/// Functions of the harness that make a call.
const CALLING: [(&str, &str); 1] = [("create_render_pipeline", "staged_pipeline(")];

/// A line of a table of bad input.
#[derive(Debug)]
struct Row<'a> {
    /// Functions, as `Context::wait`.
    calls: Vec<&'a str>,
    /// Variants of `Error`.
    errors: Vec<&'a str>,
    /// Test functions, as `resources::buffers::name`, or `lvk::path::name` for a unit test of the library.
    tests: Vec<&'a str>,
}

impl<'a> Row<'a> {
    /// Returns each call with each error.
    fn pairs(&self) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.calls.iter().flat_map(move |call| self.errors.iter().map(move |error| (*call, *error)))
    }
}

/// A function of the public interface.
#[derive(Debug, PartialEq)]
pub struct Call<'a> {
    /// The type and the function, as `Context::wait`, or the function alone.
    pub name: String,
    /// The list of the arguments, with its parentheses.
    pub arguments: &'a str,
    /// True if it returns `lvk::Result`.
    pub is_fallible: bool,
}

impl Call<'_> {
    /// True if it takes a handle, or a description that holds one.
    fn takes_handle(&self) -> bool {
        words(self.arguments).any(|word| HANDLES.contains(&word) || HOLDERS_OF_HANDLES.contains(word))
    }

    /// True if it takes more than handles.
    fn takes_more(&self) -> bool {
        words(self.arguments).any(|word| !["self", "mut", "lvk"].contains(&word) && !HANDLES.contains(&word))
    }
}

/// Returns the names in backticks of a cell or line.
pub fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Returns the rows of all tables with the head `call | wrong | error | test`, or what is wrong with a line.
fn rows(page: &str) -> Result<Vec<Row<'_>>, String> {
    let mut found = Vec::new();
    for line in page.split(WITHOUT_ERROR).next().unwrap_or_default().lines() {
        let Some(cells) = cells(line) else { continue };
        let [calls, wrong, errors, tests] = cells[..] else { return Err(format!("four cells: {line}")) };
        if tests == "test" || tests == "---" {
            continue;
        }
        let row = Row { calls: quoted(calls), errors: quoted(errors), tests: quoted(tests) };
        if wrong.is_empty() || row.calls.is_empty() || row.errors.is_empty() || row.tests.is_empty() {
            return Err(format!("a cell is empty: {line}"));
        }
        found.push(row);
    }
    Ok(found)
}

/// Returns the names that begin the items of the list below a title.
pub fn list<'a>(page: &'a str, title: &str) -> Vec<&'a str> {
    items(page, title).concat()
}

/// Returns the names that begin each item of the list below a title.
fn items<'a>(page: &'a str, title: &str) -> Vec<Vec<&'a str>> {
    let (_, section) = page.split_once(&format!("\n## {title}\n")).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let items = section.lines().filter_map(|line| line.strip_prefix("- "));
    items.map(|item| quoted(item.split(": ").next().unwrap())).collect()
}

/// Returns the calls of the list of errors that no driver makes, each with the error, which is the last name of its item.
fn without_driver(page: &str) -> BTreeSet<(&str, &str)> {
    let mut found = BTreeSet::new();
    for item in items(page, NO_DRIVER) {
        let (error, calls) = item.split_last().unwrap();
        found.extend(calls.iter().map(|call| (*call, *error)));
    }
    found
}

/// Returns the functions that return `lvk::Result`.
fn fallible_calls() -> Vec<Call<'static>> {
    INTERFACE.lines().filter_map(call).filter(|call| call.is_fallible).collect()
}

/// Returns the function of a line of the interface.
pub fn call(line: &str) -> Option<Call<'_>> {
    let (_, function) = line.split_once("fn lvk::")?;
    let (head, result) = function.rsplit_once(" -> ").unwrap_or((function, ""));
    let (mut name, mut depth) = (String::new(), 0);
    let mut letters = head.char_indices();
    let arguments = loop {
        match letters.next()? {
            (at, '(') if depth == 0 => break &head[at..],
            (_, '<') => depth += 1,
            (_, '>') => depth -= 1,
            (_, letter) if depth == 0 => name.push(letter),
            _ => {}
        }
    };
    Some(Call { name, arguments, is_fallible: result.contains("lvk::Result<") })
}

/// Returns the words of a text: names and numbers.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_').filter(|word| !word.is_empty())
}

/// Returns the variants of `pub enum Error` in a source.
pub fn variants(source: &str) -> Vec<&str> {
    let (_, body) = source.split_once("pub enum Error {\n").unwrap();
    let body = body.split("\n}").next().unwrap();
    let lines = body.lines().filter_map(|line| line.strip_prefix("    "));
    let heads = lines.filter(|line| line.starts_with(|letter: char| letter.is_ascii_uppercase()));
    heads.map(|line| line.split([' ', '(', ',']).next().unwrap()).collect()
}

/// Returns the source of the module of a test.
pub fn source(module: &[&str]) -> Option<String> {
    let files = match module {
        ["lvk", path @ ..] => {
            let path = format!("lvk/src/{}", path.join("/"));
            [format!("{path}.rs"), format!("{path}/mod.rs")]
        }
        path => {
            let path = format!("tests/tests/{}", path.join("/"));
            [format!("{path}.rs"), format!("{path}/main.rs")]
        }
    };
    files.iter().find_map(|file| std::fs::read_to_string(project().join(file)).ok())
}

/// Returns the names of the test functions of a source.
pub fn tests_of(source: &str) -> impl Iterator<Item = &str> {
    let mut marked = false;
    source.lines().map(str::trim).filter_map(move |line| {
        let name = line.strip_prefix("fn ").and_then(|rest| rest.split('(').next()).filter(|_| marked);
        marked = line == "#[test]" || (marked && (line.starts_with("#[") || line.starts_with("//")));
        name
    })
}

/// True if the source has a test function of this name.
pub fn has_test(source: &str, name: &str) -> bool {
    tests_of(source).any(|test| test == name)
}

/// Returns the functions of a source by name, each with its text up to the brace that ends it. Functions of one name are one.
fn functions(source: &str) -> BTreeMap<&str, String> {
    let mut found: BTreeMap<&str, String> = BTreeMap::new();
    let mut lines = source.lines();
    while let Some(line) = lines.next() {
        let indent = line.len() - line.trim_start().len();
        let Some(name) = function_name(line) else { continue };
        let text = found.entry(name).or_default();
        *text += line;
        let end = format!("{}}}", &line[..indent]);
        // A function of one line, or a declaration, ends where it starts.
        if line.ends_with(['}', ';']) {
            continue;
        }
        for line in lines.by_ref() {
            *text += "\n";
            *text += line;
            if line == end {
                break;
            }
        }
    }
    found
}

/// Returns the name of the function that a line begins.
fn function_name(line: &str) -> Option<&str> {
    let (before, rest) = line.trim_start().split_once("fn ")?;
    let qualifiers = ["", "pub ", "pub(crate) ", "pub(super) ", "const ", "unsafe "];
    let name = rest.split(['(', '<']).next()?;
    // A macro's `fn $test` has no name yet.
    (qualifiers.contains(&before) && !name.starts_with('$')).then_some(name)
}

/// Returns the public functions of a source, each with the errors that the section `# Errors` of its docstring names.
fn documented_errors(source: &str) -> Vec<(String, &str)> {
    let (mut found, mut owner, mut docs) = (Vec::new(), "", Vec::new());
    for line in source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default().lines() {
        owner = implemented_type(line).unwrap_or(owner);
        let text = line.trim();
        if let Some(text) = text.strip_prefix("///") {
            docs.push(text.trim());
            continue;
        }
        if let Some(name) = text.strip_prefix("pub ").and_then(function_name) {
            let call = if line == text { name.to_owned() } else { format!("{owner}::{name}") };
            found.extend(linked_errors(&docs).into_iter().map(|error| (call.clone(), error)));
        }
        // Attributes stand between a docstring and its function.
        if !text.starts_with("#[") {
            docs.clear();
        }
    }
    found
}

/// Returns the type of the `impl` block that a line begins.
fn implemented_type(line: &str) -> Option<&str> {
    let head = line.strip_prefix("impl")?;
    let head = if head.starts_with('<') { head.split_once("> ")?.1 } else { head };
    words(head.rsplit(" for ").next()?).next()
}

/// Returns the variants of `Error` that the section `# Errors` of a docstring links.
fn linked_errors<'a>(docs: &[&'a str]) -> Vec<&'a str> {
    let section = docs.iter().copied().skip_while(|line| *line != "# Errors").skip(1);
    let section = section.take_while(|line| !line.starts_with("# "));
    let links = section.flat_map(|line| line.split("](").skip(1)).filter_map(|link| link.split(')').next());
    let names = links.filter_map(|link| {
        ["Error::", "crate::Error::", "Self::"].into_iter().find_map(|path| link.strip_prefix(path))
    });
    // The others are functions.
    names.filter(|name| name.starts_with(|letter: char| letter.is_ascii_uppercase())).collect()
}

/// Returns what is wrong with a page about the errors that docstrings name: those that neither a row nor a list has, and entries of
/// the list of errors that no driver makes which have a row, or which no docstring names.
fn disagreements(page: &str, documented: &[(String, &str)]) -> Vec<String> {
    let rows = rows(page).unwrap();
    let of_rows: BTreeSet<_> = rows.iter().flat_map(Row::pairs).collect();
    let (without_rows, of_others) = (list(page, WITHOUT_ROWS), list(page, OTHER_CAUSES));
    let (without_driver, mut known) = (without_driver(page), BTreeSet::new());
    let mut found = Vec::new();
    for (call, error) in documented {
        let pair = (call.as_str(), *error);
        let has_reason = without_rows.contains(&pair.0) || of_others.contains(&pair.1);
        if known.insert(pair) && !has_reason && !of_rows.contains(&pair) && !without_driver.contains(&pair) {
            found.push(format!("the docstring of {call} names {error}, and it has no row"));
        }
    }
    for pair in without_driver {
        if of_rows.contains(&pair) {
            found.push(format!("{pair:?} is in a row and in the list"));
        }
        if !known.contains(&pair) {
            found.push(format!("{pair:?} is in the list and in no docstring"));
        }
    }
    found
}

/// Returns the text of a test and of every function of its file that the text names, and so on.
pub fn reached_text(source: &str, name: &str) -> String {
    let functions = functions(source);
    let (mut names, mut texts, mut open) = (BTreeSet::new(), String::new(), vec![name]);
    while let Some(name) = open.pop() {
        let Some(text) = functions.get(name).filter(|_| names.insert(name)) else { continue };
        open.extend(words(text).filter(|word| functions.contains_key(word)));
        texts += text;
    }
    texts
}

/// True if a source has these words, and not as a part of a longer name.
pub fn has_words(source: &str, words: &str) -> bool {
    let is_letter = |letter: char| letter.is_alphanumeric() || letter == '_';
    source.match_indices(words).any(|(at, _)| {
        let (before, behind) = (&source[..at], &source[at + words.len()..]);
        let is_part =
            before.ends_with(is_letter) || words.ends_with(is_letter) && behind.starts_with(is_letter);
        !is_part
    })
}

/// Returns what is wrong with the tests of a row. One is missing; or one of them, with the functions of its file that it calls, has no call or
/// no error of the row; or none of them has one of these. Unit tests make no public calls.
fn complaints(row: &Row<'_>) -> Vec<String> {
    let mut found = Vec::new();
    let row_calls: BTreeSet<&str> = row.calls.iter().filter_map(|call| call.rsplit("::").next()).collect();
    let row_errors: BTreeSet<&str> = row.errors.iter().copied().collect();
    let (mut missing_calls, mut missing_errors) = (row_calls.clone(), row_errors.clone());
    let mut has_calls = false;
    for test in &row.tests {
        let path: Vec<&str> = test.split("::").collect();
        let (name, module) = path.split_last().unwrap();
        let Some(source) = source(module).filter(|source| has_test(source, name)) else {
            found.push(format!("there is no test {test}"));
            continue;
        };
        let reached = reached_text(&source, name);
        let calls: Vec<_> = row_calls.iter().filter(|call| is_called(&reached, call)).collect();
        let errors: Vec<_> = row_errors.iter().filter(|error| is_expected(&reached, error)).collect();
        if calls.is_empty() && !test.starts_with("lvk::") {
            found.push(format!("{test} has none of the calls {:?}", row.calls));
        }
        if errors.is_empty() {
            found.push(format!("{test} has none of the errors {:?}", row.errors));
        }
        has_calls |= !test.starts_with("lvk::");
        missing_calls.retain(|call| !calls.contains(&call));
        missing_errors.retain(|error| !errors.contains(&error));
    }
    let missing = missing_calls.iter().filter(|_| has_calls).chain(&missing_errors);
    found.extend(missing.map(|word| format!("{word:?} is not in {:?}", row.tests)));
    found
}

/// True if a text expects the variant of an error, itself or by a helper.
fn is_expected(text: &str, error: &str) -> bool {
    let mut by_helper = EXPECTING.iter().filter(|(variant, _)| *variant == error);
    has_words(text, &format!("Error::{error}")) || by_helper.any(|(_, helper)| text.contains(helper))
}

/// True if a text calls a method, itself or by a helper.
fn is_called(text: &str, name: &str) -> bool {
    let mut by_helper = CALLING.iter().filter(|(call, _)| *call == name);
    has_words(text, &format!("{name}(")) || by_helper.any(|(_, helper)| text.contains(helper))
}

fn assert_none<T: std::fmt::Debug>(what: &str, wrong: &[T]) {
    assert!(wrong.is_empty(), "{what}: {wrong:#?}");
}

#[test]
fn every_fallible_call_has_a_row_or_a_reason() {
    let rows = rows(PAGE).unwrap();
    let by_shortage: BTreeSet<_> = list(PAGE, WITHOUT_ROWS).into_iter().collect();
    let with_rows: BTreeSet<_> = rows.iter().flat_map(|row| &row.calls).copied().collect();
    let calls = fallible_calls();
    assert!(calls.len() > 150, "{} calls", calls.len());
    let known: BTreeSet<_> = calls.iter().map(|call| call.name.as_str()).collect();
    let named: BTreeSet<_> = with_rows.union(&by_shortage).copied().collect();
    assert_none("without a row", &known.difference(&named).collect::<Vec<_>>());
    assert_none("no such call", &named.difference(&known).collect::<Vec<_>>());
    assert_none("in a row and in the list", &with_rows.intersection(&by_shortage).collect::<Vec<_>>());
}

#[test]
fn every_error_has_a_row_or_a_reason() {
    let rows = rows(PAGE).unwrap();
    let with_rows: BTreeSet<_> = rows.iter().flat_map(|row| &row.errors).copied().collect();
    let without: BTreeSet<_> = list(PAGE, OTHER_CAUSES).into_iter().collect();
    let known: BTreeSet<_> = variants(ERRORS).into_iter().collect();
    let named: BTreeSet<_> = with_rows.union(&without).copied().collect();
    assert_none("without a row", &known.difference(&named).collect::<Vec<_>>());
    assert_none("no such error", &named.difference(&known).collect::<Vec<_>>());
    assert_none("in a row and in the list", &with_rows.intersection(&without).collect::<Vec<_>>());
}

#[test]
fn every_error_that_a_docstring_names_has_a_row() {
    let calls: BTreeSet<_> = fallible_calls().into_iter().map(|call| call.name).collect();
    let sources = files("lvk/src", ".rs");
    let documented = sources.iter().flat_map(|(_, text)| documented_errors(text));
    let documented: Vec<_> = documented.filter(|(call, _)| calls.contains(call)).collect();
    assert!(documented.len() > 100, "{} errors", documented.len());
    assert_none("errors of docstrings", &disagreements(PAGE, &documented));
}

#[test]
fn every_row_names_tests_that_make_the_call_and_expect_the_error() {
    let rows = rows(PAGE).unwrap();
    assert_none("wrong rows", &rows.iter().flat_map(complaints).collect::<Vec<_>>());
}

#[test]
fn every_call_with_a_handle_is_tried_with_destroyed_and_foreign_ones() {
    let rows = rows(PAGE).unwrap();
    let tried = |call: &str| {
        let of_handles = |row: &&Row<'_>| OF_HANDLES.iter().all(|error| row.errors.contains(error));
        rows.iter().filter(of_handles).any(|row| row.calls.contains(&call))
    };
    let calls = fallible_calls().into_iter().filter(Call::takes_handle);
    let untried: Vec<_> = calls.filter(|call| !tried(&call.name)).map(|call| call.name).collect();
    assert_none("no row of handles has", &untried);
}

#[test]
fn every_call_that_takes_more_than_handles_has_more_than_their_row() {
    let rows = rows(PAGE).unwrap();
    let of_more = |row: &&Row<'_>| row.errors.iter().any(|error| !OF_HANDLES.contains(error));
    let with_more: BTreeSet<_> = rows.iter().filter(of_more).flat_map(|row| &row.calls).copied().collect();
    let with_rows: BTreeSet<_> = rows.iter().flat_map(|row| &row.calls).copied().collect();
    let (_, clamped) = PAGE.split_once(CLAMPED).unwrap();
    let clamped = quoted(clamped.split("\n## ").next().unwrap());
    let is_alone =
        |name: &str| with_rows.contains(name) && !with_more.contains(name) && !clamped.contains(&name);
    let calls = fallible_calls().into_iter().filter(Call::takes_more).map(|call| call.name);
    let alone: Vec<_> = calls.filter(|name| is_alone(name)).collect();
    assert_none("only a row of handles has", &alone);
}

#[test]
fn wrong_entries_are_noticed() {
    let row = |call, error, test| Row { calls: vec![call], errors: vec![error], tests: vec![test] };
    let right = row(
        "Context::buffer_address",
        "StaleHandle",
        "resources::handles::a_released_object_outlives_its_holder",
    );
    assert_none("right", &complaints(&right));
    let unit = row(
        "Context::a",
        "InvalidUsage",
        "lvk::accel::micromap_desc::impossible_maps_are_errors_that_name_the_micromap_and_the_number",
    );
    assert_none("a unit test", &complaints(&unit));
    for wrong in [
        row("Context::buffer_address", "StaleHandle", "resources::handles::no_such_test"),
        row("Context::buffer_address", "StaleHandle", "resources::handles::expect_all_refused"),
        row(
            "Context::buffer_address",
            "StaleHandle",
            "resources::nowhere::a_released_object_outlives_its_holder",
        ),
        row(
            "Context::no_such_call",
            "StaleHandle",
            "resources::handles::a_released_object_outlives_its_holder",
        ),
        row(
            "Context::buffer_address",
            "OverBudget",
            "resources::handles::a_released_object_outlives_its_holder",
        ),
    ] {
        assert_eq!(complaints(&wrong).iter().filter(|text| !text.is_empty()).count().min(1), 1, "{wrong:?}");
    }
    assert!(rows("| `a` | b | `c` |").is_err() && rows("| `a` | | `C` | `d::e` |").is_err());
    assert_eq!(rows("| call | wrong | error | test |\n|---|---|---|---|\n").unwrap().len(), 0);
}

/// A source with functions that link errors in the three ways, and in no section of errors.
const DOCUMENTED: &str = "
/// # Errors
/// [`Shader`](crate::Error::Shader).
pub fn free() {}

impl Other for Heap {
    /// # Errors
    /// [`File`](Error::File).
    fn hidden() {}
}

impl<H: Destroy> Holder<H> {
    /// Unlike [`File`](Error::File).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for one; as [`other`](Self::other), and
    /// [`Unsupported`](Self::Unsupported).
    ///
    /// # Examples
    /// [`File`](Error::File).
    #[must_use]
    pub unsafe fn taken(
        self,
    ) -> Result<()> {
    }

    pub const fn undocumented() {}
}

#[cfg(test)]
mod tests {
    /// # Errors
    /// [`File`](Error::File).
    pub fn later() {}
}
";

#[test]
fn errors_of_docstrings_are_read() {
    let of = |call: &str, error| (call.to_owned(), error);
    let expected =
        [of("free", "Shader"), of("Holder::taken", "InvalidUsage"), of("Holder::taken", "Unsupported")];
    assert_eq!(documented_errors(DOCUMENTED), expected);
    let types = ["impl A {", "impl<'a, T: B> C<'a, T> {", "impl D for E<'_> {", "    impl F {", "fn g() {}"];
    assert_eq!(types.map(implemented_type), [Some("A"), Some("C"), Some("E"), None, None]);
}

#[test]
fn errors_of_docstrings_without_a_row_are_noticed() {
    let documented = documented_errors(DOCUMENTED);
    let wrong = |row: &str, without_rows: &str, without_driver: &str| {
        let lists = [(WITHOUT_ROWS, without_rows), (OTHER_CAUSES, "`Shader`"), (NO_DRIVER, without_driver)];
        let lists = lists.map(|(title, item)| format!("\n## {title}\n\n- {item}: a reason\n"));
        disagreements(&format!("{row}\n{}", lists.concat()), &documented)
    };
    let both = "| `Holder::taken` | all | `InvalidUsage`, `Unsupported` | `a::b` |";
    let one = "| `Holder::taken`, `free` | all | `InvalidUsage` | `a::b` |";
    let unlisted = "`A::b`, `Vulkan`";
    assert_none("in the list of calls", &wrong("", "`Holder::taken`", "`Holder::taken`, `Unsupported`"));
    assert_none("in the list of errors", &wrong(one, "`A::b`", "`Holder::taken`, `Unsupported`"));
    let missing = "the docstring of Holder::taken names Unsupported, and it has no row";
    let needless = "(\"A::b\", \"Vulkan\") is in the list and in no docstring";
    assert_eq!(wrong(one, "`A::b`", unlisted), [missing, needless]);
    assert_eq!(wrong(both, "`A::b`", unlisted), [needless]);
    let twice = "(\"Holder::taken\", \"Unsupported\") is in a row and in the list";
    assert_eq!(wrong(both, "`A::b`", "`Holder::taken`, `Unsupported`"), [twice]);
}

#[test]
fn texts_of_tests_have_the_functions_that_they_call() {
    let source = "#[test]\nfn a() {\n    b(1);\n}\n\nfn b(n: u32) {\n    if n {\n        C.d();\n    }\n}\nfn e() {}\n\
                  fn f() { g() }\nmod m {\n    pub fn d() {\n        h();\n    }\n}\n";
    assert_eq!(functions(source).keys().copied().collect::<Vec<_>>(), ["a", "b", "d", "e", "f"]);
    let text = reached_text(source, "a");
    assert!(text.contains("b(1)") && text.contains("C.d()") && text.contains("h()") && !text.contains("g()"));
    assert_eq!(reached_text(source, "no_such_test"), "");
}

#[test]
fn the_interface_is_read() {
    let found =
        |name: &str, arguments, is_fallible| Some(Call { name: name.to_owned(), arguments, is_fallible });
    let upload = "pub fn lvk::CommandBuffer::upload<T: a::B>(&mut self, &T) -> lvk::Result<u64>";
    assert_eq!(call(upload), found("CommandBuffer::upload", "(&mut self, &T)", true));
    let address = "pub fn lvk::Holder<lvk::BufferHandle>::address(&self) -> lvk::Result<u64>";
    assert_eq!(call(address), found("Holder::address", "(&self)", true));
    assert_eq!(
        call("pub const fn lvk::a(u32) -> &'static lvk::B").map(|call| call.name).as_deref(),
        Some("a")
    );
    assert_eq!(call("pub struct lvk::Context"), None);
    let raw = "pub unsafe fn lvk::Context::raw(&self, &[lvk::BufferHandle]) -> a::Vec<lvk::Result<()>>";
    assert_eq!(call(raw), found("Context::raw", "(&self, &[lvk::BufferHandle])", true));
    let takes = |line| call(line).map(|call| (call.takes_handle(), call.takes_more()));
    assert_eq!(takes(raw), Some((true, false)));
    assert_eq!(takes(upload), Some((false, true)));
    assert_eq!(takes(address), Some((false, false)));
    assert_eq!(takes("pub fn lvk::A::b(&self, lvk::BufferHandle, [u32; 2])"), Some((true, true)));
    assert_eq!(takes("pub fn lvk::A::b(&self, &lvk::BlasDesc<'_>)"), Some((true, true)), "by its geometries");
    assert_eq!(takes("pub fn lvk::A::b(&self, &lvk::BufferDesc<'_>)"), Some((false, true)));
    assert_eq!(part("pub lvk::BlasGeometry::Aabbs(lvk::Aabbs)"), Some(("BlasGeometry", "lvk::Aabbs)")));
    assert_eq!(part("pub fn lvk::A::b(&self, lvk::BufferHandle)"), None);
    assert_eq!(
        variants(
            "pub enum Error {\n    /// A.\n    A {\n        /// B.\n        b: u32,\n    },\n    C(u32),\n}\n"
        ),
        ["A", "C"]
    );
}
