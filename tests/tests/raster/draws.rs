//! Draws: coverage, targets, depth, blending and views of targets, against the pixels that the CPU expects.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    Blend, BufferDesc, BufferHandle, BufferUsage, ColorAttachment, ColorLoadOp, ColorTarget, CompareOp,
    Context, CullMode, Dependencies, DepthAttachment, DepthLoadOp, DepthTest, Format, FrontFace, Holder,
    IndexFormat, RenderPass, RenderPassDesc, RenderPipelineDesc, RenderPipelineHandle, TextureDesc,
    TextureHandle, TextureKind, TextureRegion, TextureUsage, Topology, VertexAttribute, VertexBinding,
    VertexFormat,
};
use lvk_tests::compute::Evaluator;
use lvk_tests::device;
use lvk_tests::raster::{COVER, PAINT, coverage, pixels, render_pipeline, target};

const SIZE: [u32; 2] = [16, 16];
const CORNERS: [[f64; 2]; 3] = [[1.43, 0.55], [14.06, 4.16], [5.05, 15.43]];
const RED: [u8; 4] = [255, 0, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const CLEAR_BLUE: ColorLoadOp = ColorLoadOp::Clear([0.0, 0.0, 1.0, 1.0]);

fn color(format: Format) -> [ColorTarget; 1] {
    [format.into()]
}

fn buffer<T: bytemuck::NoUninit>(ctx: &Context, usage: BufferUsage, data: &[T]) -> Holder<BufferHandle> {
    let desc = BufferDesc { usage, data: Some(bytemuck::cast_slice(data)), ..Default::default() };
    ctx.create_buffer(&desc).unwrap()
}

fn attachment(texture: TextureHandle, load: ColorLoadOp) -> ColorAttachment {
    ColorAttachment { texture, mip: 0, layer: 0, load, store: true, resolve: None }
}

/// Runs one pass over `color` in a submission of its own.
fn draw(
    ctx: &Context,
    color: &[ColorAttachment],
    depth: Option<DepthAttachment>,
    record: impl FnOnce(&mut RenderPass<'_>) -> lvk::Result<()>,
) {
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let desc = RenderPassDesc { color, depth, debug_name: "pass", ..Default::default() };
    record(&mut cmd.begin_rendering(&desc).unwrap()).unwrap();
    ctx.submit(cmd).unwrap();
}

/// Corners in clip space.
fn clip_vertices() -> [[f32; 2]; 3] {
    CORNERS.map(|corner| corner.map(|at| (at / 8.0 - 1.0) as f32))
}

/// Red where the triangle is, blue elsewhere.
fn expected_triangle() -> Vec<[u8; 4]> {
    coverage(CORNERS, SIZE).into_iter().map(|inside| if inside { RED } else { BLUE }).collect()
}

const FROM_BUFFER: &str = "
    layout(location = 0) in vec2 position;
    layout(location = 1) in vec4 tint;
    layout(location = 0) flat out vec4 color;
    void main() { gl_Position = vec4(position, 0, 1); color = tint; }";
const FLAT: &str = "
    layout(location = 0) flat in vec4 color;
    layout(location = 0) out vec4 result;
    void main() { result = color; }";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Vertex {
    position: [f32; 2],
    color: [u8; 4],
}

fn vertices() -> [Vertex; 3] {
    clip_vertices().map(|position| Vertex { position, color: RED })
}

fn vertex_pipeline(ctx: &Context) -> Holder<RenderPipelineHandle> {
    let attributes = [
        VertexAttribute { location: 0, binding: 0, format: VertexFormat::F32x2, offset: 0 },
        VertexAttribute { location: 1, binding: 0, format: VertexFormat::Unorm8x4, offset: 8 },
    ];
    let desc = RenderPipelineDesc {
        vertex_bindings: &[VertexBinding { stride: 12, per_instance: false }],
        vertex_attributes: &attributes,
        color: &color(Format::Rgba8Unorm),
        debug_name: "from buffer",
        ..Default::default()
    };
    render_pipeline(ctx, FROM_BUFFER, FLAT, &desc)
}

#[test]
fn vertices_come_from_a_buffer() {
    let Some(ctx) = device() else { return };
    let pipeline = vertex_pipeline(&ctx);
    let target = target(&ctx, Format::Rgba8Unorm, SIZE);
    let nowhere = Vertex { position: [9.0; 2], color: BLUE };
    let [a, b, c] = vertices();
    let buffer = buffer(&ctx, BufferUsage::VERTEX, &[nowhere, nowhere, a, b, c]);
    for (offset, first) in [(0, 2), (12, 1), (24, 0)] {
        draw(&ctx, &[attachment(*target, CLEAR_BLUE)], None, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.bind_vertex_buffer(0, *buffer, offset)?;
            pass.draw(first..first + 3, 0..1)
        });
        assert_eq!(pixels::<[u8; 4]>(&ctx, *target), expected_triangle(), "from byte {offset}");
    }
}

