//! Every vertex format that the device builds from, with every index type, at odd strides and offsets; and a typed
//! error for other formats.

use lvk::glam::{Affine3A, DAffine3, DVec3, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, Context, DeviceProfile,
    Error, Holder, IndexFormat, Indices, Result, TlasDesc, Triangles, VertexFormat,
};
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Placed, instances};
use lvk_tests::ray_tracer::How;
use lvk_tests::rays::Ray;
use lvk_tests::reference::{Geometry, Instance, Reference};
use lvk_tests::{TestDevice, device, device_with};

const FORMATS: [VertexFormat; 10] = {
    use VertexFormat::{F16x2, F16x4, F32, F32x2, F32x3, F32x4, Snorm16x2, Snorm16x4, U32, Unorm8x4};
    [F32, F32x2, F32x3, F32x4, F16x2, F16x4, Snorm16x2, Snorm16x4, Unorm8x4, U32]
};

/// Formats that Vulkan demands of every device with acceleration structures (table "Mandatory format support").
const MANDATORY: [VertexFormat; 6] = {
    use VertexFormat::{F16x2, F16x4, F32x2, F32x3, Snorm16x2, Snorm16x4};
    [F32x2, F32x3, F16x2, F16x4, Snorm16x2, Snorm16x4]
};

const INDICES: [Option<IndexFormat>; 3] = [None, Some(IndexFormat::U16), Some(IndexFormat::U32)];

fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 70, ..DeviceProfile::default() };
    device().into_iter().chain(device_with(|desc| desc.profile = Some(&profile))).collect()
}

/// One component as a format holds it, and the number it then stands for.
fn encoded(format: VertexFormat, value: f32) -> (Vec<u8>, f64) {
    match format {
        VertexFormat::F32 | VertexFormat::F32x2 | VertexFormat::F32x3 | VertexFormat::F32x4 => {
            (value.to_le_bytes().to_vec(), value.into())
        }
        VertexFormat::F16x2 | VertexFormat::F16x4 => {
            let (bits, stands_for) = half(value);
            (bits.to_le_bytes().to_vec(), stands_for)
        }
        VertexFormat::Snorm16x2 | VertexFormat::Snorm16x4 => {
            let whole = (value.clamp(-1.0, 1.0) * 32_767.0).round() as i16;
            (whole.to_le_bytes().to_vec(), f64::from(whole) / 32_767.0)
        }
        VertexFormat::Unorm8x4 => {
            let whole = (value.clamp(0.0, 1.0) * 255.0).round() as u8;
            (vec![whole], f64::from(whole) / 255.0)
        }
        _ => {
            let whole = value.abs().round() as u32;
            (whole.to_le_bytes().to_vec(), f64::from(whole))
        }
    }
}

/// The half float towards zero from a number between 2^-14 and 2 in size, or zero.
fn half(value: f32) -> (u16, f64) {
    let exponent = value.abs().log2().floor();
    if value == 0.0 || exponent < -14.0 {
        return (0, 0.0);
    }
    let steps = (value.abs() / exponent.exp2() * 1024.0).floor();
    let bits = (exponent as i32 + 15) as u16 * 1024 + (steps as u16 - 1024);
    let size = f64::from(steps) / 1024.0 * f64::from(exponent).exp2();
    if value < 0.0 { (bits | 0x8000, -size) } else { (bits, size) }
}

fn components(format: VertexFormat) -> usize {
    match format {
        VertexFormat::F32 | VertexFormat::U32 => 1,
        VertexFormat::F32x2 | VertexFormat::F16x2 | VertexFormat::Snorm16x2 => 2,
        VertexFormat::F32x3 => 3,
        _ => 4,
    }
}

/// Memory layout of a model.
#[derive(Debug, Clone, Copy)]
struct Case {
    format: VertexFormat,
    indices: Option<IndexFormat>,
    /// Other bytes lie before, between and behind the vertices and before the indices.
    spread: bool,
}

/// A model on the GPU and its triangles as they are decoded.
struct Model {
    blas: Holder<AccelStructHandle>,
    decoded: Geometry,
}

impl Model {
    fn is_line(&self) -> bool {
        self.decoded.positions.iter().all(|position| position.y == 0.0 && position.z == 0.0)
    }
}

/// Bytes that are no good as any number: NaN, and indices far beyond the end.
const JUNK: u8 = 0xff;

