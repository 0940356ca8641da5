//! Ray tracing pipelines, each with its shader binding table.

use std::sync::Arc;

use ash::vk;

use super::pipeline_layout::PipelineBase;
use super::ray_tracing_compile::{LinkedLibraries, check_interface, compile_groups};
use super::ray_tracing_desc::RayTracingPipelineDesc;
use super::ray_tracing_library::RayTracingLibrary;
use super::ray_tracing_stack::StackSizes;
use super::sbt::{GroupHandles, SbtLimits, SbtPlan, SbtRegion, plan_sbt, sbt_buffer_bytes, write_sbt};
use super::sbt_order::{PerRegion, sbt_order};
use super::shader_groups::{CompiledGroups, ShaderGroups};
use super::shader_module::ModuleLookup;
use crate::cpu_scope::cpu_scope;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit_of};
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::gpu::start::driver_workarounds::with_shared_device_lock;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::shader::ShaderStage;

/// A ray tracing pipeline with its shader binding table, destroyed on drop.
pub(crate) struct RayTracingPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    /// Stack size of one ray, in bytes.
    pub(crate) stack_bytes: u32,
    pub(crate) name: Arc<str>,
    pub(crate) table: Arc<Buffer>,
    _libraries: Vec<Arc<RayTracingLibrary>>,
    plan: SbtPlan,
    /// Address of the first region: the address of the table's buffer, rounded up to the base alignment.
    base: u64,
    gpu: Arc<Gpu>,
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
        let ext = gpu.ray_tracing_functions()?;
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
        let raw = compile_groups(
            gpu,
            base,
            desc,
            &groups,
            &linked_libraries(libraries),
            vk::PipelineCreateFlags::empty(),
        )?;
        gpu.name(raw, name);
        let mut pipeline = Self {
            raw,
            push_constant_bytes: parts.iter().map(|part| part.push_constant_bytes).max().unwrap_or(0),
            stack_bytes: 0,
            name: name.into(),
            base: table.address.next_multiple_of(limits.base_alignment.into()),
            table: Arc::new(table),
            plan,
            gpu: Arc::clone(gpu),
            _libraries: libraries.to_vec(),
        };
        pipeline.set_stack_size(stack_sizes(ext, raw, &parts), desc)?;
        let order = sbt_order(&counts);
        let handles = pipeline.handles(order.len() as u32, limits.handle_bytes)?;
        let mut bytes = vec![0; pipeline.plan.bytes as usize];
        let handles = GroupHandles { bytes: &handles, order: &order };
        write_sbt(&pipeline.plan, &limits, &handles, &records, &mut bytes);
        let offset = pipeline.base - pipeline.table.address;
        Ok((pipeline, SbtContents { offset, bytes }))
    }

    fn set_stack_size(&mut self, sizes: StackSizes, desc: &RayTracingPipelineDesc<'_>) -> Result<()> {
        let bytes = sizes.pipeline_bytes(desc.max_recursion, desc.max_callable_depth);
        let what = "stack of one ray in bytes (max_recursion, max_callable_depth)";
        check_limit_of(LimitOrigin::Vulkan, &self.name, what, bytes, u32::MAX.into())?;
        self.stack_bytes = bytes as u32;
        Ok(())
    }

    fn handles(&self, group_count: u32, handle_bytes: u32) -> Result<Vec<u8>> {
        let bytes = group_count as usize * handle_bytes as usize;
        // SAFETY: the pipeline has these groups, and the size is that of their handles.
        unsafe {
            self.gpu.ray_tracing_functions()?.get_ray_tracing_shader_group_handles(
                self.raw,
                0,
                group_count,
                bytes,
            )
        }
        .map_err(Error::vulkan("vkGetRayTracingShaderGroupHandlesKHR", &self.name))
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

impl Drop for RayTracingPipeline {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pipeline.
        let destroy = || unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
        with_shared_device_lock(self.gpu.caps.driver_id, destroy);
    }
}

fn linked_libraries(libraries: &[Arc<RayTracingLibrary>]) -> LinkedLibraries {
    LinkedLibraries {
        raw: libraries.iter().map(|library| library.raw).collect(),
        ray_gen: libraries.iter().find_map(|library| library.ray_gen.clone()),
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

/// Returns the largest stack size of each kind of shader. Only shaders that a group contains are queried.
fn stack_sizes(
    ext: &ash::khr::ray_tracing_pipeline::Device,
    pipeline: vk::Pipeline,
    parts: &[&CompiledGroups],
) -> StackSizes {
    let mut sizes = StackSizes::default();
    let mut first = 0;
    for part in parts {
        for (group, stage) in &part.shaders {
            let shader = match stage {
                ShaderStage::ClosestHit => vk::ShaderGroupShaderKHR::CLOSEST_HIT,
                ShaderStage::AnyHit => vk::ShaderGroupShaderKHR::ANY_HIT,
                ShaderStage::Intersection => vk::ShaderGroupShaderKHR::INTERSECTION,
                _ => vk::ShaderGroupShaderKHR::GENERAL,
            };
            // SAFETY: the pipeline has the group, and the group has the shader.
            let bytes =
                unsafe { ext.get_ray_tracing_shader_group_stack_size(pipeline, first + group, shader) };
            sizes.add(*stage, bytes);
        }
        first += part.len() as u32;
    }
    sizes
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
    let desc = BufferDesc {
        size_bytes: bytes.max(1),
        usage: BufferUsage::empty(),
        debug_name: name,
        ..Default::default()
    };
    Buffer::new(gpu, &desc, InternalUsage::SHADER_BINDING_TABLE)
}
