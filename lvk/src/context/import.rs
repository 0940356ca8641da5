//! Images and buffers of somebody else's as objects of a context, and semaphores both ways.

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
use crate::submit::emit_barriers::layout_from_vulkan;
use crate::submit::{Submission, SubmitHandle};

/// Describes an image of somebody else's.
#[derive(Debug, Clone)]
pub struct ImportedTexture<'a> {
    /// The image, with memory.
    pub image: vk::Image,
    /// What it was made with: kind, format, extent, mips (0 stands for all), samples, usage and view formats. `data` and
    /// `generate_mips` are of no use.
    pub desc: TextureDesc<'a>,
    /// The layout all of it is in when the context may first use it: `UNDEFINED`, `GENERAL`, `READ_ONLY_OPTIMAL`,
    /// `COLOR_ATTACHMENT_OPTIMAL`, `DEPTH_STENCIL_ATTACHMENT_OPTIMAL`, `TRANSFER_SRC_OPTIMAL` or `TRANSFER_DST_OPTIMAL`.
    pub layout: vk::ImageLayout,
    /// It was made with `VK_SHARING_MODE_CONCURRENT` for the families of all queues
    /// ([`Context::raw_queue_family_of`]). Otherwise it belongs to that of the graphics queue, and no other queue uses it.
    pub concurrent: bool,
}

/// Describes a buffer of somebody else's.
#[derive(Debug, Clone, Copy)]
pub struct ImportedBuffer<'a> {
    /// The buffer, with memory, made with `SHADER_DEVICE_ADDRESS`, `TRANSFER_SRC` and `TRANSFER_DST` besides its usage.
    pub buffer: vk::Buffer,
    /// Its size in bytes.
    pub size_bytes: u64,
    /// What it was made for.
    pub usage: BufferUsage,
    /// As [`ImportedTexture::concurrent`].
    pub concurrent: bool,
    /// Name in error messages.
    pub debug_name: &'a str,
}

/// A semaphore of somebody else's that a submission waits for.
#[derive(Debug, Clone, Copy)]
pub struct RawWait {
    /// The semaphore, binary or timeline.
    pub semaphore: vk::Semaphore,
    /// The value to wait for; of no use for binary ones.
    pub value: u64,
    /// The stages that wait.
    pub stages: vk::PipelineStageFlags2,
}

/// A semaphore of somebody else's that a submission signals when all of it is done.
#[derive(Debug, Clone, Copy)]
pub struct RawSignal {
    /// The semaphore, binary or timeline.
    pub semaphore: vk::Semaphore,
    /// The value to signal; of no use for binary ones.
    pub value: u64,
}

