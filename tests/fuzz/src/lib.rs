//! Fuzz targets: each reads bytes from outside as `lvk` or its samples do, and must neither panic, nor run long, nor take more
//! memory than a multiple of the bytes.
//!
//! [`TARGETS`] lists them. libFuzzer drives them through the programs in `fuzz_targets`, which `.ci/fuzz` builds and runs; the
//! test `mutations` drives them over the corpus and over mutations of it, as a part of `cargo test`.

mod files;
mod gltf;
mod gltf_edits;
mod input;
mod memory;
pub mod mutation;
mod targets;

use std::time::{Duration, Instant};

pub use memory::{Counting, MemoryBound};
pub use targets::TARGETS;

#[global_allocator]
static COUNTING: Counting = Counting;

/// Longest time of one input. An input of a few KiB takes milliseconds; machines with more work than cores take longer.
pub const MOST_TIME: Duration = Duration::from_secs(30);

/// A reader of bytes from outside.
pub struct Target {
    /// Name of the target, of its program and of its corpus.
    pub name: &'static str,
    /// Most memory that the reader takes.
    pub memory: MemoryBound,
    /// Reads an input.
    pub read: fn(&[u8]),
}

/// The memory and the time that an input took.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// Most bytes of the heap at one time.
    pub bytes: usize,
    /// Time of the read.
    pub time: Duration,
}

impl Target {
    /// Returns the target of this name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        TARGETS.iter().find(|target| target.name == name)
    }

    /// Reads an input.
    ///
    /// # Panics
    /// If the reader panics, or takes more memory than its bound or longer than [`MOST_TIME`].
    pub fn run(&self, bytes: &[u8]) -> Cost {
        let start = Instant::now();
        let most = self.memory.bytes_for(bytes.len());
        let peak = memory::peak_of(most, || (self.read)(bytes));
        let cost = Cost { bytes: peak, time: start.elapsed() };
        assert!(
            cost.bytes <= most,
            "target '{}' took {} bytes for an input of {}, more than {most}",
            self.name,
            cost.bytes,
            bytes.len()
        );
        assert!(cost.time <= MOST_TIME, "target '{}' took {:?}", self.name, cost.time);
        cost
    }
}

/// Reads an input by the target of this name, for the programs of libFuzzer.
///
/// # Panics
/// As [`Target::run`], and for an unknown name.
pub fn run(name: &str, bytes: &[u8]) {
    let target = Target::find(name);
    assert!(target.is_some(), "no target '{name}'");
    target.into_iter().for_each(|target| _ = target.run(bytes));
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUND: MemoryBound = MemoryBound { fixed: 100, multiple: 10 };

    #[test]
    fn a_reader_within_its_bound_passes() {
        let target =
            Target { name: "little", memory: BOUND, read: |bytes| drop(vec![0_u8; 10 * bytes.len()]) };
        assert_eq!(target.run(&[0; 50]).bytes, 500);
    }

    #[test]
    #[should_panic(expected = "target 'much' took 2000 bytes for an input of 50, more than 600")]
    fn a_reader_beyond_its_bound_fails() {
        let target = Target { name: "much", memory: BOUND, read: |bytes| drop(vec![0_u8; 40 * bytes.len()]) };
        _ = target.run(&[0; 50]);
    }

    #[test]
    fn names_of_targets_differ() {
        let names: std::collections::HashSet<_> = TARGETS.iter().map(|target| target.name).collect();
        assert_eq!(names.len(), TARGETS.len());
        assert!(names.iter().all(|name| Target::find(name).is_some_and(|found| found.name == *name)));
    }
}
