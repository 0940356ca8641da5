//! Folder layout of the downloaded components, and the manifest that marks a component as complete.
//!
//! ```text
//! <folder>/driver/lib/*.so*                 loader, software driver and its dependencies
//! <folder>/driver/icd.d/lvp_icd.json        for VK_DRIVER_FILES
//! <folder>/validation/lib/*.so              validation layer and SwiftShader
//! <folder>/validation/explicit_layer.d/     for VK_ADD_LAYER_PATH
//! <folder>/validation/icd.d/swiftshader_icd.json
//! <folder>/radv/lib/*.so*                   driver for AMD GPUs and its dependencies, without a loader
//! <folder>/radv/icd.d/radeon_icd.json
//! <folder>/display/bin/Xvfb, xkbcomp         headless X server and its keymap compiler
//! <folder>/display/lib/*.so*                dependencies of both, and libraries that window clients open
//! <folder>/display/xkb/                     keyboard descriptions
//! <folder>/*/manifest                       written last; a folder without a manifest is incomplete
//! ```
//! Every path inside is relative, so the folder can be moved and copied.

use std::fs;
use std::path::{Path, PathBuf};

use crate::apt::{PackageRequest, Suite};
use crate::file;

/// The loader inside [`Component::Driver`].
pub(super) const LOADER: &str = "lib/libvulkan.so.1";
/// The software driver inside [`Component::Driver`].
pub(super) const DRIVER: &str = "lib/libvulkan_lvp.so";
/// The driver manifest (ICD JSON) inside [`Component::Driver`].
pub(super) const DRIVER_JSON: &str = "icd.d/lvp_icd.json";
/// The validation layer inside [`Component::Validation`].
pub(super) const LAYER: &str = "lib/libVkLayer_khronos_validation.so";
/// Folder of layer manifests inside [`Component::Validation`].
pub(super) const LAYER_FOLDER: &str = "explicit_layer.d";
/// SwiftShader, a driver without ray tracing, inside [`Component::Validation`].
pub(super) const SWIFTSHADER: &str = "lib/libvk_swiftshader.so";
/// SwiftShader's driver manifest inside [`Component::Validation`].
pub(super) const SWIFTSHADER_JSON: &str = "icd.d/swiftshader_icd.json";
/// The driver inside [`Component::Radv`].
pub(super) const RADV: &str = "lib/libvulkan_radeon.so";
/// RADV's driver manifest inside [`Component::Radv`].
pub(super) const RADV_JSON: &str = "icd.d/radeon_icd.json";

/// The X server inside [`Component::Display`].
pub(super) const X_SERVER: &str = "bin/Xvfb";
/// The program that compiles keymaps for the X server.
pub(super) const KEYBOARD_COMPILER: &str = "bin/xkbcomp";
/// Folder of keyboard descriptions.
pub(super) const KEYBOARDS: &str = "xkb";

const MANIFEST: &str = "manifest";
/// First line of a manifest: the layout version. A folder of another version is downloaded again.
const MANIFEST_VERSION: &str = "lvk vulkan folder 1";

/// Libraries that window clients open at run time.
pub(super) const CLIENT_LIBRARIES: [&str; 6] = [
    "libX11.so.6",
    "libX11-xcb.so.1",
    "libXcursor.so.1",
    "libXi.so.6",
    "libxkbcommon.so.0",
    "libxkbcommon-x11.so.0",
];

/// Packages of Xvfb, of [`CLIENT_LIBRARIES`] and of their dependencies. The list is explicit, because the package
/// dependencies of Xvfb include Mesa's OpenGL and LLVM, ten times the size, for GLX, which is off here.
const DISPLAY_PACKAGES: [&str; 42] = [
    "xvfb",
    "x11-xkb-utils",
    "xkb-data",
    "libaudit1",
    "libbrotli1",
    "libbsd0",
    "libbz2-1.0",
    "libcap-ng0",
    "libcap2",
    "libfontenc1",
    "libfreetype6",
    "libgcrypt20",
    "libgl1",
    "libglvnd0",
    "libglx0",
    "libgpg-error0",
    "liblz4-1",
    "liblzma5",
    "libmd0",
    "libpcre2-8-0",
    "libpixman-1-0",
    "libpng16-16",
    "libselinux1",
    "libsystemd0",
    "libunwind8",
    "libx11-6",
    "libx11-xcb1",
    "libxau6",
    "libxcb-xkb1",
    "libxcb1",
    "libxcursor1",
    "libxdmcp6",
    "libxext6",
    "libxfixes3",
    "libxfont2",
    "libxi6",
    "libxkbcommon-x11-0",
    "libxkbcommon0",
    "libxkbfile1",
    "libxrender1",
    "libzstd1",
    "zlib1g",
];

/// A component that can be downloaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    /// Loader and software driver with ray tracing.
    Driver,
    /// Validation layer, and a software driver without ray tracing.
    Validation,
    /// RADV, Mesa's driver for AMD GPUs, which compiles shaders without a GPU.
    Radv,
    /// A headless X server (Xvfb).
    Display,
}

