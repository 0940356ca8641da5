//! Shader modules and pipelines: from GLSL or SPIR-V, checked, and kept on disk.

mod background;
mod cache;
mod features;
mod hot_reload;
mod modules;
mod other_languages;
mod pipeline_cache;
mod subgroups;
