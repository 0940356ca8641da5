//! Ray tracing pipelines that are lowered to compute pipelines, one for each ray generation shader.

use std::sync::Arc;

use ash::vk;

use super::compute::{ComputePipeline, ComputePipelineDesc};
use super::lowered_groups::{LinkedGroups, LoweredPart, link};
use super::pipeline_layout::PipelineBase;
use super::ray_tracing_desc::RayTracingPipelineDesc;
use super::sbt::SbtPlan;
use super::shader_module::ShaderModule;
use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::capabilities::Capabilities;
use crate::gpu::caps::ray_tracing_pipeline_path::RayTracingPipelinePath;
use crate::parallel::parallel_map;
use crate::shader::spirv::lower::{Lowering, StageModule, Traversal, lower};

/// The compute pipelines of a lowered ray tracing pipeline.
pub(crate) struct LoweredPipeline {
    /// In the order of the ray generation shaders.
    shaders: Vec<Arc<ComputePipeline>>,
}

impl LoweredPipeline {
    /// Lowers the shaders of all parts, and compiles the results. `plan` is the table of their records.
    pub(super) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RayTracingPipelineDesc<'_>,
        parts: &[&LoweredPart],
        plan: &SbtPlan,
    ) -> Result<Self> {
        cpu_scope!("lower ray tracing pipeline");
        check_regions(desc.debug_name, plan)?;
        let linked = link(parts, Arc::ptr_eq);
        let modules = stage_modules(desc.debug_name, &linked)?;
        let job = LoweringJob { gpu, base, desc, linked: &linked, modules: &modules, plan };
        let ray_gens = linked.distinct_ray_gens();
        let made: Vec<Result<Arc<ComputePipeline>>> = match base.max_threads {
            0 | 1 => ray_gens.iter().map(|ray_gen| job.compile(*ray_gen)).collect(),
            _ => parallel_map(&ray_gens, |ray_gen| job.compile(*ray_gen)),
        };
        let made = made.into_iter().collect::<Result<Vec<_>>>()?;
        let pipeline_of = |ray_gen: &usize| {
            let place = ray_gens.iter().position(|other| other == ray_gen)?;
            made.get(place).map(Arc::clone)
        };
        Ok(Self { shaders: linked.ray_gen.iter().filter_map(pipeline_of).collect() })
    }

    /// Returns the compute pipeline of ray generation shader `index`; `None` beyond the last.
    pub(crate) fn shader(&self, index: u32) -> Option<&Arc<ComputePipeline>> {
        self.shaders.get(index as usize)
    }
}

/// Inputs of the lowering that all ray generation shaders of a pipeline share.
struct LoweringJob<'a> {
    gpu: &'a Arc<Gpu>,
    base: PipelineBase,
    desc: &'a RayTracingPipelineDesc<'a>,
    linked: &'a LinkedGroups<'a, Arc<ShaderModule>>,
    modules: &'a [StageModule<'a>],
    plan: &'a SbtPlan,
}

impl LoweringJob<'_> {
    /// Lowers the pipeline for one ray generation shader, an index in `modules`.
    fn compile(&self, ray_gen: usize) -> Result<Arc<ComputePipeline>> {
        let Self { gpu, desc, linked, plan, .. } = self;
        let lowering = Lowering {
            traversal: traversal(&gpu.caps),
            is_for_swiftshader: gpu.caps.driver_id == vk::DriverId::GOOGLE_SWIFTSHADER,
            modules: self.modules,
            ray_gen,
            miss: &linked.miss,
            hit: &linked.hit,
            callable: &linked.callable,
            strides: [&plan.miss, &plan.hit, &plan.callable].map(|region| region.stride as u32),
            push_constant_bytes: linked.push_constant_bytes(),
            launch_offset: launch_offset(self.base.push_constant_bytes),
            max_recursion: desc.max_recursion,
            max_callable_depth: desc.max_callable_depth,
        };
        let words = lower(&lowering).map_err(|error| Error::Lowering {
            pipeline: desc.debug_name.to_owned(),
            shader: error.shader,
            why: error.message,
        })?;
        #[cfg(any(test, feature = "test-hooks"))]
        crate::test_support::kept_modules::write_module(&words);
        let name = self.name_of(ray_gen);
        let module = ShaderModule::from_lowered(gpu, &name, &words)?;
        let compute = ComputePipelineDesc { debug_name: &name, ..Default::default() };
        Ok(Arc::new(ComputePipeline::new(gpu, self.base, &compute, &module)?))
    }

    /// Returns the debug name: that of the pipeline, with the ray generation shader if there are several.
    fn name_of(&self, ray_gen: usize) -> String {
        match (self.linked.ray_gen.as_slice(), self.modules.get(ray_gen)) {
            ([_, _, ..], Some(module)) => format!("{}, {}", self.desc.debug_name, module.name),
            _ => self.desc.debug_name.to_owned(),
        }
    }
}

/// Returns the offset of the launch's address in push constants of `bytes`: the address comes last.
pub(crate) fn launch_offset(bytes: u32) -> u32 {
    bytes.saturating_sub(size_of::<u64>() as u32)
}

/// Fails unless shaders can compute the place of each record, which they do in 32 bits.
fn check_regions(pipeline: &str, plan: &SbtPlan) -> Result<()> {
    let names =
        ["bytes of miss shader records", "bytes of hit group records", "bytes of callable shader records"];
    let mut regions = names.into_iter().zip([&plan.miss, &plan.hit, &plan.callable]);
    regions.try_for_each(|(what, region)| check_limit(pipeline, what, region.size, u32::MAX.into()))
}

/// Returns the traversal of lowered pipelines.
fn traversal(device: &Capabilities) -> Traversal {
    match device.ray_tracing_pipeline_path {
        RayTracingPipelinePath::Query => Traversal::Query,
        _ if device.has_fast_64_bit_loads() => Traversal::SoftwareCpuPairs,
        _ if device.is_cpu => Traversal::SoftwareCpu,
        _ => Traversal::SoftwareGpu,
    }
}

/// Returns the shaders for the lowering.
fn stage_modules<'a>(
    pipeline: &str,
    linked: &LinkedGroups<'a, Arc<ShaderModule>>,
) -> Result<Vec<StageModule<'a>>> {
    let stage_module = |(module, specialization): &(&'a Arc<ShaderModule>, &'a [(u32, u64)])| {
        let Some(words) = &module.words else {
            let message = format!("shader '{}' was made for a device with pipelines of its own", module.name);
            return Err(Error::usage(pipeline, message));
        };
        Ok(StageModule { name: &module.name, stage: module.stage, words, specialization })
    };
    linked.modules.iter().map(stage_module).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::sbt::SbtRegion;

    #[test]
    fn regions_that_32_bits_do_not_address_are_refused() {
        let plan = |size| SbtPlan { hit: SbtRegion { offset: 64, stride: 4096, size }, ..SbtPlan::default() };
        check_regions("p", &plan((1 << 32) - 4096)).unwrap();
        let error = check_regions("p", &plan(1 << 32)).unwrap_err();
        let is_told = matches!(
            error,
            Error::LimitExceeded { what: "bytes of hit group records", limit: 0xffff_ffff, .. }
        );
        assert!(is_told, "{error}");
    }
}
