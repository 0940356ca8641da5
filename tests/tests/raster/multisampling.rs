//! Multisampling: coverage, alpha to coverage, resolves of colour, depth and stencil, sample shading, and refused
//! calls.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, CompareOp, Context, Dependencies, DepthAttachment, DepthResolve, DepthTest,
    DeviceProfile, Error, Format, Holder, OptionalFeature, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle, Resolve, ResolveMode, ResolveModes, ShaderStage, StencilFace, StencilLoadOp,
    StencilOp, StencilTest, TextureDesc, TextureHandle, TextureKind, TextureUsage,
};
use lvk_tests::compute::Evaluator;
use lvk_tests::raster::{
    COVER, PAINT, has, paint, pixels, run_pass, staged_pipeline, target, unsupported, usage_error,
};
use lvk_tests::{device, device_with};

const SAMPLES: u32 = 4;

/// Four samples a pixel, to draw to and to fetch from.
fn many(ctx: &Context, format: Format, extent: [u32; 2]) -> Holder<TextureHandle> {
    let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
    let desc =
        TextureDesc { format, extent, usage, samples: SAMPLES, debug_name: "many", ..Default::default() };
    ctx.create_texture(&desc).unwrap()
}

fn make(
    ctx: &Context,
    fragment: &str,
    desc: &RenderPipelineDesc<'_>,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, fragment)];
    let desc = RenderPipelineDesc { samples: SAMPLES, debug_name: "samples", ..*desc };
    staged_pipeline(ctx, &stages, &desc)
}

fn resolved(from: TextureHandle, to: TextureHandle) -> ColorAttachment {
    let resolve = Some(Resolve { texture: to, mip: 0, layer: 0 });
    ColorAttachment { resolve, ..ColorAttachment::clear(from, [0.0; 4]) }
}

/// A half-plane's edge runs through the pixels of a column: each is as bright as its samples that are covered, which the
/// samples themselves say.
#[test]
fn an_edge_is_resolved_to_the_mean_of_its_samples() {
    let Some(ctx) = device() else { return };
    let vertex = "
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        void main() {
            const vec2 corners[3] = vec2[](vec2(-1, -1), vec2(0.3, -1), vec2(-0.2, 9));
            gl_Position = vec4(corners[gl_VertexIndex], depth, 1);
        }";
    let color = [Format::R32Float.into()];
    let stages = [(ShaderStage::Vertex, vertex), (ShaderStage::Fragment, PAINT)];
    let desc = RenderPipelineDesc { samples: SAMPLES, color: &color, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let size = [8, 8];
    let (drawn, one) = (many(&ctx, Format::R32Float, size), target(&ctx, Format::R32Float, size));
    let color = [resolved(*drawn, *one)];
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [1.0; 4], 0.0)
    });
    let found = pixels::<f32>(&ctx, *one);
    let fetch = Evaluator::new(
        &ctx,
        "texelFetch(sampler2DMS(kTextures2DMS[a], kSamplers[b]), ivec2((i / 4) % 8, i / 32), int(i % 4))",
    );
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let reads = Dependencies { sampled_images: &[*drawn], ..Default::default() };
    let samples = fetch.run(&ctx, [drawn.index(), sampler.index(), 0], 4 * 64, &reads);
    let means: Vec<f32> =
        samples.chunks(4).map(|four| four.iter().map(|sample| sample[0]).sum::<f32>() / 4.0).collect();
    assert_eq!(found, means);
    let edge = found.iter().filter(|value| **value > 0.0 && **value < 1.0).count();
    assert!(edge >= 4 && found[0] == 1.0 && found[7] == 0.0, "{found:?}");
}

#[test]
fn a_slice_of_a_volume_is_resolved_to_or_refused() {
    let Some(ctx) = device() else { return };
    let (format, size) = (Format::Rgba8Unorm, [2, 2]);
    let volume = ctx
        .create_texture(&TextureDesc {
            kind: TextureKind::D3 { depth: 3 },
            format,
            extent: size,
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            data: Some(&[0; 48]),
            debug_name: "volume",
            ..Default::default()
        })
        .unwrap();
    let drawn = many(&ctx, format, size);
    for slice in 0..3 {
        let resolve = Some(Resolve { texture: *volume, mip: 0, layer: slice });
        let color = [ColorAttachment { resolve, ..ColorAttachment::clear(*drawn, [1.0; 4]) }];
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let begun = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).map(|_| ());
        if !ctx.capabilities().resolves_to_volumes {
            unsupported(begun, "a resolve to a slice of 'volume'");
            continue;
        }
        begun.unwrap();
        ctx.submit(cmd).unwrap();
        let bytes = ctx.download_texture(*volume, &Default::default()).unwrap();
        let is_white = |at: usize| bytes[16 * at..16 * (at + 1)] == [255; 16];
        assert_eq!([0, 1, 2].map(is_white), [0, 1, 2].map(|at| at <= slice as usize), "slice {slice}");
    }
}

