//! Exchange of buffers and textures in shared memory with other devices, processes and APIs.

use std::sync::Arc;

use ash::vk;

use crate::barrier::Use;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::Texture;
use crate::submit::emit_barriers::Side;
use crate::submit::exchanged_layout::exchanged_layout;
use crate::submit::last_access::QueueAccess;

impl CommandBuffer {
    /// Releases a buffer in shared memory to other devices, processes and APIs, after everything recorded so far
    /// (`VK_QUEUE_FAMILY_EXTERNAL`). A shared semaphore, signalled by
    /// [`submit_with`](crate::Context::submit_with), tells them. Before the next use
    /// [`acquire_external_buffer`](Self::acquire_external_buffer) must take the buffer back.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a buffer without shared memory.
    pub fn release_external_buffer(&mut self, buffer: BufferHandle) -> Result<()> {
        self.exchange_buffer(buffer, Side::Release)
    }

    /// Acquires a buffer in shared memory that another device, process or API has released, before everything recorded
    /// afterwards (`VK_QUEUE_FAMILY_EXTERNAL`).
    ///
    /// # Safety
    /// The other side has released the buffer, or is never going to use it, and the submission waits for its semaphore.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a buffer without shared memory.
    pub unsafe fn acquire_external_buffer(&mut self, buffer: BufferHandle) -> Result<()> {
        self.exchange_buffer(buffer, Side::Acquire)
    }

    /// Releases a texture in shared memory in the given layout, as
    /// [`release_external_buffer`](Self::release_external_buffer) does for buffers. The layouts are those of
    /// [`release_texture`](Self::release_texture).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a texture without shared memory, and for any other layout.
    pub fn release_external_texture(
        &mut self,
        texture: TextureHandle,
        layout: vk::ImageLayout,
    ) -> Result<()> {
        let found = self.find_shared_texture(texture)?;
        self.release_texture_object(&found, layout)?;
        self.record_texture_exchange(&found, layout, Side::Release);
        Ok(())
    }

    /// Acquires a texture in shared memory, which the other side released in the given layout, as
    /// [`acquire_external_buffer`](Self::acquire_external_buffer) does for buffers. With `UNDEFINED` the contents are
    /// lost.
    ///
    /// # Safety
    /// As [`acquire_external_buffer`](Self::acquire_external_buffer), and the texture is in that layout. Command buffers
    /// that use the texture are submitted in the order in which they were recorded.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a texture without shared memory, and for a layout that is not in the list
    /// of [`ImportedTexture::layout`](crate::ImportedTexture::layout). [`WrongQueue`](Error::WrongQueue) unless the
    /// command buffer is for the graphics queue.
    pub unsafe fn acquire_external_texture(
        &mut self,
        texture: TextureHandle,
        layout: vk::ImageLayout,
    ) -> Result<()> {
        self.needs_graphics("the acquisition of a texture")?;
        let found = self.find_shared_texture(texture)?;
        let known = exchanged_layout(layout, found.image.format, found.image.usage)
            .map_err(|why| Error::usage(&found.name, why))?;
        self.shared.submitter.import_texture(found.image.id, found.image.shape, known);
        if layout == vk::ImageLayout::UNDEFINED {
            return Ok(());
        }
        self.make_visible();
        self.use_texture(&found, found.range, Use::transfer_read().with_layout(known))?;
        self.flush_barriers();
        self.record_texture_exchange(&found, layout, Side::Acquire);
        Ok(())
    }

    fn find_shared_texture(&self, texture: TextureHandle) -> Result<Arc<Texture>> {
        let texture = self.shared.store.textures.get(texture)?;
        if texture.image.shared_memory().is_some() {
            return Ok(texture);
        }
        let message = "the texture has no shared memory; create it by create_exportable_texture or \
                       import_texture_memory";
        Err(Error::usage(&texture.name, message))
    }

    /// Records the ownership transfer of a texture that is in the layout.
    fn record_texture_exchange(&mut self, texture: &Texture, layout: vk::ImageLayout, side: Side) {
        let image = &texture.image;
        let [from, to] = self.families(side, image.is_concurrent());
        let scope = side.scope();
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(scope.src_stages)
            .src_access_mask(scope.src_access)
            .dst_stage_mask(scope.dst_stages)
            .dst_access_mask(scope.dst_access)
            .old_layout(layout)
            .new_layout(layout)
            .src_queue_family_index(from)
            .dst_queue_family_index(to)
            .image(image.raw)
            .subresource_range(image.barrier_image().range(image.shape.all_subresources()))];
        self.record_exchange(&vk::DependencyInfo::default().image_memory_barriers(&barrier));
    }

    fn exchange_buffer(&mut self, buffer: BufferHandle, side: Side) -> Result<()> {
        let buffer = self.shared.store.buffers.get(buffer)?;
        if buffer.shared_memory().is_none() {
            let message = "the buffer has no shared memory; create it by create_exportable_buffer or import_buffer_memory";
            return Err(Error::usage(&buffer.name, message));
        }
        self.make_visible();
        self.use_buffer(&buffer, Use::transfer_read());
        self.flush_barriers();
        // The other side may write the buffer, so the exchange waits for reads on other queues.
        self.reference_resource(buffer.id, QueueAccess::Write);
        let [from, to] = self.families(side, self.shared.gpu.queues.families().len() > 1);
        let scope = side.scope();
        let barrier = [vk::BufferMemoryBarrier2::default()
            .src_stage_mask(scope.src_stages)
            .src_access_mask(scope.src_access)
            .dst_stage_mask(scope.dst_stages)
            .dst_access_mask(scope.dst_access)
            .src_queue_family_index(from)
            .dst_queue_family_index(to)
            .buffer(buffer.raw)
            .size(vk::WHOLE_SIZE)];
        self.record_exchange(&vk::DependencyInfo::default().buffer_memory_barriers(&barrier));
        Ok(())
    }

    /// Returns the queue families that give and take. No family owns concurrent objects.
    fn families(&self, side: Side, concurrent: bool) -> [u32; 2] {
        let own = match concurrent {
            true => vk::QUEUE_FAMILY_IGNORED,
            false => self.shared.gpu.queues.family(self.recording.queue_index),
        };
        match side {
            Side::Release => [own, vk::QUEUE_FAMILY_EXTERNAL],
            Side::Acquire => [vk::QUEUE_FAMILY_EXTERNAL, own],
        }
    }

    fn record_exchange(&mut self, info: &vk::DependencyInfo<'_>) {
        // SAFETY: the barriers before have ended any pass, and the object is alive.
        unsafe { self.shared.gpu.device.cmd_pipeline_barrier2(self.recording.commands, info) };
    }
}
