//! Compiles GLSL to SPIR-V by glslang.

use std::sync::LazyLock;

use glslang::error::GlslangError;
use glslang::limits::ResourceLimits;
use glslang::{Compiler, CompilerOptions, ShaderInput, ShaderMessage, SpirvVersion, Target, VulkanVersion};

use super::disk_file::{CachedModule, Fingerprint};
use super::include::Includes;
use super::options::{CompileFiles, CompileOptions, compile_error};
use super::sanitize::{self, SourceError};
use super::spirv::debug_source::embed_source;
use super::spirv::passes::merge_sampled_image::merge_sampled_images;
use super::spirv::passes::strip_unused_bindings::strip_unused_bindings;
use super::{ShaderModuleDesc, ShaderStage, diagnostics, preamble};
use crate::cpu_scope::cpu_scope;
use crate::error::Result;
use crate::error::readable::{readable_name, readable_text};

/// Returns the words of `text`, from the cache if it has them.
pub(super) fn compile_cached(
    desc: &ShaderModuleDesc<'_>,
    text: &str,
    options: &CompileOptions,
    files: CompileFiles<'_>,
) -> Result<Vec<u32>> {
    cpu_scope!("compile GLSL");
    let name = desc.debug_name;
    let complain = |c: SourceError| compile_error(name, format!("line {}: {}", c.line, c.message));
    let text =
        sanitize::to_ascii(text).and_then(|text| sanitize::without_version(&text)).map_err(complain)?;
    check_defines(desc)?;
    let preamble = preamble::preamble(desc.stage, options, desc.defines);
    let includes = || Includes::new(desc.includes, desc.include_dirs, files.on_search);
    let Some(cache) = files.cache else { return Ok(translate(desc, &preamble, &text, includes())?.words) };
    let key = fingerprint(desc, &preamble, &text);
    let found = cache.load(key, |included| includes().finds_unchanged(included));
    if let Some(words) = found {
        return Ok(words);
    }
    let entry = translate(desc, &preamble, &text, includes())?;
    cache.store(key, &entry);
    Ok(entry.words)
}

/// Returns the fingerprint of all inputs of a compilation except the included texts.
fn fingerprint(desc: &ShaderModuleDesc<'_>, preamble: &str, text: &str) -> Fingerprint {
    // Only words with debug information contain the module's name.
    let name = if desc.debug_info { desc.debug_name } else { "" };
    let parts = [preamble, text, name].into_iter().chain(desc.includes.iter().map(|(name, _)| *name));
    let dirs = desc.include_dirs.iter().map(|dir| dir.as_os_str().as_encoded_bytes());
    let numbers = [desc.stage as u32, desc.debug_info.into(), desc.includes.len() as u32];
    Fingerprint::from_input(&numbers, parts.map(str::as_bytes).chain(dirs))
}

/// Compiles `text`, and returns the words with the includes.
fn translate(
    desc: &ShaderModuleDesc<'_>,
    preamble: &str,
    text: &str,
    mut includes: Includes<'_>,
) -> Result<CachedModule> {
    let name = desc.debug_name;
    let words = match to_spirv(name, desc.stage, format!("{preamble}{text}"), &mut includes) {
        Ok(words) => merge_sampled_images(strip_unused_bindings(words)),
        Err(error) => {
            return Err(compile_error(
                name,
                diagnostics::errors(&error_log(error), includes.into_failures()),
            ));
        }
    };
    let (included, texts) = includes.into_included();
    if !desc.debug_info {
        return Ok(CachedModule { included, words });
    }
    let own = (name.replace(|c: char| !c.is_ascii() || c == '\0', "?"), text.to_owned());
    let texts: Vec<_> = std::iter::once(own).chain(texts).collect();
    Ok(CachedModule { included, words: embed_source(&words, &texts) })
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
        log::warn!("shader '{}': {}", readable_name(name), readable_text(&warning));
    }
    shader.compile()
}

/// Limits that never restrict a shader: pipeline creation checks the limits of the device.
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
            return Err(compile_error(
                desc.debug_name,
                format!("define '{name}': the name is not an identifier"),
            ));
        }
        if !value.chars().all(|c| c.is_ascii_graphic() || c == ' ' || c == '\t') || value.ends_with('\\') {
            let log = format!("define '{name}': the value must be one line of printable ASCII");
            return Err(compile_error(desc.debug_name, log));
        }
    }
    Ok(())
}

fn error_log(error: GlslangError) -> String {
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
