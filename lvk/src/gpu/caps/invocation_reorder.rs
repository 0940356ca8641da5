//! `VK_EXT_ray_tracing_invocation_reorder`, which `ash` 0.38 lacks: its name and its structures.

use std::ffi::{CStr, c_void};

use ash::vk;

/// Name of the extension.
pub(crate) const INVOCATION_REORDER_EXT: &CStr = c"VK_EXT_ray_tracing_invocation_reorder";

/// `VkPhysicalDeviceRayTracingInvocationReorderFeaturesEXT`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct InvocationReorderFeatures {
    s_type: vk::StructureType,
    p_next: *mut c_void,
    pub(crate) ray_tracing_invocation_reorder: vk::Bool32,
}

impl Default for InvocationReorderFeatures {
    fn default() -> Self {
        let s_type = <Self as vk::TaggedStructure>::STRUCTURE_TYPE;
        Self { s_type, p_next: std::ptr::null_mut(), ray_tracing_invocation_reorder: vk::FALSE }
    }
}

// SAFETY: the structure has the layout of the one that this structure type names in `vk.xml`.
unsafe impl vk::TaggedStructure for InvocationReorderFeatures {
    const STRUCTURE_TYPE: vk::StructureType = vk::StructureType::from_raw(1_000_581_000);
}
// SAFETY: `vk.xml` lists the structure as an extension of `VkPhysicalDeviceFeatures2`.
unsafe impl vk::ExtendsPhysicalDeviceFeatures2 for InvocationReorderFeatures {}
// SAFETY: the pointer is only followed by Vulkan, inside of calls, like that of the structures of `ash`.
unsafe impl Send for InvocationReorderFeatures {}
// SAFETY: as above.
unsafe impl Sync for InvocationReorderFeatures {}

/// `VkPhysicalDeviceRayTracingInvocationReorderPropertiesEXT`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct InvocationReorderProperties {
    s_type: vk::StructureType,
    p_next: *mut c_void,
    /// 1 if the device reorders invocations, 0 if it accepts the calls and ignores them.
    reordering_hint: i32,
    max_shader_binding_table_record_index: u32,
}

impl InvocationReorderProperties {
    /// True if the device reorders invocations.
    pub(crate) fn reorders(&self) -> bool {
        self.reordering_hint == vk::RayTracingInvocationReorderModeNV::REORDER.as_raw()
    }
}

impl Default for InvocationReorderProperties {
    fn default() -> Self {
        let s_type = <Self as vk::TaggedStructure>::STRUCTURE_TYPE;
        Self {
            s_type,
            p_next: std::ptr::null_mut(),
            reordering_hint: 0,
            max_shader_binding_table_record_index: 0,
        }
    }
}

// SAFETY: the structure has the layout of the one that this structure type names in `vk.xml`.
unsafe impl vk::TaggedStructure for InvocationReorderProperties {
    const STRUCTURE_TYPE: vk::StructureType = vk::StructureType::from_raw(1_000_581_001);
}
// SAFETY: `vk.xml` lists the structure as an extension of `VkPhysicalDeviceProperties2`.
unsafe impl vk::ExtendsPhysicalDeviceProperties2 for InvocationReorderProperties {}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::*;

    /// The structures of the NV extension have the same members at the same offsets.
    #[test]
    fn the_structures_are_laid_out_like_those_of_the_other_extension() {
        type Features = vk::PhysicalDeviceRayTracingInvocationReorderFeaturesNV<'static>;
        assert_eq!(size_of::<InvocationReorderFeatures>(), size_of::<Features>());
        assert_eq!(
            offset_of!(InvocationReorderFeatures, ray_tracing_invocation_reorder),
            offset_of!(Features, ray_tracing_invocation_reorder)
        );
        type Properties = vk::PhysicalDeviceRayTracingInvocationReorderPropertiesNV<'static>;
        assert_eq!(
            offset_of!(InvocationReorderProperties, reordering_hint),
            offset_of!(Properties, ray_tracing_invocation_reorder_reordering_hint)
        );
        assert_eq!(offset_of!(InvocationReorderProperties, max_shader_binding_table_record_index), 20);
    }

    #[test]
    fn vulkan_finds_the_structures_in_a_chain_by_their_types() {
        let mut features = InvocationReorderFeatures::default();
        let mut properties = InvocationReorderProperties::default();
        let chain = vk::PhysicalDeviceFeatures2::default().push_next(&mut features);
        // SAFETY: the chain holds one structure, which begins with its type.
        assert_eq!(unsafe { *chain.p_next.cast::<vk::StructureType>() }.as_raw(), 1_000_581_000);
        let chain = vk::PhysicalDeviceProperties2::default().push_next(&mut properties);
        // SAFETY: as above.
        assert_eq!(unsafe { *chain.p_next.cast::<vk::StructureType>() }.as_raw(), 1_000_581_001);
        assert!(!properties.reorders());
        properties.reordering_hint = 1;
        assert!(properties.reorders());
    }
}
