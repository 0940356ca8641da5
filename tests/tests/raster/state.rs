//! Raster state: polygon modes, line widths, depth bias and clamp, triangle fans, and render areas.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, ColorLoadOp, CompareOp, Context, DepthAttachment, DepthBias, DepthTest, DeviceProfile,
    Format, Holder, OptionalFeature, PolygonMode, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle,
    ShaderStage, Topology,
};
use lvk_tests::raster::{
    COVER, PAINT, has, paint, pixels, run_pass, staged_pipeline, target, unsupported, usage_error,
};
use lvk_tests::{device, device_with};

/// Vertices at the centres of pixels of a target of 8 x 8, by number.
const CENTRES: &str = "
    layout(push_constant, scalar) uniform Push { uvec2 at[5]; };
    void main() {
        gl_Position = vec4((vec2(at[gl_VertexIndex]) + 0.5) / 4.0 - 1.0, 0, 1);
        gl_PointSize = 1.0;
    }";

const ONE: &str = "
    layout(location = 0) out vec4 result;
    void main() { result = vec4(1.0); }";

fn make(
    ctx: &Context,
    vertex: &str,
    desc: &RenderPipelineDesc<'_>,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, debug_name: "raster", ..*desc };
    staged_pipeline(ctx, &[(ShaderStage::Vertex, vertex), (ShaderStage::Fragment, ONE)], &desc)
}

/// Returns the values that draws leave at these pixels, by row.
fn drawn(ctx: &Context, desc: &RenderPipelineDesc<'_>, at: &[[u32; 2]]) -> Vec<Vec<bool>> {
    let pipeline = make(ctx, CENTRES, desc).unwrap();
    let drawn = target(ctx, Format::R32Float, [8, 8]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        let mut push = [[0_u32; 2]; 5];
        push[..at.len()].copy_from_slice(at);
        pass.push_constants(&push)?;
        pass.draw(0..at.len() as u32, 0..1)
    });
    pixels::<f32>(ctx, *drawn).chunks(8).map(|row| row.iter().map(|value| *value > 0.0).collect()).collect()
}

#[test]
fn polygons_are_filled_outlined_or_dotted() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::FillModeNonSolid)) else { return };
    let corners = [[1, 1], [6, 1], [1, 6]];
    let with = |polygon| drawn(&ctx, &RenderPipelineDesc { polygon, ..Default::default() }, &corners);
    let (lines, dots) = (with(PolygonMode::Line), with(PolygonMode::Point));
    // The inside is open, and the legs lie on pixels, which end at a corner that belongs to the next edge.
    assert!(!lines[3][3] && !lines[2][2] && !lines[2][3], "{lines:?}");
    assert!((2..6).all(|at| lines[1][at] && lines[at][1]), "{lines:?}");
    assert!((2..6).all(|at| lines[7 - at][at]), "{lines:?}");
    for (y, row) in dots.iter().enumerate() {
        for (x, dot) in row.iter().enumerate() {
            assert_eq!(*dot, corners.contains(&[x as u32, y as u32]), "{x} {y}");
        }
    }
    assert!(with(PolygonMode::Fill)[3][3]);
}

#[test]
fn a_fan_turns_around_its_first_vertex() {
    let Some(ctx) = device() else { return };
    let desc = RenderPipelineDesc { topology: Topology::TriangleFan, ..Default::default() };
    let at = [[0, 0], [7, 0], [7, 3], [3, 3], [0, 3]];
    let found = drawn(&ctx, &desc, &at);
    for (y, row) in found.iter().enumerate() {
        for (x, on) in row.iter().enumerate() {
            // Pixels on the border belong to the rectangle or not, by the rule of edges.
            if x != 0 && y != 0 && x != 7 && y != 3 {
                assert_eq!(*on, x < 7 && y < 3, "{x} {y}");
            }
        }
    }
}

#[test]
fn wide_lines_cover_their_width() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::WideLines)) else { return };
    let desc = RenderPipelineDesc { topology: Topology::Lines, ..Default::default() };
    for (line_width, rows) in [(1.0, 3..4), (3.0, 2..5)] {
        let found = drawn(&ctx, &RenderPipelineDesc { line_width, ..desc }, &[[1, 3], [6, 3]]);
        for (y, row) in found.iter().enumerate() {
            assert!((2..6).all(|x| row[x] == rows.contains(&y)), "{line_width}: row {y} {row:?}");
        }
    }
    let too_wide = ctx.capabilities().limits.line_width[1] + 1.0;
    for line_width in [too_wide, 0.0, -1.0, f32::NAN] {
        let wide = RenderPipelineDesc { line_width, ..desc };
        usage_error(make(&ctx, CENTRES, &wide), "pixels wide");
    }
}

