//! The instance record that Vulkan reads, `VkAccelerationStructureInstanceKHR`.

use bytemuck::{Pod, Zeroable};

/// `VkAccelerationStructureInstanceKHR`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct InstanceRecord {
    transform: [f32; 12],
    custom_index_and_mask: u32,
    hit_group_offset_and_flags: u32,
    /// A BLAS address, or for `lvk::DeviceInstances` an index into its BLAS list.
    reference: u64,
}

impl InstanceRecord {
    /// Creates an instance with mask 0xff that uses the first hit group.
    pub(super) fn new(transform: [f32; 12], reference: u64) -> Self {
        const ALL: u32 = 0xff << 24;
        Self { transform, custom_index_and_mask: ALL, hit_group_offset_and_flags: 0, reference }
    }
}
