//! Properties that must be equal in a graphics pipeline and the passes that use it.

use std::fmt;

use crate::format::Format;

/// Formats, samples and views of targets. Plain data, because it is compared at each bind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct RenderingFormats {
    /// Formats of the colour targets, without gaps.
    colors: [Option<Format>; Self::MAX_COLORS],
    pub(crate) depth: Option<Format>,
    /// Samples per pixel.
    pub(crate) samples: u32,
    /// Bit mask of the views of a draw; 0 without multiview.
    pub(crate) view_mask: u32,
}

impl RenderingFormats {
    /// Upper limit of [`Limits::max_color_targets`](crate::Limits::max_color_targets).
    pub(crate) const MAX_COLORS: usize = 8;

    /// Creates the formats. Colours beyond [`MAX_COLORS`](Self::MAX_COLORS) are ignored, since pipelines and passes
    /// have checked the count.
    pub(crate) fn new(
        colors: impl IntoIterator<Item = Format>,
        depth: Option<Format>,
        samples: u32,
        view_mask: u32,
    ) -> Self {
        let mut shape = Self { depth, samples, view_mask, ..Self::default() };
        for (place, format) in shape.colors.iter_mut().zip(colors) {
            *place = Some(format);
        }
        shape
    }
}

impl fmt::Display for RenderingFormats {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let colors: Vec<Format> = self.colors.iter().flatten().copied().collect();
        write!(out, "{colors:?} and depth {:?}", self.depth)?;
        if self.samples != 1 {
            write!(out, " with {} samples a pixel", self.samples)?;
        }
        if self.view_mask != 0 {
            write!(out, " with the views {:#b}", self.view_mask)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_differ_in_each_part_and_say_so() {
        let (color, depth) = (Format::Rgba8Unorm, Format::D32Float);
        let plain = RenderingFormats::new([color], Some(depth), 1, 0);
        assert_eq!(plain, RenderingFormats::new([color], Some(depth), 1, 0));
        for (other, text) in [
            (
                RenderingFormats::new([color, color], Some(depth), 1, 0),
                "[Rgba8Unorm, Rgba8Unorm] and depth Some(D32Float)",
            ),
            (RenderingFormats::new([], Some(depth), 1, 0), "[] and depth Some(D32Float)"),
            (RenderingFormats::new([color], None, 1, 0), "[Rgba8Unorm] and depth None"),
            (
                RenderingFormats::new([color], None, 4, 5),
                "[Rgba8Unorm] and depth None with 4 samples a pixel with the views 0b101",
            ),
        ] {
            assert_ne!(plain, other);
            assert_eq!(other.to_string(), text);
        }
    }
}
