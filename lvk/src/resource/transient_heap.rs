//! Memory that textures with different lifetimes share, and the lifetimes.

use std::mem::ManuallyDrop;
use std::sync::Arc;

use ash::vk;

use super::texture_desc::TextureDesc;
use crate::barrier::{ResourceId, TextureShape, Use};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::{MemoryKind, ObjectMemory};
use crate::queue::Queue;

/// A texture of a [`TransientHeapDesc`] with its lifetime.
#[derive(Debug, Clone, Copy)]
pub struct TransientTexture<'a> {
    /// The texture. It takes no data, and its format is not a Y'CbCr format. With [`TextureMemory::Transient`](crate::TextureMemory), it has
    /// lazily allocated memory of its own where the device has such memory, and shares memory elsewhere.
    pub desc: TextureDesc<'a>,
    /// First step in which the texture has contents.
    pub first_step: u32,
    /// Last step in which the texture has contents, at least `first_step`.
    pub last_step: u32,
}

/// Describes textures that share memory, for [`Context::create_transient_heap`](crate::Context::create_transient_heap).
#[derive(Debug, Clone, Copy)]
pub struct TransientHeapDesc<'a> {
    /// The textures with their lifetimes. Steps are numbers of the application, usually one for each pass of a frame.
    /// Default: empty.
    pub textures: &'a [TransientTexture<'a>],
    /// Queue of the command buffers that use the textures. Default: [`Queue::Graphics`].
    pub queue: Queue,
    /// Name in error messages. Default: `"transient heap"`.
    pub debug_name: &'a str,
}

impl Default for TransientHeapDesc<'_> {
    fn default() -> Self {
        Self { textures: &[], queue: Queue::Graphics, debug_name: "transient heap" }
    }
}

/// Memory of a transient heap, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TransientHeapMemory {
    /// Memory that the textures share.
    pub shared_bytes: u64,
    /// Memory that the same textures would take without sharing.
    pub separate_bytes: u64,
    /// Size of the textures in lazily allocated memory, which are in neither of the other numbers.
    pub lazy_bytes: u64,
}

/// A block of memory that images are bound to, freed with the last of them.
pub(crate) struct SharedBlock {
    memory: ManuallyDrop<ObjectMemory>,
    gpu: Arc<Gpu>,
}

impl SharedBlock {
    pub(super) fn new(gpu: &Arc<Gpu>, name: &str, requirements: vk::MemoryRequirements) -> Result<Arc<Self>> {
        let memory = gpu.allocate(name, requirements, MemoryKind::Device, false)?;
        Ok(Arc::new(Self { memory: ManuallyDrop::new(memory), gpu: Arc::clone(gpu) }))
    }

    /// Returns the Vulkan memory and the offset in it for an offset in the block.
    pub(super) fn place(&self, offset: u64) -> (vk::DeviceMemory, u64) {
        (self.memory.raw, self.memory.offset + offset)
    }
}

impl Drop for SharedBlock {
    fn drop(&mut self) {
        // SAFETY: the memory is taken once, as the block is dropped once.
        self.gpu.free(unsafe { ManuallyDrop::take(&mut self.memory) });
    }
}

/// The lifetimes of all textures of a heap, and which of them share bytes.
#[derive(Debug)]
pub(crate) struct TransientPlan {
    pub(crate) name: String,
    pub(crate) queue: Queue,
    pub(crate) members: Vec<TransientMember>,
}

/// A texture of a heap.
#[derive(Debug)]
pub(crate) struct TransientMember {
    pub(crate) image: ResourceId,
    pub(crate) shape: TextureShape,
    /// Identity of the bytes of the texture for barriers.
    pub(crate) bytes: ResourceId,
    /// First and last step, both inclusive.
    pub(crate) steps: [u32; 2],
    /// Members that share bytes with this one, itself among them.
    pub(crate) sharers: Vec<usize>,
    /// Every use that may be the first of the texture.
    pub(crate) first_use: Use,
}

impl TransientMember {
    pub(crate) fn lives_in(&self, step: u32) -> bool {
        (self.steps[0]..=self.steps[1]).contains(&step)
    }
}

/// The member of a heap that an image is.
#[derive(Debug, Clone)]
pub(crate) struct TransientPlace {
    pub(crate) plan: Arc<TransientPlan>,
    pub(crate) member: usize,
}

impl TransientPlace {
    pub(crate) fn member(&self) -> &TransientMember {
        &self.plan.members[self.member]
    }

    /// Returns the error for a use of the texture `name` without a step of its heap.
    pub(crate) fn not_begun(&self, name: &str) -> Error {
        let message = format!(
            "it is a texture of the transient heap '{}', whose contents exist only in one command buffer; call \
             begin_transient_step there before the use",
            self.plan.name
        );
        Error::usage(name, message)
    }
}
