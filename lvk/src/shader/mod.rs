//! Shader modules: compilation of GLSL to SPIR-V, includes, and reflection.

mod compile;
#[cfg(feature = "glsl")]
mod compile_glsl;
#[cfg(feature = "glsl")]
mod diagnostics;
#[cfg_attr(not(any(feature = "glsl", test)), expect(dead_code, reason = "only what is compiled is kept"))]
mod disk_cache;
#[cfg_attr(not(any(feature = "glsl", test)), expect(dead_code, reason = "only what is compiled is kept"))]
pub(crate) mod disk_file;
#[cfg(feature = "glsl")]
mod front_end;
#[cfg(feature = "glsl")]
mod include;
pub(crate) mod layout_comparison;
mod options;
#[cfg(all(feature = "glsl", feature = "test-hooks"))]
pub(crate) mod outside_text;
#[cfg(feature = "glsl")]
mod preamble;
#[cfg(feature = "glsl")]
mod sanitize;
pub(crate) mod shader_layout;
pub(crate) mod spirv;
mod stage;

pub(crate) use compile::compile;
#[cfg(feature = "glsl")]
pub use compile_glsl::compile_glsl;
pub(crate) use disk_cache::ShaderCache;
pub use disk_cache::ShaderCacheStats;
pub(crate) use options::{CompileFiles, CompileOptions};
pub(crate) use spirv::capabilities::{check_capabilities, check_stage};
pub(crate) use spirv::hit_builtins::find_raw_hit_builtin;
pub(crate) use spirv::input_attachments::InputRead;
pub(crate) use spirv::passes::check_indices::with_checked_indices;
pub(crate) use spirv::reflect::{Primitive, Reflection};
pub(crate) use spirv::stage_interface::LocationValue;
pub(crate) use spirv::workgroup_memory::SharedBytes;
pub use stage::{ShaderModuleDesc, ShaderSource, ShaderStage};

/// Most bytes of a file of GLSL.
#[cfg(feature = "glsl")]
pub(crate) const MAX_GLSL_BYTES: u64 = 16 << 20;

/// Text of `lvk.hlsli`, which declares the descriptors of the library for HLSL and Slang, for build scripts to write to
/// a file. The manual's page [`shader_interface`](crate::manual::shader_interface) has the options of the compilers.
pub const HLSL_HEADER: &str = include_str!("hlsl/lvk.hlsli");

#[cfg(all(test, feature = "glsl"))]
mod tests;
