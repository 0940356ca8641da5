//! Vertex attributes of every format and indices of every size, against the bytes in the buffers.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, ColorAttachment, Context, DeviceProfile,
    Error, Format, Holder, IndexFormat, Indices, OptionalFeature, RenderPassDesc, RenderPipelineDesc,
    ShaderStage, Topology, Triangles, VertexAttribute, VertexBinding, VertexFormat,
};
use lvk_tests::raster::{has, pixels, run_pass, staged_pipeline, target, unsupported, usage_error};
use lvk_tests::{device, device_with};

fn buffer(ctx: &Context, usage: BufferUsage, bytes: &[u8]) -> Holder<BufferHandle> {
    ctx.create_buffer(&BufferDesc { usage, data: Some(bytes), ..Default::default() }).unwrap()
}

/// Sixteen bytes whose floats and half floats are ordinary numbers.
const BYTES: [u8; 16] =
    [0x00, 0xc0, 0x12, 0xbe, 0x81, 0x40, 0xfe, 0x41, 0x34, 0xc2, 0x56, 0x3f, 0x9a, 0xbc, 0x80, 0x43];

fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    sign * if exponent == 0 {
        fraction / 1024.0 * 2.0_f64.powi(-14)
    } else {
        (1.0 + fraction / 1024.0) * 2.0_f64.powi(exponent - 15)
    }
}

/// The components of a format, those it lacks 0, 0, 0 and 1, from its name.
fn decode(format: VertexFormat) -> [f64; 4] {
    let name = format!("{format:?}");
    let word = |i: usize| u32::from_le_bytes(BYTES[4 * i..][..4].try_into().unwrap());
    let short = |i: usize| u16::from_le_bytes(BYTES[2 * i..][..2].try_into().unwrap());
    let component: &dyn Fn(usize) -> f64 = match name.split('x').next().unwrap() {
        "F32" => &|i| f64::from(f32::from_bits(word(i))),
        "I32" => &|i| f64::from(word(i).cast_signed()),
        "U32" => &|i| f64::from(word(i)),
        "F16" => &|i| half(short(i)),
        "I16" => &|i| f64::from(short(i).cast_signed()),
        "U16" => &|i| f64::from(short(i)),
        "Snorm16" => &|i| (f64::from(short(i).cast_signed()) / 32767.0).max(-1.0),
        "Unorm16" => &|i| f64::from(short(i)) / 65535.0,
        "I8" => &|i| f64::from(BYTES[i].cast_signed()),
        "U8" => &|i| f64::from(BYTES[i]),
        "Snorm8" => &|i| (f64::from(BYTES[i].cast_signed()) / 127.0).max(-1.0),
        "Unorm8" => &|i| f64::from(BYTES[i]) / 255.0,
        "Unorm10" => &|i| {
            if i == 3 {
                f64::from(word(0) >> 30) / 3.0
            } else {
                f64::from(word(0) >> (10 * i) & 1023) / 1023.0
            }
        },
        other => unreachable!("{other}"),
    };
    let count = match name.split_once('x') {
        Some((_, "3A2")) => 4,
        Some((_, count)) => count.parse().unwrap(),
        None => 1,
    };
    [0, 1, 2, 3].map(|i| if i < count { component(i) } else { f64::from(u8::from(i == 3)) })
}

#[test]
fn attributes_of_every_format_arrive_as_they_are() {
    let Some(ctx) = device() else { return };
    let vertices = buffer(&ctx, BufferUsage::VERTEX, &BYTES);
    for format in VertexFormat::ALL {
        let name = format!("{format:?}");
        let ty = match &name[..1] {
            "I" => "ivec4",
            "U" if !name.starts_with("Unorm") => "uvec4",
            _ => "vec4",
        };
        let vertex = format!(
            "layout(location = 0) in {ty} given;
             layout(location = 0) out vec4 value;
             void main() {{ value = vec4(given); gl_Position = vec4(0, 0, 0, 1); gl_PointSize = 1.0; }}"
        );
        let fragment = "
            layout(location = 0) in vec4 value;
            layout(location = 0) out vec4 result;
            void main() { result = value; }";
        let color = [Format::Rgba32Float.into()];
        let desc = RenderPipelineDesc {
            topology: Topology::Points,
            vertex_bindings: &[VertexBinding { stride: 16, per_instance: false }],
            vertex_attributes: &[VertexAttribute { format: *format, ..Default::default() }],
            color: &color,
            ..Default::default()
        };
        let stages = [(ShaderStage::Vertex, vertex.as_str()), (ShaderStage::Fragment, fragment)];
        let pipeline = match staged_pipeline(&ctx, &stages, &desc) {
            Ok(pipeline) => pipeline,
            Err(Error::Unsupported { .. }) => {
                eprintln!("NOT TESTED, no vertices of {format:?}");
                continue;
            }
            Err(other) => unreachable!("{other}"),
        };
        let drawn = target(&ctx, Format::Rgba32Float, [1, 1]);
        let color = [ColorAttachment::clear(*drawn, [9.0; 4])];
        run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.bind_vertex_buffer(0, *vertices, 0)?;
            pass.draw(0..1, 0..1)
        });
        let found = pixels::<[f32; 4]>(&ctx, *drawn)[0];
        for (found, expected) in found.into_iter().zip(decode(*format)) {
            let close = (f64::from(found) - expected).abs() <= 1e-6 * expected.abs().max(1.0);
            assert!(close, "{format:?}: {found}, not {expected}");
        }
    }
}

