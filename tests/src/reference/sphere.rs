//! Spheres, for tests of intersection shaders.

use lvk::glam::DVec3;

use super::candidate::{Answer, Candidate, Hit, HitIds, Range, closest};
use crate::rays::Ray;

/// How close, relative to the radius, a ray may pass the silhouette before it is in doubt.
const SILHOUETTE: f64 = 1e-3;

/// A sphere in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
    /// What a hit of it reports.
    pub ids: HitIds,
}

impl Sphere {
    /// The first place where a ray passes through the surface of one of the spheres, from outside or from inside.
    pub fn closest(spheres: &[Self], ray: &Ray) -> Answer {
        let candidates: Vec<_> = spheres.iter().filter_map(|sphere| sphere.candidate(ray)).collect();
        closest(candidates.iter().copied())
    }

    fn candidate(&self, ray: &Ray) -> Option<Candidate> {
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
        let places = ends.map(|t| Range::of(t, range));
        let first = places.iter().position(|place| *place != Range::Outside)?;
        let t = ends[first];
        let hit = Hit { t, ids: self.ids, barycentrics: [0.0; 2], is_front: true, is_opaque: true };
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
        assert_eq!(hit(&Ray { direction: [0.0, 1.0, 0.0], ..ray }), None);
    }
}
