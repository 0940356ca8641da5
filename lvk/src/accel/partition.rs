//! Partition of a list of primitives into two spatially compact sides.

use std::cmp::Ordering;

use super::primitive_bounds::Bounds;

/// A primitive in a list that is partitioned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PrimitiveBounds {
    pub(crate) bounds: Bounds,
    pub(crate) index: u32,
}

/// Numbers the bounds from 0.
pub(crate) fn primitive_bounds<'a>(bounds: impl IntoIterator<Item = &'a Bounds>) -> Vec<PrimitiveBounds> {
    bounds.into_iter().zip(0..).map(|(&bounds, index)| PrimitiveBounds { bounds, index }).collect()
}

/// The union of the bounds.
pub(crate) fn union_bounds(items: &[PrimitiveBounds]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |all, item| all.union(item.bounds))
}

/// Sort keys of primitives: the low or the high end along x, y or z. For primitives that straddle the partition plane,
/// one of the ends decides. This collects the few large primitives of a region on one side and keeps the other side
/// small.
const AXIS_KEY_COUNT: usize = 6;

/// A long list is partitioned by the cheapest key of about this many evenly picked primitives. Fewer samples miss the
/// few large primitives, whose position matters most.
const SAMPLE_COUNT: usize = 1 << 14;

/// Moves `left` of the primitives to the front, so that both sides together have a small surface area cost. The result
/// depends only on the items and their order.
pub(crate) fn partition_at(items: &mut [PrimitiveBounds], left: usize) {
    if left == 0 || left >= items.len() {
        return;
    }
    let key = match items.len() / SAMPLE_COUNT {
        0..2 => cheapest_key(items, left),
        step => {
            let mut sample: Vec<_> = items.iter().copied().step_by(step).collect();
            let share = (sample.len() as u64 * left as u64 / items.len() as u64) as usize;
            cheapest_key(&mut sample, share.max(1))
        }
    };
    select_lowest(items, left, key);
}

/// Moves some of the primitives to the front and returns their number. Minimises the cost of both sides, where a ray
/// that enters a side costs the square root of its primitive count. Each side of a list of two or more gets at least
/// one primitive.
///
/// Unlike [`partition_at`] the position follows the gaps of the mesh and not a count, so the sides may have any size.
pub(crate) fn partition_sah(items: &mut [PrimitiveBounds]) -> usize {
    let step = (items.len() / SAMPLE_COUNT).max(1);
    let sample: Vec<_> = items.iter().copied().step_by(step).collect();
    let best = (0..SAH_KEY_COUNT)
        .filter_map(|key| cheapest_split(&sample, key))
        .reduce(|best, other| if other.cost < best.cost { other } else { best });
    let left =
        best.map_or(0, |best| partition_by(items, |item| sah_sort_key(item, best.key) < best.threshold));
    if left > 0 && left < items.len() {
        return left;
    }
    let middle = items.len() / 2;
    partition_at(items, middle);
    middle
}

/// The low end, the high end or the centre along x, y or z.
const SAH_KEY_COUNT: usize = 9;

fn sah_sort_key(item: &PrimitiveBounds, key: usize) -> f32 {
    match key {
        0..AXIS_KEY_COUNT => sort_key(item, key),
        _ => item.bounds.low[key - AXIS_KEY_COUNT] + item.bounds.high[key - AXIS_KEY_COUNT],
    }
}

/// A candidate partition of a list.
struct SahSplit {
    cost: f32,
    key: usize,
    /// Primitives with a key below this go left.
    threshold: f32,
}

/// The cheapest of evenly spaced thresholds of one key; `None` if all primitives have the same key.
fn cheapest_split(items: &[PrimitiveBounds], key: usize) -> Option<SahSplit> {
    const BIN_COUNT: usize = 64;
    let ranks = || items.iter().map(|item| sah_sort_key(item, key));
    let low = ranks().fold(f32::INFINITY, f32::min);
    let high = ranks().fold(f32::NEG_INFINITY, f32::max);
    let width = (high - low) / BIN_COUNT as f32;
    if !(width > 0.0 && width.is_finite()) {
        return None;
    }
    let mut bins = [(Bounds::EMPTY, 0_usize); BIN_COUNT];
    for item in items {
        let bin = &mut bins[(((sah_sort_key(item, key) - low) / width) as usize).min(BIN_COUNT - 1)];
        *bin = (bin.0.union(item.bounds), bin.1 + 1);
    }
    let join = |a: (Bounds, usize), b: (Bounds, usize)| (a.0.union(b.0), a.1 + b.1);
    let mut behind = [(Bounds::EMPTY, 0); BIN_COUNT + 1];
    for bin in (0..BIN_COUNT).rev() {
        behind[bin] = join(behind[bin + 1], bins[bin]);
    }
    let (mut before, mut best) = ((Bounds::EMPTY, 0), None::<SahSplit>);
    for bin in 1..BIN_COUNT {
        before = join(before, bins[bin - 1]);
        let cost = sah_cost(before) + sah_cost(behind[bin]);
        if before.1 > 0 && behind[bin].1 > 0 && best.as_ref().is_none_or(|best| cost < best.cost) {
            best = Some(SahSplit { cost, key, threshold: low + width * bin as f32 });
        }
    }
    best
}

