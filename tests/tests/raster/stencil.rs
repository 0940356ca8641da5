//! Stencil and depth state: operations, masks, faces, loads and stores, read-only targets, and dynamic state.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, ColorLoadOp, CompareOp, Context, CullMode, Dependencies, DepthAttachment, DepthLoadOp,
    DepthState, DepthTest, Format, Holder, RenderPass, RenderPassDesc, RenderPipelineDesc,
    RenderPipelineHandle, ShaderStage, StencilFace, StencilLoadOp, StencilOp, StencilTest, TextureHandle,
};
use lvk_tests::device;
use lvk_tests::raster::{COVER, PAINT, paint, pixels, run_pass, staged_pipeline, target, usage_error};

const BOTH: Format = Format::D32FloatS8;
/// Tests nothing and leaves the depth alone.
const NO_DEPTH: DepthTest = DepthTest { format: BOTH, compare: CompareOp::Always, write: false };
const KEEP: StencilFace = StencilFace {
    compare: CompareOp::Always,
    fail: StencilOp::Keep,
    depth_fail: StencilOp::Keep,
    pass: StencilOp::Keep,
    read_mask: 255,
    write_mask: 255,
};

/// A pipeline of a float target, depth and stencil.
fn pipeline(ctx: &Context, depth: DepthTest, stencil: StencilTest) -> Holder<RenderPipelineHandle> {
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc {
        color: &color,
        depth: Some(depth),
        stencil: Some(stencil),
        ..Default::default()
    };
    staged_pipeline(ctx, &stages, &desc).unwrap()
}

fn both(face: StencilFace) -> StencilTest {
    StencilTest::both(face)
}

/// Draws over `drawn` and `tested`, which is cleared to the depth 0.5 and a stencil value.
fn pass_over(
    ctx: &Context,
    drawn: TextureHandle,
    tested: TextureHandle,
    stencil: u8,
    record: impl FnOnce(&mut RenderPass<'_>) -> lvk::Result<()>,
) {
    let color = [ColorAttachment::clear(drawn, [0.0; 4])];
    let depth =
        DepthAttachment { stencil: StencilLoadOp::Clear(stencil), ..DepthAttachment::clear(tested, 0.5) };
    run_pass(ctx, &RenderPassDesc { color: &color, depth: Some(depth), ..Default::default() }, record);
}

/// The stencil values, found by drawing each candidate where it is equal.
fn stencil_values(ctx: &Context, tested: TextureHandle, size: [u32; 2], candidates: &[u8]) -> Vec<f32> {
    let equal = pipeline(ctx, NO_DEPTH, both(StencilFace { compare: CompareOp::Equal, ..KEEP }));
    let drawn = target(ctx, Format::R32Float, size);
    let color = [ColorAttachment::clear(*drawn, [-1.0; 4])];
    let depth = Some(DepthAttachment::load(tested));
    run_pass(ctx, &RenderPassDesc { color: &color, depth, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*equal)?;
        for candidate in candidates {
            pass.stencil_reference(*candidate, *candidate).unwrap();
            paint(pass, [f32::from(*candidate); 4], 0.0)?;
        }
        Ok(())
    });
    pixels(ctx, *drawn)
}

