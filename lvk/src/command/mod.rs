//! Command buffers. Every command checks its arguments, places the barriers it needs and records itself.

pub(crate) mod accel;
mod accel_copy;
pub(crate) mod attachment;
pub(crate) mod bind;
pub(crate) mod compute;
pub(crate) mod dependencies;
pub(crate) mod draw_count;
mod draw_mesh;
mod dynamic;
pub(crate) mod flush;
mod found;
pub(crate) mod gpu_build;
mod instances;
mod kernel;
mod label;
mod local_read;
mod part_uses;
mod pass_area;
mod present;
pub(crate) mod query;
mod query_log;
pub(crate) mod queue_check;
pub(crate) mod render;
pub(crate) mod render_pass;
mod resolve;
mod shading_rate;
mod software;
mod targets;
pub(crate) mod tlas;
pub(crate) mod trace;
pub(crate) mod transfer;
mod upload;
pub(crate) mod uses;

use std::collections::{HashMap, HashSet};
use std::mem::ManuallyDrop;
use std::sync::Arc;

use ash::vk;

use crate::accel::compaction::SizeQuery;
use crate::accel::tlas_updates::TlasUpdates;
use crate::barrier::{Barriers, ResourceId, Use};
use crate::error::Result;
use crate::gpu::queues::Queue;
use crate::handle::{BufferHandle, TextureHandle};
use crate::pipeline::{ComputePipeline, RayTracingPipeline};
use crate::resource::{Buffer, Texture};
use crate::shared::Shared;
use crate::submit::Recording;
use crate::submit::emit::LastBarrier;
use crate::submit::profiler::Scopes;
use crate::upload::staging::StagingChunk;

use accel::OpenBuild;
use bind::PushConstants;
use found::Found;
use query_log::QueryLog;
use transfer::Settle;
use uses::Uses;

/// Records commands for one submission.
///
/// Take one from [`Context::acquire_command_buffer`](crate::Context::acquire_command_buffer) or
/// [`acquire_command_buffer_on`](crate::Context::acquire_command_buffer_on) a queue, and hand it to
/// [`Context::submit`](crate::Context::submit). Several may be recorded side by side on different threads; the GPU
/// sees them in the order of submission. Barriers, descriptor sets and the lifetime of everything used are the
/// library's business. A command that answers an error has recorded nothing; the command buffer stays usable.
/// Dropping a command buffer gives it up.
pub struct CommandBuffer {
    shared: Arc<Shared>,
    queue: Queue,
    recording: ManuallyDrop<Recording>,
    finished: bool,
    found_buffers: Found<BufferHandle, Buffer>,
    found_textures: Found<TextureHandle, Texture>,
    uses: Uses,
    barriers: Barriers,
    last_barrier: LastBarrier,
    compute: Option<Arc<ComputePipeline>>,
    ray_tracing: Option<Arc<RayTracingPipeline>>,
    sets_bound: Vec<vk::PipelineBindPoint>,
    push_constants: PushConstants,
    host_reads: Vec<ResourceId>,
    open_labels: u32,
    /// Whether a render pass is open; it stays so where its value was forgotten instead of dropped.
    rendering: bool,
    /// Whether one was ever begun.
    had_pass: bool,
    /// Views that the open pass draws at once: every query takes so many. 1 outside of passes.
    views: u32,
    settle: Vec<Settle>,
    tlas_updates: TlasUpdates,
    /// Small regions of staging memory come from here.
    staged: StagingChunk,
    open_builds: Vec<OpenBuild>,
    /// Refits since the last rebuild of each bottom-level structure that is built here, by its id.
    refits: HashMap<u64, u32>,
    size_queries: Vec<Arc<SizeQuery>>,
    queries: QueryLog,
    /// Present where the command buffer is profiled.
    scopes: Option<Box<Scopes>>,
    /// Whether structures are built that nothing can show yet.
    first_builds: bool,
    /// Bottom-level structures that are built elsewhere from here on, by their ids.
    moved: HashSet<u64>,
}

