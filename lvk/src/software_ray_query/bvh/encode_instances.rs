//! Encodes instances for traversal.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec3Swizzles};

use crate::accel::instance::TlasInstance;
use crate::accel::primitive_bounds::Bounds;
use crate::software_ray_query::layout::InstanceRecord;
use crate::software_ray_query::rebraid_parts::RebraidParts;

/// The BLAS of an instance.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct InstancedBlas {
    pub(crate) address: u64,
    pub(crate) parts: Arc<RebraidParts>,
}

/// An instance or a part of one, and its bounds in the world.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlacedInstance {
    pub(crate) instance: InstanceRecord,
    pub(crate) bounds: Bounds,
    /// Parts of the instance's BLAS.
    pub(crate) parts: Arc<RebraidParts>,
}

/// Returns the instance with index `number` in the caller's list; `None` if no ray can hit it.
pub(crate) fn place_instance(
    number: u32,
    instance: &TlasInstance,
    shown: &InstancedBlas,
) -> Option<PlacedInstance> {
    let matrix = matrix_from_rows(&instance.transform);
    let inverse = rows_from_matrix(&matrix.inverse());
    let is_finite = inverse.iter().all(|number| number.is_finite());
    let bounds = shown.parts.whole.bounds;
    let is_empty = bounds.low.x > bounds.high.x;
    if instance.mask == 0 || is_empty || !is_finite || is_singular(&matrix.matrix3) {
        return None;
    }
    let record = InstanceRecord {
        world_to_object: inverse,
        object_to_world: instance.transform,
        structure: shown.address,
        custom_index_and_mask: instance.custom_index | u32::from(instance.mask) << 24,
        hit_group_offset_and_flags: instance.hit_group_offset | u32::from(instance.flags.bits()) << 24,
        number,
        entry: 0,
        reserved: [0; 2],
    };
    let bounds = transform_bounds(&matrix, bounds);
    Some(PlacedInstance { instance: record, bounds, parts: Arc::clone(&shown.parts) })
}

/// True if the determinant is no more than the rounding error of the matrix and of the products in the kernel
/// `kernels/instance.glsl`.
fn is_singular(matrix: &DMat3) -> bool {
    const SINGULAR_EPSILON: f64 = 4.0 * f32::EPSILON as f64;
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *matrix;
    let products = x.abs().dot((y.yzx() * z.zxy()).abs() + (y.zxy() * z.yzx()).abs());
    matrix.determinant().abs() <= products * SINGULAR_EPSILON
}

/// Returns the bounds of transformed bounds, with a matrix in rows. [`place_instance`] does the same for a whole BLAS.
pub(crate) fn transform_bounds_rows(object_to_world: &[f32; 12], bounds: Bounds) -> Bounds {
    transform_bounds(&matrix_from_rows(object_to_world), bounds)
}

fn matrix_from_rows(rows: &[f32; 12]) -> DAffine3 {
    let m = rows.map(f64::from);
    let column = |x: usize| DVec3::new(m[x], m[x + 4], m[x + 8]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}

fn rows_from_matrix(matrix: &DAffine3) -> [f32; 12] {
    let (m, t) = (matrix.matrix3.transpose(), matrix.translation);
    let row = |row: DVec3, last: f64| [row.x as f32, row.y as f32, row.z as f32, last as f32];
    let (x, y, z) = (row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z));
    [x[0], x[1], x[2], x[3], y[0], y[1], y[2], y[3], z[0], z[1], z[2], z[3]]
}

/// Returns the bounds of transformed bounds, with a margin for the rounding of rays.
fn transform_bounds(matrix: &DAffine3, bounds: Bounds) -> Bounds {
    const ROUNDING: f64 = 1.0 / (1 << 20) as f64;
    let (low, high) = (bounds.low.as_dvec3(), bounds.high.as_dvec3());
    let center = matrix.transform_point3((low + high) * 0.5);
    let m = &matrix.matrix3;
    let half = (high - low) * 0.5;
    let reach = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    let most = (center.abs() + reach).max_element();
    let reach = reach + DVec3::splat(most * ROUNDING);
    let finite = |v: DVec3| v.as_vec3().clamp(Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX));
    Bounds { low: finite(center - reach), high: finite(center + reach) }
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Quat};

    use super::*;
    use crate::accel::transform::transform_rows;

    #[test]
    fn a_matrix_is_singular_however_its_numbers_were_rounded() {
        let nine = [1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0, 0.0, 7.0, 8.0, 9.0, 0.0];
        for scale in [1e-6, 0.1, 1.0 / 3.0, 1.0, 7.7, 1e6_f32] {
            assert!(is_singular(&matrix_from_rows(&nine.map(|number| number * scale)).matrix3), "{scale}");
        }
        assert!(is_singular(&DMat3::ZERO));
    }

    #[test]
    fn scales_of_all_sizes_have_an_inverse() {
        let turn = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.1);
        for scale in [[1e-6; 3], [1e6; 3], [1e-12; 3], [1.0, 1e-12, 1e12], [1.0, 1e-4, 1.0], [-3.0, 0.5, 1.0]]
        {
            for turn in [Quat::IDENTITY, turn] {
                let of = Affine3A::from_scale_rotation_translation(scale.into(), turn, Vec3::ONE);
                assert!(!is_singular(&matrix_from_rows(&transform_rows(&of)).matrix3), "{scale:?}, {turn}");
            }
        }
    }
}
