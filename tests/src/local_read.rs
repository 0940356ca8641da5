//! Targets and pipelines of tests of input attachments.
#![expect(clippy::expect_used, reason = "a test whose set-up fails has failed")]

use lvk::{
    CompareOp, Context, DepthTest, Format, Holder, RenderPipelineDesc, RenderPipelineHandle, ShaderStage,
    TextureDesc, TextureHandle, TextureUsage,
};

use crate::raster::staged_pipeline;

/// Size of the targets in pixels.
pub const SIZE: [u32; 2] = [23, 17];

/// Usage of a target that is an input attachment of its own pass.
pub const READ: TextureUsage = TextureUsage::TARGET.union(TextureUsage::INPUT);

/// A triangle over all pixels, without push constants.
const ALL: &str = "
    void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0, 1); }";

/// Creates a target that its own pass reads and that tests sample.
pub fn input(ctx: &Context, format: Format) -> Holder<TextureHandle> {
    let usage = READ | TextureUsage::SAMPLED;
    let desc = TextureDesc { format, extent: SIZE, usage, debug_name: "input", ..Default::default() };
    ctx.create_texture(&desc).expect("a small target can be made")
}

/// Creates a pipeline that runs `fragment` for all pixels.
///
/// # Errors
/// Those of the pipeline; the shader must compile.
pub fn color_pipeline(
    ctx: &Context,
    fragment: &str,
    desc: &RenderPipelineDesc<'_>,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    staged_pipeline(ctx, &[(ShaderStage::Vertex, ALL), (ShaderStage::Fragment, fragment)], desc)
}

/// Returns a depth test that always passes.
pub fn depth_test(format: Format, write: bool) -> Option<DepthTest> {
    Some(DepthTest { format, compare: CompareOp::Always, write })
}
