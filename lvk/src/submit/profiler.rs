//! GPU profiler: records timestamps of the scopes of command buffers, and reads them once the GPU is done.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use ash::vk;

use super::scope_tree::{GpuProfile, Stamps, scope_tree};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::queue::Queue;
use crate::resource::QueryPool;
use crate::resource::query_pool::QueryPoolDesc;

/// Timestamps of one command buffer.
#[derive(Default)]
pub(crate) struct Scopes {
    /// Query pools. All but the last are full.
    pools: Vec<QueryPool>,
    stamps: Stamps,
    /// Query of each timestamp, counted through all pools.
    query_indices: Vec<usize>,
    /// The first free query.
    next: usize,
    /// The queue of the command buffer.
    #[cfg(feature = "tracy")]
    queue: Queue,
    /// True if a query pool could not be created. The command buffer is not measured then.
    broken: bool,
}

/// Measures command buffers while it is enabled.
pub(crate) struct Profiler {
    on: AtomicBool,
    /// True if a command buffer is measured, or a profile is unfinished.
    busy: AtomicBool,
    /// Number of frames begun.
    frames: AtomicU64,
    inner: Mutex<ProfilerState>,
    gpu: Arc<Gpu>,
}

#[derive(Default)]
struct ProfilerState {
    spare: Vec<QueryPool>,
    in_flight: VecDeque<MeasuredSubmission>,
    /// The unfinished profile: its frame or submission, its first tick, and the result so far.
    open: Option<(ProfilePart, u64, GpuProfile)>,
    last: Option<Arc<GpuProfile>>,
    #[cfg(feature = "tracy")]
    tracy: super::tracy_zones::TracyZones,
}

/// Measured command buffers of one submission.
struct MeasuredSubmission {
    value: u64,
    part: ProfilePart,
    scopes: Vec<Scopes>,
}

/// The frame or submission that a profile covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ProfilePart {
    Frame(u64),
    Submission(u64),
}

impl Profiler {
    const STAMPS: usize = 64;

    pub(crate) fn new(gpu: &Arc<Gpu>) -> Self {
        Self {
            on: AtomicBool::new(false),
            busy: AtomicBool::new(false),
            frames: AtomicU64::new(0),
            inner: Mutex::new(Rank::Profiler, ProfilerState::default()),
            gpu: Arc::clone(gpu),
        }
    }

    /// Enables or disables measurement for command buffers that begin from now on.
    pub(crate) fn set_enabled(&self, on: bool) -> Result<()> {
        if on && self.gpu.caps.limits.timestamp_bits == 0 {
            return Err(self.gpu.unsupported("timestamps on the queue"));
        }
        self.on.store(on, Ordering::Relaxed);
        Ok(())
    }

    /// Begins the frame with this number.
    pub(crate) fn begin_frame(&self, number: u64) {
        self.frames.fetch_max(number + 1, Ordering::AcqRel);
    }

    /// Begins to measure a command buffer, if the profiler is enabled.
    pub(crate) fn begin_command_buffer(
        &self,
        commands: vk::CommandBuffer,
        queue: Queue,
    ) -> Option<Box<Scopes>> {
        if !self.on.load(Ordering::Relaxed) || self.gpu.caps.queue(queue).timestamp_bits == 0 {
            return None;
        }
        let mut scopes = Box::<Scopes>::default();
        #[cfg(feature = "tracy")]
        {
            scopes.queue = queue;
        }
        self.stamp(&mut scopes, commands, Some(""), 1);
        Some(scopes)
    }

    /// Writes a timestamp for the begin of the named scope, or for the end of the innermost scope. In a pass with
    /// several `views`, a timestamp takes that number of queries, and the first of them is used.
    pub(crate) fn stamp(
        &self,
        scopes: &mut Scopes,
        commands: vk::CommandBuffer,
        name: Option<&str>,
        views: u32,
    ) {
        if scopes.broken {
            return;
        }
        let place = scopes.reserve_queries(views as usize);
        if scopes.pools.len() * Self::STAMPS <= place {
            match self.pool() {
                Ok(pool) => scopes.pools.push(pool),
                Err(error) => {
                    log::warn!("a command buffer is not profiled: {error}");
                    scopes.broken = true;
                    return;
                }
            }
        }
        let Some(pool) = scopes.pools.last() else { return };
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        let query = (place % Self::STAMPS) as u32;
        // SAFETY: the queries exist, are reset, and are written once.
        unsafe { self.gpu.device.cmd_write_timestamp2(commands, stage, pool.raw, query) };
        scopes.stamps.push(name.map(Into::into));
        scopes.query_indices.push(place);
    }

    /// Returns a query pool for timestamps whose queries are reset.
    fn pool(&self) -> Result<QueryPool> {
        let spare = self.lock().spare.pop();
        let Some(pool) = spare else {
            let desc = QueryPoolDesc {
                count: Self::STAMPS as u32,
                debug_name: "profiler stamps",
                ..Default::default()
            };
            return QueryPool::with_type(&self.gpu, &desc, vk::QueryType::TIMESTAMP);
        };
        // SAFETY: `hostQueryReset` is on, and the GPU is done with the pool.
        unsafe { self.gpu.device.reset_query_pool(pool.raw, 0, pool.count) };
        Ok(pool)
    }

    /// Takes back the query pools of a discarded command buffer.
    pub(crate) fn discard(&self, scopes: Scopes) {
        self.lock().spare.extend(scopes.pools);
    }

