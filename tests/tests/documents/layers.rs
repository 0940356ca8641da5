//! The layers of the library: a module imports only modules that stand above it in the `layers` block of
//! `CONTRIBUTING.md`.
//!
//! A line of the block is `name: description`, from the ground up. A name is a top-level module, or a path such as
//! `folder::module` for a module with a layer of its own. A line `except: a -> b: reason` allows `a` to import `b`, which
//! stands below `a`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::{BTreeMap, BTreeSet};

use crate::contributing::{block, contributing};
use crate::held_by::project;
use crate::rust_modules::Crate;

const MOST_EXCEPTIONS: usize = 5;

/// The `layers` block.
#[derive(Debug, Default, PartialEq)]
struct Layers<'a> {
    /// Modules, from the ground up.
    modules: Vec<&'a str>,
    /// Pairs of an importing and an imported module.
    exceptions: Vec<(&'a str, &'a str)>,
}

impl<'a> Layers<'a> {
    fn parse(text: &'a str) -> Result<Self, String> {
        let mut layers = Self::default();
        for line in block(text, "layers")? {
            let (name, rest) = line.split_once(": ").ok_or(format!("no `name: description`: {line:?}"))?;
            if name != "except" {
                layers.modules.push(name);
                continue;
            }
            let (from, to_and_reason) =
                rest.split_once(" -> ").ok_or(format!("no `a -> b: reason`: {line:?}"))?;
            let (to, _reason) =
                to_and_reason.split_once(": ").ok_or(format!("an exception without a reason: {line:?}"))?;
            layers.exceptions.push((from, to));
        }
        let unique: BTreeSet<_> = layers.modules.iter().collect();
        if unique.len() < layers.modules.len() {
            return Err("the block lists a module twice".to_owned());
        }
        if layers.exceptions.len() > MOST_EXCEPTIONS {
            return Err(format!(
                "{} exceptions, of which {MOST_EXCEPTIONS} are allowed",
                layers.exceptions.len()
            ));
        }
        Ok(layers)
    }

    /// Returns what is wrong with the imports of `library`, and with the block itself.
    fn complaints(&self, library: &Crate) -> Vec<String> {
        let mut there: BTreeSet<_> =
            library.modules.keys().filter_map(|path| path.first().cloned()).collect();
        there.extend(
            library.modules.keys().map(|path| path.join("::")).filter(|path| self.has_own_layer(path)),
        );
        let there: BTreeSet<_> = there.iter().map(String::as_str).collect();
        let listed: BTreeSet<_> = self.modules.iter().copied().collect();
        let mut found: Vec<_> =
            there.difference(&listed).map(|name| format!("{name}: not in the block")).collect();
        found.extend(listed.difference(&there).map(|name| format!("{name}: in the block, but no module")));
        let position = |name: &str| self.modules.iter().position(|module| *module == name);
        let mut unused: BTreeSet<_> = self.exceptions.iter().copied().collect();
        for ((file, from, to), lines) in self.imports(library) {
            let stands_above = position(&to) < position(&from) || position(&to).is_none();
            if stands_above {
                continue;
            }
            if let Some(exception) = self.exceptions.iter().find(|(a, b)| *a == from && *b == to) {
                unused.remove(exception);
                continue;
            }
            found.push(format!("lvk/src/{file}:{lines}: {from} imports {to}, which stands below it"));
        }
        found.extend(
            unused.iter().map(|(from, to)| format!("except: {from} -> {to}: no such import is left")),
        );
        found
    }

    /// True if a path below a top-level module is listed.
    fn has_own_layer(&self, path: &str) -> bool {
        path.contains("::") && self.modules.contains(&path)
    }

    /// Returns the listed module that holds a module: the longest one, else the top-level module.
    fn layer_of(&self, path: &[String]) -> Option<String> {
        let own = (2..=path.len()).rev().map(|length| path[..length].join("::"));
        own.into_iter().find(|path| self.has_own_layer(path)).or_else(|| path.first().cloned())
    }

