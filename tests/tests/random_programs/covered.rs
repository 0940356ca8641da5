//! Every public method of contexts, command buffers and render passes is called by the programs, or is named with a
//! reason in the table `Not covered` of `docs/reliability.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Types whose methods count, with the names that their values have in the programs.
const TYPES: [(&str, &[&str]); 3] =
    [("Context", &["ctx()", "ctx"]), ("CommandBuffer", &["cmd"]), ("RenderPass", &["pass", "drawn"])];

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Returns the text of every file of Rust in a folder and below it.
fn sources(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let paths = entries.into_iter().flatten().map(|entry| entry.path());
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.extend(std::fs::read_to_string(&path));
        }
    }
    found
}

/// Returns the public methods of a source, as `Type::name`, without those of builds of tests.
fn methods(source: &str) -> BTreeSet<String> {
    let (mut found, mut of, mut is_of_tests) = (BTreeSet::new(), None, false);
    for line in source.lines() {
        if let Some(head) = line.strip_prefix("impl").filter(|_| line.ends_with('{')) {
            let name = head.trim_start_matches("<'a>").trim_start().split([' ', '<']).next();
            of = TYPES.iter().map(|(name, _)| *name).find(|known| Some(*known) == name);
        } else if line == "}" {
            of = None;
        }
        let line = line.trim_start();
        let words = line.strip_prefix("pub fn ").or_else(|| line.strip_prefix("pub unsafe fn "));
        let name = words.and_then(|words| words.split(['(', '<']).next());
        if let (Some(of), Some(name), false) = (of, name, is_of_tests) {
            found.insert(format!("{of}::{name}"));
        }
        is_of_tests =
            line.starts_with("#[cfg(") && line.contains("test") || is_of_tests && line.starts_with('#');
    }
    found
}

/// Returns the methods of a type that sources call on values with these names.
fn called<'a>(methods: &'a BTreeSet<String>, sources: &str) -> BTreeSet<&'a str> {
    let is_called = |method: &&String| {
        let (of, name) = method.split_once("::").unwrap_or_default();
        let values = TYPES.iter().find(|(known, _)| *known == of).map_or(&[][..], |(_, values)| *values);
        values
            .iter()
            .any(|value| ["(", "::<"].iter().any(|open| sources.contains(&format!("{value}.{name}{open}"))))
    };
    methods.iter().filter(is_called).map(String::as_str).collect()
}

/// Returns the methods that the table of a document names, each with its reason.
fn not_covered(document: &str) -> BTreeMap<String, String> {
    let rows = document.lines().skip_while(|line| *line != "| not called | why |").skip(2);
    let mut found = BTreeMap::new();
    for row in rows.take_while(|row| row.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let names = cells[0].split(", ").map(|name| name.trim_matches('`').to_owned());
        found.extend(names.map(|name| (name, cells.get(1).copied().unwrap_or_default().to_owned())));
    }
    found
}

#[test]
fn programs_call_every_method_that_the_document_does_not_name() {
    let library = project().join("lvk/src");
    let methods: BTreeSet<String> = sources(&library).iter().flat_map(|source| methods(source)).collect();
    assert!(methods.len() > 150, "{} methods are found", methods.len());
    let own = sources(&project().join("tests/tests/random_programs")).concat();
    let own: String = own.split_whitespace().collect();
    let called = called(&methods, &own);
    let document = std::fs::read_to_string(project().join("docs/reliability.md")).unwrap_or_default();
    let excused = not_covered(&document);
    let methods = || methods.iter().map(String::as_str);
    let missing: Vec<_> =
        methods().filter(|method| !called.contains(method) && !excused.contains_key(*method)).collect();
    assert!(missing.is_empty(), "neither called nor in the table of docs/reliability.md: {missing:#?}");
    for (name, why) in &excused {
        assert!(methods().any(|method| method == name), "there is no {name}");
        assert!(!called.contains(name.as_str()), "{name} is called, and is in the table");
        assert!(!why.is_empty(), "{name} has no reason");
    }
}

#[test]
fn methods_and_their_calls_are_recognised() {
    let source = "
impl Context {
    pub fn wait(&self) {
    }
    #[cfg(any(test, feature = \"test-hooks\"))]
    #[doc(hidden)]
    pub fn hidden(&self) {}
    pub unsafe fn import<T>(&self) {}
    pub(crate) fn own(&self) {}
}
impl Readback {
    pub fn is_ready(&self) {}
}
impl<'a> RenderPass<'a> {
    pub fn draw(&mut self) {}
}
";
    let found = methods(source);
    assert_eq!(found.iter().collect::<Vec<_>>(), ["Context::import", "Context::wait", "RenderPass::draw"]);
    let calls = called(&found, "self.ctx().import::<u8>();readback.wait();pass.draw(0..3)");
    assert_eq!(calls.into_iter().collect::<Vec<_>>(), ["Context::import", "RenderPass::draw"]);
    let table = not_covered("a\n| not called | why |\n|---|---|\n| `A::b`, `A::c` | d |\n\ne");
    assert_eq!(
        table.into_iter().collect::<Vec<_>>(),
        [("A::b", "d"), ("A::c", "d")].map(|(a, b)| (a.into(), b.into()))
    );
}
