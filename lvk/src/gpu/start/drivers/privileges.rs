//! Tells whether the process has privileges that the user who started it lacks, as a set-user-ID program has.

/// True if the process has more privileges than its user. The Vulkan loader then ignores the variables of the environment
/// (`secure_getenv`), which the user has set: libraries that they name would be run with those privileges.
pub(super) fn exceed_the_users() -> bool {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    return is_secure(std::fs::read("/proc/self/auxv"));
    #[cfg(target_vendor = "apple")]
    return {
        unsafe extern "C" {
            safe fn issetugid() -> std::ffi::c_int;
        }
        issetugid() != 0
    };
    #[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
    return false;
}

/// Returns `AT_SECURE` of an auxiliary vector: pairs of words, a type and a value. The kernel lets a process whose privileges
/// it has raised read no such file, unless it is root.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn is_secure(vector: std::io::Result<Vec<u8>>) -> bool {
    const WORD: usize = size_of::<usize>();
    const AT_SECURE: usize = 23;
    let bytes = match vector {
        Ok(bytes) => bytes,
        Err(error) => return error.kind() == std::io::ErrorKind::PermissionDenied,
    };
    let (words, _) = bytes.as_chunks::<WORD>();
    let (pairs, _) = words.as_chunks::<2>();
    let value = |pair: &[[u8; WORD]; 2]| {
        let [kind, value] = pair.map(usize::from_ne_bytes);
        (kind == AT_SECURE).then_some(value)
    };
    pairs.iter().find_map(value).is_some_and(|value| value != 0)
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use std::io::{Error, ErrorKind};

    use super::*;

    fn vector(pairs: &[[usize; 2]]) -> std::io::Result<Vec<u8>> {
        Ok(pairs.iter().flatten().flat_map(|word| word.to_ne_bytes()).collect())
    }

    #[test]
    fn the_kernel_says_which_programs_have_raised_privileges() {
        assert!(is_secure(vector(&[[6, 4096], [23, 1], [0, 0]])));
        assert!(!is_secure(vector(&[[6, 23], [23, 0], [0, 0]])));
        assert!(!is_secure(vector(&[])));
        assert!(!is_secure(Ok(vec![1; 5])));
        assert!(is_secure(Err(Error::from(ErrorKind::PermissionDenied))));
        assert!(!is_secure(Err(Error::from(ErrorKind::NotFound))), "a system without /proc");
    }

    #[test]
    fn a_test_has_the_privileges_of_its_user() {
        assert!(!exceed_the_users());
        assert!(!std::fs::read("/proc/self/auxv").unwrap().is_empty());
    }
}