    /// Records the submission of measured command buffers with this timeline value.
    pub(crate) fn submit(&self, value: u64, scopes: Vec<Scopes>) {
        if scopes.is_empty() {
            return;
        }
        let part = match self.frames.load(Ordering::Acquire) {
            0 => ProfilePart::Submission(value),
            begun => ProfilePart::Frame(begun - 1),
        };
        let mut inner = self.lock();
        // Threads may arrive here in another order than at the queue.
        let place = inner.in_flight.partition_point(|other| other.value < value);
        inner.in_flight.insert(place, MeasuredSubmission { value, part, scopes });
        self.busy.store(true, Ordering::Release);
    }

    /// Reads the timestamps of submissions up to this timeline value.
    pub(crate) fn collect(&self, completed: u64) -> Result<()> {
        if !self.busy.load(Ordering::Acquire) {
            return Ok(());
        }
        let mut inner = self.lock();
        while inner.in_flight.front().is_some_and(|front| front.value <= completed) {
            if let Some(measured) = inner.in_flight.pop_front() {
                inner.read(&self.gpu, measured)?;
            }
        }
        let begun = self.frames.load(Ordering::Acquire);
        inner.close_finished(begun);
        self.busy.store(inner.open.is_some() || !inner.in_flight.is_empty(), Ordering::Release);
        Ok(())
    }

    /// Makes the unfinished profile the last one if all work submitted for it so far is done. More work of its frame
    /// completes the profile later.
    pub(crate) fn publish_open(&self) {
        if self.busy.load(Ordering::Acquire) {
            self.lock().publish_open();
        }
    }

    /// Returns the profile finished last.
    pub(crate) fn last(&self) -> Option<Arc<GpuProfile>> {
        self.lock().last.clone()
    }

    fn lock(&self) -> Guard<'_, ProfilerState> {
        self.inner.lock()
    }
}

impl ProfilerState {
    fn read(&mut self, gpu: &Gpu, measured: MeasuredSubmission) -> Result<()> {
        if self.open.as_ref().is_some_and(|(part, ..)| *part != measured.part) {
            self.close_profile();
        }
        for scopes in measured.scopes {
            if let Some(ticks) = scopes.ticks()? {
                #[cfg(feature = "tracy")]
                self.tracy.emit(gpu, scopes.queue, &scopes.stamps, &ticks);
                self.add_command_buffer(gpu, measured.part, &scopes.stamps, &ticks);
            }
            self.spare.extend(scopes.pools);
        }
        Ok(())
    }

    /// Adds a command buffer to the profile.
    fn add_command_buffer(
        &mut self,
        gpu: &Gpu,
        part: ProfilePart,
        stamps: &[Option<Box<str>>],
        ticks: &[u64],
    ) {
        let Some(&begin) = ticks.first() else { return };
        let frame = if let ProfilePart::Frame(number) = part { Some(number) } else { None };
        let fresh = || (part, begin, GpuProfile { frame, ..Default::default() });
        let timestamps = gpu.timestamps();
        let (_, first, profile) = self.open.get_or_insert_with(fresh);
        // Another queue began earlier than all command buffers added so far.
        if let Some(earlier) = timestamps.ticks_until(begin, *first) {
            profile.delay(timestamps.milliseconds(earlier));
            *first = begin;
        }
        let ms_since_first = |tick: &u64| timestamps.milliseconds(timestamps.ticks_since(*first, *tick));
        let ms: Vec<f64> = ticks.iter().map(ms_since_first).collect();
        if let Some(root) = scope_tree(stamps, &ms) {
            profile.ms = profile.ms.max(root.start_ms + root.ms);
            profile.scopes.extend(root.children);
        }
    }

    /// Finishes the profile if no more submissions can belong to it, when `begun` frames have begun.
    fn close_finished(&mut self, begun: u64) {
        let Some((part, ..)) = self.open else { return };
        let expected = match part {
            ProfilePart::Frame(number) => {
                number + 1 >= begun || self.in_flight.iter().any(|measured| measured.part == part)
            }
            ProfilePart::Submission(_) => false,
        };
        if !expected {
            self.close_profile();
        }
    }

    fn publish_open(&mut self) {
        if let Some((part, _, profile)) = &self.open
            && !self.in_flight.iter().any(|measured| measured.part == *part)
        {
            self.last = Some(Arc::new(profile.clone()));
        }
    }

    fn close_profile(&mut self) {
        if let Some((.., profile)) = self.open.take() {
            self.last = Some(Arc::new(profile));
        }
    }
}

impl Scopes {
    /// Returns the time of each timestamp; `None` if one is not available.
    fn ticks(&self) -> Result<Option<Vec<u64>>> {
        let mut ticks = vec![None; self.next];
        for (pool, part) in self.pools.iter().zip(ticks.chunks_mut(Profiler::STAMPS)) {
            pool.read(0, part)?;
        }
        Ok(if self.broken { None } else { self.query_indices.iter().map(|place| ticks[*place]).collect() })
    }

    /// Reserves `count` queries of one pool. Returns the first.
    fn reserve_queries(&mut self, count: usize) -> usize {
        let left = Profiler::STAMPS - self.next % Profiler::STAMPS;
        let place = if count <= left { self.next } else { self.next + left };
        self.next = place + count;
        place
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Pools are filled one after the other. The queries of each timestamp lie within one pool, after those of
        /// earlier ones.
        #[test]
        fn stamps_lie_apart_and_each_in_one_pool(counts in prop::collection::vec(1..33_usize, 0..40)) {
            let (mut scopes, mut end) = (Scopes::default(), 0);
            for count in counts {
                let place = scopes.reserve_queries(count);
                prop_assert!(place >= end && place < end + Profiler::STAMPS);
                end = place + count;
                prop_assert_eq!(place / Profiler::STAMPS, (end - 1) / Profiler::STAMPS);
            }
        }
    }
}