#[test]
fn vertices_are_pulled_by_address() {
    let Some(ctx) = device() else { return };
    let pull = "
        layout(buffer_reference, scalar) readonly buffer Corners { vec2 at[]; };
        layout(push_constant, scalar) uniform Push { Corners corners; };
        layout(location = 0) flat out vec4 color;
        void main() { gl_Position = vec4(corners.at[gl_VertexIndex], 0, 1); color = vec4(1, 0, 0, 1); }";
    let desc = RenderPipelineDesc { color: &color(Format::Rgba8Unorm), ..Default::default() };
    let pipeline = render_pipeline(&ctx, pull, FLAT, &desc);
    let target = target(&ctx, Format::Rgba8Unorm, SIZE);
    let corners = buffer(&ctx, BufferUsage::STORAGE, &clip_vertices());
    draw(&ctx, &[attachment(*target, CLEAR_BLUE)], None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.push_constants(&ctx.buffer_address(*corners)?)?;
        pass.draw(0..3, 0..1)
    });
    assert_eq!(pixels::<[u8; 4]>(&ctx, *target), expected_triangle());
}

#[test]
fn vertices_are_drawn_by_index() {
    let Some(ctx) = device() else { return };
    let pipeline = vertex_pipeline(&ctx);
    let target = target(&ctx, Format::Rgba8Unorm, SIZE);
    let nowhere = Vertex { position: [9.0; 2], color: BLUE };
    let [a, b, c] = vertices();
    let vertices = buffer(&ctx, BufferUsage::VERTEX, &[nowhere, c, a, nowhere, b]);
    let short = buffer(&ctx, BufferUsage::INDEX, &[0_u16, 0, 2, 4, 1]);
    let long = buffer(&ctx, BufferUsage::INDEX, &[0_u32, 0, 2, 4, 1]);
    // Index 6 with base -2 is vertex 4, and so on.
    let based = buffer(&ctx, BufferUsage::INDEX, &[4_u32, 6, 3]);
    let cases = [
        (&short, 4, IndexFormat::U16, 0..3, 0),
        (&short, 0, IndexFormat::U16, 2..5, 0),
        (&long, 8, IndexFormat::U32, 0..3, 0),
        (&based, 0, IndexFormat::U32, 0..3, -2),
    ];
    for (indices, offset, format, range, base) in cases {
        draw(&ctx, &[attachment(*target, CLEAR_BLUE)], None, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.bind_vertex_buffer(0, *vertices, 0)?;
            pass.bind_index_buffer(**indices, offset, format)?;
            pass.draw_indexed(range.clone(), base, 0..1)
        });
        assert_eq!(pixels::<[u8; 4]>(&ctx, *target), expected_triangle(), "{format:?} {offset} {base}");
    }
}

