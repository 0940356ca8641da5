//! Pipelines and targets of tests that draw, and what a rasteriser must do with a triangle.
#![expect(clippy::expect_used, reason = "a test whose set-up fails has failed")]

use lvk::{
    Context, Format, Holder, RenderPipelineDesc, RenderPipelineHandle, ShaderStage, TextureDesc,
    TextureHandle, TextureRegion, TextureUsage,
};

use crate::compute::module;

/// A triangle over all pixels, at the depth behind the colour in the push constants.
pub const COVER: &str = "
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    void main() {
        vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
        gl_Position = vec4(corner * 4.0 - 1.0, depth, 1.0);
    }";

/// The colour in the push constants.
pub const PAINT: &str = "
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    layout(location = 0) out vec4 result;
    void main() { result = color; }";

/// A pipeline of two GLSL texts; an empty `fragment` stands for none.
pub fn render_pipeline(
    ctx: &Context,
    vertex: &str,
    fragment: &str,
    desc: &RenderPipelineDesc<'_>,
) -> Holder<RenderPipelineHandle> {
    let vertex = module(ctx, ShaderStage::Vertex, vertex);
    let fragment = (!fragment.is_empty()).then(|| module(ctx, ShaderStage::Fragment, fragment));
    let desc = RenderPipelineDesc { vertex: Some(*vertex), fragment: fragment.as_deref().copied(), ..*desc };
    ctx.create_render_pipeline(&desc).expect("the pipeline of a test can be made")
}

/// A texture to draw to and to sample.
pub fn target(ctx: &Context, format: Format, extent: [u32; 2]) -> Holder<TextureHandle> {
    let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
    let desc = TextureDesc { format, extent, usage, debug_name: "target", ..Default::default() };
    ctx.create_texture(&desc).expect("a small target can be made")
}

/// The texels of a target's first mip and layer.
pub fn pixels<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
    ctx: &Context,
    target: TextureHandle,
) -> Vec<T> {
    let bytes = ctx.download_texture(target, &TextureRegion::default()).expect("the target can be read");
    bytemuck::pod_collect_to_vec(&bytes)
}

/// Which pixels of a picture a triangle with these corners, in pixels, covers.
///
/// # Panics
/// When a pixel's centre is so close to an edge that devices may differ.
pub fn coverage(corners: [[f64; 2]; 3], [width, height]: [u32; 2]) -> Vec<bool> {
    let centres = (0..height).flat_map(|y| (0..width).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]));
    let sides = |point: [f64; 2]| {
        [0, 1, 2].map(|edge| {
            let ([ax, ay], [bx, by]) = (corners[edge], corners[(edge + 1) % 3]);
            ((bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)) / (bx - ax).hypot(by - ay)
        })
    };
    centres
        .map(|centre| {
            let sides = sides(centre);
            assert!(
                sides.iter().all(|side| side.abs() > 0.01),
                "move the triangle: {centre:?} is on an edge"
            );
            sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
        })
        .collect()
}
