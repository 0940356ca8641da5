//! Files that a model consists of: regular files of bounded size, data URIs, and paths inside of the model's folder.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read as _};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::budget::Budget;
use super::place::{shortened, shortened_path};
use crate::Problem;

/// Most bytes of a file. GLB can state no more.
const MAX_FILE_BYTES: u64 = 1 << 32;

/// Reads a regular file of at most 4 GiB, as long as it was when it was opened.
pub(super) fn read(path: &Path, budget: &Budget) -> Result<Vec<u8>, Problem> {
    let named = |source| Problem::File { name: shortened_path(path), source };
    read_regular(path, MAX_FILE_BYTES).map_err(named).inspect(|bytes| budget.add_file(bytes.len() as u64))
}

fn read_regular(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    // Opening a named pipe would wait for its writer.
    let not_regular = || io::Error::new(ErrorKind::InvalidInput, "it is not a regular file");
    if !fs::metadata(path)?.is_file() {
        return Err(not_regular());
    }
    let file = File::open(path)?;
    let about = file.metadata()?;
    if !about.is_file() {
        return Err(not_regular());
    }
    let most_bytes = most_bytes.min(MAX_FILE_BYTES);
    if about.len() > most_bytes {
        let message = format!("it has {} bytes, more than the {most_bytes} that may be read", about.len());
        return Err(io::Error::new(ErrorKind::FileTooLarge, message));
    }
    let mut bytes = Vec::new();
    let size = usize::try_from(about.len()).map_err(|_| ErrorKind::OutOfMemory)?;
    bytes.try_reserve_exact(size).map_err(|_| ErrorKind::OutOfMemory)?;
    file.take(about.len()).read_to_end(&mut bytes)?;
    Ok(bytes)
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

    /// Returns the bytes that a URI names: those inside of it, or those of a file in the folder.
    pub(super) fn resolve(
        &self,
        uri: &str,
        budget: &Budget,
        place: &dyn Fn() -> String,
    ) -> Result<Vec<u8>, Problem> {
        let refuse = |why| Problem::Uri { place: place(), uri: shortened(uri), why };
        if let Some(data) = strip_scheme(uri, "data:") {
            budget.charge(data.len() as u64, place)?;
            return data_uri(data).map_err(refuse);
        }
        let relative = relative_path(uri).map_err(refuse)?;
        let without_folder = "names a file, and bytes in memory have no folder; load the model from its file";
        let path = self.folder.ok_or(without_folder).map_err(refuse)?.join(relative);
        let bytes = read_regular(&path, budget.left()).map_err(|source| {
            let name = format!("{}, which is {}", shortened_path(&path), place());
            Problem::File { name, source }
        })?;
        // A file that is named again brings no more memory.
        let is_first = self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(path);
        let length = bytes.len() as u64;
        if is_first {
            budget.add_file(length)
        } else {
            budget.charge(length, place)?
        }
        Ok(bytes)
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

    #[test]
    fn a_folder_and_a_missing_file_are_refused() {
        let budget = Budget::new(super::super::MemoryLimit::default());
        let folder = std::env::temp_dir();
        for path in [folder.clone(), folder.join("lvk-gltf-no-such-file")] {
            let error = read(&path, &budget).unwrap_err();
            assert!(matches!(error, Problem::File { .. }), "{error}");
        }
    }
}
