//! Tessellation and geometry stages: their output for patches and primitives, and refused pipelines.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferDesc, ColorAttachment, Context, Dependencies, DeviceProfile, Error, Format, Holder,
    OptionalFeature, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, ShaderStage, Topology,
};
use lvk_tests::compute::read_words;
use lvk_tests::raster::{coverage, has, pixels, run_pass, staged_pipeline, target, unsupported, usage_error};
use lvk_tests::{device, device_with};

const SIZE: [u32; 2] = [16, 16];
const CORNERS: [[f64; 2]; 3] = [[1.43, 0.55], [14.06, 4.16], [5.05, 15.43]];

/// The corners in clip space.
const VERTEX: &str = "
    void main() {
        const vec2 corners[3] = vec2[](vec2(1.43, 0.55), vec2(14.06, 4.16), vec2(5.05, 15.43));
        gl_Position = vec4(corners[gl_VertexIndex % 3] / 8.0 - 1.0, 0, 1);
    }";

const CONTROL: &str = "
    layout(vertices = 3) out;
    void main() {
        gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
        gl_TessLevelOuter = float[](3.0, 4.0, 5.0, 1.0);
        gl_TessLevelInner = float[](4.0, 1.0);
    }";

/// Flat: the divided triangle covers what the whole one covers.
const EVAL: &str = "
    layout(triangles, equal_spacing, cw) in;
    layout(location = 0) out float part;
    void main() {
        gl_Position = gl_TessCoord.x * gl_in[0].gl_Position + gl_TessCoord.y * gl_in[1].gl_Position
            + gl_TessCoord.z * gl_in[2].gl_Position;
        part = gl_TessCoord.x;
    }";

const PART: &str = "
    layout(location = 0) in float part;
    layout(location = 0) out vec4 result;
    void main() { result = vec4(1.0 + part); }";

const ONE: &str = "
    layout(location = 0) out vec4 result;
    void main() { result = vec4(1.0); }";

fn render_image(ctx: &Context, pipeline: &Holder<RenderPipelineHandle>, vertices: u32) -> Vec<f32> {
    let drawn = target(ctx, Format::R32Float, SIZE);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        pass.bind_render_pipeline(**pipeline)?;
        pass.draw(0..vertices, 0..1)
    });
    pixels(ctx, *drawn)
}

fn make(
    ctx: &Context,
    stages: &[(ShaderStage, &str)],
    topology: Topology,
) -> lvk::Result<Holder<RenderPipelineHandle>> {
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { color: &color, topology, debug_name: "staged", ..Default::default() };
    staged_pipeline(ctx, stages, &desc)
}

#[test]
fn a_divided_triangle_covers_what_the_whole_one_covers() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::TessellationShader)) else { return };
    let stages = [
        (ShaderStage::Vertex, VERTEX),
        (ShaderStage::TessControl, CONTROL),
        (ShaderStage::TessEval, EVAL),
        (ShaderStage::Fragment, PART),
    ];
    let pipeline = make(&ctx, &stages, Topology::Patches { points: 3 }).unwrap();
    let found = render_image(&ctx, &pipeline, 3);
    let [a, b, c] = CORNERS;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    for (index, (value, inside)) in found.iter().zip(coverage(CORNERS, SIZE)).enumerate() {
        let at = [index as f64 % 16.0 + 0.5, (index / 16) as f64 + 0.5];
        let part = ((b[0] - at[0]) * (c[1] - at[1]) - (b[1] - at[1]) * (c[0] - at[0])) / area;
        let expected = if inside { 1.0 + part } else { 0.0 };
        assert!((f64::from(*value) - expected).abs() < 1e-3, "{at:?}: {value}, not {expected}");
    }
}

