//! SPIR-V modules: words, reflection, capabilities, constants, and passes that rewrite modules.

pub(crate) mod atomics;
pub(crate) mod blocks;
pub(crate) mod capabilities;
pub(crate) mod const_eval;
#[cfg(feature = "glsl")]
pub(crate) mod debug_source;
pub(crate) mod hit_builtins;
pub(crate) mod input_attachments;
pub(crate) mod link;
pub(crate) mod lower;
pub(crate) mod parsed;
pub(crate) mod passes;
pub(crate) mod ray_interface;
pub(crate) mod reflect;
pub(crate) mod stage_interface;
pub(crate) mod words;
pub(crate) mod workgroup_memory;
