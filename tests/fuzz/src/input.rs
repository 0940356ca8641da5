//! Inputs that consist of several parts: choices first, bytes behind them.

/// Reads choices from the front of an input. An input that has ended gives zeros.
pub(crate) struct Input<'a> {
    rest: &'a [u8],
}

impl<'a> Input<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Takes a byte.
    pub(crate) fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.rest.split_first() else { return 0 };
        self.rest = rest;
        *first
    }

    /// Takes a number of two bytes, little-endian.
    pub(crate) fn short(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Returns what is left.
    pub(crate) fn rest(self) -> &'a [u8] {
        self.rest
    }

    /// Returns what is left as little-endian words. Bytes of an incomplete word are left out.
    pub(crate) fn words(self) -> Vec<u32> {
        self.rest.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
    }
}
