//! Shader modules of the sample.

use lvk::{Context, Error, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderSource, ShaderStage};

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
    match create_module(ctx, "hybrid", &desc) {
        // Not every device has subgroup operations in the stages of a ray tracing pipeline.
        Err(Error::Unsupported { .. }) if stage == ShaderStage::RayGen => {
            let defines = &[defines, &[("HYBRID_NO_SUBGROUPS", "1")]].concat();
            create_module(ctx, "hybrid", &ShaderModuleDesc { defines, ..desc })
        }
        result => result,
    }
}
