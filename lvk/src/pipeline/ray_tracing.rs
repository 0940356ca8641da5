//! Ray tracing pipelines, each with its shader binding table.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;

use super::sbt::{SbtGroups, SbtLimits, SbtPlan, plan_sbt, sbt_buffer_bytes, write_sbt};
use super::shader_module::ShaderModule;
use super::stage::{Specialization, SpecializationConstant, stage};
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::Limits;
use crate::handle::ShaderModuleHandle;
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
    /// Bytes the group's shaders read through `shaderRecordEXT`.
    pub record: &'a [u8],
}

/// Describes a ray tracing pipeline. The order of the lists is the order of the shader binding table.
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
    /// Deepest nesting of `traceRayEXT`; 1 if hit and miss shaders trace no rays.
    pub max_recursion: u32,
    /// Values of specialization constants.
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
            max_recursion: 1,
            specialization: &[],
            debug_name: "ray tracing pipeline",
        }
    }
}

/// A ray tracing pipeline with its shader binding table, destroyed on drop.
pub(crate) struct RayTracingPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    pub(crate) name: Arc<str>,
    pub(crate) table: Arc<Buffer>,
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
pub(crate) struct TableContents {
    pub(crate) offset: u64,
    pub(crate) bytes: Vec<u8>,
}

impl RayTracingPipeline {
    /// Makes the pipeline; the caller uploads the table's contents.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        layout: vk::PipelineLayout,
        desc: &RayTracingPipelineDesc<'_>,
        find: &dyn Fn(ShaderModuleHandle) -> Result<Arc<ShaderModule>>,
    ) -> Result<(Self, TableContents)> {
        let name = desc.debug_name;
        let limits = &gpu.caps.limits;
        gpu.ray_tracing()?;
        if desc.ray_gen.is_empty() {
            return Err(Error::usage(
                name,
                "a ray tracing pipeline needs at least one ray generation shader",
            ));
        }
        if desc.max_recursion == 0 {
            return Err(Error::usage(name, "a recursion depth of 0 traces no ray; 1 is the least"));
        }
        check_limit(name, "recursion depth", desc.max_recursion.into(), limits.max_ray_recursion.into())?;
        let stages = Stages::collect(desc, find)?;
        let sbt_limits = sbt_limits(limits);
        let records: Vec<&[u8]> = desc.hit_groups.iter().map(|group| group.record).collect();
        let plan = plan_table(desc, &sbt_limits, &records)?;
        let table = new_table(gpu, name, sbt_buffer_bytes(&plan, sbt_limits.base_alignment))?;
        let base = table.address.next_multiple_of(sbt_limits.base_alignment.into());
        let raw = create(gpu, layout, desc, &stages)?;
        gpu.name(raw, name);
        let pipeline = Self {
            raw,
            push_constant_bytes: stages.push_constant_bytes(),
            name: name.into(),
            table: Arc::new(table),
            plan,
            base,
            gpu: Arc::clone(gpu),
        };
        let handles = pipeline.handles(stages.groups.len() as u32, limits.sbt_handle_bytes)?;
        let mut bytes = vec![0; pipeline.plan.bytes as usize];
        write_sbt(&pipeline.plan, &sbt_limits, &handles, &records, &mut bytes);
        let offset = base - pipeline.table.address;
        Ok((pipeline, TableContents { offset, bytes }))
    }

    fn handles(&self, group_count: u32, handle_bytes: u32) -> Result<Vec<u8>> {
        let bytes = group_count as usize * handle_bytes as usize;
        // SAFETY: the pipeline has these groups and the size is theirs.
        unsafe {
            self.gpu.ray_tracing()?.get_ray_tracing_shader_group_handles(self.raw, 0, group_count, bytes)
        }
        .map_err(Error::vulkan("vkGetRayTracingShaderGroupHandlesKHR"))
    }

    /// The table as a trace from ray generation shader `index` sees it.
    pub(crate) fn regions(&self, index: u32) -> Result<TraceRegions> {
        let region = |region: &super::sbt::SbtRegion| vk::StridedDeviceAddressRegionKHR {
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
        unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
    }
}

/// The modules of a pipeline, each once, and the groups made of them.
#[derive(Default)]
struct Stages {
    modules: Vec<Arc<ShaderModule>>,
    groups: Vec<vk::RayTracingShaderGroupCreateInfoKHR<'static>>,
    places: HashMap<ShaderModuleHandle, u32>,
}

type Find<'a> = &'a dyn Fn(ShaderModuleHandle) -> Result<Arc<ShaderModule>>;

