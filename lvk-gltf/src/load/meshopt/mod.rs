//! Data of `EXT_meshopt_compression` and `KHR_meshopt_compression`.
//!
//! The codecs are those that the extensions' specifications describe: attributes ([`vertices`]) of versions 0 and 1, lists of
//! triangles and sequences of indices ([`indices`]), and filters of decoded attributes ([`filters`]).

mod filters;
mod indices;
mod vertices;

use super::extensions::{Meshopt, MeshoptFilter, MeshoptMode};

/// Why data cannot be decoded.
pub(super) type Damage = &'static str;

const CUT_OFF: Damage = "it is cut off";
const TRAILING: Damage = "it is longer than its elements";

/// Says which rule of the extension a description breaks, if any. The size of the result is not checked here.
pub(super) fn check(description: &Meshopt) -> Result<(), Damage> {
    let Meshopt { byte_stride: stride, count, mode, filter, .. } = description;
    let right = match mode {
        MeshoptMode::Attributes => stride.is_multiple_of(4) && (4..=256).contains(stride),
        MeshoptMode::Triangles => matches!(stride, 2 | 4) && count.is_multiple_of(3),
        MeshoptMode::Indices => matches!(stride, 2 | 4),
    };
    if !right {
        return Err("the stride or the count does not fit the mode");
    }
    let fits = match filter {
        MeshoptFilter::None => true,
        _ if *mode != MeshoptMode::Attributes => false,
        MeshoptFilter::Octahedral | MeshoptFilter::Color => matches!(stride, 4 | 8),
        MeshoptFilter::Quaternion => *stride == 8,
        MeshoptFilter::Exponential => true,
    };
    if fits { Ok(()) } else { Err("the filter does not fit the stride or the mode") }
}

/// Decodes elements into `elements`, which has `count * stride` bytes. The description has passed [`check`].
pub(super) fn decode(description: &Meshopt, data: &[u8], elements: &mut [u8]) -> Result<(), Damage> {
    let stride = description.byte_stride as usize;
    match description.mode {
        MeshoptMode::Attributes => vertices::decode(data, stride, elements)?,
        MeshoptMode::Triangles => indices::decode_triangles(data, stride, elements)?,
        MeshoptMode::Indices => indices::decode_sequence(data, stride, elements)?,
    }
    match description.filter {
        MeshoptFilter::None => {}
        MeshoptFilter::Octahedral if stride == 4 => filters::octahedral_8(elements),
        MeshoptFilter::Octahedral => filters::octahedral_16(elements),
        MeshoptFilter::Quaternion => filters::quaternion(elements),
        MeshoptFilter::Exponential => filters::exponential(elements),
        MeshoptFilter::Color if stride == 4 => filters::color_8(elements),
        MeshoptFilter::Color => filters::color_16(elements),
    }
    Ok(())
}

