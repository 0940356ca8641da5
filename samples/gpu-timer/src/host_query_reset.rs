//! The feature by which the host resets queries: queues for transfers alone cannot.

use ash::vk;

/// Calls `create` with a description of a device that enables `hostQueryReset`, whatever the program's own says. Every device with
/// Vulkan 1.2 has the feature.
///
/// # Safety
/// `info` is a valid description of a device. A structure of its chain that has the feature is in memory that can be written, and no other
/// thread uses it.
pub(crate) unsafe fn create_with_host_query_reset(
    info: *const vk::DeviceCreateInfo<'_>,
    create: impl FnOnce(*const vk::DeviceCreateInfo<'_>) -> vk::Result,
) -> vk::Result {
    // SAFETY: by contract; every structure of a chain starts with its type and the next one.
    unsafe {
        let mut next = (*info).p_next.cast_mut().cast::<vk::BaseOutStructure<'_>>();
        while !next.is_null() {
            let switch = match (*next).s_type {
                vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => {
                    &raw mut (*next.cast::<vk::PhysicalDeviceVulkan12Features<'_>>()).host_query_reset
                }
                vk::StructureType::PHYSICAL_DEVICE_HOST_QUERY_RESET_FEATURES => {
                    &raw mut (*next.cast::<vk::PhysicalDeviceHostQueryResetFeatures<'_>>()).host_query_reset
                }
                _ => {
                    next = (*next).p_next;
                    continue;
                }
            };
            let before = switch.replace(vk::TRUE);
            let result = create(info);
            *switch = before;
            return result;
        }
        let mut feature = vk::PhysicalDeviceHostQueryResetFeatures::default().host_query_reset(true);
        feature.p_next = (*info).p_next.cast_mut();
        let mut with_feature = *info;
        with_feature.p_next = (&raw const feature).cast();
        create(&raw const with_feature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// True if the layer below gets the feature in the description.
    fn told(info: &vk::DeviceCreateInfo<'_>) -> bool {
        let mut found = false;
        let look = |info: *const vk::DeviceCreateInfo<'_>| {
            // SAFETY: the chains of these tests are valid.
            unsafe {
                let mut next = (*info).p_next.cast::<vk::BaseInStructure<'_>>();
                while !next.is_null() {
                    found |= vk::TRUE
                        == match (*next).s_type {
                            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => {
                                (*next.cast::<vk::PhysicalDeviceVulkan12Features<'_>>()).host_query_reset
                            }
                            vk::StructureType::PHYSICAL_DEVICE_HOST_QUERY_RESET_FEATURES => {
                                (*next.cast::<vk::PhysicalDeviceHostQueryResetFeatures<'_>>())
                                    .host_query_reset
                            }
                            _ => vk::FALSE,
                        };
                    next = (*next).p_next;
                }
            }
            vk::Result::SUCCESS
        };
        // SAFETY: the description is valid.
        assert_eq!(unsafe { create_with_host_query_reset(info, look) }, vk::Result::SUCCESS);
        found
    }

    #[test]
    fn the_feature_is_on_below_and_as_it_was_above() {
        assert!(told(&vk::DeviceCreateInfo::default()), "nothing asked for");
        let mut of_12 = vk::PhysicalDeviceVulkan12Features::default();
        assert!(told(&vk::DeviceCreateInfo::default().push_next(&mut of_12)));
        assert_eq!(of_12.host_query_reset, vk::FALSE);
        let mut own = vk::PhysicalDeviceHostQueryResetFeatures::default().host_query_reset(true);
        assert!(told(&vk::DeviceCreateInfo::default().push_next(&mut own)));
        assert_eq!(own.host_query_reset, vk::TRUE);
        // Behind another structure, and beside another one.
        let mut of_13 = vk::PhysicalDeviceVulkan13Features::default();
        assert!(told(&vk::DeviceCreateInfo::default().push_next(&mut of_12).push_next(&mut of_13)));
        assert_eq!(of_12.host_query_reset, vk::FALSE);
        assert!(told(&vk::DeviceCreateInfo::default().push_next(&mut of_13)));
    }
}
