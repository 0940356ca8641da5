//! The last command of a picture.

use std::sync::Arc;

use super::CommandBuffer;
use crate::barrier::Use;
use crate::error::Result;
use crate::resource::Texture;

impl CommandBuffer {
    /// Readies an image of a swapchain for the presentation engine. Nothing may use it afterwards.
    pub(crate) fn release_image(&mut self, texture: &Arc<Texture>) -> Result<()> {
        self.make_visible();
        self.use_texture(texture, texture.range, Use::present())?;
        self.flush_barriers();
        Ok(())
    }
}
