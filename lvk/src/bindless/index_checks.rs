//! The buffer in which shaders check their bindless indices, and the faults that they write.
//!
//! The buffer holds one word for each slot: the number of the last command buffer that may access the slot's owner. The
//! word is 0 for a slot without owner and all ones while the owner is alive. After the owner's handle is destroyed, the
//! word is the number of the last command buffer begun before.
//!
//! Every command buffer first writes its own number into a word before those of the slots. Therefore commands recorded
//! while the owner was alive may still access it, and later commands may not.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;

use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::memory::allocator::MemoryKind;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, InternalUsage};

/// An array of the bindless set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BindlessArray {
    /// Sampled textures: `kTextures2D` and the arrays of other kinds.
    Textures,
    /// `kSamplers` and `kSamplersShadow`.
    Samplers,
    /// Storage images: `kImages2D` and the arrays of other kinds.
    StorageImages,
    /// Top-level acceleration structures: `kTLAS`, and the indices that the library's helpers and ray queries take.
    AccelStructs,
}

/// State of a slot that a wrong index refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SlotState {
    /// No object has had the index since the creation of the context, or the index is beyond the array.
    NeverCreated,
    /// The handle of the owner was destroyed before the command buffer was begun.
    Freed,
    /// The owner lacks the usage that this array needs: a texture without `SAMPLED` or `STORAGE`.
    OtherUsage,
}

/// Accesses of one shader with the same wrong index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IndexFault {
    /// The array.
    pub array: BindlessArray,
    /// The index. The shader used index 0, the default descriptor, instead.
    pub index: u32,
    /// State of the slot.
    pub state: SlotState,
    /// Debug name of the object that has or last had the index, if any.
    pub object: Option<String>,
    /// Debug name of the shader module.
    pub shader: String,
    /// Number of accesses, counted by invocation. Helper invocations do not count.
    pub count: u32,
}

impl BindlessArray {
    pub(crate) const ALL: [Self; 4] =
        [Self::Textures, Self::Samplers, Self::StorageImages, Self::AccelStructs];
}

/// Positions in the buffer, in words. `shader/glsl/checked_index.glsl` has the same numbers.
const CURRENT: u32 = 0;
const LOST: usize = 1;
const ENTRIES: u32 = 16;
pub(crate) const ENTRY_COUNT: u32 = 4096;
const ENTRY_WORDS: u32 = 8;
const STATES: u32 = ENTRIES + ENTRY_COUNT * ENTRY_WORDS;
const FREE: u32 = 0;
const ALIVE: u32 = u32::MAX;

/// Position of the words of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WordRange {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// Parameters of the index checks of a shader.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CheckPlan {
    pub(crate) address: u64,
    /// The shader number in its faults.
    pub(crate) shader: u32,
    /// Word ranges in the order of [`BindlessArray::ALL`].
    pub(crate) arrays: [WordRange; 4],
}

/// The buffer of the index checks, and the current and former owners of each slot.
pub(crate) struct IndexChecks {
    pub(crate) buffer: Arc<Buffer>,
    arrays: [WordRange; 4],
    known: Mutex<SlotOwners>,
}

#[derive(Default)]
struct SlotOwners {
    /// The current or last owner of a slot.
    owners: HashMap<(BindlessArray, u32), String>,
    shaders: Vec<String>,
}

impl IndexChecks {
    /// Creates the buffer. `counts` are the slots of each array.
    pub(crate) fn new(gpu: &Arc<Gpu>, counts: [u32; 4]) -> Result<Self> {
        let mut first = STATES;
        let arrays = counts.map(|count| {
            first += count;
            WordRange { first: first - count, count }
        });
        let desc = BufferDesc {
            size_bytes: u64::from(first) * 4,
            memory: MemoryKind::HostVisible,
            debug_name: "states of bindless slots",
            ..Default::default()
        };
        let buffer = Arc::new(Buffer::new(gpu, &desc, InternalUsage::NONE)?);
        buffer.fill_with(|bytes| bytes.fill(0));
        let checks = Self { buffer, arrays, known: Mutex::new(Rank::SlotOwners, SlotOwners::default()) };
        BindlessArray::ALL.into_iter().for_each(|array| checks.write(array, 0, ALIVE));
        Ok(checks)
    }

    /// Returns the check parameters of a module of this name.
    pub(crate) fn plan(&self, shader: &str) -> CheckPlan {
        let mut known = self.lock();
        known.shaders.push(shader.to_owned());
        CheckPlan {
            address: self.buffer.address,
            shader: known.shaders.len() as u32 - 1,
            arrays: self.arrays,
        }
    }

