//! Recording state of a command buffer, with memory that is reused.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use ash::vk;

use super::accesses::CommandAccesses;
use super::open_build::OpenBuild;
use super::pending_visibility::PendingVisibility;
use super::push_constants::PushConstants;
use super::query_usage::QueryUsage;
use crate::accel::AccelStruct;
use crate::accel::build_overlap::ConcurrentBuilds;
use crate::accel::compaction::CompactedSizeQuery;
use crate::accel::tlas_tracker::TlasTrackers;
use crate::barrier::{Barriers, ResourceId};
use crate::device_state::DeviceState;
use crate::handle::{BufferHandle, TextureHandle};
use crate::handle_cache::HandleCache;
use crate::lock_order::{Mutex, Rank};
use crate::resource::{Buffer, Texture};
use crate::submit::emit_barriers::LastBarrier;

/// Recording state of one command buffer: lists and maps.
#[derive(Default)]
pub(crate) struct RecordingState {
    pub(super) buffer_cache: HandleCache<BufferHandle, Buffer>,
    pub(super) texture_cache: HandleCache<TextureHandle, Texture>,
    pub(crate) accesses: CommandAccesses,
    /// Slots of the textures in the dependencies of the next command, and whether it writes them. Empty unless indices
    /// are checked.
    pub(super) declared: Vec<(u32, bool)>,
    pub(super) barriers: Barriers,
    pub(super) last_barrier: LastBarrier,
    pub(super) sets_bound: Vec<vk::PipelineBindPoint>,
    pub(super) push_constants: PushConstants,
    pub(super) host_reads: Vec<ResourceId>,
    pub(super) pending_visibility: Vec<PendingVisibility>,
    /// `Some` once a TLAS was updated.
    pub(super) tlas_trackers: Option<Box<TlasTrackers>>,
    /// Builds of TLAS that run concurrently.
    pub(super) build_run: ConcurrentBuilds,
    pub(super) open_builds: Vec<OpenBuild>,
    /// Refits since the last rebuild of each BLAS that this command buffer builds, by its id.
    pub(super) refits: HashMap<u64, u32>,
    pub(super) size_queries: Vec<Arc<CompactedSizeQuery>>,
    pub(super) queries: QueryUsage,
    /// Ids of BLAS whose CPU-built BVH is replaced from here on.
    pub(crate) moved_blas: HashSet<u64>,
    /// BLAS that the host referenced in a software TLAS by the addresses they had then, by their ids.
    pub(crate) placed_blas: HashMap<u64, Arc<AccelStruct>>,
    /// The name of the object for which a command failed with only a part of it recorded.
    pub(super) poisoned: Option<String>,
}

impl RecordingState {
    /// Applies the effects of the commands, once the command buffer is submitted with this timeline value.
    pub(crate) fn apply_submission(&mut self, shared: &DeviceState, value: u64) {
        if let Some(updates) = &mut self.tlas_trackers {
            shared.apply_tlas_updates(updates, |target| target.mark_used_by_submission(value));
        }
        self.open_builds.drain(..).for_each(|build| build.mark_submitted(value));
        self.size_queries.drain(..).for_each(|query| query.mark_submitted(value));
        self.queries.apply_submission();
    }

    /// Clears everything and keeps the memory.
    fn clear(&mut self) {
        let Self {
            buffer_cache,
            texture_cache,
            accesses,
            declared,
            barriers,
            // The translation of a barrier is the same for every command buffer.
            last_barrier: _,
            sets_bound,
            push_constants,
            host_reads,
            pending_visibility,
            tlas_trackers,
            build_run,
            open_builds,
            refits,
            size_queries,
            queries,
            moved_blas,
            placed_blas,
            poisoned,
        } = self;
        buffer_cache.clear();
        texture_cache.clear();
        accesses.reset();
        declared.clear();
        barriers.clear();
        sets_bound.clear();
        push_constants.clear();
        host_reads.clear();
        pending_visibility.clear();
        tlas_trackers.iter_mut().for_each(|updates| updates.clear());
        build_run.stop();
        open_builds.clear();
        refits.clear();
        size_queries.clear();
        queries.clear();
        moved_blas.clear();
        placed_blas.clear();
        *poisoned = None;
    }
}

/// Recording states that no command buffer uses at the moment, all cleared.
#[expect(clippy::vec_box, reason = "handed on as pointers")]
pub(crate) struct RecordingStatePool(Mutex<Vec<Box<RecordingState>>>);

impl RecordingStatePool {
    /// Most states that the pool keeps. It does not keep states with memory for very many instances either.
    const MAX_SPARE: usize = 8;

    pub(crate) fn new() -> Self {
        Self(Mutex::new(Rank::RecordingStates, Vec::new()))
    }

    pub(crate) fn acquire(&self) -> Box<RecordingState> {
        let pool = self.0.lock().pop();
        pool.unwrap_or_default()
    }

    pub(crate) fn recycle(&self, mut notes: Box<RecordingState>) {
        notes.clear();
        let mut pool = self.0.lock();
        let is_small = notes.tlas_trackers.as_ref().is_none_or(|updates| updates.is_worth_keeping());
        if pool.len() < Self::MAX_SPARE && is_small {
            pool.push(notes);
        }
    }
}