impl Case {
    fn bytes(&self, mesh: &Mesh) -> (Vec<u8>, Vec<DVec3>, [u64; 2]) {
        let unit = encoded(self.format, 0.0).0.len();
        let gap = if self.spread { vec![JUNK; unit] } else { Vec::new() };
        let (mut bytes, mut decoded) = (gap.repeat(3), Vec::new());
        let offset = bytes.len() as u64;
        for position in &mesh.positions {
            let mut point = DVec3::ZERO;
            for index in 0..components(self.format) {
                let value = position.get(index).copied().unwrap_or(0.7);
                let (component, stands_for) = encoded(self.format, value);
                bytes.extend(component);
                if index < 3 {
                    point[index] = stands_for;
                }
            }
            bytes.extend(&gap);
            decoded.push(point);
        }
        let stride = if self.spread { u64::from(self.format.size_bytes()) + unit as u64 } else { 0 };
        (bytes, decoded, [offset, stride])
    }

    fn index_bytes(&self, mesh: &Mesh) -> Option<(Vec<u8>, u64, IndexFormat)> {
        let format = self.indices?;
        let mut bytes = vec![JUNK; if self.spread { 3 * format.size_bytes() as usize } else { 0 }];
        let offset = bytes.len() as u64;
        for index in mesh.triangles.iter().flatten() {
            match format {
                IndexFormat::U8 => bytes.push(*index as u8),
                IndexFormat::U16 => bytes.extend((*index as u16).to_le_bytes()),
                IndexFormat::U32 => bytes.extend(index.to_le_bytes()),
            }
        }
        Some((bytes, offset, format))
    }

    fn build(&self, ctx: &Context, mesh: &Mesh) -> Result<Model> {
        let mesh = if self.indices.is_none() { mesh.unshared() } else { mesh.clone() };
        let (bytes, positions, [vertex_offset, vertex_stride]) = self.bytes(&mesh);
        let vertices = input(ctx, &bytes)?;
        let indices = self.index_bytes(&mesh);
        let index_buffer = indices.as_ref().map(|(bytes, ..)| input(ctx, bytes)).transpose()?;
        let indices = indices.zip(index_buffer.as_ref()).map(|((_, offset, format), buffer)| Indices {
            buffer: **buffer,
            offset,
            format,
        });
        let triangles = Triangles {
            vertex_format: self.format,
            vertex_offset,
            vertex_stride,
            indices,
            triangle_count: mesh.triangles.len() as u32,
            ..Triangles::packed(*vertices, mesh.positions.len() as u32)
        };
        let geometries = [BlasGeometry::Triangles(triangles)];
        let blas =
            ctx.create_blas(&BlasDesc { geometries: &geometries, debug_name: "odd", ..Default::default() })?;
        let (transform, is_opaque) = (DAffine3::IDENTITY, true);
        Ok(Model { blas, decoded: Geometry { positions, triangles: mesh.triangles, transform, is_opaque } })
    }
}

fn input(ctx: &Context, bytes: &[u8]) -> Result<Holder<BufferHandle>> {
    let usage = BufferUsage::ACCEL_INPUT;
    ctx.create_buffer(&BufferDesc { data: Some(bytes), usage, ..Default::default() })
}

/// Hills for formats with three components, the floor they stand on for those with two; within -0.9 and 0.9.
fn mesh() -> Mesh {
    let mut mesh = Mesh::terrain(8);
    for position in &mut mesh.positions {
        *position = (Vec3::from(*position) * 0.9).to_array();
        position.swap(1, 2);
    }
    mesh
}

/// True if the device builds from a format. One it does not take is an error that says so.
fn accepts(ctx: &Context, format: VertexFormat) -> Result<bool> {
    let case = Case { format, indices: None, spread: false };
    match case.build(ctx, &mesh()) {
        Ok(_) => Ok(true),
        Err(error) => {
            assert!(matches!(error, Error::Unsupported { .. }), "{format:?}: {error:?}");
            let text = error.to_string();
            assert!(text.contains("odd") && text.contains(&format!("{format:?}")), "{text}");
            Ok(false)
        }
    }
}

/// Triangles of one number for each corner are lines, which nothing hits: they stand beside hills, which are hit as if those
/// were not there.
fn between_hills(cases: &[Case]) -> Vec<Case> {
    let hills = [Case { format: VertexFormat::F32x3, indices: None, spread: false }];
    [&hills, cases, &hills].concat()
}

