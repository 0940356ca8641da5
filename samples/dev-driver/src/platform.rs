//! Downloads and advice by platform.

/// True on the platform of the downloadable packages.
pub(super) const HAS_PACKAGES: bool =
    cfg!(all(target_os = "linux", target_arch = "x86_64", target_env = "gnu"));

/// Advice where no driver traces rays.
pub(super) const INSTALL_DRIVER: &str = if cfg!(windows) {
    "install the current driver of the GPU's vendor, which brings vulkan-1.dll"
} else if cfg!(target_vendor = "apple") {
    "install MoltenVK, which is part of the Vulkan SDK"
} else if cfg!(target_os = "android") {
    "use a device with Vulkan 1.3"
} else {
    "install a GPU driver with ray tracing, or on Debian and Ubuntu `apt install mesa-vulkan-drivers libvulkan1` (Mesa \
     24.1 or newer)"
};

/// Advice where there is no current validation layer.
pub(super) const INSTALL_LAYER: &str = if HAS_PACKAGES {
    "install VK_LAYER_KHRONOS_validation 1.3.296 or newer (package `vulkan-validationlayers`, or the Vulkan SDK)"
} else {
    "install the Vulkan SDK 1.3.296 or newer, which brings VK_LAYER_KHRONOS_validation"
};
