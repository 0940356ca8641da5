//! Attributes of vertices: the types that are allowed, and their decoding.

use gltf::json::accessor::{ComponentType, Type};

use super::accessors::Accessor;
use crate::{Positions, Problem};

/// Reads positions in their own format. Integers are allowed with `KHR_mesh_quantization`.
pub(super) fn positions(accessor: &Accessor<'_>, quantized: bool) -> Result<Positions, Problem> {
    use ComponentType::{F32, I8, I16, U8, U16};
    let wanted = "VEC3 of FLOAT, or of small integers with KHR_mesh_quantization,";
    if accessor.shape != Type::Vec3 || !(quantized || accessor.component == F32) {
        return Err(accessor.wrong_type(wanted));
    }
    Ok(match (accessor.component, accessor.normalized) {
        (F32, false) => Positions::F32(accessor.read_floats(0.0)?),
        (I16, true) => Positions::Snorm16(accessor.read(shorts)?),
        (I16, false) => Positions::Sint16(accessor.read(shorts)?),
        (U16, true) => Positions::Unorm16(accessor.read(unsigned_shorts)?),
        (U16, false) => Positions::Uint16(accessor.read(unsigned_shorts)?),
        (I8, true) => Positions::Snorm8(accessor.read(|bytes| unsigned_bytes(bytes).map(|byte| byte as i8))?),
        (I8, false) => Positions::Sint8(accessor.read(|bytes| unsigned_bytes(bytes).map(|byte| byte as i8))?),
        (U8, true) => Positions::Unorm8(accessor.read(unsigned_bytes)?),
        (U8, false) => Positions::Uint8(accessor.read(unsigned_bytes)?),
        _ => return Err(accessor.wrong_type(wanted)),
    })
}

fn shorts(bytes: &[u8]) -> [i16; 4] {
    unsigned_shorts(bytes).map(|short| short as i16)
}

fn unsigned_shorts(bytes: &[u8]) -> [u16; 4] {
    let short = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    [short(0), short(2), short(4), 0]
}

fn unsigned_bytes(bytes: &[u8]) -> [u8; 4] {
    [bytes[0], bytes[1], bytes[2], 0]
}

/// Reads vectors such as normals, and makes their first three components a vector of unit length. A vector without length
/// becomes the Z axis.
pub(super) fn unit_vectors<const N: usize>(
    accessor: &Accessor<'_>,
    quantized: bool,
) -> Result<Vec<[f32; N]>, Problem> {
    let shape = if N == 3 { Type::Vec3 } else { Type::Vec4 };
    let small = matches!(accessor.component, ComponentType::I8 | ComponentType::I16) && accessor.normalized;
    if accessor.shape != shape || !(accessor.component == ComponentType::F32 || quantized && small) {
        let wanted = match N {
            3 => "VEC3 of FLOAT, or of normalized BYTE or SHORT with KHR_mesh_quantization,",
            _ => "VEC4 of FLOAT, or of normalized BYTE or SHORT with KHR_mesh_quantization,",
        };
        return Err(accessor.wrong_type(wanted));
    }
    let mut vectors = accessor.read_floats::<N>(0.0)?;
    for vector in &mut vectors {
        let unit = glam::Vec3::new(vector[0], vector[1], vector[2]).normalize_or(glam::Vec3::Z);
        vector[..3].copy_from_slice(&unit.to_array());
        if let Some(sign) = vector.get_mut(3) {
            *sign = if *sign < 0.0 { -1.0 } else { 1.0 };
        }
    }
    Ok(vectors)
}

/// Reads differences of a morph target.
pub(super) fn differences(accessor: &Accessor<'_>, quantized: bool) -> Result<Vec<[f32; 3]>, Problem> {
    let small = matches!(accessor.component, ComponentType::I8 | ComponentType::I16);
    if accessor.shape != Type::Vec3 || !(accessor.component == ComponentType::F32 || quantized && small) {
        return Err(accessor.wrong_type("VEC3 of FLOAT, or of BYTE or SHORT with KHR_mesh_quantization,"));
    }
    accessor.read_floats(0.0)
}

/// Reads a set of texture coordinates.
pub(super) fn tex_coords(accessor: &Accessor<'_>, quantized: bool) -> Result<Vec<[f32; 2]>, Problem> {
    let small = accessor.component != ComponentType::U32;
    let is_core = is_float_or_unsigned(accessor);
    if accessor.shape != Type::Vec2 || !(is_core || quantized && small) {
        let wanted = "VEC2 of FLOAT or normalized UNSIGNED_BYTE or UNSIGNED_SHORT, or of small integers with \
                      KHR_mesh_quantization,";
        return Err(accessor.wrong_type(wanted));
    }
    accessor.read_floats(0.0)
}

/// Reads colours. Those without alpha are opaque. Negative components become 0.
pub(super) fn colors(accessor: &Accessor<'_>) -> Result<Vec<[f32; 4]>, Problem> {
    if !matches!(accessor.shape, Type::Vec3 | Type::Vec4) || !is_float_or_unsigned(accessor) {
        let wanted = "VEC3 or VEC4 of FLOAT or normalized UNSIGNED_BYTE or UNSIGNED_SHORT";
        return Err(accessor.wrong_type(wanted));
    }
    let mut colors = accessor.read_floats(1.0)?;
    colors.as_flattened_mut().iter_mut().for_each(|component| *component = component.max(0.0));
    Ok(colors)
}

/// Reads a set of joints.
pub(super) fn joints(accessor: &Accessor<'_>) -> Result<Vec<[u16; 4]>, Problem> {
    match (accessor.shape, accessor.component, accessor.normalized) {
        (Type::Vec4, ComponentType::U8, false) => {
            accessor.read(|bytes| std::array::from_fn(|joint| bytes[joint].into()))
        }
        (Type::Vec4, ComponentType::U16, false) => accessor.read(|bytes| {
            std::array::from_fn(|joint| u16::from_le_bytes([bytes[2 * joint], bytes[2 * joint + 1]]))
        }),
        _ => Err(accessor.wrong_type("VEC4 of UNSIGNED_BYTE or UNSIGNED_SHORT")),
    }
}

/// Reads a set of weights of joints.
pub(super) fn weights(accessor: &Accessor<'_>) -> Result<Vec<[f32; 4]>, Problem> {
    if accessor.shape != Type::Vec4 || !is_float_or_unsigned(accessor) {
        return Err(accessor.wrong_type("VEC4 of FLOAT or normalized UNSIGNED_BYTE or UNSIGNED_SHORT"));
    }
    accessor.read_floats(0.0)
}

fn is_float_or_unsigned(accessor: &Accessor<'_>) -> bool {
    match accessor.component {
        ComponentType::F32 => true,
        ComponentType::U8 | ComponentType::U16 => accessor.normalized,
        _ => false,
    }
}
