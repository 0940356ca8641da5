//! Pipelines as data, for creation, hot reload, and compilation without running.

use lvk::{
    ColorTarget, Context, DepthTest, Format, Holder, RenderPipelineDesc, RenderPipelineHandle,
    ShaderModuleHandle, ShaderStage,
};

use crate::app::render_target::RenderTarget;
use crate::pipelines::{SamplePipeline, SampleStage};

/// A pipeline that draws on a [`RenderTarget`], or on targets of another kind.
#[derive(Debug, Clone, Copy)]
pub struct RasterPipeline {
    /// The sample, whose folder of `shaders/` the stages lie in.
    pub sample: &'static str,
    /// For messages.
    pub name: &'static str,
    /// One for each part of the pipeline.
    pub stages: &'static [SampleStage],
    /// Formats of the colour targets.
    pub color: &'static [Format],
    /// Test against the depth target, if there is one.
    pub depth: Option<DepthTest>,
    /// Samples a pixel.
    pub samples: u32,
    /// As [`RenderPipelineDesc::view_mask`].
    pub view_mask: u32,
}

impl RasterPipeline {
    /// For a [`RenderTarget::flat`].
    #[must_use]
    pub const fn flat(sample: &'static str, name: &'static str, stages: &'static [SampleStage]) -> Self {
        let samples = RenderTarget::SAMPLES;
        Self { sample, name, stages, color: &[RenderTarget::COLOR], depth: None, samples, view_mask: 0 }
    }

    /// For a [`RenderTarget::with_depth`].
    #[must_use]
    pub const fn with_depth(
        sample: &'static str,
        name: &'static str,
        stages: &'static [SampleStage],
    ) -> Self {
        Self { depth: Some(RenderTarget::NEAREST), ..Self::flat(sample, name, stages) }
    }

    /// The pipeline as data, for compilation without a device.
    #[must_use]
    pub fn data(&self) -> SamplePipeline {
        SamplePipeline {
            name: self.name,
            stages: self.stages.to_vec(),
            color: self.color.to_vec(),
            depth: self.depth.map(|depth| depth.format),
        }
    }

    /// Compiles it.
    ///
    /// # Errors
    /// Those of its shaders, and what Vulkan answers.
    pub fn create(&self, ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
        self.create_with(ctx, &RenderPipelineDesc::default())
    }

    /// The same with the state that `desc` has beside stages and targets: culling, topology, vertices and so on.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_with(
        &self,
        ctx: &Context,
        desc: &RenderPipelineDesc<'_>,
    ) -> lvk::Result<Holder<RenderPipelineHandle>> {
        let modules = self.stages.iter().map(|stage| stage.create(ctx, self.sample));
        let modules = modules.collect::<lvk::Result<Vec<_>>>()?;
        let color: Vec<_> = self.color.iter().copied().map(ColorTarget::from).collect();
        let mut desc = RenderPipelineDesc {
            color: &color,
            depth: self.depth,
            samples: self.samples,
            view_mask: self.view_mask,
            debug_name: self.name,
            ..*desc
        };
        for (stage, module) in self.stages.iter().zip(&modules) {
            *module_of(&mut desc, stage.stage) = Some(**module);
        }
        ctx.create_render_pipeline(&desc)
    }
}

/// The field of a description that holds the module of a stage. A stage that does not rasterise goes to the field of the vertex
/// stage, where `lvk` refuses it by name.
fn module_of<'a>(
    desc: &'a mut RenderPipelineDesc<'_>,
    stage: ShaderStage,
) -> &'a mut Option<ShaderModuleHandle> {
    match stage {
        ShaderStage::Task => &mut desc.task,
        ShaderStage::Mesh => &mut desc.mesh,
        ShaderStage::TessControl => &mut desc.tess_control,
        ShaderStage::TessEval => &mut desc.tess_eval,
        ShaderStage::Geometry => &mut desc.geometry,
        ShaderStage::Fragment => &mut desc.fragment,
        _ => &mut desc.vertex,
    }
}
