//! Serialisation of a BLAS: the driver's data of each part, and the data from which the library joins the parts.
//!
//! All numbers are little-endian. The header is: magic (8 bytes), version (`u32`), length of the whole file (`u64`),
//! checksum of all that follows (`u64`). The body is: flags (`u32`), number of geometries (`u32`), the geometries
//! (seven `u32` each), number of parts (`u32`), the parts. A part is: bytes of the driver's data (`u64`), 0 without a
//! map or the words of the map plus one (`u64`), the driver's data, the map.

/// A serialised BLAS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BlasFile {
    /// Build flags, encoded by the caller.
    pub(crate) flags: u32,
    /// The geometries of the BLAS.
    pub(crate) geometries: Vec<BlasFileGeometry>,
    /// The parts of the BLAS, one Vulkan acceleration structure each.
    pub(crate) parts: Vec<BlasFilePart>,
}

/// One geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BlasFileGeometry {
    pub(crate) kind: BlasFileGeometryKind,
    pub(crate) primitive_count: u32,
    /// Geometry flags, encoded by the caller.
    pub(crate) flags: u32,
}

/// Properties of a geometry that a refit must not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlasFileGeometryKind {
    Triangles {
        /// Value of a `VkFormat`.
        vertex_format: u32,
        vertex_count: u32,
        indices: BlasFileIndices,
        is_transformed: bool,
    },
    Boxes,
}

/// Index format of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlasFileIndices {
    None,
    U16,
    U32,
}

/// The acceleration structure of one part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BlasFilePart {
    /// Data that the driver serialised, at least [`VERSION_DATA_BYTES`].
    pub(crate) driver: Vec<u8>,
    /// The words of the part's primitive map; `None` if the primitives are in the caller's order.
    pub(crate) map: Option<Vec<u32>>,
}

/// Bytes at the start of the driver's data that identify compatible drivers: the driver's UUID and the UUID of the
/// format.
pub(crate) const VERSION_DATA_BYTES: usize = 32;

impl BlasFilePart {
    /// The input of `vkGetDeviceAccelerationStructureCompatibilityKHR`.
    pub(crate) fn version_data(&self) -> Option<&[u8; VERSION_DATA_BYTES]> {
        self.driver.first_chunk()
    }
}

/// Reason that bytes cannot be decoded as a BLAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BlasFileError {
    /// The magic is missing.
    #[error("these bytes are not a serialised acceleration structure")]
    NotABlob,
    /// The file has another format version.
    #[error(
        "the acceleration structure was serialised in version {found} of the format, this is version {VERSION}"
    )]
    Version {
        /// The version found.
        found: u32,
    },
    /// Bytes at the end are missing.
    #[error("the serialised acceleration structure is cut off: {found} of {expected} bytes are there")]
    Truncated {
        /// Bytes found.
        found: u64,
        /// Bytes of the whole file, or of the header if that is incomplete.
        expected: u64,
    },
    /// The bytes do not match the checksum.
    #[error("the serialised acceleration structure is damaged: its checksum is wrong")]
    Checksum,
    /// The contents contradict each other.
    #[error("the serialised acceleration structure is damaged: {0}")]
    Malformed(&'static str),
}

const MAGIC: [u8; 8] = *b"\x89lvkblas";
const VERSION: u32 = 2;
pub(crate) const HEADER_BYTES: usize = 28;
const GEOMETRY_WORDS: usize = 7;

/// Encodes a BLAS as bytes.
pub(crate) fn encode_blas_file(blob: &BlasFile) -> Vec<u8> {
    let mut body = Vec::with_capacity(encoded_bytes(blob));
    body.extend([0; HEADER_BYTES]);
    body.extend(blob.flags.to_le_bytes());
    body.extend((blob.geometries.len() as u32).to_le_bytes());
    for geometry in &blob.geometries {
        body.extend(geometry_words(geometry).into_iter().flat_map(u32::to_le_bytes));
    }
    body.extend((blob.parts.len() as u32).to_le_bytes());
    for part in &blob.parts {
        let map = part.map.as_ref().map_or(0, |map| map.len() as u64 + 1);
        body.extend((part.driver.len() as u64).to_le_bytes());
        body.extend(map.to_le_bytes());
        body.extend_from_slice(&part.driver);
        body.extend(part.map.iter().flatten().flat_map(|number| number.to_le_bytes()));
    }
    write_header(&mut body);
    body
}

