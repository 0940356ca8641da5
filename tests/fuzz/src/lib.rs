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
mod picture;
mod targets;
mod watchdog;

pub use memory::{Counting, MemoryBound};
pub use targets::TARGETS;
use watchdog::watched;
pub use watchdog::{MOST_SECONDS_VARIABLE, MOST_TIME};

#[global_allocator]
static COUNTING: Counting = Counting;

/// A reader of bytes from outside.
pub struct Target {
    /// Name of the target, of its program and of its corpus.
    pub name: &'static str,
    /// Most memory that the reader takes.
    pub memory: MemoryBound,
    /// Bytes that the reader may make of an input by the size that it states; 0 for readers of other inputs.
    pub decoded: fn(&[u8]) -> usize,
    /// Reads an input. True if it is accepted.
    pub read: fn(&[u8]) -> bool,
}

/// The memory that an input took.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// Most bytes of the heap at one time.
    pub bytes: usize,
    /// The bound of the input.
    pub most: usize,
    /// True if the input was accepted.
    pub is_accepted: bool,
}

impl Target {
    /// Returns the target of this name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        TARGETS.iter().find(|target| target.name == name)
    }

    /// Reads an input. Ends the process if that takes longer than [`MOST_TIME`].
    ///
    /// # Panics
    /// If the reader panics, or takes more memory than its bound.
    pub fn run(&self, bytes: &[u8]) -> Cost {
        let cost = watched(self.name, bytes, || {
            let most = self.memory.bytes_for(bytes.len(), (self.decoded)(bytes));
            let mut is_accepted = false;
            let bytes = memory::peak_of(most, || is_accepted = (self.read)(bytes));
            Cost { bytes, most, is_accepted }
        });
        assert!(
            cost.bytes <= cost.most,
            "target '{}' took {} bytes for an input of {}, more than {}",
            self.name,
            cost.bytes,
            bytes.len(),
            cost.most
        );
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

    const BOUND: MemoryBound = MemoryBound { fixed: 100, per_byte: 10, per_decoded: 3, most: 1_000 };

    fn target(name: &'static str, decoded: fn(&[u8]) -> usize, read: fn(&[u8]) -> bool) -> Target {
        Target { name, memory: BOUND, decoded, read }
    }

    fn takes(bytes: usize) -> bool {
        !vec![0_u8; bytes].is_empty()
    }

    #[test]
    fn a_reader_within_its_bound_passes() {
        let cost = target("little", |_| 0, |bytes| takes(10 * bytes.len())).run(&[0; 50]);
        assert_eq!((cost.bytes, cost.most, cost.is_accepted), (500, 600, true));
        let cost = target("stated", |_| 100, |_| takes(800)).run(&[0; 50]);
        assert_eq!((cost.bytes, cost.most), (800, 900));
    }

    #[test]
    #[should_panic(expected = "target 'much' took 2000 bytes for an input of 50, more than 600")]
    fn a_reader_beyond_its_bound_fails() {
        _ = target("much", |_| 0, |bytes| takes(40 * bytes.len())).run(&[0; 50]);
    }

    #[test]
    #[should_panic(expected = "target 'long' took 2000 bytes for an input of 200, more than 1000")]
    fn a_reader_beyond_its_ceiling_fails() {
        _ = target("long", |_| 0, |bytes| takes(10 * bytes.len())).run(&[0; 200]);
    }

    #[test]
    fn names_of_targets_differ() {
        let names: std::collections::HashSet<_> = TARGETS.iter().map(|target| target.name).collect();
        assert_eq!(names.len(), TARGETS.len());
        assert!(names.iter().all(|name| Target::find(name).is_some_and(|found| found.name == *name)));
    }
}
