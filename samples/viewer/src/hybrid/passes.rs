//! Rays and filters of the real-time method.

use lvk::{BufferHandle, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder};

use crate::config::{Content, ViewerConfig};
use crate::gpu::FrameScene;
use crate::gpu::layout::{FRAME_LAYOUT, Push, SCENE_LAYOUTS};
use crate::launch::{RayStages, compute, groups};
use crate::path_pass::PathPass;
use crate::pipelines::{AMBIENT_OCCLUSION, ANTIALIAS, FILTER, LIGHT, STEPS, TEMPORAL};

/// Steps of the filter in space.
const FILTER_STEPS: u32 = 4;
/// Bit of the argument of the last step (`kLastStep` in `shaders/viewer/filter.comp.glsl`).
const LAST_STEP: u32 = 256;

/// The stages of the light of what pixels show.
fn light_stages(config: &ViewerConfig) -> &'static RayStages {
    if config.occludes_ambient() { &AMBIENT_OCCLUSION } else { &LIGHT }
}

/// The pipelines.
pub(crate) struct Passes {
    light: PathPass,
    temporal: Holder<ComputePipelineHandle>,
    filter: Holder<ComputePipelineHandle>,
    antialias: Holder<ComputePipelineHandle>,
    /// Where the picture is of steps.
    steps: Option<Holder<ComputePipelineHandle>>,
}

impl Passes {
    pub(crate) fn new(ctx: &Context, config: &ViewerConfig) -> lvk::Result<Self> {
        let is_of_steps = config.content == Content::Steps;
        let filter = |stage| compute(ctx, stage, FRAME_LAYOUT);
        Ok(Self {
            light: PathPass::new(ctx, config, light_stages(config))?,
            temporal: filter(TEMPORAL)?,
            filter: filter(FILTER)?,
            antialias: filter(ANTIALIAS)?,
            steps: is_of_steps.then(|| compute(ctx, STEPS, SCENE_LAYOUTS)).transpose()?,
        })
    }

    /// The launches of paths.
    pub(crate) fn light(&self) -> &PathPass {
        &self.light
    }

    /// True if the picture is of the steps of rays.
    pub(crate) fn counts_steps(&self) -> bool {
        self.steps.is_some()
    }

    /// Records the rays whose steps are counted. Their picture takes the place of the filters'.
    pub(crate) fn record_steps(
        &self,
        cmd: &mut CommandBuffer,
        push: &Push,
        planes: BufferHandle,
        scene: FrameScene<'_>,
        extent: [u32; 2],
    ) -> lvk::Result<()> {
        let Some(steps) = &self.steps else { return Ok(()) };
        cmd.bind_compute_pipeline(**steps)?;
        cmd.push_constants(push)?;
        let dependencies = Dependencies {
            buffers: &scene.buffers(&[planes]),
            read_buffers: scene.written,
            ..Dependencies::default()
        };
        cmd.dispatch(groups(extent), &dependencies)
    }

    /// Records the filters. `push` makes the constants of a pass from its argument.
    pub(crate) fn record_filters(
        &self,
        cmd: &mut CommandBuffer,
        push: impl Fn(u32) -> Push,
        planes: BufferHandle,
        extent: [u32; 2],
    ) -> lvk::Result<()> {
        let last = FILTER_STEPS - 1;
        let steps = (0..last).chain([last | LAST_STEP]).map(|argument| (&self.filter, argument));
        let all = [(&self.temporal, 0)].into_iter().chain(steps);
        for (pipeline, argument) in all.chain([(&self.antialias, last & 1)]) {
            cmd.bind_compute_pipeline(**pipeline)?;
            cmd.push_constants(&push(argument))?;
            cmd.dispatch(groups(extent), &Dependencies { buffers: &[planes], ..Dependencies::default() })?;
        }
        Ok(())
    }
}
