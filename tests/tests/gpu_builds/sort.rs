//! The radix sort of builds on the GPU: a stable permutation for any keys.
#![allow(clippy::unwrap_used, reason = "tests")]

use lvk::test_hooks::sort;
use lvk_tests::device;
use lvk_tests::random::Random;

const COUNTS: [usize; 10] = [0, 1, 2, 127, 1023, 1024, 1025, 2049, 5000, 100_000];

fn patterns(count: usize, mask: u64) -> Vec<Vec<u64>> {
    let mut random = Random::new(count as u64);
    let all = |key: &mut dyn FnMut(u64) -> u64| (0..count as u64).map(key).map(|key| key & mask).collect();
    vec![
        all(&mut |_| 0),
        all(&mut |_| u64::MAX),
        all(&mut |i| i.wrapping_mul(0x0001_0001_0001)),
        all(&mut |i| !i),
        all(&mut |i| if i % 3 == 0 { u64::MAX } else { 7 }),
        all(&mut |_| random.bits()),
    ]
}

fn check(low_bits: u32) {
    let Some(ctx) = device() else { return };
    let mask = match low_bits {
        0 => u64::from(u32::MAX),
        bits => !0 << 32 | ((1 << bits) - 1),
    };
    for count in COUNTS {
        for (pattern, keys) in patterns(count, mask).iter().enumerate() {
            let mut expected: Vec<(u64, u32)> = keys.iter().copied().zip(0..).collect();
            expected.sort_by_key(|(key, _)| *key);
            assert!(sort(&ctx, keys, low_bits).unwrap() == expected, "{count} keys, pattern {pattern}");
        }
    }
}

#[test]
fn keys_of_one_word_are_sorted_stably() {
    check(0);
}

#[test]
fn keys_of_two_words_are_sorted_stably() {
    check(30);
}

#[test]
fn an_odd_number_of_passes_ends_in_the_same_buffer() {
    check(17);
}
