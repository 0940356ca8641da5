//! Fragment shaders that read input attachments of their own pass: the same bits as a second pass, orders of draws,
//! samples and views.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, ColorLoadOp, ColorTarget, CompareOp, Context, Dependencies, DepthAttachment, DepthState,
    DeviceProfile, Error, Format, OptionalFeature, RenderPassDesc, RenderPipelineDesc, Resolve, ShaderStage,
    StencilFace, StencilOp, StencilTest, TextureDesc, TextureHandle, TextureKind, TextureMemory,
    TextureRegion, TextureUsage,
};
use lvk_tests::local_read::{READ, SIZE, color_pipeline, depth_test, input};
use lvk_tests::raster::{COVER, has, paint, pixels, run_pass, staged_pipeline, target};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{device, device_with};

/// A colour, a number and a depth that differ from pixel to pixel.
const PATTERN: &str = "
    layout(location = 0) out vec4 color;
    layout(location = 1) out uint number;
    void main() {
        uvec2 at = uvec2(gl_FragCoord.xy);
        color = vec4(at.x * 7u % 23u, at.y * 5u % 17u, (at.x + at.y) % 11u, 40u) / 40.0;
        number = at.x * 2654435761u ^ at.y * 40503u;
        gl_FragDepth = float((at.x * 13u + at.y * 29u) % 101u) / 128.0 + 0.1;
    }";

/// Combination of the inputs, equal for both passes.
const COMBINE: &str = "
    vec4 combine(vec4 color, uint number, float depth) {
        return vec4(sqrt(color.rg) * depth, float(number >> 8) / 16777216.0, color.b - 1.0 / (depth + color.a));
    }";

const BY_INPUTS: &str = "
    LVK_INPUT(0, subpassInput, gColor);
    LVK_INPUT(1, usubpassInput, gNumber);
    LVK_DEPTH_INPUT(subpassInput, gDepth);
    layout(location = 2) out vec4 result;
    void main() {
        result = combine(subpassLoad(gColor), subpassLoad(gNumber).r, subpassLoad(gDepth).r);
    }";

const BY_TEXTURES: &str = "
    layout(push_constant, scalar) uniform Push { uvec3 textures; uint sam; };
    layout(location = 0) out vec4 result;
    void main() {
        ivec2 at = ivec2(gl_FragCoord.xy);
        vec4 color = texelFetch(sampler2D(kTextures2D[textures.x], kSamplers[sam]), at, 0);
        uint number = texelFetch(usampler2D(kTexturesU2D[textures.y], kSamplers[sam]), at, 0).r;
        result = combine(color, number, texelFetch(sampler2D(kTextures2D[textures.z], kSamplers[sam]), at, 0).r);
    }";

fn cleared(texture: TextureHandle, format: Format) -> ColorAttachment {
    let load =
        if format == Format::R32Uint { ColorLoadOp::ClearUint([9; 4]) } else { ColorLoadOp::Clear([0.5; 4]) };
    ColorAttachment { load, ..ColorAttachment::clear(texture, [0.0; 4]) }
}

const TARGETS: [Format; 3] = [Format::Rgba8Unorm, Format::R32Uint, Format::Rgba32Float];

/// The image of one pass that draws the pattern and reads it.
fn in_one_pass(ctx: &Context, depth: Format) -> Vec<u32> {
    drawn_and_read(ctx, depth, true)
}

/// The same, where depth is written by the pipeline, or else by the state of the pass, twice with a wait between.
fn drawn_and_read(ctx: &Context, depth: Format, by_pipeline: bool) -> Vec<u32> {
    let textures = [input(ctx, TARGETS[0]), input(ctx, TARGETS[1]), target(ctx, TARGETS[2], SIZE)];
    let deep = input(ctx, depth);
    let targets = TARGETS.map(ColorTarget::new);
    let desc = RenderPipelineDesc { color: &targets, debug_name: "one pass", ..Default::default() };
    let draw = RenderPipelineDesc { depth: depth_test(depth, by_pipeline), ..desc };
    let read = RenderPipelineDesc { depth: depth_test(depth, false), ..desc };
    let draw = color_pipeline(ctx, PATTERN, &draw).unwrap();
    let read = color_pipeline(ctx, &format!("{COMBINE}{BY_INPUTS}"), &read).unwrap();
    let color = [0, 1, 2].map(|place| cleared(*textures[place], TARGETS[place]));
    let desc = RenderPassDesc {
        color: &color,
        depth: Some(DepthAttachment::clear(*deep, 1.0)),
        local_read: true,
        debug_name: "draw and read",
        ..Default::default()
    };
    run_pass(ctx, &desc, |pass| {
        pass.bind_render_pipeline(*draw)?;
        if !by_pipeline {
            pass.depth_state(DepthState { compare: CompareOp::Always, write: true })?;
            pass.draw(0..3, 0..1)?;
            pass.read_targets()?;
        }
        pass.draw(0..3, 0..1)?;
        pass.bind_render_pipeline(*read)?;
        pass.draw(0..3, 0..1)
    });
    pixels(ctx, *textures[2])
}