/// Rays across the lines that triangles of one number for each corner are.
fn rays_at_lines(models: &[Model], placed: &[Placed]) -> Vec<Ray> {
    let lines = models.iter().zip(placed).filter(|(model, _)| model.is_line());
    let across = |(model, placed): (&Model, &Placed)| {
        let to = Vec3::from(placed.transform.translation);
        let points = model.decoded.positions.clone().into_iter().step_by(7);
        points.map(move |point| {
            Ray::new(point.as_vec3() + to - Vec3::new(0.1, 3.0, 0.2), Vec3::new(0.1, 3.0, 0.2))
        })
    };
    lines.flat_map(across).collect()
}

fn check(ctx: &TestDevice, what: &str, cases: &[Case]) -> Result<()> {
    let models: Vec<_> = cases.iter().map(|case| case.build(ctx, &mesh())).collect::<Result<_>>()?;
    let place = |index: usize| {
        let to = Vec3::new((index % 4) as f32 * 2.1, (index / 4) as f32 * 2.1, (index % 3) as f32);
        Placed::new(index, Affine3A::from_translation(to))
    };
    let placed: Vec<_> = (0..models.len()).map(place).collect();
    let at_lines = rays_at_lines(&models, &placed);
    let (handles, decoded): (Vec<_>, Vec<_>) =
        models.into_iter().map(|model| (model.blas, [model.decoded])).unzip();
    let instance = |(placed, geometries): (&Placed, _)| Instance {
        geometries,
        transform: DAffine3::from_translation(placed.transform.translation.as_dvec3()),
        custom_index: 0,
        mask: 0xff,
        flip_facing: false,
        no_cull: false,
        force_opaque: None,
    };
    let all: Vec<_> = placed.iter().zip(decoded.iter().map(|list| &list[..])).map(instance).collect();
    let reference = Reference::new(&all);
    let tlas =
        ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &handles), ..Default::default() })?;
    let (rays, how) = ([rays_for(&reference), at_lines].concat(), How::default());
    HitCheck::new(ctx)?.closest(what, &tlas, &rays, how, |ray| reference.closest_by(ray, how))
}

#[test]
fn every_format_the_device_accepts_is_built_from() -> Result<()> {
    for ctx in devices() {
        for format in FORMATS {
            if !accepts(&ctx, format)? {
                assert!(!MANDATORY.contains(&format), "{format:?} is mandatory");
                eprintln!("{} does not build from {format:?}", ctx.capabilities().device_name);
                continue;
            }
            let cases = INDICES.map(|indices| [false, true].map(|spread| Case { format, indices, spread }));
            let what = format!("{format:?}, indices and strides");
            match components(format) {
                1 => check(&ctx, &what, &between_hills(cases.as_flattened()))?,
                _ => check(&ctx, &what, cases.as_flattened())?,
            }
        }
    }
    Ok(())
}

/// Vertices of different formats stand side by side as geometries of one model.
#[test]
fn a_model_may_mix_formats() -> Result<()> {
    for ctx in devices() {
        let mut geometries = Vec::new();
        let mut buffers = Vec::new();
        let mut decoded = Vec::new();
        for (index, format) in (0..).zip(MANDATORY) {
            let mut mesh = mesh().unshared();
            mesh.positions.iter_mut().for_each(|position| position[0] *= 0.1 + 0.15 * index as f32);
            let case = Case { format, indices: None, spread: index % 2 == 1 };
            let (bytes, positions, [vertex_offset, vertex_stride]) = case.bytes(&mesh);
            let vertices = input(&ctx, &bytes)?;
            let packed = Triangles::packed(*vertices, positions.len() as u32);
            let triangles = Triangles { vertex_format: format, vertex_offset, vertex_stride, ..packed };
            geometries.push(BlasGeometry::Triangles(triangles));
            buffers.push(vertices);
            let (transform, is_opaque) = (DAffine3::IDENTITY, true);
            decoded.push(Geometry { positions, triangles: mesh.triangles, transform, is_opaque });
        }
        let flat: Vec<_> = MANDATORY.iter().map(|format| components(*format) == 2).collect();
        let model = [ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?];
        let placed = [Placed::new(0, Affine3A::IDENTITY)];
        let tlas =
            ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &model), ..Default::default() })?;
        let reference = Reference::new(&[Instance::new(&decoded)]);
        let how = How::default();
        // The flat ones lie in one plane, so only rays that meet a hill first have one answer.
        let rays: Vec<_> = rays_for(&reference)
            .into_iter()
            .filter(|ray| {
                let first = reference.closest_by(ray, how).hit;
                first.is_none_or(|hit| !flat[hit.ids.geometry as usize])
            })
            .collect();
        HitCheck::new(&ctx)?
            .closest("mixed formats", &tlas, &rays, how, |ray| reference.closest_by(ray, how))?;
    }
    Ok(())
}
