//! Static vertices in 16 bytes: positions as signed normalised 16-bit integers within the model's bounds.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec2, Vec3};

use crate::hybrid::half_float::half_bits;
use crate::shapes::Vertex;

/// The value of one unit.
const ONE: f32 = 32767.0;

/// A vertex as the shaders read it (`kKindStatic` in `shaders/reflections/frame.glsl`) and as
/// [`Snorm16x4`](lvk::VertexFormat::Snorm16x4) positions are built from.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PackedVertex {
    position: [i16; 4],
    normal: u32,
    texcoord: [u16; 2],
}

/// Mapping from coordinates -1 to 1 back to those of the model. The transform of every instance contains it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    centre: Vec3,
    extent: Vec3,
}

impl Grid {
    /// Returns the finest grid over the bounds from `low` to `high`.
    pub(super) fn from_bounds(low: Vec3, high: Vec3) -> Self {
        Self { centre: 0.5 * (low + high), extent: (0.5 * (high - low)).max(Vec3::splat(1e-4)) }
    }

    /// The transform from the numbers that vertices hold to the model.
    pub(super) fn to_model(self) -> Affine3A {
        Affine3A::from_translation(self.centre) * Affine3A::from_scale(self.extent)
    }

    /// Puts a vertex on the grid.
    pub(super) fn pack(self, vertex: &Vertex) -> PackedVertex {
        let [x, y, z] = ((vertex.position - self.centre) / self.extent).to_array().map(snorm16);
        PackedVertex {
            position: [x, y, z, 0],
            normal: pack_normal(vertex.normal),
            texcoord: vertex.texcoord.to_array().map(half_bits),
        }
    }
}

/// A unit vector by the octahedral map in two signed normalised 16-bit integers (`octahedral.glsl`).
pub(super) fn pack_normal(normal: Vec3) -> u32 {
    let p = Vec2::new(normal.x, normal.y) / normal.abs().element_sum();
    let sign = |value: f32| if value >= 0.0 { 1.0 } else { -1.0 };
    let folded = Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y));
    let [x, y] = (if normal.z < 0.0 { folded } else { p }).to_array().map(snorm16);
    u32::from(x as u16) | u32::from(y as u16) << 16
}

fn snorm16(value: f32) -> i16 {
    (value.clamp(-1.0, 1.0) * ONE).round() as i16
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn unpacked(vertex: &PackedVertex, grid: Grid) -> Vec3 {
        let [x, y, z, _] = vertex.position.map(|k| f32::from(k) / ONE);
        grid.to_model().transform_point3(Vec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn positions_move_by_half_a_step_at_most(
            low in prop::array::uniform3(-50.0_f32..50.0),
            size in prop::array::uniform3(0.0_f32..80.0),
            at in prop::array::uniform3(0.0_f32..=1.0),
        ) {
            let (low, size) = (Vec3::from(low), Vec3::from(size));
            let grid = Grid::from_bounds(low, low + size);
            let position = low + size * Vec3::from(at);
            let vertex = Vertex { position, normal: Vec3::Y, texcoord: Vec2::ZERO };
            let error = (unpacked(&grid.pack(&vertex), grid) - position).abs();
            let step = (size / 2.0).max(Vec3::splat(1e-4)) / ONE;
            prop_assert!(error.cmple(step * 0.51 + 2e-5).all(), "{error} {step}");
        }
    }

    #[test]
    fn normals_come_back() {
        for normal in [Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::new(-0.48, 0.6, -0.64)] {
            let bits = pack_normal(normal);
            let at = |shift: u32| f32::from((bits >> shift) as u16 as i16) / ONE;
            let (x, y) = (at(0), at(16));
            let mut v = Vec3::new(x, y, 1.0 - x.abs() - y.abs());
            if v.z < 0.0 {
                let folded = (1.0 - y.abs(), 1.0 - x.abs());
                (v.x, v.y) = (folded.0 * x.signum(), folded.1 * y.signum());
            }
            assert!(v.normalize().distance(normal) < 1e-4, "{normal}: {v}");
        }
    }
}
