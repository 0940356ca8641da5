//! Split of a mesh that exceeds the device's limits into parts that each fit.

use super::partition::{PrimitiveBounds, partition_sah, primitive_bounds, union_bounds};
use super::primitive_bounds::Bounds;
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit_of};

/// Limits of one acceleration structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PartLimits {
    /// Bytes of the acceleration structure.
    pub(crate) structure_bytes: u64,
    /// Bytes of scratch memory of its builds.
    pub(crate) scratch_bytes: u64,
    /// Primitives of all its geometries together.
    pub(crate) primitives: u64,
}

/// Sizes of one acceleration structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PartSizes {
    /// Bytes of the acceleration structure.
    pub(crate) structure_bytes: u64,
    /// Bytes of scratch memory of a build or a refit, whichever needs more.
    pub(crate) scratch_bytes: u64,
}

/// One part of a mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PartPlan {
    /// For each geometry of the mesh, the numbers of its primitives that are in the part, ascending; may be empty.
    pub(crate) geometries: Vec<Vec<u32>>,
}

/// Splits a mesh into spatially compact parts that fit and overlap little. The number of parts is up to 1.4 times the
/// minimum, or up to 3 times for a mesh whose parts would overlap much. Parts that still do not fit, because their
/// mix of geometries needs more memory, are split further. `bounds` holds the bounds of each geometry's primitives.
/// `sizes` returns the sizes of an acceleration structure with the given number of primitives of each geometry.
/// Deterministic.
///
/// Fails with [`Error::LimitExceeded`] if a single primitive does not fit.
pub(crate) fn plan_split(
    name: &str,
    bounds: &[Vec<Bounds>],
    limits: &PartLimits,
    sizes: &mut dyn FnMut(&[u32]) -> Result<PartSizes>,
) -> Result<Vec<PartPlan>> {
    let mut starts = Vec::with_capacity(bounds.len());
    let mut total = 0_u64;
    for geometry in bounds {
        starts.push(total);
        total += geometry.len() as u64;
    }
    check_limit_of(
        LimitOrigin::Library,
        name,
        "primitive count of all parts together",
        total,
        u32::MAX.into(),
    )?;
    let mut planner = SplitPlanner { name, starts, limits, sizes, parts: Vec::new() };
    planner.plan_parts(&mut primitive_bounds(bounds.iter().flatten()))?;
    Ok(planner.parts)
}

struct SplitPlanner<'a> {
    name: &'a str,
    /// Number of each geometry's first primitive, counted over all geometries.
    starts: Vec<u64>,
    limits: &'a PartLimits,
    sizes: &'a mut dyn FnMut(&[u32]) -> Result<PartSizes>,
    parts: Vec<PartPlan>,
}