/// The same by a second pass, which samples what the first has drawn.
fn in_two_passes(ctx: &Context, depth: Format) -> Vec<u32> {
    let textures = TARGETS.map(|format| target(ctx, format, SIZE));
    let deep = target(ctx, depth, SIZE);
    let [first, number, last] = TARGETS.map(ColorTarget::new);
    let drawn = [first, number];
    let draw = RenderPipelineDesc { color: &drawn, depth: depth_test(depth, true), ..Default::default() };
    let draw = color_pipeline(ctx, PATTERN, &draw).unwrap();
    let last = [last];
    let read = RenderPipelineDesc { color: &last, ..Default::default() };
    let read = color_pipeline(ctx, &format!("{COMBINE}{BY_TEXTURES}"), &read).unwrap();
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = [0, 1].map(|place| cleared(*textures[place], TARGETS[place]));
    let depth = Some(DepthAttachment::clear(*deep, 1.0));
    let mut pass =
        cmd.begin_rendering(&RenderPassDesc { color: &color, depth, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*draw).unwrap();
    pass.draw(0..3, 0..1).unwrap();
    drop(pass);
    let color = [cleared(*textures[2], TARGETS[2])];
    let dependencies =
        Dependencies { sampled_images: &[*textures[0], *textures[1], *deep], ..Default::default() };
    let mut pass =
        cmd.begin_rendering(&RenderPassDesc { color: &color, dependencies, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*read).unwrap();
    pass.push_constants(&[textures[0].index(), textures[1].index(), deep.index(), sampler.index()]).unwrap();
    pass.draw(0..3, 0..1).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    pixels(ctx, *textures[2])
}

fn one_pass_is_two(ctx: &Context) {
    if !has(ctx, OptionalFeature::LocalRead) {
        return;
    }
    for depth in [Format::D32Float, Format::D16Unorm, Format::D32FloatS8] {
        if ctx.format_support(depth).unwrap().target {
            let (one, two) = (in_one_pass(ctx, depth), in_two_passes(ctx, depth));
            assert!(one == two, "{depth:?}");
            let mut kinds = one.clone();
            kinds.sort_unstable();
            kinds.dedup();
            assert!(kinds.len() > 300, "{depth:?}: {} values", kinds.len());
        }
    }
}

#[test]
fn one_pass_has_the_bits_of_two() {
    let Some(ctx) = device() else { return };
    one_pass_is_two(&ctx);
}

/// Another driver, which has fewer inputs at least than ten or is right in another way.
#[test]
fn one_pass_has_the_bits_of_two_on_another_driver() {
    on_swiftshader(one_pass_has_the_bits_of_two_on_another_driver, || {
        let Some(ctx) = device() else { return };
        one_pass_is_two(&ctx);
        assert_places_are_limited(&ctx);
    });
}

/// A shader may not read more input attachments than the device supports; stencil is the last of ten here.
fn assert_places_are_limited(ctx: &Context) {
    let places = u64::from(ctx.capabilities().limits.max_input_attachments);
    let source = lvk::ShaderSource::Glsl(
        "LVK_STENCIL_INPUT(usubpassInput, gStencil);
         layout(location = 0) out vec4 result;
         void main() { result = vec4(subpassLoad(gStencil)); }",
    );
    let stage = ShaderStage::Fragment;
    let desc = lvk::ShaderModuleDesc { stage, source, debug_name: "marks", ..Default::default() };
    match ctx.create_shader_module(&desc) {
        Err(Error::LimitExceeded { object, requested: 10, limit, .. }) if places < 10 => {
            assert_eq!((object.as_str(), limit), ("marks", places));
        }
        made => assert!(places == 10 && made.is_ok(), "{places} places: {made:?}"),
    }
}

/// Modules whose indices are looked up read targets too.
#[test]
fn one_pass_has_the_bits_of_two_where_indices_are_checked() {
    let Some(ctx) = device_with(|desc| desc.check_indices = true) else { return };
    one_pass_is_two(&ctx);
    assert_eq!(ctx.index_faults().unwrap(), []);
}

/// A pipeline that reads and writes one target: by `read_targets` each draw sees the one before. More passes than are made
/// ready at once, in several command buffers.
#[test]
fn draws_see_those_before_them() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let fragment = "
        LVK_INPUT(0, subpassInput, gBefore);
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        layout(location = 0) out vec4 result;
        void main() { result = subpassLoad(gBefore) * 2.0 + color; }";
    let color = [Format::Rgba32Float.into()];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, fragment)];
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let drawn = input(&ctx, Format::Rgba32Float);
    let mut expected = [1.0_f32, 2.0, 3.0, 4.0];
    let mut load = ColorLoadOp::Clear(expected);
    for round in 0..3 {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        for step in 0..5 {
            let color = [ColorAttachment { load, ..ColorAttachment::clear(*drawn, [0.0; 4]) }];
            load = ColorLoadOp::Load;
            let desc = RenderPassDesc { color: &color, local_read: true, ..Default::default() };
            let mut pass = cmd.begin_rendering(&desc).unwrap();
            pass.bind_render_pipeline(*pipeline).unwrap();
            for draw in 0..2 {
                let added = [round, step, draw, 1].map(|value| value as f32);
                paint(&mut pass, added, 0.0).unwrap();
                pass.read_targets().unwrap();
                expected = std::array::from_fn(|channel| expected[channel] * 2.0 + added[channel]);
            }
        }
        ctx.submit(cmd).unwrap();
    }
    let found = pixels::<[f32; 4]>(&ctx, *drawn);
    assert!(found.iter().all(|pixel| *pixel == expected), "{:?} is not {expected:?}", found[0]);
}

