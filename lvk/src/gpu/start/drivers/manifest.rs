//! Reads one driver manifest and opens its library.

use std::path::{Path, PathBuf};

use super::json::Json;
use super::manifest_search::Variables;
use crate::error::causes::with_causes;
use crate::error::driver_report::{DriverManifest, ManifestOutcome};
use crate::regular_file;

/// Most bytes of a manifest that are read.
const MAX_BYTES: u64 = 1 << 20;

/// Opens the library of a driver, or returns the error of the dynamic linker.
pub(super) type OpenLibrary<'a> = &'a dyn Fn(&Path) -> Result<(), String>;

/// The contents of a manifest.
#[derive(Debug, PartialEq)]
struct Contents {
    library: PathBuf,
    api_version: Option<String>,
    /// `32` or `64`, if stated.
    bits: Option<String>,
}

/// Reads the manifest and opens its library, unless the loader skips it.
pub(super) fn check_manifest(path: &Path, variables: Variables<'_>, open: OpenLibrary<'_>) -> DriverManifest {
    let (path, folder) = (path.to_path_buf(), path.parent().unwrap_or(Path::new("")));
    let contents = read_text(&path).and_then(|text| Contents::parse(&text, folder));
    let Contents { library, api_version, bits } = match contents {
        Ok(contents) => contents,
        Err(error) => {
            let outcome = ManifestOutcome::NotRead { error };
            return DriverManifest { path, library: None, api_version: None, outcome };
        }
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let reason = wrong_bits(bits.as_deref()).or_else(|| filter_reason(&name, variables));
    let outcome = match reason {
        Some(reason) => ManifestOutcome::Skipped { reason },
        None => match open(&library) {
            Ok(()) => ManifestOutcome::Loaded,
            Err(error) => ManifestOutcome::LoadFailed { error },
        },
    };
    DriverManifest { path, library: Some(library), api_version, outcome }
}

/// Opens a driver's library and closes it. Fails if it is no Vulkan driver.
pub(super) fn open_library(path: &Path) -> Result<(), String> {
    // SAFETY: the Vulkan loader opens the same library, so its initialisers run in this process anyway. Like the loader, a
    // program with more privileges than its user takes no library from the environment.
    let library = unsafe { libloading::Library::new(path) }.map_err(|error| with_causes(&error))?;
    let entries: [&[u8]; 2] = [b"vk_icdGetInstanceProcAddr\0", b"vkGetInstanceProcAddr\0"];
    // SAFETY: the symbols are only looked up; a pointer of any type fits.
    let has = |name: &&[u8]| unsafe { library.get::<*const u8>(name) }.is_ok();
    if entries.iter().any(has) {
        Ok(())
    } else {
        Err("it has no function vk_icdGetInstanceProcAddr".to_owned())
    }
}

fn read_text(path: &Path) -> Result<String, String> {
    regular_file::read_text(path, MAX_BYTES).map_err(|error| error.to_string())
}

impl Contents {
    fn parse(text: &str, folder: &Path) -> Result<Self, String> {
        let json = Json::parse(text)?;
        // The loader skips a manifest without these fields, and tells of it only in its log.
        json.get("file_format_version").ok_or("it has no \"file_format_version\"")?;
        let icd = json.get("ICD").ok_or("it has no object \"ICD\"")?;
        let field = |name: &str| icd.get(name).and_then(Json::text).map(str::to_owned);
        let library = field("library_path").filter(|path| !path.is_empty());
        let library = library.ok_or("its \"ICD\" has no \"library_path\"")?;
        let api_version = Some(field("api_version").ok_or("its \"ICD\" has no \"api_version\"")?);
        Ok(Self { library: resolve(&library, folder), api_version, bits: field("library_arch") })
    }
}

/// Returns the path that the dynamic linker gets: a plain name is searched in its folders, any other path is relative to
/// the manifest.
fn resolve(library: &str, folder: &Path) -> PathBuf {
    let is_name = !library.contains(['/', std::path::MAIN_SEPARATOR]);
    if is_name { library.into() } else { folder.join(library) }
}

fn wrong_bits(bits: Option<&str>) -> Option<String> {
    let own = usize::BITS.to_string();
    bits.filter(|bits| *bits != own).map(|bits| format!("it is for programs of {bits} bits"))
}

/// Returns the reason if the loader's variables for filtering drivers exclude a manifest of this file name.
fn filter_reason(name: &str, variables: Variables<'_>) -> Option<String> {
    const SELECT: &str = "VK_LOADER_DRIVERS_SELECT";
    const DISABLE: &str = "VK_LOADER_DRIVERS_DISABLE";
    let value = |variable| variables(variable).filter(|value| !value.is_empty());
    let matches = |list: std::ffi::OsString| {
        list.to_string_lossy().split(',').any(|pattern| matches_glob(name, pattern.trim()))
    };
    if value(DISABLE).is_some_and(matches) {
        return Some(format!("{DISABLE} names it"));
    }
    value(SELECT).filter(|list| !matches(list.clone())).map(|_| format!("{SELECT} does not name it"))
}

/// True if `name` matches `pattern`, in any letter case. A `*` at the beginning or the end matches any characters.
fn matches_glob(name: &str, pattern: &str) -> bool {
    let (name, pattern) = (name.to_lowercase(), pattern.to_lowercase());
    let (tail, from_start) = match pattern.strip_prefix('*') {
        Some(tail) => (tail, false),
        None => (pattern.as_str(), true),
    };
    match (tail.strip_suffix('*'), from_start) {
        (Some(middle), false) => name.contains(middle),
        (Some(head), true) => name.starts_with(head),
        (None, false) => name.ends_with(tail),
        (None, true) => name == tail,
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;

    use super::*;

    const GOOD: &str =
        r#"{"file_format_version": "1.0.1", "ICD": {"library_path": "./libtoy.so", "api_version": "1.3.1"}}"#;

    /// Returns the manifest of this text, with variables and a library that opens.
    fn check(text: &str, variables: &[(&str, &str)]) -> DriverManifest {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Toy_icd.json");
        std::fs::write(&path, text).unwrap();
        let lookup = |name: &str| {
            variables.iter().find(|(key, _)| *key == name).map(|(_, value)| OsString::from(value))
        };
        check_manifest(&path, &lookup, &|_| Ok(()))
    }

    fn not_read(path: &Path) -> String {
        match check_manifest(path, &|_| None, &open_library).outcome {
            ManifestOutcome::NotRead { error } => error,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn broken_manifests_say_why() {
        for (text, part) in [
            ("", "a JSON value is expected"),
            ("{}", "no \"file_format_version\""),
            (r#"{"file_format_version": "1.0.0"}"#, "no object \"ICD\""),
            (&GOOD.replace(r#""./libtoy.so""#, "7"), "no \"library_path\""),
            (&GOOD.replace("./libtoy.so", ""), "no \"library_path\""),
            (&GOOD.replace("api_version", "version"), "no \"api_version\""),
            ("{\n\"ICD\" {}}", "line 2: a colon"),
        ] {
            let manifest = check(text, &[]);
            assert_eq!((&manifest.library, manifest.is_broken()), (&None, true), "{text}");
            assert!(manifest.to_string().contains(part), "{manifest}");
        }
        let folder = tempfile::tempdir().unwrap();
        assert!(not_read(&folder.path().join("absent.json")).contains("(os error 2)"));
        assert_eq!(not_read(folder.path()), "it is a directory, no file");
        std::fs::write(folder.path().join("binary.json"), [0xff, 0xfe]).unwrap();
        assert!(not_read(&folder.path().join("binary.json")).contains("UTF-8"));
    }

    #[test]
    fn library_paths_are_relative_to_the_manifest_unless_plain_names() {
        let folder = Path::new("/d");
        assert_eq!(resolve("libtoy.so", folder), Path::new("libtoy.so"));
        assert_eq!(resolve("../lib/libtoy.so", folder), Path::new("/d/../lib/libtoy.so"));
        assert_eq!(resolve("/lib/libtoy.so", folder), Path::new("/lib/libtoy.so"));
        let manifest = check(GOOD, &[]);
        assert_eq!(manifest.outcome, ManifestOutcome::Loaded);
        assert_eq!(manifest.library, Some(manifest.path.parent().unwrap().join("./libtoy.so")));
        assert_eq!(manifest.api_version.as_deref(), Some("1.3.1"));
    }

    #[test]
    fn drivers_that_the_loader_skips_are_not_opened() {
        let other = if usize::BITS == 64 { "32" } else { "64" };
        let text =
            GOOD.replace("\"api_version\"", &format!("\"library_arch\": \"{other}\", \"api_version\""));
        for (manifest, part) in [
            (check(&text, &[]), "programs of"),
            (check(GOOD, &[("VK_LOADER_DRIVERS_DISABLE", "a.json, *TOY*")]), "DRIVERS_DISABLE names it"),
            (check(GOOD, &[("VK_LOADER_DRIVERS_SELECT", "nvidia*")]), "DRIVERS_SELECT does not name it"),
        ] {
            assert!(
                matches!(&manifest.outcome, ManifestOutcome::Skipped { reason } if reason.contains(part)),
                "{manifest}"
            );
            assert!(!manifest.is_broken());
        }
        let selected = check(GOOD, &[("VK_LOADER_DRIVERS_SELECT", "nvidia*,toy*")]);
        assert_eq!(selected.outcome, ManifestOutcome::Loaded);
    }

    #[test]
    fn globs_match_in_any_letter_case() {
        for (pattern, expected) in [
            ("toy.json", true),
            ("TOY*", true),
            ("*.json", true),
            ("*oy*", true),
            ("*", true),
            ("toy", false),
            ("oy*", false),
        ] {
            assert_eq!(matches_glob("Toy.json", pattern), expected, "{pattern}");
        }
    }

    /// On Windows the cause stands behind the error of the library that opens others, and names no file.
    #[test]
    fn library_that_is_absent_has_a_cause() {
        let error = open_library(Path::new("libnothing-of-this-name.so")).unwrap_err();
        let cause = if cfg!(windows) { "(os error 126)" } else { "libnothing-of-this-name.so" };
        assert!(error.contains(cause), "{error}");
    }

    #[test]
    fn file_that_is_no_library_has_a_cause() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("libtoy.so");
        std::fs::write(&path, "text").unwrap();
        let error = open_library(&path).unwrap_err();
        let cause = if cfg!(windows) { "(os error " } else { "libtoy.so" };
        assert!(error.contains(cause), "{error}");
    }

    /// A copy of a library of this process, which is made to need a library that does not exist.
    #[test]
    #[cfg(target_os = "linux")]
    fn missing_dependency_is_named_by_the_dynamic_linker() {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let original = maps.split_whitespace().find(|word| word.ends_with("/libgcc_s.so.1")).unwrap();
        let mut image = std::fs::read(original).unwrap();
        let needed = image.windows(10).position(|bytes| bytes == b"libc.so.6\0").unwrap();
        image[needed + 3] = b'Q';
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("libtoy.so"), image).unwrap();
        let manifest = folder.path().join("toy.json");
        std::fs::write(&manifest, GOOD).unwrap();
        match check_manifest(&manifest, &|_| None, &open_library).outcome {
            ManifestOutcome::LoadFailed { error } => {
                assert!(error.starts_with("libQ.so.6: cannot open"), "{error}")
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn libraries_that_are_no_drivers_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let text = folder.path().join("libtoy.so");
        std::fs::write(
            &text,
            "this text is long enough to be taken for the header of an ELF file, which it is not",
        )
        .unwrap();
        assert!(open_library(&text).unwrap_err().contains("invalid ELF header"));
        assert!(open_library(Path::new("libnothing-of-this-name.so")).unwrap_err().contains("No such file"));
        assert!(open_library(Path::new("libc.so.6")).unwrap_err().contains("vk_icdGetInstanceProcAddr"));
    }
}