impl SplitPlanner<'_> {
    fn plan_parts(&mut self, items: &mut [PrimitiveBounds]) -> Result<()> {
        let part = self.part_plan(items);
        let counts: Vec<u32> = part.geometries.iter().map(|geometry| geometry.len() as u32).collect();
        let demand = self.size_demand(&counts)?;
        if demand.parts <= 1 {
            self.parts.push(part);
            return Ok(());
        }
        drop(part);
        if items.len() <= 1 {
            return Err(Error::LimitExceeded {
                object: self.name.to_owned(),
                what: demand.what,
                requested: demand.requested,
                limit: demand.limit,
                origin: LimitOrigin::Device,
            });
        }
        let parts = self.min_part_count(&counts, demand.parts, items.len() as u64)?;
        self.split_part(items, parts)
    }

    /// Splits the primitives into parts of at most an equal share each, and plans each part.
    fn split_part(&mut self, items: &mut [PrimitiveBounds], parts: u64) -> Result<()> {
        let share = (items.len() as u64).div_ceil(parts).max(1) as usize;
        let leaf = (share / median_leaves_of_part(parts)).max(1);
        for mut part in merge_cheapest(&sah_leaves(items, leaf), share, parts) {
            self.plan_parts(&mut part)?;
        }
        Ok(())
    }

    /// Smallest number of parts, between `lowest` and `highest`, for which an equal share of every geometry fits.
    /// Sizes have a fixed base, so the ratio of the whole size to the limit may be too small a number.
    fn min_part_count(&mut self, counts: &[u32], lowest: u64, highest: u64) -> Result<u64> {
        let mut too_few = lowest.min(highest) - 1;
        let mut enough = too_few + 1;
        while enough < highest && !self.equal_share_fits(counts, enough)? {
            (too_few, enough) = (enough, enough.saturating_mul(2).min(highest));
        }
        while enough - too_few > 1 {
            let middle = too_few + (enough - too_few) / 2;
            if self.equal_share_fits(counts, middle)? {
                enough = middle;
            } else {
                too_few = middle;
            }
        }
        Ok(enough)
    }

    fn equal_share_fits(&mut self, counts: &[u32], parts: u64) -> Result<bool> {
        Ok(self.size_demand(&equal_share(counts, parts))?.parts <= 1)
    }

    /// The limit that an acceleration structure with these counts exceeds by the largest factor, with that factor.
    fn size_demand(&mut self, counts: &[u32]) -> Result<SizeDemand> {
        let sizes = (self.sizes)(counts)?;
        let primitives = counts.iter().copied().map(u64::from).sum();
        let limits = self.limits;
        let demands = [
            SizeDemand::new("primitive count of one part", primitives, limits.primitives),
            SizeDemand::new("scratch size in bytes of one part", sizes.scratch_bytes, limits.scratch_bytes),
            SizeDemand::new(
                "structure size in bytes of one part",
                sizes.structure_bytes,
                limits.structure_bytes,
            ),
        ];
        let [first, second, third] = demands;
        let worst = if second.parts > first.parts { second } else { first };
        Ok(if third.parts > worst.parts { third } else { worst })
    }

    fn part_plan(&self, items: &[PrimitiveBounds]) -> PartPlan {
        let mut numbers: Vec<u32> = items.iter().map(|item| item.index).collect();
        numbers.sort_unstable();
        let mut geometries = Vec::with_capacity(self.starts.len());
        let mut rest = &numbers[..];
        for (geometry, &start) in self.starts.iter().enumerate() {
            let end = self.starts.get(geometry + 1).copied().unwrap_or(u64::MAX);
            let (here, behind) = rest.split_at(rest.partition_point(|&number| u64::from(number) < end));
            geometries.push(here.iter().map(|&number| number - start as u32).collect());
            rest = behind;
        }
        PartPlan { geometries }
    }
}

/// Number of leaves of a share before leaves are merged. More leaves give parts that overlap less, but merging
/// compares all pairs.
fn median_leaves_of_part(parts: u64) -> usize {
    (1024 / parts.max(1)).clamp(1, 8) as usize
}

/// Partitions by SAH until no leaf has more than `most` primitives.
fn sah_leaves(items: &mut [PrimitiveBounds], most: usize) -> Vec<&mut [PrimitiveBounds]> {
    let (mut open, mut done) = (vec![items], Vec::new());
    while let Some(piece) = open.pop() {
        if piece.len() <= most {
            done.push(piece);
            continue;
        }
        let left = partition_sah(piece);
        let (left, right) = piece.split_at_mut(left);
        open.extend([right, left]);
    }
    done
}

/// A way to merge leaves to parts.
#[derive(Debug, Clone, Copy)]
struct MergeRule {
    /// Share of the surface of a merged part that its preference to two parts is worth. Where it is negative, parts
    /// are merged only if they overlap much.
    preference: f32,
    /// Most parts, as a multiple of the minimum.
    most_parts: f32,
}

/// The first rule makes few parts. The second makes many that overlap less, which is cheaper where no few parts are
/// compact, as for shapes that reach into each other. The idea is that of re-braiding (Benthin and others, *Improved
/// Two-Level BVHs using Partial Re-Braiding*, 2017): it opens the structures that overlap.
const MERGE_RULES: [MergeRule; 2] =
    [MergeRule { preference: 0.25, most_parts: 1.4 }, MergeRule { preference: -0.25, most_parts: 3.0 }];