/// Two pipelines alternate, and each reads the output of the other. The test records no barrier.
#[test]
fn pipelines_wait_for_each_other() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let text = |from: u32, to: u32| {
        format!(
            "LVK_INPUT({from}, subpassInput, gOther);
             layout(location = {to}) out vec4 result;
             void main() {{ result = subpassLoad(gOther) * vec4(3, 2, 1, 1) + vec4(1, {to}, 0, 0); }}"
        )
    };
    let color = [Format::Rgba32Float.into(); 2];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let pipelines = [(0, 1), (1, 0)].map(|(from, to)| color_pipeline(&ctx, &text(from, to), &desc).unwrap());
    let textures = [input(&ctx, Format::Rgba32Float), input(&ctx, Format::Rgba32Float)];
    let color = [0, 1].map(|place| ColorAttachment::clear(*textures[place], [place as f32, 1.0, 2.0, 3.0]));
    let mut expected = color.map(|attachment| match attachment.load {
        ColorLoadOp::Clear(color) => color,
        _ => unreachable!("the targets are cleared"),
    });
    run_pass(&ctx, &RenderPassDesc { color: &color, local_read: true, ..Default::default() }, |pass| {
        for turn in 0..6 {
            pass.bind_render_pipeline(*pipelines[turn % 2])?;
            pass.draw(0..3, 0..1)?;
            let (from, to) = (turn % 2, 1 - turn % 2);
            let [x, y, z, w] = expected[from];
            expected[to] = [x * 3.0 + 1.0, y * 2.0 + to as f32, z, w];
        }
        Ok(())
    });
    for (texture, expected) in textures.iter().zip(expected) {
        assert!(pixels::<[f32; 4]>(&ctx, **texture).iter().all(|pixel| *pixel == expected));
    }
}

