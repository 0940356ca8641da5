//! Vertices of a model as shaders and builds read them.

use lvk_gltf::{Positions, Primitive};

use super::layout::GpuAttributes;

/// Positions as builds of acceleration structures and shaders read them.
pub(crate) enum PackedPositions<'a> {
    /// Three floats.
    Floats(std::borrow::Cow<'a, [[f32; 3]]>),
    /// Four signed normalised numbers of 16 bits, as the file has them.
    Quantised(&'a [[i16; 4]]),
}

impl<'a> PackedPositions<'a> {
    /// Takes positions as they are where both can read them; else decodes them.
    pub(crate) fn new(positions: &'a Positions) -> Self {
        match positions {
            Positions::F32(all) => Self::Floats(all.into()),
            Positions::Snorm16(all) => Self::Quantised(all),
            other => Self::Floats(other.iter().collect::<Vec<_>>().into()),
        }
    }

    /// True if positions are taken as signed normalised numbers.
    pub(crate) fn is_quantised(positions: &Positions) -> bool {
        matches!(positions, Positions::Snorm16(_))
    }

    /// Their bytes, one position after the other.
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::Floats(all) => bytemuck::cast_slice(all),
            Self::Quantised(all) => bytemuck::cast_slice(all),
        }
    }
}

/// The attributes of all vertices of a primitive.
pub(crate) fn attributes(primitive: &Primitive) -> Vec<GpuAttributes> {
    let at = |vertex: usize| {
        let texcoord = |set: usize| {
            let texcoords = primitive.tex_coords.get(set).and_then(|set| set.get(vertex));
            texcoords.copied().unwrap_or_default()
        };
        let normal = primitive.normals.get(vertex).copied().unwrap_or([0.0, 0.0, 1.0]);
        let tangent = primitive.tangents.get(vertex).copied().unwrap_or([1.0, 0.0, 0.0, 1.0]);
        GpuAttributes {
            normal: pack_normal(normal),
            tangent: pack_tangent(tangent),
            texcoords: [texcoord(0), texcoord(1)],
            color: pack_color(primitive.colors.get(vertex).copied().unwrap_or([1.0; 4])),
        }
    };
    (0..primitive.vertex_count()).map(at).collect()
}

/// A unit vector by the octahedral map (`shaders/common/octahedral.glsl`), 16 bits each.
pub(crate) fn pack_normal([x, y, z]: [f32; 3]) -> u32 {
    let sum = (x.abs() + y.abs() + z.abs()).max(f32::MIN_POSITIVE);
    let (u, v) = (x / sum, y / sum);
    let sign = |s: f32| if s >= 0.0 { 1.0 } else { -1.0 };
    let [u, v] = if z < 0.0 { [(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v)] } else { [u, v] };
    let bits = |part: f32| u32::from(((part.clamp(-1.0, 1.0) * 32_767.0).round() as i16) as u16);
    bits(u) | bits(v) << 16
}

/// A tangent; the lowest bit is set where the bitangent is turned.
pub(crate) fn pack_tangent([x, y, z, side]: [f32; 4]) -> u32 {
    pack_normal([x, y, z]) & !1 | u32::from(side < 0.0)
}

/// A linear colour, 8 bits each; beyond 0 to 1 it is clamped.
fn pack_color(color: [f32; 4]) -> u32 {
    u32::from_le_bytes(color.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// As `unitFromOctahedral` does it.
    fn unpack(bits: u32) -> Vec3 {
        let part = |bits: u32| (f32::from(bits as u16 as i16) / 32_767.0).max(-1.0);
        let (u, v) = (part(bits), part(bits >> 16));
        let z = 1.0 - u.abs() - v.abs();
        let sign = |s: f32| if s >= 0.0 { 1.0 } else { -1.0 };
        let [x, y] = if z < 0.0 { [(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v)] } else { [u, v] };
        Vec3::new(x, y, z).normalize()
    }

    #[test]
    fn unit_vectors_come_back() {
        for index in 1..500_u32 {
            let part = |factor: f32| (index as f32 * factor).sin();
            let v = Vec3::new(part(1.3), part(2.7), part(4.1)).normalize();
            assert!(unpack(pack_normal(v.to_array())).distance(v) < 1e-4, "{v}");
            let [x, y, z] = v.to_array();
            let turned = pack_tangent([x, y, z, -1.0]);
            assert!(turned & 1 == 1 && unpack(turned & !1).distance(v) < 2e-4, "{v}");
        }
    }
}
