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
    format: Format,
}

impl Screenshot {
    /// Records the copy, after everything that is drawn.
    ///
    /// # Errors
    /// What Vulkan answers.
    pub fn record(ctx: &Context, cmd: &mut CommandBuffer, image: &SwapchainImage) -> lvk::Result<Self> {
        let (extent, format) = (image.extent(), image.format());
        let copy = ctx.create_texture(&TextureDesc {
            format,
            extent,
            usage: TextureUsage::SAMPLED,
            debug_name: "screenshot",
            ..TextureDesc::default()
        })?;
        let region = TextureRegion::default();
        cmd.copy_texture(image.texture(), &region, *copy, &region)?;
        Ok(Self { copy, extent, format })
    }

    /// Waits for the copy and writes it.
    ///
    /// # Errors
    /// [`RunError::Png`], and what Vulkan answers.
    pub fn write(&self, ctx: &Context, path: &Path) -> Result<(), RunError> {
        let mut pixels = ctx.download_texture(*self.copy, &TextureRegion::default())?;
        let is_blue_first = matches!(self.format, Format::Bgra8Unorm | Format::Bgra8Srgb);
        for pixel in pixels.chunks_exact_mut(4) {
            if is_blue_first {
                pixel.swap(0, 2);
            }
            pixel[3] = u8::MAX;
        }
        Ok(png::write(path, self.extent[0], self.extent[1], &pixels)?)
    }
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
}
