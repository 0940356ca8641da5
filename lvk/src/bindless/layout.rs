//! Binding numbers of the bindless descriptor set, for Rust and for GLSL, and its descriptor counts.
//!
//! The shader preamble and the check of foreign SPIR-V are both generated from these constants.

use ash::vk;

use crate::gpu::Gpu;
use crate::gpu::caps::descriptor_limits::ReservedDescriptors;

/// The set number of the bindless descriptor set.
pub(crate) const SET: u32 = 0;
/// The set number of the pass's own targets, which fragment shaders read. Its bindings are
/// [`InputAttachment`](super::input_attachments::InputAttachment)s.
pub(crate) const INPUT_SET: u32 = 1;
/// Sampled images: every texture, declared as 2D, array, 3D or cube by aliased arrays.
pub(crate) const SAMPLED_IMAGES: u32 = 0;
/// Samplers, with and without depth comparison.
pub(crate) const SAMPLERS: u32 = 1;
/// Storage images; a texture has the same index here as in [`SAMPLED_IMAGES`].
pub(crate) const STORAGE_IMAGES: u32 = 2;
/// Combined Y'CbCr image samplers: a range of slots for each conversion of the context.
pub(crate) const YCBCR: u32 = 3;
/// Top-level acceleration structures.
pub(crate) const ACCEL_STRUCTS: u32 = 4;
/// One storage buffer, the TLAS table. Its entry of a TLAS holds the addresses of the hit remap table and of the
/// software TLAS. The hit remap table maps hits to the caller's instances and primitives.
pub(crate) const TLAS_TABLE: u32 = 5;

/// Size of an entry of the TLAS table in bytes.
pub(crate) const TLAS_TABLE_ENTRY_BYTES: u64 = 16;

/// A binding of the bindless set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) number: u32,
    pub(crate) descriptor_type: vk::DescriptorType,
    /// Name of the binding in the preamble.
    #[cfg_attr(not(feature = "glsl"), expect(dead_code, reason = "only the GLSL preamble asks"))]
    pub(crate) macro_name: &'static str,
    /// Content of the binding, for error messages.
    pub(crate) holds: &'static str,
}

impl Binding {
    const fn new(
        number: u32,
        descriptor_type: vk::DescriptorType,
        macro_name: &'static str,
        holds: &'static str,
    ) -> Self {
        Self { number, descriptor_type, macro_name, holds }
    }
}

/// The bindings, in the order of their numbers.
pub(crate) const BINDINGS: [Binding; 6] = {
    use vk::DescriptorType as Type;
    [
        Binding::new(SAMPLED_IMAGES, Type::SAMPLED_IMAGE, "LVK_BINDING_SAMPLED_IMAGES", "sampled images"),
        Binding::new(SAMPLERS, Type::SAMPLER, "LVK_BINDING_SAMPLERS", "samplers"),
        Binding::new(STORAGE_IMAGES, Type::STORAGE_IMAGE, "LVK_BINDING_STORAGE_IMAGES", "storage images"),
        Binding::new(YCBCR, Type::COMBINED_IMAGE_SAMPLER, "LVK_BINDING_YCBCR", "combined Y'CbCr samplers"),
        Binding::new(
            ACCEL_STRUCTS,
            Type::ACCELERATION_STRUCTURE_KHR,
            "LVK_BINDING_ACCEL_STRUCTS",
            "top-level acceleration structures",
        ),
        Binding::new(TLAS_TABLE, Type::STORAGE_BUFFER, "LVK_BINDING_TLAS_TABLE", "the TLAS table"),
    ]
};

/// Returns the descriptor type of one of the binding numbers above.
pub(crate) const fn descriptor_type(binding: u32) -> vk::DescriptorType {
    BINDINGS[binding as usize].descriptor_type
}

/// Descriptor counts of the bindless set, without textures and samplers.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescriptorCounts {
    /// TLAS slots, for hardware or software traversal.
    pub(super) tlas_slots: u32,
    /// TLAS descriptors; 0 without hardware acceleration structures.
    pub(super) hardware_tlas: u32,
    /// Descriptors of the TLAS table, 0 or 1.
    pub(super) tlas_tables: u32,
    /// Descriptors that count against shared limits, including the set of a pass's own targets.
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
