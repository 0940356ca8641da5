//! The remedy for each reason why no driver can be used.

use std::path::Path;

use super::driver_report::{DriverManifest, DriverReport, LoaderReport, ManifestOutcome};
use super::platform_remedies::Platform;

const PLATFORM: Platform = Platform::CURRENT;

const RAISE_LIMITS: &str =
    "free memory, or raise the limits of the process (ulimit -a): a driver needs more of them";

/// A library that the dynamic linker did not find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MissingLibrary<'a> {
    /// The library of this name or path.
    Named(&'a str),
    /// The library that was opened, or one that it needs: Windows does not say which.
    Unnamed,
}

/// Returns the remedies for `report`, the most important first. `has_devices` is true if Vulkan reports a device.
pub(super) fn driver_remedies(report: &DriverReport, has_devices: bool) -> Vec<String> {
    let mut remedies = Vec::new();
    match &report.loader {
        LoaderReport::NotOpened { path, error } => remedies.push(loader_remedy(path, error)),
        loader if loader.is_too_old() => {
            remedies.push(format!("update the loader to Vulkan 1.3; {}", PLATFORM.install_loader()));
        }
        LoaderReport::Opened { .. } => {}
    }
    let used = || report.manifests.iter().filter(|manifest| !is_skipped(manifest));
    remedies.extend(used().filter_map(manifest_remedy));
    if used().next().is_none() && !has_devices {
        remedies.push(no_manifest_remedy(report));
    } else if remedies.is_empty() && !has_devices {
        remedies.push(PLATFORM.no_device().to_owned());
    }
    let mut unique = Vec::new();
    remedies.retain(|remedy| {
        !unique.contains(remedy) && {
            unique.push(remedy.clone());
            true
        }
    });
    remedies
}

/// Returns the library that the dynamic linker (of glibc, musl, Apple, Android or Windows) did not find.
fn missing_library(error: &str) -> Option<MissingLibrary<'_>> {
    if error.contains("LoadLibrary") && error.contains("(os error 126)") {
        return Some(MissingLibrary::Unnamed);
    }
    let of_glibc = || Some(error.split_once(": cannot open shared object file: No such file")?.0);
    let of_musl = || between(error, "Error loading shared library ", ": No such file");
    let of_apple = || error.split_once("Library not loaded: ")?.1.lines().next();
    let of_android = || between(error, "library \"", "\" not found");
    let name = of_glibc().or_else(of_musl).or_else(of_apple).or_else(of_android)?.trim();
    (!name.is_empty()).then_some(MissingLibrary::Named(name))
}

/// Returns the text between the first `start` and the next `end`.
fn between<'a>(text: &'a str, start: &str, end: &str) -> Option<&'a str> {
    Some(text.split_once(start)?.1.split_once(end)?.0)
}

/// True if the dynamic linker ran out of memory or of file descriptors.
fn is_shortage(error: &str) -> bool {
    let cause = ["Too many open files", "Cannot allocate memory", "cannot allocate memory", "Out of memory"];
    let unmapped = error.contains("failed to map segment") && !error.contains("not permitted");
    unmapped || cause.iter().any(|cause| error.contains(cause))
}

fn is_skipped(manifest: &DriverManifest) -> bool {
    matches!(manifest.outcome, ManifestOutcome::Skipped { .. })
}

fn loader_remedy(path: &Path, error: &str) -> String {
    let is_own = |name: &str| Path::new(name).file_name() == path.file_name();
    match missing_library(error) {
        _ if is_shortage(error) => RAISE_LIMITS.to_owned(),
        Some(MissingLibrary::Named(name)) if !is_own(name) => {
            format!("install the package that has {name}, which the loader needs")
        }
        Some(MissingLibrary::Unnamed) if path.components().count() > 1 => format!(
            "name an existing loader in place of {0}, or none; if {0} exists, install the libraries that it needs",
            path.display()
        ),
        _ if path.components().count() > 1 => {
            format!("name an existing loader in place of {}, or none", path.display())
        }
        _ => PLATFORM.install_loader().to_owned(),
    }
}