impl Context {
    /// Makes an image of somebody else's a texture. It stays theirs: the end of the handle destroys the library's views of
    /// it, and never the image.
    ///
    /// Barriers follow it like any other texture, from the layout it is said to be in. To give it back,
    /// [`CommandBuffer::release_texture`] brings it into a layout; after others have used it,
    /// [`acquire_texture`](Self::acquire_texture) says in which one it is.
    ///
    /// # Safety
    /// The image belongs to this device and the graphics queue's family, or was made for concurrent use, is as described, and lives
    /// until the handle is destroyed and the GPU is done with it. What others did to it is waited for, by a semaphore of
    /// [`submit_with`](Self::submit_with) or by having finished.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a null image, a layout that is not in the list, and what no texture can be;
    /// [`Unsupported`](Error::Unsupported) and [`LimitExceeded`](Error::LimitExceeded) as of
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
        let layout = layout_from_vulkan(import.layout).map_err(|why| Error::usage(desc.debug_name, why))?;
        let slot = shared.reserve_slot(|| shared.bindless.reserve_texture(desc.debug_name))?;
        let made = Texture::import(&shared.gpu, desc, import.image, slot)
            .and_then(|texture| super::create_texture::default_views(&texture).map(|views| (texture, views)));
        let (texture, views) = made.inspect_err(|_| shared.bindless.free_texture(slot))?;
        shared.submitter.import_texture(texture.image.id, texture.image.shape, layout);
        if !import.concurrent {
            shared.submitter.restrict_to_graphics(texture.image.id, desc.debug_name);
        }
        shared.bindless.set_texture(slot, views);
        Ok(Holder::new(self, shared.store.textures.insert(texture), slot))
    }

    /// Makes a buffer of somebody else's a buffer of the context. It stays theirs and is never destroyed; the host's
    /// mapping of it, if there is one, is theirs too.
    ///
    /// # Safety
    /// The buffer belongs to this device, is as described, and lives until the handle is destroyed and the GPU is done
    /// with it. What others wrote is waited for, by a semaphore of [`submit_with`](Self::submit_with) or by having finished.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a null buffer or no bytes.
    pub unsafe fn import_buffer(&self, import: &ImportedBuffer<'_>) -> Result<Holder<BufferHandle>> {
        if import.buffer == vk::Buffer::null() || import.size_bytes == 0 {
            return Err(Error::usage(import.debug_name, "the buffer to import is null or has no bytes"));
        }
        let name = import.debug_name;
        // SAFETY: by the caller.
        let buffer = unsafe {
            Buffer::import(&self.device_state().gpu, import.buffer, import.size_bytes, import.usage, name)
        };
        if !import.concurrent {
            self.device_state().submitter.restrict_to_graphics(buffer.id, name);
        }
        let handle = self.device_state().store.buffers.insert(buffer);
        Ok(Holder::new(self, handle, super::create::NO_SLOT))
    }

    /// Others have used an imported texture, which is in `layout` now, all of it.
    ///
    /// # Safety
    /// It is, once what the next submission waits for is there.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a layout that is not in the list of
    /// [`ImportedTexture::layout`].
    pub unsafe fn acquire_texture(&self, texture: TextureHandle, layout: vk::ImageLayout) -> Result<()> {
        let texture = self.device_state().store.textures.get(texture)?;
        let layout = layout_from_vulkan(layout).map_err(|why| Error::usage(&texture.name, why))?;
        self.device_state().submitter.import_texture(texture.image.id, texture.image.shape, layout);
        Ok(())
    }

    /// As [`submit`](Self::submit), waiting for semaphores of somebody else's before the first of it, uploads included, and
    /// signalling others after the last.
    ///
    /// # Safety
    /// The semaphores belong to this device. Binary ones have a signal under way that nobody else waits for, or are not
    /// signalled; the values of timelines rise, and those waited for will come.
    ///
    /// # Errors
    /// As [`submit`](Self::submit).
    pub unsafe fn submit_with(
        &self,
        cmd: CommandBuffer,
        waits: &[RawWait],
        signals: &[RawSignal],
    ) -> Result<SubmitHandle> {
        let info = |semaphore, value| vk::SemaphoreSubmitInfo::default().semaphore(semaphore).value(value);
        let waits = waits.iter().map(|wait| info(wait.semaphore, wait.value).stage_mask(wait.stages));
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let signals = signals.iter().map(|signal| info(signal.semaphore, signal.value).stage_mask(all));
        let (waits, signals): (Vec<_>, Vec<_>) = (waits.collect(), signals.collect());
        let exchanges = !waits.is_empty() || !signals.is_empty();
        self.submit_with_semaphores(cmd, Submission { waits, signals, exchanges, ..Submission::default() })
    }

    /// The timeline semaphore of what is submitted to the graphics queue; [`SubmitHandle::raw_value`] is the value that a
    /// submission reaches. Others may wait for it, and must not signal it.
    pub fn raw_timeline(&self) -> vk::Semaphore {
        self.raw_timeline_of(Queue::Graphics)
    }

    /// As [`raw_timeline`](Self::raw_timeline), of another queue; queues that share hardware share it too.
    pub fn raw_timeline_of(&self, queue: Queue) -> vk::Semaphore {
        let shared = self.device_state();
        shared.submitter.timeline(shared.gpu.queues.queue_index(queue)).raw
    }
}
