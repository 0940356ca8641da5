//! What the bindless set holds beside textures and samplers.

use crate::gpu::Gpu;
use crate::gpu::caps::descriptor_limits::ReservedDescriptors;

/// Top-level structures there may be, of either form.
pub(super) fn tlas_slot_count(gpu: &Gpu) -> u32 {
    if gpu.has_acceleration_structures() { gpu.caps.limits.max_bindless_tlas } else { 0 }
}

/// Those of the device.
pub(super) fn hardware_tlas_count(gpu: &Gpu) -> u32 {
    if gpu.accel.is_some() { gpu.caps.limits.max_bindless_tlas } else { 0 }
}

/// Tables of top-level structures.
pub(super) fn tlas_table_count(gpu: &Gpu) -> u32 {
    tlas_slot_count(gpu).min(1)
}

/// What other descriptors count for, those of the set of a pass's own targets included.
pub(super) fn reserved_descriptors(gpu: &Gpu) -> ReservedDescriptors {
    let limits = &gpu.caps.limits;
    ReservedDescriptors {
        in_set: hardware_tlas_count(gpu) + tlas_table_count(gpu),
        targets: limits.max_color_targets + limits.max_input_attachments,
    }
}
