//! The push constants of a command buffer: pushed bytes, and the block that the bound pipeline declares.

use std::ops::Range;
use std::sync::Arc;

use crate::error::{Error, Result};

/// State of the push constants: the pushed bytes, and the block of the pipeline bound last.
#[derive(Debug)]
pub(super) struct PushConstants {
    /// A bit for each pushed 4-byte word. 64 bits suffice, as the layout has at most 256 bytes.
    pushed: u64,
    /// The pushed bytes, from which the library restores the ones that its kernels overwrote.
    bytes: [u8; Self::MAX_BYTES],
    expected_block: Option<(Arc<str>, u32)>,
    /// Numbers of bytes that count as the whole block of the pipeline bound last, with padding as far as the layout has
    /// it. Empty if the pipeline has no block.
    whole: Range<u32>,
}

impl Default for PushConstants {
    fn default() -> Self {
        Self { pushed: 0, bytes: [0; Self::MAX_BYTES], expected_block: None, whole: 0..0 }
    }
}

impl PushConstants {
    /// Most push constant bytes that a pipeline layout has.
    pub(super) const MAX_BYTES: usize = 256;

    /// Rust structs are padded to their alignment, while GLSL blocks end with their last member. 16 bytes is the
    /// largest alignment.
    const MAX_TAIL_PADDING: u32 = 16;

    /// Resets to the state with no bound pipeline and no pushed bytes.
    pub(super) fn clear(&mut self) {
        if self.pushed != 0 {
            self.pushed = 0;
            self.bytes = [0; Self::MAX_BYTES];
        }
        self.expected_block = None;
        self.whole = 0..0;
    }

    /// Records that a pipeline with a block of `expected` bytes was bound. Its layout has `layout_bytes`.
    pub(super) fn expect_block(&mut self, pipeline: &Arc<str>, expected: u32, layout_bytes: u32) {
        self.expected_block = Some((Arc::clone(pipeline), expected));
        let most = expected.next_multiple_of(Self::MAX_TAIL_PADDING).min(layout_bytes);
        self.whole = if expected > 0 { expected..most + 1 } else { 0..0 };
    }

    /// True if `size` bytes from the first on are the whole block of the last bound pipeline.
    #[inline]
    pub(super) fn is_whole(&self, size: u32) -> bool {
        self.whole.contains(&size) && size.is_multiple_of(4)
    }

    /// True if all these 4-byte words were pushed; see [`word_mask`].
    #[inline]
    pub(super) fn has_pushed(&self, needed: u64) -> bool {
        self.pushed & needed == needed
    }

    /// Returns the bytes up to the last pushed one; bytes that were not pushed are zero.
    pub(super) fn pushed_bytes(&self) -> &[u8] {
        let words = u64::BITS - self.pushed.leading_zeros();
        &self.bytes[..4 * words as usize]
    }

    #[inline]
    pub(super) fn store(&mut self, offset: u32, bytes: &[u8]) {
        let start = offset as usize;
        let Some(kept) = self.bytes.get_mut(start..start + bytes.len()) else { return };
        kept.copy_from_slice(bytes);
        // Written only if it changes, as a draw reads it right afterwards.
        let words = word_mask(offset, bytes.len() as u32);
        if self.pushed & words != words {
            self.pushed |= words;
        }
    }

    pub(super) fn check_range(&self, offset: u32, size: u32) -> Result<()> {
        let Some((pipeline, expected)) = &self.expected_block else {
            return Err(Error::usage("push_constants", "bind a pipeline first"));
        };
        let aligned = offset.is_multiple_of(4) && size.is_multiple_of(4) && size > 0;
        let end = offset.checked_add(size);
        let fits = end.is_some_and(|end| end <= expected.next_multiple_of(Self::MAX_TAIL_PADDING));
        if aligned && fits && *expected > 0 {
            return Ok(());
        }
        Err(Error::PushConstants { pipeline: pipeline.to_string(), expected: *expected, offset, size })
    }

    /// Fails if `bytes` are fewer than the bound pipeline's block.
    pub(super) fn check_whole(&self, bytes: usize) -> Result<()> {
        match &self.expected_block {
            Some((pipeline, expected)) if bytes < *expected as usize => {
                let size = bytes as u32;
                Err(Error::PushConstants {
                    pipeline: pipeline.to_string(),
                    expected: *expected,
                    offset: 0,
                    size,
                })
            }
            _ => Ok(()),
        }
    }

    /// Fails if the pipeline reads bytes that were never pushed.
    #[inline]
    pub(super) fn check_pushed(&self, pipeline: &str, expected: u32) -> Result<()> {
        if 4 * self.pushed.trailing_ones() >= expected {
            Ok(())
        } else {
            Err(self.missing_error(pipeline, expected))
        }
    }

    /// Returns the error that names the number of bytes the pipeline reads and of those that were pushed.
    #[cold]
    pub(super) fn missing_error(&self, pipeline: &str, expected: u32) -> Error {
        let pushed = 4 * (self.pushed & word_mask(0, expected)).count_ones();
        let message =
            format!("its shaders read {expected} bytes of push constants, but {pushed} were pushed");
        Error::usage(pipeline, message)
    }
}

/// Returns a bit for each 4-byte word of the `size` bytes from `offset` on. Both are multiples of 4.
#[inline]
pub(super) fn word_mask(offset: u32, size: u32) -> u64 {
    let below = |end: u32| u64::MAX.checked_shr(64_u32.saturating_sub(end / 4)).unwrap_or(0);
    below(offset.saturating_add(size)) & !below(offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bound(expected: u32) -> PushConstants {
        PushConstants { expected_block: Some(("p".into(), expected)), ..Default::default() }
    }

    #[test]
    fn a_push_must_match_the_block_up_to_padding() {
        assert!(bound(40).check_range(0, 40).is_ok());
        assert!(bound(40).check_range(0, 48).is_ok());
        assert!(bound(40).check_range(36, 4).is_ok());
        assert!(bound(40).check_range(0, 36).is_ok());
        assert!(matches!(bound(40).check_whole(36), Err(Error::PushConstants { expected: 40, .. })));
        assert!(bound(40).check_whole(40).is_ok());
        assert!(bound(40).check_range(0, 52).is_err());
        assert!(bound(40).check_range(48, 4).is_err());
        assert!(bound(40).check_range(0, 42).is_err());
        assert!(bound(40).check_range(u32::MAX - 3, 4).is_err());
        assert!(bound(0).check_range(0, 4).is_err());
        assert!(PushConstants::default().check_range(0, 4).is_err());
    }

    #[test]
    fn a_pipeline_does_not_run_without_its_push_constants() {
        let mut constants = PushConstants { pushed: word_mask(0, 16), ..Default::default() };
        assert!(constants.check_pushed("p", 16).is_ok());
        assert!(constants.check_pushed("p", 20).is_err());
        constants.pushed |= word_mask(20, 236);
        assert!(constants.check_pushed("p", 256).unwrap_err().to_string().contains("but 252 were"));
        constants.pushed |= word_mask(16, 4);
        assert!(constants.check_pushed("p", 256).is_ok());
    }
}
