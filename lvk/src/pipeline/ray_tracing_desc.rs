//! Descriptions of ray tracing pipelines and of their hit groups.

use super::stage::SpecializationConstant;
use crate::handle::{RayTracingLibraryHandle, ShaderModuleHandle};

/// Shaders that run when a ray meets a geometry. With an intersection shader the group is for boxes, without for
/// triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HitGroup<'a> {
    /// Runs for the closest hit.
    pub closest_hit: Option<ShaderModuleHandle>,
    /// Runs for hits of geometry that is not opaque, and may ignore them.
    pub any_hit: Option<ShaderModuleHandle>,
    /// Decides whether a ray hits what is in a box.
    pub intersection: Option<ShaderModuleHandle>,
    /// Bytes the group's shaders read through `shaderRecordEXT`; see [`record_bytes`].
    pub record: &'a [u8],
}

/// The bytes of a shader record: what a shader reads as a block `layout(shaderRecordEXT, scalar) buffer`.
///
/// The struct must be laid out as the block: `#[repr(C)]` and `scalar` agree where every member is aligned to its
/// largest scalar.
pub fn record_bytes<T: bytemuck::NoUninit>(record: &T) -> &[u8] {
    bytemuck::bytes_of(record)
}

/// Describes a ray tracing pipeline. The order of the lists is the order of the shader binding table.
///
/// The shaders of `libraries` stand behind the pipeline's own in each of the four lists, library by library: with two
/// own miss shaders, the first miss shader of the first library has the miss index 2.
#[derive(Debug, Clone, Copy)]
pub struct RayTracingPipelineDesc<'a> {
    /// Ray generation shaders; traces name one by its place, the first by default. At least one.
    pub ray_gen: &'a [ShaderModuleHandle],
    /// Miss shaders, by the miss index of `traceRayEXT`.
    pub miss: &'a [ShaderModuleHandle],
    /// Hit groups, by the instance's hit-group offset and the arguments of `traceRayEXT`.
    pub hit_groups: &'a [HitGroup<'a>],
    /// Callable shaders, by the index of `executeCallableEXT`.
    pub callable: &'a [ShaderModuleHandle],
    /// Bytes the ray generation shaders read through `shaderRecordEXT`, in the order of `ray_gen`; see
    /// [`record_bytes`]. Shaders beyond the end of the list have no record.
    pub ray_gen_records: &'a [&'a [u8]],
    /// As `ray_gen_records`, for `miss`.
    pub miss_records: &'a [&'a [u8]],
    /// As `ray_gen_records`, for `callable`.
    pub callable_records: &'a [&'a [u8]],
    /// Libraries whose shaders belong to the pipeline too. They may be destroyed before it.
    pub libraries: &'a [RayTracingLibraryHandle],
    /// Deepest nesting of `traceRayEXT`; 1 if hit and miss shaders trace no rays.
    pub max_recursion: u32,
    /// Deepest nesting of `executeCallableEXT`; 1 if callable shaders call no others.
    pub max_callable_depth: u32,
    /// Largest payload of any shader in bytes. Counts only with libraries: see
    /// [`RayTracingLibraryDesc`](crate::RayTracingLibraryDesc).
    pub max_payload_bytes: u32,
    /// Largest hit attributes of any shader in bytes, as `max_payload_bytes`; those of triangles have 8.
    pub max_hit_attribute_bytes: u32,
    /// Values of specialization constants, of the pipeline's own shaders.
    pub specialization: &'a [SpecializationConstant],
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for RayTracingPipelineDesc<'_> {
    fn default() -> Self {
        Self {
            ray_gen: &[],
            miss: &[],
            hit_groups: &[],
            callable: &[],
            ray_gen_records: &[],
            miss_records: &[],
            callable_records: &[],
            libraries: &[],
            max_recursion: 1,
            max_callable_depth: 1,
            max_payload_bytes: 64,
            max_hit_attribute_bytes: 8,
            specialization: &[],
            debug_name: "ray tracing pipeline",
        }
    }
}
