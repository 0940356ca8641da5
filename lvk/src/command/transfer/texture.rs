//! Copies from, to and between textures.

use std::sync::Arc;

use ash::vk;

use super::{SOURCE_LAYOUT, TARGET_LAYOUT};
use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::command::pending_visibility::PendingVisibility;
use crate::error::{Error, Result};
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::region::{Region, TextureRegion};
use crate::resource::{Buffer, Texture};

impl CommandBuffer {
    /// Copies bytes, tightly packed, row by row and layer by layer, into a region of a texture
    /// (`vkCmdCopyBufferToImage`). The offset is a multiple of 4 and of the size of a texel or block in bytes.
    pub fn copy_buffer_to_texture(
        &mut self,
        source: BufferHandle,
        offset: u64,
        target: TextureHandle,
        region: &TextureRegion,
    ) -> Result<()> {
        let source = self.shared.store.buffers.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let region = check_packed(&source, offset, &target, region)?;
        self.check_copy(&target, &region)?;
        self.use_texture(&target, region.subresources(), Use::transfer_write())?;
        self.use_buffer(&source, Use::transfer_read());
        self.flush_barriers();
        self.record_fill_texture(source.raw, offset, &target, &region);
        self.state.pending_visibility.push(PendingVisibility::Texture(target));
        Ok(())
    }

    /// Writes texels through staging memory (`vkCmdCopyBufferToImage`). The call copies the bytes, which are tightly
    /// packed, row by row and layer by layer. On the transfer queue this streams textures while other queues draw.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a region that does not exist, a number of bytes other than the
    /// region's, multisampled textures, and regions that copies on the queue do not support
    /// ([`QueueInfo::copy_granularity`](crate::QueueInfo::copy_granularity)); [`WrongQueue`](Error::WrongQueue) for
    /// depth and stencil on queues other than the graphics queue.
    pub fn update_texture(
        &mut self,
        target: TextureHandle,
        region: &TextureRegion,
        bytes: &[u8],
    ) -> Result<()> {
        // A multiple of 16 suits texels and blocks of every size.
        const ALIGNMENT: u64 = 16;
        let target = self.shared.store.textures.get(target)?;
        let region = target.check_upload(region, bytes.len() as u64)?;
        self.check_copy(&target, &region)?;
        let staged = self.shared.staging.write(bytes, ALIGNMENT, self.recording.staging_key())?;
        self.use_texture(&target, region.subresources(), Use::transfer_write())?;
        self.flush_barriers();
        self.record_fill_texture(staged.buffer, staged.offset, &target, &region);
        self.state.pending_visibility.push(PendingVisibility::Texture(target));
        Ok(())
    }

    /// Copies a region of a texture into a buffer, tightly packed, row by row and layer by layer
    /// (`vkCmdCopyImageToBuffer`). The offset is a multiple of 4 and of the size of a texel or block in bytes.
    pub fn copy_texture_to_buffer(
        &mut self,
        source: TextureHandle,
        region: &TextureRegion,
        target: BufferHandle,
        offset: u64,
    ) -> Result<()> {
        let source = self.shared.store.textures.get(source)?;
        let target = self.shared.store.buffers.get(target)?;
        self.copy_texture_objects_to_buffer(&source, region, &target, offset)
    }