/// Writes the header of a file over the first [`HEADER_BYTES`] of `file`, which the body follows.
fn write_header(file: &mut [u8]) {
    let (header, body) = file.split_at_mut(HEADER_BYTES);
    let (length, sum) = ((HEADER_BYTES + body.len()) as u64, checksum(body));
    let parts = [&MAGIC[..], &VERSION.to_le_bytes(), &length.to_le_bytes(), &sum.to_le_bytes()];
    header.copy_from_slice(&parts.concat());
}

/// Prepends a valid header to any body, as damage that the checksum does not detect.
#[cfg(any(test, feature = "test-hooks"))]
pub(crate) fn sealed(body: &[u8]) -> Vec<u8> {
    let mut file = [&[0; HEADER_BYTES][..], body].concat();
    write_header(&mut file);
    file
}

/// Decodes the output of [`encode_blas_file`]. Any other bytes are an error.
pub(crate) fn decode_blas_file(bytes: &[u8]) -> Result<BlasFile, BlasFileError> {
    let short = |expected| BlasFileError::Truncated { found: bytes.len() as u64, expected };
    if !MAGIC.starts_with(&bytes[..bytes.len().min(MAGIC.len())]) {
        return Err(BlasFileError::NotABlob);
    }
    let mut reader = BlobReader { rest: bytes.get(MAGIC.len()..).unwrap_or_default() };
    let found = reader.read_u32().ok_or(short(HEADER_BYTES as u64))?;
    if found != VERSION {
        return Err(BlasFileError::Version { found });
    }
    let header = reader.read_u64().zip(reader.read_u64());
    let (length, sum) = header.ok_or(short(HEADER_BYTES as u64))?;
    match length.cmp(&(bytes.len() as u64)) {
        std::cmp::Ordering::Greater => return Err(short(length)),
        std::cmp::Ordering::Less => return Err(BlasFileError::Malformed("bytes follow its end")),
        std::cmp::Ordering::Equal => {}
    }
    if sum != checksum(reader.rest) {
        return Err(BlasFileError::Checksum);
    }
    reader.read_blob()
}

/// Encodes a geometry: kind, primitives, flags. Triangles add the vertex format, the number of vertices, the bits of
/// an index (0, 16 or 32), and 1 for a transform matrix.
fn geometry_words(geometry: &BlasFileGeometry) -> [u32; GEOMETRY_WORDS] {
    let (count, flags) = (geometry.primitive_count, geometry.flags);
    match geometry.kind {
        BlasFileGeometryKind::Triangles { vertex_format, vertex_count, indices, is_transformed } => {
            let index_bits = match indices {
                BlasFileIndices::None => 0,
                BlasFileIndices::U16 => 16,
                BlasFileIndices::U32 => 32,
            };
            [0, count, flags, vertex_format, vertex_count, index_bits, is_transformed.into()]
        }
        BlasFileGeometryKind::Boxes => [1, count, flags, 0, 0, 0, 0],
    }
}

/// Reads numbers from the front of a byte slice.
struct BlobReader<'a> {
    rest: &'a [u8],
}

const TOO_SHORT: BlasFileError = BlasFileError::Malformed("a count exceeds the data that follows");

impl<'a> BlobReader<'a> {
    fn read_blob(mut self) -> Result<BlasFile, BlasFileError> {
        let flags = self.read_u32().ok_or(TOO_SHORT)?;
        let count = self.read_u32().ok_or(TOO_SHORT)?;
        let geometries = (0..count).map(|_| self.read_geometry()).collect::<Result<_, _>>()?;
        let count = self.read_u32().ok_or(TOO_SHORT)?;
        let parts = (0..count).map(|_| self.read_part()).collect::<Result<_, _>>()?;
        if !self.rest.is_empty() {
            return Err(BlasFileError::Malformed("bytes follow its last part"));
        }
        Ok(BlasFile { flags, geometries, parts })
    }