#[test]
fn instances_step_their_own_binding() {
    let Some(ctx) = device() else { return };
    let vertex = "
        layout(location = 3) in float column;
        layout(location = 0) flat out vec4 color;
        void main() {
            vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
            gl_Position = vec4((column + corner.x) / 2.0 - 1.0, corner.y * 2.0 - 1.0, 0, 1);
            color = vec4(column / 4.0, 0, 0, 1);
        }";
    let desc = RenderPipelineDesc {
        topology: Topology::TriangleStrip,
        vertex_bindings: &[VertexBinding { stride: 4, per_instance: true }],
        vertex_attributes: &[VertexAttribute {
            location: 3,
            binding: 0,
            format: VertexFormat::F32,
            offset: 0,
        }],
        color: &color(Format::R32Float),
        ..Default::default()
    };
    let pipeline = render_pipeline(&ctx, vertex, FLAT, &desc);
    let target = target(&ctx, Format::R32Float, [4, 2]);
    let columns = buffer(&ctx, BufferUsage::VERTEX, &[9.0_f32, 3.0, 1.0, 2.0]);
    draw(&ctx, &[attachment(*target, ColorLoadOp::Clear([7.0; 4]))], None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.bind_vertex_buffer(0, *columns, 0)?;
        pass.draw(0..4, 1..4)
    });
    assert_eq!(pixels::<f32>(&ctx, *target), [7.0, 0.25, 0.5, 0.75].repeat(2));
}

/// Six vertices a column; red is the number of the column.
const COLUMNS: &str = "
    layout(location = 0) flat out vec4 color;
    void main() {
        uint column = gl_VertexIndex / 6;
        uint corner = uint[](0, 1, 2, 2, 1, 3)[gl_VertexIndex % 6];
        vec2 at = vec2((column + (corner & 1)) / 4.0 - 1.0, float(corner >> 1) * 2.0 - 1.0);
        gl_Position = vec4(at, 0, 1);
        color = vec4(column + 1, 0, 0, 1);
    }";

#[test]
fn arguments_of_draws_come_from_buffers() {
    let Some(ctx) = device() else { return };
    let desc = RenderPipelineDesc { color: &color(Format::R32Float), ..Default::default() };
    let pipeline = render_pipeline(&ctx, COLUMNS, FLAT, &desc);
    let target = target(&ctx, Format::R32Float, [8, 1]);
    // Columns 1, 4 with 5, and 7: vertices, instances, first vertex, first instance, and four bytes of padding.
    let direct = [99, 6, 1, 6, 0, 0, 12, 1, 24, 0, 0, 6, 1, 42, 0_u32];
    let direct = buffer(&ctx, BufferUsage::INDIRECT, &direct);
    let numbers: Vec<u32> = (0..24).collect();
    let indices = buffer(&ctx, BufferUsage::INDEX, &numbers);
    // The same by index: indices, instances, first index, vertex offset, first instance.
    let indexed = buffer(&ctx, BufferUsage::INDIRECT, &[6, 1, 6, 0, 0, 12, 1, 0, 24, 0, 6, 1, 18, 24, 0_u32]);
    let expected = [0.0, 2.0, 0.0, 0.0, 5.0, 6.0, 0.0, 8.0];
    let clear = [attachment(*target, ColorLoadOp::Clear([0.0; 4]))];
    draw(&ctx, &clear, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw_indirect(*direct, 4, 3, 20)?;
        pass.draw_indirect(*direct, 4, 0, 20)
    });
    assert_eq!(pixels::<f32>(&ctx, *target), expected);
    draw(&ctx, &clear, None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.bind_index_buffer(*indices, 0, IndexFormat::U32)?;
        pass.draw_indexed_indirect(*indexed, 0, 3, 20)
    });
    assert_eq!(pixels::<f32>(&ctx, *target), expected);
}

