//! Copies, fills, clears, blits, resolves and mips.

mod blit;
mod buffer;
mod clear;
#[cfg(unix)]
mod external;
mod make_visible;
mod release_texture;
mod resolve;
mod texture;

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::pending_visibility::PendingVisibility;
use crate::barrier::Use;
use crate::error::Result;
use crate::resource::Texture;
use crate::resource::region::Region;

pub use buffer::BufferCopy;
pub use clear::ClearValue;

/// Layout of the source image of a copy.
const SOURCE_LAYOUT: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
/// Layout of the target image of a copy.
const TARGET_LAYOUT: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

impl CommandBuffer {
    /// Records the barriers for a command that reads one region and writes another.
    fn use_texture_pair(
        &mut self,
        source: &Arc<Texture>,
        from: &Region,
        target: &Arc<Texture>,
        to: &Region,
    ) -> Result<()> {
        self.state.accesses.clear();
        self.use_texture(source, from.subresources(), Use::transfer_read())?;
        if let Err(error) = self.use_texture(target, to.subresources(), Use::transfer_write()) {
            self.state.accesses.clear();
            return Err(error);
        }
        self.flush_barriers();
        Ok(())
    }

    /// Adds both textures to those that are made visible to shaders.
    fn make_pair_visible(&mut self, source: Arc<Texture>, target: Arc<Texture>) {
        self.state.pending_visibility.extend([source, target].map(PendingVisibility::Texture));
    }
}
