//! A primitive order that gives a good BVH with a builder that does not sort.
//!
//! Some drivers (lavapipe up to 25.0) split the list of primitives in the middle, then each half in the middle, and so
//! on. Their BVH is only as good as the order. So the order is computed from the same BVH, top down, with the cheapest
//! partition at each node. Builders that sort gain nothing.

use super::partition::{PrimitiveBounds, partition_at, primitive_bounds};
use super::primitive_bounds::Bounds;
use crate::parallel::{core_count, parallel_for};

/// Minimum ratio of the BVH cost of the given order to that of another order. Below it, the other order is not worth
/// its primitive map and its time.
pub(crate) const MIN_AREA_RATIO: f64 = 1.1;

/// Nodes with more primitives than this get their own thread.
const MIN_PARALLEL_COUNT: usize = 1 << 16;

/// Returns the indices of the bounds in an order whose median-split BVH has a small surface area. A median split puts
/// the first `ceil(n / 2)` primitives of every node to the left. Deterministic. Any values are allowed, but bounds
/// that are not finite get a poor position.
///
/// Takes O(n log n) time.
pub(crate) fn spatial_order(bounds: &[Bounds]) -> Vec<u32> {
    let mut items = primitive_bounds(bounds);
    sort_median(&mut items, core_count());
    items.into_iter().map(|item| item.index).collect()
}

/// True if the order lowers the cost of the median-split BVH by a factor of more than [`MIN_AREA_RATIO`], compared
/// with the given order.
pub(crate) fn is_reorder_worthwhile(bounds: &[Bounds], order: &[u32]) -> bool {
    let given: Vec<u32> = (0..bounds.len() as u32).collect();
    median_tree_area(bounds, &given) > MIN_AREA_RATIO * median_tree_area(bounds, order)
}

/// Cost of the median-split BVH of an order: the sum of the half areas of all its inner nodes. Indices without bounds
/// count as empty.
pub(crate) fn median_tree_area(bounds: &[Bounds], order: &[u32]) -> f64 {
    node_area(bounds, order).1
}

/// Bounds of a node, and the sum of the half areas of the node and of all inner nodes below it.
fn node_area(bounds: &[Bounds], order: &[u32]) -> (Bounds, f64) {
    match order {
        [] => (Bounds::EMPTY, 0.0),
        [one] => (bounds.get(*one as usize).copied().unwrap_or(Bounds::EMPTY), 0.0),
        _ => {
            let (left, right) = order.split_at(order.len().div_ceil(2));
            let ((left, left_area), (right, right_area)) =
                (node_area(bounds, left), node_area(bounds, right));
            let node = left.union(right);
            (node, f64::from(node.half_area()) + left_area + right_area)
        }
    }
}

/// Sorts `items` in median-split order on up to `threads` threads.
fn sort_median(mut items: &mut [PrimitiveBounds], threads: usize) {
    while items.len() > 2 {
        let middle = items.len().div_ceil(2);
        partition_at(items, middle);
        let (left, right) = items.split_at_mut(middle);
        if threads > 1 && left.len() > MIN_PARALLEL_COUNT {
            let halves = [(left, threads / 2), (right, threads - threads / 2)];
            parallel_for(2, halves.into_iter(), |(items, threads)| sort_median(items, threads));
            return;
        }
        sort_median(left, 1);
        items = right;
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::test_support::scattered_bounds::scattered_bounds;

    fn line(places: &[f32]) -> Vec<Bounds> {
        places.iter().map(|&x| Bounds { low: Vec3::X * x, high: Vec3::X * x + 1.0 }).collect()
    }

    #[test]
    fn the_cost_is_that_of_the_tree_of_halves() {
        // ((a b) (c)) : the half areas of [0, 3] and [0, 2], each 1 high and deep.
        assert_eq!(median_tree_area(&line(&[0.0, 1.0, 2.0]), &[0, 1, 2]), 7.0 + 5.0);
        assert_eq!(median_tree_area(&line(&[0.0, 1.0, 2.0]), &[0, 2, 1]), 7.0 + 7.0);
        assert_eq!(median_tree_area(&line(&[0.0]), &[0]), 0.0);
        assert_eq!(median_tree_area(&[], &[]), 0.0);
        assert_eq!(median_tree_area(&line(&[0.0]), &[7, 9]), 0.0, "no such boxes");
    }

    #[test]
    fn the_tree_is_many_times_smaller_than_unsorted() {
        let bounds = scattered_bounds(4096, 0.01);
        let unsorted: Vec<u32> = (0..4096).collect();
        let order = spatial_order(&bounds);
        let gain = median_tree_area(&bounds, &unsorted) / median_tree_area(&bounds, &order);
        assert!(gain > 8.0, "{gain}");
        assert!(is_reorder_worthwhile(&bounds, &order));
    }

    #[test]
    fn a_good_order_is_not_worth_changing() {
        let bounds = scattered_bounds(4096, 0.01);
        let sorted: Vec<Bounds> =
            spatial_order(&bounds).into_iter().map(|index| bounds[index as usize]).collect();
        assert!(!is_reorder_worthwhile(&sorted, &spatial_order(&sorted)));
        assert!(!is_reorder_worthwhile(&[], &[]));
        let same = [Bounds::ORIGIN; 9];
        assert!(!is_reorder_worthwhile(&same, &spatial_order(&same)));
    }

    #[test]
    fn neighbours_on_a_line_stay_neighbours() {
        let bounds = line(&[3.0, 0.0, 2.0, 1.0, 4.0]);
        let order = spatial_order(&bounds);
        let mut left = order[..3].to_vec();
        left.sort_unstable();
        assert_eq!(left, [1, 2, 3], "0, 2 and 1 stand left of 3 and 4");
    }

    #[test]
    fn the_larger_half_of_an_odd_number_is_the_first() {
        let places = [[0.0, 0.1], [9.0, -9.0], [0.1, 0.0], [9.0, -8.0], [0.2, 0.2]];
        let bounds = places.map(|[x, y]| Bounds { low: Vec3::new(x, y, 0.0), high: Vec3::new(x, y, 1.0) });
        let mut left = spatial_order(&bounds)[..3].to_vec();
        left.sort_unstable();
        assert_eq!(left, [0, 2, 4], "the three that lie together");
    }

    #[test]
    fn threads_do_not_change_the_result() {
        let bounds = scattered_bounds(3 * MIN_PARALLEL_COUNT as u32, 0.01);
        let (mut alone, mut many) = (primitive_bounds(&bounds), primitive_bounds(&bounds));
        sort_median(&mut alone, 1);
        sort_median(&mut many, 5);
        assert!(alone.iter().map(|item| item.index).eq(many.iter().map(|item| item.index)));
    }

    proptest! {
        #[test]
        fn every_box_appears_once_whatever_the_values(
            corners in prop::collection::vec(prop::array::uniform6(prop::num::f32::ANY), 0..200), flat in any::<bool>()
        ) {
            let bounds: Vec<_> = corners
                .iter()
                .map(|&[a, b, c, d, e, f]| match flat { true => Bounds::ORIGIN, false => Bounds { low: Vec3::new(a, b, c), high: Vec3::new(d, e, f) } })
                .collect();
            let order = spatial_order(&bounds);
            prop_assert_eq!(&order, &spatial_order(&bounds));
            let area = median_tree_area(&bounds, &order);
            prop_assert!(area.is_finite() && area >= 0.0);
            let mut sorted = order;
            sorted.sort_unstable();
            prop_assert!(sorted.iter().copied().eq(0..bounds.len() as u32));
        }
    }
}
