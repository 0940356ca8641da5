//! Ray tracing pipelines, each with its shader binding table.

use std::sync::Arc;

use ash::vk;

use super::deferred_operation::compile;
use super::pipeline_layout::PipelineBase;
use super::ray_tracing_library::RayTracingLibrary;
use super::ray_tracing_stack::StackSizes;
use super::sbt::{GroupHandles, SbtLimits, SbtPlan, SbtRegion, plan_sbt, sbt_buffer_bytes, write_sbt};
use super::sbt_order::{PerRegion, sbt_order};
use super::shader_groups::{CompiledGroups, ModuleLookup, ShaderGroups};
use super::shader_module::ShaderModule;
use super::stage::{Specialization, SpecializationConstant, stage_info};
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::gpu::start::driver_workarounds::with_shared_device_lock;
use crate::handle::{RayTracingLibraryHandle, ShaderModuleHandle};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::shader::ShaderStage;

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

/// A ray tracing pipeline with its shader binding table, destroyed on drop.
pub(crate) struct RayTracingPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    /// What a trace needs for each ray.
    pub(crate) stack_bytes: u32,
    pub(crate) name: Arc<str>,
    pub(crate) table: Arc<Buffer>,
    _libraries: Vec<Arc<RayTracingLibrary>>,
    plan: SbtPlan,
    /// Address of the first region: the table's, rounded up.
    base: u64,
    gpu: Arc<Gpu>,
}

/// What a trace passes to Vulkan.
pub(crate) struct TraceRegions {
    pub(crate) ray_gen: vk::StridedDeviceAddressRegionKHR,
    pub(crate) miss: vk::StridedDeviceAddressRegionKHR,
    pub(crate) hit: vk::StridedDeviceAddressRegionKHR,
    pub(crate) callable: vk::StridedDeviceAddressRegionKHR,
}

/// The bytes to put into a new pipeline's table, and where.
pub(crate) struct SbtContents {
    pub(crate) offset: u64,
    pub(crate) bytes: Vec<u8>,
}

impl RayTracingPipeline {
    /// Makes the pipeline; the caller uploads the table's contents.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingPipelineDesc<'_>,
        find: ModuleLookup<'_>,
        libraries: &[Arc<RayTracingLibrary>],
    ) -> Result<(Self, SbtContents)> {
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
        let raw = compile_groups(gpu, base, desc, &groups, libraries, vk::PipelineCreateFlags::empty())?;
        gpu.name(raw, name);
        let pipeline = Self {
            raw,
            push_constant_bytes: parts.iter().map(|part| part.push_constant_bytes).max().unwrap_or(0),
            stack_bytes: stack_sizes(ext, raw, &parts)
                .pipeline_bytes(desc.max_recursion, desc.max_callable_depth),
            name: name.into(),
            base: table.address.next_multiple_of(limits.base_alignment.into()),
            table: Arc::new(table),
            plan,
            gpu: Arc::clone(gpu),
            _libraries: libraries.to_vec(),
        };
        let order = sbt_order(&counts);
        let handles = pipeline.handles(order.len() as u32, limits.handle_bytes)?;
        let mut bytes = vec![0; pipeline.plan.bytes as usize];
        let handles = GroupHandles { bytes: &handles, order: &order };
        write_sbt(&pipeline.plan, &limits, &handles, &records, &mut bytes);
        let offset = pipeline.base - pipeline.table.address;
        Ok((pipeline, SbtContents { offset, bytes }))
    }

    fn handles(&self, group_count: u32, handle_bytes: u32) -> Result<Vec<u8>> {
        let bytes = group_count as usize * handle_bytes as usize;
        // SAFETY: the pipeline has these groups and the size is theirs.
        unsafe {
            self.gpu.ray_tracing_functions()?.get_ray_tracing_shader_group_handles(
                self.raw,
                0,
                group_count,
                bytes,
            )
        }
        .map_err(Error::vulkan("vkGetRayTracingShaderGroupHandlesKHR"))
    }

    /// The table as a trace from ray generation shader `index` sees it.
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

/// Fails unless the device takes the depth of recursion, and what libraries have to agree on.
pub(super) fn check_interface(gpu: &Gpu, desc: &RayTracingPipelineDesc<'_>) -> Result<()> {
    let (name, limits) = (desc.debug_name, &gpu.caps.limits);
    if desc.max_recursion == 0 {
        return Err(Error::usage(name, "a recursion depth of 0 traces no ray; 1 is the least"));
    }
    check_limit(name, "recursion depth", desc.max_recursion.into(), limits.max_ray_recursion.into())?;
    let attributes = desc.max_hit_attribute_bytes.into();
    check_limit(name, "hit attributes in bytes", attributes, limits.max_hit_attribute_bytes.into())
}

/// Compiles groups as a pipeline that is linked with `libraries`, or as a library, as `flags` say.
pub(super) fn compile_groups(
    gpu: &Gpu,
    base: PipelineBase,
    desc: &RayTracingPipelineDesc<'_>,
    groups: &ShaderGroups,
    libraries: &[Arc<RayTracingLibrary>],
    flags: vk::PipelineCreateFlags,
) -> Result<vk::Pipeline> {
    let modules = groups.modules.iter().map(|module| &**module);
    let constants = Specialization::new(desc.debug_name, desc.specialization, modules.clone())?;
    let constants = constants.info();
    let stand_in = placeholder_stage(gpu, groups, libraries);
    let modules = modules.chain(stand_in.as_deref());
    let stages: Vec<_> = modules.map(|module| stage_info(module, &constants)).collect();
    let dynamic = [vk::DynamicState::RAY_TRACING_PIPELINE_STACK_SIZE_KHR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let libraries: Vec<_> = libraries.iter().map(|library| library.raw).collect();
    let linked = vk::PipelineLibraryCreateInfoKHR::default().libraries(&libraries);
    let interface = vk::RayTracingPipelineInterfaceCreateInfoKHR::default()
        .max_pipeline_ray_payload_size(desc.max_payload_bytes)
        .max_pipeline_ray_hit_attribute_size(desc.max_hit_attribute_bytes);
    let mut info = vk::RayTracingPipelineCreateInfoKHR::default()
        .flags(flags)
        .stages(&stages)
        .groups(&groups.infos)
        .max_pipeline_ray_recursion_depth(desc.max_recursion)
        .dynamic_state(&dynamic)
        .layout(base.layout);
    if flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR) || !libraries.is_empty() {
        groups.check_sizes(desc)?;
        info = info.library_info(&linked).library_interface(&interface);
    }
    // SAFETY: modules, layout and libraries are alive, the recursion depth is within the limit, and the libraries
    // were made with the same layout and agree on the interface.
    unsafe { compile(gpu, base.cache, &info) }
}

/// A stage in no group, for lavapipe: it hands push constants only to pipelines that were given a ray generation shader
/// outside of their libraries.
fn placeholder_stage(
    gpu: &Gpu,
    groups: &ShaderGroups,
    libraries: &[Arc<RayTracingLibrary>],
) -> Option<Arc<ShaderModule>> {
    if gpu.caps.driver_name != "llvmpipe" || groups.list.counts().ray_gen > 0 {
        return None;
    }
    libraries.iter().find_map(|library| library.ray_gen.clone())
}

/// The records of all parts of a pipeline, as its table has them.
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

/// What every shader of the pipeline needs; asks of no shader that a group does not have.
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
