//! Command buffers that are recorded, run by the GPU and recorded again.

use std::collections::{BTreeSet, VecDeque};

use ash::vk;

use super::input_sets::InputSets;
use super::ownership::PerLane;
use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// A command pool of its own for each command buffer, so that any thread may record without a lock.
#[derive(Debug)]
pub(crate) struct CommandSlot {
    pub(crate) pool: vk::CommandPool,
    /// What the caller records.
    pub(crate) main: vk::CommandBuffer,
    /// See [`prologue`](Self::prologue); made when there is the first barrier for it.
    prologue: Option<vk::CommandBuffer>,
    /// Of passes in `main`.
    pub(crate) inputs: InputSets,
}

impl CommandSlot {
    fn new(gpu: &Gpu, lane: usize) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(gpu.queues.family(lane));
        // SAFETY: the queue family is the device's own.
        let pool = unsafe { gpu.device.create_command_pool(&info, None) }
            .map_err(Error::vulkan("vkCreateCommandPool"))?;
        gpu.name(pool, "command pool");
        match allocate(gpu, pool) {
            Ok(main) => Ok(Self { pool, main, prologue: None, inputs: InputSets::default() }),
            Err(error) => {
                // SAFETY: the pool is unused.
                unsafe { gpu.device.destroy_command_pool(pool, None) };
                Err(error)
            }
        }
    }

    /// Runs before `main` and holds the barriers between the queue's state and the first uses in `main`.
    pub(crate) fn prologue(&mut self, gpu: &Gpu) -> Result<vk::CommandBuffer> {
        if let Some(made) = self.prologue {
            return Ok(made);
        }
        let made = allocate(gpu, self.pool)?;
        gpu.name(made, "barriers before a command buffer");
        self.prologue = Some(made);
        Ok(made)
    }

    fn reset(&mut self, gpu: &Gpu) -> Result<()> {
        self.inputs.reset();
        // SAFETY: the GPU is done with the pool's command buffers, and nobody records them.
        unsafe { gpu.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .map_err(Error::vulkan("vkResetCommandPool"))
    }

    fn destroy(self, gpu: &Gpu) {
        // SAFETY: as in `reset`.
        unsafe { gpu.device.destroy_command_pool(self.pool, None) };
        self.inputs.destroy(gpu);
    }
}

fn allocate(gpu: &Gpu, pool: vk::CommandPool) -> Result<vk::CommandBuffer> {
    let info = vk::CommandBufferAllocateInfo::default()
        .command_pool(pool)
        .level(vk::CommandBufferLevel::PRIMARY)
        .command_buffer_count(1);
    // SAFETY: the pool is alive, and nobody else uses it.
    let made = unsafe { gpu.device.allocate_command_buffers(&info) };
    made.map(|buffers| buffers[0]).map_err(Error::vulkan("vkAllocateCommandBuffers"))
}

/// Which command buffers are free, being recorded, or with the GPU.
#[derive(Debug, Default)]
pub(crate) struct CommandRing {
    lanes: PerLane<LaneSlots>,
    open: BTreeSet<u64>,
    /// Sequence numbers of command buffers that never reached the GPU, until the next collection.
    given_up: Vec<u64>,
    last_sequence: u64,
}

/// Command buffers of one family, and what the lane has under way.
#[derive(Debug, Default)]
struct LaneSlots {
    free: Vec<CommandSlot>,
    in_flight: VecDeque<InFlight>,
}

#[derive(Debug)]
struct InFlight {
    value: u64,
    sequence: u64,
    slot: CommandSlot,
}

impl CommandRing {
    /// Takes a command buffer of a lane to record, with its sequence number.
    pub(crate) fn acquire(&mut self, gpu: &Gpu, lane: usize) -> Result<(u64, CommandSlot)> {
        let slot = match self.lanes[lane].free.pop() {
            Some(slot) => slot,
            None => CommandSlot::new(gpu, lane)?,
        };
        self.last_sequence += 1;
        self.open.insert(self.last_sequence);
        Ok((self.last_sequence, slot))
    }

    /// The command buffer was submitted and is done when the lane's timeline reaches `value`.
    pub(crate) fn submitted(&mut self, lane: usize, sequence: u64, slot: CommandSlot, value: u64) {
        self.open.remove(&sequence);
        self.lanes[lane].in_flight.push_back(InFlight { value, sequence, slot });
    }

    /// The command buffer was given up before submission.
    pub(crate) fn discard(&mut self, gpu: &Gpu, lane: usize, sequence: u64, slot: CommandSlot) {
        self.open.remove(&sequence);
        self.given_up.push(sequence);
        self.lanes[lane].recycle(gpu, slot);
    }

    /// Takes command buffers back that the lanes are done with; answers their sequence numbers, and those given up.
    pub(crate) fn collect(&mut self, gpu: &Gpu, completed: &PerLane<u64>) -> Vec<u64> {
        let mut done = std::mem::take(&mut self.given_up);
        for (lane, completed) in self.lanes.iter_mut().zip(completed) {
            while lane.in_flight.front().is_some_and(|oldest| oldest.value <= *completed) {
                let Some(oldest) = lane.in_flight.pop_front() else { break };
                done.push(oldest.sequence);
                lane.recycle(gpu, oldest.slot);
            }
        }
        done
    }

    /// Sequence number of the command buffer that was taken last.
    pub(crate) fn newest(&self) -> u64 {
        self.last_sequence
    }

    /// Sequence number of the oldest command buffer being recorded.
    pub(crate) fn oldest_open(&self) -> Option<u64> {
        self.open.first().copied()
    }

    /// Sequence number of the newest command buffer being recorded.
    pub(crate) fn newest_open(&self) -> Option<u64> {
        self.open.last().copied()
    }

    /// Destroys everything. The GPU is idle and nothing is being recorded.
    pub(crate) fn destroy(&mut self, gpu: &Gpu) {
        for lane in &mut self.lanes {
            let in_flight = lane.in_flight.drain(..).map(|entry| entry.slot);
            lane.free.drain(..).chain(in_flight).for_each(|slot| slot.destroy(gpu));
        }
    }
}

impl LaneSlots {
    fn recycle(&mut self, gpu: &Gpu, mut slot: CommandSlot) {
        match slot.reset(gpu) {
            Ok(()) => self.free.push(slot),
            Err(_) => slot.destroy(gpu),
        }
    }
}