#[test]
fn operations_change_values_as_their_names_say() {
    let Some(ctx) = device() else { return };
    const REFERENCE: u8 = 0x5a;
    const STARTS: [u8; 3] = [0, 0x0f, 255];
    type Row = (StencilOp, fn(u8) -> u8);
    let table: [Row; 8] = [
        (StencilOp::Keep, |value| value),
        (StencilOp::Zero, |_| 0),
        (StencilOp::Replace, |_| REFERENCE),
        (StencilOp::IncrementClamp, |value| value.saturating_add(1)),
        (StencilOp::DecrementClamp, |value| value.saturating_sub(1)),
        (StencilOp::Invert, |value| !value),
        (StencilOp::IncrementWrap, |value| value.wrapping_add(1)),
        (StencilOp::DecrementWrap, |value| value.wrapping_sub(1)),
    ];
    let size = [table.len() as u32, 1];
    let pipelines: Vec<_> = table
        .iter()
        .map(|(op, _)| pipeline(&ctx, NO_DEPTH, both(StencilFace { pass: *op, ..KEEP })))
        .collect();
    let (drawn, tested) = (target(&ctx, Format::R32Float, size), target(&ctx, BOTH, size));
    for start in STARTS {
        pass_over(&ctx, *drawn, *tested, start, |pass| {
            pass.stencil_reference(REFERENCE, REFERENCE).unwrap();
            for (column, pipeline) in (0..).zip(&pipelines) {
                pass.bind_render_pipeline(**pipeline)?;
                pass.scissor([column, 0], [1, 1])?;
                paint(pass, [1.0; 4], 0.0)?;
            }
            Ok(())
        });
        let expected: Vec<u8> = table.iter().map(|(_, op)| op(start)).collect();
        let found = stencil_values(&ctx, *tested, size, &expected);
        let expected: Vec<f32> = expected.into_iter().map(f32::from).collect();
        assert_eq!(found, expected, "from {start}");
    }
}

/// Three columns: stencil fails, depth fails, both pass. The reference is compared under the mask, and written under the
/// other one.
#[test]
fn each_outcome_has_its_own_operation_under_the_masks() {
    let Some(ctx) = device() else { return };
    let face = StencilFace {
        compare: CompareOp::Equal,
        fail: StencilOp::Zero,
        depth_fail: StencilOp::Invert,
        pass: StencilOp::Replace,
        read_mask: 0x0f,
        write_mask: 0xf1,
    };
    let depth = DepthTest { format: BOTH, compare: CompareOp::Less, write: false };
    let tests = pipeline(&ctx, depth, both(face));
    let (drawn, tested) = (target(&ctx, Format::R32Float, [3, 1]), target(&ctx, BOTH, [3, 1]));
    let start = 0xa6;
    pass_over(&ctx, *drawn, *tested, start, |pass| {
        pass.bind_render_pipeline(*tests)?;
        for (column, (reference, depth)) in (0..).zip([(0x57, 0.25), (0x56, 0.75), (0x56, 0.25)]) {
            pass.scissor([column, 0], [1, 1])?;
            pass.stencil_reference(reference, reference).unwrap();
            paint(pass, [1.0; 4], depth)?;
        }
        Ok(())
    });
    assert_eq!(pixels::<f32>(&ctx, *drawn), [0.0, 0.0, 1.0]);
    let written = |value: u8| (start & !0xf1) | (value & 0xf1);
    let expected = [written(0), written(!start), written(0x56)];
    let found = stencil_values(&ctx, *tested, [3, 1], &expected);
    assert_eq!(found, expected.map(f32::from));
}

/// The same triangle from its front and from its back.
#[test]
fn front_and_back_faces_have_tests_and_references_of_their_own() {
    let Some(ctx) = device() else { return };
    let test = StencilTest {
        front: StencilFace { pass: StencilOp::Replace, ..KEEP },
        back: StencilFace { pass: StencilOp::IncrementWrap, ..KEEP },
    };
    let sides = pipeline(&ctx, NO_DEPTH, test);
    let (drawn, tested) = (target(&ctx, Format::R32Float, [2, 1]), target(&ctx, BOTH, [2, 1]));
    pass_over(&ctx, *drawn, *tested, 7, |pass| {
        pass.bind_render_pipeline(*sides)?;
        pass.stencil_reference(40, 90).unwrap();
        pass.scissor([0, 0], [1, 1])?;
        paint(pass, [1.0; 4], 0.0)?;
        // Seen in a mirror, the winding is the other one.
        pass.viewport([0.0, 1.0, 2.0, -1.0], [0.0, 1.0])?;
        pass.scissor([1, 0], [1, 1])?;
        paint(pass, [1.0; 4], 0.0)
    });
    let mut found = stencil_values(&ctx, *tested, [2, 1], &[7, 8, 40, 90, 91]);
    found.sort_by(f32::total_cmp);
    assert_eq!(found, [8.0, 40.0]);
}