    /// Records the owner of a slot. A texture owns the slot in both of its arrays.
    pub(super) fn reserve(&self, arrays: &[BindlessArray], slot: u32, name: &str) {
        let mut known = self.lock();
        arrays.iter().for_each(|array| _ = known.owners.insert((*array, slot), name.to_owned()));
    }

    /// Marks the owner of a slot as accessible.
    pub(super) fn mark_alive(&self, array: BindlessArray, slot: u32) {
        self.write(array, slot, ALIVE);
    }

    /// Marks the handle of a slot's owner as destroyed. Command buffers up to `newest` may still access the owner.
    pub(super) fn mark_retired(&self, array: BindlessArray, slot: u32, newest: u64) {
        self.write(array, slot, (newest as u32).clamp(1, ALIVE - 1));
    }

    /// Frees a slot. An owner that is still marked alive was never created; its word becomes 0.
    pub(super) fn mark_free(&self, array: BindlessArray, slot: u32) {
        if self.read(array, slot) == ALIVE {
            self.write(array, slot, FREE);
        }
    }

    /// Records the number of the command buffer at its begin, after all earlier commands.
    pub(crate) fn record_begin(&self, gpu: &Gpu, commands: vk::CommandBuffer, sequence: u64) {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let all = (Stage::ALL_COMMANDS, Access::MEMORY_READ | Access::MEMORY_WRITE);
        let transfer = (Stage::ALL_TRANSFER, Access::TRANSFER_READ | Access::TRANSFER_WRITE);
        barrier(gpu, commands, all, transfer);
        let number = (sequence as u32).to_le_bytes();
        // SAFETY: the command buffer is being recorded outside of a pass; the buffer lives as long as the context.
        unsafe {
            gpu.device.cmd_update_buffer(commands, self.buffer.raw, u64::from(CURRENT) * 4, &number);
        }
        barrier(gpu, commands, transfer, all);
    }

    /// Returns the faults in a copy of the buffer's first [`fault_bytes`](Self::fault_bytes), sorted by array, index
    /// and shader.
    pub(crate) fn faults(&self, words: &[u32]) -> Vec<IndexFault> {
        let (entries, _) =
            words.get(ENTRIES as usize..).unwrap_or(&[]).as_chunks::<{ ENTRY_WORDS as usize }>();
        let lost = words.get(LOST).copied().unwrap_or(0);
        if lost > 0 {
            log::warn!(
                "{lost} accesses with wrong indices are not listed: there are too many different faults"
            );
        }
        let mut faults: Vec<_> = entries.iter().filter_map(|entry| self.decode_fault(entry)).collect();
        faults.sort_by(|a, b| (a.array, a.index, &a.shader).cmp(&(b.array, b.index, &b.shader)));
        faults
    }

    /// Returns the size of the faults, which are at the start of the buffer.
    pub(crate) fn fault_bytes() -> u64 {
        u64::from(STATES) * 4
    }

    /// Decodes an entry: key, shader, array, index, the word found, and the count.
    fn decode_fault(&self, entry: &[u32; ENTRY_WORDS as usize]) -> Option<IndexFault> {
        let [key, shader, array, index, word, count, ..] = *entry;
        let array = BindlessArray::ALL.get(array as usize).copied().filter(|_| key != 0)?;
        let known = self.lock();
        let object = known.owners.get(&(array, index)).cloned();
        let state = match word {
            FREE if object.is_some() => SlotState::OtherUsage,
            FREE => SlotState::NeverCreated,
            _ => SlotState::Freed,
        };
        let shader = known.shaders.get(shader as usize).cloned().unwrap_or_default();
        Some(IndexFault { array, index, state, object, shader, count })
    }

    fn write(&self, array: BindlessArray, slot: u32, word: u32) {
        if let Some(place) = self.word_offset(array, slot) {
            self.buffer.write(place, &word.to_ne_bytes());
        }
    }

    fn read(&self, array: BindlessArray, slot: u32) -> u32 {
        let mut word = [0; 4];
        self.word_offset(array, slot).map(|place| self.buffer.read(place, &mut word));
        u32::from_ne_bytes(word)
    }

    fn word_offset(&self, array: BindlessArray, slot: u32) -> Option<u64> {
        let WordRange { first, count } = self.arrays[array as usize];
        (slot < count).then(|| u64::from(first + slot) * 4)
    }

    fn lock(&self) -> Guard<'_, SlotOwners> {
        self.known.lock()
    }
}

type SyncScope = (vk::PipelineStageFlags2, vk::AccessFlags2);

/// Records a barrier for the buffer. The trackers do not know the buffer, since shaders access it in every command.
fn barrier(gpu: &Gpu, commands: vk::CommandBuffer, from: SyncScope, to: SyncScope) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)];
    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: the command buffer is being recorded outside of a pass.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &info) };
}