    fn read_geometry(&mut self) -> Result<BlasFileGeometry, BlasFileError> {
        let mut words = [0; GEOMETRY_WORDS];
        for word in &mut words {
            *word = self.read_u32().ok_or(TOO_SHORT)?;
        }
        let [kind, primitive_count, flags, vertex_format, vertex_count, index_bits, matrix] = words;
        let indices = match index_bits {
            0 => Some(BlasFileIndices::None),
            16 => Some(BlasFileIndices::U16),
            32 => Some(BlasFileIndices::U32),
            _ => None,
        };
        let kind = match (kind, indices, matrix) {
            (0, Some(indices), 0 | 1) => {
                let is_transformed = matrix == 1;
                BlasFileGeometryKind::Triangles { vertex_format, vertex_count, indices, is_transformed }
            }
            (1, ..) if words[3..] == [0; 4] => BlasFileGeometryKind::Boxes,
            _ => return Err(BlasFileError::Malformed("it holds a geometry of an unknown kind")),
        };
        Ok(BlasFileGeometry { kind, primitive_count, flags })
    }

    fn read_part(&mut self) -> Result<BlasFilePart, BlasFileError> {
        let (driver, map) = self.read_u64().zip(self.read_u64()).ok_or(TOO_SHORT)?;
        let driver = self.read_bytes(driver).ok_or(TOO_SHORT)?.to_vec();
        if driver.len() < VERSION_DATA_BYTES {
            return Err(BlasFileError::Malformed("the driver's data of a part is shorter than its header"));
        }
        let map = match map.checked_sub(1) {
            None => None,
            Some(count) => {
                let numbers =
                    count.checked_mul(4).and_then(|bytes| self.read_bytes(bytes)).ok_or(TOO_SHORT)?;
                Some(numbers.as_chunks().0.iter().map(|chunk| u32::from_le_bytes(*chunk)).collect())
            }
        };
        Ok(BlasFilePart { driver, map })
    }

    fn read_u32(&mut self) -> Option<u32> {
        self.read_array().map(u32::from_le_bytes)
    }

    fn read_u64(&mut self) -> Option<u64> {
        self.read_array().map(u64::from_le_bytes)
    }

    fn read_array<const COUNT: usize>(&mut self) -> Option<[u8; COUNT]> {
        let (array, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*array)
    }

    fn read_bytes(&mut self, count: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(usize::try_from(count).ok()?)?;
        self.rest = rest;
        Some(taken)
    }
}

pub(crate) fn encoded_bytes(blob: &BlasFile) -> usize {
    let part =
        |part: &BlasFilePart| 16 + part.driver.len() + part.map.as_ref().map_or(0, |map| 4 * map.len());
    HEADER_BYTES
        + 12
        + 4 * GEOMETRY_WORDS * blob.geometries.len()
        + blob.parts.iter().map(part).sum::<usize>()
}