/// Each sample has its own value, so that modes differ.
const BY_SAMPLE: &str = "
    layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
    layout(location = 0) out vec4 result;
    void main() {
        float at[4] = float[](0.5, 0.25, 0.75, 0.375);
        result = vec4(at[gl_SampleID]);
        gl_FragDepth = at[gl_SampleID];
    }";

#[test]
fn fragments_run_for_each_sample_that_they_ask_for() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::SampleRateShading)) else { return };
    let count = "
        layout(buffer_reference, scalar) buffer Count { uint value; };
        layout(push_constant, scalar) uniform Push { Count count; };
        layout(location = 0) out vec4 result;
        void main() { result = vec4(1); atomicAdd(count.value, 1); }";
    let color = [Format::R32Float.into()];
    let drawn = many(&ctx, Format::R32Float, [2, 2]);
    // A driver that splits the triangle runs pixels at the edge twice.
    for (sample_shading, invocations) in [(0.0, 4..=8), (1.0, 16..=32)] {
        let desc = RenderPipelineDesc { color: &color, sample_shading, ..Default::default() };
        let stages = [
            (
                ShaderStage::Vertex,
                "void main() {
                gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0, 1); }",
            ),
            (ShaderStage::Fragment, count),
        ];
        let pipeline =
            staged_pipeline(&ctx, &stages, &RenderPipelineDesc { samples: SAMPLES, ..desc }).unwrap();
        let counter = lvk_tests::compute::words_buffer(&ctx, &[0]);
        let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
        let desc = RenderPassDesc {
            color: &color,
            dependencies: Dependencies { buffers: &[*counter], ..Default::default() },
            ..Default::default()
        };
        run_pass(&ctx, &desc, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.push_constants(&ctx.buffer_address(*counter)?)?;
            pass.draw(0..3, 0..1)
        });
        let found = lvk_tests::compute::read_words(&ctx, *counter, 1)[0];
        assert!(invocations.contains(&found), "{sample_shading}: {found}");
    }
}

/// Strips of an image, 8 pixels wide, of alphas from 0 to 1.
const STRIPS: usize = 9;

/// The red and the alpha of each strip of an image, as the sum over its 8 x 8 pixels; red is 1 where it is drawn.
fn strips(ctx: &Context, alpha_to_coverage: bool) -> [[f32; 2]; STRIPS] {
    let fragment = "
        layout(location = 0) out vec4 result;
        void main() { result = vec4(1, 1, 1, float(int(gl_FragCoord.x) / 8) / 8.0); }";
    let (format, size) = (Format::Rgba8Unorm, [8 * STRIPS as u32, 8]);
    let color = [format.into()];
    let desc = RenderPipelineDesc { color: &color, alpha_to_coverage, ..Default::default() };
    let pipeline = make(ctx, fragment, &desc).unwrap();
    let (drawn, one) = (many(ctx, format, size), target(ctx, format, size));
    let color = [resolved(*drawn, *one)];
    run_pass(ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [0.0; 4], 0.0)
    });
    let mut sums = [[0.0; 2]; STRIPS];
    for (at, [red, _, _, alpha]) in pixels::<[u8; 4]>(ctx, *one).into_iter().enumerate() {
        // Quarters of 255 are rounded.
        let samples = f32::from(red) * SAMPLES as f32 / 255.0;
        assert!((samples - samples.round()).abs() < 0.02, "{red} is no number of {SAMPLES} samples");
        let sum = &mut sums[at % size[0] as usize / 8];
        *sum = [sum[0] + samples.round() / SAMPLES as f32, sum[1] + f32::from(alpha) / 255.0];
    }
    sums
}

