//! Candidates of a ray, and its hit among them.

use super::triangle::Crossing;

/// Weights closer to zero than this are at an edge.
const EDGE: f64 = 2e-4;
/// Cosines closer to zero than this are along the surface.
const GRAZE: f64 = 0.01;
/// Along a surface the weights themselves are blurred this far.
const GRAZE_EDGE: f64 = 0.05;
/// Distances closer than this, relative to the distance or to 1, are the same.
const TIE: f64 = 2e-5;

/// Numbers of the hit primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct HitIds {
    /// Instance number.
    pub instance: u32,
    /// The instance's custom index.
    pub custom_index: u32,
    /// Geometry number.
    pub geometry: u32,
    /// Primitive number.
    pub primitive: u32,
}

/// A hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance as a multiple of the ray's direction.
    pub t: f64,
    /// Numbers of the primitive.
    pub ids: HitIds,
    /// Weights of a triangle's second and third vertex.
    pub barycentrics: [f64; 2],
    /// True for a front face: its vertices, in object space, turn clockwise in left-handed coordinates as seen from
    /// the ray's origin.
    pub is_front: bool,
    /// True if no any-hit shader decides about it.
    pub is_opaque: bool,
    /// Absolute cosine between the direction and the surface's normal. At a grazing hit, rounding of the ray's origin
    /// moves the hit by one over this.
    pub cosine: f64,
}

/// Closest hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The hit, or `None`.
    pub hit: Option<Hit>,
    /// True if f32 arithmetic must give the same result.
    pub is_certain: bool,
}

/// A primitive that a ray hits, or nearly hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub(super) hit: Hit,
    pub(super) is_hit: bool,
    pub(super) is_certain: bool,
}

impl Candidate {
    /// Judges a crossing. Returns `None` if the ray does not even nearly hit.
    pub(super) fn of_triangle(
        crossing: &Crossing,
        ids: HitIds,
        mirrored: bool,
        range: (f64, f64),
    ) -> Option<Self> {
        let grazes = crossing.cosine.abs() < GRAZE;
        let blur = if grazes { GRAZE_EDGE } else { EDGE };
        let in_range = Range::locate(crossing.t, range);
        let margin = crossing.margin();
        if margin < -blur || in_range == Range::Outside {
            return None;
        }
        let hit = Hit {
            t: crossing.t,
            ids,
            barycentrics: [crossing.weights[1], crossing.weights[2]],
            is_front: (crossing.cosine < 0.0) != mirrored,
            is_opaque: true,
            cosine: crossing.cosine.abs(),
        };
        let is_certain = margin > blur && !grazes && in_range == Range::Inside;
        Some(Self { hit, is_hit: margin >= 0.0 && range.0 < crossing.t && crossing.t < range.1, is_certain })
    }
}

/// Position of a distance in the interval of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Range {
    Inside,
    AtAnEnd,
    Outside,
}

impl Range {
    pub(super) fn locate(t: f64, range: (f64, f64)) -> Self {
        if same_distance(t, range.0) || same_distance(t, range.1) {
            Self::AtAnEnd
        } else if range.0 < t && t < range.1 {
            Self::Inside
        } else {
            Self::Outside
        }
    }
}

/// Returns the closest of the candidates that are hits. It is certain if no uncertain candidate lies before or at it,
/// and no other hit at it.
pub(super) fn closest(candidates: impl Iterator<Item = Candidate> + Clone) -> Answer {
    let hits = candidates.clone().filter(|candidate| candidate.is_hit);
    let best = hits.min_by(|a, b| a.hit.t.total_cmp(&b.hit.t));
    let Some(best) = best else {
        return Answer { hit: None, is_certain: candidates.count() == 0 };
    };
    let rival = |other: &Candidate| {
        let before = other.hit.t < best.hit.t || same_distance(other.hit.t, best.hit.t);
        before && (!other.is_certain || other.hit.ids != best.hit.ids)
    };
    Answer { hit: Some(best.hit), is_certain: !candidates.clone().any(|other| rival(&other)) }
}

/// Returns all hits, the closest first; `None` if any is uncertain.
pub(super) fn all(candidates: impl Iterator<Item = Candidate> + Clone) -> Option<Vec<Hit>> {
    let certain = candidates.clone().all(|candidate| candidate.is_certain);
    let mut hits: Vec<_> = candidates.map(|candidate| candidate.hit).collect();
    hits.sort_by(|a, b| a.t.total_cmp(&b.t));
    certain.then_some(hits)
}

/// Returns whether there is any hit; `None` if that is uncertain.
pub(super) fn any(mut candidates: impl Iterator<Item = Candidate> + Clone) -> Option<bool> {
    if candidates.clone().any(|candidate| candidate.is_certain) {
        return Some(true);
    }
    if candidates.next().is_some() { None } else { Some(false) }
}

fn same_distance(a: f64, b: f64) -> bool {
    (a - b).abs() <= TIE * a.abs().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(t: f64, primitive: u32, margin: f64) -> Candidate {
        let crossing = Crossing { t, weights: [margin, 0.5 - margin, 0.5], cosine: -0.5 };
        let ids = HitIds { primitive, ..HitIds::default() };
        Candidate::of_triangle(&crossing, ids, false, (0.0, 10.0)).unwrap()
    }

    fn answer(candidates: &[Candidate]) -> (Option<u32>, bool) {
        let answer = closest(candidates.iter().copied());
        (answer.hit.map(|hit| hit.ids.primitive), answer.is_certain)
    }

    #[test]
    fn the_closest_hit_wins_and_doubt_before_it_spreads() {
        let (near, far) = (candidate(1.0, 1, 0.2), candidate(2.0, 2, 0.2));
        assert_eq!(answer(&[far, near]), (Some(1), true));
        assert_eq!(answer(&[far, candidate(1.0, 3, -1e-4)]), (Some(2), false));
        assert_eq!(answer(&[near, candidate(2.0, 3, -1e-4)]), (Some(1), true));
        assert_eq!(answer(&[near, candidate(1.0 + 1e-6, 3, 0.2)]), (Some(1), false));
        assert_eq!(answer(&[candidate(1.0, 4, 1e-4)]), (Some(4), false));
        assert_eq!(answer(&[candidate(1.0, 4, -1e-4)]), (None, false));
        assert_eq!(answer(&[]), (None, true));
    }

    #[test]
    fn any_hit_is_enough_for_a_shadow() {
        let sure = candidate(2.0, 1, 0.2);
        let doubtful = candidate(1.0, 2, 1e-4);
        assert_eq!(any([doubtful, sure].into_iter()), Some(true));
        assert_eq!(any([doubtful].into_iter()), None);
        assert_eq!(any([].into_iter()), Some(false));
    }

    #[test]
    fn both_ends_of_a_ray_are_open() {
        let at = |t: f64| {
            let crossing = Crossing { t, weights: [0.4, 0.3, 0.3], cosine: 0.5 };
            Candidate::of_triangle(&crossing, HitIds::default(), false, (1.0, 3.0))
        };
        assert_eq!(at(0.9), None);
        assert_eq!(at(3.1), None);
        assert!(at(1.0).is_some_and(|found| !found.is_hit && !found.is_certain));
        assert!(at(3.0).is_some_and(|found| !found.is_hit && !found.is_certain));
        assert!(at(2.0).is_some_and(|found| found.is_hit && found.is_certain && !found.hit.is_front));
    }
}
