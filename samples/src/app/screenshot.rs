//! Pictures of what a window shows.

use std::path::{Path, PathBuf};

use lvk::{
    CommandBuffer, Context, Format, Holder, SwapchainImage, TextureDesc, TextureHandle, TextureRegion,
    TextureUsage,
};

use super::png;
use super::run_error::RunError;

/// The first name of the kind `hybrid_window_0001.png` that no file in `folder` has.
#[must_use]
pub fn free_name(folder: &Path, sample: &str) -> PathBuf {
    let mut names = (1..).map(|number: u32| folder.join(format!("{sample}_window_{number:04}.png")));
    names.find(|path| !path.exists()).unwrap_or_default()
}

/// A copy of what an image of a window holds, on its way.
pub struct Screenshot {
    copy: Holder<TextureHandle>,
    extent: [u32; 2],
    texels: Texels,
}

/// Memory layout of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Texels {
    /// A byte a channel, red first.
    RedFirst,
    /// A byte a channel, blue first.
    BlueFirst,
    /// Ten bits for red, green and blue, from the lowest on.
    TenBits,
}

impl Screenshot {
    /// Records the copy, after everything that is drawn.
    ///
    /// # Errors
    /// [`RunError::NoScreenshot`] of formats that no PNG is made of, and what Vulkan answers.
    pub fn record(ctx: &Context, cmd: &mut CommandBuffer, image: &SwapchainImage) -> Result<Self, RunError> {
        let (extent, format) = (image.extent(), image.format());
        let texels = Texels::from_format(format).ok_or(RunError::NoScreenshot { format })?;
        let copy = ctx.create_texture(&TextureDesc {
            format,
            extent,
            usage: TextureUsage::SAMPLED,
            debug_name: "screenshot",
            ..TextureDesc::default()
        })?;
        let region = TextureRegion::default();
        cmd.copy_texture(image.texture(), &region, *copy, &region)?;
        Ok(Self { copy, extent, texels })
    }

    /// Waits for the copy and writes it.
    ///
    /// # Errors
    /// [`RunError::Png`], and what Vulkan answers.
    pub fn write(&self, ctx: &Context, path: &Path) -> Result<(), RunError> {
        let mut pixels = ctx.download_texture(*self.copy, &TextureRegion::default())?;
        for pixel in pixels.as_chunks_mut().0 {
            *pixel = self.texels.rgba(*pixel);
        }
        png::remove_leftovers(path);
        Ok(png::write(path, self.extent[0], self.extent[1], &pixels)?)
    }
}

impl Texels {
    fn from_format(format: Format) -> Option<Self> {
        match format {
            Format::Rgba8Unorm | Format::Rgba8Srgb => Some(Self::RedFirst),
            Format::Bgra8Unorm | Format::Bgra8Srgb => Some(Self::BlueFirst),
            Format::Rgb10A2Unorm => Some(Self::TenBits),
            _ => None,
        }
    }

    /// Red, green and blue with 8 bits each, and nothing seen through it.
    fn rgba(self, texel: [u8; 4]) -> [u8; 4] {
        let [a, b, c, _] = texel;
        let [red, green, blue] = match self {
            Self::RedFirst => [a, b, c],
            Self::BlueFirst => [c, b, a],
            Self::TenBits => [0, 10, 20].map(|shift| eight_bits(u32::from_le_bytes(texel) >> shift)),
        };
        [red, green, blue, u8::MAX]
    }
}

/// The nearest of 8 bits to the lowest ten of `value`.
fn eight_bits(value: u32) -> u8 {
    (((value & 0x3ff) * 255 + 511) / 1023) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_picture_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let first = free_name(folder.path(), "hall");
        assert_eq!(first, folder.path().join("hall_window_0001.png"));
        std::fs::write(&first, "").unwrap();
        assert_eq!(free_name(folder.path(), "hall"), folder.path().join("hall_window_0002.png"));
    }

    #[test]
    fn channels_are_read_in_every_window_format_of_the_samples() {
        for format in [Format::Rgba8Unorm, Format::Rgba8Srgb] {
            assert_eq!(Texels::from_format(format).unwrap().rgba([1, 2, 3, 4]), [1, 2, 3, 255]);
        }
        for format in [Format::Bgra8Unorm, Format::Bgra8Srgb] {
            assert_eq!(Texels::from_format(format).unwrap().rgba([1, 2, 3, 4]), [3, 2, 1, 255]);
        }
        let packed = (1 << 30 | 1023 << 20 | 512 << 10 | 4_u32).to_le_bytes();
        assert_eq!(Texels::from_format(Format::Rgb10A2Unorm).unwrap().rgba(packed), [1, 128, 255, 255]);
    }

    #[test]
    fn ten_bits_become_the_nearest_eight() {
        for value in 0..1024_u32 {
            let exact = f64::from(value) * 255.0 / 1023.0;
            assert_eq!(f64::from(eight_bits(value)), exact.round(), "{value}");
        }
    }

    #[test]
    fn other_formats_are_refused_by_name() {
        assert_eq!(Texels::from_format(Format::Rgba16Float), None);
        let told = RunError::NoScreenshot { format: Format::Rgba16Float }.to_string();
        assert!(told.contains("Rgba16Float"), "{told}");
    }
}
