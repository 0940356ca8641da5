//! Import of external images and buffers, and submissions with external semaphores.

use ash::vk;

use super::Context;
use super::holder::Holder;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::handle::{BufferHandle, TextureHandle};
use crate::queue::Queue;
use crate::resource::buffer::BufferUsage;
use crate::resource::texture_desc::TextureDesc;
use crate::resource::{Buffer, Texture};
use crate::submit::exchanged_layout::exchanged_layout;
use crate::submit::{Submission, SubmitHandle};

/// Describes an external image to import.
#[derive(Debug, Clone)]
pub struct ImportedTexture<'a> {
    /// The image, bound to memory.
    pub image: vk::Image,
    /// The creation parameters of the image: kind, format, extent, mips (0 for all), samples, usage and view formats.
    /// `data` and `generate_mips` are ignored. Copies, clears, uploads and downloads need `TRANSFER_SRC` or `TRANSFER_DST`
    /// in the usage of the image, which the library cannot check.
    pub desc: TextureDesc<'a>,
    /// Layout of the whole image when the context first uses it: `UNDEFINED`, `GENERAL`, `READ_ONLY_OPTIMAL`,
    /// `SHADER_READ_ONLY_OPTIMAL`, `DEPTH_STENCIL_READ_ONLY_OPTIMAL`, `COLOR_ATTACHMENT_OPTIMAL`,
    /// `DEPTH_STENCIL_ATTACHMENT_OPTIMAL`, `TRANSFER_SRC_OPTIMAL` or `TRANSFER_DST_OPTIMAL`. The layouts of attachments
    /// and `DEPTH_STENCIL_READ_ONLY_OPTIMAL` need [`TextureUsage::TARGET`](crate::TextureUsage::TARGET); read-only
    /// colour images need [`SAMPLED`](crate::TextureUsage::SAMPLED).
    pub layout: vk::ImageLayout,
    /// True if the object was created with `VK_SHARING_MODE_CONCURRENT` for the families of all queues
    /// ([`Context::raw_queue_family_of`]). Otherwise it belongs to the graphics queue's family, and other queues must
    /// not use it.
    pub concurrent: bool,
}

/// Describes an external buffer to import.
#[derive(Debug, Clone, Copy)]
pub struct ImportedBuffer<'a> {
    /// The buffer, bound to memory. It was created with `SHADER_DEVICE_ADDRESS`, `TRANSFER_SRC` and `TRANSFER_DST`
    /// besides its usage.
    pub buffer: vk::Buffer,
    /// Size in bytes.
    pub size_bytes: u64,
    /// Usage that the buffer was created with.
    pub usage: BufferUsage,
    /// As [`ImportedTexture::concurrent`].
    pub concurrent: bool,
    /// Name in error messages.
    pub debug_name: &'a str,
}

/// An external semaphore that a submission waits for.
#[derive(Debug, Clone, Copy)]
pub struct RawWait {
    /// The semaphore, binary or timeline.
    pub semaphore: vk::Semaphore,
    /// The timeline value to wait for. Ignored for binary semaphores.
    pub value: u64,
    /// The stages that wait.
    pub stages: vk::PipelineStageFlags2,
}

/// An external semaphore that a submission signals when all of its work is done.
#[derive(Debug, Clone, Copy)]
pub struct RawSignal {
    /// The semaphore, binary or timeline.
    pub semaphore: vk::Semaphore,
    /// The timeline value to signal. Ignored for binary semaphores.
    pub value: u64,
}

impl Context {
    /// Imports an external image as a texture. The caller keeps ownership of the image: destroying the handle destroys
    /// the library's views, and never the image.
    ///
    /// Barriers are tracked as for any other texture, starting from the declared layout.
    /// [`CommandBuffer::release_texture`] transitions the image to a layout for external use. After external use,
    /// [`acquire_texture`](Self::acquire_texture) sets its current layout.
    ///
    /// # Safety
    /// The image belongs to this device and the graphics queue's family, or was created for concurrent use. It matches
    /// the description, and lives until the handle is destroyed and the GPU is done with it. External accesses are
    /// finished, or the submission waits for them with a semaphore of [`submit_with`](Self::submit_with).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a null image, a layout that is not in the list or that the image cannot
    /// have, and descriptions that no texture can have; [`Unsupported`](Error::Unsupported) and [`LimitExceeded`](Error::LimitExceeded) as in
    /// [`create_texture`](Self::create_texture).
    pub unsafe fn import_texture(&self, import: &ImportedTexture<'_>) -> Result<Holder<TextureHandle>> {
        let (shared, desc) = (self.device_state(), &import.desc);
        if desc.format.is_yuv() {
            let message = "textures in Y'CbCr are not imported; create one, and copy the planes to it";
            return Err(Error::usage(desc.debug_name, message));
        }
        if import.image == vk::Image::null() {
            return Err(Error::usage(desc.debug_name, "the image to import is null"));
        }
        if desc.data.is_some() || desc.generate_mips {
            let message = "an imported texture has its contents; upload others by upload_texture";
            return Err(Error::usage(desc.debug_name, message));
        }
        let layout = exchanged_layout(import.layout, desc.format, desc.usage)
            .map_err(|why| Error::usage(desc.debug_name, why))?;
        let holder = self.add_texture(desc, |slot| Texture::import(&shared.gpu, desc, import.image, slot))?;
        let image = &shared.store.textures.get(holder.handle())?.image;
        shared.submitter.import_texture(image.id, image.shape, layout);
        if !import.concurrent {
            shared.submitter.restrict_to_graphics(image.id, desc.debug_name);
        }
        Ok(holder)
    }

