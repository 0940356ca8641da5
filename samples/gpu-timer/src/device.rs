//! Submissions of a device, between timestamps.
//!
//! Times of all queues of a device are those of one clock, which holds for the drivers that were measured; Vulkan promises as much for one
//! queue alone. A submission works from the moment at which the GPU begins its first command buffer, waits for semaphores of later stages
//! included.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;
use lvk_layer::SetDeviceLoaderData;

use crate::intervals::union_length;

/// A device, the functions of the layer below for it, and the submissions that were not asked for yet.
pub(crate) struct TimedDevice {
    pub(crate) functions: ash::Device,
    pub(crate) get_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    set_loader_data: Option<SetDeviceLoaderData>,
    /// Nanoseconds between two values of a timestamp.
    period: f64,
    /// The bits of a timestamp that count, for each queue family.
    valid_bits: Vec<u32>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    families: HashMap<vk::Queue, u32>,
    pools: HashMap<u32, vk::CommandPool>,
    queries: Vec<vk::QueryPool>,
    /// Those of submissions that have ended, by queue family.
    idle: HashMap<u32, Vec<Timestamps>>,
    submitted: Vec<(u32, Timestamps)>,
    /// Submissions since the last question that have no timestamps.
    untimed: usize,
}

/// The command buffers around a submission, and the pool of their two timestamps.
#[derive(Clone, Copy)]
struct Timestamps {
    queries: vk::QueryPool,
    before: vk::CommandBuffer,
    after: vk::CommandBuffer,
}

/// Work of the queues since the last question.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum BusyTime {
    /// Nothing was submitted.
    NothingSubmitted,
    /// A queue has no timestamps, or one could not be read.
    NotTimed,
    /// Milliseconds in which a queue worked.
    Milliseconds(f64),
}

/// Returns the elements behind a pointer of a Vulkan command.
///
/// # Safety
/// There are `count` elements, unless it is 0.
pub(crate) unsafe fn slice_of<'a, T>(first: *const T, count: u32) -> &'a [T] {
    // SAFETY: by contract.
    if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(first, count as usize) } }
}

