//! Produces SPIR-V words from a shader source.

#[cfg(feature = "glsl")]
use super::front_end::compile_cached;
use super::options::{CompileFiles, CompileOptions, compile_error};
use super::spirv::passes::strip_primitive_culling::strip_primitive_culling;
use super::spirv::passes::strip_ray_query::strip_unused_ray_query;
use super::spirv::words;
use super::{ShaderModuleDesc, ShaderSource};
#[cfg(not(feature = "glsl"))]
use crate::error::Error;
use crate::error::Result;

/// Returns the SPIR-V of a module.
///
/// GLSL is compiled to SPIR-V 1.6, or loaded from the cache if it was compiled before. SPIR-V words are returned after a
/// check of their structure, without an unused capability of ray queries.
pub(crate) fn compile(
    desc: &ShaderModuleDesc<'_>,
    options: &CompileOptions,
    files: CompileFiles<'_>,
) -> Result<Vec<u32>> {
    match desc.source {
        ShaderSource::Glsl(text) if options.software_ray_query => {
            compile_cached(desc, text, options, files).map(|words| strip_primitive_culling(&words))
        }
        ShaderSource::Glsl(text) => compile_cached(desc, text, options, files),
        ShaderSource::Spirv(words) => {
            words::validate(words).map_err(|log| compile_error(desc.debug_name, log))?;
            Ok(strip_unused_ray_query(words))
        }
    }
}

#[cfg(not(feature = "glsl"))]
fn compile_cached(
    desc: &ShaderModuleDesc<'_>,
    _: &str,
    _: &CompileOptions,
    _: CompileFiles<'_>,
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
        match compile(&desc, &CompileOptions::default(), CompileFiles::default()) {
            Err(Error::Unsupported { why, .. }) => assert!(why.contains("feature `glsl`")),
            other => panic!("{other:?}"),
        }
    }
}
