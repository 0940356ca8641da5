//! The modules of a crate and the paths by which they name each other, read from source text.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::rust_tokens::{Kind, Token, group_end, nesting, tokens, without_tests};

/// A module's path below the crate, such as `["accel", "blas"]`; the crate itself is empty.
pub type ModulePath = Vec<String>;

/// A path in code, as it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenPath {
    pub line: usize,
    pub segments: Vec<String>,
    /// Modules within the file that the path stands in.
    inline: ModulePath,
    /// The name that a `use` gives it; `None` for a path outside of `use`.
    name: Option<String>,
}

/// The declarations and paths of one file.
#[derive(Debug, Default)]
pub struct Module {
    /// The file's path below the crate's `src`.
    pub file: String,
    pub paths: Vec<WrittenPath>,
    items: BTreeSet<String>,
    /// Modules whose declaration only builds of tests contain.
    test_modules: BTreeSet<String>,
}

/// The modules of a crate outside of test code, by path.
#[derive(Debug, Default)]
pub struct Crate {
    pub modules: BTreeMap<ModulePath, Module>,
}

impl Crate {
    /// Reads every Rust file below `src`.
    pub fn read(src: &Path) -> Self {
        let mut files = Vec::new();
        let mut folders = vec![src.to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                let path = entry.path();
                let name = path.strip_prefix(src).unwrap_or(&path).to_string_lossy().into_owned();
                match std::fs::read_to_string(&path) {
                    _ if path.is_dir() => folders.push(path),
                    Ok(text) if name.ends_with(".rs") => files.push((name, text)),
                    _ => {}
                }
            }
        }
        Self::from_files(files.iter().map(|(name, text)| (name.as_str(), text.as_str())))
    }

    /// Builds the modules of `(path below src, text)` pairs.
    pub fn from_files<'a>(files: impl Iterator<Item = (&'a str, &'a str)>) -> Self {
        let mut modules: BTreeMap<_, _> =
            files.map(|(file, text)| (module_path(file), read_module(file, text))).collect();
        let tests: Vec<ModulePath> = modules
            .iter()
            .flat_map(|(path, module)| module.test_modules.iter().map(|name| child(path, name)))
            .collect();
        modules.retain(|path, _| !tests.iter().any(|test| path.starts_with(test)));
        Self { modules }
    }

    /// Returns the path below the crate that `written` in `module` stands for; `None` for other crates and local names.
    pub fn absolute(&self, module: &[String], written: &WrittenPath) -> Option<ModulePath> {
        let within = [module, &written.inline].concat();
        self.absolute_segments(&within, &written.segments, written.name.is_some(), 0)
    }

    fn absolute_segments(
        &self,
        within: &[String],
        segments: &[String],
        is_use: bool,
        depth: usize,
    ) -> Option<ModulePath> {
        let (first, rest) = segments.split_first()?;
        match first.as_str() {
            "crate" => Some(rest.to_vec()),
            "self" if is_use || !rest.is_empty() => Some(self.relative(within, rest)),
            "super" => Some(self.relative(&within[..within.len().checked_sub(1)?], rest)),
            _ if self.modules.contains_key(&child(within, first)) => Some([within, segments].concat()),
            _ => {
                let named = self.named_by_use(within, first).filter(|named| named.segments != segments)?;
                let path = [named.segments.as_slice(), rest].concat();
                if depth > 8 { None } else { self.absolute_segments(within, &path, true, depth + 1) }
            }
        }
    }

    /// Returns `segments`, which may begin with more of `super`, below `within`.
    fn relative(&self, within: &[String], segments: &[String]) -> ModulePath {
        match segments.split_first() {
            Some((first, rest)) if first == "super" && !within.is_empty() => {
                self.relative(&within[..within.len() - 1], rest)
            }
            _ => [within, segments].concat(),
        }
    }

    /// Returns the `use` that gives `name` in the module `within`, which may be one inside a file.
    fn named_by_use(&self, within: &[String], name: &str) -> Option<&WrittenPath> {
        let file = self.file_of(within);
        let inline = &within[file.len()..];
        let mut paths = self.modules.get(file)?.paths.iter();
        paths.find(|path| path.inline == inline && path.name.as_deref() == Some(name))
    }

    /// Returns the longest part of `path` that is a module with a file of its own.
    fn file_of<'a>(&self, path: &'a [String]) -> &'a [String] {
        let length = (0..=path.len()).rev().find(|&length| self.modules.contains_key(&path[..length]));
        &path[..length.unwrap_or(0)]
    }

    /// Returns the module that declares what the absolute path `path` names. A re-export leads to the module that
    /// declares the item.
    pub fn declared_in(&self, path: &[String]) -> ModulePath {
        self.declared_in_at_depth(path, 0)
    }

    fn declared_in_at_depth(&self, path: &[String], depth: usize) -> ModulePath {
        let module = self.file_of(path);
        let Some(item) = path.get(module.len()) else { return module.to_vec() };
        let is_declared =
            |module: &[String]| self.modules.get(module).is_some_and(|m| m.items.contains(item));
        if is_declared(module) || depth > 8 {
            return module.to_vec();
        }
        if let Some(named) = self.named_by_use(module, item) {
            let further = [named.segments.as_slice(), &path[module.len() + 1..]].concat();
            let target = self.absolute_segments(module, &further, true, 0);
            return target.map_or(module.to_vec(), |target| self.declared_in_at_depth(&target, depth + 1));
        }
        let paths = self.modules.get(module).into_iter().flat_map(|module| &module.paths);
        let globs = paths.filter(|path| path.name.as_deref() == Some("*"));
        let mut sources = globs.filter_map(|glob| self.absolute(module, glob));
        sources.find(|source| is_declared(source)).unwrap_or(module.to_vec())
    }
}

