//! Transient heaps: textures that share memory because they have contents at different times.

use std::sync::Arc;

use super::Context;
use super::holder::Holder;
use crate::command::CommandBuffer;
use crate::error::{Error, Result};
use crate::handle::TextureHandle;
use crate::resource::Texture;
use crate::resource::transient_heap::{TransientHeapDesc, TransientHeapMemory, TransientPlan};
use crate::resource::transient_images::create_images;

/// Textures that share memory, created by [`Context::create_transient_heap`]. Dropping the heap destroys them.
///
/// Each texture has a handle and a bindless index for the life of the heap. Its contents exist inside one command
/// buffer, from its first to its last step ([`CommandBuffer::begin_transient_step`]).
#[derive(Debug)]
pub struct TransientHeap {
    ctx: Context,
    textures: Vec<Holder<TextureHandle>>,
    plan: Arc<TransientPlan>,
    memory: TransientHeapMemory,
}

impl TransientHeap {
    /// Returns the textures in the order of [`TransientHeapDesc::textures`].
    pub fn textures(&self) -> &[Holder<TextureHandle>] {
        &self.textures
    }

    /// Returns how much memory the textures share, and how much they would take without sharing.
    pub fn memory(&self) -> TransientHeapMemory {
        self.memory
    }
}

impl Context {
    /// Creates textures that share memory (`vkBindImageMemory` of several images to the same bytes): two textures
    /// without a common step may lie on the same bytes. Each has its own handle and bindless index.
    ///
    /// The lifetimes are given up front, so that the library packs the textures once. No frame allocates memory or
    /// writes descriptors.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for an empty list, for a last step before the first one, for data, and
    /// for Y'CbCr formats; the errors of [`create_texture`](Self::create_texture);
    /// [`OutOfDeviceMemory`](Error::OutOfDeviceMemory).
    pub fn create_transient_heap(&self, desc: &TransientHeapDesc<'_>) -> Result<TransientHeap> {
        let (images, plan, memory) = create_images(&self.device_state().gpu, desc)?;
        let textures = desc
            .textures
            .iter()
            .zip(images)
            .map(|(texture, image)| {
                let (gpu, desc) = (&self.device_state().gpu, &texture.desc);
                self.add_texture(desc, |slot| Ok(Texture::from_image(gpu, desc, image, slot)))
            })
            .collect::<Result<_>>()?;
        Ok(TransientHeap { ctx: self.clone(), textures, plan, memory })
    }
}

impl CommandBuffer {
    /// Begins a step of a transient heap: the contents of textures whose last step is over end, and textures whose
    /// lifetime contains the step begin with undefined contents.
    ///
    /// The library records the barriers where memory passes from one texture to another (`vkCmdPipelineBarrier2`),
    /// also across command buffers. A later step may skip numbers. The same step again changes nothing. An earlier
    /// step begins a new round, in which every texture begins anew. All contents end with the command buffer. Several
    /// command buffers may use one heap; the GPU executes them one after the other.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a heap of another context, and for a command buffer of another queue
    /// than that of the heap. Commands that use a texture of the heap outside of its steps fail with `InvalidUsage`
    /// too, as do commands of a command buffer that has not begun a step of the heap.
    pub fn begin_transient_step(&mut self, heap: &TransientHeap, step: u32) -> Result<()> {
        if !self.belongs_to(heap.ctx.device_state()) {
            return Err(Error::usage(&heap.plan.name, "the transient heap belongs to another context"));
        }
        self.enter_transient_step(&heap.plan, step)
    }
}