    /// As [`copy_texture_to_buffer`](Self::copy_texture_to_buffer), by object.
    pub(crate) fn copy_texture_objects_to_buffer(
        &mut self,
        source: &Arc<Texture>,
        region: &TextureRegion,
        target: &Arc<Buffer>,
        offset: u64,
    ) -> Result<()> {
        let region = check_packed(target, offset, source, region)?;
        self.check_copy(source, &region)?;
        self.use_texture(source, region.subresources(), Use::transfer_read())?;
        self.use_buffer(target, Use::transfer_write());
        self.flush_barriers();
        let copy = region.buffer_copy(offset);
        // SAFETY: the region lies inside the image and its bytes inside the buffer.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_copy_image_to_buffer(self.raw(), source.image.raw, SOURCE_LAYOUT, target.raw, &[copy]);
        }
        self.state.pending_visibility.push(PendingVisibility::Texture(Arc::clone(source)));
        self.state.pending_visibility.push(PendingVisibility::Buffer(Arc::clone(target)));
        Ok(())
    }

    /// Copies texels, or blocks of compressed formats, between textures whose texels or blocks have the same size in
    /// bytes (`vkCmdCopyImage`). Both regions have as many texels or blocks as `from` in each direction, and as many
    /// layers or slices. Slices of a volume may be copied to layers, and layers to slices. Depth and stencil are copied
    /// one at a time, and between textures of one format.
    pub fn copy_texture(
        &mut self,
        source: TextureHandle,
        from: &TextureRegion,
        target: TextureHandle,
        to: &TextureRegion,
    ) -> Result<()> {
        let source = self.shared.store.textures.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let from = source.resolve_region(from)?;
        let to = matching_region(&source, &from, &target, to)?;
        self.check_copy(&source, &from)?;
        self.check_copy(&target, &to)?;
        self.use_texture_pair(&source, &from, &target, &to)?;
        let depth = from.extent[2].max(to.extent[2]);
        let copy = vk::ImageCopy {
            src_subresource: from.raw_layers(),
            src_offset: from.raw_offset(),
            dst_subresource: to.raw_layers(),
            dst_offset: to.raw_offset(),
            extent: vk::Extent3D { depth, ..from.raw_extent() },
        };
        // SAFETY: both regions lie inside their images, whose texels or blocks are equally large.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_copy_image(
                self.raw(),
                source.image.raw,
                SOURCE_LAYOUT,
                target.image.raw,
                TARGET_LAYOUT,
                &[copy],
            );
        }
        self.make_pair_visible(source, target);
        Ok(())
    }

    /// Records only the copy of bytes to a region. Expects its barriers to be recorded.
    pub(in crate::command) fn record_fill_texture(
        &self,
        source: vk::Buffer,
        offset: u64,
        target: &Texture,
        region: &Region,
    ) {
        let copy = region.buffer_copy(offset);
        // SAFETY: the bytes lie inside the buffer and the region inside the image.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_copy_buffer_to_image(self.raw(), source, target.image.raw, TARGET_LAYOUT, &[copy]);
        }
    }
}

/// Checks that the packed bytes of a region lie inside a buffer, and resolves the region.
fn check_packed(buffer: &Buffer, offset: u64, texture: &Texture, region: &TextureRegion) -> Result<Region> {
    let region = texture.resolve_region(region)?;
    texture.check_one_sample("copies from and to buffers move")?;
    let bytes = u64::from(region.part.block_bytes);
    if !offset.is_multiple_of(4) || !offset.is_multiple_of(bytes) {
        let message = format!("the offset {offset} is no multiple of 4 and of {bytes} bytes");
        return Err(Error::usage(&buffer.name, message));
    }
    buffer.check_range(offset, region.bytes())?;
    Ok(region)
}

/// Returns the region of `target` at the offset of `to` that has the size of `from`.
fn matching_region(source: &Texture, from: &Region, target: &Texture, to: &TextureRegion) -> Result<Region> {
    let part = target.copy_aspect(to.aspect)?;
    check_copyable(source, from, target, part.aspect, part.block_bytes)?;
    let [width, height, _] = target.bounds().mip_extent(to.mip);
    let room = [width.saturating_sub(to.offset[0]), height.saturating_sub(to.offset[1])];
    let [width, height, slices] = from.extent;
    let extent = if part.block == from.part.block {
        [width, height]
    } else {
        let blocks = from.part.block_count([width, height]);
        // The last block may reach over the edge.
        [0, 1].map(|axis| match blocks[axis].saturating_mul(part.block[axis]) {
            side if side - part.block[axis] < room[axis] => side.min(room[axis]),
            side => side,
        })
    };
    let count = slices * from.layers;
    let (layers, depth) = if target.kind.is_3d() { (1, count) } else { (count, 1) };
    target.resolve_region(&TextureRegion { extent, layers, depth, ..*to })
}

fn check_copyable(
    source: &Texture,
    from: &Region,
    target: &Texture,
    aspect: vk::ImageAspectFlags,
    block_bytes: u32,
) -> Result<()> {
    if source.image.samples != target.image.samples {
        let message = format!(
            "texels of {} samples cannot be copied to texels of {}; resolve, or use a shader",
            source.image.samples, target.image.samples
        );
        return Err(Error::usage(&target.name, message));
    }
    let (a, b) = (source.image.format, target.image.format);
    let alike = if a.is_color() && b.is_color() {
        from.part.block_bytes == block_bytes
    } else {
        a == b && from.part.aspect == aspect
    };
    if alike {
        return Ok(());
    }
    let message = format!("texels of {a:?} cannot be copied to {b:?}; blit, or use a shader");
    Err(Error::usage(&target.name, message))
}