/// FNV-1a, 64 bits. Every step is invertible, so a single changed byte always changes the checksum.
fn checksum(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xCBF2_9CE4_8422_2325, |sum, &byte| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_blob() -> impl Strategy<Value = BlasFile> {
        let indices =
            prop_oneof![Just(BlasFileIndices::None), Just(BlasFileIndices::U16), Just(BlasFileIndices::U32)];
        let triangles = (any::<u32>(), any::<u32>(), indices, any::<bool>()).prop_map(
            |(vertex_format, vertex_count, indices, is_transformed)| BlasFileGeometryKind::Triangles {
                vertex_format,
                vertex_count,
                indices,
                is_transformed,
            },
        );
        let kind = prop_oneof![triangles, Just(BlasFileGeometryKind::Boxes)];
        let geometry = (kind, any::<u32>(), any::<u32>())
            .prop_map(|(kind, primitive_count, flags)| BlasFileGeometry { kind, primitive_count, flags });
        let driver = prop::collection::vec(any::<u8>(), VERSION_DATA_BYTES..100);
        let map = prop::option::of(prop::collection::vec(any::<u32>(), 0..20));
        let part = (driver, map).prop_map(|(driver, map)| BlasFilePart { driver, map });
        (any::<u32>(), prop::collection::vec(geometry, 0..4), prop::collection::vec(part, 0..4))
            .prop_map(|(flags, geometries, parts)| BlasFile { flags, geometries, parts })
    }

    fn words(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    #[test]
    fn the_checksum_is_the_published_one() {
        assert_eq!(checksum(b""), 0xCBF2_9CE4_8422_2325);
        assert_eq!(checksum(b"a"), 0xAF63_DC4C_8601_EC8C);
        assert_eq!(checksum(b"foobar"), 0x8594_4171_F739_67E8);
    }

    #[test]
    fn each_kind_of_damage_is_told_apart() {
        let driver: Vec<u8> = (0..40).collect();
        let part = BlasFilePart { driver, map: Some(vec![2, 0, 1]) };
        assert_eq!(part.version_data().map(|data| data[31]), Some(31));
        let geometry = BlasFileGeometry { kind: BlasFileGeometryKind::Boxes, primitive_count: 3, flags: 1 };
        let good = encode_blas_file(&BlasFile { flags: 5, geometries: vec![geometry], parts: vec![part] });
        let changed = |at: usize| {
            let mut bytes = good.clone();
            bytes[at] ^= 1;
            decode_blas_file(&bytes)
        };
        assert_eq!(changed(0), Err(BlasFileError::NotABlob));
        assert_eq!(changed(8), Err(BlasFileError::Version { found: VERSION ^ 1 }));
        assert_eq!(changed(good.len() - 1), Err(BlasFileError::Checksum));
        assert_eq!(decode_blas_file(b"not at all one"), Err(BlasFileError::NotABlob));
        assert_eq!(
            decode_blas_file(b"\x89lvkb"),
            Err(BlasFileError::Truncated { found: 5, expected: HEADER_BYTES as u64 })
        );
        let (found, expected) = (good.len() as u64 - 1, good.len() as u64);
        assert_eq!(
            decode_blas_file(&good[..good.len() - 1]),
            Err(BlasFileError::Truncated { found, expected })
        );
        assert!(matches!(decode_blas_file(&[&good[..], &[0]].concat()), Err(BlasFileError::Malformed(_))));
    }

    #[test]
    fn sealed_nonsense_is_refused_without_large_allocations() {
        let nonsense = [
            words(&[0]),
            words(&[0, u32::MAX, 0]),
            words(&[0, 0, u32::MAX, 0]),
            words(&[0, 1, 7, 0, 0, 0, 0, 0, 0, 0]),
            words(&[0, 1, 0, 3, 0, 106, 9, 8, 0, 0]),
            words(&[0, 1, 0, 3, 0, 106, 9, 16, 2, 0]),
            words(&[0, 1, 1, 3, 0, 0, 0, 16, 0, 0]),
            words(&[0, 1, 0, 3, 0, 106, 9, 16, 1]),
            words(&[0, 0, 1, u32::MAX, u32::MAX, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
            [words(&[0, 0, 1, 32, 0, u32::MAX, u32::MAX]), vec![0; 32]].concat(),
            [words(&[0, 0, 1, 31, 0, 0, 0]), vec![0; 31]].concat(),
            words(&[0, 0, 0, 0]),
        ];
        for body in nonsense {
            assert!(matches!(decode_blas_file(&sealed(&body)), Err(BlasFileError::Malformed(_))), "{body:?}");
        }
        for body in [words(&[0, 0, 0]), words(&[0, 1, 0, 3, 0, 106, 9, 16, 1, 0])] {
            assert!(decode_blas_file(&sealed(&body)).is_ok(), "{body:?}");
        }
    }

    proptest! {
        #[test]
        fn files_are_read_as_they_were_written(blob in any_blob()) {
            let bytes = encode_blas_file(&blob);
            prop_assert_eq!(bytes.len(), encoded_bytes(&blob));
            prop_assert_eq!(decode_blas_file(&bytes), Ok(blob));
        }

        #[test]
        fn truncation_or_a_changed_bit_is_an_error(blob in any_blob(), place in any::<prop::sample::Index>(), bit in 0..8_u32) {
            let mut bytes = encode_blas_file(&blob);
            let place = place.index(bytes.len());
            prop_assert!(decode_blas_file(&bytes[..place]).is_err());
            bytes[place] ^= 1_u8 << bit;
            prop_assert!(decode_blas_file(&bytes).is_err());
        }

        #[test]
        fn arbitrary_bytes_are_read_or_refused(body in prop::collection::vec(prop_oneof![Just(0_u8), Just(1), any::<u8>()], 0..300)) {
            let _ = decode_blas_file(&body);
            if let Ok(blob) = decode_blas_file(&sealed(&body)) {
                prop_assert_eq!(encode_blas_file(&blob), sealed(&body));
            }
        }
    }
}