/// Each fragment of a sample reads that sample, as a fetch from the texture does; nothing of the samples is kept.
#[test]
fn samples_are_read_one_by_one() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::LocalRead) || !has(&ctx, OptionalFeature::SampleRateShading) {
        return;
    }
    let by_sample = "
        layout(location = 0) out vec4 result;
        void main() { result = vec4(gl_FragCoord.xy + gl_SampleID * 100.0, gl_SampleID, 1); }";
    let read = "
        LVK_INPUT(0, subpassInputMS, gSamples);
        layout(location = 1) out vec4 result;
        void main() { result = subpassLoad(gSamples, gl_SampleID) * vec4(1, 1, gl_SampleID, 1); }";
    let formats = [Format::Rgba32Float.into(); 2];
    let desc = RenderPipelineDesc { color: &formats, samples: 4, ..Default::default() };
    let [draw, read] = [by_sample, read].map(|text| color_pipeline(&ctx, text, &desc).unwrap());
    let many = |usage| {
        let desc = TextureDesc {
            format: Format::Rgba32Float,
            extent: SIZE,
            samples: 4,
            usage,
            memory: TextureMemory::Transient,
            debug_name: "samples",
            ..Default::default()
        };
        ctx.create_texture(&desc).unwrap()
    };
    let (samples, lit) = (many(READ), many(TextureUsage::TARGET));
    let image = target(&ctx, Format::Rgba32Float, SIZE);
    let gone = ColorAttachment { store: false, ..ColorAttachment::clear(*samples, [0.0; 4]) };
    let resolve = Some(Resolve { texture: *image, mip: 0, layer: 0 });
    let color = [gone, ColorAttachment { texture: *lit, resolve, ..gone }];
    run_pass(&ctx, &RenderPassDesc { color: &color, local_read: true, ..Default::default() }, |pass| {
        for pipeline in [&draw, &read] {
            pass.bind_render_pipeline(**pipeline)?;
            pass.draw(0..3, 0..1)?;
        }
        Ok(())
    });
    let found = pixels::<[f32; 4]>(&ctx, *image);
    for (at, [_, _, square, one]) in found.iter().enumerate() {
        assert_eq!(([*square, *one], at), ([(1.0 + 4.0 + 9.0) / 4.0, 1.0], at));
    }
    // Samples lie around the middle of a pixel, so that their mean is near.
    let [x, y, ..] = found[(3 * SIZE[0] + 5) as usize];
    assert!((x - 155.5).abs() < 0.3 && (y - 153.5).abs() < 0.3, "{x} {y}");
}

/// Every view and every layer reads its own.
#[test]
fn views_read_their_own_layer() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::LocalRead) || !has(&ctx, OptionalFeature::Multiview) {
        return;
    }
    let draw = "
        #extension GL_EXT_multiview : require
        layout(location = 0) out vec4 result;
        void main() { result = vec4(10 + gl_ViewIndex, gl_FragCoord.x, 0, 1); }";
    let read = "
        LVK_INPUT(0, subpassInput, gDrawn);
        layout(location = 1) out vec4 result;
        void main() { result = subpassLoad(gDrawn) * 2.0; }";
    let formats = [Format::Rgba32Float.into(); 2];
    let desc = RenderPipelineDesc { color: &formats, view_mask: 0b101, ..Default::default() };
    let [draw, read] = [draw, read].map(|text| color_pipeline(&ctx, text, &desc).unwrap());
    let textures = [READ, TextureUsage::TARGET].map(|usage| {
        let kind = TextureKind::D2Array { layers: 4 };
        let desc =
            TextureDesc { kind, format: Format::Rgba32Float, extent: [4, 4], usage, ..Default::default() };
        ctx.create_texture(&desc).unwrap()
    });
    let color = textures.each_ref().map(|texture| ColorAttachment::clear(**texture, [7.0; 4]));
    let color = color.map(|color| ColorAttachment { layer: 1, ..color });
    let pass = RenderPassDesc { color: &color, view_mask: 0b101, local_read: true, ..Default::default() };
    run_pass(&ctx, &pass, |pass| {
        for pipeline in [&draw, &read] {
            pass.bind_render_pipeline(**pipeline)?;
            pass.draw(0..3, 0..1)?;
        }
        Ok(())
    });
    for (layer, view) in [(1, 0.0), (3, 2.0)] {
        let region = TextureRegion { layer, ..Default::default() };
        let bytes = ctx.download_texture(*textures[1], &region).unwrap();
        let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        for (at, texel) in texels.iter().enumerate() {
            assert_eq!(*texel, [20.0 + 2.0 * view, (at % 4) as f32 * 2.0 + 1.0, 0.0, 2.0], "layer {layer}");
        }
    }
}

