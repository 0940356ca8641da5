//! Pipelines and targets of tests that draw, and the coverage of triangles.
#![expect(clippy::expect_used, reason = "a test whose set-up fails has failed")]

use lvk::{
    ColorAttachment, Context, Dependencies, Error, Format, Holder, OptionalFeature, RenderPass,
    RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderStage, TextureDesc, TextureHandle,
    TextureRegion, TextureUsage,
};

use crate::compute::{Evaluator, module};

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

/// Creates a pipeline of two GLSL texts; an empty `fragment` stands for none.
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

/// Creates a texture to draw to and to sample.
pub fn target(ctx: &Context, format: Format, extent: [u32; 2]) -> Holder<TextureHandle> {
    let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
    let desc = TextureDesc { format, extent, usage, debug_name: "target", ..Default::default() };
    ctx.create_texture(&desc).expect("a small target can be made")
}

/// Returns the texels of a target's first mip and layer.
pub fn pixels<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
    ctx: &Context,
    target: TextureHandle,
) -> Vec<T> {
    let bytes = ctx.download_texture(target, &TextureRegion::default()).expect("the target can be read");
    bytemuck::pod_collect_to_vec(&bytes)
}

/// Returns, for each pixel of an image, whether a triangle covers it. Vertices are in pixels.
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

/// Creates a pipeline of GLSL texts for any stages.
///
/// # Errors
/// Those of the pipeline; the shaders must compile.
pub fn staged_pipeline(
    ctx: &Context,
    stages: &[(ShaderStage, &str)],
    desc: &RenderPipelineDesc<'_>,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let modules: Vec<_> = stages.iter().map(|(stage, text)| (*stage, module(ctx, *stage, text))).collect();
    let of = |wanted| modules.iter().find(|(stage, _)| *stage == wanted).map(|(_, module)| **module);
    ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: of(ShaderStage::Vertex),
        task: of(ShaderStage::Task),
        mesh: of(ShaderStage::Mesh),
        tess_control: of(ShaderStage::TessControl),
        tess_eval: of(ShaderStage::TessEval),
        geometry: of(ShaderStage::Geometry),
        fragment: of(ShaderStage::Fragment),
        ..*desc
    })
}

/// Runs one pass in a submission of its own.
///
/// # Panics
/// When anything is refused.
pub fn run_pass(
    ctx: &Context,
    desc: &RenderPassDesc<'_>,
    record: impl FnOnce(&mut RenderPass<'_>) -> lvk::Result<()>,
) {
    let mut cmd = ctx.acquire_command_buffer().expect("a command buffer can be had");
    record(&mut cmd.begin_rendering(desc).expect("the pass begins")).expect("the draws are taken");
    ctx.submit(cmd).expect("the commands are taken");
}

/// Asserts that compute, textures and draws work: draws a colour, samples it, and reads both back.
///
/// # Panics
/// When anything is refused, or a colour is another one.
pub fn expect_drawing(ctx: &Context) {
    let drawn = target(ctx, Format::Rgba8Unorm, [4, 4]);
    let desc = RenderPipelineDesc { color: &[Format::Rgba8Unorm.into()], ..Default::default() };
    let pipeline = render_pipeline(ctx, COVER, PAINT, &desc);
    let mut cmd = ctx.acquire_command_buffer().expect("the device can draw and sample");
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let mut pass = cmd
        .begin_rendering(&RenderPassDesc { color: &color, ..Default::default() })
        .expect("the device can draw and sample");
    pass.bind_render_pipeline(*pipeline).expect("the device can draw and sample");
    pass.push_constants(&[0.0, 1.0, 0.0, 1.0, 0.5_f32]).expect("the device can draw and sample");
    pass.draw(0..3, 0..1).expect("the device can draw and sample");
    drop(pass);
    ctx.submit(cmd).expect("the device can draw and sample");
    assert_eq!(pixels::<[u8; 4]>(ctx, *drawn), [[0, 255, 0, 255]; 16]);
    let sampler = ctx.create_sampler(&Default::default()).expect("the device can draw and sample");
    let sample = Evaluator::new(ctx, "textureBindless2D(a, b, vec2(0.5)) * float(i + 1)");
    let reads = Dependencies { sampled_images: &[*drawn], ..Default::default() };
    let found = sample.run(ctx, [drawn.index(), sampler.index(), 0], 2, &reads);
    assert_eq!(found, [[0.0, 1.0, 0.0, 1.0], [0.0, 2.0, 0.0, 2.0]]);
}

/// Draws the colour and the depth of [`COVER`] and [`PAINT`] over the scissor.
///
/// # Errors
/// Those of the draw.
pub fn paint(pass: &mut RenderPass<'_>, color: [f32; 4], depth: f32) -> lvk::Result<()> {
    let [r, g, b, a] = color;
    pass.push_constants(&[r, g, b, a, depth])?;
    pass.draw(0..3, 0..1)
}

/// Asserts that a call returned `Error::InvalidUsage` with these words.
///
/// # Panics
/// Otherwise.
pub fn usage_error<T>(result: lvk::Result<T>, words: &str) {
    match result.map(drop) {
        Err(Error::InvalidUsage { object, message }) => {
            let text = format!("{object}: {message}");
            assert!(text.contains(words), "'{text}' does not say '{words}'");
        }
        other => unreachable!("expected an error that says '{words}', not {other:?}"),
    }
}

/// Asserts that a call returned `Error::Unsupported` with these words.
///
/// # Panics
/// Otherwise.
pub fn unsupported<T>(result: lvk::Result<T>, words: &str) {
    match result.map(drop) {
        Err(error @ Error::Unsupported { .. }) => {
            let text = error.to_string();
            assert!(text.contains(words), "'{text}' does not say '{words}'");
        }
        other => unreachable!("expected an error that says '{words}', not {other:?}"),
    }
}

/// True if the device has a feature. Prints what is not tested if it has not.
pub fn has(ctx: &Context, feature: OptionalFeature) -> bool {
    let there = ctx.capabilities().has(feature);
    if !there {
        eprintln!("NOT TESTED, {} lacks {}", ctx.capabilities().device_name, feature.vulkan_name());
    }
    there
}
