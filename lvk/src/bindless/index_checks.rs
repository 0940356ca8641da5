//! The buffer in which shaders check their bindless indices, and the faults that they write.
//!
//! The buffer holds one word for each slot: the number of the last command buffer that may access the slot's owner. The
//! word is 0 for a slot without owner and all ones while the owner is alive. After the owner's handle is destroyed, the
//! word is the number of the last command buffer begun before.
//!
//! Every command buffer first writes its own number into a word before those of the slots. Therefore commands recorded
//! while the owner was alive may still access it, and later commands may not.
//!
//! A second word for each slot of a texture holds the number of the last command that declared the texture in its
//! dependencies, and whether a command has written the texture since it was last readable everywhere. Every command first
//! writes its number and the words of its textures. A shader that accesses a written texture of another command's number
//! lacks a declaration, and so does a shader that writes one.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

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
    /// The owner is alive, but the command does not list it in its [`Dependencies`](crate::Dependencies), although the
    /// shader writes it, or an earlier command wrote it. The access is a hazard, perhaps in a wrong layout.
    Undeclared,
}

/// Accesses of one shader with the same wrong index, or to the same undeclared texture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IndexFault {
    /// The array.
    pub array: BindlessArray,
    /// The index. The shader used index 0, the default descriptor, instead, except for
    /// [`Undeclared`](SlotState::Undeclared).
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

/// A line for a log: the shader, the index, the cause with the name of the object, and the remedy.
impl fmt::Display for IndexFault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { array, index, state, object, shader, count } = self;
        let object = object.as_deref().unwrap_or_default();
        write!(out, "shader '{shader}' used index {index} of {array:?} {count} times: ")?;
        match state {
            SlotState::NeverCreated => out.write_str("no object has had it; pass the index of a live object"),
            SlotState::Freed => write!(
                out,
                "'{object}' was destroyed before the command buffer was begun; keep its Holder while shaders use the index"
            ),
            SlotState::OtherUsage => {
                write!(out, "'{object}' lacks the usage of this array; create it with SAMPLED or STORAGE")
            }
            SlotState::Undeclared => {
                write!(out, "'{object}' is missing in the Dependencies of the command; name it there")
            }
        }
    }
}

impl BindlessArray {
    pub(crate) const ALL: [Self; 4] =
        [Self::Textures, Self::Samplers, Self::StorageImages, Self::AccelStructs];
}

/// Positions in the buffer, in words. `shader/glsl/checked_index.glsl` has the same numbers.
const CURRENT: u32 = 0;
const LOST: usize = 1;
/// The number of the current command.
const COMMAND: u32 = 2;
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
    /// Position of the declarations of textures.
    pub(crate) declarations: u32,
}

impl CheckPlan {
    /// Returns the position of the declarations of an array; 0 for arrays without.
    pub(crate) fn declarations_of(&self, array: usize) -> u32 {
        let is_texture = matches!(
            BindlessArray::ALL.get(array),
            Some(BindlessArray::Textures | BindlessArray::StorageImages)
        );
        if is_texture { self.declarations } else { 0 }
    }
}

/// Access of a command to the texture of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SlotAccess {
    pub(crate) slot: u32,
    /// The dependencies of the command list the texture.
    pub(crate) is_declared: bool,
    /// Later commands need a declaration.
    pub(crate) is_written: bool,
}

/// The buffer of the index checks, and the current and former owners of each slot.
pub(crate) struct IndexChecks {
    pub(crate) buffer: Arc<Buffer>,
    arrays: [WordRange; 4],
    /// Position of the declarations of textures.
    declarations: u32,
    /// Number of the last command.
    commands: AtomicU32,
    /// Accesses of the faults that the application has asked for.
    reported: AtomicU32,
    known: Mutex<SlotOwners>,
}

/// Returns the number of accesses of all faults.
fn accesses_of(faults: &[IndexFault]) -> u32 {
    faults.iter().fold(0, |sum: u32, fault| sum.wrapping_add(fault.count))
}

