//! Layout of a folder with fetched libraries, and the manifest that makes it valid.
//!
//! ```text
//! <folder>/driver/lib/*.so*                 loader, software driver and all it needs
//! <folder>/driver/icd.d/lvp_icd.json        for VK_DRIVER_FILES
//! <folder>/validation/lib/*.so              validation layer and SwiftShader
//! <folder>/validation/explicit_layer.d/     for VK_ADD_LAYER_PATH
//! <folder>/validation/icd.d/swiftshader_icd.json
//! <folder>/radv/lib/*.so*                   driver for AMD cards and all it needs but a loader
//! <folder>/radv/icd.d/radeon_icd.json
//! <folder>/display/bin/Xvfb, xkbcomp         X server without a screen, and what it compiles keyboards with
//! <folder>/display/lib/*.so*                all that both need, and what programs with windows open
//! <folder>/display/xkb/                     descriptions of keyboards
//! <folder>/*/manifest                       written last; without it the folder does not count
//! ```
//! Every path inside is relative, so the folder can be moved and copied.

use std::fs;
use std::path::{Path, PathBuf};

use super::apt::{Order, Suite};

/// The loader inside [`Part::Driver`].
pub(super) const LOADER: &str = "lib/libvulkan.so.1";
/// The software driver inside [`Part::Driver`].
pub(super) const DRIVER: &str = "lib/libvulkan_lvp.so";
/// The driver's description inside [`Part::Driver`].
pub(super) const DRIVER_JSON: &str = "icd.d/lvp_icd.json";
/// The validation layer inside [`Part::Validation`].
pub(super) const LAYER: &str = "lib/libVkLayer_khronos_validation.so";
/// Folder of layer descriptions inside [`Part::Validation`].
pub(super) const LAYER_FOLDER: &str = "explicit_layer.d";
/// A driver without ray tracing inside [`Part::Validation`].
pub(super) const SWIFTSHADER: &str = "lib/libvk_swiftshader.so";
/// Its description inside [`Part::Validation`].
pub(super) const SWIFTSHADER_JSON: &str = "icd.d/swiftshader_icd.json";
/// The driver inside [`Part::Radv`].
pub(super) const RADV: &str = "lib/libvulkan_radeon.so";
/// Its description inside [`Part::Radv`].
pub(super) const RADV_JSON: &str = "icd.d/radeon_icd.json";

/// The X server inside [`Part::Display`].
pub(super) const X_SERVER: &str = "bin/Xvfb";
/// What it compiles keyboards with.
pub(super) const KEYBOARD_COMPILER: &str = "bin/xkbcomp";
/// What it compiles.
pub(super) const KEYBOARDS: &str = "xkb";

const MANIFEST: &str = "manifest";
/// Counts layouts: a folder written for another one is fetched anew.
const MANIFEST_HEAD: &str = "lvk vulkan folder 1";

/// Libraries that programs with windows open while they run.
pub(super) const CLIENT_LIBRARIES: [&str; 6] = [
    "libX11.so.6",
    "libX11-xcb.so.1",
    "libXcursor.so.1",
    "libXi.so.6",
    "libxkbcommon.so.0",
    "libxkbcommon-x11.so.0",
];

/// Xvfb and the libraries above with those they are linked to. Its dependencies as packages would bring Mesa's OpenGL and LLVM along, ten
/// times as much, for an extension that is off here.
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

/// One of the things that can be fetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Loader and software driver with ray tracing.
    Driver,
    /// Validation layer, and a software driver without ray tracing.
    Validation,
    /// Mesa's driver for AMD cards, which compiles for them without one.
    Radv,
    /// An X server without a screen.
    Display,
}

impl Part {
    /// Where this part lives below the Vulkan folder `root`.
    pub(super) fn folder(self, root: &Path) -> PathBuf {
        root.join(match self {
            Self::Driver => "driver",
            Self::Validation => "validation",
            Self::Radv => "radv",
            Self::Display => "display",
        })
    }

    /// Where it is put together before it is complete.
    pub(super) fn partial_folder(self, root: &Path) -> PathBuf {
        self.folder(root).with_extension("partial")
    }

    /// The packages it is made of.
    pub(super) fn order(self) -> Order {
        match self {
            Self::Driver => Order {
                packages: &["mesa-vulkan-drivers", "libvulkan1"],
                with_dependencies: true,
                suite: Suite::Backports,
            },
            Self::Radv => {
                Order { packages: &["mesa-vulkan-drivers"], with_dependencies: true, suite: Suite::Backports }
            }
            Self::Validation => {
                Order { packages: &["chromium-common"], with_dependencies: false, suite: Suite::Security }
            }
            Self::Display => {
                Order { packages: &DISPLAY_PACKAGES, with_dependencies: false, suite: Suite::Security }
            }
        }
    }

    /// What it is, for a person to read.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Driver => "software driver lavapipe",
            Self::Validation => "validation layer",
            Self::Radv => "driver for AMD cards, RADV",
            Self::Display => "X server without a screen, Xvfb",
        }
    }

    /// All of them.
    pub(super) const ALL: [Self; 4] = [Self::Driver, Self::Validation, Self::Radv, Self::Display];

    /// The complete folder of this part, if one of `roots` has it.
    pub(super) fn find(self, roots: &[PathBuf]) -> Option<PathBuf> {
        roots.iter().map(|root| self.folder(root)).find(|folder| Manifest::read(folder).is_some())
    }
}

/// What a complete folder says about itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Manifest {
    /// Name and version of the packages it was made from.
    pub(super) packages: Vec<(String, String)>,
    /// Libraries to open before the loader starts, in this order, relative to the folder.
    pub(super) preload: Vec<String>,
}

impl Manifest {
    /// The manifest of `folder`; `None` if there is none or it is not for this layout.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        Self::parse(&fs::read_to_string(folder.join(MANIFEST)).ok()?)
    }

    /// Writes it into `folder`, which completes the folder.
    pub(super) fn write(&self, folder: &Path) -> std::io::Result<()> {
        fs::write(folder.join(MANIFEST), self.to_text())
    }

    fn parse(text: &str) -> Option<Self> {
        let mut lines = text.lines();
        if lines.next()? != MANIFEST_HEAD {
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
        format!("{MANIFEST_HEAD}\n{}", packages.chain(preload).collect::<String>())
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
    fn other_layouts_do_not_count() {
        assert_eq!(Manifest::parse(""), None);
        assert_eq!(Manifest::parse("lvk vulkan folder 0\n"), None);
        assert_eq!(Manifest::parse(&format!("{MANIFEST_HEAD}\nunknown word\n")), None);
    }

    #[test]
    fn a_folder_counts_only_with_its_manifest() {
        let (with, without) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        for root in [&with, &without] {
            fs::create_dir(Part::Driver.folder(root.path())).unwrap();
        }
        example().write(&Part::Driver.folder(with.path())).unwrap();
        let roots = [without.path().to_path_buf(), with.path().to_path_buf()];
        assert_eq!(Part::Driver.find(&roots), Some(Part::Driver.folder(with.path())));
        assert_eq!(Part::Validation.find(&roots), None);
    }
}