/// Returns the module that a file below `src` holds.
fn module_path(file: &str) -> ModulePath {
    let stem = file.strip_suffix(".rs").unwrap_or(file);
    let stem = stem.strip_suffix("/mod").unwrap_or(stem);
    if stem == "lib" { Vec::new() } else { stem.split('/').map(str::to_owned).collect() }
}

fn child(module: &[String], name: &str) -> ModulePath {
    [module, &[name.to_owned()]].concat()
}

fn read_module(file: &str, text: &str) -> Module {
    let all = tokens(text);
    let mut reader =
        Reader { module: Module { file: file.to_owned(), ..Module::default() }, ..Reader::default() };
    let outside_tests = without_tests(&all);
    reader.read(&outside_tests);
    let declared = declared_modules(&outside_tests);
    reader.module.test_modules =
        declared_modules(&all).into_iter().filter(|name| !declared.contains(name)).collect();
    reader.module
}

/// Returns the names of modules that have a file of their own.
fn declared_modules(tokens: &[Token<'_>]) -> BTreeSet<String> {
    let declarations = tokens.windows(3).filter(|three| three[0].is_word("mod") && three[2].is_mark(";"));
    declarations.map(|three| three[1].text.to_owned()).collect()
}

#[derive(Default)]
struct Reader {
    module: Module,
    depth: i32,
    /// Open modules within the file, each with the depth of its content.
    inline: Vec<(String, i32)>,
}

impl Reader {
    fn read(&mut self, tokens: &[Token<'_>]) {
        let mut at = 0;
        while at < tokens.len() {
            at = self.read_one(tokens, at);
        }
    }

    /// Reads what begins at `at` and returns where the next thing begins.
    fn read_one(&mut self, tokens: &[Token<'_>], at: usize) -> usize {
        let next = |offset: usize| tokens.get(at + offset);
        let next_is = |offset: usize, mark: &str| next(offset).is_some_and(|token| token.is_mark(mark));
        let token = &tokens[at];
        if token.is_word("mod") && next_is(2, "{") {
            self.add_item(tokens[at + 1].text);
            self.depth += 1;
            self.inline.push((tokens[at + 1].text.to_owned(), self.depth));
            return at + 3;
        }
        if token.is_word("use") && !next_is(1, "<") {
            return self.read_use(tokens, at + 1, &[]) + 1;
        }
        if token.kind == Kind::Word && next_is(1, "::") && !is_within_path(tokens, at) {
            return self.read_path(tokens, at);
        }
        if token.kind == Kind::Word && is_declaration(token.text) {
            let name = next(1).filter(|name| name.kind == Kind::Word);
            name.into_iter().for_each(|name| self.add_item(name.text));
        }
        self.depth += nesting(token);
        self.inline.retain(|(_, depth)| *depth <= self.depth);
        at + 1
    }

    /// Adds an item that stands directly in the file's module.
    fn add_item(&mut self, name: &str) {
        if self.depth == 0 {
            self.module.items.insert(name.to_owned());
        }
    }

    fn add(&mut self, line: usize, segments: Vec<String>, name: Option<&str>) {
        let inline = self.inline.iter().map(|(name, _)| name.clone()).collect();
        self.module.paths.push(WrittenPath { line, segments, inline, name: name.map(str::to_owned) });
    }

    /// Reads a tree of imports below `prefix` and returns where it ends.
    fn read_use(&mut self, tokens: &[Token<'_>], start: usize, prefix: &[String]) -> usize {
        let (mut segments, mut at) = (prefix.to_vec(), start);
        while let Some(token) = tokens.get(at) {
            match token.text {
                "{" => return self.read_use_group(tokens, at, &segments),
                "*" => {
                    self.add(token.line, segments, Some("*"));
                    return at + 1;
                }
                "as" => break,
                // The path of another crate.
                "::" if at == start => segments.push(String::new()),
                "::" => {}
                "self" if !segments.is_empty() => {}
                word if token.kind == Kind::Word => segments.push(word.to_owned()),
                _ => break,
            }
            at += 1;
        }
        let line = tokens[at - 1].line;
        let renamed = tokens.get(at).is_some_and(|token| token.is_word("as"));
        let name = if renamed { Some(tokens[at + 1].text.to_owned()) } else { segments.last().cloned() };
        self.add(line, segments, name.as_deref());
        if renamed { at + 2 } else { at }
    }

    fn read_use_group(&mut self, tokens: &[Token<'_>], open: usize, prefix: &[String]) -> usize {
        let end = group_end(tokens, open);
        let mut at = open + 1;
        while at + 1 < end {
            let after = self.read_use(tokens, at, prefix);
            at = after + usize::from(tokens[after].is_mark(","));
        }
        end
    }

    fn read_path(&mut self, tokens: &[Token<'_>], start: usize) -> usize {
        let (mut segments, mut at) = (vec![tokens[start].text.to_owned()], start + 1);
        while let [colons, word, ..] = &tokens[at..]
            && colons.is_mark("::")
            && word.kind == Kind::Word
        {
            segments.push(word.text.to_owned());
            at += 2;
        }
        // An exported macro is named by the crate's root, whichever file defines it.
        if !is_macro_call(&tokens[at..]) {
            self.add(tokens[start].line, segments, None);
        }
        at
    }
}

fn is_macro_call(rest: &[Token<'_>]) -> bool {
    matches!(rest, [mark, open, ..] if mark.is_mark("!") && ["(", "[", "{"].iter().any(|text| open.is_mark(text)))
}

fn is_within_path(tokens: &[Token<'_>], at: usize) -> bool {
    at > 0 && (tokens[at - 1].is_mark("::") || tokens[at - 1].is_mark("."))
}

fn is_declaration(word: &str) -> bool {
    ["fn", "struct", "enum", "union", "trait", "type", "const", "static", "macro_rules"].contains(&word)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the modules that the paths of `module` lead to, each once.
    fn targets(files: &[(&str, &str)], module: &str) -> BTreeSet<String> {
        let found = Crate::from_files(files.iter().copied());
        let path = module_path(&format!("{module}.rs"));
        let paths = found.modules[&path].paths.iter();
        paths
            .filter_map(|written| found.absolute(&path, written))
            .map(|absolute| found.declared_in(&absolute).join("::"))
            .collect()
    }

    #[test]
    fn every_form_of_import_is_read() {
        let a = "use crate::b::{self, c::{C, D as E}, *};
            pub(crate) use super::a::deep::F;
            use std::fmt;
            use ::d::G;
            impl Iterator<Item = u8> + use<'_> for X {}
            fn f() { let x = crate::d::H::new::<u8>(); c::g(); deep::h() }
            fn made() { crate::exported!(1) }
            macro_rules! m { () => { $crate::e::I } }";
        let files = [
            ("a.rs", a),
            ("a/deep.rs", ""),
            ("b/mod.rs", ""),
            ("b/c.rs", ""),
            ("d.rs", ""),
            ("e.rs", ""),
            ("lib.rs", ""),
        ];
        assert_eq!(targets(&files, "a"), ["a::deep", "b", "b::c", "d", "e"].map(str::to_owned).into());
    }

    #[test]
    fn a_reexport_leads_to_what_declares_the_item() {
        let files = [
            ("lib.rs", "mod a; pub use a::A;"),
            ("a/mod.rs", "mod b; mod c; pub(crate) use b::A; pub(crate) use c::*; pub(crate) struct Own;"),
            ("a/b.rs", "pub struct A;"),
            ("a/c.rs", "pub fn glob() {}"),
            ("user.rs", "use crate::a; use crate::A; fn f() { a::glob() }"),
            ("own.rs", "use crate::a::Own;"),
        ];
        assert_eq!(targets(&files, "user"), ["a", "a::b", "a::c"].map(str::to_owned).into());
        assert_eq!(targets(&files, "own"), ["a".to_owned()].into());
    }

    #[test]
    fn paths_of_inner_modules_begin_there() {
        let files =
            [("a.rs", "mod inner { use super::super::b::B; } use super::c::C;"), ("b.rs", ""), ("c.rs", "")];
        assert_eq!(targets(&files, "a"), ["b", "c"].map(str::to_owned).into());
    }

    #[test]
    fn modules_for_tests_are_left_out_by_their_declaration_not_by_name() {
        let files = [
            ("lib.rs", "mod a; mod b; #[cfg(any(test, feature = \"test-hooks\"))] mod test_support;"),
            ("a.rs", "#[cfg(test)] mod twin; #[cfg(test)] mod tests { use crate::b::B; } // crate::b::B"),
            ("a/twin.rs", "use crate::b::B;"),
            ("b.rs", "#[cfg(test)] mod c_tests; #[cfg(test)] mod test_model; mod size_model;"),
            ("b/c_tests.rs", ""),
            ("b/size_model.rs", ""),
            ("b/test_model.rs", ""),
            ("test_support/mod.rs", "mod model;"),
            ("test_support/model.rs", ""),
        ];
        let found = Crate::from_files(files.into_iter());
        assert_eq!(
            found.modules.values().map(|module| &*module.file).collect::<Vec<_>>(),
            ["lib.rs", "a.rs", "b.rs", "b/size_model.rs"]
        );
        assert_eq!(targets(&files, "a"), BTreeSet::new());
    }
}