/// The device chooses the samples that an alpha covers, and whether pixels differ in them. Their number is defined.
#[test]
fn coverage_grows_with_alpha_where_it_is_asked_for() {
    let Some(ctx) = device() else { return };
    let covered = strips(&ctx, true).map(|[red, _]| red / 64.0);
    assert_eq!((covered[0], covered[STRIPS - 1]), (0.0, 1.0), "{covered:?}");
    assert!(covered.is_sorted(), "{covered:?}");
    for (strip, share) in covered.iter().enumerate() {
        let alpha = strip as f32 / 8.0;
        assert!((share - alpha).abs() <= 1.0 / SAMPLES as f32, "alpha {alpha} covers {share}: {covered:?}");
    }
    let plain = strips(&ctx, false);
    for (strip, [red, alpha]) in plain.into_iter().enumerate() {
        assert_eq!(red, 64.0, "strip {strip} of {plain:?}");
        assert!((alpha / 64.0 - strip as f32 / 8.0).abs() < 1.0 / 255.0, "strip {strip} of {plain:?}");
    }
}

#[test]
fn colour_depth_and_stencil_are_resolved_by_their_modes() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::SampleRateShading)) else { return };
    let format = Format::D32FloatS8;
    let limits = ctx.capabilities().limits.depth_resolve;
    assert!(limits.depth.contains(ResolveModes::SAMPLE_ZERO));
    let replace = StencilFace { pass: StencilOp::Replace, ..Default::default() };
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc {
        color: &color,
        depth: Some(DepthTest { format, compare: CompareOp::Always, write: true }),
        stencil: Some(StencilTest::both(replace)),
        ..Default::default()
    };
    let pipeline = make(&ctx, BY_SAMPLE, &desc).unwrap();
    let modes = [
        (ResolveMode::SampleZero, 0.5),
        (ResolveMode::Average, 0.46875),
        (ResolveMode::Min, 0.25),
        (ResolveMode::Max, 0.75),
    ];
    let (drawn, tested) = (many(&ctx, Format::R32Float, [2, 1]), many(&ctx, format, [2, 1]));
    for (mode, expected) in modes {
        let stencil = Some(if mode == ResolveMode::Average { ResolveMode::SampleZero } else { mode });
        let (one, depth_one) = (target(&ctx, Format::R32Float, [2, 1]), target(&ctx, format, [2, 1]));
        let resolve = DepthResolve { texture: *depth_one, mip: 0, layer: 0, depth: Some(mode), stencil };
        let color = [resolved(*drawn, *one)];
        let depth = DepthAttachment {
            stencil: StencilLoadOp::Clear(1),
            resolve: Some(resolve),
            ..DepthAttachment::clear(*tested, 0.0)
        };
        let desc = RenderPassDesc { color: &color, depth: Some(depth), ..Default::default() };
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let mut pass = match cmd.begin_rendering(&desc) {
            Ok(pass) => pass,
            Err(Error::Unsupported { .. }) => {
                eprintln!("NOT TESTED, no depth resolve by {mode:?} and {stencil:?}: {limits:?}");
                continue;
            }
            Err(other) => unreachable!("{other}"),
        };
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.stencil_reference(77, 77).unwrap();
        paint(&mut pass, [0.0; 4], 0.0).unwrap();
        drop(pass);
        ctx.submit(cmd).unwrap();
        assert_eq!(pixels::<f32>(&ctx, *one), [0.46875; 2]);
        assert_eq!(pixels::<f32>(&ctx, *depth_one), [expected; 2], "{mode:?}");
        assert_eq!(equal_to(&ctx, *depth_one, 77), [1.0; 2], "{mode:?}");
    }
}

/// 1 where the stencil is `value`.
fn equal_to(ctx: &Context, tested: TextureHandle, value: u8) -> Vec<f32> {
    let format = Format::D32FloatS8;
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc {
        color: &color,
        depth: Some(DepthTest { format, compare: CompareOp::Always, write: false }),
        stencil: Some(StencilTest::both(StencilFace { compare: CompareOp::Equal, ..Default::default() })),
        ..Default::default()
    };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let pipeline = staged_pipeline(ctx, &stages, &desc).unwrap();
    let drawn = target(ctx, Format::R32Float, [2, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let depth = Some(DepthAttachment::load(tested));
    run_pass(ctx, &RenderPassDesc { color: &color, depth, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.stencil_reference(value, value).unwrap();
        paint(pass, [1.0; 4], 0.0)
    });
    pixels(ctx, drawn.handle())
}

/// Integers have no mean. Vulkan asks for the first sample; NVIDIA's driver (580.159.04) takes another one.
#[test]
fn integers_are_resolved_to_one_of_their_samples() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::SampleRateShading)) else { return };
    let usage = TextureUsage::TARGET;
    let format = Format::R32Uint;
    let desc = TextureDesc { format, extent: [1, 1], usage, samples: SAMPLES, ..Default::default() };
    let Ok(drawn) = ctx.create_texture(&desc) else {
        eprintln!("NOT TESTED, no {SAMPLES} samples of integers");
        return;
    };
    let fragment = "
        layout(location = 0) out uvec4 result;
        void main() { result = uvec4(1 << 4 * gl_SampleID); }";
    let color = [format.into()];
    let cover = "void main() {
        gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0, 1); }";
    let stages = [(ShaderStage::Vertex, cover), (ShaderStage::Fragment, fragment)];
    let desc = RenderPipelineDesc { color: &color, samples: SAMPLES, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let one = target(&ctx, format, [1, 1]);
    let color = [ColorAttachment { load: lvk::ColorLoadOp::ClearUint([0; 4]), ..resolved(*drawn, *one) }];
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw(0..3, 0..1)
    });
    let resolved = pixels::<u32>(&ctx, *one)[0];
    assert!((0..SAMPLES).any(|sample| resolved == 1 << (4 * sample)), "{resolved}");
}

