//! BVH2 nodes that the GPU merges bottom up: equal to those of the model on the CPU, for any primitives.
#![allow(clippy::unwrap_used, reason = "tests")]

use lvk::Context;
use lvk::test_hooks::{CheckBounds, SortedPrimitives, cluster, code_bits};
use lvk_tests::device;
use lvk_tests::random::Random;

/// Primitives with bounds at small integers, for which areas are exact. `code` returns the code of each place.
fn primitives(
    count: usize,
    bounds: &mut dyn FnMut(usize) -> CheckBounds,
    code: &mut dyn FnMut(usize) -> u64,
) -> SortedPrimitives {
    let bits = code_bits(count).unwrap();
    let mut codes: Vec<u64> = (0..count).map(|place| code(place) & ((1 << bits) - 1)).collect();
    codes.sort_unstable();
    SortedPrimitives { bounds: (0..count).map(bounds).collect(), codes, bits }
}

fn check(ctx: &Context, primitives: &SortedPrimitives, what: &str) {
    let expected = primitives.cluster();
    let (found, decisions) = cluster(ctx, primitives).unwrap();
    assert!(found == expected, "{what}");
    // So few primitives are one leaf.
    let is_decided = primitives.codes.len() > 3;
    assert!(!is_decided || decisions == expected.decisions(), "{what}");
}

#[test]
fn binary_nodes_are_those_of_the_model() {
    let Some(ctx) = device() else { return };
    for count in [2, 3, 16, 17, 31, 32, 33, 34, 100, 777, 3000, 5000] {
        let mut random = Random::new(count as u64);
        let mut other = Random::new(count as u64 + 1);
        let mut box_near = |place: usize| {
            let mut below = |most: usize| ((random.bits() >> 40) as usize % most) as f32;
            let low: [f32; 3] =
                std::array::from_fn(|axis| below(40) + if axis == 0 { (place / 50) as f32 } else { 0.0 });
            [low, low.map(|coordinate| coordinate + below(9))]
        };
        check(&ctx, &primitives(count, &mut box_near, &mut |_| other.bits()), &format!("{count}"));
        check(
            &ctx,
            &primitives(count, &mut box_near, &mut |place| place as u64 / 30),
            &format!("{count} in cells"),
        );
    }
}

/// Each cluster is nearest to its successor, or all are equal.
#[test]
fn chains_and_equal_bounds_make_low_trees() {
    let Some(ctx) = device() else { return };
    for count in [40, 1000, 5000] {
        let mut nested = |place: usize| [[0.0; 3], [1.0 + (place % 1000) as f32; 3]];
        check(&ctx, &primitives(count, &mut nested, &mut |_| 5), &format!("{count} nested, equal codes"));
        let mut shifts = |place: usize| 1_u64 << (place % 60);
        check(&ctx, &primitives(count, &mut nested, &mut shifts), &format!("{count} nested, long paths"));
        check(&ctx, &primitives(count, &mut |_| [[0.0; 3], [1.0; 3]], &mut |_| 5), &format!("{count} equal"));
    }
}
