//! The Vulkan queues behind the three queues of the library.

use std::sync::atomic::AtomicU32;

use ash::vk;

use crate::error::{Error, Result};
use crate::lock_order::{Guard, Mutex, Rank};
use crate::queue::Queue;

/// A failed wait for a Vulkan queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct IdleFailure {
    /// The first queue that uses the Vulkan queue.
    pub(crate) queue: Queue,
    /// The error of the driver.
    pub(crate) result: vk::Result,
}

impl IdleFailure {
    /// True if the wait failed for lack of memory.
    pub(crate) fn lacks_memory(self) -> bool {
        use vk::Result as Code;
        matches!(self.result, Code::ERROR_OUT_OF_HOST_MEMORY | Code::ERROR_OUT_OF_DEVICE_MEMORY)
    }

    /// Returns the error, which names the queue.
    pub(crate) fn into_error(self) -> Error {
        Error::vulkan("vkQueueWaitIdle", format_args!("{} queue", self.queue.label()))(self.result)
    }
}

/// Mapping of the library's queues to Vulkan queues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum QueueRequest {
    /// Separate Vulkan queues where the device has them.
    #[default]
    OwnHardware,
    /// One Vulkan queue, on which all commands run one after the other.
    Shared,
    /// Separate queues on every device. Queues that share a Vulkan queue synchronise and transfer ownership
    /// as if each had its own. This exercises multi-queue code on any device and under its validation layer.
    /// It makes nothing faster.
    Emulated,
}

/// Returns the mask of the timestamp bits that are valid on all queues that have timestamps. `bits` holds the
/// valid bits of each queue, 0 for none.
pub(crate) fn shared_timestamp_bits(bits: [u32; 3]) -> u64 {
    let least = bits.into_iter().filter(|bits| *bits > 0).min().unwrap_or(1);
    u64::MAX >> (64 - least.min(64))
}

/// Properties of the Vulkan queue behind a [`Queue`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct QueueInfo {
    /// True if the device has a separate Vulkan queue for it. Always true for the graphics queue, even if
    /// other queues share it.
    pub own_hardware: bool,
    /// Queue family of the Vulkan queue.
    pub family: u32,
    /// Valid bits of a timestamp (`timestampValidBits`); 0 if the queue has no timestamps.
    pub timestamp_bits: u32,
    /// Granularity of texture copies, in texels or blocks (`minImageTransferGranularity`). Offsets and
    /// extents of copies must be multiples of it or reach the edge. Zeros if only whole mips can be copied.
    pub copy_granularity: [u32; 3],
}

/// A queue family, as reported by the device.
#[derive(Debug, Clone, Copy)]
pub(crate) struct QueueFamily {
    pub(crate) flags: vk::QueueFlags,
    pub(crate) count: u32,
    pub(crate) timestamp_bits: u32,
    pub(crate) copy_granularity: [u32; 3],
}

/// A Vulkan queue, by family and index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct QueueLocation {
    pub(crate) family: u32,
    pub(crate) index: u32,
}

/// Returns the queue families of a device, in Vulkan's order.
pub(crate) fn queue_families(instance: &ash::Instance, raw: vk::PhysicalDevice) -> Vec<QueueFamily> {
    // SAFETY: `raw` was enumerated from `instance`.
    let families = unsafe { instance.get_physical_device_queue_family_properties(raw) };
    let family = |found: &vk::QueueFamilyProperties| {
        let vk::Extent3D { width, height, depth } = found.min_image_transfer_granularity;
        QueueFamily {
            flags: found.queue_flags,
            count: found.queue_count,
            timestamp_bits: found.timestamp_valid_bits,
            copy_granularity: [width, height, depth],
        }
    };
    families.iter().map(family).collect()
}

