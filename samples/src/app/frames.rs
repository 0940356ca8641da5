//! The frames to render.

use std::ops::Range;
use std::str::FromStr;

/// The frames to render.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Frames {
    /// Frame 0, rendered this many times to time it.
    Still(u32),
    /// The frames from the first number to before the last one, each once.
    Sequence(Range<u32>),
}

impl Frames {
    /// Most frames at a time.
    pub const MAX_COUNT: u32 = 1_000_000;

    /// Number of frames.
    #[must_use]
    pub fn count(&self) -> u32 {
        match self {
            Self::Still(count) => *count,
            Self::Sequence(range) => range.end.saturating_sub(range.start),
        }
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number =
            |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is no number of a frame"));
        let frames = match text.split_once("..") {
            None => Self::Still(number(text)?),
            Some((start, end)) => Self::Sequence(number(start)?..number(end)?),
        };
        let count = match &frames {
            Self::Still(count) => i64::from(*count),
            Self::Sequence(range) => i64::from(range.end) - i64::from(range.start),
        };
        match count {
            1..=1_000_000 => Ok(frames),
            ..=0 => Err("no frame at all: give a number, or FIRST..END with END after FIRST".to_owned()),
            _ => Err(format!("at most {} frames at a time", Self::MAX_COUNT)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_still_and_a_range_a_sequence() {
        assert_eq!("60".parse(), Ok(Frames::Still(60)));
        assert_eq!("0..240".parse(), Ok(Frames::Sequence(0..240)));
        assert_eq!("120..121".parse::<Frames>().map(|frames| frames.count()), Ok(1));
    }

    #[test]
    fn nothing_and_nonsense_are_refused() {
        for text in
            ["0", "", "-1", "3..3", "4..3", "0..", "..5", "a..b", "0..1000001", "1000001", "0..4294967296"]
        {
            assert!(text.parse::<Frames>().is_err(), "{text}");
        }
        assert!("0..1000000".parse::<Frames>().is_ok());
    }
}
