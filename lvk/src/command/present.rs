//! The last command that uses a swapchain image.

use std::sync::Arc;

use super::CommandBuffer;
use crate::barrier::Use;
use crate::error::Result;
use crate::resource::Texture;

impl CommandBuffer {
    /// Transitions a swapchain image to the layout for presentation. No later command may use it.
    pub(crate) fn release_image(&mut self, texture: &Arc<Texture>) -> Result<()> {
        self.make_visible();
        self.use_texture(texture, texture.range, Use::present())?;
        self.flush_barriers();
        Ok(())
    }
}