/// Selects a Vulkan queue for each queue of the library. `graphics` is the family with graphics and compute.
/// The most specialised families come first, then further queues of the families in use, then the graphics
/// queue itself.
pub(crate) fn locate_queues(families: &[QueueFamily], graphics: u32) -> [QueueLocation; 3] {
    use vk::QueueFlags as Flags;
    let first = QueueLocation { family: graphics, index: 0 };
    let find = |fits: &dyn Fn(Flags) -> bool| {
        let found = families.iter().position(|family| family.count > 0 && fits(family.flags));
        found.map(|family| QueueLocation { family: family as u32, index: 0 })
    };
    let spare = |family: u32, index: u32| {
        let count = families.get(family as usize).map_or(0, |family| family.count);
        (index < count).then_some(QueueLocation { family, index })
    };
    let compute = find(&|flags| flags.contains(Flags::COMPUTE) && !flags.contains(Flags::GRAPHICS));
    let compute = compute.or_else(|| spare(graphics, 1)).unwrap_or(first);
    let beside = Flags::TRANSFER | Flags::SPARSE_BINDING | Flags::PROTECTED;
    let transfer = find(&|flags| flags.contains(Flags::TRANSFER) && beside.contains(flags));
    let next = || if compute == first { None } else { spare(compute.family, compute.index + 1) };
    [first, compute, transfer.or_else(next).unwrap_or(first)]
}

/// Returns the properties of the queues at these locations.
pub(crate) fn describe_queues(families: &[QueueFamily], locations: &[QueueLocation; 3]) -> [QueueInfo; 3] {
    let info = |queue: Queue| {
        let location = locations[queue.index()];
        let alone = locations.iter().filter(|other| **other == location).count() == 1;
        let family = families.get(location.family as usize);
        QueueInfo {
            own_hardware: queue == Queue::Graphics || alone,
            family: location.family,
            timestamp_bits: family.map_or(0, |family| family.timestamp_bits),
            copy_granularity: family.map_or([1; 3], |family| family.copy_granularity),
        }
    };
    Queue::ALL.map(info)
}

/// The Vulkan queues that a context uses.
///
/// Command buffers of one queue index run in submission order. The graphics queue has queue index 0. A
/// separate queue has the index of its position in [`Queue::ALL`]; every other queue shares index 0.
pub(crate) struct Queues {
    raw: Vec<Mutex<vk::Queue>>,
    /// Open labels of each of `raw`. They change only while their queue is locked.
    open_labels: Vec<AtomicU32>,
    /// Index into `raw` for each queue.
    raw_index: [usize; 3],
    families: [u32; 3],
    /// True for each queue with a queue index of its own.
    is_separate: [bool; 3],
    is_emulated: bool,
    /// The queue families in use, without duplicates.
    distinct: Vec<u32>,
}

impl Queues {
    /// Creates the queues from the Vulkan queue and family of each. Queues with the same handle share it.
    pub(crate) fn new(raw: [(vk::Queue, u32); 3], request: QueueRequest) -> Self {
        let raw = if request == QueueRequest::Shared { [raw[0]; 3] } else { raw };
        let mut queues: Vec<vk::Queue> = Vec::new();
        let raw_index = raw.map(|(queue, _)| {
            queues.iter().position(|known| *known == queue).unwrap_or_else(|| {
                queues.push(queue);
                queues.len() - 1
            })
        });
        let families = raw.map(|(_, family)| family);
        let is_emulated = request == QueueRequest::Emulated;
        let is_separate = [0, 1, 2].map(|queue_index: usize| {
            queue_index > 0 && (is_emulated || raw_index[queue_index] != raw_index[0])
        });
        let mut distinct = families.to_vec();
        distinct.sort_unstable();
        distinct.dedup();
        let open_labels = queues.iter().map(|_| AtomicU32::new(0)).collect();
        let raw = queues.into_iter().map(|queue| Mutex::new(Rank::Queue, queue)).collect();
        Self { raw, open_labels, raw_index, families, is_separate, is_emulated, distinct }
    }

    /// Returns the queue index of a queue.
    pub(crate) fn queue_index(&self, queue: Queue) -> usize {
        if self.is_separate[queue.index()] { queue.index() } else { 0 }
    }

