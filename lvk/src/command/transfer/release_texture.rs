//! Releases textures to another engine in a given layout.

use std::sync::Arc;

use ash::vk;

use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::submit::exchanged_layout::exchanged_layout;
use crate::submit::last_access::QueueAccess;

impl CommandBuffer {
    /// Transitions a whole texture to the layout that another engine expects, after everything recorded so far
    /// (`vkCmdPipelineBarrier2`). The layouts are those of [`ImportedTexture::layout`](crate::ImportedTexture), without
    /// `UNDEFINED`.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for any other layout, and for one that the format or the usage of the
    /// texture rules out.
    pub fn release_texture(&mut self, texture: TextureHandle, layout: vk::ImageLayout) -> Result<()> {
        let texture = self.shared.store.textures.get(texture)?;
        self.release_texture_object(&texture, layout)
    }

    /// As [`release_texture`](Self::release_texture).
    pub(super) fn release_texture_object(
        &mut self,
        texture: &Arc<Texture>,
        layout: vk::ImageLayout,
    ) -> Result<()> {
        let image = &texture.image;
        let known = exchanged_layout(layout, image.format, image.usage)
            .map_err(|why| Error::usage(&texture.name, why))?;
        if layout == vk::ImageLayout::UNDEFINED {
            return Err(Error::usage(&texture.name, "a texture cannot be released in the layout UNDEFINED"));
        }
        // Otherwise the end of the recording would transition a texture that a copy used to its default layout.
        self.make_visible();
        self.use_texture(texture, texture.range, Use::transfer_read().with_layout(known))?;
        self.flush_barriers();
        // The other engine may write the texture, so it waits for reads on other queues.
        self.reference_resource(texture.image.id, QueueAccess::Write);
        Ok(())
    }
}
