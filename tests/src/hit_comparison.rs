//! Comparison of hit records with the reference.

use crate::ray_tracer::{BACK, FRONT, HitRecord, MISSED};
use crate::rays::Ray;
use crate::reference::{Answer, Hit, HitIds};

/// Tolerance of distances, relative to the largest of the distance, 1, and an eighth of the largest coordinate of the
/// ray's origin: far from the origin f32 is no finer.
const DISTANCE: f64 = 1e-5;
/// Tolerance relative to the largest coordinate of the ray's origin: rounding when a ray is transformed to object
/// space.
const PLACE: f64 = 1e-6;
const BARYCENTRICS: f64 = 2e-4;
/// The reference may leave out one of this many rays.
const EXCLUDED_SHARE: usize = 50;
const MISTAKES_PRINTED: usize = 5;

/// Result of a comparison.
#[derive(Debug, Clone, Default)]
pub struct HitComparison {
    /// Rays compared or left out.
    pub rays: usize,
    /// Rays the reference is not certain about.
    pub excluded: usize,
    /// Compared rays that hit something, by the reference.
    pub hits: usize,
    /// Differences, a line each.
    pub mistakes: Vec<String>,
}

impl HitComparison {
    /// Compares closest hits of triangles.
    pub fn of_triangles(rays: &[Ray], records: &[HitRecord], answer: impl Fn(&Ray) -> Answer) -> Self {
        Self::compare(rays, records, |ray, record| {
            let answer = answer(ray);
            answer.is_certain.then(|| (answer.hit.is_some(), triangle_mistake(ray, record, &answer)))
        })
    }

    /// Compares closest hits by distance and ids only.
    pub fn of_shapes(rays: &[Ray], records: &[HitRecord], answer: impl Fn(&Ray) -> Answer) -> Self {
        Self::compare(rays, records, |ray, record| {
            let answer = answer(ray);
            answer.is_certain.then(|| (answer.hit.is_some(), mistake(ray, record, &answer)))
        })
    }

    /// Compares whether rays hit anything.
    pub fn of_occlusion(
        rays: &[Ray],
        records: &[HitRecord],
        occluded: impl Fn(&Ray) -> Option<bool>,
    ) -> Self {
        Self::compare(rays, records, |ray, record| {
            let expected = occluded(ray)?;
            let found = record.kind != MISSED;
            Some((expected, (found != expected).then(|| format!("occluded: {found}, must be {expected}"))))
        })
    }

    fn compare(
        rays: &[Ray],
        records: &[HitRecord],
        judge: impl Fn(&Ray, &HitRecord) -> Option<(bool, Option<String>)>,
    ) -> Self {
        assert_eq!(rays.len(), records.len());
        let mut agreement = Self { rays: rays.len(), ..Self::default() };
        for (index, (ray, record)) in rays.iter().zip(records).enumerate() {
            match judge(ray, record) {
                None => agreement.excluded += 1,
                Some((is_hit, mistake)) => {
                    agreement.hits += usize::from(is_hit);
                    let line = mistake.map(|mistake| format!("ray {index} {ray:?}: {mistake}"));
                    agreement.mistakes.extend(line);
                }
            }
        }
        agreement
    }

    /// Adds the results of another comparison.
    pub fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.excluded += other.excluded;
        self.hits += other.hits;
        self.mistakes.extend(other.mistakes);
    }

    /// Asserts that nothing differs, few rays were left out, and at least a twentieth hit something.
    ///
    /// # Panics
    /// As said.
    pub fn assert(&self, what: &str) {
        let shown =
            self.mistakes.iter().take(MISTAKES_PRINTED).map(String::as_str).collect::<Vec<_>>().join("\n  ");
        let (count, rays) = (self.mistakes.len(), self.rays);
        assert!(count == 0, "{what}: {count} of {rays} rays are wrong:\n  {shown}");
        let excluded = self.excluded;
        assert!(excluded * EXCLUDED_SHARE < rays, "{what}: {excluded} of {rays} rays could not be compared");
        let hits = self.hits;
        assert!(hits * 20 >= rays, "{what}: only {hits} of {rays} rays hit anything, which tests nothing");
        eprintln!("{what}: {rays} rays, {hits} hits, {excluded} left out");
    }
}

fn mistake(ray: &Ray, record: &HitRecord, answer: &Answer) -> Option<String> {
    let found = (record.kind != MISSED).then_some(HitIds {
        instance: record.instance,
        custom_index: record.custom_index,
        geometry: record.geometry,
        primitive: record.primitive,
    });
    let expected = answer.hit.map(|hit| hit.ids);
    if found != expected {
        return Some(format!("hit {found:?} at {}, must be {expected:?} ({:?})", record.t, answer.hit));
    }
    let Hit { t, cosine, .. } = answer.hit?;
    let coordinate = ray.origin.iter().fold(0.0_f64, |most, place| most.max(f64::from(place.abs())));
    let moved = PLACE * coordinate / cosine;
    let is_close = within(f64::from(record.t), t, DISTANCE * t.abs().max(1.0).max(coordinate / 8.0) + moved);
    (!is_close).then(|| format!("distance {}, must be {t}", record.t))
}

fn triangle_mistake(ray: &Ray, record: &HitRecord, answer: &Answer) -> Option<String> {
    if let Some(mistake) = mistake(ray, record, answer) {
        return Some(mistake);
    }
    let hit = answer.hit?;
    let pairs = record.barycentrics.iter().zip(hit.barycentrics);
    if !pairs.into_iter().all(|(found, expected)| within(f64::from(*found), expected, BARYCENTRICS)) {
        return Some(format!("barycentrics {:?}, must be {:?}", record.barycentrics, hit.barycentrics));
    }
    let kind = if hit.is_front { FRONT } else { BACK };
    (record.kind != kind).then(|| format!("hit kind {:#x}, must be {kind:#x}", record.kind))
}

/// Returns `false` for NaN.
fn within(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance
}
