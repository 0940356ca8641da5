//! An instance as Vulkan reads it.

use bytemuck::{Pod, Zeroable};

/// `VkAccelerationStructureInstanceKHR`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct InstanceRecord {
    transform: [f32; 12],
    custom_index_and_mask: u32,
    hit_group_offset_and_flags: u32,
    /// An address, or for `lvk::DeviceInstances` a place in a list.
    reference: u64,
}

impl InstanceRecord {
    /// An instance that every ray sees, of the first hit group.
    pub(super) fn new(transform: [f32; 12], reference: u64) -> Self {
        const ALL: u32 = 0xff << 24;
        Self { transform, custom_index_and_mask: ALL, hit_group_offset_and_flags: 0, reference }
    }
}