/// Share of a ray's cost that many parts must save, as each part is an object and an instance.
const LEAST_SAVING: f32 = 0.1;

/// Merges leaves by the rule whose parts cost rays least. `fewest` is the minimum of parts, each of which has at most
/// `most` primitives.
fn merge_cheapest(leaves: &[&mut [PrimitiveBounds]], most: usize, fewest: u64) -> Vec<Vec<PrimitiveBounds>> {
    let leaf = |(index, leaf): (usize, &&mut [PrimitiveBounds])| MergeCandidate {
        leaves: vec![index],
        count: leaf.len(),
        bounds: union_bounds(leaf),
        partner: None,
    };
    let candidates: Vec<_> = leaves.iter().enumerate().map(leaf).collect();
    let [few, many] = MERGE_RULES.map(|rule| merge_parts(candidates.clone(), rule, most, fewest));
    let cheapest = if ray_cost(&many) < ray_cost(&few) * (1.0 - LEAST_SAVING) { many } else { few };
    let items =
        |part: MergeCandidate| part.leaves.iter().flat_map(|leaf| leaves[*leaf].iter().copied()).collect();
    cheapest.into_iter().map(items).collect()
}

/// Returns the cost of a ray that passes the parts, by the surface area heuristic: for each part that the ray enters,
/// one for the entry, and the depth of a tree of the part, of which the tree of all primitives has the depth one.
fn ray_cost(parts: &[MergeCandidate]) -> f32 {
    let depth = |count: usize| (count.max(2) as f32).log2();
    let all = depth(parts.iter().map(|part| part.count).sum());
    parts.iter().map(|part| part.bounds.half_area() * (1.0 + depth(part.count) / all)).sum()
}

/// A part that is merged from leaves.
#[derive(Debug, Clone)]
struct MergeCandidate {
    /// Indices of the leaves.
    leaves: Vec<usize>,
    /// Number of primitives.
    count: usize,
    bounds: Bounds,
    /// The other part that gives the largest merge gain, and the gain.
    partner: Option<(usize, f32)>,
}

/// Merges parts, those with the largest overlap first. Merges until no merge gains and the rule's number of parts
/// remains, or until each merged part would have more than `most` primitives.
fn merge_parts(parts: Vec<MergeCandidate>, rule: MergeRule, most: usize, fewest: u64) -> Vec<MergeCandidate> {
    let enough = (fewest as f32 * rule.most_parts) as usize;
    let mut merger = Merger { parts, preference: rule.preference, most };
    (0..merger.parts.len()).for_each(|part| merger.find_partner(part));
    while let Some((part, partner)) = merger.best_merge(merger.parts.len() > enough) {
        merger.merge(part.min(partner), part.max(partner));
    }
    merger.parts
}

struct Merger {
    parts: Vec<MergeCandidate>,
    /// See [`MergeRule::preference`].
    preference: f32,
    /// Most primitives of a part.
    most: usize,
}

impl Merger {
    /// Surface area saved if both parts become one; `None` if the merged part would be too large.
    fn gain(&self, part: &MergeCandidate, other: &MergeCandidate) -> Option<f32> {
        if part.count + other.count > self.most {
            return None;
        }
        let together = part.bounds.union(other.bounds).half_area() * (1.0 - self.preference);
        Some(part.bounds.half_area() + other.bounds.half_area() - together)
    }

    /// Merges `partner` into `part`, which has the lower index.
    fn merge(&mut self, part: usize, partner: usize) {
        let taken = self.parts.swap_remove(partner);
        let moved = self.parts.len();
        let merged = &mut self.parts[part];
        merged.bounds = merged.bounds.union(taken.bounds);
        merged.leaves.extend(taken.leaves);
        merged.count += taken.count;
        for other in 0..self.parts.len() {
            match self.parts[other].partner {
                Some((with, _)) if with == part || with == partner => self.find_partner(other),
                Some((with, gain)) if with == moved => self.parts[other].partner = Some((partner, gain)),
                _ => {}
            }
        }
        self.find_partner(part);
        (0..self.parts.len()).for_each(|other| self.offer(other, part));
    }

