//! Remedies that differ by platform.

/// Platforms whose loaders and drivers are installed in different ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Platform {
    Windows,
    /// macOS and iOS.
    Apple,
    Android,
    /// Linux and the other systems with packages.
    Unix,
}

impl Platform {
    pub(super) const CURRENT: Self = if cfg!(windows) {
        Self::Windows
    } else if cfg!(target_vendor = "apple") {
        Self::Apple
    } else if cfg!(target_os = "android") {
        Self::Android
    } else {
        Self::Unix
    };

    /// The remedy where there is no loader.
    pub(super) const fn install_loader(self) -> &'static str {
        match self {
            Self::Windows => {
                "install the current driver of the GPU's vendor, which brings the loader vulkan-1.dll"
            }
            Self::Apple => {
                "on macOS install the Vulkan SDK, which has the loader and the driver MoltenVK; on iOS bundle \
                 MoltenVK.framework with the application and name its library in ContextDesc::vulkan_library"
            }
            Self::Android => "use a device whose Android has Vulkan",
            Self::Unix => {
                "install the Vulkan loader: the package libvulkan1 (Debian, Ubuntu), vulkan-loader (Fedora) or \
                 vulkan-icd-loader (Arch)"
            }
        }
    }

    /// The remedy where there is no driver.
    pub(super) const fn install_driver(self) -> &'static str {
        match self {
            Self::Windows => {
                "install the current driver of the GPU's vendor (drivers in the registry are not in this report)"
            }
            Self::Apple => {
                "on macOS install the Vulkan SDK, which has the driver MoltenVK; on iOS bundle MoltenVK.framework with \
                 the application and name its library in ContextDesc::vulkan_library"
            }
            Self::Android => {
                "use a device whose Android has a Vulkan driver (the system's own drivers are not in this report)"
            }
            Self::Unix => {
                "install a Vulkan driver: the GPU vendor's, or Mesa's package mesa-vulkan-drivers (Debian, Ubuntu, \
                 Fedora), vulkan-radeon or vulkan-intel (Arch)"
            }
        }
    }

    /// The remedy where drivers load, but none offers a device.
    pub(super) const fn no_device(self) -> &'static str {
        match self {
            Self::Windows => {
                "every driver of this report loads, but none offers a device: check in the Device Manager that the GPU \
                 works, and install the current driver of its vendor; VK_LOADER_DEBUG=all prints the reasons of the loader"
            }
            Self::Apple => {
                "every driver loads, but none offers a device: check that the GPU has Metal, and that MoltenVK is \
                 current; VK_LOADER_DEBUG=all prints the reasons of the loader"
            }
            Self::Android => {
                "every driver of this report loads, but none offers a device: unset the variables that name drivers, or \
                 update the system"
            }
            Self::Unix => {
                "every driver loads, but none offers a device: check that the GPU's kernel driver runs, that it has the \
                 version of the Vulkan driver, and that this user may open its device files (/dev/dri, /dev/nvidia*); \
                 VK_LOADER_DEBUG=all prints the reasons of the loader"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remedies_name_what_the_platform_has() {
        for (platform, own) in [
            (Platform::Windows, ["vulkan-1.dll", "registry", "Device Manager"]),
            (Platform::Apple, ["vulkan_library", "MoltenVK.framework", "Metal"]),
            (Platform::Android, ["Android", "Android", "update the system"]),
            (Platform::Unix, ["libvulkan1", "mesa-vulkan-drivers", "/dev/dri"]),
        ] {
            let remedies = [platform.install_loader(), platform.install_driver(), platform.no_device()];
            for (remedy, part) in remedies.into_iter().zip(own) {
                assert!(remedy.contains(part), "no '{part}' in: {remedy}");
                assert_eq!(remedy.contains("/dev/"), platform == Platform::Unix && part == "/dev/dri");
            }
        }
    }

    #[test]
    fn apples_remedies_name_both_systems() {
        for remedy in [Platform::Apple.install_loader(), Platform::Apple.install_driver()] {
            assert!(remedy.contains("macOS") && remedy.contains("iOS"), "{remedy}");
        }
    }
}