#[test]
fn stencil_is_loaded_cleared_and_stored_apart_from_depth() {
    let Some(ctx) = device() else { return };
    let tested = target(&ctx, BOTH, [1, 1]);
    let clear = |stencil| DepthAttachment { stencil, ..DepthAttachment::clear(*tested, 0.25) };
    let run = |depth: DepthAttachment| {
        run_pass(&ctx, &RenderPassDesc { depth: Some(depth), ..Default::default() }, |_| Ok(()));
        let stencil = stencil_values(&ctx, *tested, [1, 1], &[0, 3, 200])[0];
        (pixels::<f32>(&ctx, *tested)[0], stencil)
    };
    assert_eq!(run(clear(StencilLoadOp::Clear(200))), (0.25, 200.0));
    assert_eq!(
        run(DepthAttachment { load: DepthLoadOp::Clear(0.75), ..clear(StencilLoadOp::Load) }),
        (0.75, 200.0)
    );
    let stencil_alone = DepthAttachment { load: DepthLoadOp::Load, ..clear(StencilLoadOp::Clear(3)) };
    assert_eq!(run(stencil_alone), (0.75, 3.0));
    assert_eq!(run(DepthAttachment::load(*tested)), (0.75, 3.0));
    // Of depth alone what is dropped may be anything; the stencil stays.
    let dropped = DepthAttachment { load: DepthLoadOp::DontCare, store: false, ..clear(StencilLoadOp::Load) };
    assert_eq!(run(dropped).1, 3.0);
}