fn sah_cost((bounds, count): (Bounds, usize)) -> f32 {
    if count == 0 { 0.0 } else { bounds.half_area() * (count as f32).sqrt() }
}

/// Moves the primitives that go left to the front and returns their number.
fn partition_by(items: &mut [PrimitiveBounds], goes_left: impl Fn(&PrimitiveBounds) -> bool) -> usize {
    let mut left = 0;
    for index in 0..items.len() {
        if goes_left(&items[index]) {
            items.swap(left, index);
            left += 1;
        }
    }
    left
}

fn cheapest_key(items: &mut [PrimitiveBounds], left: usize) -> usize {
    let mut best = (f32::INFINITY, 0);
    for key in 0..AXIS_KEY_COUNT {
        select_lowest(items, left, key);
        let (left, right) = items.split_at(left);
        let cost = cost(left) + cost(right);
        if cost < best.0 {
            best = (cost, key);
        }
    }
    best.1
}

fn cost(items: &[PrimitiveBounds]) -> f32 {
    union_bounds(items).half_area() * items.len() as f32
}

/// Moves the `left` items with the lowest keys to the front.
fn select_lowest(items: &mut [PrimitiveBounds], left: usize, key: usize) {
    let compare =
        |a: &PrimitiveBounds, b: &PrimitiveBounds| match sort_key(a, key).total_cmp(&sort_key(b, key)) {
            // Equal keys are ordered by index, so that the result does not depend on the selection algorithm.
            Ordering::Equal => a.index.cmp(&b.index),
            order => order,
        };
    items.select_nth_unstable_by(left - 1, compare);
}

fn sort_key(item: &PrimitiveBounds, key: usize) -> f32 {
    match key {
        0..3 => item.bounds.low[key],
        _ => item.bounds.high[key - 3],
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;

    fn small_box(center: [f32; 3]) -> Bounds {
        let center = Vec3::from(center);
        Bounds { low: center - 0.1, high: center + 0.1 }
    }

    #[test]
    fn two_clusters_are_told_apart_on_every_axis_at_any_ratio() {
        for axis in 0..3 {
            let mut bounds = vec![small_box([0.0; 3]); 30];
            let mut far = [0.0; 3];
            far[axis] = 50.0;
            bounds.extend(vec![small_box(far); 10]);
            bounds.swap(3, 35);
            bounds.swap(17, 31);
            let mut items = primitive_bounds(&bounds);
            partition_at(&mut items, 30);
            assert!(items[..30].iter().all(|item| item.bounds == small_box([0.0; 3])), "axis {axis}");
        }
    }

    #[test]
    fn large_primitives_are_taken_out_of_small_ones() {
        let mut bounds: Vec<_> =
            (0..20).map(|i| small_box([(i % 5) as f32 * 0.1, (i / 5) as f32 * 0.1, 0.0])).collect();
        for at in [3, 9, 12, 18] {
            bounds[at] = Bounds { low: Vec3::splat(-100.0), high: Vec3::splat(100.0) };
        }
        let mut items = primitive_bounds(&bounds);
        partition_at(&mut items, 16);
        let mut large: Vec<_> = items[16..].iter().map(|item| item.index).collect();
        large.sort_unstable();
        assert_eq!(large, [3, 9, 12, 18]);
    }

    proptest! {
        #[test]
        fn nothing_is_lost_whatever_the_values(
            corners in prop::collection::vec(prop::array::uniform6(prop::num::f32::ANY), 0..100), left in 0..120_usize
        ) {
            let bounds: Vec<_> = corners
                .iter()
                .map(|&[a, b, c, d, e, f]| Bounds { low: Vec3::new(a, b, c), high: Vec3::new(d, e, f) })
                .collect();
            let mut items = primitive_bounds(&bounds);
            partition_at(&mut items, left);
            let mut numbers: Vec<_> = items.iter().map(|item| item.index).collect();
            numbers.sort_unstable();
            prop_assert!(numbers.into_iter().eq(0..bounds.len() as u32));
        }
    }
}
