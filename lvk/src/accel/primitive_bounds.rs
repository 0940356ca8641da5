//! Bounds of primitives, computed from vertices, indices and AABBs in the way a build reads them.

use glam::{Vec3, Vec4};

use crate::format::VertexFormat;

/// An axis-aligned bounding box (AABB).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
}

impl Bounds {
    /// Empty bounds, the neutral element of a union.
    pub(crate) const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    /// Bounds of a primitive that no ray can hit.
    pub(crate) const ORIGIN: Self = Self { low: Vec3::ZERO, high: Vec3::ZERO };

    pub(crate) fn from_points(points: [Vec3; 3]) -> Self {
        let [a, b, c] = points;
        Self { low: a.min(b).min(c), high: a.max(b).max(c) }
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half of the surface area, proportional to the probability that a ray hits the AABB. 0 for empty bounds. Side
    /// lengths are clamped to [`MAX_SIDE`], so that sums over many AABBs stay finite.
    pub(crate) fn half_area(self) -> f32 {
        let d = (self.high - self.low).max(Vec3::ZERO).min(Vec3::splat(MAX_SIDE));
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

const MAX_SIDE: f32 = 1e12;

/// Vertices in their memory layout.
pub(crate) struct VertexBytes<'a> {
    /// The bytes from the first vertex on.
    pub(crate) bytes: &'a [u8],
    /// Bytes from one vertex to the next; 0 means tightly packed positions.
    pub(crate) stride: usize,
    /// Format of a position.
    pub(crate) format: VertexFormat,
    /// Number of vertices.
    pub(crate) count: u32,
}

impl VertexBytes<'_> {
    /// Position of a vertex; `None` if the vertex is out of range or beyond the bytes.
    fn position(&self, vertex: u32) -> Option<Vec3> {
        if vertex >= self.count {
            return None;
        }
        let packed = self.format.size_bytes() as usize;
        decode_position(self.format, element_bytes(self.bytes, self.stride, packed, vertex)?)
    }
}

/// Indices in their memory layout, three for each triangle. The bytes start at the first index and need no alignment.
pub(crate) enum IndexBytes<'a> {
    /// Every three vertices are a triangle.
    None,
    /// 16-bit indices.
    U16(&'a [u8]),
    /// 32-bit indices.
    U32(&'a [u8]),
}

impl IndexBytes<'_> {
    /// The vertex indices of a triangle; `None` if the triangle is out of range.
    pub(crate) fn vertex_indices(&self, triangle: u32) -> Option<[u32; 3]> {
        match self {
            Self::None => {
                let first = triangle.checked_mul(3)?;
                Some([first, first.checked_add(1)?, first.checked_add(2)?])
            }
            Self::U16(bytes) => Some(
                decode_numbers(element_bytes(bytes, 6, 6, triangle)?, u16::from_le_bytes)?.map(u32::from),
            ),
            Self::U32(bytes) => decode_numbers(element_bytes(bytes, 12, 12, triangle)?, u32::from_le_bytes),
        }
    }
}

/// Triangles in their memory layout.
pub(crate) struct TriangleBytes<'a> {
    pub(crate) vertices: VertexBytes<'a>,
    pub(crate) indices: IndexBytes<'a>,
    /// Number of triangles.
    pub(crate) count: u32,
    /// Transform of the vertices: 3 rows of 4 columns.
    pub(crate) transform: Option<[f32; 12]>,
}

impl TriangleBytes<'_> {
    /// The vertices of a triangle; `None` if a coordinate is NaN or a vertex does not exist.
    pub(crate) fn vertices(&self, triangle: u32) -> Option<[Vec3; 3]> {
        let [a, b, c] = self.indices.vertex_indices(triangle)?;
        let corners = [self.vertex(a)?, self.vertex(b)?, self.vertex(c)?];
        (!corners.iter().any(|corner| corner.is_nan())).then_some(corners)
    }

    /// The bounds of all triangles. A triangle without valid vertices lies at the origin.
    pub(crate) fn bounds(&self) -> Vec<Bounds> {
        let bounds = |triangle| self.vertices(triangle).map_or(Bounds::ORIGIN, Bounds::from_points);
        (0..self.count).map(bounds).collect()
    }

    fn vertex(&self, vertex: u32) -> Option<Vec3> {
        let position = self.vertices.position(vertex)?;
        let Some(m) = &self.transform else { return Some(position) };
        let row = |first: usize| Vec4::new(m[first], m[first + 1], m[first + 2], m[first + 3]);
        Some(Vec3::from_array([0, 4, 8].map(|first| row(first).dot(position.extend(1.0)))))
    }
}

/// AABBs in their memory layout, six floats each: minimum, maximum.
pub(crate) struct AabbListBytes<'a> {
    /// The bytes from the first AABB on.
    pub(crate) bytes: &'a [u8],
    /// Bytes from one AABB to the next; 0 means tightly packed.
    pub(crate) stride: usize,
    /// Number of AABBs.
    pub(crate) count: u32,
}