/// Returns the number of a name, which it gets when it first comes: modules that are compiled again have the numbers of those before.
fn number_of(names: &mut Vec<String>, name: &str) -> u32 {
    let known = names.iter().position(|known| known == name);
    let number = known.unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    });
    number as u32
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
        let declarations = first;
        first += counts[BindlessArray::Textures as usize];
        let desc = BufferDesc {
            size_bytes: u64::from(first) * 4,
            memory: MemoryKind::HostVisible,
            debug_name: "states of bindless slots",
            ..Default::default()
        };
        let buffer = Arc::new(Buffer::new(gpu, &desc, InternalUsage::NONE)?);
        buffer.fill_with(|bytes| bytes.fill(0));
        let known = Mutex::new(Rank::SlotOwners, SlotOwners::default());
        let checks = Self {
            buffer,
            arrays,
            declarations,
            commands: AtomicU32::new(0),
            reported: AtomicU32::new(0),
            known,
        };
        BindlessArray::ALL.into_iter().for_each(|array| checks.write(array, 0, ALIVE));
        Ok(checks)
    }

    /// Returns the check parameters of a module of this name.
    pub(crate) fn plan(&self, shader: &str) -> CheckPlan {
        CheckPlan {
            address: self.buffer.address,
            shader: number_of(&mut self.lock().shaders, shader),
            arrays: self.arrays,
            declarations: self.declarations,
        }
    }

    /// Records the owner of a slot. A texture owns the slot in both of its arrays.
    pub(super) fn reserve(&self, arrays: &[BindlessArray], slot: u32, name: &str) {
        let mut known = self.lock();
        arrays.iter().for_each(|array| _ = known.owners.insert((*array, slot), name.to_owned()));
        drop(known);
        let is_texture = arrays.contains(&BindlessArray::Textures);
        if is_texture && slot < self.arrays[BindlessArray::Textures as usize].count {
            self.buffer.write(u64::from(self.declarations + slot) * 4, &0_u32.to_ne_bytes());
        }
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
        barrier(gpu, commands, ALL, TRANSFER);
        self.record_word(gpu, commands, CURRENT, sequence as u32);
        barrier(gpu, commands, TRANSFER, ALL);
    }

    /// Records that the host may read the faults of a command buffer at its end.
    pub(crate) fn record_end(&self, gpu: &Gpu, commands: vk::CommandBuffer) {
        barrier(gpu, commands, ALL, HOST);
    }

    /// Records the accesses of the next command to textures, after all earlier commands.
    pub(crate) fn record_accesses(&self, gpu: &Gpu, commands: vk::CommandBuffer, accesses: &[SlotAccess]) {
        // The lowest bit of a declaration tells whether the texture is written.
        let command = (self.commands.fetch_add(1, Ordering::Relaxed) + 1) & (u32::MAX >> 1);
        barrier(gpu, commands, ALL, TRANSFER);
        self.record_word(gpu, commands, COMMAND, command);
        for access in accesses {
            let number = if access.is_declared { command } else { 0 };
            let word = number << 1 | u32::from(access.is_written);
            self.record_word(gpu, commands, self.declarations + access.slot, word);
        }
        barrier(gpu, commands, TRANSFER, ALL);
    }

    fn record_word(&self, gpu: &Gpu, commands: vk::CommandBuffer, position: u32, word: u32) {
        // SAFETY: the command buffer is being recorded outside of a pass; the buffer lives as long as the context.
        unsafe {
            gpu.device.cmd_update_buffer(
                commands,
                self.buffer.raw,
                u64::from(position) * 4,
                &word.to_ne_bytes(),
            );
        }
    }

    /// Logs the faults at the end of a context, unless the application has asked for all of them. The device is idle.
    pub(crate) fn log_faults(&self) {
        let mut words = vec![0_u32; Self::fault_bytes() as usize / 4];
        self.buffer.read(0, bytemuck::cast_slice_mut(&mut words));
        let faults = self.decode_faults(&words);
        if accesses_of(&faults) != self.reported.load(Ordering::Relaxed) {
            faults.iter().for_each(|fault| log::error!("{fault}"));
        }
    }

    /// Returns the faults in a copy of the buffer's first [`fault_bytes`](Self::fault_bytes), sorted by array, index
    /// and shader, for the application: [`log_faults`](Self::log_faults) logs nothing unless others come.
    pub(crate) fn report_faults(&self, words: &[u32]) -> Vec<IndexFault> {
        let faults = self.decode_faults(words);
        self.reported.store(accesses_of(&faults), Ordering::Relaxed);
        faults
    }

    fn decode_faults(&self, words: &[u32]) -> Vec<IndexFault> {
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
            ALIVE => SlotState::Undeclared,
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

const ALL: SyncScope = (
    vk::PipelineStageFlags2::ALL_COMMANDS,
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
    ),
);
const TRANSFER: SyncScope = (
    vk::PipelineStageFlags2::ALL_TRANSFER,
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::TRANSFER_READ.as_raw() | vk::AccessFlags2::TRANSFER_WRITE.as_raw(),
    ),
);

const HOST: SyncScope = (vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_that_is_compiled_again_has_the_number_of_the_one_before() {
        let mut names = Vec::new();
        let numbers = ["sky", "sea", "sky", "land", "sea"].map(|name| number_of(&mut names, name));
        assert_eq!((numbers, names.len()), ([0, 1, 0, 2, 1], 3));
    }
}
