//! Selection of the instances of a TLAS.

use glam::{Mat4, Vec3, Vec4};

/// Selects the instances that rays may hit: those near an extended view frustum that are not too small to be seen.
///
/// Reflected rays and shadow rays leave the frustum, so give it a margin. The size test compares the angle under which
/// the sphere around an instance's AABB appears from the eye with a threshold, as in Wolfenstein: Youngblood.
///
/// ```
/// use glam::Vec3;
/// use glam::camera::rh::{proj::vulkan, view};
/// use lvk::InstanceCulling;
///
/// let eye = Vec3::ZERO;
/// let view = view::look_to_mat4(eye, Vec3::NEG_Z, Vec3::Y);
/// let projection = vulkan::perspective(1.0, 16.0 / 9.0, 0.1, 1000.0);
/// let culling = InstanceCulling {
///     frustum_margin: 20.0,
///     min_angle: 0.002,
///     ..InstanceCulling::from_view_projection(eye, (projection * view).to_cols_array_2d())
/// };
/// let boxes = [Vec3::new(0.0, 0.0, -50.0), Vec3::new(0.0, 0.0, 50.0)].map(|center| (center - 1.0, center + 1.0));
/// assert_eq!(culling.kept(boxes), [0]);
/// ```
///
/// Points are `[f32; 3]`, or anything that converts to it, as the vectors of `glam`, `mint` and `nalgebra` do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InstanceCulling {
    /// Position of the viewer. Default: `[0.0; 3]`.
    pub eye: [f32; 3],
    /// Planes of the frustum: a point `p` is inside if `dot(xyz, p) + w >= 0`. The lengths of the normals do not
    /// matter. A plane with the normal 0 culls nothing. Default: normals of 0, which cull nothing.
    pub planes: [[f32; 4]; 6],
    /// Distance by which the planes are moved outwards, in world units; a negative one moves them inwards. Default: 0.
    pub frustum_margin: f32,
    /// Smallest angle under which an instance must appear, in radians, 0 to π; 0 culls nothing. Default: 0.
    pub min_angle: f32,
}

impl Default for InstanceCulling {
    /// Culls nothing.
    fn default() -> Self {
        Self { eye: [0.0; 3], planes: [[0.0; 4]; 6], frustum_margin: 0.0, min_angle: 0.0 }
    }
}

