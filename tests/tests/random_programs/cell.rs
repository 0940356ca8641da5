//! Bytes as the model knows them: the range in which each lies.

/// Range of one byte. A known byte has equal ends, a byte with unknown contents has the whole range.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// Least value.
    pub low: u8,
    /// Largest value.
    pub high: u8,
}

impl Cell {
    /// A byte that was never written.
    pub const UNKNOWN: Self = Self { low: 0, high: u8::MAX };

    /// Returns a known byte.
    pub fn known(byte: u8) -> Self {
        Self { low: byte, high: byte }
    }

    /// True if the byte may have this value.
    pub fn allows(self, byte: u8) -> bool {
        (self.low..=self.high).contains(&byte)
    }

    /// True if the value is known.
    pub fn is_known(self) -> bool {
        self.low == self.high
    }
}

impl std::fmt::Debug for Cell {
    /// Formats a known byte as such.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.is_known() {
            true => write!(out, "{:x}", self.low),
            false => write!(out, "{:x}-{:x}", self.low, self.high),
        }
    }
}

/// Returns known cells of these bytes.
pub fn known(bytes: &[u8]) -> Vec<Cell> {
    bytes.iter().copied().map(Cell::known).collect()
}

/// Compares bytes of the library with those of the model. The error names the first difference.
pub fn compare(what: &str, found: &[u8], expected: &[Cell]) -> Result<(), String> {
    if found.len() != expected.len() {
        return Err(format!("{what}: {} bytes, expected {}", found.len(), expected.len()));
    }
    let wrong = found.iter().zip(expected).position(|(byte, cell)| !cell.allows(*byte));
    match wrong {
        None => Ok(()),
        Some(at) => {
            let end = (at + 8).min(found.len());
            let (bytes, cells) = (&found[at..end], &expected[at..end]);
            Err(format!("{what}: from byte {at} of {} on {bytes:x?}, expected {cells:x?}", found.len()))
        }
    }
}

/// Returns bytes that are normal, positive floats at any offset: no conversion changes them, and none is a NaN.
pub fn pattern(seed: u16, count: usize) -> Vec<u8> {
    (0..count).map(|index| pattern_byte(seed, index)).collect()
}

/// Returns the byte of [`pattern`] at an index.
pub fn pattern_byte(seed: u16, index: usize) -> u8 {
    0x21 + ((usize::from(seed) + 7 * index) % 0x5d) as u8
}

#[test]
fn unknown_bytes_may_have_any_value_and_known_ones_only_theirs() {
    assert!(Cell::UNKNOWN.allows(0) && Cell::UNKNOWN.allows(255) && !Cell::UNKNOWN.is_known());
    let expected = [Cell::known(3), Cell::UNKNOWN, Cell { low: 4, high: 6 }];
    assert_eq!(compare("b", &[3, 99, 5], &expected), Ok(()));
    assert!(compare("b", &[3, 99, 7], &expected).unwrap_err().contains("from byte 2 of 3 on [7]"));
    assert!(compare("b", &[3, 99], &expected).unwrap_err().contains("2 bytes"));
}

#[test]
fn patterns_are_normal_floats_at_any_offset() {
    for seed in 0..200 {
        let bytes = pattern(seed, 64);
        for word in bytes.windows(4) {
            assert!(f32::from_le_bytes([word[0], word[1], word[2], word[3]]).is_normal());
        }
    }
}
