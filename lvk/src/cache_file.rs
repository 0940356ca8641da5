//! Cache files: their maximum size and checksums.

/// Maximum size of a cache in bytes. A larger one is not read.
pub(crate) const MAX_BYTES: u64 = 1 << 30;

/// Returns the 64-bit FNV-1a hash. It detects damage, but not tampering.
pub(crate) fn checksum(parts: &[&[u8]]) -> u64 {
    const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let bytes = parts.iter().copied().flatten();
    bytes.fold(BASIS, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(PRIME))
}

/// Returns a checksum, computed eight bytes at a time. It detects damage and different contents, but not
/// tampering.
pub(crate) fn fingerprint(bytes: &[u8], seed: u64) -> u64 {
    const PRIME: u64 = 0x9e37_79b9_7f4a_7c15;
    let mix = |sum: u64, word: u64| {
        let mixed = (sum ^ word).wrapping_mul(PRIME);
        mixed ^ mixed >> 29
    };
    let (words, rest) = bytes.as_chunks::<8>();
    let all = words.iter().fold(seed ^ bytes.len() as u64, |sum, word| mix(sum, u64::from_le_bytes(*word)));
    rest.iter().fold(all, |sum, byte| mix(sum, u64::from(*byte)))
}
