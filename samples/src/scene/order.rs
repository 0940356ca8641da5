//! An order of triangles that makes a good tree of a builder which does not sort.
//!
//! Some drivers (lavapipe up to 25.0) cut the list of primitives in the middle, each half in the middle again,
//! and so on: the tree is as good as the order. So the order is made by that very tree, top down: at each node
//! the half that goes left is chosen by the cheapest of four cuts, by the surface-area measure. Builders that
//! sort lose nothing, and vertex fetches gain from the locality.

use std::cmp::Ordering;

use glam::Vec3;

/// A primitive on its way through the tree.
#[derive(Clone, Copy)]
struct Item {
    low: Vec3,
    high: Vec3,
    index: u32,
}

/// Ways to rank the primitives of a node: by centre along x, y or z, or by size, which keeps a few large
/// primitives from inflating every node.
const CUT_COUNT: usize = 4;

/// The cheapest cut of a large node is found on about this many of its primitives, evenly picked.
const SAMPLE_COUNT: usize = 2048;

/// Nodes larger than this are worth a thread of their own.
const PARALLEL_COUNT: usize = 1 << 16;

/// Order of primitives whose tree of halves (the first `ceil(n / 2)` to the left, at every node) has a small
/// surface area. `boxes` are (minimum, maximum) corners; returns their numbers in the new order. Deterministic;
/// any values are allowed, but those that are not finite get a poor place.
///
/// Takes O(n log n) time: about a second for a million boxes.
pub fn median_order(boxes: &[(Vec3, Vec3)]) -> Vec<u32> {
    let mut items: Vec<Item> =
        boxes.iter().zip(0..).map(|(&(low, high), index)| Item { low, high, index }).collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    cut(&mut items, threads);
    items.into_iter().map(|item| item.index).collect()
}

/// Arranges `items`, splitting the work over up to `threads` threads.
fn cut(mut items: &mut [Item], threads: usize) {
    while items.len() > 2 {
        let middle = items.len().div_ceil(2);
        let kind = match items.len() / SAMPLE_COUNT {
            0..2 => cheapest_cut(items),
            step => cheapest_cut(&mut items.iter().copied().step_by(step).collect::<Vec<_>>()),
        };
        select(items, middle, kind);
        let (left, right) = items.split_at_mut(middle);
        if threads > 1 && left.len() > PARALLEL_COUNT {
            std::thread::scope(|scope| {
                scope.spawn(|| cut(left, threads / 2));
                cut(right, threads - threads / 2);
            });
            return;
        }
        cut(left, 1);
        items = right;
    }
}

fn cheapest_cut(items: &mut [Item]) -> usize {
    let middle = items.len().div_ceil(2);
    let mut best = (f32::INFINITY, 0);
    for kind in 0..CUT_COUNT {
        select(items, middle, kind);
        let (left, right) = items.split_at(middle);
        let cost = half_area(left) * left.len() as f32 + half_area(right) * right.len() as f32;
        if cost < best.0 {
            best = (cost, kind);
        }
    }
    best.1
}

/// Moves the `middle` lowest ranked items to the front.
fn select(items: &mut [Item], middle: usize, kind: usize) {
    let compare = |a: &Item, b: &Item| match rank(a, kind).total_cmp(&rank(b, kind)) {
        // Equal ranks are told apart, so that the result does not depend on how selection works.
        Ordering::Equal => a.index.cmp(&b.index),
        order => order,
    };
    items.select_nth_unstable_by(middle - 1, compare);
}

fn rank(item: &Item, kind: usize) -> f32 {
    match kind {
        0..3 => item.low[kind] + item.high[kind],
        _ => item.low.distance_squared(item.high),
    }
}

fn half_area(items: &[Item]) -> f32 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for item in items {
        low = low.min(item.low);
        high = high.max(item.high);
    }
    let d = high - low;
    d.x * d.y + d.y * d.z + d.z * d.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Sum of the areas of all inner nodes of the tree of halves.
    fn tree_area(boxes: &[(Vec3, Vec3)], order: &[u32]) -> f32 {
        if order.len() < 2 {
            return 0.0;
        }
        let items: Vec<Item> = order
            .iter()
            .map(|&index| Item { low: boxes[index as usize].0, high: boxes[index as usize].1, index })
            .collect();
        let (left, right) = order.split_at(order.len().div_ceil(2));
        half_area(&items) + tree_area(boxes, left) + tree_area(boxes, right)
    }

    fn scattered(count: u32) -> Vec<(Vec3, Vec3)> {
        let noise =
            |i: u32, k: u32| (i.wrapping_mul(2_654_435_761).rotate_left(7 * k) >> 8) as f32 / 16_777_216.0;
        (0..count)
            .map(|i| {
                let low = Vec3::new(noise(i, 0), noise(i, 1), noise(i, 2));
                (low, low + Vec3::splat(0.01))
            })
            .collect()
    }

    #[test]
    fn the_tree_of_halves_is_many_times_smaller_than_unsorted() {
        let boxes = scattered(4096);
        let unsorted: Vec<u32> = (0..4096).collect();
        let sorted = median_order(&boxes);
        let gain = tree_area(&boxes, &unsorted) / tree_area(&boxes, &sorted);
        assert!(gain > 8.0, "{gain}");
    }

    #[test]
    fn neighbours_on_a_line_stay_neighbours() {
        let boxes: Vec<_> = [3.0, 0.0, 2.0, 1.0, 4.0].map(|x| (Vec3::X * x, Vec3::X * x + Vec3::ONE)).into();
        let order = median_order(&boxes);
        assert_eq!(order.len(), 5);
        let mut left = order[..3].to_vec();
        left.sort_unstable();
        assert_eq!(left, [1, 2, 3], "0, 2 and 1 stand left of 3 and 4");
    }

    #[test]
    fn threads_do_not_change_the_result() {
        let boxes = scattered(3 * PARALLEL_COUNT as u32);
        let mut alone: Vec<Item> =
            boxes.iter().zip(0..).map(|(&(low, high), index)| Item { low, high, index }).collect();
        cut(&mut alone, 1);
        let alone: Vec<u32> = alone.into_iter().map(|item| item.index).collect();
        assert_eq!(median_order(&boxes), alone);
    }

    proptest! {
        #[test]
        fn every_box_appears_once_whatever_the_values(
            corners in proptest::collection::vec((any::<[f32; 3]>(), any::<[f32; 3]>()), 0..200),
            flat in any::<bool>(),
        ) {
            let boxes: Vec<_> = corners
                .iter()
                .map(|&(a, b)| if flat { (Vec3::ZERO, Vec3::ZERO) } else { (Vec3::from(a), Vec3::from(b)) })
                .collect();
            let order = median_order(&boxes);
            prop_assert_eq!(&order, &median_order(&boxes));
            let mut sorted = order;
            sorted.sort_unstable();
            prop_assert!(sorted.iter().copied().eq(0..boxes.len() as u32));
        }
    }
}
