//! Limits of this process that the software driver does not survive.
//!
//! Mesa's software driver uses memory that it was refused, and ends the process by a signal while it creates a device. The memory
//! of its objects is files without names, to which the limit of file sizes applies.

use crate::error::DriverError;

/// Bytes of address space that the software driver needs beside its threads for the scene of `hybrid`, with a reserve: on two cores 1,500 MiB
/// were enough and 1,400 were not.
const ADDRESS_SPACE: u64 = 1536 << 20;
/// Bytes that a thread of the driver and one of the library need for each core, with a reserve: 16 of each took 450 MiB more than two.
const ADDRESS_SPACE_OF_THREAD: u64 = 64 << 20;
/// Bytes that the largest file may have, with a reserve: 128 MiB were enough, 64 MiB were not.
const FILE_SIZE: u64 = 256 << 20;

/// Refuses the software driver in a process whose address space or files are limited to less than it needs.
pub(crate) fn check() -> Result<(), DriverError> {
    // Other systems than Linux have no such file and no downloaded driver.
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    check_limits(&std::fs::read_to_string("/proc/self/limits").unwrap_or_default(), cores)
}

fn check_limits(limits: &str, cores: u64) -> Result<(), DriverError> {
    let needed = ADDRESS_SPACE + cores * ADDRESS_SPACE_OF_THREAD;
    if let Some(limit) = soft_limit(limits, "Max address space").filter(|limit| *limit < needed) {
        return Err(DriverError::AddressSpace { limit, needed });
    }
    if let Some(limit) = soft_limit(limits, "Max file size").filter(|limit| *limit < FILE_SIZE) {
        return Err(DriverError::FileSize { limit, needed: FILE_SIZE });
    }
    Ok(())
}

/// Returns the soft limit called `name` in bytes from the content of `/proc/self/limits`; `None` if there is no limit.
fn soft_limit(limits: &str, name: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(file_size: &str, address_space: &str) -> String {
        format!(
            "Limit                     Soft Limit           Hard Limit           Units\n\
             Max cpu time              7                    unlimited            seconds\n\
             Max file size             {file_size}   bytes\n\
             Max address space         {address_space}   bytes\n"
        )
    }

    #[test]
    fn the_soft_limit_is_the_first_number_of_its_line() {
        let of = |value: &str| soft_limit(&limits("unlimited unlimited", value), "Max address space");
        assert_eq!(of("471859200            unlimited"), Some(471_859_200));
        assert_eq!(of("unlimited            unlimited"), None);
        assert_eq!(soft_limit("", "Max address space"), None);
    }

    #[test]
    fn limits_below_the_needs_are_refused() {
        let of = |file_size: u64, address_space: u64| {
            check_limits(&limits(&file_size.to_string(), &address_space.to_string()), 2)
        };
        let needed = ADDRESS_SPACE + 2 * ADDRESS_SPACE_OF_THREAD;
        assert!(of(FILE_SIZE, needed).is_ok());
        assert!(matches!(of(FILE_SIZE, needed - 1), Err(DriverError::AddressSpace { .. })), "two cores");
        let of_many = check_limits(&limits("unlimited", &needed.to_string()), 8);
        assert!(matches!(of_many, Err(DriverError::AddressSpace { .. })), "more threads need more");
        assert!(matches!(of(512, u64::MAX), Err(DriverError::FileSize { limit: 512, .. })));
        assert!(matches!(of(u64::MAX, 1 << 29), Err(DriverError::AddressSpace { .. })));
        assert!(check_limits("", 8).is_ok());
    }
}