/// Depths that a covering triangle leaves, after passes over a target cleared to 0.5.
fn depths(
    ctx: &Context,
    format: Format,
    desc: &RenderPipelineDesc<'_>,
    vertex: &str,
    biases: &[Option<DepthBias>],
) -> Vec<u8> {
    let depth = Some(DepthTest { format, compare: CompareOp::Always, write: true });
    let desc = RenderPipelineDesc { depth, ..*desc };
    let pipeline = staged_pipeline(ctx, &[(ShaderStage::Vertex, vertex)], &desc).unwrap();
    let tested = target(ctx, format, [biases.len() as u32, 1]);
    let depth = Some(DepthAttachment::clear(*tested, 0.5));
    run_pass(ctx, &RenderPassDesc { depth, ..Default::default() }, |pass| {
        for (column, bias) in (0..).zip(biases) {
            pass.bind_render_pipeline(*pipeline)?;
            if let Some(bias) = bias {
                pass.depth_bias(*bias)?;
            }
            pass.scissor([column, 0], [1, 1])?;
            paint(pass, [0.0; 4], 0.25)?;
        }
        Ok(())
    });
    ctx.download_texture(*tested, &Default::default()).unwrap()
}

#[test]
fn depth_bias_moves_depths_by_units() {
    let Some(ctx) = device() else { return };
    let constant = |constant| DepthBias { constant, ..Default::default() };
    let desc = RenderPipelineDesc { depth_bias: Some(constant(5.0)), ..Default::default() };
    let clamped = DepthBias { clamp: 3.0 / 65535.0, ..constant(100.0) };
    let bounded = has(&ctx, OptionalFeature::DepthBiasClamp).then_some(clamped);
    let biases = [None, Some(constant(0.0)), Some(constant(-8.0)), bounded, None];
    let bytes = depths(&ctx, Format::D16Unorm, &desc, COVER, &biases);
    let found: Vec<i32> = bytes.chunks(2).map(|two| u16::from_le_bytes([two[0], two[1]]).into()).collect();
    let plain = found[1];
    assert!((plain - 16384).abs() <= 1, "{plain}");
    let moved: Vec<i32> = found.iter().map(|depth| depth - plain).collect();
    // The device defines the unit: at most two steps of the format.
    let unit = if moved[0] > 7 { 2 } else { 1 };
    let expected = [5 * unit, 0, -8 * unit, if bounded.is_some() { 3 } else { 5 * unit }, 5 * unit];
    assert!(moved.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= 1), "{moved:?}");
}

/// The triangle's depth rises by 1/64 a pixel.
#[test]
fn depth_bias_grows_with_the_slope() {
    let Some(ctx) = device() else { return };
    let vertex = "
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        void main() {
            vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
            gl_Position = vec4(corner, depth + (corner.x + 1.0) / 2.0 / 16.0, 1.0);
        }";
    let bias = |slope| Some(DepthBias { slope, ..Default::default() });
    let desc = RenderPipelineDesc { depth_bias: bias(0.0), ..Default::default() };
    let biases = [None, bias(2.0), bias(-1.0), None];
    let bytes = depths(&ctx, Format::D32Float, &desc, vertex, &biases);
    let found: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
    for (x, (found, slope)) in found.iter().zip([0.0, 2.0, -1.0, 0.0]).enumerate() {
        let expected = 0.25 + (x as f32 + 0.5) / 64.0 + slope / 64.0;
        assert!((found - expected).abs() < 1e-4, "{x}: {found}, not {expected}");
    }
}

