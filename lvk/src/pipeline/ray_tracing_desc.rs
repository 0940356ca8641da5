//! Descriptions of ray tracing pipelines and of their hit groups.

use super::block_layout::BlockLayout;
use super::shader_record::ShaderRecord;
use super::stage::SpecializationConstant;
use crate::handle::{RayTracingLibraryHandle, ShaderModuleHandle};

/// Shaders that run when a ray meets a geometry. A group with an intersection shader is for AABBs; a group without one
/// is for triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HitGroup<'a> {
    /// Shader of the closest hit. Default: none.
    pub closest_hit: Option<ShaderModuleHandle>,
    /// Shader of each hit of geometry that is not opaque. It may ignore the hit. Default: none.
    pub any_hit: Option<ShaderModuleHandle>,
    /// Shader that decides whether a ray hits the object inside an AABB. Default: none.
    pub intersection: Option<ShaderModuleHandle>,
    /// Bytes that the group's shaders read through `shaderRecordEXT`. Default: empty.
    pub record: ShaderRecord<'a>,
}

/// Describes a ray tracing pipeline. The order of the lists is the order of the shader binding table.
///
/// The shaders of `libraries` follow the pipeline's own in each of the four lists, library by library. With two own
/// miss shaders, the first miss shader of the first library has the miss index 2.
#[derive(Debug, Clone, Copy)]
pub struct RayTracingPipelineDesc<'a> {
    /// Ray generation shaders, at least one. A trace selects one by its index; the default is the first.
    /// Default: empty.
    pub ray_gen: &'a [ShaderModuleHandle],
    /// Miss shaders, by the miss index of `traceRayEXT`. Default: empty.
    pub miss: &'a [ShaderModuleHandle],
    /// Hit groups, by the instance's hit-group offset and the arguments of `traceRayEXT`. Default: empty.
    pub hit_groups: &'a [HitGroup<'a>],
    /// Callable shaders, by the index of `executeCallableEXT`. Default: empty.
    pub callable: &'a [ShaderModuleHandle],
    /// Bytes that the ray generation shaders read through `shaderRecordEXT`, in the order of `ray_gen`. Shaders beyond
    /// the end of the list have no record. Default: empty.
    pub ray_gen_records: &'a [ShaderRecord<'a>],
    /// Records of the miss shaders, in the order of `miss`; see `ray_gen_records`. Default: empty.
    pub miss_records: &'a [ShaderRecord<'a>],
    /// Records of the callable shaders, in the order of `callable`; see `ray_gen_records`. Default: empty.
    pub callable_records: &'a [ShaderRecord<'a>],
    /// Libraries whose shaders are linked into the pipeline. They may be destroyed before the pipeline. Default: empty.
    pub libraries: &'a [RayTracingLibraryHandle],
    /// Deepest nesting of `traceRayEXT`; 1 if hit and miss shaders trace no rays. Deeper traces are undefined behaviour,
    /// which the library does not check. A lowered pipeline returns at once from traces, and from calls of callable shaders
    /// that call others, where more than `max_recursion` (plus `max_callable_depth` with such shaders) are open; on CPUs, rays that
    /// run no closest-hit shader may be traced at any depth. Default: 1.
    pub max_recursion: u32,
    /// Deepest nesting of `executeCallableEXT`; 1 if callable shaders call no others. The stack of a ray grows with it and
    /// has at most `u32::MAX` bytes. A lowered pipeline takes at most 31. Default: 1.
    pub max_callable_depth: u32,
    /// Largest payload of any shader in bytes. Used only with libraries: see
    /// [`RayTracingLibraryDesc`](crate::RayTracingLibraryDesc). Default: 64.
    pub max_payload_bytes: u32,
    /// Largest hit attributes of any shader in bytes. Used only with libraries. The attributes of triangles have 8
    /// bytes. Default: 8.
    pub max_hit_attribute_bytes: u32,
    /// Values of specialization constants of the pipeline's own shaders. Default: empty.
    pub specialization: &'a [SpecializationConstant],
    /// Rust structs for the blocks of the pipeline's own shaders, compared with them at creation. Records have their
    /// layouts with them ([`ShaderRecord::new`]). Default: empty.
    pub layouts: &'a [BlockLayout],
    /// Name in error messages, validation messages and debuggers. Default: `"ray tracing pipeline"`.
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
            layouts: &[],
            debug_name: "ray tracing pipeline",
        }
    }
}
