//! Command buffers: every command checks its arguments, records the barriers it needs and then itself.

pub(crate) mod accesses;
pub(crate) mod barriers;
pub(crate) mod bind;
pub(crate) mod build_blas;
mod build_micromap;
mod build_tlas;
pub(crate) mod compute;
mod copy_accel;
mod declared_accesses;
pub(crate) mod dependencies;
mod instance_kernel;
mod kernel_dispatch;
mod label;
mod open_build;
mod pending_visibility;
#[cfg(feature = "window")]
mod present;
mod push_constants;
pub(crate) mod query;
mod query_usage;
pub(crate) mod queue_support;
mod recording_state;
pub(crate) mod render;
mod subresource_accesses;
mod tlas_table;
pub(crate) mod trace;
mod trace_lowered;
pub(crate) mod transfer;
mod transient_steps;
pub(crate) mod update_tlas;
mod upload;
mod upload_value;

use std::mem::ManuallyDrop;
use std::sync::Arc;

use ash::vk;

use crate::barrier::Use;
use crate::device_state::SharedDeviceState;
use crate::error::Result;
use crate::pipeline::{ComputePipeline, RayTracingPipeline};
use crate::queue::Queue;
use crate::submit::Recording;
use crate::submit::profiler::Scopes;
use crate::upload::staging::{ChunkMemory, StagingChunk};

use recording_state::RecordingState;
pub(crate) use recording_state::RecordingStatePool;

/// Records commands for one submission.
///
/// [`Context::acquire_command_buffer`](crate::Context::acquire_command_buffer) and
/// [`acquire_command_buffer_on`](crate::Context::acquire_command_buffer_on) return a command buffer, and
/// [`Context::submit`](crate::Context::submit) takes it. Several may be recorded at the same time on different threads;
/// the GPU executes them in the order of submission. The library records the barriers, binds the descriptor sets and
/// keeps the used objects alive. A command that returns an error has recorded nothing, and the command buffer stays
/// usable. The exceptions are builds that run out of memory half way, as their documentation says:
/// [`Context::submit`](crate::Context::submit) then rejects the command buffer. Dropping a command buffer discards it.
pub struct CommandBuffer {
    pub(crate) shared: Arc<SharedDeviceState>,
    queue: Queue,
    finished: bool,
    pub(crate) recording: ManuallyDrop<Box<Recording>>,
    pub(crate) state: ManuallyDrop<Box<RecordingState>>,
    compute: Option<Arc<ComputePipeline>>,
    ray_tracing: Option<Arc<RayTracingPipeline>>,
    open_labels: u32,
    /// True while a render pass is open. Stays true if the [`RenderPass`](render::pass::RenderPass) was forgotten
    /// instead of dropped.
    rendering: bool,
    /// True once a render pass was begun.
    had_pass: bool,
    /// Views that the open pass draws at once, and the number of queries that each query command uses; 1 outside of
    /// passes.
    views: u32,
    /// Staging chunk that small regions are allocated from.
    staged: StagingChunk,
    /// Chunk that [`upload`](Self::upload) allocates small values from.
    uploaded: StagingChunk,
    /// `Some` if the command buffer is profiled.
    scopes: Option<Box<Scopes>>,
}

/// The part of a command buffer that is kept after its recording has ended.
pub(crate) struct FinishedRecording {
    /// Effects of the commands, applied when the command buffer is submitted.
    pub(crate) state: Box<RecordingState>,
    /// `Some` if the command buffer was profiled.
    pub(crate) scopes: Option<Box<Scopes>>,
}

impl CommandBuffer {
    /// Creates a command buffer that records into `recording` and `state`, both empty.
    pub(crate) fn new(
        shared: &Arc<SharedDeviceState>,
        queue: Queue,
        recording: Box<Recording>,
        state: Box<RecordingState>,
    ) -> Self {
        if let Some(checks) = &shared.bindless.checks {
            checks.record_begin(&shared.gpu, recording.commands, recording.sequence);
        }
        Self {
            scopes: shared.profiler.begin_command_buffer(recording.commands, queue),
            shared: Arc::clone(shared),
            queue,
            finished: false,
            recording: ManuallyDrop::new(recording),
            state: ManuallyDrop::new(state),
            compute: None,
            ray_tracing: None,
            open_labels: 0,
            rendering: false,
            had_pass: false,
            views: 1,
            staged: StagingChunk::new(ChunkMemory::Cached),
            uploaded: StagingChunk::new(ChunkMemory::NearGpu),
        }
    }

    /// Returns the Vulkan command buffer, for commands the library does not have.
    ///
    /// The library does not track commands recorded this way: the caller records their barriers, and leaves images in
    /// the layout they had before. Pipelines and push constants must be bound again afterwards. So must the bindless
    /// set ([`Context::raw_descriptor_set`](crate::Context::raw_descriptor_set)) if another set replaced it.
    #[inline]
    pub fn raw(&self) -> vk::CommandBuffer {
        self.recording.commands
    }

    /// True if the command buffer was created by the context that owns `shared`.
    pub(crate) fn belongs_to(&self, shared: &Arc<SharedDeviceState>) -> bool {
        Arc::ptr_eq(&self.shared, shared)
    }

    /// Fails if the command buffer uses swapchain images that the presentation engine owns. On queues other than the
    /// graphics queue, also fails if it uses resources that only the graphics queue may use.
    pub(crate) fn check_images(&self) -> Result<()> {
        if self.queue != Queue::Graphics {
            self.shared.submitter.check_queue(&self.recording.tracker)?;
        }
        self.shared.submitter.check_presentables(&self.recording.tracker)
    }

    /// Ends the recording.
    pub(crate) fn finish(mut self) -> (Box<Recording>, FinishedRecording) {
        self.pop_labels(0);
        self.end_open_queries();
        self.make_visible();
        self.make_visible_to_host();
        self.flush_barriers();
        self.end_transient_steps();
        self.write_label_timestamp(None);
        self.reference_query_pools();
        if let Some(checks) = &self.shared.bindless.checks {
            checks.record_end(&self.shared.gpu, self.recording.commands);
        }
        self.finished = true;
        // SAFETY: `finished` keeps `drop` from taking both again.
        let (recording, state) =
            unsafe { (ManuallyDrop::take(&mut self.recording), ManuallyDrop::take(&mut self.state)) };
        (recording, FinishedRecording { state, scopes: self.scopes.take() })
    }

    /// Makes writes to mapped memory visible to the host.
    fn make_visible_to_host(&mut self) {
        let RecordingState { accesses: uses, host_reads, .. } = &mut **self.state;
        host_reads.drain(..).for_each(|id| uses.add_id(id, Use::host_read()));
    }
}

impl Drop for CommandBuffer {
    fn drop(&mut self) {
        if !self.finished {
            // SAFETY: only `finish` takes these too, and it sets `finished`.
            let (recording, _notes) =
                unsafe { (ManuallyDrop::take(&mut self.recording), ManuallyDrop::take(&mut self.state)) };
            self.shared.submitter.discard(recording);
            if let Some(scopes) = self.scopes.take() {
                self.shared.profiler.discard(*scopes);
            }
        }
    }
}

impl std::fmt::Debug for CommandBuffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CommandBuffer").field("sequence", &self.recording.sequence).finish()
    }
}