/// Takes bytes from the front.
fn take<'a>(data: &mut &'a [u8], count: usize) -> Result<&'a [u8], Damage> {
    let (front, rest) = data.split_at_checked(count).ok_or(CUT_OFF)?;
    *data = rest;
    Ok(front)
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    fn description(mode: MeshoptMode, stride: usize, count: usize, filter: MeshoptFilter) -> Meshopt {
        let (byte_stride, count) = (stride as u64, count as u64);
        Meshopt { buffer: 0, byte_offset: 0, byte_length: 0, byte_stride, count, mode, filter }
    }

    fn decoded(description: &Meshopt, data: &[u8]) -> Result<Vec<u8>, Damage> {
        check(description)?;
        let mut elements = vec![0; (description.count * description.byte_stride) as usize];
        decode(description, data, &mut elements).map(|()| elements)
    }

    /// Checks elements of `STRIDE` bytes, encoded by the reference in all its versions and levels, and every cut.
    fn check_attributes<const STRIDE: usize>(bytes: &[u8]) {
        let elements: Vec<[u8; STRIDE]> = bytes.as_chunks().0.to_vec();
        let description = description(MeshoptMode::Attributes, STRIDE, elements.len(), MeshoptFilter::None);
        for (level, version) in [(0, 0), (0, 1), (1, 1), (2, 1), (3, 1)] {
            let data = ::meshopt::encode_vertex_buffer_level(&elements, level, Some(version)).unwrap();
            assert_eq!(data[0], 0xa0 + version as u8);
            assert_eq!(decoded(&description, &data).unwrap(), elements.as_flattened(), "{level} {version}");
            for length in (0..data.len()).step_by(data.len() / 50 + 1) {
                assert!(decoded(&description, &data[..length]).is_err(), "{length} of {}", data.len());
            }
            let tail = if version == 0 { STRIDE.max(32) } else { (STRIDE + STRIDE / 4).max(24) };
            let (blocks, tail) = data.split_at(data.len() - tail);
            assert_eq!(decoded(&description, &[blocks, &[0], tail].concat()), Err(TRAILING));
        }
    }

    /// Bytes like those of meshes: smooth, noisy, constant, and floats.
    fn bytes() -> impl Strategy<Value = Vec<u8>> {
        let steps = |most: u8| {
            vec(0..=most, 0..6000).prop_map(|steps| {
                let sum = |sum: &mut u8, step: u8| {
                    *sum = sum.wrapping_add(step);
                    Some(*sum)
                };
                steps.into_iter().scan(0_u8, sum).collect::<Vec<_>>()
            })
        };
        let floats = vec(-10.0_f32..10.0, 0..1500);
        let floats = floats.prop_map(|floats| floats.iter().flat_map(|float| float.to_le_bytes()).collect());
        prop_oneof![steps(1), steps(3), steps(20), steps(255), vec(Just(7_u8), 0..3000), floats]
    }

    /// The reference rounds and takes reciprocal roots by other instructions, so that a component may be one off.
    fn are_close<T: Copy + Into<i32>>(found: &[T], wanted: &[T]) -> bool {
        found.iter().zip(wanted).all(|(found, wanted)| (*found).into().abs_diff((*wanted).into()) <= 1)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn attributes_of_the_reference_are_decoded(bytes in bytes()) {
            check_attributes::<4>(&bytes);
            check_attributes::<8>(&bytes);
            check_attributes::<12>(&bytes);
            check_attributes::<16>(&bytes);
            check_attributes::<64>(&bytes);
            check_attributes::<256>(&bytes);
        }

        #[test]
        fn indices_of_the_reference_are_decoded(
            triangles in vec([0_u32..300, 0..300, 0..300], 0..400),
            width in prop_oneof![Just(2), Just(4)],
            is_mesh in any::<bool>(),
        ) {
            let indices: Vec<u32> = if is_mesh {
                // A grid, whose triangles share edges.
                (0..triangles.len() as u32).flat_map(|i| [i, i + 1, i + 21, i + 1, i + 22, i + 21]).collect()
            } else {
                triangles.as_flattened().to_vec()
            };
            let check = |mode, data: &[u8], wanted: &[u32]| {
                let wanted: Vec<u8> = wanted.iter().flat_map(|index| index.to_le_bytes()[..width].to_vec()).collect();
                let description = description(mode, width, indices.len(), MeshoptFilter::None);
                assert_eq!(decoded(&description, data).unwrap(), wanted);
                for length in (0..data.len()).step_by(data.len() / 50 + 1) {
                    assert!(decoded(&description, &data[..length]).is_err());
                }
            };
            check(MeshoptMode::Indices, &::meshopt::encode_index_sequence(&indices, 1000).unwrap(), &indices);
            // The codec turns the corners of triangles.
            let data = ::meshopt::encode_index_buffer(&indices, 1000).unwrap();
            let turned: Vec<u32> = ::meshopt::decode_index_buffer(&data, indices.len()).unwrap();
            check(MeshoptMode::Triangles, &data, &turned);
        }

        #[test]
        fn random_bytes_are_an_error_or_decoded(data in vec(any::<u8>(), 0..300), count in 0_usize..100) {
            for (mode, stride) in [(MeshoptMode::Attributes, 12), (MeshoptMode::Triangles, 4), (MeshoptMode::Indices, 2)] {
                for header in [0xa0, 0xa1, 0xe1, 0xd1] {
                    let data = [&[header], &data[..]].concat();
                    _ = decoded(&description(mode, stride, count / 3 * 3, MeshoptFilter::None), &data);
                }
            }
        }

        #[test]
        fn filters_give_what_those_of_the_reference_give(
            vectors in vec([-1.0_f32..1.0, -1.0..1.0, -1.0..1.0, 0.0..1.0], 1..50),
            bits in 4_i32..=16,
            noise in vec(any::<[i16; 4]>(), 1..50),
        ) {
            let unit: Vec<[f32; 4]> = vectors.iter().map(|v| glam::Vec4::from(*v).normalize_or(glam::Vec4::X).to_array()).collect();
            let axes: Vec<[f32; 4]> = vectors.iter().map(|[x, y, z, w]| {
                glam::Vec3::new(*x, *y, *z).normalize_or(glam::Vec3::X).extend(*w).to_array()
            }).collect();

            let mut wanted: Vec<[i16; 4]> = ::meshopt::encode_filter_oct(&axes, bits);
            let mut found = wanted.clone();
            ::meshopt::decode_filter_oct(&mut wanted);
            filters::octahedral_16(bytemuck::cast_slice_mut(&mut found));
            prop_assert!(are_close(found.as_flattened(), wanted.as_flattened()), "{found:?} {wanted:?}");

            let mut wanted: Vec<[i8; 4]> = ::meshopt::encode_filter_oct(&axes, bits.min(8));
            let mut found = wanted.clone();
            ::meshopt::decode_filter_oct(&mut wanted);
            filters::octahedral_8(bytemuck::cast_slice_mut(&mut found));
            prop_assert!(are_close(found.as_flattened(), wanted.as_flattened()), "{found:?} {wanted:?}");

            let mut wanted = ::meshopt::encode_filter_quat(&unit, bits);
            let mut found = wanted.clone();
            ::meshopt::decode_filter_quat(&mut wanted);
            filters::quaternion(bytemuck::cast_slice_mut(&mut found));
            prop_assert!(are_close(found.as_flattened(), wanted.as_flattened()), "{found:?} {wanted:?}");

            let large: Vec<[f32; 4]> = vectors.iter().map(|v| v.map(|n| n * 1e6)).collect();
            let mut wanted = ::meshopt::encode_filter_exp(&large, bits, ::meshopt::EncodeExpMode::Separate);
            let mut found = bytemuck::cast_slice(&wanted).to_vec();
            ::meshopt::decode_filter_exp(&mut wanted);
            filters::exponential(&mut found);
            prop_assert_eq!(&found[..], bytemuck::cast_slice::<_, u8>(&wanted));

            let colors: Vec<[f32; 4]> = vectors.iter().map(|v| v.map(f32::abs)).collect();
            let mut wanted: Vec<[u16; 4]> = ::meshopt::encode_filter_color(&colors, bits);
            let mut found = wanted.clone();
            ::meshopt::decode_filter_color(&mut wanted);
            filters::color_16(bytemuck::cast_slice_mut(&mut found));
            prop_assert!(are_close(found.as_flattened(), wanted.as_flattened()), "{found:?} {wanted:?}");

            let mut wanted: Vec<[u8; 4]> = ::meshopt::encode_filter_color(&colors, bits.min(8));
            let mut found = wanted.clone();
            ::meshopt::decode_filter_color(&mut wanted);
            filters::color_8(bytemuck::cast_slice_mut(&mut found));
            prop_assert!(are_close(found.as_flattened(), wanted.as_flattened()), "{found:?} {wanted:?}");

            // Damaged data gives some numbers, and no panic.
            let noise: &[u8] = bytemuck::cast_slice(&noise);
            for filter in [filters::octahedral_8, filters::octahedral_16, filters::quaternion, filters::exponential,
                filters::color_8, filters::color_16] {
                filter(&mut noise.to_vec());
            }
        }
    }

    #[test]
    fn descriptions_that_do_not_fit_are_refused() {
        use MeshoptFilter::{Color, Exponential, None, Octahedral, Quaternion};
        use MeshoptMode::{Attributes, Indices, Triangles};
        for (mode, stride, count, filter, right) in [
            (Attributes, 12, 5, None, true),
            (Attributes, 10, 5, None, false),
            (Attributes, 0, 5, None, false),
            (Attributes, 260, 5, None, false),
            (Attributes, 8, 5, Octahedral, true),
            (Attributes, 12, 5, Octahedral, false),
            (Attributes, 8, 5, Quaternion, true),
            (Attributes, 4, 5, Quaternion, false),
            (Attributes, 12, 5, Exponential, true),
            (Attributes, 4, 5, Color, true),
            (Triangles, 2, 6, None, true),
            (Triangles, 2, 5, None, false),
            (Triangles, 3, 6, None, false),
            (Triangles, 4, 6, Exponential, false),
            (Indices, 4, 5, None, true),
            (Indices, 8, 5, None, false),
        ] {
            let description = description(mode, stride, count, filter);
            assert_eq!(check(&description).is_ok(), right, "{description:?}");
        }
    }
}
