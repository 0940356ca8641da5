//! Spheres, for tests of intersection shaders.

use lvk::glam::DVec3;

use super::candidate::{Answer, Candidate, Hit, HitIds, Range, closest};
use crate::rays::Ray;

/// Distance from the silhouette, relative to the radius, below which a hit is uncertain.
const SILHOUETTE: f64 = 1e-3;

/// A sphere in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: DVec3,
    /// Radius.
    pub radius: f64,
    /// Numbers that a hit reports.
    pub ids: HitIds,
}

impl Sphere {
    /// Returns the first hit of a ray with the surface of one of the spheres, from outside or from inside.
    pub fn closest(spheres: &[Self], ray: &Ray) -> Answer {
        Self::closest_of(spheres, ray, &[0, 1])
    }

    /// Returns the first point where a ray leaves one of the spheres.
    pub fn closest_exit(spheres: &[Self], ray: &Ray) -> Answer {
        Self::closest_of(spheres, ray, &[1])
    }

    fn closest_of(spheres: &[Self], ray: &Ray, sides: &[usize]) -> Answer {
        let candidates: Vec<_> = spheres.iter().filter_map(|sphere| sphere.candidate(ray, sides)).collect();
        closest(candidates.iter().copied())
    }

    /// Returns the first of the sides (0 in, 1 out) within the ray's interval.
    fn candidate(&self, ray: &Ray, sides: &[usize]) -> Option<Candidate> {
        let direction = DVec3::from(ray.direction.map(f64::from));
        let to_center = self.center - DVec3::from(ray.origin.map(f64::from));
        let middle = to_center.dot(direction) / direction.length_squared();
        let passing = (to_center - direction * middle).length();
        if passing > self.radius * (1.0 + SILHOUETTE) {
            return None;
        }
        let half = (self.radius.powi(2) - passing.powi(2)).max(0.0).sqrt() / direction.length();
        let range = (f64::from(ray.t_min), f64::from(ray.t_max));
        let ends = [middle - half, middle + half];
        let places = ends.map(|t| Range::locate(t, range));
        let first = *sides.iter().find(|side| places[**side] != Range::Outside)?;
        let t = ends[first];
        let cosine = (1.0 - (passing / self.radius).powi(2)).max(0.0).sqrt();
        let hit =
            Hit { t, ids: self.ids, barycentrics: [0.0; 2], is_front: first == 0, is_opaque: true, cosine };
        let is_certain = places[first] == Range::Inside && passing < self.radius * (1.0 - SILHOUETTE);
        Some(Candidate { hit, is_hit: passing < self.radius && range.0 < t && t < range.1, is_certain })
    }
}

#[cfg(test)]
mod tests {
    use lvk::glam::Vec3;

    use super::*;

    #[test]
    fn a_sphere_is_hit_from_outside_and_from_inside() {
        let sphere = Sphere { center: DVec3::new(0.0, 0.0, 5.0), radius: 2.0, ids: HitIds::default() };
        let hit = |ray: &Ray| Sphere::closest(&[sphere], ray).hit.map(|hit| hit.t);
        let ray = Ray::new(Vec3::ZERO, Vec3::Z * 2.0);
        assert_eq!(hit(&ray), Some(1.5));
        assert_eq!(hit(&Ray { t_min: 2.0, ..ray }), Some(3.5));
        assert_eq!(hit(&Ray { t_max: 1.0, ..ray }), None);
        let exit = Sphere::closest_exit(&[sphere], &ray).hit;
        assert_eq!(exit.map(|hit| (hit.t, hit.is_front)), Some((3.5, false)));
        assert_eq!(hit(&Ray { direction: [0.0, 1.0, 0.0], ..ray }), None);
    }
}