#[test]
fn several_targets_take_their_own_outputs_and_clears() {
    let Some(ctx) = device() else { return };
    let fragment = "
        layout(location = 0) out vec4 color;
        layout(location = 1) out uvec2 ids;
        layout(location = 2) out vec4 wide;
        void main() {
            uint pixel = uint(gl_FragCoord.x) + 10 * uint(gl_FragCoord.y);
            color = vec4(0, 1, 0, 1);
            ids = uvec2(pixel, 0xfffffff0);
            wide = vec4(-1.5, 1e9, pixel, 0);
        }";
    let formats = [Format::Rgba8Unorm, Format::Rg32Uint, Format::Rgba32Float];
    let desc = RenderPipelineDesc { color: &formats.map(ColorTarget::from), ..Default::default() };
    let pipeline = render_pipeline(&ctx, COVER, fragment, &desc);
    let targets = formats.map(|format| target(&ctx, format, [4, 2]));
    let loads =
        [CLEAR_BLUE, ColorLoadOp::ClearUint([7, u32::MAX, 0, 0]), ColorLoadOp::Clear([0.25, -2.0, 0.0, 1.0])];
    let color = [0, 1, 2].map(|i| attachment(*targets[i], loads[i]));
    draw(&ctx, &color, None, |pass| {
        assert_eq!(pass.extent(), [4, 2]);
        pass.bind_render_pipeline(*pipeline)?;
        pass.push_constants(&[0.0_f32; 5])?;
        pass.scissor([1, 0], [2, 2])?;
        pass.draw(0..3, 0..1)
    });
    let drawn = |x: usize| x == 1 || x == 2;
    for (at, found) in pixels::<[u8; 4]>(&ctx, *targets[0]).into_iter().enumerate() {
        assert_eq!(found, if drawn(at % 4) { [0, 255, 0, 255] } else { BLUE }, "pixel {at}");
    }
    for (at, found) in pixels::<[u32; 2]>(&ctx, *targets[1]).into_iter().enumerate() {
        let id = (at % 4 + 10 * (at / 4)) as u32;
        assert_eq!(found, if drawn(at % 4) { [id, 0xffff_fff0] } else { [7, u32::MAX] }, "pixel {at}");
    }
    for (at, found) in pixels::<[f32; 4]>(&ctx, *targets[2]).into_iter().enumerate() {
        let id = (at % 4 + 10 * (at / 4)) as f32;
        assert_eq!(
            found,
            if drawn(at % 4) { [-1.5, 1e9, id, 0.0] } else { [0.25, -2.0, 0.0, 1.0] },
            "pixel {at}"
        );
    }
}

fn paint(pass: &mut RenderPass<'_>, color: [f32; 4], depth: f32) -> lvk::Result<()> {
    pass.push_constants(&[color[0], color[1], color[2], color[3], depth])?;
    pass.draw(0..3, 0..1)
}

#[test]
fn depth_decides_what_is_seen() {
    let Some(ctx) = device() else { return };
    for format in [Format::D16Unorm, Format::D32Float, Format::D24UnormS8, Format::D32FloatS8] {
        let desc = TextureDesc { format, extent: [3, 1], usage: TextureUsage::TARGET, ..Default::default() };
        let Ok(depth) = ctx.create_texture(&desc) else { continue };
        let expected = [
            (CompareOp::Less, [2.0, 1.0, 1.0]),
            (CompareOp::LessOrEqual, [2.0, 2.0, 1.0]),
            (CompareOp::Greater, [1.0, 1.0, 2.0]),
            (CompareOp::Equal, [1.0, 2.0, 1.0]),
            (CompareOp::Always, [2.0, 2.0, 2.0]),
            (CompareOp::Never, [1.0, 1.0, 1.0]),
        ];
        for (compare, expected) in expected {
            let pipeline = |compare| {
                let depth = Some(DepthTest { format, compare, write: true });
                let desc =
                    RenderPipelineDesc { color: &color(Format::R32Float), depth, ..Default::default() };
                render_pipeline(&ctx, COVER, PAINT, &desc)
            };
            let (first, second) = (pipeline(CompareOp::Less), pipeline(compare));
            let target = target(&ctx, Format::R32Float, [3, 1]);
            let clear = DepthAttachment::clear(*depth, 1.0);
            draw(&ctx, &[attachment(*target, ColorLoadOp::Clear([0.0; 4]))], Some(clear), |pass| {
                pass.bind_render_pipeline(*first)?;
                paint(pass, [1.0; 4], 0.5)
            });
            // The second pass goes on with the depth that the first one stored.
            let load = DepthAttachment { load: DepthLoadOp::Load, ..clear };
            draw(&ctx, &[attachment(*target, ColorLoadOp::Load)], Some(load), |pass| {
                pass.bind_render_pipeline(*second)?;
                for (column, depth) in (0..).zip([0.25, 0.5, 0.75]) {
                    pass.scissor([column, 0], [1, 1])?;
                    paint(pass, [2.0; 4], depth)?;
                }
                Ok(())
            });
            assert_eq!(pixels::<f32>(&ctx, *target), expected, "{format:?} {compare:?}");
        }
    }
}

