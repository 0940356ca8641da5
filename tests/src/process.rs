//! Counts of the test's own process: memory, file descriptors, threads.

/// Returns the bytes on the heap of the process, the driver's included; `None` where the C library does not report
/// them as glibc does.
#[must_use]
pub fn heap_bytes() -> Option<i64> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: no preconditions; it locks each arena while it counts.
        let heap = unsafe { libc::mallinfo2() };
        Some(heap.uordblks as i64 + heap.hblkhd as i64)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    None
}

/// Returns the resident bytes of the process; `None` on systems that do not report them as Linux does.
#[must_use]
pub fn resident_bytes() -> Option<i64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(1024 * line.split_whitespace().nth(1)?.parse::<i64>().ok()?)
}

/// Returns the number of open file descriptors, without the one that reads the list; `None` on systems that do not
/// list them as Linux does.
#[must_use]
pub fn file_descriptor_count() -> Option<i64> {
    Some(std::fs::read_dir("/proc/self/fd").ok()?.count() as i64 - 1)
}

/// Returns the names of all threads; `None` on systems that do not list them as Linux does.
#[must_use]
pub fn thread_names() -> Option<Vec<String>> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    // A thread may end before its name is read.
    let name = |thread: std::io::Result<std::fs::DirEntry>| {
        std::fs::read_to_string(thread.ok()?.path().join("comm")).ok()
    };
    Some(threads.filter_map(name).map(|name| name.trim_end().to_owned()).collect())
}
