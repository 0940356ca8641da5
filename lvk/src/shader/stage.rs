//! Description of a shader module.

use std::path::Path;

use ash::vk;

/// The pipeline stage a shader module is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShaderStage {
    /// Vertex stage of a render pipeline.
    Vertex,
    /// Tessellation control stage (hull).
    TessControl,
    /// Tessellation evaluation stage (domain).
    TessEval,
    /// Geometry stage.
    Geometry,
    /// Fragment stage; the only one with derivatives.
    Fragment,
    /// Compute pipeline.
    Compute,
    /// Task stage, in front of a mesh stage.
    Task,
    /// Mesh stage.
    Mesh,
    /// Ray generation stage, the start of a ray tracing pipeline.
    RayGen,
    /// Called for a ray without a hit.
    Miss,
    /// Called for the closest hit of a ray.
    ClosestHit,
    /// Called for each hit of geometry that is not opaque, to accept or ignore it.
    AnyHit,
    /// Intersects a ray with the content of an AABB.
    Intersection,
    /// Called by index from other ray tracing stages.
    Callable,
}

impl ShaderStage {
    /// True if the stage belongs to a ray tracing pipeline.
    #[must_use]
    pub fn is_ray_tracing(self) -> bool {
        use ShaderStage::{AnyHit, Callable, ClosestHit, Intersection, Miss, RayGen};
        matches!(self, RayGen | Miss | ClosestHit | AnyHit | Intersection | Callable)
    }

    /// Returns the Vulkan stage bit.
    #[must_use]
    pub fn raw(self) -> vk::ShaderStageFlags {
        match self {
            Self::Vertex => vk::ShaderStageFlags::VERTEX,
            Self::TessControl => vk::ShaderStageFlags::TESSELLATION_CONTROL,
            Self::TessEval => vk::ShaderStageFlags::TESSELLATION_EVALUATION,
            Self::Geometry => vk::ShaderStageFlags::GEOMETRY,
            Self::Fragment => vk::ShaderStageFlags::FRAGMENT,
            Self::Compute => vk::ShaderStageFlags::COMPUTE,
            Self::Task => vk::ShaderStageFlags::TASK_EXT,
            Self::Mesh => vk::ShaderStageFlags::MESH_EXT,
            Self::RayGen => vk::ShaderStageFlags::RAYGEN_KHR,
            Self::Miss => vk::ShaderStageFlags::MISS_KHR,
            Self::ClosestHit => vk::ShaderStageFlags::CLOSEST_HIT_KHR,
            Self::AnyHit => vk::ShaderStageFlags::ANY_HIT_KHR,
            Self::Intersection => vk::ShaderStageFlags::INTERSECTION_KHR,
            Self::Callable => vk::ShaderStageFlags::CALLABLE_KHR,
        }
    }

    /// Returns the stage's name for messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::TessControl => "tessellation control",
            Self::TessEval => "tessellation evaluation",
            Self::Geometry => "geometry",
            Self::Fragment => "fragment",
            Self::Compute => "compute",
            Self::Task => "task",
            Self::Mesh => "mesh",
            Self::RayGen => "ray generation",
            Self::Miss => "miss",
            Self::ClosestHit => "closest hit",
            Self::AnyHit => "any hit",
            Self::Intersection => "intersection",
            Self::Callable => "callable",
        }
    }

    /// All stages.
    pub(crate) const ALL: [Self; 14] = [
        Self::Vertex,
        Self::TessControl,
        Self::TessEval,
        Self::Geometry,
        Self::Fragment,
        Self::Compute,
        Self::Task,
        Self::Mesh,
        Self::RayGen,
        Self::Miss,
        Self::ClosestHit,
        Self::AnyHit,
        Self::Intersection,
        Self::Callable,
    ];
}

