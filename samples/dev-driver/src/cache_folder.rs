//! The user's folder for caches.

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;

/// The convention of a platform about the place of caches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Convention {
    /// The XDG base directories, of Linux and others.
    Xdg,
    /// The Library folder of macOS and iOS.
    Apple,
    /// The local application data of Windows.
    Windows,
}

/// Returns this project's folder below the user's folder for caches: `%LOCALAPPDATA%\\lvk` on Windows,
/// `~/Library/Caches/lvk` on Apple's systems, and elsewhere `$XDG_CACHE_HOME/lvk` or `~/.cache/lvk`. Returns `None` if the
/// variables do not name an absolute folder. The folder need not exist.
#[must_use]
pub fn cache_folder() -> Option<PathBuf> {
    Convention::PLATFORM.folder(|name| env::var_os(name))
}

impl Convention {
    const PLATFORM: Self = if cfg!(windows) {
        Self::Windows
    } else if cfg!(target_vendor = "apple") {
        Self::Apple
    } else {
        Self::Xdg
    };

    /// Returns the folder by the environment `variable`. A relative path does not count.
    fn folder(self, variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
        let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let base = match self {
            Self::Xdg => absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache"))),
            Self::Apple => Some(absolute("HOME")?.join("Library/Caches")),
            Self::Windows => {
                absolute("LOCALAPPDATA").or_else(|| Some(absolute("USERPROFILE")?.join("AppData/Local")))
            }
        };
        Some(base?.join("lvk"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The folder where variables have the given paths below an absolute folder, and that folder is removed from it.
    fn folder_with(convention: Convention, variables: &[(&str, &str)]) -> Option<PathBuf> {
        let root = env::temp_dir();
        let value = |name: &str| {
            let (_, path) = variables.iter().find(|(key, _)| *key == name)?;
            Some(root.join(path).into_os_string())
        };
        Some(convention.folder(value)?.strip_prefix(&root).unwrap().to_path_buf())
    }

    fn relative(name: &str) -> Option<OsString> {
        (name != "HOME").then(|| "relative".into())
    }

    #[test]
    fn each_platform_has_its_folder() {
        let all =
            [("HOME", "home"), ("XDG_CACHE_HOME", "xdg"), ("LOCALAPPDATA", "data"), ("USERPROFILE", "u")];
        assert_eq!(folder_with(Convention::Xdg, &all), Some("xdg/lvk".into()));
        assert_eq!(folder_with(Convention::Apple, &all), Some("home/Library/Caches/lvk".into()));
        assert_eq!(folder_with(Convention::Windows, &all), Some("data/lvk".into()));
    }

    #[test]
    fn the_home_folder_serves_without_the_variable() {
        assert_eq!(folder_with(Convention::Xdg, &[("HOME", "home")]), Some("home/.cache/lvk".into()));
        assert_eq!(
            folder_with(Convention::Windows, &[("USERPROFILE", "u")]),
            Some("u/AppData/Local/lvk".into())
        );
        for convention in [Convention::Xdg, Convention::Apple, Convention::Windows] {
            assert_eq!(folder_with(convention, &[]), None);
        }
    }

    #[test]
    fn relative_paths_do_not_count() {
        for convention in [Convention::Xdg, Convention::Apple, Convention::Windows] {
            assert_eq!(convention.folder(relative), None);
        }
    }
}
