//! Libraries of compiled ray tracing shaders, from which pipelines are linked.

use std::sync::Arc;

use ash::vk;

use super::block_layout::BlockLayout;
use super::lowered_groups::LoweredPart;
use super::pipeline_layout::PipelineBase;
use super::ray_tracing_compile::{LinkedLibraries, check_interface, compile_groups};
use super::ray_tracing_desc::{HitGroup, RayTracingPipelineDesc};
use super::shader_groups::{CompiledGroups, ShaderGroups};
use super::shader_module::{ModuleLookup, ShaderModule};
use super::shader_record::ShaderRecord;
use super::stage::SpecializationConstant;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::start::driver_workarounds::with_shared_device_lock;
use crate::handle::ShaderModuleHandle;
use crate::shader::ShaderStage;

/// Describes a library: shader groups that are compiled once and linked into any number of pipelines by
/// [`RayTracingPipelineDesc::libraries`]. A library has at least one shader or hit group.
///
/// `max_recursion`, `max_payload_bytes` and `max_hit_attribute_bytes` must equal those of the pipelines.
#[derive(Debug, Clone, Copy)]
pub struct RayTracingLibraryDesc<'a> {
    /// Ray generation shaders. Default: empty.
    pub ray_gen: &'a [ShaderModuleHandle],
    /// Miss shaders. Default: empty.
    pub miss: &'a [ShaderModuleHandle],
    /// Hit groups. Default: empty.
    pub hit_groups: &'a [HitGroup<'a>],
    /// Callable shaders. Default: empty.
    pub callable: &'a [ShaderModuleHandle],
    /// See [`RayTracingPipelineDesc::ray_gen_records`]. Default: empty.
    pub ray_gen_records: &'a [ShaderRecord<'a>],
    /// See [`RayTracingPipelineDesc::miss_records`]. Default: empty.
    pub miss_records: &'a [ShaderRecord<'a>],
    /// See [`RayTracingPipelineDesc::callable_records`]. Default: empty.
    pub callable_records: &'a [ShaderRecord<'a>],
    /// See [`RayTracingPipelineDesc::max_recursion`]. Default: 1.
    pub max_recursion: u32,
    /// See [`RayTracingPipelineDesc::max_payload_bytes`]. Default: 64.
    pub max_payload_bytes: u32,
    /// See [`RayTracingPipelineDesc::max_hit_attribute_bytes`]. Default: 8.
    pub max_hit_attribute_bytes: u32,
    /// Values of specialization constants. Default: empty.
    pub specialization: &'a [SpecializationConstant],
    /// See [`RayTracingPipelineDesc::layouts`]. Default: empty.
    pub layouts: &'a [BlockLayout],
    /// Name in error messages, validation messages and debuggers. Default: `"ray tracing library"`.
    pub debug_name: &'a str,
}

impl Default for RayTracingLibraryDesc<'_> {
    fn default() -> Self {
        let pipeline = RayTracingPipelineDesc::default();
        Self {
            ray_gen: &[],
            miss: &[],
            hit_groups: &[],
            callable: &[],
            ray_gen_records: &[],
            miss_records: &[],
            callable_records: &[],
            max_recursion: pipeline.max_recursion,
            max_payload_bytes: pipeline.max_payload_bytes,
            max_hit_attribute_bytes: pipeline.max_hit_attribute_bytes,
            specialization: &[],
            layouts: &[],
            debug_name: "ray tracing library",
        }
    }
}

impl<'a> RayTracingLibraryDesc<'a> {
    /// Returns the description of a pipeline with these shaders.
    fn as_pipeline(&self) -> RayTracingPipelineDesc<'a> {
        RayTracingPipelineDesc {
            ray_gen: self.ray_gen,
            miss: self.miss,
            hit_groups: self.hit_groups,
            callable: self.callable,
            ray_gen_records: self.ray_gen_records,
            miss_records: self.miss_records,
            callable_records: self.callable_records,
            max_recursion: self.max_recursion,
            max_payload_bytes: self.max_payload_bytes,
            max_hit_attribute_bytes: self.max_hit_attribute_bytes,
            specialization: self.specialization,
            layouts: self.layouts,
            debug_name: self.debug_name,
            ..Default::default()
        }
    }
}

/// A ray tracing library, destroyed on drop.
pub(crate) struct RayTracingLibrary {
    code: LibraryCode,
    pub(crate) groups: CompiledGroups,
    pub(crate) name: Arc<str>,
    interface: LibraryInterface,
}

