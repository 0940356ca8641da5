//! Ray tracing pipelines, each with its shader binding table.

use std::sync::Arc;

use ash::vk;

use super::lowered::LoweredPipeline;
use super::lowered_groups::LoweredPart;
use super::pipeline_layout::PipelineBase;
use super::ray_tracing_compile::check_interface;
use super::ray_tracing_desc::RayTracingPipelineDesc;
use super::ray_tracing_hardware::HardwarePipeline;
use super::ray_tracing_library::RayTracingLibrary;
use super::sbt::{GroupHandles, SbtLimits, SbtPlan, SbtRegion, plan_sbt, sbt_buffer_bytes, write_sbt};
use super::sbt_order::{PerRegion, sbt_order};
use super::shader_groups::{CompiledGroups, ShaderGroups};
use super::shader_module::ModuleLookup;
use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

/// A ray tracing pipeline with its shader binding table, destroyed on drop.
pub(crate) struct RayTracingPipeline {
    pub(crate) code: PipelineCode,
    pub(crate) push_constant_bytes: u32,
    pub(crate) name: Arc<str>,
    pub(crate) table: Arc<Buffer>,
    plan: SbtPlan,
    /// Address of the first region: the address of the table's buffer, rounded up to the base alignment.
    base: u64,
}

/// The compiled shaders of a pipeline.
pub(crate) enum PipelineCode {
    /// A pipeline of the device.
    Hardware(HardwarePipeline),
    /// Compute shaders that the library made of the shaders. The table holds records without handles.
    Lowered(LoweredPipeline),
}

/// Regions of the shader binding table that a trace passes to Vulkan.
pub(crate) struct TraceRegions {
    pub(crate) ray_gen: vk::StridedDeviceAddressRegionKHR,
    pub(crate) miss: vk::StridedDeviceAddressRegionKHR,
    pub(crate) hit: vk::StridedDeviceAddressRegionKHR,
    pub(crate) callable: vk::StridedDeviceAddressRegionKHR,
}

/// Contents of a new pipeline's shader binding table, and their offset in the buffer.
pub(crate) struct SbtContents {
    pub(crate) offset: u64,
    pub(crate) bytes: Vec<u8>,
}

impl RayTracingPipeline {
    /// Creates the pipeline. The caller uploads the contents of the shader binding table.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingPipelineDesc<'_>,
        find: ModuleLookup<'_>,
        libraries: &[Arc<RayTracingLibrary>],
    ) -> Result<(Self, SbtContents)> {
        cpu_scope!("create ray tracing pipeline");
        let name = desc.debug_name;
        gpu.check_ray_tracing_pipelines()?;
        check_interface(gpu, desc)?;
        libraries.iter().try_for_each(|library| library.check_interface(desc))?;
        let groups = ShaderGroups::collect(desc, find)?;
        let parts: Vec<&CompiledGroups> =
            std::iter::once(&groups.list).chain(libraries.iter().map(|library| &library.groups)).collect();
        let counts: Vec<PerRegion<usize>> = parts.iter().map(|part| part.counts()).collect();
        if counts.iter().all(|counts| counts.ray_gen == 0) {
            let message = "a ray tracing pipeline needs at least one ray generation shader";
            return Err(Error::usage(name, message));
        }
        let limits = sbt_limits(&gpu.caps.limits);
        let records = linked_records(&parts);
        let plan = plan_sbt(name, &limits, &records)?;
        let table = create_sbt_buffer(gpu, name, sbt_buffer_bytes(&plan, limits.base_alignment))?;
        let code = PipelineCode::new(gpu, base, desc, &groups, libraries, &plan)?;
        let order = sbt_order(&counts);
        let handles = match &code {
            PipelineCode::Hardware(pipeline) => {
                pipeline.handles(name, order.len() as u32, limits.handle_bytes)?
            }
            PipelineCode::Lowered(_) => Vec::new(),
        };
        let mut bytes = vec![0; plan.bytes as usize];
        write_sbt(&plan, &limits, &GroupHandles { bytes: &handles, order: &order }, &records, &mut bytes);
        let start = table.address.next_multiple_of(limits.base_alignment.into());
        let offset = start - table.address;
        let pipeline = Self {
            code,
            push_constant_bytes: parts.iter().map(|part| part.push_constant_bytes).max().unwrap_or(0),
            name: name.into(),
            base: start,
            table: Arc::new(table),
            plan,
        };
        Ok((pipeline, SbtContents { offset, bytes }))
    }

    /// Returns the stack size of one ray in bytes; 0 if the pipeline is lowered.
    pub(crate) fn stack_bytes(&self) -> u32 {
        match &self.code {
            PipelineCode::Hardware(pipeline) => pipeline.stack_bytes,
            PipelineCode::Lowered(_) => 0,
        }
    }

    /// Returns the regions of the shader binding table for a trace from ray generation shader `index`.
    pub(crate) fn trace_regions(&self, index: u32) -> Result<TraceRegions> {
        let region = |region: &SbtRegion| vk::StridedDeviceAddressRegionKHR {
            device_address: if region.size == 0 { 0 } else { self.base + region.offset },
            stride: region.stride,
            size: region.size,
        };
        let Some(ray_gen) = self.plan.ray_gen.get(index as usize) else {
            let count = self.plan.ray_gen.len();
            let message = format!("ray generation shader {index} does not exist: the pipeline has {count}");
            return Err(Error::usage(&*self.name, message));
        };
        Ok(TraceRegions {
            ray_gen: region(ray_gen),
            miss: region(&self.plan.miss),
            hit: region(&self.plan.hit),
            callable: region(&self.plan.callable),
        })
    }
}