#[test]
fn a_pipeline_without_fragments_writes_depth_alone() {
    let Some(ctx) = device() else { return };
    let format = Format::D32Float;
    let pipeline = |write| {
        let depth = Some(DepthTest { format, compare: CompareOp::Less, write });
        render_pipeline(&ctx, COVER, "", &RenderPipelineDesc { depth, ..Default::default() })
    };
    let (writing, reading) = (pipeline(true), pipeline(false));
    let depth = target(&ctx, format, [4, 1]);
    draw(&ctx, &[], Some(DepthAttachment::clear(*depth, 0.75)), |pass| {
        pass.bind_render_pipeline(*writing)?;
        pass.scissor([0, 0], [2, 1])?;
        paint(pass, [0.0; 4], 0.25)?;
        paint(pass, [0.0; 4], 0.5)?;
        pass.bind_render_pipeline(*reading)?;
        pass.scissor([0, 0], [4, 1])?;
        paint(pass, [0.0; 4], 0.125)
    });
    assert_eq!(pixels::<f32>(&ctx, *depth), [0.25, 0.25, 0.75, 0.75]);
    let fetch = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(i, 0), 0)");
    let reads = Dependencies { sampled_images: &[*depth], ..Default::default() };
    let found = fetch.run(&ctx, [depth.index(), 0, 0], 4, &reads);
    assert_eq!(found.iter().map(|value| value[0]).collect::<Vec<_>>(), [0.25, 0.25, 0.75, 0.75]);
}

#[test]
fn blending_combines_source_and_target() {
    let Some(ctx) = device() else { return };
    let target = target(&ctx, Format::Rgba32Float, [1, 1]);
    let (behind, over) = ([0.5, 0.25, 0.0, 0.5], [0.25, 0.5, 1.0, 0.25]);
    let blends = [
        (None, [0.25, 0.5, 1.0]),
        (Some(Blend::ALPHA), [0.4375, 0.3125, 0.25]),
        (Some(Blend::PREMULTIPLIED_ALPHA), [0.625, 0.6875, 1.0]),
        (Some(Blend::ADDITIVE), [0.75, 0.75, 1.0]),
    ];
    for (blend, expected) in blends {
        let color = [ColorTarget { blend, ..ColorTarget::new(Format::Rgba32Float) }];
        let pipeline =
            render_pipeline(&ctx, COVER, PAINT, &RenderPipelineDesc { color: &color, ..Default::default() });
        draw(&ctx, &[attachment(*target, ColorLoadOp::Clear(behind))], None, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            paint(pass, over, 0.0)
        });
        let found = pixels::<[f32; 4]>(&ctx, *target)[0];
        let close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close, "{blend:?}: {found:?}, not {expected:?}");
    }
}

#[test]
fn a_pass_loads_what_the_one_before_stored() {
    let Some(ctx) = device() else { return };
    let desc = RenderPipelineDesc { color: &color(Format::R32Float), ..Default::default() };
    let pipeline = render_pipeline(&ctx, COVER, PAINT, &desc);
    let target = target(&ctx, Format::R32Float, [4, 1]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    for column in 0..4 {
        let load = if column == 0 { ColorLoadOp::Clear([9.0; 4]) } else { ColorLoadOp::Load };
        let color = [attachment(*target, load)];
        let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.scissor([column, 0], [1, 1]).unwrap();
        if column != 2 {
            paint(&mut pass, [column as f32; 4], 0.0).unwrap();
        }
    }
    ctx.submit(cmd).unwrap();
    assert_eq!(pixels::<f32>(&ctx, *target), [0.0, 1.0, 9.0, 3.0]);
    draw(&ctx, &[attachment(*target, ColorLoadOp::DontCare)], None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        paint(pass, [5.0; 4], 0.0)
    });
    assert_eq!(pixels::<f32>(&ctx, *target), [5.0; 4]);
}

