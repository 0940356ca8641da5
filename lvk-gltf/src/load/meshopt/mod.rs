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
