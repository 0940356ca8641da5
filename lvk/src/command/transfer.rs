//! Copies, fills, clears, blits and mips.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use crate::barrier::{Layout, Stages, Use};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::sampler::Filter;
use crate::resource::texture::TextureRegion;
use crate::resource::texture_desc::TextureUsage;
use crate::resource::{Buffer, Texture};
use crate::submit::Recording;
use crate::submit::emit::emit;

/// Layout of an image that is copied from.
const SOURCE: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
/// Layout of an image that is copied to.
const TARGET: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

/// A resource a copy wrote, or read in a layout of its own, to be made readable everywhere before shaders run.
pub(super) enum Settle {
    Buffer(Arc<Buffer>),
    Texture(Arc<Texture>),
}

impl CommandBuffer {
    /// Copies `size` bytes between buffers (`vkCmdCopyBuffer2`).
    pub fn copy_buffer(
        &mut self,
        source: BufferHandle,
        source_offset: u64,
        target: BufferHandle,
        target_offset: u64,
        size: u64,
    ) -> Result<()> {
        let source = self.shared.store.buffers.get(source)?;
        let target = self.shared.store.buffers.get(target)?;
        self.copy_buffer_objects(&source, source_offset, &target, target_offset, size)
    }

    /// As [`copy_buffer`](Self::copy_buffer), by object.
    pub(crate) fn copy_buffer_objects(
        &mut self,
        source: &Arc<Buffer>,
        source_offset: u64,
        target: &Arc<Buffer>,
        target_offset: u64,
        size: u64,
    ) -> Result<()> {
        source.check_range(source_offset, size)?;
        target.check_range(target_offset, size)?;
        if source.id == target.id && source_offset.abs_diff(target_offset) < size {
            return Err(Error::usage(&source.name, "source and target of the copy overlap"));
        }
        if size == 0 {
            return Ok(());
        }
        self.use_buffer(source, Use::transfer_read());
        self.use_buffer(target, Use::transfer_write());
        self.flush();
        self.settle.push(Settle::Buffer(Arc::clone(target)));
        let region = vk::BufferCopy { src_offset: source_offset, dst_offset: target_offset, size };
        // SAFETY: both ranges lie inside their buffers and do not overlap.
        unsafe { self.shared.gpu.device.cmd_copy_buffer(self.raw(), source.raw, target.raw, &[region]) };
        Ok(())
    }

    /// Fills bytes with a repeated 32-bit value; offset and size are multiples of 4 (`vkCmdFillBuffer`).
    pub fn fill_buffer(&mut self, buffer: BufferHandle, offset: u64, size: u64, value: u32) -> Result<()> {
        let buffer = self.shared.store.buffers.get(buffer)?;
        buffer.check_range(offset, size)?;
        if !offset.is_multiple_of(4) || !size.is_multiple_of(4) {
            return Err(Error::usage(&buffer.name, "offset and size of a fill are multiples of 4"));
        }
        if size == 0 {
            return Ok(());
        }
        self.use_buffer(&buffer, Use::transfer_write());
        self.flush();
        // SAFETY: the range lies inside the buffer and is aligned.
        unsafe { self.shared.gpu.device.cmd_fill_buffer(self.raw(), buffer.raw, offset, size, value) };
        self.settle.push(Settle::Buffer(buffer));
        Ok(())
    }

    /// Copies bytes, rows tightly packed, into a region of a texture (`vkCmdCopyBufferToImage`).
    pub fn copy_buffer_to_texture(
        &mut self,
        source: BufferHandle,
        offset: u64,
        target: TextureHandle,
        region: &TextureRegion,
    ) -> Result<()> {
        let source = self.shared.store.buffers.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let region = self.check_packed(&source, offset, &target, region)?;
        self.use_buffer(&source, Use::transfer_read());
        self.record_fill_texture(source.raw, offset, &target, &region)
    }

