//! From all places where a ray may hit something to what it hits.

use super::triangle::Crossing;

/// Weights closer to zero than this are at an edge.
const EDGE: f64 = 2e-4;
/// Cosines closer to zero than this are along the surface.
const GRAZE: f64 = 0.01;
/// Along a surface the weights themselves are blurred this far.
const GRAZE_EDGE: f64 = 0.05;
/// Distances closer than this, relative to the distance or to 1, are the same.
const TIE: f64 = 2e-5;

/// Which primitive was hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct HitIds {
    /// Place in the list of instances.
    pub instance: u32,
    /// The instance's custom index.
    pub custom_index: u32,
    /// Place in the instance's list of geometries.
    pub geometry: u32,
    /// Place in the geometry's list of primitives.
    pub primitive: u32,
}

/// A hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Multiple of the ray's direction.
    pub t: f64,
    /// What was hit.
    pub ids: HitIds,
    /// Weights of a triangle's second and third corner.
    pub barycentrics: [f64; 2],
    /// Whether the ray came from the side where the corners, in object space, turn clockwise in left-handed
    /// coordinates.
    pub is_front: bool,
    /// Whether it counts without an any-hit shader.
    pub is_opaque: bool,
    /// Between the direction and the surface's normal, without its sign. Where a ray grazes a surface, rounding of its
    /// origin moves the hit by one over this.
    pub cosine: f64,
}

/// What a ray hits first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// The hit, or `None`.
    pub hit: Option<Hit>,
    /// Whether arithmetic in f32 has to come to the same answer.
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
    /// Judges a crossing; `None` if the ray does not even nearly hit.
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

/// Where a distance lies in the range of a ray.
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

/// The closest of the candidates that are hits. It is certain if no doubtful candidate lies before or at it, and no
/// other hit at it.
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

/// All hits, the closest first; `None` where any is doubtful.
pub(super) fn all(candidates: impl Iterator<Item = Candidate> + Clone) -> Option<Vec<Hit>> {
    let certain = candidates.clone().all(|candidate| candidate.is_certain);
    let mut hits: Vec<_> = candidates.map(|candidate| candidate.hit).collect();
    hits.sort_by(|a, b| a.t.total_cmp(&b.t));
    certain.then_some(hits)
}

/// Whether there is any hit; `None` where that is doubtful.
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
