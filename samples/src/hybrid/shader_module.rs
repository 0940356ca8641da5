//! Shader modules from the texts inside the binary.

use lvk::{Context, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage};

use crate::shaders::INCLUDES;

/// Compiles a stage of the sample.
pub(super) fn module(
    ctx: &Context,
    stage: ShaderStage,
    text: &str,
    defines: &[(&str, &str)],
    debug_name: &str,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    ctx.create_shader_module(&ShaderModuleDesc {
        stage,
        source: ShaderSource::Glsl(text),
        includes: INCLUDES,
        defines,
        debug_name,
        ..ShaderModuleDesc::default()
    })
}