impl Component {
    /// Returns the folder of this component below the Vulkan folder `root`.
    pub(super) fn folder(self, root: &Path) -> PathBuf {
        root.join(match self {
            Self::Driver => "driver",
            Self::Validation => "validation",
            Self::Radv => "radv",
            Self::Display => "display",
        })
    }

    /// Returns the folder in which the component is assembled before it is complete.
    pub(super) fn staging_folder(self, root: &Path) -> PathBuf {
        self.folder(root).with_extension("partial")
    }

    /// Returns the packages that contain this component.
    pub(super) fn packages(self) -> PackageRequest {
        match self {
            Self::Driver => PackageRequest {
                packages: &["mesa-vulkan-drivers", "libvulkan1"],
                with_dependencies: true,
                suite: Suite::Backports,
            },
            Self::Radv => PackageRequest {
                packages: &["mesa-vulkan-drivers"],
                with_dependencies: true,
                suite: Suite::Backports,
            },
            Self::Validation => PackageRequest {
                packages: &["chromium-common"],
                with_dependencies: false,
                suite: Suite::Security,
            },
            Self::Display => PackageRequest {
                packages: &DISPLAY_PACKAGES,
                with_dependencies: false,
                suite: Suite::Security,
            },
        }
    }

    /// Returns the name of the component for messages.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Driver => "software driver lavapipe",
            Self::Validation => "validation layer",
            Self::Radv => "driver for AMD GPUs, RADV",
            Self::Display => "headless X server, Xvfb",
        }
    }

    /// All components.
    pub(super) const ALL: [Self; 4] = [Self::Driver, Self::Validation, Self::Radv, Self::Display];

    /// Returns the first complete folder of this component below `roots`.
    pub(super) fn find(self, roots: &[PathBuf]) -> Option<PathBuf> {
        roots.iter().map(|root| self.folder(root)).find(|folder| Manifest::read(folder).is_some())
    }
}

/// The manifest of a complete component folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Manifest {
    /// Name and version of the source packages.
    pub(super) packages: Vec<(String, String)>,
    /// Libraries to open before the loader starts, in this order, relative to the folder.
    pub(super) preload: Vec<String>,
}

impl Manifest {
    /// Reads the manifest of `folder`; `None` if there is none or its layout version differs.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        Self::parse(&file::text(&folder.join(MANIFEST))?)
    }

    /// Writes the manifest into `folder`, which marks the folder as complete.
    pub(super) fn write(&self, folder: &Path) -> std::io::Result<()> {
        fs::write(folder.join(MANIFEST), self.to_text())
    }

    fn parse(text: &str) -> Option<Self> {
        let mut lines = text.lines();
        if lines.next()? != MANIFEST_VERSION {
            return None;
        }
        let mut manifest = Self::default();
        for line in lines {
            match line.split_once(' ')? {
                ("package", rest) => {
                    let (name, version) = rest.split_once(' ')?;
                    manifest.packages.push((name.to_owned(), version.to_owned()));
                }
                ("preload", path) => manifest.preload.push(path.to_owned()),
                _ => return None,
            }
        }
        Some(manifest)
    }

    fn to_text(&self) -> String {
        let packages = self.packages.iter().map(|(name, version)| format!("package {name} {version}\n"));
        let preload = self.preload.iter().map(|path| format!("preload {path}\n"));
        format!("{MANIFEST_VERSION}\n{}", packages.chain(preload).collect::<String>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Manifest {
        Manifest {
            packages: vec![("mesa-vulkan-drivers".into(), "25.0.7-2~bpo12+1".into())],
            preload: vec!["lib/libz.so.1".into(), "lib/libLLVM-15.so.1".into()],
        }
    }

    #[test]
    fn a_manifest_reads_back_as_written() {
        assert_eq!(Manifest::parse(&example().to_text()), Some(example()));
        assert_eq!(Manifest::parse(&Manifest::default().to_text()), Some(Manifest::default()));
    }

    #[test]
    fn other_layout_versions_are_rejected() {
        assert_eq!(Manifest::parse(""), None);
        assert_eq!(Manifest::parse("lvk vulkan folder 0\n"), None);
        assert_eq!(Manifest::parse(&format!("{MANIFEST_VERSION}\nunknown word\n")), None);
    }

    #[test]
    fn a_folder_without_a_manifest_is_incomplete() {
        let (with, without) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        for root in [&with, &without] {
            fs::create_dir(Component::Driver.folder(root.path())).unwrap();
        }
        example().write(&Component::Driver.folder(with.path())).unwrap();
        let roots = [without.path().to_path_buf(), with.path().to_path_buf()];
        assert_eq!(Component::Driver.find(&roots), Some(Component::Driver.folder(with.path())));
        assert_eq!(Component::Validation.find(&roots), None);
    }
}
