//! The memory that a load may still take.

use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};

use super::MemoryLimit;
use super::source::Source;
use crate::Problem;

/// The memory that a load may still take. Every allocation whose size the file decides is charged before it is made, and none is
/// given back, so that the sum is a bound of the peak.
#[derive(Debug)]
pub(super) struct Budget {
    left: AtomicU64,
    limit: AtomicU64,
    multiple: u64,
}

impl Budget {
    pub(super) fn new(limit: MemoryLimit) -> Self {
        let (left, limit_bytes) = (AtomicU64::new(limit.fixed_bytes), AtomicU64::new(limit.fixed_bytes));
        Self { left, limit: limit_bytes, multiple: limit.multiple }
    }

    /// Adds what the bytes of a file bring. The bytes themselves are charged.
    pub(super) fn add_file(&self, bytes: u64) {
        let more = bytes.saturating_mul(self.multiple.saturating_sub(1));
        for sum in [&self.left, &self.limit] {
            let add = |before: u64| Some(before.saturating_add(more));
            _ = sum.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add);
        }
    }

    /// Returns the bytes that are left.
    pub(super) fn left(&self) -> u64 {
        self.left.load(Ordering::Relaxed)
    }

    /// Takes bytes for an object.
    pub(super) fn charge(&self, bytes: u64, place: impl FnOnce() -> String) -> Result<(), Problem> {
        let take = |left: u64| left.checked_sub(bytes);
        match self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take) {
            Ok(_) => Ok(()),
            Err(left) => Err(Problem::Memory {
                place: place(),
                bytes,
                left,
                limit: self.limit.load(Ordering::Relaxed),
            }),
        }
    }

    /// Reads all bytes of a source. Those of a file are charged.
    pub(super) fn read<'a>(
        &self,
        source: Source<'a>,
        place: impl FnOnce() -> String,
    ) -> Result<Cow<'a, [u8]>, Problem> {
        if matches!(source, Source::File { .. }) {
            self.charge(source.length(), place)?;
        }
        source.read()
    }

    /// Makes an empty list for this number of entries.
    pub(super) fn list<T>(&self, count: u64, place: impl Fn() -> String) -> Result<Vec<T>, Problem> {
        let bytes = count.saturating_mul(size_of::<T>() as u64);
        self.charge(bytes, &place)?;
        let mut list = Vec::new();
        let capacity = usize::try_from(count).unwrap_or(usize::MAX);
        let too_large = |_| Problem::Memory { place: place(), bytes, left: 0, limit: bytes };
        list.try_reserve_exact(capacity).map_err(too_large)?;
        Ok(list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_charge_beyond_what_is_left_is_refused_and_takes_nothing() {
        let budget = Budget::new(MemoryLimit { fixed_bytes: 100, multiple: 3 });
        budget.add_file(10); // 20 more, as the bytes themselves are in memory
        budget.charge(100, String::new).unwrap();
        let error = budget.charge(21, || "mesh 1".into()).unwrap_err();
        let Problem::Memory { place, bytes, left, limit } = error else { panic!("{error}") };
        assert_eq!((place.as_str(), bytes, left, limit), ("mesh 1", 21, 20, 120));
        budget.charge(20, String::new).unwrap();
        assert_eq!(budget.left(), 0);
    }

    #[test]
    fn a_list_of_absurd_length_is_refused() {
        let budget = Budget::new(MemoryLimit { fixed_bytes: 100, multiple: 0 });
        assert!(budget.list::<u64>(u64::MAX, String::new).is_err());
        assert_eq!(budget.list::<u64>(12, String::new).unwrap().capacity(), 12);
    }
}
