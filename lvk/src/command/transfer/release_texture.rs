//! Gives textures to others in the layout they want.

use ash::vk;

use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::handle::TextureHandle;
use crate::submit::emit_barriers::layout_from_vulkan;
use crate::submit::ownership::QueueAccess;

impl CommandBuffer {
    /// Brings all of a texture into a layout that others want it in, after everything recorded so far
    /// (`vkCmdPipelineBarrier2`). The layouts are those of [`ImportedTexture::layout`](crate::ImportedTexture), without
    /// `UNDEFINED`.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for another layout.
    pub fn release_texture(&mut self, texture: TextureHandle, layout: vk::ImageLayout) -> Result<()> {
        let texture = self.shared.store.textures.get(texture)?;
        let known = layout_from_vulkan(layout).map_err(|why| Error::usage(&texture.name, why))?;
        if layout == vk::ImageLayout::UNDEFINED {
            return Err(Error::usage(&texture.name, "a texture cannot be released in the layout UNDEFINED"));
        }
        // What copies touched is otherwise made readable by shaders later.
        self.make_visible();
        self.use_texture(&texture, texture.range, Use::transfer_read().with_layout(known))?;
        self.flush_barriers();
        // Others may write it, so it waits for those who read it on other queues.
        self.reference_resource(texture.image.id, QueueAccess::Write);
        Ok(())
    }
}
