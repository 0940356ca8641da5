//! Clears of textures.

use ash::vk;

use super::TARGET_LAYOUT;
use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::command::pending_visibility::PendingVisibility;
use crate::error::{Error, Result};
use crate::format::NumericFormat;
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::region::TextureRange;

/// The value that fills a texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClearValue {
    /// A colour, for formats that shaders read as floats.
    Color([f32; 4]),
    /// Unsigned integers, for unsigned integer formats.
    Uint([u32; 4]),
    /// Signed integers, for signed integer formats.
    Sint([i32; 4]),
    /// A depth from 0 to 1; leaves the stencil unchanged.
    Depth(f32),
    /// A stencil value from 0 to 255; leaves the depth unchanged.
    Stencil(u32),
    /// Depth and stencil.
    DepthStencil(f32, u32),
}

impl CommandBuffer {
    /// Fills mips and layers of a texture, all slices of volumes, with one value (`vkCmdClearColorImage`,
    /// `vkCmdClearDepthStencilImage`). If the texture is a view, a colour is encoded in the format of the viewed
    /// texture.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for mips and layers that do not exist, for values that the format does not
    /// hold or that are out of range, and for compressed formats; [`WrongQueue`](Error::WrongQueue) on the transfer
    /// queue, and for depth and stencil on queues other than the graphics queue.
    pub fn clear_texture(
        &mut self,
        texture: TextureHandle,
        value: ClearValue,
        range: &TextureRange,
    ) -> Result<()> {
        let texture = self.shared.store.textures.get(texture)?;
        let part = texture.resolve_range(range)?;
        let aspects = check_value(&texture, value)?;
        if aspects == vk::ImageAspectFlags::COLOR {
            self.needs_compute("a clear of a texture")?;
        } else {
            self.needs_graphics("a clear of depth or stencil")?;
        }
        self.use_texture(&texture, part, Use::transfer_write())?;
        self.flush_barriers();
        let range =
            vk::ImageSubresourceRange { aspect_mask: aspects, ..texture.image.barrier_image().range(part) };
        let (device, image) = (&self.shared.gpu.device, texture.image.raw);
        // SAFETY: the range lies inside the image, whose format holds such a value.
        unsafe {
            match raw_value(value) {
                RawClearValue::Color(color) => {
                    device.cmd_clear_color_image(self.raw(), image, TARGET_LAYOUT, &color, &[range])
                }
                RawClearValue::DepthStencil(value) => {
                    device.cmd_clear_depth_stencil_image(self.raw(), image, TARGET_LAYOUT, &value, &[range]);
                }
            }
        }
        self.state.pending_visibility.push(PendingVisibility::Texture(texture));
        Ok(())
    }
}

enum RawClearValue {
    Color(vk::ClearColorValue),
    DepthStencil(vk::ClearDepthStencilValue),
}

fn raw_value(value: ClearValue) -> RawClearValue {
    let depth_stencil =
        |depth, stencil| RawClearValue::DepthStencil(vk::ClearDepthStencilValue { depth, stencil });
    match value {
        ClearValue::Color(float32) => RawClearValue::Color(vk::ClearColorValue { float32 }),
        ClearValue::Uint(uint32) => RawClearValue::Color(vk::ClearColorValue { uint32 }),
        ClearValue::Sint(int32) => RawClearValue::Color(vk::ClearColorValue { int32 }),
        ClearValue::Depth(depth) => depth_stencil(depth, 0),
        ClearValue::Stencil(stencil) => depth_stencil(0.0, stencil),
        ClearValue::DepthStencil(depth, stencil) => depth_stencil(depth, stencil),
    }
}

/// Returns the aspects that the value fills. Fails if the texture lacks them, or if the value is out of range or of
/// another kind.
fn check_value(texture: &Texture, value: ClearValue) -> Result<vk::ImageAspectFlags> {
    use vk::ImageAspectFlags as Aspects;
    let format = texture.image.format;
    let wrong = |why: &str| {
        Err(Error::usage(&texture.name, format!("{format:?} cannot be cleared to {value:?}: {why}")))
    };
    let (wanted, numbers) = match value {
        ClearValue::Color(_) => (Aspects::COLOR, Some(NumericFormat::Float)),
        ClearValue::Uint(_) => (Aspects::COLOR, Some(NumericFormat::Uint)),
        ClearValue::Sint(_) => (Aspects::COLOR, Some(NumericFormat::Sint)),
        ClearValue::Depth(_) => (Aspects::DEPTH, None),
        ClearValue::Stencil(_) => (Aspects::STENCIL, None),
        ClearValue::DepthStencil(..) => (Aspects::DEPTH | Aspects::STENCIL, None),
    };
    let (depth, stencil) = match raw_value(value) {
        RawClearValue::Color(_) => (0.0, 0),
        RawClearValue::DepthStencil(value) => (value.depth, value.stencil),
    };
    if !texture.view_aspects().contains(wanted) {
        return wrong("the texture lacks the aspect");
    }
    if format.is_compressed() || format.is_yuv() {
        return wrong("its texels can only be copied");
    }
    if numbers.is_some_and(|numbers| numbers != format.numeric_format()) {
        return wrong("the numeric formats differ");
    }
    if !(0.0..=1.0).contains(&depth) || stencil > 0xFF {
        return wrong("depths are from 0 to 1, stencil values from 0 to 255");
    }
    Ok(wanted)
}
