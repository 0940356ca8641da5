//! Writes the layer manifest (JSON) of the validation layer from the properties that the layer library reports.

use std::ffi::{CStr, c_char};
use std::path::Path;

use ash::vk;
use lvk::with_causes;

use crate::error::DownloadError;

/// Name of the validation layer.
pub(super) const LAYER_NAME: &CStr = c"VK_LAYER_KHRONOS_validation";
const DEVICE_EXTENSIONS: [(&CStr, u32); 1] = [(vk::EXT_TOOLING_INFO_NAME, 1)];

/// Opens the layer `library` and returns its layer manifest. `library_path` is the path in the manifest, relative to the
/// manifest file.
pub(super) fn describe(library: &Path, library_path: &str) -> Result<String, DownloadError> {
    let unusable = |reason: String| DownloadError::Content {
        reason: format!("{}: {reason}", lvk::readable_name(library)),
    };
    // SAFETY: the file comes from a verified package; the initialisers of a Vulkan layer have no preconditions.
    let handle =
        unsafe { libloading::Library::new(library) }.map_err(|error| unusable(with_causes(&error)))?;
    let layers = layers(&handle).map_err(|error| unusable(with_causes(&error)))?;
    let layer = layers.iter().find(|layer| layer.layer_name_as_c_str() == Ok(LAYER_NAME));
    let layer = layer
        .ok_or_else(|| unusable("the library does not contain VK_LAYER_KHRONOS_validation".to_owned()))?;
    let extensions = extensions(&handle).map_err(|error| unusable(with_causes(&error)))?;
    let named = |name: &CStr| name.to_string_lossy().into_owned();
    let instance: Vec<_> = extensions
        .iter()
        .filter_map(|extension| {
            Some((named(extension.extension_name_as_c_str().ok()?), extension.spec_version))
        })
        .collect();
    let device: Vec<_> = DEVICE_EXTENSIONS.iter().map(|(name, version)| (named(name), *version)).collect();
    Ok(json(library_path, layer.spec_version, layer.implementation_version, &instance, &device))
}

fn layers(library: &libloading::Library) -> Result<Vec<vk::LayerProperties>, libloading::Error> {
    // SAFETY: the symbol has this type by the Vulkan specification.
    let enumerate: libloading::Symbol<'_, vk::PFN_vkEnumerateInstanceLayerProperties> =
        unsafe { library.get(b"vkEnumerateInstanceLayerProperties\0")? };
    Ok(enumerate_all(|count, data| {
        // SAFETY: `count` and `data` are null or valid for `count` elements, as `enumerate_all` ensures.
        unsafe { enumerate(count, data) }
    }))
}

fn extensions(library: &libloading::Library) -> Result<Vec<vk::ExtensionProperties>, libloading::Error> {
    // SAFETY: the symbol has this type by the Vulkan specification.
    let enumerate: libloading::Symbol<'_, vk::PFN_vkEnumerateInstanceExtensionProperties> =
        unsafe { library.get(b"vkEnumerateInstanceExtensionProperties\0")? };
    let name: *const c_char = LAYER_NAME.as_ptr();
    Ok(enumerate_all(|count, data| {
        // SAFETY: as above, and `name` is a C string that outlives the call.
        unsafe { enumerate(name, count, data) }
    }))
}

/// Makes the two calls of a Vulkan enumeration. `call` gets a valid pointer to the count, and null or a pointer to `count`
/// elements. Returns an empty list on failure.
fn enumerate_all<T: Clone + Default>(call: impl Fn(*mut u32, *mut T) -> vk::Result) -> Vec<T> {
    let mut count = 0;
    if call(&mut count, std::ptr::null_mut()) != vk::Result::SUCCESS {
        return Vec::new();
    }
    let mut items = vec![T::default(); count as usize];
    if call(&mut count, items.as_mut_ptr()) != vk::Result::SUCCESS {
        return Vec::new();
    }
    items.truncate(count as usize);
    items
}

fn json(
    library: &str,
    spec_version: u32,
    implementation_version: u32,
    instance: &[(String, u32)],
    device: &[(String, u32)],
) -> String {
    let version = format!(
        "{}.{}.{}",
        vk::api_version_major(spec_version),
        vk::api_version_minor(spec_version),
        vk::api_version_patch(spec_version)
    );
    let list = |extensions: &[(String, u32)]| {
        let item = |(name, version): &(String, u32)| {
            format!("\n      {{ \"name\": \"{name}\", \"spec_version\": \"{version}\" }}")
        };
        extensions.iter().map(item).collect::<Vec<_>>().join(",")
    };
    format!(
        "{{\n  \"file_format_version\": \"1.1.0\",\n  \"layer\": {{\n    \"name\": \"{}\",\n    \"type\": \"GLOBAL\",\n    \
         \"library_path\": \"{library}\",\n    \"api_version\": \"{version}\",\n    \
         \"implementation_version\": \"{implementation_version}\",\n    \
         \"description\": \"Khronos validation layer\",\n    \"instance_extensions\": [{}\n    ],\n    \
         \"device_extensions\": [{}\n    ]\n  }}\n}}\n",
        LAYER_NAME.to_string_lossy(),
        list(instance),
        list(device),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_description_carries_version_path_and_extensions() {
        let instance = [("VK_EXT_debug_utils".to_owned(), 2), ("VK_EXT_layer_settings".to_owned(), 2)];
        let text = json("../lib/x.so", vk::make_api_version(0, 1, 4, 364), 1, &instance, &[]);
        for part in [
            "\"api_version\": \"1.4.364\"",
            "\"library_path\": \"../lib/x.so\"",
            "{ \"name\": \"VK_EXT_debug_utils\", \"spec_version\": \"2\" },",
            "{ \"name\": \"VK_EXT_layer_settings\", \"spec_version\": \"2\" }\n    ]",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert_eq!(text.matches('{').count(), text.matches('}').count());
    }

    #[test]
    fn a_file_that_is_not_a_layer_is_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("libx.so");
        std::fs::write(&path, "text").unwrap();
        assert!(matches!(describe(&path, "../lib/libx.so"), Err(DownloadError::Content { .. })));
    }
}
