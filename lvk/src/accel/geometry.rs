//! Geometries of a BLAS: checked and converted once, for the size query and for the build.

use std::sync::Arc;

use ash::vk;
use bitflags::bitflags;

use super::transform::is_finite;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit, check_limit_of};
use crate::format::{IndexFormat, VertexFormat};
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::handle::BufferHandle;
use crate::resource::Buffer;
use crate::resource::buffer::BufferUsage;

bitflags! {
    /// Ray behaviour of a geometry.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct GeometryFlags: u32 {
        /// Runs no any-hit shader: every hit counts.
        const OPAQUE = 1;
        /// Runs the any-hit shader at most once for each primitive.
        const NO_DUPLICATE_ANY_HIT = 1 << 1;
    }
}

/// Indices of triangles, three for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indices {
    /// A buffer with [`BufferUsage::ACCEL_INPUT`].
    pub buffer: BufferHandle,
    /// Offset of the first index in bytes, a multiple of the index size.
    pub offset: u64,
    /// Format of an index.
    pub format: IndexFormat,
}

/// Triangles of a BLAS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangles {
    /// A buffer with [`BufferUsage::ACCEL_INPUT`] that holds the positions.
    pub vertex_buffer: BufferHandle,
    /// Offset of the first vertex in bytes.
    pub vertex_offset: u64,
    /// Bytes from one vertex to the next; 0 means tightly packed positions.
    pub vertex_stride: u64,
    /// Format of a position.
    pub vertex_format: VertexFormat,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Indices; without them every three vertices are a triangle.
    pub indices: Option<Indices>,
    /// Number of triangles.
    pub triangle_count: u32,
    /// Transform of the vertices before the build.
    pub transform: Option<GeometryTransform>,
    /// Ray behaviour of the triangles.
    pub flags: GeometryFlags,
}

impl Triangles {
    /// Opaque triangles of packed [`VertexFormat::F32x3`] positions, three for each.
    pub fn packed(vertex_buffer: BufferHandle, vertex_count: u32) -> Self {
        Self {
            vertex_buffer,
            vertex_offset: 0,
            vertex_stride: 0,
            vertex_format: VertexFormat::F32x3,
            vertex_count,
            indices: None,
            triangle_count: vertex_count / 3,
            transform: None,
            flags: GeometryFlags::OPAQUE,
        }
    }

    /// As [`packed`](Self::packed), with [`IndexFormat::U32`] indices, three for each triangle.
    pub fn indexed(
        vertex_buffer: BufferHandle,
        vertex_count: u32,
        index_buffer: BufferHandle,
        triangle_count: u32,
    ) -> Self {
        let indices = Indices { buffer: index_buffer, offset: 0, format: IndexFormat::U32 };
        Self { indices: Some(indices), triangle_count, ..Self::packed(vertex_buffer, vertex_count) }
    }
}

/// A matrix of 3 rows of 4 columns, row by row (`VkTransformMatrixKHR`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GeometryTransform {
    /// A matrix of finite numbers by value; [`rows_from_columns`](crate::rows_from_columns) converts columns.
    Rows([f32; 12]),
    /// 48 bytes in a buffer, read by every build.
    Buffer {
        /// A buffer with [`BufferUsage::ACCEL_INPUT`].
        buffer: BufferHandle,
        /// Offset of the matrix in bytes, a multiple of 16.
        offset: u64,
    },
}

impl From<[f32; 12]> for GeometryTransform {
    fn from(rows: [f32; 12]) -> Self {
        Self::Rows(rows)
    }
}

/// Axis-aligned bounding boxes, each `[f32; 6]`: minimum, maximum. An intersection shader computes the hits inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Aabbs {
    /// A buffer with [`BufferUsage::ACCEL_INPUT`].
    pub buffer: BufferHandle,
    /// Offset of the first AABB in bytes, a multiple of 8.
    pub offset: u64,
    /// Bytes from one AABB to the next, a multiple of 8; 0 means tightly packed (24).
    pub stride: u64,
    /// Number of AABBs.
    pub count: u32,
    /// Ray behaviour of the AABBs.
    pub flags: GeometryFlags,
}

/// One geometry of a BLAS. All geometries of a BLAS are of the same kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BlasGeometry {
    /// Triangles.
    Triangles(Triangles),
    /// Axis-aligned bounding boxes.
    Aabbs(Aabbs),
}

/// A geometry in Vulkan's form, with its number of primitives.
#[derive(Clone, Copy)]
pub(crate) struct VulkanGeometry {
    pub(crate) raw: vk::AccelerationStructureGeometryKHR<'static>,
    pub(crate) primitive_count: u32,
}

impl BlasGeometry {
    /// The buffers that a build reads.
    pub(crate) fn buffers(&self) -> impl Iterator<Item = BufferHandle> {
        let all = match self {
            Self::Triangles(t) => {
                [Some(t.vertex_buffer), t.indices.map(|indices| indices.buffer), self.transform_buffer()]
            }
            Self::Aabbs(aabbs) => [Some(aabbs.buffer), None, None],
        };
        all.into_iter().flatten()
    }

