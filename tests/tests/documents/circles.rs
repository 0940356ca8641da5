//! The files of the library import each other without circles. A folder's `mod.rs` and its direct children may know each
//! other.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::{BTreeMap, BTreeSet};

use crate::held_by::project;
use crate::rust_modules::{Crate, ModulePath};

/// Imports between files: the importing module, the imported one, and the lines.
type Imports = BTreeMap<ModulePath, BTreeMap<ModulePath, BTreeSet<usize>>>;

/// Files that all reach each other.
type Circle = BTreeSet<ModulePath>;

fn imports(library: &Crate) -> Imports {
    let mut found = Imports::new();
    for (path, module) in &library.modules {
        for written in &module.paths {
            let Some(absolute) = library.absolute(path, written) else { continue };
            let target = library.declared_in(&absolute);
            if target != *path {
                found.entry(path.clone()).or_default().entry(target).or_default().insert(written.line);
            }
        }
    }
    found
}

/// Returns every circle of more than one file among `files`.
fn circles(imports: &Imports, files: &BTreeSet<ModulePath>) -> Vec<Circle> {
    let reached: BTreeMap<_, _> = files.iter().map(|file| (file, reachable(imports, files, file))).collect();
    let mut found: BTreeSet<Circle> = BTreeSet::new();
    for file in files {
        let circle: Circle =
            reached[file].iter().filter(|other| reached[other].contains(file)).cloned().collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
    found
}

/// Returns the files among `files` that `start` reaches by imports.
fn reachable(imports: &Imports, files: &BTreeSet<ModulePath>, start: &ModulePath) -> BTreeSet<ModulePath> {
    let (mut found, mut open) = (BTreeSet::new(), vec![start]);
    while let Some(file) = open.pop() {
        for target in imports.get(file).into_iter().flat_map(BTreeMap::keys) {
            if files.contains(target) && found.insert(target.clone()) {
                open.push(target);
            }
        }
    }
    found
}

/// Returns the circles that are not allowed: those that go beyond one folder, and those between siblings.
fn forbidden(imports: &Imports, files: &BTreeSet<ModulePath>) -> Vec<Circle> {
    let mut found = Vec::new();
    for circle in circles(imports, files) {
        let parent = circle.first().cloned().unwrap_or_default();
        let is_child = |path: &ModulePath| path.len() == parent.len() + 1 && path.starts_with(&parent);
        let mut children = circle.clone();
        children.remove(&parent);
        if children.iter().all(is_child) {
            found.extend(circles(imports, &children));
        } else {
            found.push(circle);
        }
    }
    found
}

/// Returns the files of a circle and the imports between them.
fn describe(library: &Crate, imports: &Imports, circle: &Circle) -> String {
    let file = |path: &ModulePath| library.modules[path].file.as_str();
    let files: Vec<_> = circle.iter().map(file).collect();
    let mut lines = vec![format!("{} files: {}", circle.len(), files.join(" "))];
    for from in circle {
        for (to, at) in imports.get(from).into_iter().flatten().filter(|(to, _)| circle.contains(*to)) {
            let at: Vec<_> = at.iter().map(usize::to_string).collect();
            lines.push(format!("    {}:{} -> {}", file(from), at.join(","), file(to)));
        }
    }
    lines.join("\n")
}

fn library() -> Crate {
    Crate::read(&project().join("lvk/src"))
}

fn describe_all(library: &Crate, imports: &Imports, circles: &[Circle]) -> String {
    circles.iter().map(|circle| describe(library, imports, circle) + "\n").collect()
}

#[test]
fn files_import_each_other_without_circles() {
    let library = library();
    let imports = imports(&library);
    let found = forbidden(&imports, &library.modules.keys().cloned().collect());
    assert!(found.is_empty(), "{} circles:\n{}", found.len(), describe_all(&library, &imports, &found));
}

/// Prints all circles, those within a folder too, with `-- --nocapture`.
#[test]
fn imports_of_the_library_are_read() {
    let library = library();
    let imports = imports(&library);
    let number: usize = imports.values().map(BTreeMap::len).sum();
    assert!(
        library.modules.len() > 200 && number > 1000,
        "{} files, {number} imports",
        library.modules.len()
    );
    println!(
        "{}",
        describe_all(&library, &imports, &circles(&imports, &library.modules.keys().cloned().collect()))
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the forbidden circles, each as the names of its modules.
    fn found(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let library = Crate::from_files(files.iter().copied());
        let circles = forbidden(&imports(&library), &library.modules.keys().cloned().collect());
        circles.iter().map(|circle| circle.iter().map(|path| path.join("::")).collect()).collect()
    }

    #[test]
    fn imports_in_one_direction_pass() {
        let files = [
            ("lib.rs", "mod a; mod b; pub use b::B;"),
            ("a.rs", "use crate::b::B; use crate::c::{C, D};"),
            ("b.rs", "use crate::c::C;"),
            ("c.rs", "#[cfg(test)] use crate::a::A; // use crate::a::A;"),
        ];
        assert_eq!(found(&files), Vec::<Vec<String>>::new());
    }

    #[test]
    fn a_circle_of_three_files_is_reported_whole() {
        let files = [
            ("a.rs", "use crate::b::B;"),
            ("b.rs", "fn f() { crate::c::f() }"),
            ("c.rs", "use super::a::A;"),
            ("d.rs", "use crate::a::A;"),
        ];
        assert_eq!(found(&files), [["a", "b", "c"]]);
    }

    #[test]
    fn parent_and_children_may_know_each_other_but_siblings_may_not() {
        let parent = ("a/mod.rs", "mod b; mod c; use b::B; use c::C; pub struct A;");
        let [child, other] = [("a/b.rs", "use super::A;"), ("a/c.rs", "use crate::a::A;")];
        assert_eq!(found(&[parent, child, other]), Vec::<Vec<String>>::new());
        let [b, c] = [("a/b.rs", "use super::{A, C};"), ("a/c.rs", "use crate::a::{A, B};")];
        assert_eq!(found(&[parent, b, c]), [["a::b", "a::c"]]);
        assert_eq!(found(&[("a.rs", parent.1), b, c]), [["a::b", "a::c"]]);
    }

    #[test]
    fn a_circle_beyond_one_folder_is_reported_with_the_parent() {
        let files = [
            ("a/mod.rs", "mod b; use b::B; pub struct A;"),
            ("a/b.rs", "use super::A; use crate::d::D;"),
            ("d.rs", "use crate::a::B;"),
        ];
        assert_eq!(found(&files), [["a", "a::b", "d"]]);
        let nested = [
            ("a/mod.rs", "use b::c::C; pub struct A;"),
            ("a/b/mod.rs", ""),
            ("a/b/c.rs", "use crate::a::A;"),
        ];
        assert_eq!(found(&nested), [["a", "a::b::c"]]);
    }
}
