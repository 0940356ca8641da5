//! Gets SPIR-V words out of what the caller gave.

#[cfg(feature = "glsl")]
use super::front_end::compile_cached;
use super::spirv::passes::strip_primitive_culling::strip_primitive_culling;
use super::spirv::words;
use super::{ShaderCache, ShaderModuleDesc, ShaderSource};
use crate::error::{Error, Result};
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::ray_query_path::RayQueryPath;

/// What the preamble must know of the device.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CompileOptions {
    /// The device loads from storage images without a format (`shaderStorageImageReadWithoutFormat`).
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) formatless_read: bool,
    /// The device fetches the corners of triangles that were hit (`VK_KHR_ray_tracing_position_fetch`).
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) position_fetch: bool,
    /// The library walks ray queries itself.
    pub(crate) software_ray_query: bool,
    /// Helper invocations of fragment shaders have no arrays that work.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) helpers_lose_arrays: bool,
    /// The device is a CPU.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) is_cpu: bool,
    /// It gathers 64 bits for each lane as fast as 32.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) gathers_pairs: bool,
}

impl CompileOptions {
    /// For a device with these capabilities.
    pub(crate) fn from_capabilities(device: &Capabilities) -> Self {
        Self {
            formatless_read: device.formatless_storage_read,
            position_fetch: device.position_fetch,
            software_ray_query: device.ray_query_path == RayQueryPath::Software,
            helpers_lose_arrays: device.helpers_lose_arrays,
            is_cpu: device.is_cpu,
            gathers_pairs: device.is_cpu && device.shader_int64,
        }
    }
}

/// The module's SPIR-V: version 1.6 for GLSL, the caller's own words, checked for their structure, otherwise.
///
/// What is compiled is looked up in `cache` first.
pub(crate) fn compile(
    desc: &ShaderModuleDesc<'_>,
    options: &CompileOptions,
    cache: Option<&ShaderCache>,
) -> Result<Vec<u32>> {
    match desc.source {
        ShaderSource::Glsl(text) if options.software_ray_query => {
            compile_cached(desc, text, options, cache).map(|words| strip_primitive_culling(&words))
        }
        ShaderSource::Glsl(text) => compile_cached(desc, text, options, cache),
        ShaderSource::Spirv(words) => {
            words::validate(words).map_err(|log| compile_error(desc.debug_name, log))?;
            Ok(words.to_vec())
        }
    }
}

pub(super) fn compile_error(name: &str, log: impl Into<String>) -> Error {
    Error::Shader { name: name.to_owned(), log: log.into() }
}

#[cfg(not(feature = "glsl"))]
fn compile_cached(
    desc: &ShaderModuleDesc<'_>,
    _: &str,
    _: &CompileOptions,
    _: Option<&ShaderCache>,
) -> Result<Vec<u32>> {
    let what = format!("GLSL source of shader '{}'", desc.debug_name);
    Err(Error::unsupported(
        what,
        "lvk was built without its feature `glsl`; turn it on, or pass SPIR-V words",
    ))
}

#[cfg(all(test, not(feature = "glsl")))]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]
    use super::*;

    #[test]
    fn glsl_names_the_missing_feature() {
        let desc = ShaderModuleDesc { source: ShaderSource::Glsl("void main() {}"), ..Default::default() };
        match compile(&desc, &CompileOptions::default(), None) {
            Err(Error::Unsupported { why, .. }) => assert!(why.contains("feature `glsl`")),
            other => panic!("{other:?}"),
        }
    }
}
