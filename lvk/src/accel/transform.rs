//! Transforms of instances and geometries: 3 rows of 4 numbers, row by row (`VkTransformMatrixKHR`).

/// The transform that moves nothing.
pub(crate) const IDENTITY_ROWS: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Returns the rows of an affine transform in Vulkan's order (`VkTransformMatrixKHR`), from its columns: the images of
/// the three axes, and the translation.
///
/// The columns are those of `glam`'s `Affine3A::to_cols_array_2d` and of `mint`'s `ColumnMatrix3x4`.
///
/// ```
/// let place = glam::Affine3A::from_translation(glam::Vec3::new(1.0, 2.0, 3.0));
/// let rows = lvk::rows_from_columns(place.to_cols_array_2d());
/// assert_eq!(rows, [1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0]);
/// ```
pub fn rows_from_columns(columns: impl Into<[[f32; 3]; 4]>) -> [f32; 12] {
    let columns = columns.into();
    std::array::from_fn(|at| columns[at % 4][at / 4])
}

/// Returns the rows of an affine transform of the crate `glam` in Vulkan's order (`VkTransformMatrixKHR`).
#[cfg(any(feature = "glam", test))]
pub fn transform_rows(transform: &glam::Affine3A) -> [f32; 12] {
    rows_from_columns(transform.to_cols_array_2d())
}

/// True if all numbers are finite: no exponent is all ones. Needs no branch for each number.
#[inline]
pub(crate) fn is_finite(transform: &[f32; 12]) -> bool {
    let all = transform.iter().fold(0, |all, number| all | ((number.to_bits() & 0x7fff_ffff) + 0x0080_0000));
    all >> 31 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_has_vulkans_row_order() {
        let transform = glam::Affine3A::from_translation(glam::Vec3::new(1.0, 2.0, 3.0));
        let rows = rows_from_columns(transform.to_cols_array_2d());
        assert_eq!(rows, [1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0]);
    }

    #[test]
    fn a_transform_is_finite_only_if_all_its_numbers_are() {
        for number in [0.0, -0.0, 1.5, f32::MAX, -f32::MAX, f32::MIN_POSITIVE, 1e-45] {
            assert!(is_finite(&[number; 12]), "{number}");
        }
        for place in 0..12 {
            for number in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut transform = [f32::MAX; 12];
                transform[place] = number;
                assert!(!is_finite(&transform), "{number} at {place}");
            }
        }
    }
}
