//! Generates the text before every GLSL shader from the binding numbers.

use std::fmt::Write;

use super::ShaderStage;
use super::options::CompileOptions;
use crate::bindless::input_attachments::InputAttachment;
use crate::bindless::layout;
use crate::software_ray_query;

/// Helpers and resource arrays for every stage.
const BINDLESS: &str = include_str!("glsl/bindless.glsl");

/// Returns the names and texts of the library's files for `#include <lvk/..>`.
pub(super) fn library() -> impl Iterator<Item = (&'static str, &'static str)> {
    CORE_LIBRARY.iter().chain(software_ray_query::GLSL).copied()
}

const CORE_LIBRARY: &[(&str, &str)] = &[
    ("lvk/hardware_ray_query.glsl", include_str!("glsl/hardware_ray_query.glsl")),
    ("lvk/hit_remap.glsl", include_str!("glsl/hit_remap.glsl")),
    ("lvk/ray_flags.glsl", include_str!("glsl/ray_flags.glsl")),
    ("lvk/ray_query.glsl", include_str!("glsl/ray_query.glsl")),
    ("lvk/ray_tracing.glsl", include_str!("glsl/ray_tracing.glsl")),
    ("lvk/tlas.glsl", include_str!("glsl/tlas.glsl")),
    ("lvk/tlas_table.glsl", include_str!("glsl/tlas_table.glsl")),
];

/// Extensions that are enabled in every stage. An extension needs no device feature until its types or functions are
/// used.
pub(super) const EXTENSIONS: [&str; 25] = [
    "GL_GOOGLE_include_directive",
    "GL_GOOGLE_cpp_style_line_directive",
    "GL_EXT_buffer_reference",
    "GL_EXT_buffer_reference2",
    "GL_EXT_buffer_reference_uvec2",
    "GL_EXT_scalar_block_layout",
    "GL_EXT_nonuniform_qualifier",
    "GL_EXT_samplerless_texture_functions",
    "GL_EXT_control_flow_attributes",
    "GL_EXT_debug_printf",
    "GL_EXT_shader_8bit_storage",
    "GL_EXT_shader_16bit_storage",
    "GL_EXT_shader_explicit_arithmetic_types_int8",
    "GL_EXT_shader_explicit_arithmetic_types_int16",
    "GL_EXT_shader_explicit_arithmetic_types_int64",
    "GL_EXT_shader_explicit_arithmetic_types_float16",
    "GL_EXT_shader_atomic_int64",
    "GL_EXT_shader_atomic_float",
    "GL_KHR_shader_subgroup_basic",
    "GL_KHR_shader_subgroup_vote",
    "GL_KHR_shader_subgroup_ballot",
    "GL_KHR_shader_subgroup_arithmetic",
    "GL_KHR_shader_subgroup_shuffle",
    "GL_KHR_shader_subgroup_shuffle_relative",
    "GL_KHR_shader_subgroup_quad",
];

/// Returns the text before the caller's first line, which stays line 1.
pub(super) fn preamble(stage: ShaderStage, options: &CompileOptions, defines: &[(&str, &str)]) -> String {
    let mut text = String::from("#version 460\n");
    for extension in EXTENSIONS.into_iter().chain(stage_extensions(stage)) {
        push_extension(&mut text, extension);
    }
    push_define(&mut text, stage_macro(stage), "1");
    push_define(&mut text, "LVK_SET", &layout::SET.to_string());
    declare_input_attachments(&mut text);
    for binding in layout::BINDINGS {
        push_define(&mut text, binding.macro_name, &binding.number.to_string());
    }
    if options.formatless_read {
        push_extension(&mut text, "GL_EXT_shader_image_load_formatted");
        push_define(&mut text, "LVK_FORMATLESS_READ", "1");
    }
    if options.position_fetch {
        push_define(&mut text, "LVK_POSITION_FETCH", "1");
        if stage.is_ray_tracing() {
            push_extension(&mut text, "GL_EXT_ray_tracing_position_fetch");
        }
    }
    if options.software_ray_query {
        push_define(&mut text, "LVK_SOFTWARE_RAY_QUERY", "1");
    }
    if options.is_cpu {
        push_define(&mut text, "LVK_DEVICE_IS_CPU", "1");
    }
    if options.gathers_pairs {
        push_define(&mut text, "LVK_GATHERS_PAIRS", "1");
    }
    if options.helpers_lose_arrays {
        push_define(&mut text, "LVK_HELPERS_LOSE_ARRAYS", "1");
    }
    text.push_str(BINDLESS);
    if stage.is_ray_tracing() {
        push_define(&mut text, "LVK_STAGE_RAY_TRACING", "1");
        text.push_str("#include <lvk/ray_tracing.glsl>\n");
    }
    for (name, value) in defines {
        push_define(&mut text, name, value);
    }
    text.push_str("#line 1 0\n");
    text
}

/// Declares the defines for input attachments of fragment shaders.
fn declare_input_attachments(text: &mut String) {
    push_define(text, "LVK_INPUT_SET", &layout::INPUT_SET.to_string());
    for (name, input) in [
        ("COLOR", InputAttachment::Color(0)),
        ("DEPTH", InputAttachment::Depth),
        ("STENCIL", InputAttachment::Stencil),
    ] {
        push_define(text, &format!("LVK_PLACE_OF_{name}"), &input.index().to_string());
    }
}

fn push_extension(text: &mut String, extension: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "#extension {extension} : require");
}

fn push_define(text: &mut String, name: &str, value: &str) {
    let _ = writeln!(text, "#define {name} {value}");
}

pub(super) fn stage_extensions(stage: ShaderStage) -> Option<&'static str> {
    match stage {
        ShaderStage::Task | ShaderStage::Mesh => Some("GL_EXT_mesh_shader"),
        stage if stage.is_ray_tracing() => Some("GL_EXT_ray_tracing"),
        _ => None,
    }
}

pub(super) fn stage_macro(stage: ShaderStage) -> &'static str {
    match stage {
        ShaderStage::Vertex => "LVK_STAGE_VERTEX",
        ShaderStage::TessControl => "LVK_STAGE_TESS_CONTROL",
        ShaderStage::TessEval => "LVK_STAGE_TESS_EVAL",
        ShaderStage::Geometry => "LVK_STAGE_GEOMETRY",
        ShaderStage::Fragment => "LVK_STAGE_FRAGMENT",
        ShaderStage::Compute => "LVK_STAGE_COMPUTE",
        ShaderStage::Task => "LVK_STAGE_TASK",
        ShaderStage::Mesh => "LVK_STAGE_MESH",
        ShaderStage::RayGen => "LVK_STAGE_RAY_GEN",
        ShaderStage::Miss => "LVK_STAGE_MISS",
        ShaderStage::ClosestHit => "LVK_STAGE_CLOSEST_HIT",
        ShaderStage::AnyHit => "LVK_STAGE_ANY_HIT",
        ShaderStage::Intersection => "LVK_STAGE_INTERSECTION",
        ShaderStage::Callable => "LVK_STAGE_CALLABLE",
    }
}