    /// The transform matrix, if it is given by value.
    pub(crate) fn transform_rows(&self) -> Option<[f32; 12]> {
        match self {
            Self::Triangles(Triangles { transform: Some(GeometryTransform::Rows(rows)), .. }) => Some(*rows),
            _ => None,
        }
    }

    fn transform_buffer(&self) -> Option<BufferHandle> {
        match self {
            Self::Triangles(Triangles {
                transform: Some(GeometryTransform::Buffer { buffer, .. }), ..
            }) => Some(*buffer),
            _ => None,
        }
    }

    pub(crate) fn flags(&self) -> GeometryFlags {
        match self {
            Self::Triangles(triangles) => triangles.flags,
            Self::Aabbs(aabbs) => aabbs.flags,
        }
    }

    /// True if the geometry holds AABBs.
    pub(crate) fn is_aabbs(&self) -> bool {
        matches!(self, Self::Aabbs(_))
    }

    pub(crate) fn primitive_count(&self) -> u32 {
        match self {
            Self::Triangles(triangles) => triangles.triangle_count,
            Self::Aabbs(aabbs) => aabbs.count,
        }
    }

    /// Checks and converts the geometry. `matrix` is the address of a transform matrix given by value, else 0.
    pub(crate) fn convert(
        &self,
        gpu: &Gpu,
        name: &str,
        find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
        matrix: u64,
    ) -> Result<VulkanGeometry> {
        match self {
            Self::Triangles(triangles) => convert_triangles(triangles, gpu, name, find, matrix),
            Self::Aabbs(aabbs) => convert_aabbs(aabbs, find),
        }
    }
}

/// Checks the list of geometries, and the formats and the transform of each.
pub(crate) fn check_geometries(name: &str, geometries: &[BlasGeometry], limits: &Limits) -> Result<()> {
    for (index, geometry) in geometries.iter().enumerate() {
        if let BlasGeometry::Triangles(triangles) = geometry {
            check_formats(name, triangles)?;
        }
        if geometry.transform_rows().is_some_and(|rows| !is_finite(&rows)) {
            let message = format!("the transform of geometry {index} is not finite; give finite numbers");
            return Err(Error::usage(name, message));
        }
    }
    if geometries.is_empty() {
        return Err(Error::usage(name, "a bottom-level structure needs at least one geometry"));
    }
    if geometries.iter().any(|geometry| geometry.is_aabbs() != geometries[0].is_aabbs()) {
        return Err(Error::usage(name, "triangles and boxes cannot share a structure; make two"));
    }
    check_limit(name, "geometry count", geometries.len() as u64, limits.max_blas_geometries)
}

/// Fails for formats that only draws support.
fn check_formats(name: &str, triangles: &Triangles) -> Result<()> {
    let format = triangles.vertex_format;
    if !format.is_position() {
        let what = format!("vertex format {format:?} in acceleration structure '{name}'");
        return Err(Error::unsupported(what, "no BLAS can be built from it; F32x3 always works"));
    }
    if triangles.indices.is_some_and(|indices| indices.format == IndexFormat::U8) {
        let what = format!("8-bit indices in acceleration structure '{name}'");
        return Err(Error::unsupported(what, "Vulkan builds from 16 and 32-bit indices"));
    }
    Ok(())
}

fn convert_triangles(
    triangles: &Triangles,
    gpu: &Gpu,
    name: &str,
    find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
    matrix: u64,
) -> Result<VulkanGeometry> {
    let format = triangles.vertex_format;
    let vertex_features = vk::FormatFeatureFlags::ACCELERATION_STRUCTURE_VERTEX_BUFFER_KHR;
    if gpu.accel.is_some() && !gpu.buffer_features(format.raw()).contains(vertex_features) {
        let what = format!("vertex format {format:?} in acceleration structure '{name}'");
        return Err(Error::unsupported(what, "the device cannot build from it; F32x3 always works"));
    }
    let vertices = find(triangles.vertex_buffer)?;
    vertices.check_usage(BufferUsage::ACCEL_INPUT)?;
    let packed = u64::from(format.size_bytes());
    let stride = if triangles.vertex_stride == 0 { packed } else { triangles.vertex_stride };
    let unit = u64::from(format.component_bytes());
    check_alignment(name, "vertex offset", triangles.vertex_offset, unit)?;
    check_alignment(name, "vertex stride", stride, unit)?;
    check_limit_of(LimitOrigin::Vulkan, name, "vertex stride in bytes", stride, u32::MAX.into())?;
    check_elements(&vertices, triangles.vertex_offset, triangles.vertex_count, stride, packed)?;
    if triangles.indices.is_some() && triangles.triangle_count > 0 && triangles.vertex_count == 0 {
        let message = format!("{} triangles with indices need at least one vertex", triangles.triangle_count);
        return Err(Error::usage(name, message));
    }
    let matrix = match triangles.transform {
        Some(GeometryTransform::Buffer { buffer, offset }) => transform_address(name, buffer, offset, find)?,
        _ => matrix,
    };
    let mut data = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(format.raw())
        .vertex_data(host_or_device_address(vertices.address + triangles.vertex_offset))
        .vertex_stride(stride)
        .max_vertex(triangles.vertex_count.saturating_sub(1))
        .index_type(vk::IndexType::NONE_KHR)
        .transform_data(host_or_device_address(matrix));
    match triangles.indices {
        Some(indices) => {
            data = data
                .index_type(indices.format.raw())
                .index_data(index_address(name, triangles, indices, find)?);
        }
        None if u64::from(triangles.triangle_count) * 3 > u64::from(triangles.vertex_count) => {
            let message = format!("{} triangles need three vertices each", triangles.triangle_count);
            return Err(Error::usage(name, message));
        }
        None => {}
    }
    let raw = vulkan_geometry(vk::GeometryTypeKHR::TRIANGLES, triangles.flags)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles: data });
    Ok(VulkanGeometry { raw, primitive_count: triangles.triangle_count })
}

