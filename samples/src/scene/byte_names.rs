//! Names in scene files: bytes of any encoding, which a comment may follow, and which may name a file.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use crate::app::input_file::{self, FileKind};

/// Lengths that are tried of a name with several `#`.
const MOST_ENDS: usize = 8;

/// What the rest of a line may name: all of it, or what stands in front of a `#` behind a blank, longest first. Names may hold
/// `#`, so the caller takes the first that exists. There is at least one.
pub(super) fn names_in(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let text = text.trim_ascii();
    let begins_comment = |at: &usize| text[*at] == b'#' && text[at - 1].is_ascii_whitespace();
    let ends = (1..text.len()).rev().filter(begins_comment).take(MOST_ENDS);
    std::iter::once(text).chain(ends.map(|end| text[..end].trim_ascii_end()))
}

/// The name between quotation marks if `text` begins with one, else all of it.
pub(super) fn unquoted(text: &[u8]) -> &[u8] {
    let Some(rest) = text.strip_prefix(b"\"") else { return text };
    rest.split(|byte| *byte == b'"').next().unwrap_or_default().trim_ascii()
}

/// Finds the files that scene files name. Each folder is listed once, whatever the number of names.
#[derive(Default)]
pub(super) struct FileFinder {
    /// The entries of each folder, by their names in small letters.
    folders: RefCell<HashMap<PathBuf, Rc<HashMap<String, OsString>>>>,
}

impl FileFinder {
    /// Finds the regular file that a scene file means by `name`, which is relative to one of `folders`: as written (backslashes
    /// are separators), with other capitals, with `%20` and the like decoded, or, if the folders of the name do not exist on
    /// this machine, by its last part in one of `folders` or of their `subfolders`. Bytes that are no UTF-8 are those of the
    /// file's name, or Latin-1 for it.
    pub(super) fn find(&self, folders: &[&Path], name: &[u8], subfolders: &[&str]) -> Option<PathBuf> {
        let name: Vec<u8> = name.iter().map(|byte| if *byte == b'\\' { b'/' } else { *byte }).collect();
        let decoded = percent_decoded(&name);
        std::iter::once(name).chain(decoded).find_map(|name| self.find_named(folders, &name, subfolders))
    }

    fn find_named(&self, folders: &[&Path], name: &[u8], subfolders: &[&str]) -> Option<PathBuf> {
        let last = name.rsplit(|byte| *byte == b'/').next().unwrap_or_default();
        if last.is_empty() {
            return None;
        }
        let beside =
            subfolders.iter().flat_map(|subfolder| folders.iter().map(move |folder| folder.join(subfolder)));
        let all: Vec<PathBuf> = folders.iter().map(|folder| folder.to_path_buf()).chain(beside).collect();
        let whole = folders
            .iter()
            .flat_map(|folder| paths(name).into_iter().map(|path| (folder.to_path_buf(), path)));
        let by_last =
            all.iter().flat_map(|folder| paths(last).into_iter().map(|path| (folder.clone(), path)));
        let candidates: Vec<(PathBuf, PathBuf)> = whole.chain(by_last).collect();
        let exact = candidates.iter().map(|(folder, path)| folder.join(path)).find(|path| path.is_file());
        exact.or_else(|| candidates.iter().find_map(|(folder, path)| self.with_other_capitals(folder, path)))
    }

    /// The file at `path` in `folder`, where names may differ in capitals, or in whether they are UTF-8 or Latin-1.
    fn with_other_capitals(&self, folder: &Path, path: &Path) -> Option<PathBuf> {
        let mut found = folder.to_path_buf();
        for component in path.components() {
            found = match component {
                Component::Normal(name) => {
                    let entry = self.entry_with_other_capitals(&found, name);
                    let as_written = found.join(component);
                    if as_written.exists() { as_written } else { entry? }
                }
                _ => found.join(component),
            };
        }
        found.is_file().then_some(found)
    }

