//! Resident memory of this process, by `/proc`.

use std::path::Path;

const STATUS: &str = "/proc/self/status";

/// True if the system tells the memory of a process.
pub(super) fn is_known() -> bool {
    Path::new(STATUS).exists()
}

/// Makes the peak the present value, where the system allows it. At the start of a process both are nearly equal.
pub(super) fn reset_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Returns the resident bytes now, and their peak; `None` where the system does not tell.
pub(super) fn resident_and_peak() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string(STATUS).ok()?;
    Some([bytes_of(&status, "VmRSS:")?, bytes_of(&status, "VmHWM:")?])
}

/// Returns the bytes of an entry in kibibytes.
fn bytes_of(status: &str, name: &str) -> Option<u64> {
    let line = status.lines().find(|line| line.starts_with(name))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_kibibytes() {
        let status = "Name:\tbench\nVmHWM:\t    2048 kB\nVmRSS:\t     3 kB\n";
        assert_eq!(bytes_of(status, "VmHWM:"), Some(2 << 20));
        assert_eq!(bytes_of(status, "VmRSS:"), Some(3072));
        assert_eq!(bytes_of(status, "VmSwap:"), None);
        assert_eq!(bytes_of("VmRSS:", "VmRSS:"), None);
    }
}
