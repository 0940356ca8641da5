//! GLSL to SPIR-V by glslang.

use std::sync::LazyLock;

use glslang::error::GlslangError;
use glslang::limits::ResourceLimits;
use glslang::{Compiler, CompilerOptions, ShaderInput, ShaderMessage, SpirvVersion, Target, VulkanVersion};

use super::compile::{CompileOptions, failed};
use super::include::Includes;
use super::sampled_copies::without_sampled_copies;
use super::source::{self, Complaint};
use super::unused::without_unused_resources;
use super::{ShaderModuleDesc, ShaderStage, diagnostics, preamble};
use crate::error::Result;

pub(super) fn glsl(desc: &ShaderModuleDesc<'_>, text: &str, options: &CompileOptions) -> Result<Vec<u32>> {
    let name = desc.debug_name;
    let complain = |c: Complaint| failed(name, format!("line {}: {}", c.line, c.message));
    let text = source::to_ascii(text).and_then(|text| source::without_version(&text)).map_err(complain)?;
    check_defines(desc)?;
    let text = preamble::preamble(desc.stage, options, desc.defines) + &text;
    let mut includes = Includes::new(desc.includes, desc.include_dirs);
    match to_spirv(name, desc.stage, text, &mut includes) {
        Ok(words) => Ok(without_sampled_copies(without_unused_resources(words))),
        Err(error) => Err(failed(name, diagnostics::errors(&log_of(error), includes.into_failures()))),
    }
}

fn to_spirv(
    name: &str,
    stage: ShaderStage,
    text: String,
    includes: &mut Includes<'_>,
) -> Result<Vec<u32>, GlslangError> {
    let Some(compiler) = Compiler::acquire() else {
        return Err(GlslangError::NoLanguageTarget);
    };
    let source = glslang::ShaderSource::from(text);
    let options = CompilerOptions {
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_3, spirv_version: SpirvVersion::SPIRV1_6 },
        messages: ShaderMessage::VULKAN_RULES | ShaderMessage::SPV_RULES,
        ..CompilerOptions::default()
    };
    let no_defines: Option<&[(&str, Option<&str>)]> = None;
    let stage = glslang_stage(stage);
    let input = ShaderInput::new_with_limits(&source, &LIMITS, stage, &options, no_defines, Some(includes))?;
    let shader = compiler.create_shader(input)?;
    for warning in diagnostics::warnings(&shader.get_log()) {
        log::warn!("shader '{name}': {warning}");
    }
    shader.compile()
}

/// Wide enough never to stand in the way: the device's own limits are checked when a pipeline is made.
static LIMITS: LazyLock<ResourceLimits> = LazyLock::new(|| {
    let mut limits = ResourceLimits::default();
    limits.set_max_compute_work_group_size_x(GROUP);
    limits.set_max_compute_work_group_size_y(GROUP);
    limits.set_max_compute_work_group_size_z(GROUP);
    limits.set_max_mesh_work_group_size_x_ext(GROUP);
    limits.set_max_mesh_work_group_size_y_ext(GROUP);
    limits.set_max_mesh_work_group_size_z_ext(GROUP);
    limits.set_max_task_work_group_size_x_ext(GROUP);
    limits.set_max_task_work_group_size_y_ext(GROUP);
    limits.set_max_task_work_group_size_z_ext(GROUP);
    limits.set_max_samples(64);
    limits
});
const GROUP: i32 = 4096;

fn check_defines(desc: &ShaderModuleDesc<'_>) -> Result<()> {
    for (name, value) in desc.defines {
        let starts_well = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        if !starts_well || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(failed(desc.debug_name, format!("define '{name}': the name is not an identifier")));
        }
        if !value.chars().all(|c| c.is_ascii_graphic() || c == ' ' || c == '\t') || value.ends_with('\\') {
            let log = format!("define '{name}': the value must be one line of printable ASCII");
            return Err(failed(desc.debug_name, log));
        }
    }
    Ok(())
}

fn log_of(error: GlslangError) -> String {
    match error {
        GlslangError::PreprocessError(log)
        | GlslangError::ParseError(log)
        | GlslangError::MapIoError(log)
        | GlslangError::LinkError(log) => log.log,
        other => other.to_string(),
    }
}

fn glslang_stage(stage: ShaderStage) -> glslang::ShaderStage {
    match stage {
        ShaderStage::Vertex => glslang::ShaderStage::Vertex,
        ShaderStage::TessControl => glslang::ShaderStage::TesselationControl,
        ShaderStage::TessEval => glslang::ShaderStage::TesselationEvaluation,
        ShaderStage::Geometry => glslang::ShaderStage::Geometry,
        ShaderStage::Fragment => glslang::ShaderStage::Fragment,
        ShaderStage::Compute => glslang::ShaderStage::Compute,
        ShaderStage::Task => glslang::ShaderStage::Task,
        ShaderStage::Mesh => glslang::ShaderStage::Mesh,
        ShaderStage::RayGen => glslang::ShaderStage::RayGeneration,
        ShaderStage::Miss => glslang::ShaderStage::Miss,
        ShaderStage::ClosestHit => glslang::ShaderStage::ClosestHit,
        ShaderStage::AnyHit => glslang::ShaderStage::AnyHit,
        ShaderStage::Intersection => glslang::ShaderStage::Intersect,
        ShaderStage::Callable => glslang::ShaderStage::Callable,
    }
}