/// Points of a quad divided in four by four, by the levels that the control stage sets.
#[test]
fn levels_decide_how_many_points_there_are() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::TessellationShader)) else { return };
    let control = "
        layout(vertices = 1) out;
        void main() {
            gl_TessLevelOuter = float[](4.0, 4.0, 4.0, 4.0);
            gl_TessLevelInner = float[](4.0, 4.0);
        }";
    let eval = "
        layout(quads, equal_spacing, point_mode) in;
        void main() { gl_Position = vec4((gl_TessCoord.xy * 12.0 + 2.5) / 8.0 - 1.0, 0, 1); }";
    let stages = [
        (ShaderStage::Vertex, "void main() { gl_Position = vec4(0); }"),
        (ShaderStage::TessControl, control),
        (ShaderStage::TessEval, eval),
        (ShaderStage::Fragment, ONE),
    ];
    let pipeline = make(&ctx, &stages, Topology::Patches { points: 1 }).unwrap();
    let on = |at: usize| [2, 5, 8, 11, 14].contains(&at);
    let expected: Vec<f32> =
        (0..256).map(|index| f32::from(u8::from(on(index % 16) && on(index / 16)))).collect();
    assert_eq!(render_image(&ctx, &pipeline, 1), expected);
}

/// A point becomes a rectangle, and the shader counts its primitives in a buffer.
#[test]
fn a_geometry_shader_makes_rectangles_of_points() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::GeometryShader) || !has(&ctx, OptionalFeature::VertexStoresAndAtomics) {
        return;
    }
    let vertex = "void main() { gl_Position = vec4(gl_VertexIndex * 6 + 1, gl_VertexIndex * 5 + 2, 0, 1); }";
    let geometry = "
        layout(points) in;
        layout(triangle_strip, max_vertices = 4) out;
        layout(buffer_reference, scalar) buffer Count { uint value; };
        layout(push_constant, scalar) uniform Push { Count count; };
        layout(location = 0) out flat float number;
        void main() {
            atomicAdd(count.value, 1);
            for (int i = 0; i < 4; ++i) {
                vec2 corner = gl_in[0].gl_Position.xy + vec2(i & 1, i >> 1) * vec2(3, 2);
                number = gl_PrimitiveIDIn + 1;
                gl_Position = vec4(corner / 8.0 - 1.0, 0, 1);
                EmitVertex();
            }
        }";
    let fragment = "
        layout(location = 0) in flat float number;
        layout(location = 0) out vec4 result;
        void main() { result = vec4(number); }";
    let stages =
        [(ShaderStage::Vertex, vertex), (ShaderStage::Geometry, geometry), (ShaderStage::Fragment, fragment)];
    let pipeline = make(&ctx, &stages, Topology::Points).unwrap();
    let count = ctx.create_buffer(&BufferDesc { data: Some(&[0; 4]), ..Default::default() }).unwrap();
    let drawn = target(&ctx, Format::R32Float, SIZE);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    let desc = RenderPassDesc {
        color: &color,
        dependencies: Dependencies { buffers: &[*count], ..Default::default() },
        ..Default::default()
    };
    run_pass(&ctx, &desc, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.push_constants(&ctx.buffer_address(*count)?)?;
        pass.draw(0..3, 0..1)
    });
    let expected: Vec<f32> = (0..256)
        .map(|index| {
            let (x, y) = (index % 16, index / 16);
            let inside = |n: &i32| (6 * n + 1..6 * n + 4).contains(&x) && (5 * n + 2..5 * n + 4).contains(&y);
            (0..3).find(inside).map_or(0.0, |n| (n + 1) as f32)
        })
        .collect();
    assert_eq!(pixels::<f32>(&ctx, *drawn), expected);
    assert_eq!(read_words(&ctx, *count, 1), [3]);
}

