//! Reads mesh inputs back to compute the bounds of their primitives.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::Context;
use crate::accel::desc::BlasDesc;
use crate::accel::geometry::{BlasGeometry, GeometryTransform, Triangles};
use crate::accel::primitive_bounds::{
    AabbListBytes, Bounds, GeometryBytes, IndexBytes, TriangleBytes, VertexBytes,
};
use crate::command::transfer::BufferCopy;
use crate::device_state::DeferredObject;
use crate::error::Result;
use crate::format::IndexFormat;
use crate::handle::BufferHandle;
use crate::resource::Buffer;

/// Maximum bytes of one readback. The inputs of a whole scene may exceed the readback memory.
const MAX_READ_BYTES: u64 = 64 << 20;

/// A range of a buffer: handle, offset in bytes, size in bytes.
type InputRange = (BufferHandle, u64, u64);

/// Buffer ranges that are read together, each once.
#[derive(Default)]
pub(crate) struct InputBytes {
    index_by_range: HashMap<InputRange, usize>,
    /// Each buffer, and the offset of its first byte.
    buffers: Vec<(Arc<Buffer>, u64)>,
    /// Position of each range of the list in `bytes`.
    ranges: Vec<Range<u64>>,
    bytes: Vec<u8>,
}

impl Context {
    /// Returns the bounds of the primitives of each geometry of each mesh. Waits for the GPU.
    pub(super) fn read_bounds(&self, descs: &[&BlasDesc<'_>]) -> Result<Vec<Vec<Vec<Bounds>>>> {
        let inputs = self.read_inputs(descs)?;
        let of_mesh =
            |desc: &&BlasDesc<'_>| desc.geometries.iter().map(|g| geometry_bounds(g, &inputs)).collect();
        Ok(descs.iter().map(of_mesh).collect())
    }

    /// Reads the inputs of meshes. Waits for the GPU.
    pub(crate) fn read_inputs(&self, descs: &[&BlasDesc<'_>]) -> Result<InputBytes> {
        let mut inputs = InputBytes::default();
        for geometry in descs.iter().flat_map(|desc| desc.geometries) {
            for range in input_ranges(geometry) {
                self.add_input_range(&mut inputs, range)?;
            }
        }
        self.read_input_ranges(&mut inputs)?;
        Ok(inputs)
    }

    fn add_input_range(&self, inputs: &mut InputBytes, range: InputRange) -> Result<()> {
        let (handle, offset, size) = range;
        if size == 0 || inputs.index_by_range.contains_key(&range) {
            return Ok(());
        }
        let buffer = self.device_state().store.buffers.get(handle)?;
        inputs.index_by_range.insert(range, inputs.bytes.len());
        inputs.bytes.resize(inputs.bytes.len() + size as usize, 0);
        let start = inputs.ranges.last().map_or(0, |last| last.end);
        inputs.ranges.push(start..start + size);
        inputs.buffers.push((buffer, offset));
        Ok(())
    }

    fn read_input_ranges(&self, inputs: &mut InputBytes) -> Result<()> {
        let InputBytes { buffers: list, ranges, bytes, .. } = inputs;
        let most = MAX_READ_BYTES.min(self.device_state().gpu.caps.limits.max_buffer_bytes).max(1);
        for (bytes, start) in bytes.chunks_mut(most as usize).zip((0_u64..).step_by(most as usize)) {
            let size = bytes.len() as u64;
            self.read_back(size, bytes, |cmd, target| {
                for (index, part) in overlaps(ranges, start..start + size) {
                    let (buffer, offset) = &list[index];
                    self.device_state().free_later(DeferredObject::BufferRef(Arc::clone(buffer)));
                    let from = offset + (part.start - ranges[index].start);
                    cmd.copy_buffer_objects(
                        buffer,
                        target,
                        &[BufferCopy {
                            source_offset: from,
                            target_offset: part.start - start,
                            size: part.end - part.start,
                        }],
                    )?;
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}

impl InputBytes {
    fn bytes_of(&self, range: InputRange) -> &[u8] {
        let start = self.index_by_range.get(&range);
        start.and_then(|start| self.bytes.get(*start..*start + range.2 as usize)).unwrap_or_default()
    }
}

/// Returns the indices of consecutive `ranges` that overlap `window`, with the overlapping part of each.
fn overlaps(ranges: &[Range<u64>], window: Range<u64>) -> impl Iterator<Item = (usize, Range<u64>)> {
    let first = ranges.partition_point(|range| range.end <= window.start);
    let inside = ranges[first..].iter().take_while(move |range| range.start < window.end);
    let common = move |range: &Range<u64>| range.start.max(window.start)..range.end.min(window.end);
    (first..).zip(inside.map(common))
}

/// Returns the buffer ranges that a geometry reads.
fn input_ranges(geometry: &BlasGeometry) -> impl Iterator<Item = InputRange> {
    let ranges = match geometry {
        BlasGeometry::Aabbs(boxes) => {
            const BOX_BYTES: u64 = 24;
            let bytes = span_bytes(boxes.count, boxes.stride, BOX_BYTES);
            [Some((boxes.buffer, boxes.offset, bytes)), None, None]
        }
        BlasGeometry::Triangles(triangles) => {
            [Some(vertex_range(triangles)), index_range(triangles), matrix_range(triangles)]
        }
    };
    ranges.into_iter().flatten()
}

fn vertex_range(triangles: &Triangles) -> InputRange {
    let packed = u64::from(triangles.vertex_format.size_bytes());
    let bytes = span_bytes(triangles.vertex_count, triangles.vertex_stride, packed);
    (triangles.vertex_buffer, triangles.vertex_offset, bytes)
}

fn index_range(triangles: &Triangles) -> Option<InputRange> {
    let indices = triangles.indices?;
    let bytes = u64::from(triangles.triangle_count) * 3 * u64::from(indices.format.size_bytes());
    Some((indices.buffer, indices.offset, bytes))
}

fn matrix_range(triangles: &Triangles) -> Option<InputRange> {
    const MATRIX_BYTES: u64 = 48;
    match triangles.transform {
        Some(GeometryTransform::Buffer { buffer, offset }) => Some((buffer, offset, MATRIX_BYTES)),
        _ => None,
    }
}

/// Returns the bytes from the start of the first element to the end of the last.
fn span_bytes(count: u32, stride: u64, packed: u64) -> u64 {
    let stride = if stride == 0 { packed } else { stride };
    if count == 0 { 0 } else { u64::from(count - 1) * stride + packed }
}

fn geometry_bounds(geometry: &BlasGeometry, inputs: &InputBytes) -> Vec<Bounds> {
    match geometry_bytes(geometry, inputs) {
        GeometryBytes::Boxes(boxes) => boxes.all_bounds(),
        GeometryBytes::Triangles(triangles) => triangles.bounds(),
    }
}

/// Returns the input bytes of a geometry.
pub(crate) fn geometry_bytes<'a>(geometry: &BlasGeometry, inputs: &'a InputBytes) -> GeometryBytes<'a> {
    match geometry {
        BlasGeometry::Aabbs(boxes) => {
            let bytes = input_ranges(geometry).next().map_or(&[][..], |range| inputs.bytes_of(range));
            GeometryBytes::Boxes(AabbListBytes { bytes, stride: boxes.stride as usize, count: boxes.count })
        }
        BlasGeometry::Triangles(triangles) => {
            let bytes = inputs.bytes_of(vertex_range(triangles));
            let vertices = VertexBytes {
                bytes,
                stride: triangles.vertex_stride as usize,
                format: triangles.vertex_format,
                count: triangles.vertex_count,
            };
            let of_triangles = index_range(triangles).map(|range| inputs.bytes_of(range)).unwrap_or_default();
            let indices = match triangles.indices.map(|indices| indices.format) {
                // Acceleration structures are not built from 8-bit indices.
                None | Some(IndexFormat::U8) => IndexBytes::None,
                Some(IndexFormat::U16) => IndexBytes::U16(of_triangles),
                Some(IndexFormat::U32) => IndexBytes::U32(of_triangles),
            };
            let transform = geometry_transform(triangles, inputs);
            GeometryBytes::Triangles(TriangleBytes {
                vertices,
                indices,
                count: triangles.triangle_count,
                transform,
            })
        }
    }
}

fn geometry_transform(triangles: &Triangles, inputs: &InputBytes) -> Option<[f32; 12]> {
    match triangles.transform? {
        GeometryTransform::Rows(rows) => Some(rows),
        GeometryTransform::Buffer { .. } => {
            let mut rows = [0.0; 12];
            let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut rows);
            let found = inputs.bytes_of(matrix_range(triangles)?);
            (found.len() == bytes.len()).then(|| bytes.copy_from_slice(found))?;
            Some(rows)
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn windows_cover_every_byte_once(sizes in prop::collection::vec(1..40_u64, 0..20), most in 1..50_u64) {
            let mut end = 0;
            let mut place = |size: &u64| {
                end += size;
                end - size..end
            };
            let ranges: Vec<_> = sizes.iter().map(&mut place).collect();
            let mut next = 0;
            for start in (0..end).step_by(most as usize) {
                for (index, part) in overlaps(&ranges, start..start + most) {
                    prop_assert_eq!(part.start, next);
                    prop_assert!(part.start >= start && part.end <= start + most && !part.is_empty());
                    prop_assert!(ranges[index].start <= part.start && part.end <= ranges[index].end);
                    next = part.end;
                }
            }
            prop_assert_eq!(next, end);
        }
    }
}