/// The program text of a shader module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShaderSource<'a> {
    /// GLSL 4.60 for Vulkan, compiled to SPIR-V 1.6 when the module is created; the entry point is `main`.
    ///
    /// Needs the feature `glsl` (on by default). Without it, creating the module fails with
    /// [`Error::Unsupported`](crate::Error::Unsupported). See [`ShaderModuleDesc`] for the features of the text.
    Glsl(&'a str),
    /// SPIR-V words up to version 1.6, in the byte order of the machine, with an entry point `main`.
    /// [`manual::shader_interface`](crate::manual::shader_interface) has the sets and bindings.
    ///
    /// The structure is checked (header, instruction lengths, entry point, bindings). The semantics are not: run a
    /// validator over SPIR-V from an unknown source.
    Spirv(&'a [u32]),
}

/// Describes a shader module.
///
/// # Features of GLSL text
///
/// The text needs no `#version` (450 and 460 are accepted) and declares no descriptors: a preamble declares them in
/// every stage. Line numbers in messages are those of the text. The manual's page
/// [`shader_interface`](crate::manual::shader_interface) lists every name; this is an overview.
///
/// ```glsl
/// layout(local_size_x = 8, local_size_y = 8) in;
/// layout(push_constant, scalar) uniform Push { uint colour; uint smp; uint target; vec2 texel; } push;
///
/// void main() {
///     vec2 uv = (vec2(gl_GlobalInvocationID.xy) + 0.5) * push.texel;
///     vec4 c = textureBindless2DLod(push.colour, push.smp, uv, 0.0);
///     imageStore(kImages2D[push.target], ivec2(gl_GlobalInvocationID.xy), c);
/// }
/// ```
///
/// * Textures: arrays `kTextures2D`, `kTextures2DArray`, `kTextures3D`, `kTexturesCube`, `kTexturesU2D` and
///   `kTexturesI2D` (integer texels), `kTextures2DShadow`; samplers `kSamplers`, `kSamplersShadow`. The helpers take
///   the indices of a texture and a sampler, which need not be uniform: `textureBindless2D(tex, smp, uv)`, `..2DLod`,
///   `..2DGrad`, `..2DGather`, `..2DShadow(tex, smp, vec3(uv, reference))`, `..2DArray[Lod]`, `..3D[Lod]`,
///   `..Cube[Lod]`, `textureBindlessFetch2D(tex, texel, lod)` (`FetchU2D`, `FetchI2D`), `textureBindlessSize2D(tex)`
///   (`Size2DArray`, `Size3D`, `SizeCube`), `textureBindlessQueryLevels2D(tex)` (`QueryLevelsCube`). Helpers without
///   an explicit level use derivatives in fragment shaders and mip level 0 in every other stage. `..2DArrayShadow`
///   and `..CubeShadow` take the reference after the coordinates. `..2DGatherShadow(tex, smp, uv, reference)` and
///   `..2DGatherChannel(tex, smp, uv, channel)` (`2DArray`, `Cube`) gather. Multisampled textures (`kTextures2DMS`)
///   have `textureBindlessFetch2DMS(tex, texel, sample)`, `..Size2DMS` and `..Samples2DMS`.
/// * Textures of other shapes: declare them once at global scope, `LVK_TEXTURES(utexture3D, kVolumes);`.
///   `LVK_TEXTURES(textureCubeArray, kTexturesCubeArray);` enables `textureBindlessCubeArray[Lod]` with the index of
///   the cube as fourth coordinate, `textureBindlessCubeArrayShadow(tex, smp, dirCube, reference)` and
///   `textureBindlessSizeCubeArray(tex)`. `LVK_TEXTURES(texture1D, kTextures1D);` enables `textureBindless1D[Lod]`,
///   `textureBindlessFetch1D(tex, texel, lod)` and `textureBindlessSize1D(tex)`.
/// * Textures in Y'CbCr: `LVK_YUV_TEXTURES(kYuv);` at global scope, then `textureBindlessYUV(kYuv, index, uv)` returns
///   a colour. The index must be a constant, for instance a specialisation constant.
/// * Storage images: `kImages2D`, `kImages2DArray`, `kImages3D`, `kImagesU2D`, `kImagesI2D` accept stores of any
///   format. Loads from them need `LVK_FORMATLESS_READ`, which is defined if the device can load without a format. For
///   other loads and for atomics, name the format once at global scope:
///   `LVK_STORAGE_IMAGES_2D(rgba8, kImagesRgba8);`, `LVK_STORAGE_IMAGES_U2D(r32ui, kCounters);`,
///   `LVK_STORAGE_IMAGES_I2D(..)`, or `LVK_STORAGE_IMAGES(image3D, r32f, kVolumes);` for the other shapes. Mark an
///   index that differs between invocations: `kImages2D[nonuniformEXT(i)]`.
/// * Buffers, by address: `layout(buffer_reference, scalar) readonly buffer Vertices { vec3 position[]; };` and a
///   member `Vertices vertices;` in the push constants.
/// * Ray tracing stages: `traceRayEXT(kTLAS[push.tlas], LVK_RAY_FLAG_OPAQUE, ..)`.
/// * Any stage: `#include <lvk/ray_query.glsl>` for ray queries,
///   `lvkRayQueryInitialize(rq, push.tlas, LVK_RAY_FLAG_OPAQUE, 0xFFu, origin, 0.0, direction, 100.0)` and so on.
/// * Task and mesh stages: `GL_EXT_mesh_shader` is on, with `taskPayloadSharedEXT`, `EmitMeshTasksEXT(x, y, z)`,
///   `SetMeshOutputsEXT(vertices, primitives)` and `gl_MeshVerticesEXT`.
/// * `LVK_STAGE_FRAGMENT`, `LVK_STAGE_RAY_GEN` and so on are defined for the current stage, so that one file can serve
///   several stages.
///
/// Extensions for buffer references, scalar layout, non-uniform indexing, sized integer and float types, subgroup
/// operations and `debugPrintfEXT` are on. An extension that the text does not use costs nothing and needs no device
/// feature.
///
/// # Includes
///
/// `#include "name"` is looked up in [`includes`](Self::includes), then beside the including file, then in
/// [`include_dirs`](Self::include_dirs). `#include <name>` does not look beside the including file. Names that start
/// with `lvk/` belong to the library. `#pragma once` and include guards both work. A module includes at most 4,096 files and
/// 64 MiB, each counted as often as it is included.
#[derive(Debug, Clone, Copy)]
pub struct ShaderModuleDesc<'a> {
    /// The stage the module is for. Default: [`ShaderStage::Vertex`].
    pub stage: ShaderStage,
    /// The program text. Default: an empty [`ShaderSource::Glsl`].
    pub source: ShaderSource<'a>,
    /// Files for `#include` in memory: name as written in the directive (with `/`), and text. Default: empty.
    pub includes: &'a [(&'a str, &'a str)],
    /// Folders that `#include` searches, in order. Default: empty.
    pub include_dirs: &'a [&'a Path],
    /// Macros defined before the text: name and replacement (may be empty). Ignored for SPIR-V. Default: empty.
    pub defines: &'a [(&'a str, &'a str)],
    /// Embeds the text and its includes in the module (`OpSource`), for frame and shader debuggers. Ignored for SPIR-V.
    /// Line numbers are not embedded: the compiler's crate does not provide them. Default: false.
    pub debug_info: bool,
    /// Name shown in errors and by debugging tools. Default: `"shader module"`.
    pub debug_name: &'a str,
}

impl Default for ShaderModuleDesc<'_> {
    /// Returns an empty vertex shader text; set at least `stage` and `source`.
    fn default() -> Self {
        Self {
            stage: ShaderStage::Vertex,
            source: ShaderSource::Glsl(""),
            includes: &[],
            include_dirs: &[],
            defines: &[],
            debug_info: false,
            debug_name: "shader module",
        }
    }
}