    fn entry_with_other_capitals(&self, folder: &Path, name: &OsStr) -> Option<PathBuf> {
        let mut folders = self.folders.borrow_mut();
        let entries = match folders.get(folder) {
            Some(entries) => entries,
            None => folders.entry(folder.into()).or_insert(Rc::new(entries_of(folder))),
        };
        entries.get(&folded(name)).map(|name| folder.join(name))
    }
}

/// The entries of a folder by their names in small letters; of names that differ in capitals, the first. Empty if the folder
/// cannot be read.
fn entries_of(folder: &Path) -> HashMap<String, OsString> {
    let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut names: Vec<OsString> =
        std::fs::read_dir(listed).into_iter().flatten().flatten().map(|entry| entry.file_name()).collect();
    names.sort_unstable_by(|a, b| b.cmp(a));
    names.into_iter().map(|name| (folded(&name), name)).collect()
}

/// The name in small letters, as text.
fn folded(name: &OsStr) -> String {
    let bytes = name.as_encoded_bytes();
    std::str::from_utf8(bytes).map_or_else(|_| latin_1(bytes), str::to_owned).to_lowercase()
}

/// The name with the bytes that `%` and two hexadecimal digits stand for, as in addresses; `None` if it has none.
fn percent_decoded(name: &[u8]) -> Option<Vec<u8>> {
    let mut decoded = Vec::with_capacity(name.len());
    let mut rest = name;
    while let [first, after @ ..] = rest {
        let digits = after
            .first_chunk::<2>()
            .filter(|_| *first == b'%')
            .filter(|d| d.iter().all(u8::is_ascii_hexdigit));
        let byte = digits.and_then(|digits| u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok());
        decoded.push(byte.unwrap_or(*first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    (decoded.len() < name.len()).then_some(decoded)
}

/// The name as a path for messages about a file that is not there.
pub(super) fn path_of(name: &[u8]) -> PathBuf {
    paths(name).into_iter().next().unwrap_or_default()
}

/// Why a [`FileFinder`] found no file at `path`: there is none, or something that is no regular file.
pub(super) fn why_absent(path: &Path, kind: FileKind) -> String {
    match input_file::open(path, kind) {
        Err(error) if error.kind() != ErrorKind::NotFound => error.to_string(),
        _ => "no such file".to_owned(),
    }
}

/// The paths that the bytes of a name may mean.
fn paths(name: &[u8]) -> Vec<PathBuf> {
    match std::str::from_utf8(name) {
        Ok(text) => vec![text.into()],
        Err(_) => path_of_bytes(name).into_iter().chain([latin_1(name).into()]).collect(),
    }
}

#[cfg(unix)]
fn path_of_bytes(name: &[u8]) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    Some(std::ffi::OsStr::from_bytes(name).into())
}

/// Names of files are text here.
#[cfg(not(unix))]
fn path_of_bytes(_: &[u8]) -> Option<PathBuf> {
    None
}

fn latin_1(name: &[u8]) -> String {
    name.iter().map(|byte| char::from(*byte)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_may_end_a_name() {
        let found =
            |text: &str| -> Vec<String> { names_in(text.as_bytes()).map(lvk::readable_bytes).collect() };
        assert_eq!(found(" wall "), ["wall"]);
        assert_eq!(found("wall # north"), ["wall # north", "wall"]);
        assert_eq!(found("no #1 wall\t# north"), ["no #1 wall\\t# north", "no #1 wall", "no"]);
        assert_eq!(found("wall#2"), ["wall#2"]);
        assert_eq!(found("#2"), ["#2"]);
        assert_eq!(found(&"a #".repeat(100_000)).len(), MOST_ENDS + 1);
        assert_eq!(unquoted(b"\"a b.png\" # c"), b"a b.png");
    }

    #[test]
    fn foreign_paths_and_other_capitals_lead_to_files() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("textures")).unwrap();
        std::fs::write(folder.path().join("textures/Wood.PNG"), b"").unwrap();
        let wood = folder.path().join("textures/Wood.PNG").canonicalize().unwrap();
        for name in
            ["textures/Wood.PNG", "textures\\Wood.PNG", "C:\\art\\Wood.PNG", "wood.png", "Textures/wood.png"]
        {
            let found = FileFinder::default().find(&[folder.path()], name.as_bytes(), &["textures"]).unwrap();
            assert_eq!(found.canonicalize().unwrap(), wood, "{name}");
        }
        for name in ["stone.png", "", "textures", "textures/", "."] {
            assert_eq!(
                FileFinder::default().find(&[folder.path()], name.as_bytes(), &["textures"]),
                None,
                "{name}"
            );
        }
        assert_eq!(FileFinder::default().find(&[folder.path()], b"wood.png", &[]), None);
        let others = [Path::new("/nowhere"), folder.path()];
        assert!(
            FileFinder::default().find(&others, b"TEXTURES\\wood.png", &[]).is_some(),
            "a folder with other capitals"
        );
    }

    /// The folder is listed once: a file that comes later is not known by other capitals.
    #[test]
    fn a_folder_is_listed_once() {
        let folder = tempfile::tempdir().unwrap();
        let finder = FileFinder::default();
        let find = |name: &str| finder.find(&[folder.path()], name.as_bytes(), &[]);
        assert_eq!(find("WOOD.png"), None);
        std::fs::write(folder.path().join("wood.png"), b"").unwrap();
        assert_eq!(find("WOOD.png"), None);
        assert!(find("wood.png").is_some());
        for name in ["B.png", "b.PNG"] {
            std::fs::write(folder.path().join(name), b"").unwrap();
        }
        let first = FileFinder::default().find(&[folder.path()], b"b.png", &[]).unwrap();
        assert!(first.ends_with("B.png") || first.ends_with("b.PNG"));
    }

    #[test]
    fn bytes_of_addresses_are_decoded_where_no_file_has_the_name() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["my wood.png", "a%20b.png", "a b.png"] {
            std::fs::write(folder.path().join(name), b"").unwrap();
        }
        let found = |name: &str| FileFinder::default().find(&[folder.path()], name.as_bytes(), &[]);
        assert_eq!(found("my%20wood.png"), Some(folder.path().join("my wood.png")));
        assert_eq!(found("file:///C:/x/My%20Wood.png"), Some(folder.path().join("my wood.png")));
        assert_eq!(found("a%20b.png"), Some(folder.path().join("a%20b.png")));
        for name in ["my%2", "%", "%zz", "100%", "my%20stone.png"] {
            assert_eq!(found(name), None, "{name}");
        }
        assert_eq!(percent_decoded(b"h%C3%b6he%"), Some("h\u{f6}he%".as_bytes().to_vec()));
    }

    #[test]
    fn latin_1_names_files_of_utf_8() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("Größe.png"), b"").unwrap();
        for name in
            ["Größe.png".as_bytes(), b"Gr\xf6\xdfe.png", b"gr\xf6\xdfe.PNG", b"D:\\x\\GR\xd6\xdfE.png"]
        {
            assert!(
                FileFinder::default().find(&[folder.path()], name, &[]).is_some(),
                "{}",
                lvk::readable_bytes(name)
            );
        }
        assert_eq!(FileFinder::default().find(&[folder.path()], b"Gr\xfc\xdfe.png", &[]), None);
    }

    /// macOS takes no such names.
    #[cfg(target_os = "linux")]
    #[test]
    fn names_of_files_are_bytes() {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in [(&b"M\xe4.mtl"[..], "a"), (b"M\xf6.mtl", "b")] {
            std::fs::write(folder.path().join(path_of_bytes(name).unwrap()), content).unwrap();
        }
        let content = |name: &[u8]| {
            std::fs::read(FileFinder::default().find(&[folder.path()], name, &[]).unwrap()).unwrap()
        };
        assert_eq!(
            (content(b"M\xe4.mtl"), content(b"M\xf6.mtl"), content(b"m\xd6.MTL")),
            (b"a".to_vec(), b"b".to_vec(), b"b".to_vec())
        );
    }
}