/// What becomes true once a command buffer is submitted.
pub(crate) struct Outcome {
    pub(crate) tlas_updates: TlasUpdates,
    pub(crate) builds: Vec<OpenBuild>,
    pub(crate) size_queries: Vec<Arc<SizeQuery>>,
    queries: QueryLog,
    /// Present where the command buffer was profiled.
    pub(crate) scopes: Option<Box<Scopes>>,
}

impl Outcome {
    /// The command buffer went to the GPU with this timeline value.
    pub(crate) fn submit(mut self, shared: &Shared, value: u64) {
        self.tlas_updates.drain().for_each(|update| shared.show(update).submitted(value));
        shared.spare_updates.give(self.tlas_updates);
        self.builds.into_iter().for_each(|build| build.submit(value));
        self.size_queries.iter().for_each(|query| query.submit());
        self.queries.submit();
    }
}

impl CommandBuffer {
    pub(crate) fn new(shared: &Arc<Shared>, queue: Queue) -> Result<Self> {
        let recording = shared.submitter.acquire(queue)?;
        if let Some(checks) = &shared.bindless.checks {
            checks.begin(&shared.gpu, recording.commands, recording.sequence);
        }
        Ok(Self {
            scopes: shared.profiler.begin(recording.commands, queue),
            queue,
            recording: ManuallyDrop::new(recording),
            shared: Arc::clone(shared),
            finished: false,
            found_buffers: Found::default(),
            found_textures: Found::default(),
            uses: Uses::default(),
            barriers: Barriers::default(),
            last_barrier: LastBarrier::default(),
            compute: None,
            ray_tracing: None,
            sets_bound: Vec::new(),
            push_constants: PushConstants::default(),
            host_reads: Vec::new(),
            open_labels: 0,
            rendering: false,
            views: 1,
            had_pass: false,
            settle: Vec::new(),
            tlas_updates: TlasUpdates::default(),
            staged: StagingChunk::default(),
            open_builds: Vec::new(),
            refits: HashMap::new(),
            size_queries: Vec::new(),
            queries: QueryLog::default(),
            first_builds: false,
            moved: HashSet::new(),
        })
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
    pub(crate) fn belongs_to(&self, shared: &Arc<Shared>) -> bool {
        Arc::ptr_eq(&self.shared, shared)
    }

    /// Fails where images of a swapchain are used that the presentation engine has, and where another queue uses what only the
    /// graphics queue may.
    pub(crate) fn check_images(&self) -> Result<()> {
        if self.queue != Queue::Graphics {
            self.shared.submitter.check_queue(&self.recording.tracker)?;
        }
        self.shared.submitter.check(&self.recording.tracker)
    }

    /// Ends the recording. Answers also what becomes true once it is submitted.
    pub(crate) fn finish(mut self) -> (Recording, Outcome) {
        self.pop_labels(0);
        self.end_open_queries();
        self.settle();
        for id in std::mem::take(&mut self.host_reads) {
            self.uses.id(id, Use::host_read());
        }
        self.flush();
        self.stamp(None);
        self.refer_to_queries();
        self.finished = true;
        // SAFETY: `finished` keeps `drop` from taking the recording again.
        let recording = unsafe { ManuallyDrop::take(&mut self.recording) };
        let outcome = Outcome {
            tlas_updates: std::mem::take(&mut self.tlas_updates),
            builds: std::mem::take(&mut self.open_builds),
            size_queries: std::mem::take(&mut self.size_queries),
            queries: std::mem::take(&mut self.queries),
            scopes: self.scopes.take(),
        };
        (recording, outcome)
    }
}

impl Drop for CommandBuffer {
    fn drop(&mut self) {
        if !self.finished {
            // SAFETY: only `finish` takes the recording too, and it sets `finished`.
            let recording = unsafe { ManuallyDrop::take(&mut self.recording) };
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
