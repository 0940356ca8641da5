//! Shader modules of the sample.

use lvk::{Context, Error, Holder, ShaderModuleDesc, ShaderModuleHandle, ShaderStage};

use crate::pipelines::SampleStage;
use crate::shader_folder::create_module;

/// Compiles a stage of the sample with these macros.
pub(super) fn module(
    ctx: &Context,
    stage: &SampleStage,
    defines: &[(&str, &str)],
) -> lvk::Result<Holder<ShaderModuleHandle>> {
    let desc = ShaderModuleDesc { defines, ..stage.module() };
    match create_module(ctx, "hybrid", &desc) {
        // Not every device has subgroup operations in the stages of a ray tracing pipeline.
        Err(Error::Unsupported { .. }) if stage.stage == ShaderStage::RayGen => {
            let defines = &[defines, &[("HYBRID_NO_SUBGROUPS", "1")]].concat();
            create_module(ctx, "hybrid", &ShaderModuleDesc { defines, ..desc })
        }
        result => result,
    }
}
