//! Sorts the primitives of a mesh along a Morton curve.

use glam::DVec3;
use rayon::prelude::*;

use super::binary_node::{Aabb, BinaryNode};
use super::build_threads::TASK_LENGTH;
use crate::accel::primitive_bounds::Bounds;

/// Bits of the code for each axis.
const AXIS_BITS: u32 = 21;

/// Returns the leaves along a Morton curve through their centers. Of equal codes, the lower primitive is first.
pub(super) fn morton_sorted_leaves(boxes: &[Bounds]) -> Vec<BinaryNode> {
    let whole = Aabb::from(&union_of_all(boxes));
    let scale = 1.0 / (whole.high - whole.low).as_dvec3().max(DVec3::splat(f64::MIN_POSITIVE));
    let low = whole.low.as_dvec3();
    let code = |bounds: &Bounds| morton_code((Aabb::from(bounds).center().as_dvec3() - low) * scale);
    let mut codes: Vec<(u64, u32)> = boxes
        .par_iter()
        .enumerate()
        .with_min_len(TASK_LENGTH)
        .map(|(number, bounds)| (code(bounds), number as u32))
        .collect();
    codes.par_sort_unstable();
    let leaf = |(_, number): &(u64, u32)| BinaryNode::leaf(&boxes[*number as usize], *number);
    codes.par_iter().with_min_len(TASK_LENGTH).map(leaf).collect()
}

/// Returns the union of all AABBs. The chunks have the same length for any number of threads, and so the result has the
/// same bits.
pub(super) fn union_of_all(boxes: &[Bounds]) -> Bounds {
    let union = |all: &[Bounds]| all.iter().copied().fold(Bounds::EMPTY, Bounds::union);
    let parts: Vec<Bounds> = boxes.par_chunks(TASK_LENGTH).map(union).collect();
    union(&parts)
}

/// Returns the Morton code of a position in the unit cube. Positions outside are clamped.
fn morton_code(position: DVec3) -> u64 {
    let steps = position * f64::from(1_u32 << AXIS_BITS);
    spread_bits(steps.x as u32) | spread_bits(steps.y as u32) << 1 | spread_bits(steps.z as u32) << 2
}

/// Moves bit `n` of the lowest [`AXIS_BITS`] bits to bit `3 * n`.
fn spread_bits(number: u32) -> u64 {
    const STEPS: [(u32, u64); 5] = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    let bits = u64::from(number) & ((1 << AXIS_BITS) - 1);
    STEPS.into_iter().fold(bits, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn each_bit_moves_to_three_times_its_place(number in 0..1_u32 << AXIS_BITS) {
            let slow = (0..AXIS_BITS).map(|bit| u64::from(number >> bit & 1) << (3 * bit)).sum::<u64>();
            prop_assert_eq!(spread_bits(number), slow);
        }

        #[test]
        fn leaves_follow_the_curve(
            corners in prop::collection::vec(prop::array::uniform3(0..9_u8), 1..300)
        ) {
            let place = |corner: &[u8; 3]| Vec3::from_array(corner.map(f32::from));
            let boxes: Vec<_> =
                corners.iter().map(|corner| Bounds { low: place(corner), high: place(corner) }).collect();
            let low = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union).low;
            let leaves = morton_sorted_leaves(&boxes);
            let mut seen: Vec<u32> = leaves.iter().map(BinaryNode::index).collect();
            let equal_are_sorted = leaves.windows(2).all(|pair| {
                pair[0].aabb() != pair[1].aabb() || pair[0].index() < pair[1].index()
            });
            prop_assert!(equal_are_sorted && leaves.iter().any(|leaf| leaf.aabb().low.cmpge(low.into()).all()));
            seen.sort_unstable();
            prop_assert_eq!(seen, (0..boxes.len() as u32).collect::<Vec<_>>());
        }
    }
}
