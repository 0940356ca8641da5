//! Compares the hits of software ray queries with those of the driver.

use super::tracers::Layout;
use super::traversal::TraversalResult;
use crate::table::Table;
use crate::tracer::{Hit, TracedImage};

/// Relative tolerance for equal distances.
const TOLERANCE: f32 = 1e-4;

/// Pixel counts of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct HitAgreement {
    pixels: usize,
    /// Pixels with the same triangle, or a miss in both images.
    primitives: usize,
    /// Pixels with equal distances up to rounding, or a miss in both images.
    distances: usize,
    /// Pixels with a shadow ray in both images.
    shadow_rays: usize,
    /// Pixels of `shadow_rays` with the same result.
    shadows: usize,
}

impl HitAgreement {
    /// Downloads and compares two images.
    pub(super) fn compare(reference: &TracedImage, other: &TracedImage) -> lvk::Result<Self> {
        let hits: Vec<_> = reference.hits()?.into_iter().zip(other.hits()?).collect();
        let lit: Vec<_> = reference.lit()?.into_iter().zip(other.lit()?).collect();
        Ok(Self::compare_pixels(&hits, &lit))
    }

    fn compare_pixels(hits: &[(Hit, Hit)], lit: &[(u32, u32)]) -> Self {
        let both_hit = |(a, b): &(Hit, Hit)| a.t >= 0.0 && b.t >= 0.0;
        let both_missed = |(a, b): &(Hit, Hit)| a.t < 0.0 && b.t < 0.0;
        let count = |same: fn(&(Hit, Hit)) -> bool| {
            hits.iter().filter(|pair| both_missed(pair) || both_hit(pair) && same(pair)).count()
        };
        let shadows = || hits.iter().zip(lit).filter(|(pair, _)| both_hit(pair));
        Self {
            pixels: hits.len(),
            primitives: count(|(a, b)| a.primitive == b.primitive),
            distances: count(|(a, b)| (a.t - b.t).abs() <= TOLERANCE * a.t),
            shadow_rays: shadows().count(),
            shadows: shadows().filter(|(_, (a, b))| a == b).count(),
        }
    }

    /// Adds the counts of another comparison.
    pub(super) fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.primitives += other.primitives;
        self.distances += other.distances;
        self.shadow_rays += other.shadow_rays;
        self.shadows += other.shadows;
    }
}

/// Returns a table with a row for each tracer that has a reference.
pub(super) fn table(results: &[TraversalResult]) -> Table {
    let columns = ["equal to pipeline, given order", "triangle", "distance", "shadow"];
    let mut table = Table::new("### Hit agreement".to_owned(), &columns);
    if results.iter().all(|case| case.agreement.is_none()) {
        table.add_note("not compared: the device has no ray tracing pipelines");
        return table;
    }
    for case in results {
        let Some(found) = case.agreement else { continue };
        let layout = if case.layout == Layout::Chunks { ", overlapping instances" } else { "" };
        let shares = [
            share(found.primitives, found.pixels),
            share(found.distances, found.pixels),
            share(found.shadows, found.shadow_rays),
        ];
        table.add_row(format!("{}{layout}", case.name), shares);
    }
    table.add_note(format!(
        "shares of pixels of all cameras: the same triangle or two misses, relative distances within {TOLERANCE:e}, and equal shadow \
         rays where both primary rays hit"
    ));
    table.add_note("the hit triangle may differ at a shared edge and for coplanar triangles");
    table
}

fn share(part: usize, of: usize) -> String {
    if of == 0 { "-".to_owned() } else { format!("{:.4} %", 100.0 * part as f64 / of as f64) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misses_agree_with_misses_and_hits_with_equal_hits() {
        let hit = |t, primitive| Hit { t, primitive };
        let hits = [
            (hit(-1.0, 0), hit(-1.0, 0)),
            (hit(-1.0, 0), hit(1.0, 0)),
            (hit(2.0, 5), hit(2.0001, 5)),
            (hit(2.0, 5), hit(2.0, 6)),
            (hit(2.0, 5), hit(2.1, 5)),
        ];
        let lit = [(0, 0), (0, 1), (1, 1), (1, 0), (0, 0)];
        let found = HitAgreement::compare_pixels(&hits, &lit);
        let expected = HitAgreement { pixels: 5, primitives: 3, distances: 3, shadow_rays: 3, shadows: 2 };
        assert_eq!(found, expected);
        let mut twice = found;
        twice.add(&found);
        assert_eq!((twice.pixels, twice.shadows), (10, 4));
        assert_eq!((share(1, 4), share(0, 0)), ("25.0000 %".to_owned(), "-".to_owned()));
    }
}
