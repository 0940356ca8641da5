//! BVH8 nodes that the GPU collapses from BVH2 nodes: equal to those of the model on the CPU, for any tree.
#![allow(clippy::unwrap_used, reason = "tests")]

use lvk::Context;
use lvk::test_hooks::{Bvh2Reference, any_tree, collapse};
use lvk_tests::device;
use lvk_tests::random::Random;

fn tree(count: usize, even: usize, height: u32, seed: u64) -> Bvh2Reference {
    let mut random = Random::new(seed);
    any_tree(count, even, height, &mut |below| (random.bits() >> 32) as usize % below)
}

/// True if the nodes had room.
fn check(ctx: &Context, tree: &Bvh2Reference, what: &str) -> bool {
    let expected = tree.collapse();
    let (found, room) = collapse(ctx, tree).unwrap();
    assert_eq!(found.is_some(), expected.node_count() <= room, "{what}: {}", expected.node_count());
    let has_room = found.is_some();
    assert!(found.is_none_or(|found| found == expected), "{what}");
    has_room
}

#[test]
fn wide_nodes_are_those_of_the_model() {
    let Some(ctx) = device() else { return };
    for count in [4, 5, 7, 8, 9, 23, 24, 25, 100, 777, 3000, 20_000] {
        for even in [4, 7, 8] {
            let has_room = check(&ctx, &tree(count, even, 64, count as u64), &format!("{count}, {even}"));
            assert!(has_room || even == 4, "{count}");
        }
    }
}

#[test]
fn paths_fit_the_traversal_stack() {
    let Some(ctx) = device() else { return };
    for seed in 0..8 {
        check(&ctx, &tree(600, 0, 64, seed), &format!("{seed}"));
        check(&ctx, &tree(64, 0, 63, seed), &format!("{seed}, a chain"));
    }
}
