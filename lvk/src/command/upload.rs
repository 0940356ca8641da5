//! Records pending uploads as copies.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use super::pending_visibility::PendingVisibility;
use crate::barrier::Use;
use crate::device_state::DeferredObject;
use crate::error::Result;
use crate::upload::PendingUploads;
use crate::upload::copy_regions::CopyRegion;
use crate::upload::pending::{BufferUploads, TextureUpload, UsedPage, write_round_ends};

impl CommandBuffer {
    /// Records pending uploads: buffers with one barrier for all and one copy for each page of each, textures with one
    /// barrier for all that do not write the same texels.
    pub(crate) fn record_uploads(&mut self, uploads: PendingUploads) -> Result<()> {
        let PendingUploads { buffers, textures, pages, .. } = uploads;
        for used in &pages {
            self.shared.staging.mark_used(used.page, used.count, self.recording.staging_key());
        }
        self.record_buffer_uploads(buffers, &pages);
        let part = |upload: &TextureUpload| {
            let (region, _) = upload.texels.as_ref()?;
            Some((upload.target.image.id, region.subresources()))
        };
        let mut start = 0;
        for end in write_round_ends(textures.iter().map(part)) {
            self.record_texture_uploads(&textures[start..end])?;
            start = end;
        }
        for TextureUpload { target, .. } in textures {
            self.shared.free_later(DeferredObject::TextureRef(target));
        }
        Ok(())
    }

    fn record_buffer_uploads(&mut self, mut buffers: Vec<BufferUploads>, pages: &[UsedPage]) {
        buffers.retain(|upload| !upload.is_dead());
        if buffers.is_empty() {
            return;
        }
        for BufferUploads { target, .. } in &buffers {
            self.use_buffer(target, Use::transfer_write());
        }
        self.flush_barriers();
        for BufferUploads { target, regions: pieces } in buffers {
            for pieces in pieces.split_by_page().chunk_by(|a, b| a.page == b.page) {
                self.copy_page_regions(pieces, pages, target.raw);
            }
            self.state.pending_visibility.push(PendingVisibility::Buffer(Arc::clone(&target)));
            self.shared.free_later(DeferredObject::BufferRef(target));
        }
    }

    /// Copies the regions of one staging page.
    fn copy_page_regions(&self, pieces: &[CopyRegion], pages: &[UsedPage], target: vk::Buffer) {
        let page = pieces.first().and_then(|first| pages.iter().find(|used| used.page == first.page));
        let Some(page) = page else { return };
        let copy = |piece: &CopyRegion| vk::BufferCopy {
            src_offset: piece.source,
            dst_offset: piece.target,
            size: piece.bytes,
        };
        let copies: Vec<_> = pieces.iter().map(copy).collect();
        // SAFETY: the regions lie inside the page and the buffer, and none overlaps another.
        unsafe { self.shared.gpu.device.cmd_copy_buffer(self.raw(), page.raw, target, &copies) };
    }

    /// Records uploads that write different texels.
    fn record_texture_uploads(&mut self, uploads: &[TextureUpload]) -> Result<()> {
        for TextureUpload { target, texels } in uploads {
            if let Some((region, _)) = texels {
                self.use_texture(target, region.subresources(), Use::transfer_write())?;
            }
        }
        self.flush_barriers();
        for TextureUpload { target, texels } in uploads {
            if let Some((region, staged)) = texels {
                self.record_fill_texture(staged.buffer, staged.offset, target, region);
            }
            self.state.pending_visibility.push(PendingVisibility::Texture(Arc::clone(target)));
        }
        Ok(())
    }
}