    fn find_partner(&mut self, part: usize) {
        self.parts[part].partner = None;
        (0..self.parts.len()).for_each(|other| self.offer(part, other));
    }

    /// Makes `other` the partner of `part` if it gains more than the present partner.
    fn offer(&mut self, part: usize, other: usize) {
        if part == other {
            return;
        }
        if let Some(gain) = self.gain(&self.parts[part], &self.parts[other])
            && self.parts[part].partner.is_none_or(|(_, present)| gain > present)
        {
            self.parts[part].partner = Some((other, gain));
        }
    }

    /// Returns the two parts with the largest gain. With `at_a_loss`, the gain may be negative.
    fn best_merge(&self, at_a_loss: bool) -> Option<(usize, usize)> {
        let pairs = self.parts.iter().enumerate().filter_map(|(part, merged)| {
            let (partner, gain) = merged.partner?;
            Some((part, partner, gain))
        });
        let best = pairs.reduce(|best, pair| if pair.2 > best.2 { pair } else { best });
        best.filter(|(_, _, gain)| at_a_loss || *gain >= 0.0).map(|(part, partner, _)| (part, partner))
    }
}

/// Primitives of each geometry in an average part: `ceil(total / parts)` in sum over all geometries. Rounding each
/// geometry up would give more, as there may be more geometries than primitives in a part.
fn equal_share(counts: &[u32], parts: u64) -> Vec<u32> {
    let (mut behind, mut given) = (0_u64, 0);
    let share = |&count: &u32| {
        behind += u64::from(count);
        let before = given;
        given = behind.div_ceil(parts.max(1));
        (given - before) as u32
    };
    counts.iter().map(share).collect()
}

/// One limit, and the number of parts that it requires.
#[derive(Clone, Copy)]
struct SizeDemand {
    what: &'static str,
    requested: u64,
    limit: u64,
    parts: u64,
}