    /// Copies a region of a texture into a buffer, rows tightly packed (`vkCmdCopyImageToBuffer`).
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
        let region = self.check_packed(target, offset, source, region)?;
        self.use_texture(source, source.part(region.mip, region.layer), Use::transfer_read())?;
        self.use_buffer(target, Use::transfer_write());
        self.flush();
        let copy = source.buffer_copy(&region, offset);
        // SAFETY: the region lies inside the image and its bytes inside the buffer.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_copy_image_to_buffer(self.raw(), source.image.raw, SOURCE, target.raw, &[copy]);
        }
        self.settle.push(Settle::Texture(Arc::clone(source)));
        self.settle.push(Settle::Buffer(Arc::clone(target)));
        Ok(())
    }

    /// Copies texels between textures of texels of the same size (`vkCmdCopyImage`). Both regions have the extent and depth
    /// of the first. A slice of a volume may be copied to a layer, and a layer to a slice.
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
        let to = target.resolve_region(&TextureRegion { extent: from.extent, depth: from.depth, ..*to })?;
        check_copyable(&source, &target)?;
        self.use_texture_pair(&source, &from, &target, &to)?;
        let copy = vk::ImageCopy {
            src_subresource: source.layers_of(from.mip, from.layer),
            src_offset: from.raw_offset(),
            dst_subresource: target.layers_of(to.mip, to.layer),
            dst_offset: to.raw_offset(),
            extent: from.raw_extent(),
        };
        // SAFETY: both regions lie inside their images, whose texels are equally large.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_copy_image(self.raw(), source.image.raw, SOURCE, target.image.raw, TARGET, &[copy]);
        }
        self.settle.extend([source, target].map(Settle::Texture));
        Ok(())
    }

    /// Copies a region of a multisampled colour texture to one of one sample, each texel the mean of its samples, of
    /// integers one of them (`vkCmdResolveImage`). Both have one format, and both regions have the extent of the first.
    /// Depth and stencil are resolved by passes.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for other numbers of samples, for different formats, for depth, and for
    /// regions that do not exist; [`Unsupported`](Error::Unsupported) where the format cannot be resolved to.
    pub fn resolve_texture(
        &mut self,
        source: TextureHandle,
        from: &TextureRegion,
        target: TextureHandle,
        to: &TextureRegion,
    ) -> Result<()> {
        let source = self.shared.store.textures.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let from = source.resolve_region(from)?;
        let to = target.resolve_region(&TextureRegion { extent: from.extent, depth: from.depth, ..*to })?;
        self.check_resolve(&source, &target)?;
        self.use_texture_pair(&source, &from, &target, &to)?;
        let resolve = vk::ImageResolve {
            src_subresource: source.layers_of(from.mip, from.layer),
            src_offset: from.raw_offset(),
            dst_subresource: target.layers_of(to.mip, to.layer),
            dst_offset: to.raw_offset(),
            extent: from.raw_extent(),
        };
        // SAFETY: both regions lie inside their images of one format, the first with several samples, the other with one.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_resolve_image(
                self.raw(),
                source.image.raw,
                SOURCE,
                target.image.raw,
                TARGET,
                &[resolve],
            );
        }
        self.settle.extend([source, target].map(Settle::Texture));
        Ok(())
    }

    fn check_resolve(&self, source: &Texture, target: &Texture) -> Result<()> {
        target.check_one_sample("resolves write")?;
        let [from, to] = [source, target].map(|texture| texture.image.format);
        if source.image.samples == 1 {
            return Err(Error::usage(&source.name, "it has one sample a texel; copy or blit it"));
        }
        if from != to || from.is_depth() {
            let message = format!("{from:?} cannot be resolved to {to:?}; both must be one colour format");
            return Err(Error::usage(&target.name, message));
        }
        if self.shared.gpu.image_features(to.raw()).contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT) {
            return Ok(());
        }
        let what = format!("a resolve from '{}' to '{}'", source.name, target.name);
        Err(Error::unsupported(what, format!("the device cannot resolve {to:?}; use a shader")))
    }

    /// Copies and scales a region, converting the format (`vkCmdBlitImage`). Views count as of the format of the texture
    /// they show.
    pub fn blit_texture(
        &mut self,
        source: TextureHandle,
        from: &TextureRegion,
        target: TextureHandle,
        to: &TextureRegion,
        filter: Filter,
    ) -> Result<()> {
        let source = self.shared.store.textures.get(source)?;
        let target = self.shared.store.textures.get(target)?;
        let from = source.resolve_region(from)?;
        let to = target.resolve_region(to)?;
        self.check_blit(&source, &target, filter)?;
        self.use_texture_pair(&source, &from, &target, &to)?;
        self.record_blit(&source, &from, &target, &to, filter);
        self.settle.extend([source, target].map(Settle::Texture));
        Ok(())
    }

    /// Fills every mip but the first by halving the one before, for all layers, volumes in depth too.
    pub fn generate_mipmaps(&mut self, texture: TextureHandle) -> Result<()> {
        let texture = self.shared.store.textures.get(texture)?;
        self.generate_mipmaps_object(&texture)
    }

    /// As [`generate_mipmaps`](Self::generate_mipmaps), by object.
    pub(crate) fn generate_mipmaps_object(&mut self, texture: &Arc<Texture>) -> Result<()> {
        self.check_blit(texture, texture, Filter::Linear)?;
        for mip in 1..texture.mips() {
            for layer in 0..texture.layers() {
                let from =
                    texture.resolve_region(&TextureRegion { mip: mip - 1, layer, ..Default::default() })?;
                let to = texture.resolve_region(&TextureRegion { mip, layer, ..Default::default() })?;
                self.use_texture_pair(texture, &from, texture, &to)?;
                self.record_blit(texture, &from, texture, &to, Filter::Linear);
            }
        }
        self.settle.push(Settle::Texture(Arc::clone(texture)));
        Ok(())
    }

    /// Fills all mips and layers of a colour texture with one colour (`vkCmdClearColorImage`), which is encoded in the
    /// format of the texture itself where this is a view of it.
    pub fn clear_texture(&mut self, texture: TextureHandle, color: [f32; 4]) -> Result<()> {
        let texture = self.shared.store.textures.get(texture)?;
        if texture.image.format.is_depth() || texture.image.format.is_uint() {
            return Err(Error::usage(&texture.name, "only textures of colours are cleared to a colour"));
        }
        self.use_texture(&texture, texture.range, Use::transfer_write())?;
        self.flush();
        let range = texture.image.for_barriers().range(texture.range);
        let color = vk::ClearColorValue { float32: color };
        // SAFETY: the range lies inside the image.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_clear_color_image(self.raw(), texture.image.raw, TARGET, &color, &[range]);
        }
        self.settle.push(Settle::Texture(texture));
        Ok(())
    }

    /// Copies host bytes into a buffer through the staging ring.
    pub(crate) fn upload_buffer(&mut self, target: &Arc<Buffer>, offset: u64, bytes: &[u8]) -> Result<()> {
        target.check_range(offset, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let region = self.shared.staging.write(bytes, 16, self.recording.sequence)?;
        self.retire_temporary(region.temporary);
        self.use_buffer(target, Use::transfer_write());
        self.flush();
        let copy = vk::BufferCopy { src_offset: region.offset, dst_offset: offset, size: bytes.len() as u64 };
        // SAFETY: both ranges lie inside their buffers.
        unsafe { self.shared.gpu.device.cmd_copy_buffer(self.raw(), region.buffer, target.raw, &[copy]) };
        self.settle.push(Settle::Buffer(Arc::clone(target)));
        Ok(())
    }

    /// Copies host bytes, rows tightly packed, into a texture through the staging ring.
    pub(crate) fn upload_texture(
        &mut self,
        target: &Arc<Texture>,
        region: &TextureRegion,
        bytes: &[u8],
    ) -> Result<()> {
        let region = target.resolve_region(region)?;
        target.check_one_sample("uploads write")?;
        let expected = region.texels() * u64::from(target.format.texel_bytes());
        if bytes.len() as u64 != expected {
            let message = format!("{} bytes were given for texels of {expected} bytes", bytes.len());
            return Err(Error::usage(&target.name, message));
        }
        let staged = self.shared.staging.write(bytes, 16, self.recording.sequence)?;
        self.retire_temporary(staged.temporary);
        self.record_fill_texture(staged.buffer, staged.offset, target, &region)
    }

    fn record_fill_texture(
        &mut self,
        source: vk::Buffer,
        offset: u64,
        target: &Arc<Texture>,
        region: &TextureRegion,
    ) -> Result<()> {
        self.use_texture(target, target.part(region.mip, region.layer), Use::transfer_write())?;
        self.flush();
        let copy = target.buffer_copy(region, offset);
        // SAFETY: the bytes lie inside the buffer and the region inside the image.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_copy_buffer_to_image(self.raw(), source, target.image.raw, TARGET, &[copy]);
        }
        self.settle.push(Settle::Texture(Arc::clone(target)));
        Ok(())
    }

    /// Checks that the packed bytes of a region lie inside a buffer, and resolves the region.
    fn check_packed(
        &self,
        buffer: &Buffer,
        offset: u64,
        texture: &Texture,
        region: &TextureRegion,
    ) -> Result<TextureRegion> {
        let region = texture.resolve_region(region)?;
        texture.check_one_sample("copies from and to buffers move")?;
        let texel = u64::from(texture.format.texel_bytes());
        if !offset.is_multiple_of(texel.max(4)) {
            let message = format!("the offset {offset} is no multiple of {} bytes", texel.max(4));
            return Err(Error::usage(&buffer.name, message));
        }
        buffer.check_range(offset, region.texels() * texel)?;
        Ok(region)
    }

    fn use_texture_pair(
        &mut self,
        source: &Arc<Texture>,
        from: &TextureRegion,
        target: &Arc<Texture>,
        to: &TextureRegion,
    ) -> Result<()> {
        self.uses.clear();
        self.use_texture(source, source.part(from.mip, from.layer), Use::transfer_read())?;
        if let Err(error) = self.use_texture(target, target.part(to.mip, to.layer), Use::transfer_write()) {
            self.uses.clear();
            return Err(error);
        }
        self.flush();
        Ok(())
    }

    fn check_blit(&self, source: &Texture, target: &Texture, filter: Filter) -> Result<()> {
        source.check_one_sample("blits read")?;
        target.check_one_sample("blits write")?;
        let gpu = &self.shared.gpu;
        let linear = match filter {
            Filter::Nearest => vk::FormatFeatureFlags::empty(),
            Filter::Linear => vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
        };
        let from = vk::FormatFeatureFlags::BLIT_SRC | linear;
        let [source_format, target_format] = [source, target].map(|texture| texture.image.format);
        let compatible = !source_format.is_depth()
            && !target_format.is_depth()
            && source_format.is_uint() == target_format.is_uint()
            && gpu.image_features(source_format.raw()).contains(from)
            && gpu.image_features(target_format.raw()).contains(vk::FormatFeatureFlags::BLIT_DST);
        if compatible {
            return Ok(());
        }
        let what = format!("a {filter:?} blit from '{}' to '{}'", source.name, target.name);
        let formats = format!("{source_format:?} and {target_format:?}");
        Err(Error::unsupported(what, format!("the device cannot scale between {formats}; use a shader")))
    }

    fn record_blit(
        &self,
        source: &Texture,
        from: &TextureRegion,
        target: &Texture,
        to: &TextureRegion,
        filter: Filter,
    ) {
        let blit = vk::ImageBlit {
            src_subresource: source.layers_of(from.mip, from.layer),
            src_offsets: from.raw_corners(),
            dst_subresource: target.layers_of(to.mip, to.layer),
            dst_offsets: to.raw_corners(),
        };
        let filter = match filter {
            Filter::Nearest => vk::Filter::NEAREST,
            Filter::Linear => vk::Filter::LINEAR,
        };
        // SAFETY: both regions lie inside their images, and the formats can be blitted.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_blit_image(
                self.raw(),
                source.image.raw,
                SOURCE,
                target.image.raw,
                TARGET,
                &[blit],
                filter,
            );
        }
    }

    /// Gives a new texture the layout in which shaders read it.
    pub(crate) fn settle_texture(&mut self, texture: &Arc<Texture>) {
        self.settle.push(Settle::Texture(Arc::clone(texture)));
    }

    /// Makes what copies touched readable by every shader and every input, with one barrier for all.
    pub(super) fn settle(&mut self) {
        if self.settle.is_empty() {
            return;
        }
        let Recording { tracker, images, commands, .. } = &mut *self.recording;
        self.barriers.clear();
        // What was written twice is listed twice; the second read needs no barrier any more.
        for written in self.settle.drain(..) {
            match written {
                Settle::Buffer(buffer) => {
                    tracker.use_buffer(buffer.id, Use::everything_read(), &mut self.barriers);
                }
                Settle::Texture(texture) => {
                    let Some(read) = resting_use(texture.image.usage) else { continue };
                    let image = &texture.image;
                    images.insert(image.id, image.for_barriers());
                    tracker.use_texture(image.id, image.shape, texture.range, read, &mut self.barriers);
                }
            }
        }
        emit(&self.shared.gpu, *commands, &self.barriers, images);
    }
}

/// How shaders read a texture that no command declares; `None` for textures they do not read.
fn resting_use(usage: TextureUsage) -> Option<Use> {
    let read = Use::shader_read(Stages::SHADERS);
    if usage.contains(TextureUsage::SAMPLED) {
        return Some(read);
    }
    usage.contains(TextureUsage::STORAGE).then_some(read.with_layout(Layout::General))
}

fn check_copyable(source: &Texture, target: &Texture) -> Result<()> {
    let depth = |format: Format| format.is_depth();
    let (from, to) = (source.image.format, target.image.format);
    if source.image.samples != target.image.samples {
        let message = format!(
            "texels of {} samples cannot be copied to texels of {}; resolve, or use a shader",
            source.image.samples, target.image.samples
        );
        return Err(Error::usage(&target.name, message));
    }
    let same_bits = from.texel_bytes() == to.texel_bytes() && !depth(from) && !depth(to);
    if from == to || same_bits {
        return Ok(());
    }
    let message = format!("texels of {from:?} cannot be copied to {to:?}; blit, or use a shader");
    Err(Error::usage(&target.name, message))
}
