//! Every pipeline of the samples as data, for those who compile them without running them.

use lvk::{Context, Format, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage};

use crate::shader_folder::create_module;
use crate::shaders::INCLUDES;
use crate::{
    app, bench, deferred, hello_triangle, hybrid, hybrid_oit, large_scene, mesh_shaders, omni_shadows,
    reflections, render_to_cube_map, rtx_ao, rtx_hello, rtx_pipeline, rtx_textures, sponza, triplanar, yuv,
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
        bench::pipelines(),
        app::ui::pipelines(),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::*;

    const STAGES: [&str; 10] =
        ["vert", "frag", "comp", "rgen", "rmiss", "rchit", "rahit", "rint", "mesh", "task"];

    fn stage_files(folder: &Path) -> Vec<PathBuf> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                found.extend(stage_files(&path));
            } else if STAGES.iter().any(|stage| name.ends_with(&format!(".{stage}.glsl"))) {
                found.push(path);
            }
        }
        found
    }

    #[test]
    fn every_stage_below_shaders_is_in_a_pipeline() {
        let files = stage_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders"));
        assert!(files.len() >= 7, "{files:?}");
        let pipelines = all();
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap();
            let listed =
                pipelines.iter().flat_map(|pipeline| &pipeline.stages).any(|stage| stage.text == text);
            assert!(listed, "{} is in no pipeline of `pipelines::all`", file.display());
        }
    }

    #[test]
    fn names_tell_pipelines_apart() {
        let mut names: Vec<_> = all().iter().map(|pipeline| pipeline.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