fn index_address(
    name: &str,
    triangles: &Triangles,
    indices: Indices,
    find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
) -> Result<vk::DeviceOrHostAddressConstKHR> {
    let buffer = find(indices.buffer)?;
    buffer.check_usage(BufferUsage::ACCEL_INPUT)?;
    let size = u64::from(indices.format.size_bytes());
    check_alignment(name, "index offset", indices.offset, size)?;
    buffer.check_range(indices.offset, u64::from(triangles.triangle_count) * 3 * size)?;
    Ok(host_or_device_address(buffer.address + indices.offset))
}

fn transform_address(
    name: &str,
    buffer: BufferHandle,
    offset: u64,
    find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
) -> Result<u64> {
    const MATRIX_BYTES: u64 = 48;
    let buffer = find(buffer)?;
    buffer.check_usage(BufferUsage::ACCEL_INPUT)?;
    check_alignment(name, "transform offset", offset, 16)?;
    buffer.check_range(offset, MATRIX_BYTES)?;
    Ok(buffer.address + offset)
}

fn convert_aabbs(
    aabbs: &Aabbs,
    find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
) -> Result<VulkanGeometry> {
    const BOX_BYTES: u64 = 24;
    let buffer = find(aabbs.buffer)?;
    buffer.check_usage(BufferUsage::ACCEL_INPUT)?;
    let stride = if aabbs.stride == 0 { BOX_BYTES } else { aabbs.stride };
    check_alignment(&buffer.name, "box offset", aabbs.offset, 8)?;
    check_alignment(&buffer.name, "box stride", stride, 8)?;
    check_limit_of(LimitOrigin::Vulkan, &buffer.name, "box stride in bytes", stride, u32::MAX.into())?;
    check_elements(&buffer, aabbs.offset, aabbs.count, stride, BOX_BYTES)?;
    let data = vk::AccelerationStructureGeometryAabbsDataKHR::default()
        .data(host_or_device_address(buffer.address + aabbs.offset))
        .stride(stride);
    let raw = vulkan_geometry(vk::GeometryTypeKHR::AABBS, aabbs.flags)
        .geometry(vk::AccelerationStructureGeometryDataKHR { aabbs: data });
    Ok(VulkanGeometry { raw, primitive_count: aabbs.count })
}

fn vulkan_geometry(
    kind: vk::GeometryTypeKHR,
    flags: GeometryFlags,
) -> vk::AccelerationStructureGeometryKHR<'static> {
    let pairs = [
        (GeometryFlags::OPAQUE, vk::GeometryFlagsKHR::OPAQUE),
        (GeometryFlags::NO_DUPLICATE_ANY_HIT, vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION),
    ];
    let none = vk::GeometryFlagsKHR::empty();
    let raw = pairs.iter().filter(|(bit, _)| flags.contains(*bit)).fold(none, |all, (_, raw)| all | *raw);
    vk::AccelerationStructureGeometryKHR::default().geometry_type(kind).flags(raw)
}

pub(crate) fn host_or_device_address(device_address: u64) -> vk::DeviceOrHostAddressConstKHR {
    vk::DeviceOrHostAddressConstKHR { device_address }
}

fn check_alignment(name: &str, what: &str, value: u64, unit: u64) -> Result<()> {
    if value.is_multiple_of(unit) {
        return Ok(());
    }
    Err(Error::usage(name, format!("{what} is {value}, it must be a multiple of {unit} bytes")))
}

/// Fails unless `count` elements of `size` bytes, `stride` apart, lie inside the buffer.
fn check_elements(buffer: &Buffer, offset: u64, count: u32, stride: u64, size: u64) -> Result<()> {
    let before_last = stride.checked_mul(u64::from(count).saturating_sub(1));
    let bytes = match (count, before_last) {
        (0, _) => Some(0),
        (_, Some(before)) => before.checked_add(size),
        (_, None) => None,
    };
    let too_large = || Error::usage(&buffer.name, "stride times count overflows");
    buffer.check_range(offset, bytes.ok_or_else(too_large)?)
}