#[test]
fn mips_layers_and_faces_are_drawn_to_and_sampled() {
    let Some(ctx) = device() else { return };
    let desc = RenderPipelineDesc { color: &color(Format::R32Float), ..Default::default() };
    let pipeline = render_pipeline(&ctx, COVER, PAINT, &desc);
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let cases = [
        (TextureKind::D2, 1, "textureBindless2DLod(a, b, vec2(0.5), i)"),
        (
            TextureKind::D2Array { layers: 3 },
            3,
            "textureBindless2DArrayLod(a, b, vec3(0.5, 0.5, i / 3), i % 3)",
        ),
        (
            TextureKind::Cube,
            6,
            "textureBindlessCubeLod(a, b, vec3(i/3 == 0, i/3 == 2, i/3 == 4) - vec3(i/3 == 1, i/3 == 3, i/3 == 5), i % 3)",
        ),
    ];
    for (kind, layers, expression) in cases {
        let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
        let desc = TextureDesc {
            kind,
            format: Format::R32Float,
            extent: [4, 4],
            mips: 0,
            usage,
            ..Default::default()
        };
        let texture = ctx.create_texture(&desc).unwrap();
        for (layer, mip) in (0..layers).flat_map(|layer| (0..3).map(move |mip| (layer, mip))) {
            let load = ColorLoadOp::Clear([-1.0; 4]);
            let attachment =
                ColorAttachment { texture: *texture, mip, layer, load, store: true, resolve: None };
            draw(&ctx, &[attachment], None, |pass| {
                assert_eq!(pass.extent(), [4 >> mip; 2]);
                pass.bind_render_pipeline(*pipeline)?;
                paint(pass, [(3 * layer + mip) as f32; 4], 0.0)
            });
        }
        let reads = Dependencies { sampled_images: &[*texture], ..Default::default() };
        let words = [texture.index(), sampler.index(), 0];
        let found = Evaluator::new(&ctx, expression).run(&ctx, words, 3 * layers, &reads);
        let expected: Vec<f32> = (0..3 * layers).map(|i| i as f32).collect();
        assert_eq!(found.iter().map(|value| value[0]).collect::<Vec<_>>(), expected, "{kind:?}");
    }
}

#[test]
fn viewport_and_scissor_move_and_clip() {
    let Some(ctx) = device() else { return };
    let fragment = "
        layout(location = 0) out vec4 result;
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        void main() { result = vec4(gl_FragCoord.z * 8.0); }";
    let desc = RenderPipelineDesc { color: &color(Format::R32Float), ..Default::default() };
    let pipeline = render_pipeline(&ctx, COVER, fragment, &desc);
    let target = target(&ctx, Format::R32Float, [4, 3]);
    draw(&ctx, &[attachment(*target, ColorLoadOp::Clear([0.0; 4]))], None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.viewport([1.0, 0.0, 2.0, 3.0], [0.5, 0.75])?;
        paint(pass, [0.0; 4], 0.0)?;
        pass.viewport([1.0, 0.0, 2.0, 3.0], [0.0, 1.0])?;
        pass.scissor([2, 1], [2, 1])?;
        paint(pass, [0.0; 4], 0.25)
    });
    let expected = [0.0, 4.0, 4.0, 0.0, 0.0, 4.0, 2.0, 0.0, 0.0, 4.0, 4.0, 0.0];
    assert_eq!(pixels::<f32>(&ctx, *target), expected);
}

#[test]
fn a_negative_height_flips_the_image() {
    let Some(ctx) = device() else { return };
    let pipeline = vertex_pipeline(&ctx);
    let target = target(&ctx, Format::Rgba8Unorm, SIZE);
    let vertices = buffer(&ctx, BufferUsage::VERTEX, &vertices());
    draw(&ctx, &[attachment(*target, CLEAR_BLUE)], None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.bind_vertex_buffer(0, *vertices, 0)?;
        pass.viewport([0.0, 16.0, 16.0, -16.0], [0.0, 1.0])?;
        pass.draw(0..3, 0..1)
    });
    let found = pixels::<[u8; 4]>(&ctx, *target);
    let flipped: Vec<_> = found.chunks(16).rev().flatten().copied().collect();
    assert_eq!(flipped, expected_triangle());
}

