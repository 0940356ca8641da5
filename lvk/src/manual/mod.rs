//! The manual: one page per topic, to be read from top to bottom. The API documentation has the details.

#[doc = include_str!("textures.md")]
pub mod textures {}

#[doc = include_str!("queues_and_uploads.md")]
pub mod queues_and_uploads {}

#[doc = include_str!("rendering.md")]
pub mod rendering {}

#[doc = include_str!("acceleration_structures.md")]
pub mod acceleration_structures {}

#[doc = include_str!("software_ray_queries.md")]
pub mod software_ray_queries {}

#[doc = include_str!("splitting_and_profiles.md")]
pub mod splitting_and_profiles {}

#[doc = include_str!("ray_tracing_pipelines.md")]
pub mod ray_tracing_pipelines {}

#[doc = include_str!("lowered_pipelines.md")]
pub mod lowered_pipelines {}

#[doc = include_str!("shaders.md")]
pub mod shaders {}

#[doc = include_str!("shader_interface.md")]
pub mod shader_interface {}

#[doc = include_str!("debugging.md")]
pub mod debugging {}

#[doc = include_str!("unchecked.md")]
pub mod unchecked {}

#[doc = include_str!("interop.md")]
pub mod interop {}

#[doc = include_str!("measuring.md")]
pub mod measuring {}

#[cfg(feature = "window")]
#[doc = include_str!("windows.md")]
pub mod windows {}

#[doc = include_str!("parity.md")]
pub mod parity {}

#[doc = include_str!("from_lightweightvk.md")]
pub mod from_lightweightvk {}

#[doc = include_str!("from_wgpu.md")]
pub mod from_wgpu {}
