//! The texel density of a triangle: texels of its texture per unit of length, the constant of a ray cone's level of
//! detail (see `shaders/common/texture_lod.glsl`).

use glam::{Vec2, Vec3};

/// Half the log2 of texel area over surface area, for a texture of `size` texels. 0 for triangles without area
/// in either space, which then show the finest level.
pub(super) fn lod_constant(positions: [[f32; 3]; 3], texcoords: [[f32; 2]; 3], size: [u32; 2]) -> f32 {
    let [p0, p1, p2] = positions.map(Vec3::from);
    let scale = Vec2::new(size[0] as f32, size[1] as f32);
    let [t0, t1, t2] = texcoords.map(|t| Vec2::from(t) * scale);
    let surface = (p1 - p0).cross(p2 - p0).length();
    let texels = (t1 - t0).perp_dot(t2 - t0).abs();
    let lod = 0.5 * (texels / surface).log2();
    if lod.is_finite() { lod } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[test]
    fn one_texel_per_unit_is_level_zero_of_a_footprint_of_one() {
        let positions = [[0.0; 3], [256.0, 0.0, 0.0], [0.0, 256.0, 0.0]];
        assert!(lod_constant(positions, CORNERS, [256, 256]).abs() < 1e-6);
    }

    #[test]
    fn four_times_the_texels_along_both_axes_are_two_levels() {
        let positions = [[0.0; 3], [64.0, 0.0, 0.0], [0.0, 0.0, 64.0]];
        assert!((lod_constant(positions, CORNERS, [256, 256]) - 2.0).abs() < 1e-6);
        assert!((lod_constant(positions, CORNERS, [256, 64]) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn triangles_without_area_are_harmless() {
        assert_eq!(lod_constant([[1.0; 3]; 3], CORNERS, [256, 256]), 0.0);
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(lod_constant(positions, [[0.5; 2]; 3], [256, 256]), 0.0);
    }
}