/// Stencil as numbers, beside depth of the same texture.
#[test]
fn stencil_is_read() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::LocalRead) || !ctx.format_support(Format::D32FloatS8).unwrap().target {
        return;
    }
    if ctx.capabilities().limits.max_input_attachments < 10 {
        eprintln!("NOT TESTED, {} has too few input attachments", ctx.capabilities().device_name);
        return;
    }
    let text = "
        LVK_DEPTH_INPUT(subpassInput, gDepth);
        LVK_STENCIL_INPUT(usubpassInput, gStencil);
        layout(location = 0) out vec4 result;
        void main() { result = vec4(subpassLoad(gDepth).r, subpassLoad(gStencil).r, 0, 1); }";
    let format = Format::D32FloatS8;
    let formats = [Format::Rgba32Float.into()];
    let desc = RenderPipelineDesc { color: &formats, ..Default::default() };
    let face = StencilFace { pass: StencilOp::Replace, ..StencilFace::default() };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, "void main() {}")];
    let stencil = Some(StencilTest::both(face));
    let mark = RenderPipelineDesc { depth: depth_test(format, true), stencil, ..desc };
    let mark = staged_pipeline(&ctx, &stages, &mark).unwrap();
    let read = RenderPipelineDesc { depth: depth_test(format, false), ..desc };
    let read = color_pipeline(&ctx, text, &read).unwrap();
    let (drawn, deep) = (target(&ctx, Format::Rgba32Float, SIZE), input(&ctx, format));
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let depth = Some(DepthAttachment::clear(*deep, 1.0));
    let [width, height] = SIZE;
    run_pass(
        &ctx,
        &RenderPassDesc { color: &color, depth, local_read: true, ..Default::default() },
        |pass| {
            pass.bind_render_pipeline(*mark)?;
            for column in 0..width {
                pass.stencil_reference(column as u8 * 11, column as u8 * 11).unwrap();
                pass.scissor([column, 0], [1, height])?;
                paint(pass, [0.0; 4], column as f32 / 32.0)?;
            }
            pass.scissor([0, 0], SIZE)?;
            pass.bind_render_pipeline(*read)?;
            pass.draw(0..3, 0..1)
        },
    );
    for (at, pixel) in pixels::<[f32; 4]>(&ctx, *drawn).iter().enumerate() {
        let column = (at % width as usize) as f32;
        assert_eq!(*pixel, [column / 32.0, column * 11.0, 0.0, 1.0], "{at}");
    }
}

/// A pass reads what another command wrote before it, and a depth target that it only tests against.
#[test]
fn shaders_read_loaded_contents() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let read = "
        LVK_INPUT(0, subpassInput, gLoaded);
        LVK_DEPTH_INPUT(subpassInput, gDepth);
        layout(location = 1) out vec4 result;
        void main() { result = subpassLoad(gLoaded) + subpassLoad(gDepth).r; }";
    let formats = [Format::Rgba32Float.into(); 2];
    let depth = depth_test(Format::D32Float, false);
    let desc = RenderPipelineDesc { color: &formats, depth, ..Default::default() };
    let read = color_pipeline(&ctx, read, &desc).unwrap();
    let (loaded, drawn) = (input(&ctx, Format::Rgba32Float), target(&ctx, Format::Rgba32Float, SIZE));
    let deep = input(&ctx, Format::D32Float);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.clear_texture(*loaded, lvk::ClearValue::Color([1.0, 2.0, 3.0, 4.0]), &Default::default()).unwrap();
    cmd.clear_texture(*deep, lvk::ClearValue::Depth(0.25), &Default::default()).unwrap();
    for _ in 0..2 {
        let kept = ColorAttachment { load: ColorLoadOp::Load, ..ColorAttachment::clear(*loaded, [0.0; 4]) };
        let color = [kept, ColorAttachment::clear(*drawn, [9.0; 4])];
        let depth = Some(DepthAttachment::read_only(*deep));
        let desc = RenderPassDesc { color: &color, depth, local_read: true, ..Default::default() };
        let mut pass = cmd.begin_rendering(&desc).unwrap();
        pass.bind_render_pipeline(*read).unwrap();
        pass.draw(0..3, 0..1).unwrap();
    }
    ctx.submit(cmd).unwrap();
    let found = pixels::<[f32; 4]>(&ctx, *drawn);
    assert!(found.iter().all(|pixel| *pixel == [1.25, 2.25, 3.25, 4.25]), "{:?}", found[0]);
    let kept = pixels::<[f32; 4]>(&ctx, *loaded);
    assert!(kept.iter().all(|pixel| *pixel == [1.0, 2.0, 3.0, 4.0]), "no output, so nothing was written");
}

/// Also behind a wait, after which the state still is what was set.
#[test]
fn depth_that_the_state_of_a_pass_writes_is_waited_for() {
    let Some(ctx) = device() else { return };
    if has(&ctx, OptionalFeature::LocalRead) {
        let depth = Format::D32Float;
        assert_eq!(drawn_and_read(&ctx, depth, false), in_two_passes(&ctx, depth));
    }
}

/// Passes and pipelines without inputs are what they were.
#[test]
fn devices_without_local_reads_draw_in_two_passes() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let image = in_two_passes(&ctx, Format::D32Float);
    assert_eq!(image.len(), (SIZE[0] * SIZE[1] * 4) as usize);
}
