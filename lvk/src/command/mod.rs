//! Command buffers. Every command checks its arguments, places the barriers it needs and records itself.

pub(crate) mod accesses;
pub(crate) mod barriers;
pub(crate) mod bind;
pub(crate) mod build_blas;
mod build_tlas;
pub(crate) mod compute;
mod copy_accel;
pub(crate) mod dependencies;
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
pub(crate) mod transfer;
pub(crate) mod update_tlas;
mod upload;

use std::mem::ManuallyDrop;
use std::sync::Arc;

use ash::vk;

use crate::barrier::Use;
use crate::device_state::DeviceState;
use crate::error::Result;
use crate::pipeline::{ComputePipeline, RayTracingPipeline};
use crate::queue::Queue;
use crate::submit::Recording;
use crate::submit::profiler::Scopes;
use crate::upload::staging::StagingChunk;

use recording_state::RecordingState;
pub(crate) use recording_state::RecordingStatePool;

/// Records commands for one submission.
///
/// Take one from [`Context::acquire_command_buffer`](crate::Context::acquire_command_buffer) or
/// [`acquire_command_buffer_on`](crate::Context::acquire_command_buffer_on) a queue, and hand it to
/// [`Context::submit`](crate::Context::submit). Several may be recorded side by side on different threads; the GPU
/// sees them in the order of submission. Barriers, descriptor sets and the lifetime of everything used are the
/// library's business. A command that answers an error has recorded nothing; the command buffer stays usable. The exceptions are
/// builds that run out of memory half way: they say so, and [`Context::submit`](crate::Context::submit) refuses the command buffer.
/// Dropping a command buffer gives it up.
pub struct CommandBuffer {
    pub(crate) shared: Arc<DeviceState>,
    queue: Queue,
    finished: bool,
    pub(crate) recording: ManuallyDrop<Box<Recording>>,
    pub(crate) state: ManuallyDrop<Box<RecordingState>>,
    compute: Option<Arc<ComputePipeline>>,
    ray_tracing: Option<Arc<RayTracingPipeline>>,
    open_labels: u32,
    /// Whether a render pass is open; it stays so where its value was forgotten instead of dropped.
    rendering: bool,
    /// Whether one was ever begun.
    had_pass: bool,
    /// Views that the open pass draws at once: every query takes so many. 1 outside of passes.
    views: u32,
    /// Small regions of staging memory come from here.
    staged: StagingChunk,
    /// Present where the command buffer is profiled.
    scopes: Option<Box<Scopes>>,
}

/// What is left of a command buffer once it is complete.
pub(crate) struct FinishedRecording {
    /// What becomes true when it is submitted.
    pub(crate) state: Box<RecordingState>,
    /// Present where it was profiled.
    pub(crate) scopes: Option<Box<Scopes>>,
}

impl CommandBuffer {
    /// Commands go to `recording`, and what is to be remembered of them to `state`, which are empty.
    pub(crate) fn new(
        shared: &Arc<DeviceState>,
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
            staged: StagingChunk::default(),
        }
    }

    /// The Vulkan command buffer, for commands the library does not have.
    ///
    /// What is recorded this way is not tracked: the caller places its barriers, and leaves images in the layout it
    /// found them in. Pipelines and push constants must be bound again afterwards, and so must the bindless set
    /// ([`Context::raw_descriptor_set`](crate::Context::raw_descriptor_set)) where another set took its place.
    #[inline]
    pub fn raw(&self) -> vk::CommandBuffer {
        self.recording.commands
    }

    /// Whether the command buffer was made by the context with these parts.
    pub(crate) fn belongs_to(&self, shared: &Arc<DeviceState>) -> bool {
        Arc::ptr_eq(&self.shared, shared)
    }

    /// Fails where images of a swapchain are used that the presentation engine has, and where another queue uses what only the
    /// graphics queue may.
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
        self.write_label_timestamp(None);
        self.reference_query_pools();
        self.finished = true;
        // SAFETY: `finished` keeps `drop` from taking both again.
        let (recording, state) =
            unsafe { (ManuallyDrop::take(&mut self.recording), ManuallyDrop::take(&mut self.state)) };
        (recording, FinishedRecording { state, scopes: self.scopes.take() })
    }

    /// The host sees what was written in mapped memory.
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
