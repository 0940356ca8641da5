//! The binding numbers of the bindless descriptor set, for Rust and for GLSL, and its numbers of descriptors.
//!
//! The shader preamble and the check of foreign SPIR-V are both generated from these constants.

use crate::gpu::Gpu;
use crate::gpu::caps::descriptor_limits::ReservedDescriptors;

/// The descriptor set that holds everything.
pub(crate) const SET: u32 = 0;
/// The set of the pass's own targets as fragment shaders read them; its bindings are
/// [`InputAttachment`](super::input_attachments::InputAttachment)s.
pub(crate) const INPUT_SET: u32 = 1;
/// Sampled images: every texture, seen as 2D, array, 3D or cube through aliased declarations.
pub(crate) const SAMPLED_IMAGES: u32 = 0;
/// Samplers, with and without depth comparison.
pub(crate) const SAMPLERS: u32 = 1;
/// Storage images; a texture has the same index here as in [`SAMPLED_IMAGES`].
pub(crate) const STORAGE_IMAGES: u32 = 2;
/// Combined Y'CbCr image samplers: a range of slots for each conversion of the context.
pub(crate) const YCBCR: u32 = 3;
/// Top-level acceleration structures.
pub(crate) const ACCEL_STRUCTS: u32 = 4;
/// One storage buffer: for each top-level structure the address of the rows that lead from hits to the caller's
/// instances and primitives.
pub(crate) const TLAS_TABLE: u32 = 5;

/// Bytes of an entry of the table of top-level structures.
pub(crate) const TLAS_TABLE_ENTRY_BYTES: u64 = 16;

/// Each binding with the words an error message and the preamble use for it.
pub(crate) const BINDINGS: [(u32, &str, &str); 6] = [
    (SAMPLED_IMAGES, "LVK_BINDING_SAMPLED_IMAGES", "sampled images"),
    (SAMPLERS, "LVK_BINDING_SAMPLERS", "samplers"),
    (STORAGE_IMAGES, "LVK_BINDING_STORAGE_IMAGES", "storage images"),
    (YCBCR, "LVK_BINDING_YCBCR", "combined Y'CbCr samplers"),
    (ACCEL_STRUCTS, "LVK_BINDING_ACCEL_STRUCTS", "top-level acceleration structures"),
    (TLAS_TABLE, "LVK_BINDING_TLAS_TABLE", "the table of top-level structures"),
];

/// Numbers of descriptors of the bindless set beside textures and samplers.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescriptorCounts {
    /// Top-level acceleration structures, of either form.
    pub(super) tlas_slots: u32,
    /// Top-level acceleration structures of the device.
    pub(super) hardware_tlas: u32,
    /// Tables of top-level acceleration structures.
    pub(super) tlas_tables: u32,
    /// What they count for together, with the set of a pass's own targets.
    pub(super) reserved: ReservedDescriptors,
}

impl DescriptorCounts {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let limits = &gpu.caps.limits;
        let tlas_slots = if gpu.has_acceleration_structures() { limits.max_bindless_tlas } else { 0 };
        let hardware_tlas = if gpu.accel.is_some() { limits.max_bindless_tlas } else { 0 };
        let tlas_tables = tlas_slots.min(1);
        let reserved = ReservedDescriptors {
            in_set: hardware_tlas + tlas_tables,
            targets: limits.max_color_targets + limits.max_input_attachments,
        };
        Self { tlas_slots, hardware_tlas, tlas_tables, reserved }
    }
}
