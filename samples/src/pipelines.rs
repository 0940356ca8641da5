//! Every pipeline of the samples as data, for programs that compile them without running them.

use lvk::{
    BlockLayout, ComputePipelineDesc, ComputePipelineHandle, Context, Format, Holder, ShaderModuleDesc,
    ShaderModuleHandle, ShaderSource, ShaderStage,
};

use crate::catalogue;
use crate::shader_folder::create_module;
use crate::shaders::INCLUDES;

/// The stage whose GLSL is `shaders/<sample>/<name>.glsl`; its name says the kind of the stage, as in `sky.frag`.
macro_rules! shader {
    ($sample:literal, $name:literal) => {
        $crate::pipelines::SampleStage::from_glsl(
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../shaders/", $sample, "/", $name, ".glsl")),
            $name,
        )
    };
}
pub(crate) use shader;

/// A stage of a [`SamplePipeline`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleStage {
    /// Kind of the stage.
    pub stage: ShaderStage,
    /// GLSL of the stage.
    pub text: &'static str,
    /// Names and values of macros.
    pub defines: &'static [(&'static str, &'static str)],
    /// Name of the file without `.glsl`, for messages and for folders of shaders.
    pub name: &'static str,
}

impl SampleStage {
    /// A stage without macros. The end of `name` says its kind: `.vert`, `.frag`, `.comp`, `.rgen`, `.rmiss`, `.rchit`,
    /// `.rahit`, `.rint`, `.task` or `.mesh`.
    ///
    /// # Panics
    /// If `name` ends otherwise; in a constant this is an error of the compiler.
    #[must_use]
    pub const fn from_glsl(text: &'static str, name: &'static str) -> Self {
        Self { stage: kind_of(name), text, defines: &[], name }
    }

    /// The same stage with macros: names and values.
    #[must_use]
    pub const fn with_defines(self, defines: &'static [(&'static str, &'static str)]) -> Self {
        Self { defines, ..self }
    }

    /// The description of its module.
    #[must_use]
    pub fn module(&self) -> ShaderModuleDesc<'static> {
        ShaderModuleDesc {
            stage: self.stage,
            source: ShaderSource::Glsl(self.text),
            includes: INCLUDES,
            defines: self.defines,
            debug_name: self.name,
            ..ShaderModuleDesc::default()
        }
    }

    /// Compiles it as a stage of `sample`; see [`create_module`].
    ///
    /// # Errors
    /// Those of [`create_module`].
    pub fn create(&self, ctx: &Context, sample: &str) -> lvk::Result<Holder<ShaderModuleHandle>> {
        create_module(ctx, sample, &self.module())
    }

    /// Creates the pipeline of a compute stage of `sample`, which is named as the stage. `layouts` are compared with its blocks.
    ///
    /// # Errors
    /// Those of [`create_module`] and of [`Context::create_compute_pipeline`].
    pub fn create_compute_pipeline(
        &self,
        ctx: &Context,
        sample: &str,
        layouts: &[BlockLayout],
    ) -> lvk::Result<Holder<ComputePipelineHandle>> {
        debug_assert_eq!(self.stage, ShaderStage::Compute);
        let module = self.create(ctx, sample)?;
        ctx.create_compute_pipeline(&ComputePipelineDesc {
            module: Some(*module),
            layouts,
            debug_name: self.name,
            ..ComputePipelineDesc::default()
        })
    }
}

/// The kind of a stage by the end of its name.
#[expect(
    clippy::panic,
    reason = "names are literals in constants, where a panic is an error of the compiler"
)]
const fn kind_of(name: &str) -> ShaderStage {
    let bytes = name.as_bytes();
    let mut dot = bytes.len();
    while dot > 0 && bytes[dot - 1] != b'.' {
        dot -= 1;
    }
    match bytes.split_at(dot).1 {
        b"vert" => ShaderStage::Vertex,
        b"frag" => ShaderStage::Fragment,
        b"comp" => ShaderStage::Compute,
        b"rgen" => ShaderStage::RayGen,
        b"rmiss" => ShaderStage::Miss,
        b"rchit" => ShaderStage::ClosestHit,
        b"rahit" => ShaderStage::AnyHit,
        b"rint" => ShaderStage::Intersection,
        b"task" => ShaderStage::Task,
        b"mesh" => ShaderStage::Mesh,
        _ => panic!("the name of a stage ends as .vert or .frag do"),
    }
}

/// A pipeline that a sample creates. Its stages tell its kind: one compute stage, ray tracing stages, or stages that
/// draw. Each closest-hit stage is a hit group for triangles; an intersection stage begins a hit group for boxes, which an
/// any-hit stage behind it belongs to. Nothing traces more than one ray deep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplePipeline {
    /// For messages.
    pub name: &'static str,
    /// Stages; for ray tracing in the order of the shader binding table.
    pub stages: Vec<SampleStage>,
    /// Formats of the colour targets it draws to.
    pub color: Vec<Format>,
    /// Format of the depth target, if it has one.
    pub depth: Option<Format>,
}

impl SamplePipeline {
    /// A pipeline without targets: one compute stage, or stages that trace rays.
    #[must_use]
    pub fn new(name: &'static str, stages: &[SampleStage]) -> Self {
        Self { name, stages: stages.to_vec(), color: Vec::new(), depth: None }
    }

    /// A pipeline that draws to targets of these formats.
    #[must_use]
    pub fn raster(
        name: &'static str,
        stages: &[SampleStage],
        color: &[Format],
        depth: Option<Format>,
    ) -> Self {
        Self { name, stages: stages.to_vec(), color: color.to_vec(), depth }
    }
}

/// Returns every pipeline of the samples and of `bench`.
#[must_use]
pub fn all() -> Vec<SamplePipeline> {
    catalogue::SAMPLES.iter().flat_map(|sample| (sample.pipelines)()).collect()
}