    /// Returns the lines of imports between layers, by file, importing layer and imported layer.
    fn imports(&self, library: &Crate) -> BTreeMap<(String, String, String), String> {
        let mut found: BTreeMap<_, BTreeSet<usize>> = BTreeMap::new();
        for (path, module) in &library.modules {
            let Some(from) = self.layer_of(path) else { continue };
            for written in &module.paths {
                let Some(absolute) = library.absolute(path, written) else { continue };
                // A root re-export is not a module: its declaration is.
                let is_module =
                    absolute.first().is_some_and(|first| library.modules.contains_key(&vec![first.clone()]));
                let target = if is_module { absolute } else { library.declared_in(&absolute) };
                let Some(to) = self.layer_of(&target).filter(|to| *to != from) else { continue };
                found.entry((module.file.clone(), from.clone(), to)).or_default().insert(written.line);
            }
        }
        let joined =
            |lines: BTreeSet<usize>| lines.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        found.into_iter().map(|(key, lines)| (key, joined(lines))).collect()
    }
}

#[test]
fn modules_import_only_what_stands_above_them() {
    let text = contributing();
    let layers = Layers::parse(&text).unwrap();
    let complaints = layers.complaints(&Crate::read(&project().join("lvk/src")));
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILES: [(&str, &str); 6] = [
        ("lib.rs", "mod ground; mod gpu; mod roof; pub use ground::Error; pub use roof::Roof;"),
        ("ground.rs", "pub struct Error;"),
        ("gpu/mod.rs", "use crate::ground::Error; use crate::Error as Same; mod device;"),
        ("gpu/device.rs", "use super::super::ground; fn f() { super::other() }"),
        ("roof/mod.rs", "use crate::{ground::Error, gpu::{self, device::Device}};\npub struct Roof;"),
        ("roof/part.rs", "// use crate::beyond::X;\n#[cfg(test)]\nuse crate::beyond::X;"),
    ];

    fn complaints(block: &str, changed: (&str, &str)) -> Vec<String> {
        let text = format!("```layers\n{block}\n```");
        let files = FILES.into_iter().filter(|(file, _)| *file != changed.0).chain([changed]);
        Layers::parse(&text).unwrap().complaints(&Crate::from_files(files))
    }

    const BLOCK: &str = "ground: a\ngpu: b\nroof: c";

    #[test]
    fn a_tree_in_order_passes() {
        assert_eq!(complaints(BLOCK, FILES[0]), Vec::<String>::new());
    }

    #[test]
    fn an_import_from_below_is_named_with_its_lines() {
        let upwards =
            ["use crate::roof::Roof;", "fn f() { crate::roof::f() }", "use crate::Roof;", "use super::roof;"];
        for import in upwards {
            let text = format!("pub struct Error;\n\n{import}");
            let expected = ["lvk/src/ground.rs:3: ground imports roof, which stands below it"];
            assert_eq!(complaints(BLOCK, ("ground.rs", &text)), expected, "{import}");
        }
    }

    #[test]
    fn a_module_below_a_folder_may_have_a_layer_of_its_own() {
        let block = "ground: a\ngpu: b\ngpu::device: d\nroof: c";
        assert_eq!(complaints(block, FILES[0]), Vec::<String>::new());
        let folder = ("gpu/mod.rs", "use self::device::Device; mod device;");
        assert_eq!(complaints(BLOCK, folder), Vec::<String>::new());
        let expected = ["lvk/src/gpu/mod.rs:1: gpu imports gpu::device, which stands below it"];
        assert_eq!(complaints(block, folder), expected);
    }

    #[test]
    fn an_exception_allows_one_import_and_must_be_needed() {
        let allowed = format!("{BLOCK}\nexcept: ground -> roof: a reason");
        assert_eq!(complaints(&allowed, ("ground.rs", "use crate::roof::Roof;")), Vec::<String>::new());
        assert_eq!(complaints(&allowed, FILES[1]), ["except: ground -> roof: no such import is left"]);
    }

    #[test]
    fn modules_and_lines_of_the_block_are_the_same_set() {
        assert_eq!(
            complaints(&format!("{BLOCK}\ncellar: d"), FILES[0]),
            ["cellar: in the block, but no module"]
        );
        assert_eq!(complaints(BLOCK, ("attic.rs", "")), ["attic: not in the block"]);
    }

    #[test]
    fn blocks_that_cannot_be_read_are_refused() {
        let six = "except: a -> b: c\n".repeat(MOST_EXCEPTIONS + 1);
        for block in ["ground", "ground: a\nground: b", "except: a -> b", &six] {
            assert!(Layers::parse(&format!("```layers\n{block}\n```")).is_err(), "{block}");
        }
        assert!(Layers::parse("").unwrap_err().contains("```layers"));
    }
}
