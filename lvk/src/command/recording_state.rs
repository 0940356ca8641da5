//! What a command buffer notes while it is recorded, with memory that is used again.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use ash::vk;

use super::accesses::Uses;
use super::bind::PushConstants;
use super::build_blas::OpenBuild;
use super::query_usage::QueryLog;
use super::transfer::Settle;
use crate::accel::AccelStruct;
use crate::accel::build_overlap::BuildRun;
use crate::accel::compaction::SizeQuery;
use crate::accel::tlas_tracker::TlasUpdates;
use crate::barrier::{Barriers, ResourceId};
use crate::device_state::Shared;
use crate::handle::{BufferHandle, TextureHandle};
use crate::handle_cache::Found;
use crate::lock_order::{Mutex, Rank};
use crate::resource::{Buffer, Texture};
use crate::submit::emit_barriers::LastBarrier;

/// Lists and maps of one command buffer.
#[derive(Default)]
pub(crate) struct Notes {
    pub(super) found_buffers: Found<BufferHandle, Buffer>,
    pub(super) found_textures: Found<TextureHandle, Texture>,
    pub(super) uses: Uses,
    pub(super) barriers: Barriers,
    pub(super) last_barrier: LastBarrier,
    pub(super) sets_bound: Vec<vk::PipelineBindPoint>,
    pub(super) push_constants: PushConstants,
    pub(super) host_reads: Vec<ResourceId>,
    pub(super) settle: Vec<Settle>,
    /// Present once a top-level structure was updated.
    pub(super) tlas_updates: Option<Box<TlasUpdates>>,
    /// Builds of top-level structures that run side by side.
    pub(super) build_run: BuildRun,
    pub(super) open_builds: Vec<OpenBuild>,
    /// Refits since the last rebuild of each bottom-level structure that is built here, by its id.
    pub(super) refits: HashMap<u64, u32>,
    pub(super) size_queries: Vec<Arc<SizeQuery>>,
    pub(super) queries: QueryLog,
    /// Bottom-level structures that are built elsewhere from here on, by their ids.
    pub(super) moved: HashSet<u64>,
    /// Bottom-level structures that the host placed in top-level ones where it knew them to lie, by their ids.
    pub(super) placed: HashMap<u64, Arc<AccelStruct>>,
    /// What a command failed on with only a part of it recorded.
    pub(super) torn: Option<String>,
}

impl Notes {
    /// The command buffer went to the GPU with this timeline value: what it noted becomes true.
    pub(crate) fn submitted(&mut self, shared: &Shared, value: u64) {
        if let Some(updates) = &mut self.tlas_updates {
            shared.show(updates, |target| target.submitted(value));
        }
        self.open_builds.drain(..).for_each(|build| build.submit(value));
        self.size_queries.drain(..).for_each(|query| query.submit());
        self.queries.submit();
    }

    /// Forgets everything, and keeps the memory.
    fn clear(&mut self) {
        let Self {
            found_buffers,
            found_textures,
            uses,
            barriers,
            // What barriers are called is the same for every command buffer.
            last_barrier: _,
            sets_bound,
            push_constants,
            host_reads,
            settle,
            tlas_updates,
            build_run,
            open_builds,
            refits,
            size_queries,
            queries,
            moved,
            placed,
            torn,
        } = self;
        found_buffers.clear();
        found_textures.clear();
        uses.forget();
        barriers.clear();
        sets_bound.clear();
        push_constants.clear();
        host_reads.clear();
        settle.clear();
        tlas_updates.iter_mut().for_each(|updates| updates.clear());
        build_run.stop();
        open_builds.clear();
        refits.clear();
        size_queries.clear();
        queries.clear();
        moved.clear();
        placed.clear();
        *torn = None;
    }
}

/// Notes that no command buffer has at the moment, empty.
#[expect(clippy::vec_box, reason = "handed on as pointers")]
pub(crate) struct SpareNotes(Mutex<Vec<Box<Notes>>>);

impl SpareNotes {
    /// More than this are let go, and so are those of very many instances.
    const MOST: usize = 8;

    pub(crate) fn new() -> Self {
        Self(Mutex::new(Rank::SpareNotes, Vec::new()))
    }

    pub(crate) fn take(&self) -> Box<Notes> {
        let spare = self.0.lock().pop();
        spare.unwrap_or_default()
    }

    pub(crate) fn give(&self, mut notes: Box<Notes>) {
        notes.clear();
        let mut spare = self.0.lock();
        let is_small = notes.tlas_updates.as_ref().is_none_or(|updates| updates.is_worth_keeping());
        if spare.len() < Self::MOST && is_small {
            spare.push(notes);
        }
    }
}