impl PipelineCode {
    /// Compiles the groups of a pipeline and of its libraries.
    fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingPipelineDesc<'_>,
        groups: &ShaderGroups,
        libraries: &[Arc<RayTracingLibrary>],
        plan: &SbtPlan,
    ) -> Result<Self> {
        if !gpu.caps.lowered_pipelines() {
            return Ok(Self::Hardware(HardwarePipeline::new(gpu, base, desc, groups, libraries)?));
        }
        if !libraries.is_empty() {
            groups.check_sizes(desc)?;
        }
        let own = LoweredPart::new(desc, groups)?;
        let of_libraries = libraries.iter().filter_map(|library| library.lowered());
        let parts: Vec<&LoweredPart> = std::iter::once(&own).chain(of_libraries).collect();
        Ok(Self::Lowered(LoweredPipeline::new(gpu, base, desc, &parts, plan)?))
    }
}

/// Returns the shader records of all parts of a pipeline, in the order of the shader binding table.
fn linked_records<'a>(parts: &[&'a CompiledGroups]) -> PerRegion<Vec<&'a [u8]>> {
    let of = |region: fn(&CompiledGroups) -> &Vec<Box<[u8]>>| {
        parts.iter().flat_map(|part| region(part)).map(|record| &**record).collect()
    };
    PerRegion {
        ray_gen: of(|part| &part.records.ray_gen),
        miss: of(|part| &part.records.miss),
        hit: of(|part| &part.records.hit),
        callable: of(|part| &part.records.callable),
    }
}

fn sbt_limits(limits: &Limits) -> SbtLimits {
    SbtLimits {
        handle_bytes: limits.sbt_handle_bytes,
        handle_alignment: limits.sbt_handle_alignment,
        base_alignment: limits.sbt_base_alignment,
        max_stride: limits.sbt_max_stride,
    }
}

fn create_sbt_buffer(gpu: &Arc<Gpu>, name: &str, bytes: u64) -> Result<Buffer> {
    let (usage, internal) = match gpu.caps.lowered_pipelines() {
        true => (BufferUsage::STORAGE, InternalUsage::NONE),
        false => (BufferUsage::empty(), InternalUsage::SHADER_BINDING_TABLE),
    };
    let desc = BufferDesc { size_bytes: bytes.max(1), usage, debug_name: name, ..Default::default() };
    Buffer::new(gpu, &desc, internal)
}