impl InstanceCulling {
    /// Creates a selection that culls everything outside the frustum of a matrix from world space to Vulkan's clip
    /// space. Depth is from 0 to 1 in either direction. The far plane may be infinitely far. The matrix multiplies
    /// column vectors and is given as its four columns.
    pub fn from_view_projection(eye: impl Into<[f32; 3]>, view_projection: impl Into<[[f32; 4]; 4]>) -> Self {
        let matrix = Mat4::from_cols_array_2d(&view_projection.into());
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| matrix.row(row));
        let planes = [w + x, w - x, w + y, w - y, z, w - z].map(|plane| plane.to_array());
        Self { eye: eye.into(), planes, ..Self::default() }
    }

    /// True if the AABB from `low` to `high`, in world space, is kept. An AABB that contains the eye is always kept.
    /// So is an invalid one: inverted, or with a NaN coordinate.
    pub fn keeps(&self, low: impl Into<[f32; 3]>, high: impl Into<[f32; 3]>) -> bool {
        self.keeps_box(Vec3::from(low.into()), Vec3::from(high.into()))
    }

    fn keeps_box(&self, low: Vec3, high: Vec3) -> bool {
        let eye = Vec3::from(self.eye);
        let is_box = low.cmple(high).all();
        let holds_eye = low.cmple(eye).all() && eye.cmple(high).all();
        !is_box || holds_eye || (self.touches_frustum(low, high) && self.is_large(low, high))
    }

    /// As [`keeps`](Self::keeps), for an AABB in object space. `transform` (3 rows of 4 columns, as in
    /// [`TlasInstance`](crate::TlasInstance)) maps object space to world space.
    pub fn keeps_instance(
        &self,
        low: impl Into<[f32; 3]>,
        high: impl Into<[f32; 3]>,
        transform: &[f32; 12],
    ) -> bool {
        let (low, high) = (Vec3::from(low.into()), Vec3::from(high.into()));
        let is_box = low.cmple(high).all();
        let (low, high) = transformed_box(low, high, transform);
        !is_box || self.keeps_box(low, high)
    }

    /// Returns the indices of the AABBs `(low, high)`, in world space, that are kept.
    pub fn kept<P: Into<[f32; 3]>>(&self, boxes: impl IntoIterator<Item = (P, P)>) -> Vec<u32> {
        (0..).zip(boxes).filter_map(|(index, (low, high))| self.keeps(low, high).then_some(index)).collect()
    }

    fn touches_frustum(&self, low: Vec3, high: Vec3) -> bool {
        self.planes.map(Vec4::from).iter().all(|plane| {
            let normal = plane.truncate();
            let farthest = Vec3::select(normal.cmpge(Vec3::ZERO), high, low);
            let outside = normal.dot(farthest) + plane.w < -self.frustum_margin * normal.length();
            !outside || normal == Vec3::ZERO
        })
    }

    /// A sphere of radius r at the distance d appears under the angle 2 asin(r / d).
    fn is_large(&self, low: Vec3, high: Vec3) -> bool {
        let radius_squared = low.distance_squared(high) / 4.0;
        let distance_squared = Vec3::from(self.eye).distance_squared((low + high) / 2.0);
        let sine = (self.min_angle.clamp(0.0, std::f32::consts::PI) / 2.0).sin();
        let small = radius_squared < distance_squared * sine * sine;
        !small
    }
}

/// AABB of a transformed AABB (Arvo, Graphics Gems 1990).
fn transformed_box(low: Vec3, high: Vec3, transform: &[f32; 12]) -> (Vec3, Vec3) {
    let column = |index: usize| Vec3::new(transform[index], transform[4 + index], transform[8 + index]);
    let (mut world_low, mut world_high) = (column(3), column(3));
    for axis in 0..3 {
        let (a, b) = (column(axis) * low[axis], column(axis) * high[axis]);
        world_low += a.min(b);
        world_high += a.max(b);
    }
    (world_low, world_high)
}

#[cfg(test)]
mod tests {
    use glam::camera::rh::{proj::vulkan, view};
    use glam::{Affine3A, Quat, Vec4Swizzles};
    use proptest::prelude::*;

    use super::super::transform::transform_rows;
    use super::*;

    const EYE: Vec3 = Vec3::new(1.0, 2.0, 3.0);

    fn view_projection(angle: f32, infinite: bool) -> Mat4 {
        let view =
            view::look_to_mat4(EYE, Quat::from_rotation_y(angle) * Vec3::new(0.0, -0.2, -1.0), Vec3::Y);
        let projection = match infinite {
            true => vulkan::perspective_infinite_reverse(1.2, 1.6, 0.1),
            false => vulkan::perspective(1.2, 1.6, 0.1, 60.0),
        };
        projection * view
    }

    fn from_view_projection(eye: Vec3, matrix: Mat4) -> InstanceCulling {
        InstanceCulling::from_view_projection(eye, matrix.to_cols_array_2d())
    }

