//! Instances flattened to world space, with a BVH over their triangles.

use std::time::Duration;

use lvk::glam::{DAffine3, DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::candidate::{Answer, Candidate, Hit, HitIds, all, any, closest};
use super::rules::{Rules, Surface};
use super::triangle::cross;
use crate::rays::Ray;

/// Fewer triangles than this need no BVH.
const TREE_TRIANGLES: usize = 16;
/// Bounds are larger than their triangles by this share, so that near hits are found and rounding does not matter.
const BOX_SLACK: f64 = 2e-3;

/// Triangles of one geometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// Positions of the vertices.
    pub positions: Vec<DVec3>,
    /// Three vertices for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Transform to object space; a mirroring one flips the front faces.
    pub transform: DAffine3,
    /// True if hits need no any-hit shader.
    pub is_opaque: bool,
}

/// An instance of geometries.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance<'a> {
    /// Geometries.
    pub geometries: &'a [Geometry],
    /// Transform from object space to world space.
    pub transform: DAffine3,
    /// Custom index that hits report.
    pub custom_index: u32,
    /// Mask: rays see the instance if their mask has one of its bits.
    pub mask: u8,
    /// True if front and back faces are swapped.
    pub flip_facing: bool,
    /// True if face culling is disabled.
    pub no_cull: bool,
    /// Opacity forced on every geometry.
    pub force_opaque: Option<bool>,
}

/// The triangles of all instances, ready for rays.
pub struct Reference {
    triangles: Vec<Triangle>,
    tree: Option<Bvh2>,
}

struct Triangle {
    corners: [DVec3; 3],
    ids: HitIds,
    mask: u8,
    /// True if exactly one of a mirroring transform and swapped faces applies.
    mirrored: bool,
    surface: Surface,
}

impl<'a> Instance<'a> {
    /// Creates an instance without a transform, with a full mask and no flags.
    pub fn new(geometries: &'a [Geometry]) -> Self {
        Self {
            geometries,
            transform: DAffine3::IDENTITY,
            custom_index: 0,
            mask: 0xff,
            flip_facing: false,
            no_cull: false,
            force_opaque: None,
        }
    }
}

impl Reference {
    /// Flattens instances. Their order gives the instance numbers.
    pub fn new(instances: &[Instance<'_>]) -> Self {
        let all = (0..).zip(instances).flat_map(|(index, item)| flatten(index, item));
        let triangles: Vec<_> = all.filter(Triangle::can_be_hit).collect();
        let boxes: Vec<_> = triangles.iter().map(Triangle::bounds).collect();
        let tree = (boxes.len() >= TREE_TRIANGLES)
            .then(|| build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default()));
        Self { triangles, tree }
    }

    /// Returns the bounds of all triangles.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let corners = self.triangles.iter().flat_map(|triangle| triangle.corners);
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        corners.fold(empty, |(low, high), corner| (low.min(corner), high.max(corner)))
    }

    /// Returns the closest hit of a ray, among instances that have a bit of `mask`.
    pub fn closest(&self, ray: &Ray, mask: u8) -> Answer {
        self.closest_where(ray, mask, |_| true)
    }

    /// As [`closest`](Self::closest), by mask and flags.
    pub fn closest_by(&self, ray: &Ray, rules: impl Into<Rules>) -> Answer {
        self.closest_by_where(ray, rules, |_| true)
    }

    /// As [`closest`](Self::closest), of the hits that `accept` returns `true` for.
    pub fn closest_where(&self, ray: &Ray, mask: u8, accept: impl Fn(&Hit) -> bool) -> Answer {
        self.closest_by_where(ray, Rules::of_mask(mask), accept)
    }

    /// As [`closest_by`](Self::closest_by), of the hits that `accept` returns `true` for.
    pub fn closest_by_where(
        &self,
        ray: &Ray,
        rules: impl Into<Rules>,
        accept: impl Fn(&Hit) -> bool,
    ) -> Answer {
        let mut candidates = self.candidates(ray, rules.into());
        candidates.retain(|candidate| accept(&candidate.hit));
        closest(candidates.iter().copied())
    }

    /// Returns whether a ray hits anything; `None` if that is uncertain.
    pub fn occluded(&self, ray: &Ray, mask: u8) -> Option<bool> {
        any(self.candidates(ray, Rules::of_mask(mask)).iter().copied())
    }

    /// Returns all hits of a ray, the closest first; `None` if any is uncertain.
    pub fn all_hits(&self, ray: &Ray, rules: impl Into<Rules>) -> Option<Vec<Hit>> {
        all(self.candidates(ray, rules.into()).iter().copied())
    }

    fn candidates(&self, ray: &Ray, rules: Rules) -> Vec<Candidate> {
        let Some(tree) = &self.tree else { return self.candidates_of_all(ray, rules) };
        let mut found = Vec::new();
        let walker = obvhs::ray::Ray::new(
            Vec3A::from_array(ray.origin),
            Vec3A::from_array(ray.direction),
            0.0,
            f32::INFINITY,
        );
        tree.ray_traverse_anyhit(walker, |_, place| {
            let triangle = &self.triangles[tree.primitive_indices[place] as usize];
            found.extend(triangle.candidate(ray, rules));
        });
        found
    }

    fn candidates_of_all(&self, ray: &Ray, rules: Rules) -> Vec<Candidate> {
        self.triangles.iter().filter_map(|triangle| triangle.candidate(ray, rules)).collect()
    }
}

