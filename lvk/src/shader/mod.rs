//! Shader modules: GLSL to SPIR-V, includes, and what a module tells about itself.

mod atomics;
mod capability;
mod compile;
#[cfg(feature = "glsl")]
mod diagnostics;
#[cfg_attr(not(any(feature = "glsl", test)), expect(dead_code, reason = "only what is compiled is kept"))]
mod disk_cache;
#[cfg_attr(not(any(feature = "glsl", test)), expect(dead_code, reason = "only what is compiled is kept"))]
mod disk_file;
mod fold;
#[cfg(feature = "glsl")]
mod front_end;
mod hit_numbers;
mod idle_culling;
mod import;
#[cfg(feature = "glsl")]
mod include;
mod input_read;
mod instrument;
mod module;
#[cfg(feature = "glsl")]
mod offline;
#[cfg(feature = "glsl")]
mod preamble;
mod ray_interface;
mod reflect;
#[cfg(feature = "glsl")]
mod sampled_copies;
mod shared_memory;
#[cfg(feature = "glsl")]
mod source;
#[cfg(feature = "glsl")]
mod source_text;
mod spirv;
mod stage;
#[cfg(feature = "glsl")]
mod unused;

pub(crate) use capability::{check_capabilities, check_stage};
pub(crate) use compile::{CompileOptions, compile};
pub(crate) use disk_cache::ShaderCache;
pub use disk_cache::ShaderCacheStats;
pub(crate) use hit_numbers::raw_hit_number;
pub(crate) use input_read::InputRead;
pub(crate) use instrument::with_checked_indices;
#[cfg(feature = "glsl")]
pub use offline::compile_glsl;
pub(crate) use reflect::{Primitive, Reflection, reflect};
pub(crate) use shared_memory::SharedBytes;
pub use stage::{ShaderModuleDesc, ShaderSource, ShaderStage};

#[cfg(all(test, feature = "glsl"))]
mod tests;
