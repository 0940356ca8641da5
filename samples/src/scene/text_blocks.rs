//! Reads text block by block, so that a large file never lies in memory whole.

use std::io::{self, ErrorKind, Read};

use super::text_lines::{decoded, is_utf16, without_padding};

/// Bytes that are read at once.
const BLOCK: usize = 1 << 18;

/// Most bytes of a line end.
const LINE_END: usize = 3;

/// Text of a stream, as [`decoded`] returns that of a whole file. A file in UTF-16 is read whole.
pub(super) struct TextBlocks<R> {
    source: R,
    /// Text that was read and not consumed, and padding that may be followed by text.
    buffer: Vec<u8>,
    is_started: bool,
    /// True if the buffer holds the end of the text.
    is_ended: bool,
    /// Bytes that were consumed.
    pub consumed: u64,
}

impl<R: Read> TextBlocks<R> {
    pub fn new(source: R) -> Self {
        Self { source, buffer: Vec::new(), is_started: false, is_ended: false, consumed: 0 }
    }

    /// Returns the text that was read and not consumed.
    pub fn text(&self) -> &[u8] {
        without_padding(&self.buffer)
    }

    /// True if no text follows what [`text`](Self::text) returns.
    pub fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// Drops `count` bytes of the text.
    pub fn consume(&mut self, count: usize) {
        self.buffer.drain(..count);
        self.consumed += count as u64;
    }

    /// Reads on: at least as much as is there, so that a long line takes time in proportion to its length.
    ///
    /// # Errors
    /// Those of the stream, and [`ErrorKind::OutOfMemory`].
    pub fn read_on(&mut self) -> io::Result<()> {
        self.append(BLOCK.max(self.buffer.len()) as u64)?;
        if std::mem::replace(&mut self.is_started, true) {
            return Ok(());
        }
        if is_utf16(&self.buffer) {
            self.append(u64::MAX)?;
            self.buffer = decoded(&self.buffer).into_owned();
        } else if self.buffer.starts_with(b"\xef\xbb\xbf") {
            self.buffer.drain(..3);
        }
        Ok(())
    }

    fn append(&mut self, most: u64) -> io::Result<()> {
        if let Ok(most) = usize::try_from(most)
            && most < usize::MAX
        {
            self.buffer.try_reserve(most).map_err(|_| ErrorKind::OutOfMemory)?;
        }
        let read = self.source.by_ref().take(most).read_to_end(&mut self.buffer)?;
        self.is_ended = (read as u64) < most;
        Ok(())
    }

    /// Returns the place up to which a statement may reach: behind it at least one whole line follows, or the text ends. Whether
    /// a line is continued depends on the one behind it.
    pub fn complete_end(&self) -> usize {
        let text = self.text();
        if self.is_ended {
            return text.len();
        }
        let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
        let whole = &text[..text.len().saturating_sub(LINE_END)];
        let last = whole.iter().rposition(is_end).unwrap_or(0);
        whole[..last].iter().rposition(is_end).map_or(0, |end| end + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::text_lines::next_logical_line;
    use proptest::prelude::*;

    /// A stream that gives few bytes at once.
    struct Trickle<'a>(&'a [u8], usize);

    impl Read for Trickle<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = self.1.min(buffer.len()).min(self.0.len());
            buffer[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    type Statement = (Vec<u8>, usize, bool);

    fn statements_of_blocks(content: &[u8], most: u64) -> Vec<Statement> {
        let mut blocks = TextBlocks::new(content);
        let mut found = Vec::new();
        blocks.is_started = true;
        loop {
            blocks.append(most.max(blocks.buffer.len() as u64)).unwrap();
            let (text, end) = (blocks.text(), blocks.complete_end());
            let mut consumed = 0;
            while consumed < end {
                let (line, after) = next_logical_line(&text[consumed..]);
                if text.len() - after.len() > end {
                    break;
                }
                found.push((line.text.to_vec(), line.line_count, line.is_cut));
                consumed = text.len() - after.len();
            }
            blocks.consume(consumed);
            if blocks.is_ended() {
                return found;
            }
        }
    }

    fn statements_of_whole(content: &[u8]) -> Vec<Statement> {
        let mut rest = without_padding(content);
        let mut found = Vec::new();
        while !rest.is_empty() {
            let (line, after) = next_logical_line(rest);
            found.push((line.text.to_vec(), line.line_count, line.is_cut));
            rest = after;
        }
        found
    }

    proptest! {
        /// Wherever blocks end, the statements are those of the whole text.
        #[test]
        fn blocks_have_the_statements_of_the_whole(
            words in prop::collection::vec(
                prop::sample::select(&["f", "1", " ", "\\", "\n", "\r\n", "\r\r\n", "\r", "v", "#", "\0", "\x1a", "g"][..]),
                0..60
            ),
            most in 1..12_u64,
        ) {
            let content = words.concat();
            prop_assert_eq!(
                statements_of_blocks(content.as_bytes(), most),
                statements_of_whole(content.as_bytes())
            );
        }
    }

    #[test]
    fn encodings_and_padding_are_those_of_a_whole_file() {
        let utf16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        for content in [
            b"\xef\xbb\xbfv 1 2 3\n".to_vec(),
            b"v 1 2 3\n\0\0\x1a\0".to_vec(),
            [b"\xff\xfe".to_vec(), utf16("v \u{e9}\n")].concat(),
            utf16("v 1\nv 2\n"),
            Vec::new(),
            vec![0; 9],
        ] {
            let mut blocks = TextBlocks::new(Trickle(&content, 1));
            blocks.read_on().unwrap();
            assert!(blocks.is_ended());
            assert_eq!(blocks.text(), &*decoded(&content));
        }
    }

    #[test]
    fn a_long_line_is_read_in_growing_blocks() {
        let mut blocks = TextBlocks::new(io::repeat(b'v'));
        let mut lengths = Vec::new();
        for _ in 0..4 {
            blocks.read_on().unwrap();
            lengths.push(blocks.text().len());
            assert_eq!((blocks.complete_end(), blocks.is_ended()), (0, false));
        }
        assert_eq!(lengths, [BLOCK, 2 * BLOCK, 4 * BLOCK, 8 * BLOCK]);
    }
}
