//! How far rays find the same by software and by the driver.

use super::super::table::Table;
use super::super::tracer::{Hit, Picture};
use super::sides::Shape;
use super::walk::Walked;

/// Distances count as the same within this part of them.
const CLOSE: f32 = 1e-4;

/// Numbers of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Agreement {
    pixels: usize,
    /// With the same triangle, or none in both.
    primitives: usize,
    /// With distances that are the same but for rounding, or none in both.
    distances: usize,
    /// With a shadow ray in both.
    shadow_rays: usize,
    /// Of those, with the same answer.
    shadows: usize,
}

impl Agreement {
    /// Waits for both pictures.
    pub(super) fn of(reference: &Picture, other: &Picture) -> lvk::Result<Self> {
        let hits: Vec<_> = reference.hits()?.into_iter().zip(other.hits()?).collect();
        let lit: Vec<_> = reference.lit()?.into_iter().zip(other.lit()?).collect();
        Ok(Self::of_pixels(&hits, &lit))
    }

    fn of_pixels(hits: &[(Hit, Hit)], lit: &[(u32, u32)]) -> Self {
        let both_hit = |(a, b): &(Hit, Hit)| a.t >= 0.0 && b.t >= 0.0;
        let both_missed = |(a, b): &(Hit, Hit)| a.t < 0.0 && b.t < 0.0;
        let count = |same: fn(&(Hit, Hit)) -> bool| {
            hits.iter().filter(|pair| both_missed(pair) || both_hit(pair) && same(pair)).count()
        };
        let shadows = || hits.iter().zip(lit).filter(|(pair, _)| both_hit(pair));
        Self {
            pixels: hits.len(),
            primitives: count(|(a, b)| a.primitive == b.primitive),
            distances: count(|(a, b)| (a.t - b.t).abs() <= CLOSE * a.t),
            shadow_rays: shadows().count(),
            shadows: shadows().filter(|(_, (a, b))| a == b).count(),
        }
    }

    /// Counts the pixels of both.
    pub(super) fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.primitives += other.primitives;
        self.distances += other.distances;
        self.shadow_rays += other.shadow_rays;
        self.shadows += other.shadows;
    }
}

/// A row for each way of tracing that there is something to compare with.
pub(super) fn table(walked: &[Walked]) -> Table {
    let columns = ["the same as by pipeline, as given", "triangle", "distance", "shadow"];
    let mut table = Table::new("### Agreement".to_owned(), &columns);
    if walked.iter().all(|side| side.agreement.is_none()) {
        table.note("not compared: the device has no ray tracing pipelines");
        return table;
    }
    for side in walked {
        let Some(found) = side.agreement else { continue };
        let shape = if side.shape == Shape::Cut { ", overlapping instances" } else { "" };
        let shares = [
            share(found.primitives, found.pixels),
            share(found.distances, found.pixels),
            share(found.shadows, found.shadow_rays),
        ];
        table.row(format!("{}{shape}", side.name), shares);
    }
    table.note(format!(
        "shares of pixels of all cameras: the same triangle or none, distances within {CLOSE:e} of them, and the answer of \
         shadow rays where both primary rays hit"
    ));
    table.note("which of two triangles is hit may differ where they share an edge, or lie upon each other");
    table
}

fn share(part: usize, of: usize) -> String {
    if of == 0 { "-".to_owned() } else { format!("{:.4} %", 100.0 * part as f64 / of as f64) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misses_agree_with_misses_and_hits_with_hits_of_the_same() {
        let hit = |t, primitive| Hit { t, primitive };
        let hits = [
            (hit(-1.0, 0), hit(-1.0, 0)),
            (hit(-1.0, 0), hit(1.0, 0)),
            (hit(2.0, 5), hit(2.0001, 5)),
            (hit(2.0, 5), hit(2.0, 6)),
            (hit(2.0, 5), hit(2.1, 5)),
        ];
        let lit = [(0, 0), (0, 1), (1, 1), (1, 0), (0, 0)];
        let found = Agreement::of_pixels(&hits, &lit);
        let expected = Agreement { pixels: 5, primitives: 3, distances: 3, shadow_rays: 3, shadows: 2 };
        assert_eq!(found, expected);
        let mut twice = found;
        twice.add(&found);
        assert_eq!((twice.pixels, twice.shadows), (10, 4));
        assert_eq!((share(1, 4), share(0, 0)), ("25.0000 %".to_owned(), "-".to_owned()));
    }
}
