//! Shader modules and pipelines: from text or words, checked, and kept on disk.

mod cache;
mod features;
mod modules;
mod pipeline_cache;