    /// True if there is more than one queue index.
    pub(crate) fn has_several(&self) -> bool {
        self.is_separate.contains(&true)
    }

    /// True if there is more than one Vulkan queue.
    pub(crate) fn has_several_raw(&self) -> bool {
        self.raw.len() > 1
    }

    /// Locks the Vulkan queue of a queue index, which only one thread may use at a time.
    pub(crate) fn raw(&self, queue_index: usize) -> Guard<'_, vk::Queue> {
        self.raw[self.raw_index[queue_index]].lock()
    }

    /// Waits until each Vulkan queue is idle (`vkQueueWaitIdle`). Unlike a wait for the device, this needs no exclusive
    /// access to other queues, which the engine of an external device uses.
    pub(crate) fn wait_idle(&self, device: &ash::Device) -> Result<(), IdleFailure> {
        let waits = self.raw.iter().enumerate().map(|(place, raw)| {
            // SAFETY: the queue is locked.
            let idle = unsafe { device.queue_wait_idle(*raw.lock()) };
            idle.map_err(|result| IdleFailure { queue: self.first_user(place), result })
        });
        // A queue whose wait fails does not keep the others from being waited for.
        waits.fold(Ok(()), Result::and)
    }

    /// Returns the first queue that uses the Vulkan queue at `place`.
    fn first_user(&self, place: usize) -> Queue {
        let uses = |queue: &Queue| self.raw_index[queue.index()] == place;
        Queue::ALL.into_iter().find(uses).unwrap_or_default()
    }

    /// Returns the family of a queue index.
    pub(crate) fn family(&self, queue_index: usize) -> u32 {
        self.families[queue_index]
    }

    /// Returns the number of open labels of the Vulkan queue behind a queue.
    pub(crate) fn open_labels(&self, queue: Queue) -> &AtomicU32 {
        &self.open_labels[self.raw_index[queue.index()]]
    }

    /// True if queues of their own share one Vulkan queue, as tests request it.
    pub(crate) fn is_emulated(&self) -> bool {
        self.is_emulated
    }

    /// Returns all families in use, without duplicates.
    pub(crate) fn families(&self) -> &[u32] {
        &self.distinct
    }

    /// Returns the ownership domain of a queue index. Queues of one domain share ownership of images.
    pub(crate) fn domain(&self, queue_index: usize) -> u32 {
        if self.is_emulated { queue_index as u32 } else { self.families[queue_index] }
    }

    /// True if images can be owned by one queue and not by another.
    pub(crate) fn has_several_domains(&self) -> bool {
        (1..3).any(|queue_index| self.is_separate[queue_index] && self.domain(queue_index) != self.domain(0))
    }
}

#[cfg(test)]
mod tests {
    use ash::vk::Handle;

    use super::*;

    const ALL: vk::QueueFlags = vk::QueueFlags::from_raw(0b1111);
    const COMPUTE: vk::QueueFlags = vk::QueueFlags::from_raw(0b1110);
    const COPIES: vk::QueueFlags = vk::QueueFlags::from_raw(0b1100);
    const DECODER: vk::QueueFlags = vk::QueueFlags::from_raw(0b10_1100);

    fn locate(list: &[(vk::QueueFlags, u32)], graphics: u32) -> [(u32, u32); 3] {
        let family = |(flags, count): &(vk::QueueFlags, u32)| QueueFamily {
            flags: *flags,
            count: *count,
            timestamp_bits: 64,
            copy_granularity: [1; 3],
        };
        let families: Vec<_> = list.iter().map(family).collect();
        locate_queues(&families, graphics).map(|location| (location.family, location.index))
    }

