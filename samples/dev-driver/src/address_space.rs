//! The limit of this process's address space, which the software driver does not survive.
//!
//! Mesa's software driver uses memory that it was refused, and ends the process by a signal while it creates a device.

use crate::error::DriverError;

/// Bytes of address space that the software driver needs for a small scene, with a reserve: 900 MiB were enough.
const NEEDED: u64 = 1 << 30;

/// Refuses the software driver in a process whose address space is limited to less than it needs.
pub(crate) fn check() -> Result<(), DriverError> {
    // Other systems than Linux have no such file and no downloaded driver.
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    match soft_limit(&limits) {
        Some(limit) if limit < NEEDED => Err(DriverError::AddressSpace { limit, needed: NEEDED }),
        _ => Ok(()),
    }
}

/// Returns the soft limit in bytes from the content of `/proc/self/limits`; `None` if there is no limit.
fn soft_limit(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_soft_limit_is_the_first_number_of_its_line() {
        let of = |value: &str| {
            let head = "Limit                     Soft Limit           Hard Limit           Units\n";
            soft_limit(&format!(
                "{head}Max cpu time              7   unlimited   seconds\nMax address space         {value}   bytes\n"
            ))
        };
        assert_eq!(of("471859200            unlimited"), Some(471_859_200));
        assert_eq!(of("unlimited            unlimited"), None);
        assert_eq!(soft_limit(""), None);
    }
}
