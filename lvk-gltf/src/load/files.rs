//! Files that a model consists of: regular files of bounded size, data URIs, and paths inside of the model's folder.

use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::budget::Budget;
use super::place::{shortened, shortened_path};
use super::source::{OpenFile, Source};
use crate::Problem;

/// Opens a regular file of at most 4 GiB.
pub(super) fn open(path: &Path, budget: &Budget) -> Result<OpenFile, Problem> {
    let named = |source| Problem::File { name: shortened_path(path), source };
    OpenFile::open(path, u64::MAX).map_err(named).inspect(|file| budget.add_file(file.length()))
}

/// A buffer or image that a URI names.
#[derive(Debug)]
pub(super) enum Resolved {
    /// The bytes inside of it.
    Bytes(Vec<u8>),
    /// A file in the folder.
    File(OpenFile),
}

impl Resolved {
    pub(super) fn source(&self) -> Source<'_> {
        match self {
            Self::Bytes(bytes) => Source::Memory(bytes),
            Self::File(file) => file.whole(),
        }
    }
}

/// The folder of a model, and the files of it that were read.
#[derive(Debug)]
pub(super) struct Files<'a> {
    folder: Option<&'a Path>,
    read: Mutex<HashSet<PathBuf>>,
}

impl<'a> Files<'a> {
    pub(super) fn new(folder: Option<&'a Path>) -> Self {
        Self { folder, read: Mutex::default() }
    }

    /// Returns what a URI names.
    pub(super) fn resolve(
        &self,
        uri: &str,
        budget: &Budget,
        place: &dyn Fn() -> String,
    ) -> Result<Resolved, Problem> {
        let refuse = |why| Problem::Uri { place: place(), uri: shortened(uri), why };
        if let Some(data) = strip_scheme(uri, "data:") {
            budget.charge(data.len() as u64, place)?;
            return data_uri(data).map(Resolved::Bytes).map_err(refuse);
        }
        let relative = relative_path(uri).map_err(refuse)?;
        let without_folder = "names a file, and bytes in memory have no folder; load the model from its file";
        let path = self.folder.ok_or(without_folder).map_err(refuse)?.join(relative);
        let file = OpenFile::open(&path, budget.left()).map_err(|source| {
            let name = format!("{}, which is {}", shortened_path(&path), place());
            Problem::File { name, source }
        })?;
        // A file that is named again brings no more memory.
        let is_first = self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(path);
        let length = file.length();
        if is_first {
            budget.add_file(length)
        } else {
            budget.charge(length, place)?
        }
        Ok(Resolved::File(file))
    }
}

fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let start = uri.get(..scheme.len())?;
    start.eq_ignore_ascii_case(scheme).then(|| &uri[scheme.len()..])
}

/// Decodes what follows `data:`.
fn data_uri(data: &str) -> Result<Vec<u8>, &'static str> {
    let (kind, data) = data.split_once(',').ok_or("has no comma before its data; export the file again")?;
    if kind.len() >= 7 && kind.as_bytes()[kind.len() - 7..].eq_ignore_ascii_case(b";base64") {
        return base64(data.as_bytes()).ok_or("has damaged base64; export the file again");
    }
    percent_decoded(data).ok_or("has a damaged percent code; export the file again")
}

/// Decodes base64 with or without padding.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let end = text.iter().rposition(|byte| *byte != b'=').map_or(0, |last| last + 1);
    let (text, padding) = text.split_at(end);
    if padding.len() > 2 || text.len() % 4 == 1 {
        return None;
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for quad in text.chunks(4) {
        let mut bits = 0;
        for character in quad {
            bits = bits << 6 | sextet(*character)?;
        }
        bits <<= 6 * (4 - quad.len());
        bytes.extend(&bits.to_be_bytes()[1..quad.len()]);
    }
    Some(bytes)
}

fn sextet(character: u8) -> Option<u32> {
    let value = match character {
        b'A'..=b'Z' => character - b'A',
        b'a'..=b'z' => character - b'a' + 26,
        b'0'..=b'9' => character - b'0' + 52,
        b'+' | b'-' => 62,
        b'/' | b'_' => 63,
        _ => return None,
    };
    Some(value.into())
}

fn percent_decoded(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        rest = after;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let [high, low, after @ ..] = after else { return None };
        let digit = |byte: &u8| char::from(*byte).to_digit(16);
        bytes.push((digit(high)? * 16 + digit(low)?) as u8);
        rest = after;
    }
    Some(bytes)
}

/// Returns the path of a relative URI. It leads to no place outside of the folder that it starts in.
fn relative_path(uri: &str) -> Result<PathBuf, &'static str> {
    const OUTSIDE: &str =
        "leads out of the model's folder; put the file beside the model and name it by a relative path";
    let scheme = uri.split(['/', '?', '#']).next().is_some_and(|first| first.contains(':'));
    if scheme {
        return Err("is not a relative path; put the file beside the model and name it by a relative path");
    }
    let decoded = percent_decoded(uri).ok_or("has a damaged percent code; export the file again")?;
    let decoded = String::from_utf8(decoded).map_err(|_| "is not UTF-8; rename the file")?;
    if decoded.is_empty() || decoded.contains('\0') {
        return Err("names no file; export the file again");
    }
    if decoded.contains('\\') || decoded.contains(':') {
        return Err(OUTSIDE); // another drive or folder on Windows, and no name that tools write elsewhere
    }
    let mut depth = 0_u32;
    for component in Path::new(&decoded).components() {
        depth = match component {
            Component::Normal(_) => depth + 1,
            Component::CurDir => depth,
            Component::ParentDir => depth.checked_sub(1).ok_or(OUTSIDE)?,
            Component::RootDir | Component::Prefix(_) => return Err(OUTSIDE),
        };
    }
    Ok(PathBuf::from(decoded))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_test_vectors_of_rfc_4648() {
        let vectors = [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
        ];
        for (text, plain) in vectors {
            assert_eq!(base64(text.as_bytes()).unwrap(), plain.as_bytes());
            assert_eq!(base64(text.trim_end_matches('=').as_bytes()).unwrap(), plain.as_bytes());
        }
        assert_eq!(base64(b"+/-_").unwrap(), [0xfb, 0xff, 0xbf]);
        for damaged in ["Z", "Zm9vY", "Zm9v====", "Z*==", "Zg==Zg=="] {
            assert!(base64(damaged.as_bytes()).is_none(), "{damaged}");
        }
    }

    #[test]
    fn paths_stay_in_the_folder() {
        for (uri, path) in [
            ("a.bin", "a.bin"),
            ("sub/a%20b.png", "sub/a b.png"),
            ("./sub/../a.bin", "./sub/../a.bin"),
            ("%C3%A4.bin", "ä.bin"),
        ] {
            assert_eq!(relative_path(uri).unwrap(), Path::new(path));
        }
        for uri in [
            "/etc/passwd",
            "../a.bin",
            "sub/../../a.bin",
            "%2e%2e/a.bin",
            "%2Fetc/passwd",
            "..\\a.bin",
            "C:/a.bin",
            "sub/C%3a/a",
            "http://host/a.bin",
            "file:///etc/passwd",
            "a%00.bin",
            "",
            "a%2",
            "a%zz",
            "%ff",
        ] {
            assert!(relative_path(uri).is_err(), "{uri}");
        }
    }
}