    #[test]
    fn families_that_can_do_least_else_come_first() {
        let nvidia = [(ALL, 16), (COPIES, 2), (COMPUTE, 8), (DECODER, 1)];
        assert_eq!(locate(&nvidia, 0), [(0, 0), (2, 0), (1, 0)]);
        let video_before = [(ALL, 16), (DECODER, 1), (COPIES, 2), (COMPUTE, 8)];
        assert_eq!(locate(&video_before, 0), [(0, 0), (3, 0), (2, 0)]);
    }

    #[test]
    fn further_queues_of_a_family_are_taken_before_one_is_shared() {
        assert_eq!(locate(&[(ALL, 1)], 0), [(0, 0), (0, 0), (0, 0)]);
        assert_eq!(locate(&[(ALL, 2)], 0), [(0, 0), (0, 1), (0, 0)]);
        assert_eq!(locate(&[(ALL, 3)], 0), [(0, 0), (0, 1), (0, 2)]);
        assert_eq!(locate(&[(COMPUTE, 2), (ALL, 1)], 1), [(1, 0), (0, 0), (0, 1)]);
        assert_eq!(locate(&[(ALL, 1), (COMPUTE, 1)], 0), [(0, 0), (1, 0), (0, 0)]);
        assert_eq!(locate(&[(ALL, 1), (COPIES, 1)], 0), [(0, 0), (0, 0), (1, 0)]);
    }

    #[test]
    fn failed_waits_name_the_first_queue_that_uses_the_vulkan_queue() {
        let raw = |handle, family| (vk::Queue::from_raw(handle), family);
        let queues = Queues::new([raw(1, 0), raw(2, 1), raw(1, 0)], QueueRequest::OwnHardware);
        let text = |place| {
            let result = vk::Result::ERROR_OUT_OF_HOST_MEMORY;
            IdleFailure { queue: queues.first_user(place), result }.into_error().to_string()
        };
        assert_eq!(text(0), "out of host memory in vkQueueWaitIdle for 'graphics queue'");
        assert_eq!(text(1), "out of host memory in vkQueueWaitIdle for 'compute queue'");
    }

    #[test]
    fn own_hardware_is_not_shared() {
        let own = |indices: [u32; 3]| {
            let locations = indices.map(|index| QueueLocation { family: 0, index });
            describe_queues(&[], &locations).map(|info| info.own_hardware)
        };
        assert_eq!(own([0, 1, 2]), [true; 3]);
        assert_eq!(own([0, 0, 1]), [true, false, true]);
        assert_eq!(own([0, 1, 1]), [true, false, false]);
    }

    #[test]
    fn timestamps_are_compared_in_the_bits_that_all_have() {
        assert_eq!(shared_timestamp_bits([64, 64, 64]), u64::MAX);
        assert_eq!(shared_timestamp_bits([64, 36, 0]), (1 << 36) - 1);
        assert_eq!(shared_timestamp_bits([32, 64, 48]), u64::from(u32::MAX));
    }

    #[test]
    fn queues_of_one_handle_share_a_queue_index_unless_emulated() {
        let raw = |number: u64, family| (vk::Queue::from_raw(number), family);
        let one = [raw(1, 0); 3];
        let three = [raw(1, 0), raw(2, 4), raw(3, 2)];
        let queues = |raw, request| {
            let queues = Queues::new(raw, request);
            (
                Queue::ALL.map(|queue| queues.queue_index(queue)),
                queues.has_several_domains(),
                queues.families().to_vec(),
            )
        };
        assert_eq!(queues(one, QueueRequest::OwnHardware), ([0; 3], false, vec![0]));
        assert_eq!(queues(one, QueueRequest::Emulated), ([0, 1, 2], true, vec![0]));
        assert_eq!(queues(three, QueueRequest::OwnHardware), ([0, 1, 2], true, vec![0, 2, 4]));
        assert_eq!(queues(three, QueueRequest::Shared), ([0; 3], false, vec![0]));
        let one_family = [raw(1, 0), raw(2, 0), raw(1, 0)];
        assert_eq!(queues(one_family, QueueRequest::OwnHardware), ([0, 1, 0], false, vec![0]));
    }
}
