//! Pseudo-random bytes, equal in every run.

use crate::random::Random;

/// Returns `count` bytes that depend on `seed` alone.
pub fn noise(seed: u32, count: usize) -> Vec<u8> {
    let mut random = Random::new(seed.into());
    std::iter::repeat_with(|| random.bits() as u8).take(count).collect()
}