impl Triangle {
    /// Vulkan calls triangles with a NaN as an x coordinate inactive; one without an area has no inside.
    fn can_be_hit(&self) -> bool {
        const THINNEST: f64 = 1e-12;
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        ab.cross(ac).length() > THINNEST * ab.length_squared().max(ac.length_squared())
    }

    fn candidate(&self, ray: &Ray, rules: Rules) -> Option<Candidate> {
        if self.mask & rules.mask == 0 {
            return None;
        }
        let (origin, direction) = (ray.origin.map(f64::from).into(), ray.direction.map(f64::from).into());
        let crossing = cross(origin, direction, &self.corners)?;
        let range = (f64::from(ray.t_min), f64::from(ray.t_max));
        let mut candidate = Candidate::of_triangle(&crossing, self.ids, self.mirrored, range)?;
        candidate.hit.is_opaque = rules.is_opaque(self.surface);
        rules.admits(self.surface, candidate.hit.is_front).then_some(candidate)
    }

    fn bounds(&self) -> Aabb {
        let [a, b, c] = self.corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let size = (high - low).max_element() + low.abs().max(high.abs()).max_element() * 1e-3;
        let slack = DVec3::splat(size * BOX_SLACK);
        Aabb::new((low - slack).as_vec3a(), (high + slack).as_vec3a())
    }
}

fn flatten<'a>(index: u32, instance: &'a Instance<'_>) -> impl Iterator<Item = Triangle> + 'a {
    let mirrored = (instance.transform.matrix3.determinant() < 0.0) != instance.flip_facing;
    (0..).zip(instance.geometries).flat_map(move |(geometry, shape)| {
        let transform = instance.transform * shape.transform;
        let (force_opaque, no_cull) = (instance.force_opaque, instance.no_cull);
        let surface = Surface { is_opaque: shape.is_opaque, force_opaque, no_cull };
        (0..).zip(&shape.triangles).map(move |(primitive, triangle)| Triangle {
            corners: triangle.map(|vertex| transform.transform_point3(shape.positions[vertex as usize])),
            ids: HitIds { instance: index, custom_index: instance.custom_index, geometry, primitive },
            mask: instance.mask,
            mirrored,
            surface,
        })
    })
}

#[cfg(test)]
mod tests {
    use lvk::glam::Vec3;

    use super::*;
    use crate::random::Random;
    use crate::rays::random_rays;

    fn soup(seed: u64, count: u32) -> Geometry {
        let mut random = Random::new(seed);
        let corner = |random: &mut Random, center: Vec3| {
            (center + random.direction() * random.between(0.05, 0.6)).as_dvec3()
        };
        let mut positions = Vec::new();
        for _ in 0..count {
            let center = random.point(Vec3::NEG_ONE, Vec3::ONE);
            positions.extend([(); 3].map(|()| corner(&mut random, center)));
        }
        let triangles = (0..count).map(|index| [index * 3, index * 3 + 1, index * 3 + 2]).collect();
        Geometry { positions, triangles, transform: DAffine3::IDENTITY, is_opaque: true }
    }

    #[test]
    fn the_tree_finds_what_trying_all_triangles_finds() {
        for seed in 0..8 {
            let geometry = [soup(seed, 20 + 60 * seed as u32)];
            let reference = Reference::new(&[Instance::new(&geometry)]);
            assert!(reference.tree.is_some());
            let mut hits = 0;
            for ray in random_rays(seed, 500, Vec3::NEG_ONE, Vec3::ONE) {
                let by_tree = reference.closest(&ray, 0xff);
                assert_eq!(
                    by_tree,
                    closest(reference.candidates_of_all(&ray, Rules::of_mask(0xff)).iter().copied())
                );
                assert_eq!(
                    reference.occluded(&ray, 0xff),
                    any(reference.candidates_of_all(&ray, Rules::of_mask(0xff)).iter().copied())
                );
                hits += usize::from(by_tree.hit.is_some());
            }
            assert!(hits > 50, "{hits} hits");
        }
    }

    #[test]
    fn instances_keep_their_numbers_masks_and_fronts() {
        let square = [Geometry {
            positions: vec![DVec3::NEG_ONE, DVec3::new(3.0, -1.0, -1.0), DVec3::new(-1.0, 3.0, -1.0)],
            triangles: vec![[0, 1, 2]],
            transform: DAffine3::from_translation(DVec3::Z),
            is_opaque: true,
        }];
        let near = Instance { custom_index: 7, mask: 1, ..Instance::new(&square) };
        let far = Instance {
            transform: DAffine3::from_translation(DVec3::Z)
                * DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)),
            mask: 2,
            ..Instance::new(&square)
        };
        let reference = Reference::new(&[near, far]);
        let ray = Ray::new(Vec3::new(0.1, 0.1, -2.0), Vec3::Z);
        let first = reference.closest(&ray, 0xff).hit.unwrap();
        assert_eq!((first.t, first.ids.instance, first.ids.custom_index, first.is_front), (2.0, 0, 7, false));
        let second = reference.closest(&ray, 2).hit.unwrap();
        assert_eq!((second.t, second.ids.instance, second.is_front), (3.0, 1, true));
        assert_eq!(reference.closest(&ray, 4).hit, None);
        let hidden = reference.closest_where(&ray, 0xff, |hit| hit.ids.instance == 1);
        assert_eq!(hidden.hit, Some(second));
    }
}