#[test]
fn culling_follows_the_winding_on_screen() {
    let Some(ctx) = device() else { return };
    let vertices = buffer(&ctx, BufferUsage::STORAGE, &clip_vertices());
    let pull = "
        layout(buffer_reference, scalar) readonly buffer Corners { vec2 at[]; };
        layout(push_constant, scalar) uniform Push { Corners corners; };
        layout(location = 0) flat out vec4 color;
        void main() { gl_Position = vec4(corners.at[gl_VertexIndex], 0, 1); color = vec4(1, 0, 0, 1); }";
    // The corners run clockwise on a screen whose y points down.
    let cases = [
        (CullMode::None, FrontFace::Clockwise, true),
        (CullMode::Back, FrontFace::Clockwise, true),
        (CullMode::Front, FrontFace::Clockwise, false),
        (CullMode::Back, FrontFace::CounterClockwise, false),
        (CullMode::Front, FrontFace::CounterClockwise, true),
    ];
    for (cull, front_face, seen) in cases {
        let desc =
            RenderPipelineDesc { cull, front_face, color: &color(Format::Rgba8Unorm), ..Default::default() };
        let pipeline = render_pipeline(&ctx, pull, FLAT, &desc);
        let target = target(&ctx, Format::Rgba8Unorm, SIZE);
        draw(&ctx, &[attachment(*target, CLEAR_BLUE)], None, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.push_constants(&ctx.buffer_address(*vertices)?)?;
            pass.draw(0..3, 0..1)
        });
        let expected = if seen { expected_triangle() } else { vec![BLUE; 256] };
        assert_eq!(pixels::<[u8; 4]>(&ctx, *target), expected, "{cull:?} {front_face:?}");
    }
}

#[test]
fn points_fill_their_pixel() {
    let Some(ctx) = device() else { return };
    let vertex = "
        layout(location = 0) flat out vec4 color;
        void main() {
            gl_Position = vec4((gl_VertexIndex * 2 + 0.5) / 4.0 - 1.0, 0, 0, 1);
            gl_PointSize = 1.0;
            color = vec4(gl_VertexIndex + 1);
        }";
    let topology = Topology::Points;
    let desc = RenderPipelineDesc { topology, color: &color(Format::R32Float), ..Default::default() };
    let pipeline = render_pipeline(&ctx, vertex, FLAT, &desc);
    let target = target(&ctx, Format::R32Float, [8, 1]);
    draw(&ctx, &[attachment(*target, ColorLoadOp::Clear([0.0; 4]))], None, |pass| {
        pass.bind_render_pipeline(*pipeline)?;
        pass.draw(0..3, 0..1)
    });
    assert_eq!(pixels::<f32>(&ctx, *target), [1.0, 0.0, 2.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
}

#[test]
fn fragments_choose_the_mip_by_their_derivatives() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc { format: Format::R32Float, extent: [16, 16], mips: 0, ..Default::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    for mip in 0..5 {
        let values = vec![mip as f32; 1 << (2 * (4 - mip))];
        let region = TextureRegion { mip, ..Default::default() };
        ctx.upload_texture(*texture, &region, bytemuck::cast_slice(&values)).unwrap();
    }
    let sampler = ctx.create_sampler(&Default::default()).unwrap();
    let fragment = "
        layout(location = 0) out vec4 result;
        layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
        void main() {
            uvec2 indices = floatBitsToUint(color.xy);
            result = textureBindless2D(indices.x, indices.y, gl_FragCoord.xy / color.z);
        }";
    let desc = RenderPipelineDesc { color: &color(Format::R32Float), ..Default::default() };
    let pipeline = render_pipeline(&ctx, COVER, fragment, &desc);
    for (side, mip) in [(16, 0.0), (8, 1.0), (4, 2.0)] {
        let target = target(&ctx, Format::R32Float, [side; 2]);
        draw(&ctx, &[attachment(*target, ColorLoadOp::DontCare)], None, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            let indices = [texture.index(), sampler.index()].map(f32::from_bits);
            paint(pass, [indices[0], indices[1], side as f32, 0.0], 0.0)
        });
        let found = pixels::<f32>(&ctx, *target);
        assert!(found.iter().all(|value| (value - mip).abs() < 0.05), "{side}: {found:?}");
    }
}
