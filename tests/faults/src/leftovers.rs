//! What a process holds beside Vulkan objects: file descriptors, threads and memory of the heap.

use std::fmt;
use std::fs;
use std::io;
use std::time::{Duration, Instant};

/// Bytes of the heap that a run may hold beyond a run without a fault: texts of errors and tables of the standard library that grow.
const HEAP_SLACK: usize = 4096;
/// Longest time in which threads that have ended disappear from the system's list.
const PATIENCE: Duration = Duration::from_millis(200);

/// What a process holds when everything of a scenario has been dropped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Leftovers {
    /// Open file descriptors.
    pub file_descriptors: usize,
    /// Threads.
    pub threads: usize,
    /// Bytes that the program has allocated and not freed, without those of the driver.
    pub heap_bytes: usize,
}

impl Leftovers {
    /// Counts what this process holds, by the system's lists. `heap_bytes` comes from the program's allocator.
    ///
    /// # Errors
    /// Those of the folder `/proc/self`.
    pub fn of_process(heap_bytes: usize) -> io::Result<Self> {
        let count = |folder| fs::read_dir(folder).map(Iterator::count);
        let start = Instant::now();
        while count("/proc/self/task")? > 1 && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(Self { file_descriptors: count("/proc/self/fd")?, threads: count("/proc/self/task")?, heap_bytes })
    }

    /// Reads the words of the text that `Display` writes. `None` if one is missing.
    pub(crate) fn parse<'a>(words: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        let value = |name: &str| {
            let mut pairs = words.clone().filter_map(|word| word.split_once('='));
            pairs.find(|(found, _)| *found == name)?.1.parse().ok()
        };
        Some(Self {
            file_descriptors: value("files")?,
            threads: value("threads")?,
            heap_bytes: value("heap")?,
        })
    }

    /// Says what this process holds beyond `other`; `None` if nothing.
    #[must_use]
    pub fn beyond(&self, other: &Self) -> Option<String> {
        let more = [
            (self.file_descriptors.saturating_sub(other.file_descriptors), 0, "file descriptors"),
            (self.threads.saturating_sub(other.threads), 0, "threads"),
            (self.heap_bytes.saturating_sub(other.heap_bytes), HEAP_SLACK, "bytes of the heap"),
        ];
        let texts = more.into_iter().filter(|(more, slack, _)| more > slack);
        let texts: Vec<_> = texts.map(|(more, _, what)| format!("{more} {what}")).collect();
        (!texts.is_empty()).then(|| texts.join(", "))
    }
}

impl fmt::Display for Leftovers {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file_descriptors, threads, heap_bytes } = self;
        write!(out, "files={file_descriptors} threads={threads} heap={heap_bytes}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_of_anything_is_told() {
        let clean = Leftovers { file_descriptors: 4, threads: 1, heap_bytes: 100 };
        assert_eq!(clean.beyond(&clean), None);
        let fewer = Leftovers { file_descriptors: 3, threads: 0, heap_bytes: 0 };
        assert_eq!(fewer.beyond(&clean), None);
        let more = Leftovers { file_descriptors: 6, threads: 2, heap_bytes: 101 + HEAP_SLACK };
        let told = "2 file descriptors, 1 threads, 4097 bytes of the heap";
        assert_eq!(more.beyond(&clean).as_deref(), Some(told));
    }

    #[test]
    fn open_files_are_counted() -> io::Result<()> {
        let before = Leftovers::of_process(0)?;
        let kept: Vec<_> = (0..100).map(|_| fs::File::open("/dev/null")).collect::<Result<_, _>>()?;
        let after = Leftovers::of_process(7)?;
        assert!(after.file_descriptors > before.file_descriptors + 50 && after.heap_bytes == 7, "{after}");
        drop(kept);
        Ok(())
    }
}