    fn corners(low: Vec3, high: Vec3) -> [Vec3; 8] {
        std::array::from_fn(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// True if a point is clearly inside Vulkan's clip volume.
    fn is_inside(matrix: Mat4, point: Vec3) -> bool {
        let clip = matrix * point.extend(1.0);
        let available = clip.w * 0.999;
        clip.w > 0.0
            && clip.xy().abs().max_element() < available
            && clip.z > 0.001 * clip.w
            && clip.z < available
    }

    #[test]
    fn boxes_beyond_each_plane_are_culled_up_to_the_margin() {
        let view = view::look_to_mat4(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y);
        let projection = vulkan::perspective(std::f32::consts::FRAC_PI_2, 1.0, 1.0, 100.0);
        let culling = from_view_projection(Vec3::ZERO, projection * view);
        // At the depth of 50 the frustum is 50 high and wide to each side; all planes but two are slanted by 45
        // degrees.
        let slant = 0.5_f32.sqrt();
        let cases = [
            (Vec3::new(60.0, 0.0, -50.0), 10.0 * slant),
            (Vec3::new(-60.0, 0.0, -50.0), 10.0 * slant),
            (Vec3::new(0.0, 60.0, -50.0), 10.0 * slant),
            (Vec3::new(0.0, -60.0, -50.0), 10.0 * slant),
            (Vec3::new(0.0, 0.0, -110.0), 10.0),
            (Vec3::new(0.0, 0.0, 9.0), 10.0),
        ];
        assert!(culling.keeps(Vec3::new(0.0, 0.0, -50.0), Vec3::new(0.1, 0.1, -50.0)));
        for (point, distance) in cases {
            assert!(!culling.keeps(point, point), "{point}");
            assert!(
                !InstanceCulling { frustum_margin: distance - 0.01, ..culling }.keeps(point, point),
                "{point}"
            );
            assert!(
                InstanceCulling { frustum_margin: distance + 0.01, ..culling }.keeps(point, point),
                "{point}"
            );
        }
    }

    #[test]
    fn the_angle_is_that_of_the_sphere_around_the_box() {
        for (half, distance) in [(0.5_f32, 10.0_f32), (3.0, 40.0), (0.01, 1.0)] {
            let center = EYE + Vec3::new(0.6, 0.0, 0.8) * distance;
            let angle = 2.0 * (f64::from(half) * 3_f64.sqrt() / f64::from(distance)).asin() as f32;
            let culling =
                |min_angle| InstanceCulling { eye: EYE.to_array(), min_angle, ..Default::default() };
            assert!(culling(angle * 0.999).keeps(center - half, center + half));
            assert!(!culling(angle * 1.001).keeps(center - half, center + half));
        }
    }

    #[test]
    fn a_box_around_the_eye_is_kept() {
        let strict = InstanceCulling {
            eye: EYE.to_array(),
            planes: [[1.0, 0.0, 0.0, -1000.0]; 6],
            frustum_margin: 0.0,
            min_angle: 3.0,
        };
        assert!(strict.keeps(EYE - 0.5, EYE + 0.1));
        assert!(!strict.keeps(EYE + 0.5, EYE + 0.6));
    }

    #[test]
    fn boxes_of_nan_are_kept() {
        let strict = InstanceCulling {
            planes: [[1.0, 0.0, 0.0, -1000.0]; 6],
            min_angle: 1.0,
            ..InstanceCulling::default()
        };
        let (low, high) = (Vec3::ONE, Vec3::splat(1.01));
        assert!(!strict.keeps(low, high));
        assert!(strict.keeps(Vec3::new(1.0, f32::NAN, 1.0), high));
        assert!(strict.keeps(low, Vec3::NAN));
        assert!(strict.keeps(high, low), "inverted");
        let mut transform = transform_rows(&Affine3A::IDENTITY);
        assert!(!strict.keeps_instance(low, high, &transform));
        assert!(strict.keeps_instance(Vec3::new(1.0, f32::NAN, 1.0), high, &transform));
        assert!(strict.keeps_instance(high, low, &transform), "inverted");
        transform[6] = f32::NAN;
        assert!(strict.keeps_instance(low, high, &transform));
        assert!(
            InstanceCulling { eye: [f32::NAN; 3], planes: [[f32::NAN; 4]; 6], ..strict }.keeps(low, high)
        );
        let lax = InstanceCulling { frustum_margin: f32::NAN, min_angle: f32::NAN, ..strict };
        assert!(lax.keeps(low, high));
    }

    #[test]
    fn the_default_culls_nothing() {
        assert!(InstanceCulling::default().keeps(Vec3::splat(1e6), Vec3::splat(1e6)));
    }

    proptest! {
        #[test]
        fn a_box_with_a_corner_in_view_is_never_culled(
            center in prop::array::uniform3(-80.0_f32..80.0),
            half in prop::array::uniform3(0.0_f32..20.0),
            angle in 0.0_f32..6.3,
            infinite in any::<bool>(),
            margin in 0.0_f32..5.0,
        ) {
            let (center, half) = (Vec3::from(center), Vec3::from(half));
            let matrix = view_projection(angle, infinite);
            let culling = InstanceCulling {
                frustum_margin: margin, ..from_view_projection(EYE, matrix)
            };
            let kept = culling.keeps(center - half, center + half);
            if corners(center - half, center + half).iter().any(|&corner| is_inside(matrix, corner)) {
                prop_assert!(kept);
            }
            prop_assert_eq!(kept, brute_force(&culling, center - half, center + half));
        }

        #[test]
        fn an_instance_is_kept_where_any_of_its_moved_corners_is_in_view(
            half in prop::array::uniform3(0.1_f32..5.0),
            place in prop::array::uniform3(-50.0_f32..50.0),
            scale in prop::array::uniform3(-3.0_f32..3.0),
            turn in prop::array::uniform3(0.0_f32..6.3),
            angle in 0.0_f32..6.3,
        ) {
            let half = Vec3::from(half);
            let turn = Quat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2]);
            let transform = Affine3A::from_scale_rotation_translation(scale.into(), turn, place.into());
            let moved = corners(-half, half).map(|corner| transform.transform_point3(corner));
            let (low, high) = transformed_box(-half, half, &transform_rows(&transform));
            for corner in moved {
                prop_assert!(corner.cmpge(low - 1e-3).all() && corner.cmple(high + 1e-3).all());
            }
            let exact = moved.iter().fold((moved[0], moved[0]), |(a, b), p| (a.min(*p), b.max(*p)));
            prop_assert!(exact.0.distance(low) < 1e-3 && exact.1.distance(high) < 1e-3, "no larger than needed");
            let matrix = view_projection(angle, false);
            let culling = from_view_projection(EYE, matrix);
            if moved.iter().any(|&corner| is_inside(matrix, corner)) {
                prop_assert!(culling.keeps_instance(-half, half, &transform_rows(&transform)));
            }
        }

        #[test]
        fn lists_are_filtered_one_by_one(
            boxes in prop::collection::vec((prop::array::uniform3(-80.0_f32..80.0), 0.0_f32..9.0), 0..50),
            min_angle in 0.0_f32..0.5,
        ) {
            let culling = InstanceCulling {
                min_angle, ..from_view_projection(EYE, view_projection(0.0, true))
            };
            let boxes: Vec<_> = boxes.iter().map(|&(center, half)| (Vec3::from(center) - half, Vec3::from(center) + half)).collect();
            let kept = culling.kept(boxes.iter().copied());
            for (index, (low, high)) in boxes.into_iter().enumerate() {
                prop_assert_eq!(kept.contains(&(index as u32)), culling.keeps(low, high));
            }
            prop_assert!(kept.is_sorted());
        }
    }

    /// True unless all eight corners are outside the same plane.
    fn brute_force(culling: &InstanceCulling, low: Vec3, high: Vec3) -> bool {
        let outside = |plane: &Vec4, corner: &Vec3| {
            plane.dot(corner.extend(1.0)) < -culling.frustum_margin * plane.xyz().length()
        };
        let all_outside = |plane: &Vec4| corners(low, high).iter().all(|corner| outside(plane, corner));
        let surrounds = EYE.cmpge(low).all() && EYE.cmple(high).all();
        surrounds
            || !culling
                .planes
                .map(Vec4::from)
                .iter()
                .any(|plane| plane.xyz() != Vec3::ZERO && all_outside(plane))
    }
}
