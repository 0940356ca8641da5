//! Shader modules and pipelines: from GLSL or SPIR-V, checked, and kept on disk; layouts of Rust structs.

mod background;
mod cache;
mod features;
mod hot_reload;
mod layouts;
mod modules;
mod other_languages;
mod pipeline_cache;
mod special_files;
mod subgroups;