/// Behind tessellation, the geometry stage sees the small triangles: it draws none but the first.
#[test]
fn a_geometry_shader_sees_what_tessellation_makes() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::TessellationShader) || !has(&ctx, OptionalFeature::GeometryShader) {
        return;
    }
    let geometry = "
        layout(triangles) in;
        layout(points, max_vertices = 1) out;
        layout(location = 0) in float partIn[];
        layout(location = 0) out float part;
        void main() {
            part = 0.0;
            gl_PointSize = 1.0;
            gl_Position = (gl_in[0].gl_Position + gl_in[1].gl_Position + gl_in[2].gl_Position) / 3.0;
            EmitVertex();
        }";
    let control = "
        layout(vertices = 3) out;
        void main() {
            gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
            gl_TessLevelOuter = float[](1.0, 1.0, 1.0, 1.0);
            gl_TessLevelInner = float[](1.0, 1.0);
        }";
    let stages = [
        (ShaderStage::Vertex, VERTEX),
        (ShaderStage::TessControl, control),
        (ShaderStage::TessEval, EVAL),
        (ShaderStage::Geometry, geometry),
        (ShaderStage::Fragment, PART),
    ];
    let pipeline = make(&ctx, &stages, Topology::Patches { points: 3 }).unwrap();
    let found = render_image(&ctx, &pipeline, 3);
    let middle = [0, 1].map(|axis| (CORNERS.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0) as usize);
    let expected: Vec<f32> = (0..256).map(|i| f32::from(u8::from(i == middle[1] * 16 + middle[0]))).collect();
    assert_eq!(found, expected);
}

#[test]
fn stages_that_do_not_go_together_are_refused() {
    let Some(ctx) = device() else { return };
    if !has(&ctx, OptionalFeature::TessellationShader) || !has(&ctx, OptionalFeature::GeometryShader) {
        return;
    }
    let (vertex, control, eval) =
        ((ShaderStage::Vertex, VERTEX), (ShaderStage::TessControl, CONTROL), (ShaderStage::TessEval, EVAL));
    let fragment = (ShaderStage::Fragment, ONE);
    let patches = Topology::Patches { points: 3 };
    usage_error(make(&ctx, &[vertex, control, fragment], patches), "give the pipeline both");
    usage_error(make(&ctx, &[vertex, eval, fragment], patches), "give the pipeline both");
    usage_error(make(&ctx, &[vertex, control, eval], Topology::Triangles), "need each other");
    usage_error(make(&ctx, &[vertex, fragment], patches), "need each other");
    let tessellated = [vertex, control, eval, fragment];
    usage_error(make(&ctx, &tessellated, Topology::Patches { points: 0 }), "at least one point");
    match make(&ctx, &tessellated, Topology::Patches { points: 1 << 20 }).map(drop) {
        Err(Error::LimitExceeded { object, requested, limit, .. }) => {
            assert_eq!((object.as_str(), requested), ("staged", 1 << 20));
            assert_eq!(limit, u64::from(ctx.capabilities().limits.max_patch_points));
        }
        other => unreachable!("{other:?}"),
    }
    let geometry = |takes: &str| {
        format!(
            "layout({takes}) in; layout(points, max_vertices = 1) out;
             void main() {{ gl_Position = vec4(0); EmitVertex(); }}"
        )
    };
    let [lines, adjacent] = [geometry("lines"), geometry("triangles_adjacency")];
    let with = |text| [vertex, (ShaderStage::Geometry, text), fragment];
    usage_error(make(&ctx, &with(&lines), Topology::Triangles), "takes Lines, but Triangles come to it");
    usage_error(make(&ctx, &with(&adjacent), Topology::Triangles), "adjacent vertices");
    let all = [vertex, control, eval, (ShaderStage::Geometry, lines.as_str()), fragment];
    usage_error(make(&ctx, &all, patches), "takes Lines, but Triangles come to it");
    let wrong = ctx.create_render_pipeline(&RenderPipelineDesc {
        vertex: Some(*lvk_tests::compute::module(&ctx, ShaderStage::Fragment, ONE)),
        ..Default::default()
    });
    usage_error(wrong, "Vertex module is needed");
}

#[test]
fn devices_without_the_stages_refuse_them_by_name() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let module = |stage, source| {
        ctx.create_shader_module(&lvk::ShaderModuleDesc {
            stage,
            source: lvk::ShaderSource::Glsl(source),
            debug_name: "beyond",
            ..Default::default()
        })
    };
    unsupported(module(ShaderStage::TessControl, CONTROL), "tessellationShader");
    let geometry = "layout(points) in; layout(points, max_vertices = 1) out; void main() { EmitVertex(); }";
    unsupported(module(ShaderStage::Geometry, geometry), "geometryShader");
}
