//! The configuration of the sample: size, format and conversion.

use clap::ValueEnum;
use lvk::{Format, YuvConversion};

/// The memory layout of an image's planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum YuvFormat {
    /// One plane of Y, one of both colour differences, 8 bits.
    Nv12,
    /// Three planes, 8 bits.
    I420,
    /// One plane of Y, one of both colour differences, 10 bits.
    P010,
    /// Three planes, 10 bits.
    I010,
}

/// The matrix between Y'CbCr and colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum YuvModel {
    /// Matrix of standard definition.
    Bt601,
    /// Matrix of high definition.
    Bt709,
    /// Matrix of ultra high definition.
    Bt2020,
}

/// The range of numbers from black to white.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum YuvRange {
    /// 16 to 235, as broadcast.
    Narrow,
    /// 0 to 255.
    Full,
}

/// All conversions of the sample: what its context is made with ([`lvk::ContextDesc::yuv`]).
pub const CONVERSIONS: [YuvConversion; 24] = {
    let mut all = [YuvConversion::new(Format::Nv12); 24];
    let mut number = 0;
    while number < all.len() {
        all[number].format = YuvFormat::ALL[number / 6].raw();
        all[number].model = YuvModel::ALL[number / 2 % 3].raw();
        all[number].range =
            if number.is_multiple_of(2) { lvk::YuvRange::Narrow } else { lvk::YuvRange::Full };
        number += 1;
    }
    all
};

/// The configuration of the sample. Numbers out of range count as the nearest number in range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YuvConfig {
    /// Pixels in a row, and rows, of what is rendered.
    pub extent: [u32; 2],
    /// Those of the moving picture: even, 2 to 4096.
    pub video_size: [u32; 2],
    /// The memory layout of its planes; `None` for the first that the device supports.
    pub format: Option<YuvFormat>,
    /// The matrix.
    pub model: YuvModel,
    /// The range of numbers from black to white.
    pub range: YuvRange,
    /// True if its planes are shown too.
    pub shows_planes: bool,
}

impl YuvConfig {
    /// As usual but for the size.
    #[must_use]
    pub fn new(extent: [u32; 2]) -> Self {
        let (model, range) = (YuvModel::Bt709, YuvRange::Narrow);
        Self { extent, video_size: [640, 360], format: None, model, range, shows_planes: false }
    }

    /// Clamps every number to its range.
    pub(super) fn clamped(self) -> Self {
        Self { video_size: self.video_size.map(|side| side.clamp(2, 4096) & !1), ..self }
    }
}

impl YuvFormat {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Nv12, Self::I420, Self::P010, Self::I010];

    /// The library's name.
    #[must_use]
    pub const fn raw(self) -> Format {
        match self {
            Self::Nv12 => Format::Nv12,
            Self::I420 => Format::Yuv420p8,
            Self::P010 => Format::P010,
            Self::I010 => Format::Yuv420p10,
        }
    }

    /// Bits of a number.
    #[must_use]
    pub const fn bits(self) -> u32 {
        if matches!(self, Self::Nv12 | Self::I420) { 8 } else { 10 }
    }

    /// True if both colour differences share a plane.
    #[must_use]
    pub const fn has_two_planes(self) -> bool {
        matches!(self, Self::Nv12 | Self::P010)
    }
}

impl YuvModel {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Bt601, Self::Bt709, Self::Bt2020];

    const fn raw(self) -> lvk::YuvModel {
        match self {
            Self::Bt601 => lvk::YuvModel::Bt601,
            Self::Bt709 => lvk::YuvModel::Bt709,
            Self::Bt2020 => lvk::YuvModel::Bt2020,
        }
    }

    /// Shares of red and blue in Y.
    pub(super) fn weights(self) -> [f32; 2] {
        match self {
            Self::Bt601 => [0.299, 0.114],
            Self::Bt709 => [0.2126, 0.0722],
            Self::Bt2020 => [0.2627, 0.0593],
        }
    }
}

/// Place in [`CONVERSIONS`].
pub(super) fn conversion(format: YuvFormat, model: YuvModel, range: YuvRange) -> usize {
    (format as usize * 3 + model as usize) * 2 + range as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversions_are_where_they_are_looked_for() {
        for format in YuvFormat::ALL {
            for model in YuvModel::ALL {
                for (range, raw) in
                    [(YuvRange::Narrow, lvk::YuvRange::Narrow), (YuvRange::Full, lvk::YuvRange::Full)]
                {
                    let found = CONVERSIONS[conversion(format, model, range)];
                    assert_eq!((found.format, found.model, found.range), (format.raw(), model.raw(), raw));
                }
            }
        }
    }

    #[test]
    fn sizes_of_videos_are_even() {
        let video_size = |video_size| YuvConfig { video_size, ..YuvConfig::new([8, 8]) }.clamped().video_size;
        assert_eq!(video_size([0, 7]), [2, 6]);
        assert_eq!(video_size([u32::MAX, 360]), [4096, 360]);
    }
}