#[test]
fn textures_that_cannot_be_resolved_are_refused() {
    let Some(ctx) = device() else { return };
    let (four, depth_four) = (many(&ctx, Format::R32Float, [2, 2]), many(&ctx, Format::D32Float, [2, 2]));
    let (one, other) = (target(&ctx, Format::R32Float, [2, 2]), target(&ctx, Format::Rgba8Unorm, [2, 2]));
    let (small, depth_one) = (target(&ctx, Format::R32Float, [1, 2]), target(&ctx, Format::D32Float, [2, 2]));
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut begin = |from: &Holder<TextureHandle>, to: &Holder<TextureHandle>, words: &str| {
        let color = [resolved(**from, **to)];
        usage_error(cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }), words);
    };
    begin(&one, &one, "from several samples a pixel to one");
    begin(&four, &four, "from several samples a pixel to one");
    begin(&four, &other, "a resolve keeps it");
    begin(&four, &small, "[1, 2]");
    let mut begin = |depth: Option<ResolveMode>| {
        let resolve = Some(DepthResolve { texture: *depth_one, mip: 0, layer: 0, depth, stencil: None });
        let depth = Some(DepthAttachment { resolve, ..DepthAttachment::clear(*depth_four, 0.0) });
        cmd.begin_rendering(&RenderPassDesc { depth, ..Default::default() }).map(drop)
    };
    usage_error(begin(None), "a mode of depth");
    let modes = ctx.capabilities().limits.depth_resolve.depth;
    for (mode, bit) in [(ResolveMode::Min, ResolveModes::MIN), (ResolveMode::Average, ResolveModes::AVERAGE)]
    {
        if !modes.contains(bit) {
            unsupported(begin(Some(mode)), "resolving depth");
        }
    }
    begin(Some(ResolveMode::SampleZero)).unwrap();
    let mixed = [ColorAttachment::clear(*four, [0.0; 4]), ColorAttachment::clear(*other, [0.0; 4])];
    usage_error(cmd.begin_rendering(&RenderPassDesc { color: &mixed, ..Default::default() }), "samples");
    ctx.submit(cmd).unwrap();
}

#[test]
fn pipelines_have_the_samples_of_the_device_and_of_the_pass() {
    let Some(ctx) = device() else { return };
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let with = |samples| staged_pipeline(&ctx, &stages, &RenderPipelineDesc { samples, ..desc });
    for samples in [0, 3, 128] {
        usage_error(with(samples), "samples are 1, 2, 4");
    }
    if ctx.capabilities().limits.color_samples & 64 == 0 {
        unsupported(with(64), "64 samples a pixel of R32Float");
    }
    for sample_shading in [-0.5, 1.5, f32::NAN] {
        let desc = RenderPipelineDesc { sample_shading, ..desc };
        usage_error(make(&ctx, PAINT, &desc), "from 0 to 1");
    }
    let (one, four) = (with(1).unwrap(), with(SAMPLES).unwrap());
    let (drawn, plain) = (many(&ctx, Format::R32Float, [1, 1]), target(&ctx, Format::R32Float, [1, 1]));
    for (texture, fits, wrong) in [(&drawn, &four, &one), (&plain, &one, &four)] {
        let color = [ColorAttachment::clear(**texture, [0.0; 4])];
        run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
            usage_error(pass.bind_render_pipeline(**wrong), "4 samples a pixel");
            pass.bind_render_pipeline(**fits)
        });
    }
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let shaded = RenderPipelineDesc { sample_shading: 1.0, ..desc };
    unsupported(make(&bare, PAINT, &shaded), "sampleRateShading");
}