/// The shaders of a library.
enum LibraryCode {
    Compiled(CompiledLibrary),
    /// Shaders that are lowered with those of each pipeline.
    Lowered(LoweredPart),
}

/// A library of the device, destroyed on drop.
pub(super) struct CompiledLibrary {
    pub(super) raw: vk::Pipeline,
    /// A ray generation shader of the library.
    pub(super) ray_gen: Option<Arc<ShaderModule>>,
    gpu: Arc<Gpu>,
}

/// Values that must be equal in a library and the pipelines linked from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct LibraryInterface {
    recursion: u32,
    payload_bytes: u32,
    hit_attribute_bytes: u32,
}

impl LibraryInterface {
    fn from_desc(desc: &RayTracingPipelineDesc<'_>) -> Self {
        Self {
            recursion: desc.max_recursion,
            payload_bytes: desc.max_payload_bytes,
            hit_attribute_bytes: desc.max_hit_attribute_bytes,
        }
    }

    /// Returns the first difference from the interface of a pipeline: field name, pipeline's value, library's value.
    fn difference(&self, pipeline: &Self) -> Option<(&'static str, u32, u32)> {
        let fields = [
            ("max_recursion", pipeline.recursion, self.recursion),
            ("max_payload_bytes", pipeline.payload_bytes, self.payload_bytes),
            ("max_hit_attribute_bytes", pipeline.hit_attribute_bytes, self.hit_attribute_bytes),
        ];
        fields.into_iter().find(|(_, wanted, own)| wanted != own)
    }
}

impl RayTracingLibrary {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingLibraryDesc<'_>,
        find: ModuleLookup<'_>,
    ) -> Result<Self> {
        let name = desc.debug_name;
        gpu.check_ray_tracing_pipelines()?;
        if !gpu.caps.pipeline_libraries {
            return Err(gpu.unsupported(&format!("pipeline libraries, of which '{name}' is one")));
        }
        let desc = &desc.as_pipeline();
        check_interface(gpu, desc)?;
        let groups = ShaderGroups::collect(desc, find)?;
        if groups.infos.is_empty() {
            return Err(Error::usage(name, "a library needs at least one shader or hit group"));
        }
        let code = if gpu.caps.lowered_pipelines() {
            groups.check_sizes(desc)?;
            LibraryCode::Lowered(LoweredPart::new(desc, &groups)?)
        } else {
            LibraryCode::Compiled(CompiledLibrary::new(gpu, base, desc, &groups)?)
        };
        let interface = LibraryInterface::from_desc(desc);
        Ok(Self { code, groups: groups.list, name: name.into(), interface })
    }

    /// Returns the library of the device; `None` if the library is lowered with each pipeline.
    pub(super) fn compiled(&self) -> Option<&CompiledLibrary> {
        match &self.code {
            LibraryCode::Compiled(library) => Some(library),
            LibraryCode::Lowered(_) => None,
        }
    }

    /// Returns the shaders to lower; `None` if the device has compiled them.
    pub(super) fn lowered(&self) -> Option<&LoweredPart> {
        match &self.code {
            LibraryCode::Compiled(_) => None,
            LibraryCode::Lowered(part) => Some(part),
        }
    }

    /// Fails unless the pipeline has the interface of the library.
    pub(crate) fn check_interface(&self, pipeline: &RayTracingPipelineDesc<'_>) -> Result<()> {
        let Some((field, wanted, own)) = self.interface.difference(&LibraryInterface::from_desc(pipeline))
        else {
            return Ok(());
        };
        let message =
            format!("{field} is {wanted}, but {own} in the library '{}'; make them equal", self.name);
        Err(Error::usage(pipeline.debug_name, message))
    }
}

impl CompiledLibrary {
    fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingPipelineDesc<'_>,
        groups: &ShaderGroups,
    ) -> Result<Self> {
        let flags = vk::PipelineCreateFlags::LIBRARY_KHR;
        let raw = compile_groups(gpu, base, desc, groups, &LinkedLibraries::default(), flags)?;
        gpu.name(raw, desc.debug_name);
        let ray_gen = groups.modules.iter().find(|module| module.stage == ShaderStage::RayGen).cloned();
        Ok(Self { raw, ray_gen, gpu: Arc::clone(gpu) })
    }
}

impl Drop for CompiledLibrary {
    fn drop(&mut self) {
        // SAFETY: pipelines linked from the library hold it.
        let destroy = || unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
        with_shared_device_lock(self.gpu.caps.driver_id, destroy);
    }
}
