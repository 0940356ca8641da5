//! Inputs of a compilation beside the source, and its error.

#[cfg(feature = "glsl")]
use std::path::Path;

use super::ShaderCache;
use crate::error::Error;
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::ray_query_path::RayQueryPath;

/// Properties of the device that the preamble depends on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CompileOptions {
    /// The device loads from storage images without a format (`shaderStorageImageReadWithoutFormat`).
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) formatless_read: bool,
    /// The device can fetch the vertex positions of hit triangles (`VK_KHR_ray_tracing_position_fetch`).
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) position_fetch: bool,
    /// The library traverses acceleration structures of ray queries itself.
    pub(crate) software_ray_query: bool,
    /// Arrays do not work in helper invocations of fragment shaders on the device.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) helpers_lose_arrays: bool,
    /// The device is a CPU.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) is_cpu: bool,
    /// The device gathers 64 bits for each invocation as fast as 32.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) gathers_pairs: bool,
}

impl CompileOptions {
    /// Returns the options for a device with these capabilities.
    pub(crate) fn from_capabilities(device: &Capabilities) -> Self {
        Self {
            formatless_read: device.formatless_storage_read,
            position_fetch: device.position_fetch,
            software_ray_query: device.ray_query_path == RayQueryPath::Software,
            helpers_lose_arrays: device.helpers_lose_arrays,
            is_cpu: device.is_cpu,
            gathers_pairs: device.has_fast_64_bit_loads(),
        }
    }
}

/// Files that a compilation reads and writes; the default are includes only.
#[derive(Clone, Copy, Default)]
pub(crate) struct CompileFiles<'a> {
    /// The cache of compiled modules.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only what is compiled is kept"))]
    pub(crate) cache: Option<&'a ShaderCache>,
    /// Called with each path at which an include is searched, before the search.
    #[cfg(feature = "glsl")]
    pub(crate) on_search: Option<&'a dyn Fn(&Path)>,
}

impl<'a> CompileFiles<'a> {
    /// Returns the files of a compilation with this cache.
    pub(crate) fn with_cache(cache: Option<&'a ShaderCache>) -> Self {
        Self {
            cache,
            #[cfg(feature = "glsl")]
            on_search: None,
        }
    }
}

pub(super) fn compile_error(name: &str, log: impl Into<String>) -> Error {
    Error::Shader { name: name.to_owned(), log: log.into() }
}