impl Stages {
    /// Groups in the order of the table: ray generation, miss, hit, callable.
    fn collect(desc: &RayTracingPipelineDesc<'_>, find: Find<'_>) -> Result<Self> {
        let mut stages = Self::default();
        for handle in desc.ray_gen {
            stages.general(*handle, ShaderStage::RayGen, find)?;
        }
        for handle in desc.miss {
            stages.general(*handle, ShaderStage::Miss, find)?;
        }
        for group in desc.hit_groups {
            stages.hit_group(group, find)?;
        }
        for handle in desc.callable {
            stages.general(*handle, ShaderStage::Callable, find)?;
        }
        Ok(stages)
    }

    fn general(&mut self, handle: ShaderModuleHandle, stage: ShaderStage, find: Find<'_>) -> Result<()> {
        let place = self.place(Some(handle), stage, find)?;
        self.groups.push(group(vk::RayTracingShaderGroupTypeKHR::GENERAL).general_shader(place));
        Ok(())
    }

    fn hit_group(&mut self, desc: &HitGroup<'_>, find: Find<'_>) -> Result<()> {
        let kind = match desc.intersection {
            Some(_) => vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP,
            None => vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP,
        };
        let hit = group(kind)
            .closest_hit_shader(self.place(desc.closest_hit, ShaderStage::ClosestHit, find)?)
            .any_hit_shader(self.place(desc.any_hit, ShaderStage::AnyHit, find)?)
            .intersection_shader(self.place(desc.intersection, ShaderStage::Intersection, find)?);
        self.groups.push(hit);
        Ok(())
    }

    /// The place of a module among the stages; the same module takes one place.
    fn place(
        &mut self,
        handle: Option<ShaderModuleHandle>,
        stage: ShaderStage,
        find: Find<'_>,
    ) -> Result<u32> {
        let Some(handle) = handle else { return Ok(vk::SHADER_UNUSED_KHR) };
        let module = find(handle)?;
        module.check_stage(stage)?;
        let next = self.modules.len() as u32;
        let place = *self.places.entry(handle).or_insert(next);
        if place == next {
            self.modules.push(module);
        }
        Ok(place)
    }

    fn push_constant_bytes(&self) -> u32 {
        self.modules.iter().map(|module| module.reflection.push_constant_bytes).max().unwrap_or(0)
    }
}

fn group(kind: vk::RayTracingShaderGroupTypeKHR) -> vk::RayTracingShaderGroupCreateInfoKHR<'static> {
    vk::RayTracingShaderGroupCreateInfoKHR::default()
        .ty(kind)
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR)
}

fn sbt_limits(limits: &Limits) -> SbtLimits {
    SbtLimits {
        handle_bytes: limits.sbt_handle_bytes,
        handle_alignment: limits.sbt_handle_alignment,
        base_alignment: limits.sbt_base_alignment,
        max_stride: limits.sbt_max_stride,
    }
}

fn plan_table(desc: &RayTracingPipelineDesc<'_>, limits: &SbtLimits, records: &[&[u8]]) -> Result<SbtPlan> {
    let record_bytes: Vec<usize> = records.iter().map(|record| record.len()).collect();
    let groups = SbtGroups {
        ray_gen: desc.ray_gen.len() as u32,
        miss: desc.miss.len() as u32,
        hit_records: &record_bytes,
        callable: desc.callable.len() as u32,
    };
    plan_sbt(limits, &groups)
}

fn new_table(gpu: &Arc<Gpu>, name: &str, bytes: u64) -> Result<Buffer> {
    let desc = BufferDesc {
        size_bytes: bytes.max(1),
        usage: BufferUsage::empty(),
        debug_name: name,
        ..Default::default()
    };
    Buffer::new(gpu, &desc, InternalUsage::SHADER_BINDING_TABLE)
}

fn create(
    gpu: &Gpu,
    layout: vk::PipelineLayout,
    desc: &RayTracingPipelineDesc<'_>,
    stages: &Stages,
) -> Result<vk::Pipeline> {
    let modules = stages.modules.iter().map(|module| &**module);
    let constants = Specialization::new(desc.debug_name, desc.specialization, modules.clone())?;
    let constants = constants.info();
    let infos: Vec<_> = modules.map(|module| stage(module, &constants)).collect();
    let info = vk::RayTracingPipelineCreateInfoKHR::default()
        .stages(&infos)
        .groups(&stages.groups)
        .max_pipeline_ray_recursion_depth(desc.max_recursion)
        .layout(layout);
    // SAFETY: the modules and the layout are alive, and the recursion depth is within the limit.
    let made = unsafe {
        gpu.ray_tracing()?.create_ray_tracing_pipelines(
            vk::DeferredOperationKHR::null(),
            vk::PipelineCache::null(),
            &[info],
            None,
        )
    };
    Ok(made.map_err(|(_, result)| Error::vulkan("vkCreateRayTracingPipelinesKHR")(result))?[0])
}