/// Fragments read the very depth they are tested against.
#[test]
fn a_read_only_target_is_tested_and_sampled_in_one_pass() {
    let Some(ctx) = device() else { return };
    let tested = target(&ctx, Format::D32Float, [4, 1]);
    let format = Format::D32Float;
    let write = DepthTest { format, compare: CompareOp::Always, write: true };
    let stages = [(ShaderStage::Vertex, COVER)];
    let desc = RenderPipelineDesc { depth: Some(write), ..Default::default() };
    let writer = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let depth = Some(DepthAttachment::clear(*tested, 1.0));
    run_pass(&ctx, &RenderPassDesc { depth, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*writer)?;
        for (column, depth) in (0..).zip([0.125, 0.25, 0.5, 0.75]) {
            pass.scissor([column, 0], [1, 1])?;
            paint(pass, [0.0; 4], depth)?;
        }
        Ok(())
    });
    let fragment = "
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        layout(location = 0) out vec4 result;
        void main() {
            result = 2.0 * textureBindlessFetch2D(floatBitsToUint(color.x), ivec2(gl_FragCoord.xy), 0);
        }";
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, fragment)];
    let depth = Some(DepthTest { format, compare: CompareOp::Less, write: false });
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, depth, ..Default::default() };
    let reader = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let drawn = target(&ctx, Format::R32Float, [4, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let desc = RenderPassDesc {
        color: &color,
        depth: Some(DepthAttachment::read_only(*tested)),
        dependencies: Dependencies { sampled_images: &[*tested], ..Default::default() },
        ..Default::default()
    };
    run_pass(&ctx, &desc, |pass| {
        pass.bind_render_pipeline(*reader)?;
        paint(pass, [f32::from_bits(tested.index()), 0.0, 0.0, 0.0], 0.375)
    });
    assert_eq!(pixels::<f32>(&ctx, *drawn), [0.0, 0.0, 1.0, 1.5]);
    assert_eq!(pixels::<f32>(&ctx, *tested), [0.125, 0.25, 0.5, 0.75]);
}

#[test]
fn a_pass_replaces_the_depth_test_until_the_next_pipeline() {
    let Some(ctx) = device() else { return };
    let depth = DepthTest { format: BOTH, compare: CompareOp::Less, write: true };
    let tests = pipeline(&ctx, depth, both(KEEP));
    let (drawn, tested) = (target(&ctx, Format::R32Float, [4, 1]), target(&ctx, BOTH, [4, 1]));
    pass_over(&ctx, *drawn, *tested, 0, |pass| {
        let column = |pass: &mut RenderPass<'_>, column, depth| {
            pass.scissor([column, 0], [1, 1])?;
            paint(pass, [1.0; 4], depth)
        };
        pass.bind_render_pipeline(*tests)?;
        column(pass, 0, 0.75)?;
        pass.depth_state(DepthState { compare: CompareOp::Greater, write: true })?;
        column(pass, 1, 0.75)?;
        pass.depth_state(DepthState { compare: CompareOp::Always, write: false })?;
        column(pass, 2, 0.25)?;
        pass.bind_render_pipeline(*tests)?;
        column(pass, 3, 0.25)
    });
    assert_eq!(pixels::<f32>(&ctx, *drawn), [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(pixels::<f32>(&ctx, *tested), [0.5, 0.75, 0.5, 0.25]);
}

#[test]
fn contradictory_state_is_refused() {
    let Some(ctx) = device() else { return };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let stencil = Some(both(StencilFace { pass: StencilOp::Replace, ..KEEP }));
    let flat = DepthTest { format: Format::D32Float, ..NO_DEPTH };
    for depth in [None, Some(flat)] {
        let desc = RenderPipelineDesc { depth, stencil, debug_name: "stencil", ..Default::default() };
        usage_error(staged_pipeline(&ctx, &stages, &desc), "stencil: a stencil test needs a depth test");
    }
    let (drawn, tested) = (target(&ctx, Format::R32Float, [1, 1]), target(&ctx, BOTH, [1, 1]));
    run_pass(
        &ctx,
        &RenderPassDesc { depth: Some(DepthAttachment::clear(*tested, 1.0)), ..Default::default() },
        |_| Ok(()),
    );
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let only = DepthAttachment::read_only(*tested);
    for depth in [
        DepthAttachment { load: DepthLoadOp::Clear(0.0), ..only },
        DepthAttachment { stencil: StencilLoadOp::Clear(0), ..only },
        DepthAttachment { stencil: StencilLoadOp::DontCare, ..only },
    ] {
        let desc = RenderPassDesc { depth: Some(depth), ..Default::default() };
        usage_error(cmd.begin_rendering(&desc), "DepthAttachment::read_only");
    }
    let writes = DepthTest { write: true, ..NO_DEPTH };
    let [writes_depth, writes_stencil, reads] =
        [(writes, KEEP), (NO_DEPTH, StencilFace { fail: StencilOp::Zero, ..KEEP }), (NO_DEPTH, KEEP)]
            .map(|(depth, face)| pipeline(&ctx, depth, both(face)));
    let color = [ColorAttachment { load: ColorLoadOp::DontCare, ..ColorAttachment::clear(*drawn, [0.0; 4]) }];
    let desc = RenderPassDesc { color: &color, depth: Some(only), ..Default::default() };
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    usage_error(pass.depth_state(NO_DEPTH_STATE), "bind a render pipeline first");
    usage_error(pass.bind_render_pipeline(*writes_depth), "read-only");
    usage_error(pass.bind_render_pipeline(*writes_stencil), "read-only");
    pass.bind_render_pipeline(*reads).unwrap();
    usage_error(pass.depth_state(DepthState { write: true, ..NO_DEPTH_STATE }), "read-only");
    pass.depth_state(NO_DEPTH_STATE).unwrap();
    drop(pass);
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, cull: CullMode::Back, ..Default::default() };
    let plain = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
    pass.bind_render_pipeline(*plain).unwrap();
    usage_error(pass.depth_state(NO_DEPTH_STATE), "no depth test");
    drop(pass);
    ctx.submit(cmd).unwrap();
}

const NO_DEPTH_STATE: DepthState = DepthState { compare: CompareOp::Always, write: false };
