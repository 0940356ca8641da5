//! Every pipeline of the samples as data, for those who compile them without running them.

use lvk::{Context, Format, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage};

use crate::shader_folder::create_module;
use crate::shaders::INCLUDES;
use crate::{
    app, deferred, hello_triangle, hybrid, hybrid_oit, large_scene, mesh_shaders, omni_shadows, reflections,
    render_to_cube_map, rtx_ao, rtx_hello, rtx_pipeline, rtx_textures, sponza, triplanar, yuv,
};

/// A stage of a [`SamplePipeline`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleStage {
    /// Which stage.
    pub stage: ShaderStage,
    /// Its GLSL.
    pub text: &'static str,
    /// Names and values of macros.
    pub defines: &'static [(&'static str, &'static str)],
    /// For messages.
    pub name: &'static str,
}

impl SampleStage {
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
}

/// A pipeline that a sample creates. Its stages tell its kind: one compute stage, ray tracing stages, or stages that
/// draw. Each closest-hit stage is a hit group for triangles; an intersection stage begins a hit group for boxes, which an
/// any-hit stage behind it belongs to. Nothing traces more than one ray deep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplePipeline {
    /// For messages.
    pub name: &'static str,
    /// In the order of the shader binding table where rays are traced.
    pub stages: Vec<SampleStage>,
    /// Formats of the colour targets it draws to.
    pub color: Vec<Format>,
    /// Format of the depth target, if it has one.
    pub depth: Option<Format>,
}

/// All of them.
#[must_use]
pub fn all() -> Vec<SamplePipeline> {
    [
        deferred::pipelines(),
        hello_triangle::pipelines(),
        hybrid::pipelines(),
        hybrid_oit::pipelines(),
        large_scene::pipelines(),
        omni_shadows::pipelines(),
        mesh_shaders::pipelines(),
        reflections::pipelines(),
        render_to_cube_map::pipelines(),
        rtx_ao::pipelines(),
        rtx_hello::pipelines(),
        rtx_pipeline::pipelines(),
        rtx_textures::pipelines(),
        yuv::pipelines(),
        triplanar::pipelines(),
        sponza::pipelines(),
        app::ui::pipelines(),
    ]
    .concat()
}