impl TimedDevice {
    pub(crate) fn new(
        instance: &ash::Instance,
        physical: vk::PhysicalDevice,
        functions: ash::Device,
        get_proc_addr: vk::PFN_vkGetDeviceProcAddr,
        set_loader_data: Option<SetDeviceLoaderData>,
    ) -> Self {
        // SAFETY: the physical device is alive.
        let (period, families) = unsafe {
            let limits = instance.get_physical_device_properties(physical).limits;
            (limits.timestamp_period, instance.get_physical_device_queue_family_properties(physical))
        };
        Self {
            functions,
            get_proc_addr,
            set_loader_data,
            period: f64::from(period),
            valid_bits: families.iter().map(|family| family.timestamp_valid_bits).collect(),
            state: Mutex::default(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn add_queue(&self, queue: vk::Queue, family: u32) {
        self.state().families.insert(queue, family);
    }

    /// Submits batches, between timestamps if they have command buffers.
    ///
    /// # Safety
    /// As `vkQueueSubmit`.
    pub(crate) unsafe fn submit(
        &self,
        queue: vk::Queue,
        batches: &[vk::SubmitInfo<'_>],
        fence: vk::Fence,
    ) -> vk::Result {
        let works = batches.iter().any(|batch| batch.command_buffer_count > 0);
        let timestamps = self.timestamps(queue, works);
        let mut batches = batches.to_vec();
        let mut lists: Vec<Vec<vk::CommandBuffer>> = batches
            .iter()
            // SAFETY: by contract.
            .map(|batch| unsafe { slice_of(batch.p_command_buffers, batch.command_buffer_count) }.to_vec())
            .collect();
        enclose(&mut lists, timestamps.map(|(_, times)| [times.before, times.after]));
        for (batch, list) in batches.iter_mut().zip(&lists) {
            batch.command_buffer_count = list.len() as u32;
            batch.p_command_buffers = list.as_ptr();
        }
        // SAFETY: by contract; the added command buffers are recorded, and no other submission has them.
        let submitted = unsafe { self.functions.queue_submit(queue, &batches, fence) };
        self.record_submission(timestamps, submitted)
    }

    /// Submits batches, between timestamps if they have command buffers.
    ///
    /// # Safety
    /// As `vkQueueSubmit2`.
    pub(crate) unsafe fn submit2(
        &self,
        queue: vk::Queue,
        batches: &[vk::SubmitInfo2<'_>],
        fence: vk::Fence,
    ) -> vk::Result {
        let works = batches.iter().any(|batch| batch.command_buffer_info_count > 0);
        let timestamps = self.timestamps(queue, works);
        let mut batches = batches.to_vec();
        let mut lists: Vec<Vec<vk::CommandBufferSubmitInfo<'_>>> = batches
            .iter()
            .map(|batch| {
                // SAFETY: by contract.
                unsafe { slice_of(batch.p_command_buffer_infos, batch.command_buffer_info_count) }.to_vec()
            })
            .collect();
        let info = |list| vk::CommandBufferSubmitInfo::default().command_buffer(list);
        enclose(&mut lists, timestamps.map(|(_, times)| [info(times.before), info(times.after)]));
        for (batch, list) in batches.iter_mut().zip(&lists) {
            batch.command_buffer_info_count = list.len() as u32;
            batch.p_command_buffer_infos = list.as_ptr();
        }
        // SAFETY: by contract; the added command buffers are recorded, and no other submission has them. The device has Vulkan 1.3, as
        // programs that are measured ask for.
        let submitted = unsafe { self.functions.queue_submit2(queue, &batches, fence) };
        self.record_submission(timestamps, submitted)
    }

    /// Records the timestamps of a submission until they are asked for, or gives them back where it failed.
    fn record_submission(
        &self,
        timestamps: Option<(u32, Timestamps)>,
        submitted: ash::prelude::VkResult<()>,
    ) -> vk::Result {
        let mut state = self.state();
        match submitted {
            Ok(()) => {
                state.submitted.extend(timestamps);
                vk::Result::SUCCESS
            }
            Err(error) => {
                if let Some((family, timestamps)) = timestamps {
                    state.idle.entry(family).or_default().push(timestamps);
                }
                error
            }
        }
    }

    /// Returns the timestamps for a submission to a queue, and its family. `None` for one without work, and where they cannot be had, which
    /// is counted.
    fn timestamps(&self, queue: vk::Queue, works: bool) -> Option<(u32, Timestamps)> {
        let mut state = self.state();
        let timestamps = if works { self.find_timestamps(&mut state, queue) } else { None };
        state.untimed += usize::from(works && timestamps.is_none());
        timestamps
    }

    fn find_timestamps(&self, state: &mut State, queue: vk::Queue) -> Option<(u32, Timestamps)> {
        let family = *state.families.get(&queue)?;
        if self.valid_bits.get(family as usize).is_none_or(|bits| *bits == 0) {
            return None;
        }
        if let Some(idle) = state.idle.get_mut(&family).and_then(Vec::pop) {
            return Some((family, idle));
        }
        let pool = match state.pools.get(&family) {
            Some(pool) => *pool,
            None => {
                let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
                // SAFETY: the description is valid.
                let pool = unsafe { self.functions.create_command_pool(&info, None) }.ok()?;
                state.pools.insert(family, pool);
                pool
            }
        };
        Some((family, self.recorded(state, pool)?))
    }

    /// Records the command buffers around a submission. They are submitted again and again.
    fn recorded(&self, state: &mut State, pool: vk::CommandPool) -> Option<Timestamps> {
        let queries = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2);
        let lists = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(2);
        // A timestamp can be read before its command buffer has ended.
        let begin =
            vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::SIMULTANEOUS_USE);
        // SAFETY: the descriptions are valid, and the lock of the state keeps the pool for this thread.
        unsafe {
            let queries = self.functions.create_query_pool(&queries, None).ok()?;
            state.queries.push(queries);
            self.functions.reset_query_pool(queries, 0, 2);
            let lists = self.functions.allocate_command_buffers(&lists).ok()?;
            for list in &lists {
                if let Some(set) = self.set_loader_data {
                    let handle = vk::Handle::as_raw(*list) as usize as *mut std::ffi::c_void;
                    (set(self.functions.handle(), handle) == vk::Result::SUCCESS).then_some(())?;
                }
                self.functions.begin_command_buffer(*list, &begin).ok()?;
            }
            let [before, after] = [lists[0], lists[1]];
            self.functions.cmd_write_timestamp(before, vk::PipelineStageFlags::TOP_OF_PIPE, queries, 0);
            self.functions.cmd_write_timestamp(after, vk::PipelineStageFlags::BOTTOM_OF_PIPE, queries, 1);
            self.functions.end_command_buffer(before).ok()?;
            self.functions.end_command_buffer(after).ok()?;
            Some(Timestamps { queries, before, after })
        }
    }

    /// Returns the work of the queues since the last call. Waits for submissions that have not ended; others wait for this call.
    pub(crate) fn take_busy_time(&self) -> BusyTime {
        let mut state = self.state();
        let submitted = std::mem::take(&mut state.submitted);
        let mut untimed = std::mem::take(&mut state.untimed);
        if submitted.is_empty() && untimed == 0 {
            return BusyTime::NothingSubmitted;
        }
        let mut intervals = Vec::new();
        for (family, timestamps) in submitted {
            let mut ticks = [0_u64; 2];
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            // SAFETY: the lock keeps the device, and the submission writes both queries, which it does not use once they can be read.
            let read = unsafe {
                let read = self.functions.get_query_pool_results(timestamps.queries, 0, &mut ticks, flags);
                self.functions.reset_query_pool(timestamps.queries, 0, 2);
                read
            };
            match read {
                Ok(()) => {
                    intervals.push(unwrapped(ticks, self.valid_bits[family as usize]));
                    state.idle.entry(family).or_default().push(timestamps);
                }
                Err(_) => untimed += 1,
            }
        }
        match untimed {
            0 => BusyTime::Milliseconds(union_length(intervals) as f64 * self.period * 1e-6),
            _ => BusyTime::NotTimed,
        }
    }

    /// Destroys what the layer has created, after all work.
    pub(crate) fn destroy_timestamps(&self) {
        let mut state = self.state();
        // SAFETY: nothing of it is in use after the wait; the device is about to be destroyed.
        unsafe {
            let _ = self.functions.device_wait_idle();
            for queries in std::mem::take(&mut state.queries) {
                self.functions.destroy_query_pool(queries, None);
            }
            for pool in std::mem::take(&mut state.pools).into_values() {
                self.functions.destroy_command_pool(pool, None);
            }
        }
        // A question on another thread, which waited for the lock, finds nothing.
        state.submitted.clear();
        state.untimed = 0;
    }
}

/// Returns an interval whose end is not before its start, where the counter of so many bits has begun anew in between. An end that is a
/// little before its start is none of that: the interval is empty.
fn unwrapped([from, to]: [u64; 2], valid_bits: u32) -> [u64; 2] {
    let mask = u64::MAX >> (64 - valid_bits.clamp(1, 64));
    let ticks = to.wrapping_sub(from) & mask;
    [from, if ticks > mask / 2 { from } else { from.saturating_add(ticks) }]
}

/// Puts a list before the first lists and another one behind the last.
fn enclose<T>(lists: &mut [Vec<T>], ends: Option<[T; 2]>) {
    if let (Some([before, after]), false) = (ends, lists.is_empty()) {
        lists[0].insert(0, before);
        let last = lists.len() - 1;
        lists[last].push(after);
    }
}

#[cfg(test)]
mod tests {
    use super::{enclose, unwrapped};

    #[test]
    fn a_counter_that_begins_anew_does_not_shorten_an_interval() {
        assert_eq!(unwrapped([10, 14], 36), [10, 14]);
        let last = (1 << 36) - 1;
        assert_eq!(unwrapped([last, 4], 36), [last, last + 5]);
        assert_eq!(unwrapped([u64::MAX - 1, u64::MAX], 64), [u64::MAX - 1, u64::MAX]);
        for bits in [36, 64] {
            assert_eq!(unwrapped([14, 10], bits), [14, 14], "a clock that went back");
        }
    }

    #[test]
    fn the_first_batch_begins_and_the_last_one_ends_with_a_timestamp() {
        let mut batches = vec![vec![1], Vec::new(), vec![2, 3], Vec::new()];
        enclose(&mut batches, Some([8, 9]));
        assert_eq!(batches, [vec![8, 1], vec![], vec![2, 3], vec![9]]);
        let mut none: Vec<Vec<u8>> = Vec::new();
        enclose(&mut none, Some([8, 9]));
        assert_eq!(none, Vec::<Vec<u8>>::new());
    }
}