#[test]
fn depths_beyond_the_range_are_clipped_or_clamped() {
    let Some(ctx) = device() else { return };
    let clamp = has(&ctx, OptionalFeature::DepthClamp);
    for (depth_clamp, expected) in [(false, 0.5), (true, 1.0)] {
        if depth_clamp && !clamp {
            continue;
        }
        let vertex = "
            layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
            void main() {
                vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
                gl_Position = vec4(corner * 4.0 - 1.0, depth * 5.0, 1.0);
            }";
        let desc = RenderPipelineDesc { depth_clamp, ..Default::default() };
        let bytes = depths(&ctx, Format::D32Float, &desc, vertex, &[None]);
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&bytes), [expected], "{depth_clamp}");
    }
}

/// Loads, clears and draws stay inside; the rest keeps what it held.
#[test]
fn a_pass_touches_its_area_alone() {
    let Some(ctx) = device() else { return };
    let stages = [(ShaderStage::Vertex, COVER), (ShaderStage::Fragment, PAINT)];
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, ..Default::default() };
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let drawn = target(&ctx, Format::R32Float, [4, 2]);
    let clear = |value| [ColorAttachment::clear(*drawn, [value; 4])];
    run_pass(&ctx, &RenderPassDesc { color: &clear(1.0), ..Default::default() }, |_| Ok(()));
    let part = RenderPassDesc { color: &clear(2.0), area: Some([1, 0, 3, 1]), ..Default::default() };
    run_pass(&ctx, &part, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        usage_error(pass.scissor([0, 0], [2, 1]), "outside of");
        usage_error(pass.scissor([1, 0], [1, 2]), "outside of");
        pass.scissor([2, 0], [1, 1])?;
        paint(pass, [3.0; 4], 0.0)
    });
    let load = [ColorAttachment { load: ColorLoadOp::Load, ..clear(0.0)[0] }];
    let part = RenderPassDesc { color: &load, area: Some([3, 1, 1, 1]), ..Default::default() };
    run_pass(&ctx, &part, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [4.0; 4], 0.0)
    });
    assert_eq!(pixels::<f32>(&ctx, *drawn), [1.0, 2.0, 3.0, 2.0, 1.0, 1.0, 1.0, 4.0]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    for area in [[0, 0, 5, 1], [0, 0, 0, 1], [4, 0, 1, 1], [1, u32::MAX, 1, 2]] {
        let desc = RenderPassDesc { color: &load, area: Some(area), ..Default::default() };
        usage_error(cmd.begin_rendering(&desc), "the area");
    }
}

#[test]
fn state_that_cannot_be_is_refused() {
    let Some(ctx) = device() else { return };
    let plain = RenderPipelineDesc::default();
    let odd = DepthBias { slope: f32::INFINITY, ..Default::default() };
    let with_bias = |bias| RenderPipelineDesc { depth_bias: Some(bias), ..plain };
    usage_error(make(&ctx, COVER, &with_bias(odd)), "no finite numbers");
    let drawn = target(&ctx, Format::R32Float, [1, 1]);
    let [unbiased, biased] =
        [plain, with_bias(DepthBias::default())].map(|desc| make(&ctx, COVER, &desc).unwrap());
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        usage_error(pass.depth_bias(DepthBias::default()), "bind a render pipeline first");
        pass.bind_render_pipeline(*unbiased)?;
        usage_error(pass.depth_bias(DepthBias::default()), "created with a depth bias");
        pass.bind_render_pipeline(*biased)?;
        usage_error(pass.depth_bias(DepthBias { constant: f32::NAN, ..Default::default() }), "finite");
        pass.depth_bias(DepthBias { slope: 1.0, ..Default::default() })
    });
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    for (desc, lack) in [
        (RenderPipelineDesc { polygon: PolygonMode::Line, ..plain }, "fillModeNonSolid"),
        (RenderPipelineDesc { line_width: 2.0, ..plain }, "wideLines"),
        (RenderPipelineDesc { depth_clamp: true, ..plain }, "depthClamp"),
        (with_bias(DepthBias { clamp: 1.0, ..Default::default() }), "depthBiasClamp"),
    ] {
        unsupported(make(&bare, COVER, &desc), lack);
    }
    let unbounded = make(&bare, COVER, &with_bias(DepthBias::default())).unwrap();
    let drawn = target(&bare, Format::R32Float, [1, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(&bare, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(*unbounded)?;
        unsupported(pass.depth_bias(DepthBias { clamp: 1.0, ..Default::default() }), "depthBiasClamp");
        pass.depth_bias(DepthBias { slope: 1.0, ..Default::default() })
    });
}