    /// Imports an external buffer. The caller keeps ownership of the buffer and of its host mapping, if there is one.
    /// The context never destroys it.
    ///
    /// # Safety
    /// The buffer belongs to this device, matches the description, and lives until the handle is destroyed and the GPU
    /// is done with it. External writes are finished, or the submission waits for them with a semaphore of
    /// [`submit_with`](Self::submit_with).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a null buffer or a size of 0.
    pub unsafe fn import_buffer(&self, import: &ImportedBuffer<'_>) -> Result<Holder<BufferHandle>> {
        if import.buffer == vk::Buffer::null() || import.size_bytes == 0 {
            return Err(Error::usage(import.debug_name, "the buffer to import is null or has no bytes"));
        }
        let name = import.debug_name;
        // SAFETY: by the caller's promise.
        let buffer = unsafe {
            Buffer::import(&self.device_state().gpu, import.buffer, import.size_bytes, import.usage, name)
        };
        if !import.concurrent {
            self.device_state().submitter.restrict_to_graphics(buffer.id, name);
        }
        let handle = self.device_state().store.buffers.insert(buffer);
        Ok(Holder::new(self, handle, super::create::NO_SLOT))
    }

    /// Acquires an imported texture after external use. `layout` is the current layout of the whole image.
    ///
    /// # Safety
    /// The image is in that layout once the waits of the next submission are satisfied.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a layout that is not in the list of [`ImportedTexture::layout`] or that
    /// the image cannot have.
    pub unsafe fn acquire_texture(&self, texture: TextureHandle, layout: vk::ImageLayout) -> Result<()> {
        let texture = self.device_state().store.textures.get(texture)?;
        let image = &texture.image;
        let layout = exchanged_layout(layout, image.format, image.usage)
            .map_err(|why| Error::usage(&texture.name, why))?;
        self.device_state().submitter.import_texture(texture.image.id, texture.image.shape, layout);
        Ok(())
    }

    /// Submits like [`submit`](Self::submit), with external semaphores. Waits for `waits` before the first command,
    /// including uploads, and signals `signals` after the last.
    ///
    /// # Safety
    /// The semaphores belong to this device. A binary semaphore to wait for has a pending signal and no other waiter. A
    /// binary semaphore to signal is unsignalled. Timeline values rise, and the values to wait for will be signalled.
    /// The semaphores live until [`wait_idle`](Self::wait_idle) returns: some drivers use them a moment longer than the
    /// submission runs.
    ///
    /// # Errors
    /// As [`submit`](Self::submit), and [`InvalidUsage`](Error::InvalidUsage) for a null semaphore.
    pub unsafe fn submit_with(
        &self,
        cmd: CommandBuffer,
        waits: &[RawWait],
        signals: &[RawSignal],
    ) -> Result<SubmitHandle> {
        check_not_null("wait for", waits.iter().map(|wait| wait.semaphore))?;
        check_not_null("signal", signals.iter().map(|signal| signal.semaphore))?;
        let info = |semaphore, value| vk::SemaphoreSubmitInfo::default().semaphore(semaphore).value(value);
        let waits = waits.iter().map(|wait| info(wait.semaphore, wait.value).stage_mask(wait.stages));
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let signals = signals.iter().map(|signal| info(signal.semaphore, signal.value).stage_mask(all));
        let (waits, signals): (Vec<_>, Vec<_>) = (waits.collect(), signals.collect());
        let exchanges = !waits.is_empty() || !signals.is_empty();
        self.submit_with_semaphores(cmd, Submission { waits, signals, exchanges, ..Submission::default() })
    }

    /// Returns the timeline semaphore of submissions to the graphics queue. [`SubmitHandle::raw_value`] is the value
    /// that a submission reaches. External code may wait for it, and must not signal it.
    pub fn raw_timeline(&self) -> vk::Semaphore {
        self.raw_timeline_of(Queue::Graphics)
    }

    /// Returns the timeline semaphore of a queue, like [`raw_timeline`](Self::raw_timeline). Queues that share hardware
    /// share the semaphore.
    pub fn raw_timeline_of(&self, queue: Queue) -> vk::Semaphore {
        let shared = self.device_state();
        shared.submitter.timeline(shared.gpu.queues.queue_index(queue)).raw
    }
}

/// Fails if one of the semaphores of a submission is null.
fn check_not_null(what: &str, mut semaphores: impl Iterator<Item = vk::Semaphore>) -> Result<()> {
    match semaphores.position(|semaphore| semaphore == vk::Semaphore::null()) {
        None => Ok(()),
        Some(index) => {
            let message =
                format!("semaphore {index} to {what} is null; leave it out, or give one of this device");
            Err(Error::usage("submit_with", message))
        }
    }
}
