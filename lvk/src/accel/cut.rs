//! How a list of primitives is cut in two compact pieces.

use std::cmp::Ordering;

use super::bounds::Bounds;

/// A primitive on its way through the cuts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    pub(crate) bounds: Bounds,
    pub(crate) index: u32,
}

/// Numbers boxes from 0.
pub(crate) fn items<'a>(bounds: impl IntoIterator<Item = &'a Bounds>) -> Vec<Item> {
    bounds.into_iter().zip(0..).map(|(&bounds, index)| Item { bounds, index }).collect()
}

/// The union of the boxes.
pub(crate) fn union(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |all, item| all.union(item.bounds))
}

/// Ways to rank primitives: by the low or the high end along x, y or z. Of those that reach across a cut, one end or
/// the other decides, which gathers the few large ones of a place in one piece and leaves the other one small.
const WAY_COUNT: usize = 6;

/// The cheapest way to cut a long list is found on about this many of its primitives, evenly picked. Fewer miss the
/// few large ones, whose place matters most.
const SAMPLE_COUNT: usize = 1 << 14;

/// Moves `left` of the primitives to the front, so that both pieces together cost little by the surface-area measure.
/// The result depends on the items and their order alone.
pub(crate) fn cut(items: &mut [Item], left: usize) {
    if left == 0 || left >= items.len() {
        return;
    }
    let way = match items.len() / SAMPLE_COUNT {
        0..2 => cheapest_way(items, left),
        step => {
            let mut sample: Vec<_> = items.iter().copied().step_by(step).collect();
            let share = (sample.len() as u64 * left as u64 / items.len() as u64) as usize;
            cheapest_way(&mut sample, share.max(1))
        }
    };
    select(items, left, way);
}

fn cheapest_way(items: &mut [Item], left: usize) -> usize {
    let mut best = (f32::INFINITY, 0);
    for way in 0..WAY_COUNT {
        select(items, left, way);
        let (left, right) = items.split_at(left);
        let cost = cost(left) + cost(right);
        if cost < best.0 {
            best = (cost, way);
        }
    }
    best.1
}

fn cost(items: &[Item]) -> f32 {
    union(items).half_area() * items.len() as f32
}

/// Moves the `left` lowest ranked items to the front.
fn select(items: &mut [Item], left: usize, way: usize) {
    let compare = |a: &Item, b: &Item| match rank(a, way).total_cmp(&rank(b, way)) {
        // Equal ranks are told apart, so that the result does not depend on how selection works.
        Ordering::Equal => a.index.cmp(&b.index),
        order => order,
    };
    items.select_nth_unstable_by(left - 1, compare);
}

fn rank(item: &Item, way: usize) -> f32 {
    match way {
        0..3 => item.bounds.low[way],
        _ => item.bounds.high[way - 3],
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
            let mut items = items(&bounds);
            cut(&mut items, 30);
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
        let mut items = items(&bounds);
        cut(&mut items, 16);
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
            let mut items = items(&bounds);
            cut(&mut items, left);
            let mut numbers: Vec<_> = items.iter().map(|item| item.index).collect();
            numbers.sort_unstable();
            prop_assert!(numbers.into_iter().eq(0..bounds.len() as u32));
        }
    }
}
