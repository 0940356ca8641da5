//! What the bindless set holds beside textures and samplers.

use crate::gpu::Gpu;
use crate::gpu::caps::descriptor_limits::OtherDescriptors;

/// Top-level structures there may be, of either form.
pub(super) fn slot_count(gpu: &Gpu) -> u32 {
    if gpu.has_structures() { gpu.caps.limits.max_bindless_tlas } else { 0 }
}

/// Those of the device.
pub(super) fn tlas_count(gpu: &Gpu) -> u32 {
    if gpu.accel.is_some() { gpu.caps.limits.max_bindless_tlas } else { 0 }
}

/// Tables of top-level structures.
pub(super) fn table_count(gpu: &Gpu) -> u32 {
    slot_count(gpu).min(1)
}

/// What other descriptors count for, those of the set of a pass's own targets included.
pub(super) fn others(gpu: &Gpu) -> OtherDescriptors {
    let limits = &gpu.caps.limits;
    OtherDescriptors {
        in_set: tlas_count(gpu) + table_count(gpu),
        targets: limits.max_color_targets + limits.max_input_attachments,
    }
}