impl SizeDemand {
    fn new(what: &'static str, requested: u64, limit: u64) -> Self {
        let parts = if limit == 0 && requested > 0 { u64::MAX } else { requested.div_ceil(limit.max(1)) };
        Self { what, requested, limit, parts }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::test_support::scattered_bounds::scattered_bounds;

    const MIB: u64 = 1 << 20;

    fn scattered(count: u32) -> Vec<Bounds> {
        scattered_bounds(count, 0.001)
    }

    /// Sizes with a fixed base and `structure` and `scratch` bytes for each primitive.
    fn linear(base: u64, structure: u64, scratch: u64) -> impl FnMut(&[u32]) -> Result<PartSizes> {
        move |counts| {
            let primitives: u64 = counts.iter().copied().map(u64::from).sum();
            Ok(PartSizes {
                structure_bytes: base + primitives * structure,
                scratch_bytes: base + primitives * scratch,
            })
        }
    }

    fn limits(structure_bytes: u64, scratch_bytes: u64, primitives: u64) -> PartLimits {
        PartLimits { structure_bytes, scratch_bytes, primitives }
    }

    fn part_count(part: &PartPlan) -> usize {
        part.geometries.iter().map(Vec::len).sum()
    }

    fn part_area(bounds: &[Vec<Bounds>], part: &PartPlan) -> f64 {
        let numbers = part.geometries.iter().zip(bounds);
        let boxes =
            numbers.flat_map(|(numbers, bounds)| numbers.iter().map(|&number| bounds[number as usize]));
        f64::from(boxes.fold(Bounds::EMPTY, Bounds::union).half_area())
    }

    #[test]
    fn a_mesh_within_the_limit_stays_whole() {
        let bounds = [scattered(10), Vec::new(), scattered(3)];
        let parts = plan_split("mesh", &bounds, &limits(1000, 1000, 13), &mut linear(0, 1, 1)).unwrap();
        assert_eq!(parts, [PartPlan { geometries: vec![(0..10).collect(), Vec::new(), (0..3).collect()] }]);
        let empty = plan_split("mesh", &[Vec::new()], &limits(0, 0, 0), &mut linear(0, 1, 1)).unwrap();
        assert_eq!(empty, [PartPlan { geometries: vec![Vec::new()] }]);
    }

    /// The phone of the slides: 2.8 M triangles of 2,805 bytes of scratch each need 29.3 times 256 MiB.
    #[test]
    fn a_large_mesh_on_a_phone_is_some_thirty_parts() {
        let bounds = [scattered(2_800_000)];
        let limits = limits(256 * MIB, 256 * MIB, 1 << 24);
        let parts = plan_split("mesh", &bounds, &limits, &mut linear(0, 219, 2805)).unwrap();
        assert!((30..=45).contains(&parts.len()), "{}", parts.len());
        assert_eq!(parts.iter().map(part_count).sum::<usize>(), 2_800_000);
    }

    #[test]
    fn a_fixed_base_takes_little_more_parts_than_it_must() {
        let bounds = [scattered(1000)];
        // 1000 + 10 n <= 1500 holds for n <= 50. So 20 parts are needed, though the whole is only 8 times too large.
        let parts = plan_split("mesh", &bounds, &limits(1500, 1500, 1000), &mut linear(1000, 10, 1)).unwrap();
        assert!((20..=60).contains(&parts.len()), "{}", parts.len());
    }

    #[test]
    fn a_primitive_too_large_by_itself_is_an_error_that_names_the_limit() {
        let check = |limits: PartLimits, what: &str| {
            let error =
                plan_split("statue", &[scattered(40)], &limits, &mut linear(100, 10, 20)).unwrap_err();
            let text = error.to_string();
            assert!(
                matches!(error, Error::LimitExceeded { .. })
                    && text.contains(what)
                    && text.contains("statue"),
                "{text}"
            );
        };
        check(limits(109, 1 << 40, 100), "structure size");
        check(limits(1 << 40, 119, 100), "scratch size");
        check(limits(1 << 40, 1 << 40, 0), "primitive count");
        let empty = plan_split("statue", &[Vec::new()], &limits(99, 99, 1), &mut linear(100, 10, 20));
        assert!(matches!(empty, Err(Error::LimitExceeded { .. })));
    }

    #[test]
    fn errors_of_the_size_query_come_through() {
        let mut fails = |_: &[u32]| Err(Error::usage("mesh", "lost"));
        assert!(plan_split("mesh", &[scattered(4)], &limits(1, 1, 1), &mut fails).is_err());
    }

    #[test]
    fn a_costly_geometry_is_split_further_than_a_cheap_one() {
        // The first geometry, all on the left, costs 50 times as much as the second one.
        let shifted = scattered(500).into_iter();
        let right = shifted
            .map(|one| Bounds { low: one.low + Vec3::X * 9.0, high: one.high + Vec3::X * 9.0 })
            .collect();
        let mut sizes = |counts: &[u32]| {
            let bytes = u64::from(counts[0]) * 50 + u64::from(counts[1]);
            Ok(PartSizes { structure_bytes: bytes, scratch_bytes: 0 })
        };
        let parts = plan_split("mesh", &[scattered(500), right], &limits(5000, 1, 1000), &mut sizes).unwrap();
        let largest = |geometry: usize| parts.iter().map(|part| part.geometries[geometry].len()).max();
        assert!(largest(0) <= Some(100) && largest(1) > Some(150), "{:?} {:?}", largest(0), largest(1));
    }

    #[test]
    fn a_share_is_as_large_as_an_average_part() {
        assert_eq!(equal_share(&[100, 0, 50], 1), [100, 0, 50]);
        assert_eq!(equal_share(&[100, 0, 51], 10), [10, 0, 6]);
        assert_eq!(equal_share(&[1; 7], 3).iter().sum::<u32>(), 3);
        assert_eq!(equal_share(&[u32::MAX, 0], u64::MAX), [1, 0]);
    }

    #[test]
    fn many_small_geometries_take_no_more_parts_than_a_large_one() {
        let bounds: Vec<_> = scattered(5000).chunks(10).map(<[Bounds]>::to_vec).collect();
        let parts = plan_split("mesh", &bounds, &limits(MIB, MIB, 170), &mut linear(0, 1, 1)).unwrap();
        assert!((30..=90).contains(&parts.len()), "{}", parts.len());
    }

    #[test]
    fn primitives_in_one_place_are_split_by_count() {
        for one in [Bounds::ORIGIN, Bounds { low: Vec3::NAN, high: Vec3::NAN }] {
            let parts =
                plan_split("mesh", &[vec![one; 100]], &limits(MIB, MIB, 30), &mut linear(0, 1, 1)).unwrap();
            assert!((4..=5).contains(&parts.len()), "{}", parts.len());
        }
    }

    #[test]
    fn parts_are_compact() {
        let bounds = [scattered(30_000), scattered(20_000)];
        let parts =
            plan_split("mesh", &bounds, &limits(MIB, MIB, 50_000 / 31), &mut linear(0, 1, 1)).unwrap();
        let area: f64 = parts.iter().map(|part| part_area(&bounds, part)).sum();
        // Parts of random primitives would all be as large as the whole, 3.
        assert!(area < 0.15 * 3.0 * parts.len() as f64, "{area} in {} parts", parts.len());
    }

    proptest! {
        #[test]
        fn every_primitive_is_in_one_part_and_every_part_fits(
            geometries in prop::collection::vec(
                prop::collection::vec((prop::array::uniform3(prop::num::f32::ANY), any::<bool>()), 0..80), 1..5),
            (base, structure, scratch) in (0..50_u64, 1..10_u64, 1..10_u64),
            room in (10..200_u64, 10..200_u64, 1..40_u64),
        ) {
            let bounds: Vec<Vec<Bounds>> = geometries
                .iter()
                .map(|places| places.iter().map(|&(place, wild)| boxed(place, wild)).collect())
                .collect();
            let limits = limits(base + room.0, base + room.1, room.2);
            let mut sizes = linear(base, structure, scratch);
            let parts = plan_split("mesh", &bounds, &limits, &mut sizes).unwrap();
            prop_assert_eq!(&parts, &plan_split("mesh", &bounds, &limits, &mut sizes).unwrap());
            for part in &parts {
                let counts: Vec<u32> = part.geometries.iter().map(|numbers| numbers.len() as u32).collect();
                let sizes = sizes(&counts).unwrap();
                prop_assert!(sizes.structure_bytes <= limits.structure_bytes);
                prop_assert!(sizes.scratch_bytes <= limits.scratch_bytes);
                prop_assert!(part_count(part) as u64 <= limits.primitives);
                prop_assert!(part_count(part) > 0 || parts.len() == 1);
                prop_assert!(part.geometries.iter().all(|numbers| numbers.is_sorted()));
            }
            for (geometry, bounds) in bounds.iter().enumerate() {
                let mut all: Vec<u32> = parts.iter().flat_map(|part| part.geometries[geometry].clone()).collect();
                all.sort_unstable();
                prop_assert!(all.into_iter().eq(0..bounds.len() as u32));
            }
        }
    }

    /// A small AABB, or with `wild` one with any coordinates. Coordinates that are NaN make all such AABBs equal.
    fn boxed(place: [f32; 3], wild: bool) -> Bounds {
        let place = Vec3::from(place);
        if wild {
            Bounds { low: place, high: -place }
        } else {
            Bounds { low: place.clamp(Vec3::ZERO, Vec3::ONE), high: Vec3::ONE }
        }
    }
}
