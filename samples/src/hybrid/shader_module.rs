//! Shader modules of the sample.

use lvk::{Context, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage};

use crate::shader_folder::create_module;
use crate::shaders::INCLUDES;

/// Compiles a stage of the sample.
pub(super) fn module(
    ctx: &Context,
    stage: ShaderStage,
    text: &str,
    defines: &[(&str, &str)],
    debug_name: &str,
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let desc = ShaderModuleDesc {
        stage,
        source: ShaderSource::Glsl(text),
        includes: INCLUDES,
        defines,
        debug_name,
        ..ShaderModuleDesc::default()
    };
    create_module(ctx, "hybrid", &desc)
}
