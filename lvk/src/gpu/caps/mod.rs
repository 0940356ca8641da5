//! Capabilities and limits of a device, as plain values.

pub(crate) mod capabilities;
pub(crate) mod descriptor_limits;
pub(crate) mod enabled_features;
pub(crate) mod extension_features;
pub(crate) mod features;
pub(crate) mod format_features;
pub(crate) mod host_image_copy;
pub(crate) mod image_limits;
pub(crate) mod invocation_reorder;
pub(crate) mod limits;
pub(crate) mod lowering_preference;
pub(crate) mod mesh_limits;
pub(crate) mod optional_features;
pub(crate) mod portability;
pub(crate) mod queues;
pub(crate) mod ray_query_path;
pub(crate) mod ray_tracing_pipeline_path;
pub(crate) mod resolve_modes;
pub(crate) mod shading_rate;
pub(crate) mod subgroup_limits;