impl AabbListBytes<'_> {
    /// Bounds of an AABB; `None` if it is inverted, has a NaN coordinate or lies beyond the bytes.
    pub(crate) fn bounds(&self, index: u32) -> Option<Bounds> {
        let bytes = element_bytes(self.bytes, self.stride, 24, index)?;
        let [ax, ay, az, bx, by, bz] = decode_numbers(bytes, f32::from_le_bytes)?;
        let (low, high) = (Vec3::new(ax, ay, az), Vec3::new(bx, by, bz));
        low.cmple(high).all().then_some(Bounds { low, high })
    }

    /// Bounds of all AABBs. Invalid ones lie at the origin.
    pub(crate) fn all_bounds(&self) -> Vec<Bounds> {
        (0..self.count).map(|index| self.bounds(index).unwrap_or(Bounds::ORIGIN)).collect()
    }
}

/// The contents of a geometry's buffers.
pub(crate) enum GeometryBytes<'a> {
    Triangles(TriangleBytes<'a>),
    Boxes(AabbListBytes<'a>),
}

/// The bytes of one element; `None` if the element lies beyond the slice.
fn element_bytes(bytes: &[u8], stride: usize, packed: usize, index: u32) -> Option<&[u8]> {
    let stride = if stride == 0 { packed } else { stride };
    let start = stride.checked_mul(index as usize)?;
    bytes.get(start..start.checked_add(packed)?)
}

/// Decodes a position from the bytes of one vertex. Components that the format lacks are 0. Returns `None` if there
/// are too few bytes, and for formats from which no BLAS can be built.
fn decode_position(format: VertexFormat, bytes: &[u8]) -> Option<Vec3> {
    let snorm = |value: u16| (f32::from(value as i16) / 32767.0).max(-1.0);
    Some(match format {
        VertexFormat::F32 => Vec3::new(decode_numbers::<1, 4, _>(bytes, f32::from_le_bytes)?[0], 0.0, 0.0),
        VertexFormat::F32x2 => with_zero_z(decode_numbers(bytes, f32::from_le_bytes)?),
        VertexFormat::F32x3 | VertexFormat::F32x4 => {
            Vec3::from_array(decode_numbers(bytes, f32::from_le_bytes)?)
        }
        VertexFormat::F16x2 => with_zero_z(decode_numbers(bytes, u16::from_le_bytes)?.map(half_to_f32)),
        VertexFormat::F16x4 => Vec3::from_array(decode_numbers(bytes, u16::from_le_bytes)?.map(half_to_f32)),
        VertexFormat::Snorm16x2 => with_zero_z(decode_numbers(bytes, u16::from_le_bytes)?.map(snorm)),
        VertexFormat::Snorm16x4 => Vec3::from_array(decode_numbers(bytes, u16::from_le_bytes)?.map(snorm)),
        VertexFormat::Unorm8x4 => Vec3::from_array(
            decode_numbers::<3, 1, _>(bytes, u8::from_le_bytes)?.map(|value| f32::from(value) / 255.0),
        ),
        VertexFormat::U32 => {
            Vec3::new(decode_numbers::<1, 4, _>(bytes, u32::from_le_bytes)?[0] as f32, 0.0, 0.0)
        }
        _ => return None,
    })
}

fn with_zero_z([x, y]: [f32; 2]) -> Vec3 {
    Vec3::new(x, y, 0.0)
}

/// Decodes the first `COUNT` numbers of `SIZE` bytes each; `None` if there are too few bytes.
fn decode_numbers<const COUNT: usize, const SIZE: usize, T: Copy + Default>(
    bytes: &[u8],
    read: fn([u8; SIZE]) -> T,
) -> Option<[T; COUNT]> {
    let mut all = [T::default(); COUNT];
    let (chunks, _) = bytes.as_chunks::<SIZE>();
    for (number, chunk) in all.iter_mut().zip(chunks.get(..COUNT)?) {
        *number = read(*chunk);
    }
    Some(all)
}

/// Value of a half float (IEEE 754 binary16); each has an exact `f32`.
fn half_to_f32(half: u16) -> f32 {
    const SMALLEST: f32 = 1.0 / 16_777_216.0;
    let sign = u32::from(half & 0x8000) << 16;
    let exponent = u32::from(half >> 10 & 0x1F);
    let fraction = u32::from(half & 0x3FF);
    let magnitude = match exponent {
        0 => (fraction as f32 * SMALLEST).to_bits(),
        0x1F => 0x7F80_0000 | fraction << 13,
        _ => (exponent + 127 - 15) << 23 | fraction << 13,
    };
    f32::from_bits(sign | magnitude)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn triangle_bounds(
        vertices: &VertexBytes<'_>,
        indices: IndexBytes<'_>,
        count: u32,
        transform: Option<&[f32; 12]>,
    ) -> Vec<Bounds> {
        let vertices = VertexBytes { ..*vertices };
        TriangleBytes { vertices, indices, count, transform: transform.copied() }.bounds()
    }

    fn box_bounds(bytes: &[u8], stride: usize, count: u32) -> Vec<Bounds> {
        AabbListBytes { bytes, stride, count }.all_bounds()
    }

    const FORMATS: [VertexFormat; 10] = [
        VertexFormat::F32,
        VertexFormat::F32x2,
        VertexFormat::F32x3,
        VertexFormat::F32x4,
        VertexFormat::F16x2,
        VertexFormat::F16x4,
        VertexFormat::Snorm16x2,
        VertexFormat::Snorm16x4,
        VertexFormat::Unorm8x4,
        VertexFormat::U32,
    ];

    #[test]
    fn every_half_float_has_its_value() {
        for half in 0..=u16::MAX {
            let (exponent, fraction) = (i32::from(half >> 10 & 0x1F), f64::from(half & 0x3FF));
            let sign = if half >> 15 == 1 { -1.0 } else { 1.0 };
            let value = half_to_f32(half);
            match exponent {
                0x1F if fraction > 0.0 => assert!(value.is_nan()),
                0x1F => assert_eq!(f64::from(value), sign * f64::INFINITY),
                0 => assert_eq!(f64::from(value), sign * fraction / 1024.0 * 2_f64.powi(-14)),
                _ => {
                    assert_eq!(f64::from(value), sign * (1.0 + fraction / 1024.0) * 2_f64.powi(exponent - 15))
                }
            }
            assert_eq!(value.is_sign_negative(), sign < 0.0);
        }
    }

    #[test]
    fn every_format_is_read_as_the_device_reads_it() {
        let floats: Vec<u8> = [1.5_f32, -2.0, 3.0, 9.0].into_iter().flat_map(f32::to_le_bytes).collect();
        let halves: Vec<u8> =
            [0x3C00_u16, 0xC000, 0x3800, 0x7C00].into_iter().flat_map(u16::to_le_bytes).collect();
        let norms: Vec<u8> = [32767_i16, -32768, -32767, 5].into_iter().flat_map(i16::to_le_bytes).collect();
        let cases = [
            (VertexFormat::F32, &floats[..4], [1.5, 0.0, 0.0]),
            (VertexFormat::F32x2, &floats[..8], [1.5, -2.0, 0.0]),
            (VertexFormat::F32x3, &floats[..12], [1.5, -2.0, 3.0]),
            (VertexFormat::F32x4, &floats[..], [1.5, -2.0, 3.0]),
            (VertexFormat::F16x2, &halves[..4], [1.0, -2.0, 0.0]),
            (VertexFormat::F16x4, &halves[..], [1.0, -2.0, 0.5]),
            (VertexFormat::Snorm16x2, &norms[..4], [1.0, -1.0, 0.0]),
            (VertexFormat::Snorm16x4, &norms[..], [1.0, -1.0, -1.0]),
            (VertexFormat::Unorm8x4, &[0, 255, 51, 7], [0.0, 1.0, 0.2]),
            (VertexFormat::U32, &[3, 0, 0, 0], [3.0, 0.0, 0.0]),
        ];
        for (format, bytes, expected) in cases {
            assert_eq!(bytes.len(), format.size_bytes() as usize);
            assert_eq!(decode_position(format, bytes), Some(Vec3::from(expected)), "{format:?}");
            assert_eq!(decode_position(format, &bytes[..1]), None, "{format:?} cut short");
        }
    }

    #[test]
    fn a_transform_moves_the_vertices() {
        let bytes: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect();
        let vertices = VertexBytes { bytes: &bytes, stride: 0, format: VertexFormat::F32x3, count: 3 };
        let mirrored = [-2.0, 0.0, 0.0, 10.0, 0.0, 1.0, 0.0, 20.0, 0.0, 3.0, 1.0, 30.0];
        let bounds = triangle_bounds(&vertices, IndexBytes::None, 1, Some(&mirrored));
        let expected = Bounds { low: Vec3::new(8.0, 20.0, 30.0), high: Vec3::new(10.0, 21.0, 33.0) };
        assert_eq!(bounds, [expected]);
    }

    #[test]
    fn triangles_that_cannot_be_read_lie_at_the_origin() {
        let numbers = [5.0, 5.0, 5.0, 6.0, 5.0, 5.0, 5.0, 6.0, 5.0, 5.0, f32::NAN, 5.0];
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f32::to_le_bytes).collect();
        let vertices = VertexBytes { bytes: &bytes, stride: 12, format: VertexFormat::F32x3, count: 9 };
        let indices: Vec<u8> =
            [0_u16, 1, 2, 0, 1, 3, 0, 1, 4, 0, 9, 1, 0].into_iter().flat_map(u16::to_le_bytes).collect();
        let bounds = triangle_bounds(&vertices, IndexBytes::U16(&indices), 6, None);
        assert_eq!(bounds[0], Bounds { low: Vec3::splat(5.0), high: Vec3::new(6.0, 6.0, 5.0) });
        assert_eq!(bounds[1..], [Bounds::ORIGIN; 5], "not a number, no bytes, no vertex, no indices");
        let fewer = VertexBytes { count: 2, ..vertices };
        assert_eq!(triangle_bounds(&fewer, IndexBytes::None, 1, None), [Bounds::ORIGIN]);
    }

    #[test]
    fn boxes_are_read_at_their_stride() {
        let numbers = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 99.0, 99.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0];
        let bytes: Vec<u8> = numbers.map(f32::to_le_bytes).concat();
        let first = Bounds { low: Vec3::ZERO, high: Vec3::new(1.0, 2.0, 3.0) };
        assert_eq!(box_bounds(&bytes, 32, 3), [first, Bounds::ORIGIN, Bounds::ORIGIN], "inverted, not there");
        assert_eq!(box_bounds(&bytes, 0, 1), [first]);
    }

    #[test]
    fn areas_are_finite_whatever_the_box() {
        assert_eq!(Bounds { low: Vec3::ZERO, high: Vec3::new(1.0, 2.0, 3.0) }.half_area(), 11.0);
        assert_eq!(Bounds::EMPTY.half_area(), 0.0);
        assert_eq!(Bounds { low: Vec3::NAN, high: Vec3::ONE }.half_area(), 0.0);
        let everything = Bounds { low: Vec3::NEG_INFINITY, high: Vec3::INFINITY };
        assert!((everything.half_area() * u32::MAX as f32).is_finite());
    }

    proptest! {
        #[test]
        fn boxes_hold_their_triangles(
            corners in prop::collection::vec(prop::array::uniform3(-100.0_f32..100.0), 1..30),
            picks in prop::collection::vec(prop::array::uniform3(any::<u16>()), 0..40),
            padding in 0..3_usize,
        ) {
            let mut bytes = Vec::new();
            for corner in &corners {
                bytes.extend(corner.iter().flat_map(|value| value.to_le_bytes()));
                bytes.resize(bytes.len() + 4 * padding, 0xFF);
            }
            let count = corners.len() as u32;
            let vertices = VertexBytes { bytes: &bytes, stride: 12 + 4 * padding, format: VertexFormat::F32x3, count };
            let picks: Vec<_> = picks.iter().map(|pick| pick.map(|vertex| vertex % count as u16)).collect();
            let short: Vec<u8> = picks.concat().into_iter().flat_map(u16::to_le_bytes).collect();
            let long: Vec<u8> = picks.concat().into_iter().map(u32::from).flat_map(u32::to_le_bytes).collect();
            let bounds = triangle_bounds(&vertices, IndexBytes::U16(&short), picks.len() as u32, None);
            prop_assert_eq!(&bounds, &triangle_bounds(&vertices, IndexBytes::U32(&long), picks.len() as u32, None));
            for (bounds, pick) in bounds.iter().zip(&picks) {
                for axis in [0, 1, 2] {
                    let values = pick.map(|vertex| corners[vertex as usize][axis]);
                    prop_assert_eq!(bounds.low[axis], values.into_iter().fold(f32::INFINITY, f32::min));
                    prop_assert_eq!(bounds.high[axis], values.into_iter().fold(f32::NEG_INFINITY, f32::max));
                }
            }
        }

        #[test]
        fn arbitrary_bytes_give_a_box_for_each_primitive(
            bytes in prop::collection::vec(any::<u8>(), 0..200),
            indices in prop::collection::vec(any::<u8>(), 0..200),
            stride in prop_oneof![0..40_usize, Just(usize::MAX)],
            format in prop::sample::select(&FORMATS[..]),
            count in any::<u32>(),
            transform in prop::option::of(prop::array::uniform12(prop::num::f32::ANY)),
        ) {
            let vertices = VertexBytes { bytes: &bytes, stride, format, count };
            for indices in [IndexBytes::None, IndexBytes::U16(&indices), IndexBytes::U32(&indices)] {
                let bounds = triangle_bounds(&vertices, indices, 50, transform.as_ref());
                prop_assert_eq!(bounds.len(), 50);
                prop_assert!(bounds.iter().all(|bounds| bounds.low.cmple(bounds.high).all()));
            }
            let bounds = box_bounds(&bytes, stride, 50);
            prop_assert!(bounds.iter().all(|bounds| bounds.low.cmple(bounds.high).all()));
        }
    }
}