fn manifest_remedy(manifest: &DriverManifest) -> Option<String> {
    let path = manifest.path.display();
    let is_own = |name: &str| {
        let own = manifest.library.as_deref().and_then(Path::file_name);
        own.is_some() && Path::new(name).file_name() == own
    };
    match &manifest.outcome {
        ManifestOutcome::Loaded | ManifestOutcome::Skipped { .. } => None,
        ManifestOutcome::LoadFailed { error } | ManifestOutcome::NotRead { error } if is_shortage(error) => {
            Some(RAISE_LIMITS.to_owned())
        }
        ManifestOutcome::NotRead { .. } => {
            Some(format!("correct or remove {path}, or install its driver again"))
        }
        ManifestOutcome::LoadFailed { error } => Some(match missing_library(error) {
            Some(MissingLibrary::Named(name)) if !is_own(name) => {
                format!("install the package that has {name}, which the driver of {path} needs")
            }
            Some(MissingLibrary::Unnamed) => format!(
                "install the driver of {path} again: its library, or one that the library needs, is missing"
            ),
            _ => format!("install the driver of {path} again, for this architecture, or remove that file"),
        }),
    }
}

fn no_manifest_remedy(report: &DriverReport) -> String {
    let variable = report.searched.iter().find_map(|searched| searched.variable);
    if let Some(ManifestOutcome::Skipped { reason }) = report.manifests.first().map(|first| &first.outcome) {
        return format!("use a driver that the loader does not skip ({reason})");
    }
    match variable {
        Some(variable) if variable != "VK_ADD_DRIVER_FILES" => {
            format!("correct {variable}, or unset it to use the drivers that are installed")
        }
        _ => PLATFORM.install_driver().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::driver_report::SearchedPath;
    use super::*;

    fn report(loader_error: Option<&str>, outcomes: &[ManifestOutcome]) -> DriverReport {
        let path = "libvulkan.so.1".into();
        let loader = match loader_error {
            Some(error) => LoaderReport::NotOpened { path, error: error.to_owned() },
            None => LoaderReport::Opened { path, version: Some((1, 3, 0)) },
        };
        let manifest = |outcome: &ManifestOutcome| DriverManifest {
            path: "/d/toy.json".into(),
            library: Some("/d/libtoy.so".into()),
            api_version: None,
            outcome: outcome.clone(),
        };
        let manifests = outcomes.iter().map(manifest).collect();
        DriverReport { loader, failure: None, searched: Vec::new(), manifests }
    }

    fn fails(error: &str) -> ManifestOutcome {
        ManifestOutcome::LoadFailed { error: error.to_owned() }
    }

    /// Asserts that the only remedy contains `part`.
    fn assert_remedy(report: &DriverReport, part: &str) {
        let remedies = driver_remedies(report, false);
        assert!(remedies.len() == 1 && remedies[0].contains(part), "no '{part}' in {remedies:?}");
    }

    fn not_found(name: &str) -> String {
        format!("{name}: cannot open shared object file: No such file or directory")
    }

    const WINDOWS_126: &str =
        "LoadLibraryExW failed: The specified module could not be found. (os error 126)";
    const APPLE: &str = "dlopen(/d/libtoy.so, 0x0005): Library not loaded: @rpath/libMoltenVK.dylib\n  \
                         Referenced from: <1> /d/libtoy.so\n  Reason: tried: '/usr/lib/libMoltenVK.dylib' (no such file)";

    #[test]
    fn dynamic_linkers_name_the_missing_library() {
        for (error, expected) in [
            (not_found("libX11.so.6").as_str(), Some("libX11.so.6")),
            (
                "Error loading shared library libX11.so.6: No such file or directory (needed by /l/libd.so)",
                Some("libX11.so.6"),
            ),
            (APPLE, Some("@rpath/libMoltenVK.dylib")),
            (
                "dlopen failed: library \"libhardware.so\" not found: needed by /d/libtoy.so in namespace",
                Some("libhardware.so"),
            ),
            ("/d/libtoy.so: invalid ELF header", None),
            (": cannot open shared object file: No such file", None),
            ("LoadLibraryExW failed: %1 is not a valid Win32 application. (os error 193)", None),
            ("Required key not available (os error 126)", None),
        ] {
            assert_eq!(missing_library(error), expected.map(MissingLibrary::Named), "{error}");
        }
        assert_eq!(missing_library(WINDOWS_126), Some(MissingLibrary::Unnamed));
    }

    #[test]
    fn loader_remedies_follow_the_error() {
        let loaded = [ManifestOutcome::Loaded];
        assert_remedy(&report(Some(&not_found("libvulkan.so.1")), &loaded), PLATFORM.install_loader());
        assert_remedy(&report(Some(WINDOWS_126), &loaded), PLATFORM.install_loader());
        assert_remedy(
            &report(Some(&not_found("libdl.so.2")), &loaded),
            "has libdl.so.2, which the loader needs",
        );
        let text = "libvulkan.so.1: cannot open shared object file: Too many open files";
        assert_remedy(&report(Some(text), &loaded), RAISE_LIMITS);
        let mut named = report(Some(&not_found("/nowhere/libvulkan.so.1")), &loaded);
        if let LoaderReport::NotOpened { path, .. } = &mut named.loader {
            *path = "/nowhere/libvulkan.so.1".into();
        }
        assert_remedy(&named, "in place of /nowhere/libvulkan.so.1");
        if let LoaderReport::NotOpened { error, .. } = &mut named.loader {
            *error = WINDOWS_126.to_owned();
        }
        assert_remedy(&named, "if /nowhere/libvulkan.so.1 exists, install the libraries that it needs");
        named.loader = LoaderReport::Opened { path: "l".into(), version: Some((1, 2, 200)) };
        assert_remedy(&named, "update the loader");
    }

    #[test]
    fn driver_remedies_follow_the_error() {
        assert_remedy(&report(None, &[]), PLATFORM.install_driver());
        assert_remedy(&report(None, &[ManifestOutcome::Loaded]), PLATFORM.no_device());
        assert_remedy(&report(None, &[fails(&not_found("libX11.so.6"))]), "the package that has libX11.so.6");
        assert_remedy(
            &report(None, &[fails(&not_found("/d/libtoy.so"))]),
            "install the driver of /d/toy.json",
        );
        assert_remedy(&report(None, &[fails(APPLE)]), "the package that has @rpath/libMoltenVK.dylib");
        assert_remedy(&report(None, &[fails(WINDOWS_126)]), "or one that the library needs, is missing");
        assert_remedy(&report(None, &[fails("/d/libtoy.so: invalid ELF header")]), "install the driver of");
        let shortage = fails("/d/libtoy.so: failed to map segment from shared object");
        assert_remedy(&report(None, &[shortage.clone(), shortage]), RAISE_LIMITS);
        let not_read = ManifestOutcome::NotRead { error: "no JSON".to_owned() };
        assert_remedy(&report(None, &[not_read]), "correct or remove /d/toy.json");
        let skipped = ManifestOutcome::Skipped { reason: "for 32 bits".to_owned() };
        assert_remedy(&report(None, &[skipped]), "(for 32 bits)");
    }

    #[test]
    fn variables_that_name_no_driver_are_to_be_corrected() {
        let mut report = report(None, &[]);
        report.searched = vec![SearchedPath { path: "/x".into(), variable: Some("VK_DRIVER_FILES") }];
        assert_remedy(&report, "unset it");
        report.searched[0].variable = Some("VK_ADD_DRIVER_FILES");
        assert_remedy(&report, PLATFORM.install_driver());
    }

    #[test]
    fn usable_machine_needs_no_remedy() {
        assert_eq!(driver_remedies(&report(None, &[ManifestOutcome::Loaded]), true), Vec::<String>::new());
        assert_eq!(driver_remedies(&report(None, &[]), true), Vec::<String>::new());
    }
}