#[test]
fn indices_of_every_size_name_the_same_vertices() {
    let Some(ctx) = device() else { return };
    let vertex = "
        void main() {
            gl_Position = vec4((gl_VertexIndex + 0.5) / 4.0 - 1.0, 0, 0, 1);
            gl_PointSize = 1.0;
        }";
    let fragment = "
        layout(location = 0) out vec4 result;
        void main() { result = vec4(1.0); }";
    let color = [Format::R32Float.into()];
    let desc = RenderPipelineDesc { topology: Topology::Points, color: &color, ..Default::default() };
    let stages = [(ShaderStage::Vertex, vertex), (ShaderStage::Fragment, fragment)];
    let pipeline = staged_pipeline(&ctx, &stages, &desc).unwrap();
    let eight = has(&ctx, OptionalFeature::IndexTypeUint8);
    for format in [IndexFormat::U8, IndexFormat::U16, IndexFormat::U32] {
        if format == IndexFormat::U8 && !eight {
            continue;
        }
        // The first is skipped by the offset.
        let bytes: Vec<u8> = [7_u32, 1, 4, 6]
            .iter()
            .flat_map(|i| i.to_le_bytes()[..format.size_bytes() as usize].to_vec())
            .collect();
        let indices = buffer(&ctx, BufferUsage::INDEX, &bytes);
        let drawn = target(&ctx, Format::R32Float, [8, 1]);
        let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
        run_pass(&ctx, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
            pass.bind_render_pipeline(*pipeline)?;
            pass.bind_index_buffer(*indices, format.size_bytes().into(), format)?;
            usage_error(pass.draw_indexed(0..4, 0, 0..1), "but 3 are bound");
            pass.draw_indexed(0..3, 0, 0..1)
        });
        let expected = [0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0];
        assert_eq!(pixels::<f32>(&ctx, *drawn), expected, "{format:?}");
    }
}

#[test]
fn formats_that_do_not_fit_are_refused() {
    let Some(ctx) = device() else { return };
    let vertex = "layout(location = 0) in vec2 a; void main() { gl_Position = vec4(a, 0, 1); }";
    let make = |stride, offset, format| {
        let desc = RenderPipelineDesc {
            vertex_bindings: &[VertexBinding { stride, per_instance: false }],
            vertex_attributes: &[VertexAttribute { offset, format, ..Default::default() }],
            color: &[Format::R32Float.into()],
            ..Default::default()
        };
        staged_pipeline(&ctx, &[(ShaderStage::Vertex, vertex)], &desc)
    };
    usage_error(make(10, 0, VertexFormat::F32x2), "multiples of 4");
    usage_error(make(16, 2, VertexFormat::F32x2), "multiples of 4");
    drop(make(10, 2, VertexFormat::F16x2).unwrap());
    let usage = BufferUsage::ACCEL_INPUT | BufferUsage::INDEX;
    let points = buffer(&ctx, usage, &[0; 64]);
    let build = |triangles| {
        ctx.create_blas(&BlasDesc { geometries: &[BlasGeometry::Triangles(triangles)], ..Default::default() })
    };
    if ctx.capabilities().ray_query || ctx.capabilities().ray_tracing_pipeline {
        let odd = Triangles { vertex_format: VertexFormat::U8x4, ..Triangles::packed(*points, 3) };
        unsupported(build(odd), "U8x4");
        let indices = Some(Indices { buffer: *points, offset: 0, format: IndexFormat::U8 });
        unsupported(build(Triangles { indices, ..Triangles::packed(*points, 3) }), "8-bit indices");
    }
    let profile = DeviceProfile::core_only();
    let Some(bare) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    let indices = buffer(&bare, BufferUsage::INDEX, &[0; 4]);
    let drawn = target(&bare, Format::R32Float, [1, 1]);
    let color = [ColorAttachment::clear(*drawn, [0.0; 4])];
    run_pass(&bare, &RenderPassDesc { color: &color, ..Default::default() }, |pass| {
        unsupported(pass.bind_index_buffer(*indices, 0, IndexFormat::U8), "indexTypeUint8");
        Ok(())
    });
}
