//! Geometries in the layout of the kernels.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use crate::accel::geometry::{BlasGeometry, GeometryTransform, Triangles};
use crate::error::{Error, Result};
use crate::format::VertexFormat;
use crate::handle::BufferHandle;
use crate::resource::Buffer;

/// Bytes of a matrix of 3 rows of 4 columns.
const MATRIX_BYTES: u64 = 48;
const BOX_BYTES: u64 = 24;

/// `Geometry` of `software_ray_query/kernels/input.glsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct GpuGeometry {
    pub(crate) data: u64,
    pub(crate) indices: u64,
    pub(crate) matrix: u64,
    pub(crate) stride: u32,
    pub(crate) format: u32,
    pub(crate) index_bytes: u32,
    pub(crate) vertex_count: u32,
    pub(crate) first_primitive: u32,
    pub(crate) first_vertex: u32,
    pub(crate) flags: u32,
    pub(crate) reserved: [u32; 3],
}

/// Returns validated geometries in the layout of the kernels.
///
/// `matrices` is the address of the matrices that are given by value: a multiple of 16, with 48 bytes for each
/// geometry. It is `None` without such matrices.
///
/// # Errors
/// A destroyed buffer; more primitives than 32 bits can count.
pub(crate) fn gpu_geometries(
    name: &str,
    geometries: &[BlasGeometry],
    find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
    matrices: Option<u64>,
) -> Result<Vec<GpuGeometry>> {
    let (mut primitives, mut vertices) = (0_u32, 0_u32);
    let mut list = Vec::with_capacity(geometries.len());
    for (index, geometry) in geometries.iter().enumerate() {
        let matrix = match (geometry.transform_rows(), matrices) {
            (Some(_), Some(start)) => start + index as u64 * MATRIX_BYTES,
            _ => 0,
        };
        let read = match geometry {
            BlasGeometry::Triangles(triangles) => geometry_triangles(triangles, find, matrix)?,
            BlasGeometry::Aabbs(boxes) => GpuGeometry {
                data: find(boxes.buffer)?.address + boxes.offset,
                stride: if boxes.stride == 0 { BOX_BYTES } else { boxes.stride } as u32,
                ..Zeroable::zeroed()
            },
        };
        let flags = geometry.flags().bits();
        list.push(GpuGeometry { first_primitive: primitives, first_vertex: vertices, flags, ..read });
        let too_many = || Error::usage(name, "the geometries have more primitives than 32 bits count");
        primitives = primitives.checked_add(geometry.primitive_count()).ok_or_else(too_many)?;
        // With more vertices than 32 bits can count, leaves have copies of positions.
        vertices = vertices.saturating_add(read.vertex_count);
    }
    Ok(list)
}

/// Returns the number of vertices that a geometry may refer to.
pub(crate) fn vertex_count(geometry: &BlasGeometry) -> u32 {
    match geometry {
        BlasGeometry::Triangles(triangles) => triangles.vertex_count,
        BlasGeometry::Aabbs(_) => 0,
    }
}

fn geometry_triangles(
    triangles: &Triangles,
    find: &dyn Fn(BufferHandle) -> Result<Arc<Buffer>>,
    matrix: u64,
) -> Result<GpuGeometry> {
    let format = triangles.vertex_format;
    let number = format_id(format).ok_or_else(|| {
        Error::unsupported(format!("vertex format {format:?} in a build"), "F32x3 always works")
    })?;
    let stride = match triangles.vertex_stride {
        0 => u64::from(format.size_bytes()),
        stride => stride,
    };
    let (indices, index_bytes) = match triangles.indices {
        Some(indices) => (find(indices.buffer)?.address + indices.offset, indices.format.size_bytes()),
        None => (0, 0),
    };
    let matrix = match triangles.transform {
        Some(GeometryTransform::Buffer { buffer, offset }) => find(buffer)?.address + offset,
        _ => matrix,
    };
    Ok(GpuGeometry {
        data: find(triangles.vertex_buffer)?.address + triangles.vertex_offset,
        indices,
        matrix,
        stride: stride as u32,
        format: number,
        index_bytes,
        vertex_count: triangles.vertex_count,
        ..Zeroable::zeroed()
    })
}

/// Returns the id of a vertex format that acceleration structures support, for `positionAt` of
/// `software_ray_query/kernels/input.glsl`.
fn format_id(format: VertexFormat) -> Option<u32> {
    Some(match format {
        VertexFormat::F32 => 0,
        VertexFormat::F32x2 => 1,
        VertexFormat::F32x3 => 2,
        VertexFormat::F32x4 => 3,
        VertexFormat::F16x2 => 4,
        VertexFormat::F16x4 => 5,
        VertexFormat::Snorm16x2 => 6,
        VertexFormat::Snorm16x4 => 7,
        VertexFormat::Unorm8x4 => 8,
        VertexFormat::U32 => 9,
        _ => return None,
    })
}
