//! Launches of random pipelines on the GPU.

use lvk::{
    Capabilities, Context, Dependencies, HitGroup, Holder, RayTracingPipelineDesc, Result, ShaderModuleDesc,
    ShaderModuleHandle, ShaderRecord, ShaderSource, ShaderStage, compile_glsl,
};
use lvk_tests::compute::{read_words, words_buffer};

use super::LAUNCHES;
use super::glsl;
use super::interpreter::record;
use super::optimised::{optimised, optimiser};
use super::program::{MAX_CALLABLE_DEPTH, MAX_DEPTH, Pipeline};
use super::scene::{GROUP_BEHIND, LAYERS, Scene};

/// A shader of a pipeline.
pub struct Module {
    stage: ShaderStage,
    text: String,
    /// Words that passes have made, and the names of the passes.
    optimised: Option<(Vec<u32>, String)>,
}

impl Module {
    /// Returns the text of the functions, and what became of them.
    pub fn description(&self) -> String {
        let passes = self.optimised.as_ref().map_or("", |(_, passes)| passes);
        let (_, functions) = self.text.split_once(glsl::FUNCTIONS).unwrap_or_default();
        format!("// {:?} {passes}\n{functions}", self.stage)
    }

    fn create(&self, ctx: &Context) -> Result<Holder<ShaderModuleHandle>> {
        let source = match &self.optimised {
            Some((words, _)) => ShaderSource::Spirv(words),
            None => ShaderSource::Glsl(&self.text),
        };
        ctx.create_shader_module(&ShaderModuleDesc { stage: self.stage, source, ..Default::default() })
    }
}

/// Returns the shaders of a pipeline in the order of [`Pipeline::shaders_mut`]. With a number, every second one is optimised.
pub fn modules(ctx: &Context, pipeline: &Pipeline, number: Option<u64>) -> Result<Vec<Module>> {
    let mut copy = pipeline.clone();
    let shaders = copy.shaders_mut();
    let modules = (0..).zip(shaders).map(|(index, (stage, is_procedural, shader))| {
        let text = glsl::text(pipeline, shader, stage, is_procedural);
        let (program, number) = (optimiser(), number.filter(|number| (number + index) % 2 == 1));
        let mut module = Module { stage, text, optimised: None };
        if let (Some(program), Some(number)) = (program, number) {
            let source = ShaderSource::Glsl(&module.text);
            let desc = ShaderModuleDesc { stage, source, ..Default::default() };
            // Debian's optimiser does not know the capability for positions of triangles.
            let capabilities = Capabilities { position_fetch: false, ..ctx.capabilities().clone() };
            let words = compile_glsl(&desc, &capabilities)?;
            let of_module = number.wrapping_mul(64).wrapping_add(index);
            let done = optimised(&program, of_module, words);
            module.optimised = Some(done.unwrap_or_else(|error| (Vec::new(), error.to_string())));
        }
        Ok(module)
    });
    modules.collect()
}

/// Returns the results of all invocations on the GPU.
pub fn launch(ctx: &Context, scene: &Scene, pipeline: &Pipeline, number: Option<u64>) -> Result<Vec<u32>> {
    let results = words_buffer(ctx, &vec![u32::MAX; LAUNCHES as usize]);
    let modules = modules(ctx, pipeline, number)?;
    let holders: Vec<_> = modules.iter().map(|module| module.create(ctx)).collect::<Result<_>>()?;
    let handles: Vec<ShaderModuleHandle> = holders.iter().map(|holder| **holder).collect();
    let of = |stage: ShaderStage| -> Vec<ShaderModuleHandle> {
        let all = modules.iter().zip(&handles).filter(|(module, _)| module.stage == stage);
        all.map(|(_, handle)| *handle).collect()
    };
    let words =
        |kind: u32, count: usize| (0..count).map(|index| [0xEE, record(kind, index)]).collect::<Vec<_>>();
    let counts = [1, pipeline.misses.len(), GROUP_BEHIND + LAYERS - 1, pipeline.callables.len()];
    let tags: Vec<_> = (0..).zip(counts).map(|(kind, count)| words(kind, count)).collect();
    let records = |kind: usize| -> Vec<ShaderRecord<'_>> {
        tags[kind].iter().map(|words| ShaderRecord::from_bytes(bytemuck::bytes_of(words))).collect()
    };
    let groups = groups(pipeline, &of, records(2));
    let made = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &of(ShaderStage::RayGen),
        miss: &of(ShaderStage::Miss),
        hit_groups: &groups,
        callable: &of(ShaderStage::Callable),
        ray_gen_records: &records(0),
        miss_records: &records(1),
        callable_records: &records(3),
        max_recursion: MAX_DEPTH,
        max_callable_depth: MAX_CALLABLE_DEPTH,
        ..Default::default()
    })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_ray_tracing_pipeline(*made)?;
    scene.push_constants(
        &mut cmd,
        ctx.buffer_address(*results)?,
        [pipeline.hits.len(), pipeline.misses.len()],
    )?;
    cmd.trace_rays([LAUNCHES, 1, 1], &Dependencies { buffers: &[*results], ..Default::default() })?;
    ctx.submit(cmd)?;
    Ok(read_words(ctx, *results, LAUNCHES as usize))
}

/// Returns the hit groups with their records: those of targets, those behind, and empty ones between.
fn groups<'a>(
    pipeline: &Pipeline,
    of: &dyn Fn(ShaderStage) -> Vec<ShaderModuleHandle>,
    records: Vec<ShaderRecord<'a>>,
) -> Vec<HitGroup<'a>> {
    let [mut closest, mut any, mut intersection] =
        [ShaderStage::ClosestHit, ShaderStage::AnyHit, ShaderStage::Intersection]
            .map(|stage| of(stage).into_iter());
    let mut all: Vec<_> =
        records.into_iter().map(|record| HitGroup { record, ..Default::default() }).collect();
    let behind = pipeline.behind.iter().map(|group| (GROUP_BEHIND, group));
    for (index, group) in pipeline.hits.iter().enumerate().chain(behind) {
        all[index].closest_hit = closest.next();
        all[index].any_hit = group.any_hit.as_ref().and_then(|_| any.next());
        all[index].intersection = group.intersection.as_ref().and_then(|_| intersection.next());
    }
    all
}
