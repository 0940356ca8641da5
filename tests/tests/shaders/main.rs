//! Shader modules and pipelines: from GLSL or SPIR-V, checked, and kept on disk; layouts of Rust structs.

mod cache;
mod features;
mod layouts;
mod modules;
mod other_languages;
mod pipeline_cache;
