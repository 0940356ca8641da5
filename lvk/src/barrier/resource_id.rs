//! Identities of tracked resources, and maps keyed by them.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};

/// Identity of a buffer, a texture or a group of resources that is tracked as one. It is never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ResourceId(pub(crate) u64);

impl ResourceId {
    /// Returns a new id, unique for the life of the process.
    pub(crate) fn next() -> Self {
        static LAST: AtomicU64 = AtomicU64::new(0);
        Self(LAST.fetch_add(1, Ordering::Relaxed) + 1)
    }

    /// Returns one of 64 bits, for sets that reject most ids early. Ids are consecutive, so few ids of a
    /// small set share a bit.
    #[inline]
    pub(crate) fn bit(self) -> u64 {
        1 << (self.0 % 64)
    }
}

/// A map keyed by [`ResourceId`].
pub(crate) type IdMap<T> = HashMap<ResourceId, T, BuildHasherDefault<IdHasher>>;

/// Hashes ids. They are consecutive numbers assigned by the library, so protection against crafted keys is
/// not needed.
#[derive(Default)]
pub(crate) struct IdHasher(u64);

impl Hasher for IdHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte) ^ self.0);
        }
    }

    fn write_u64(&mut self, id: u64) {
        self.0 = id.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
