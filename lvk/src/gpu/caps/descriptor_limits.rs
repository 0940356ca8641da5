//! Sizes of the descriptor arrays in the bindless set. Each descriptor counts against several device limits,
//! and all of them hold.

use ash::vk;

use crate::error::{Result, check_limit};

/// Number of samplers that the library requests. Fewer if the device allows fewer.
const WANTED_SAMPLERS: u32 = 1_024;
/// Maximum number of textures on any device, because the library keeps a table entry for each.
const MAX_TEXTURES: u32 = 1 << 20;
/// The default texture and one other texture.
const MIN_TEXTURES: u32 = 2;
const OBJECT: &str = "bindless set";

/// Maximum descriptors of a layout and a pool with update-after-bind, over all stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DescriptorLimits {
    /// Samplers, including those of combined image samplers.
    pub(crate) samplers: u32,
    /// Sampled images, including those of combined image samplers.
    pub(crate) sampled_images: u32,
    pub(crate) storage_images: u32,
    /// Resources that one stage accesses, including colour targets.
    pub(crate) resources: u32,
    /// Descriptors of all kinds in all pools.
    pub(crate) in_pools: u32,
}

/// Descriptors of a context beside textures, samplers and Y'CbCr conversions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ReservedDescriptors {
    /// TLAS, and the buffers that describe them.
    pub(crate) in_set: u32,
    /// Input attachments and colour targets of a pass.
    pub(crate) targets: u32,
}

/// Requested textures in Y'CbCr formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct YuvRequest {
    pub(crate) conversions: u32,
    /// Textures of each conversion, including the default texture.
    pub(crate) textures: u32,
    /// Number of descriptors per texture.
    pub(crate) descriptors: u32,
}

/// Sizes of the texture and sampler arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DescriptorBudget {
    pub(crate) textures: u32,
    pub(crate) samplers: u32,
}

impl DescriptorLimits {
    pub(crate) fn from_properties(v12: &vk::PhysicalDeviceVulkan12Properties<'_>) -> Self {
        Self {
            samplers: v12
                .max_per_stage_descriptor_update_after_bind_samplers
                .min(v12.max_descriptor_set_update_after_bind_samplers),
            sampled_images: v12
                .max_per_stage_descriptor_update_after_bind_sampled_images
                .min(v12.max_descriptor_set_update_after_bind_sampled_images),
            storage_images: v12
                .max_per_stage_descriptor_update_after_bind_storage_images
                .min(v12.max_descriptor_set_update_after_bind_storage_images),
            resources: v12.max_per_stage_update_after_bind_resources,
            in_pools: v12.max_update_after_bind_descriptors_in_all_pools,
        }
    }

    /// Queries the limits of a device.
    pub(crate) fn query(instance: &ash::Instance, device: vk::PhysicalDevice) -> Self {
        let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
        let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut v12);
        // SAFETY: the device was enumerated from the instance, and supports the structure, which lives until
        // the call returns.
        unsafe { instance.get_physical_device_properties2(device, &mut all) };
        Self::from_properties(&v12)
    }

    /// Returns the number of Y'CbCr textures per conversion. They take at most half of the descriptors, as
    /// the other textures need the rest.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) if there are too many conversions.
    pub(crate) fn yuv_textures(&self, reserved: &ReservedDescriptors, request: &YuvRequest) -> Result<u32> {
        let each = request.descriptors.max(1);
        let most = self.samplers.min(self.sampled_images).min(self.remaining(reserved)) / 2 / each;
        check_limit("ContextDesc::yuv", "number of conversions", request.conversions.into(), most.into())?;
        Ok(request.textures.min(most / request.conversions.max(1)))
    }

    /// Returns the array sizes beside `yuv` descriptors of Y'CbCr textures. A texture takes a sampled and a
    /// storage image descriptor.
    pub(crate) fn budget(&self, reserved: &ReservedDescriptors, yuv: u32) -> DescriptorBudget {
        let left = self.remaining(reserved).saturating_sub(yuv);
        let samplers = WANTED_SAMPLERS.min(self.samplers.saturating_sub(yuv)).min(left / 2);
        let textures = self
            .sampled_images
            .saturating_sub(yuv)
            .min(self.storage_images)
            .min((left - samplers) / 2)
            .min(MAX_TEXTURES);
        DescriptorBudget { textures, samplers }
    }

    /// Returns the number of descriptors of any kind beside the reserved ones, limited by stage and by pools.
    fn remaining(&self, reserved: &ReservedDescriptors) -> u32 {
        let in_stage = self.resources.saturating_sub(reserved.in_set).saturating_sub(reserved.targets);
        in_stage.min(self.in_pools.saturating_sub(reserved.in_set))
    }
}

impl DescriptorBudget {
    /// Returns the budget with at most so many textures and samplers.
    pub(crate) fn at_most(self, textures: u32, samplers: u32) -> Self {
        Self { textures: self.textures.min(textures), samplers: self.samplers.min(samplers) }
    }

    /// Returns the number of textures that a context gets if it requests `wanted`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) if not even one texture fits beside the default
    /// texture.
    pub(crate) fn texture_count(&self, wanted: u32) -> Result<u32> {
        check_limit(OBJECT, "number of textures", MIN_TEXTURES.into(), self.textures.into())?;
        Ok(wanted.clamp(MIN_TEXTURES, self.textures))
    }
}

/// Returns the largest number of textures that satisfies `fits`, found by halving `wanted`.
///
/// # Errors
/// [`Error::LimitExceeded`](crate::Error::LimitExceeded) if not even one texture fits beside the default
/// texture.
pub(crate) fn largest_fitting(wanted: u32, fits: impl Fn(u32) -> bool) -> Result<u32> {
    let half = |textures: &u32| (*textures > MIN_TEXTURES).then(|| (textures / 2).max(MIN_TEXTURES));
    let found = std::iter::successors(Some(wanted), half).find(|textures| fits(*textures)).unwrap_or(0);
    check_limit(OBJECT, "number of textures", MIN_TEXTURES.into(), found.into())?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use proptest::prelude::*;

    use super::*;

    fn number() -> impl Strategy<Value = u32> {
        prop_oneof![0..200_u32, 400..4_000_u32, 400_000..2_000_000_u32, Just(u32::MAX), any::<u32>()]
    }

    prop_compose! {
        fn limits()(all in [number(), number(), number(), number(), number()]) -> DescriptorLimits {
            let [samplers, sampled_images, storage_images, resources, in_pools] = all;
            DescriptorLimits { samplers, sampled_images, storage_images, resources, in_pools }
        }
    }

    prop_compose! {
        fn reserved()(in_set in 0..300_u32, targets in 0..19_u32) -> ReservedDescriptors {
            ReservedDescriptors { in_set, targets }
        }
    }

    prop_compose! {
        fn request()(
            conversions in prop_oneof![0..6_u32, 0..2_000_u32], textures in 1..1_026_u32, descriptors in 1..4_u32
        ) -> YuvRequest {
            YuvRequest { conversions, textures, descriptors }
        }
    }

    /// True if Vulkan allows a layout and a pool with these descriptors.
    fn holds(
        limits: &DescriptorLimits,
        reserved: &ReservedDescriptors,
        yuv: u32,
        budget: &DescriptorBudget,
    ) -> bool {
        let [textures, samplers, yuv] = [budget.textures, budget.samplers, yuv].map(u64::from);
        let all = 2 * textures + samplers + yuv + u64::from(reserved.in_set);
        samplers + yuv <= limits.samplers.into()
            && textures + yuv <= limits.sampled_images.into()
            && textures <= limits.storage_images.into()
            && all + u64::from(reserved.targets) <= limits.resources.into()
            && all <= limits.in_pools.into()
    }

    proptest! {
        #[test]
        fn everything_a_context_gets_is_within_every_limit(limits in limits(), reserved in reserved(), request in request()) {
            let Ok(each) = limits.yuv_textures(&reserved, &request) else { return Ok(()) };
            prop_assert!(each <= request.textures);
            let yuv = each * request.conversions * request.descriptors;
            let budget = limits.budget(&reserved, yuv);
            if let Ok(textures) = budget.texture_count(u32::MAX) {
                let all = DescriptorBudget { textures, ..budget };
                prop_assert!(holds(&limits, &reserved, yuv, &all));
                let more = DescriptorBudget { textures: textures + 1, ..budget };
                prop_assert!(textures == MAX_TEXTURES || !holds(&limits, &reserved, yuv, &more));
            }
        }

        #[test]
        fn a_context_gets_what_it_wants_where_that_fits(request in request(), wanted in 2..400_000_u32) {
            let request = YuvRequest { conversions: request.conversions.min(8), ..request };
            let limits = promised();
            let reserved = ReservedDescriptors { in_set: 257, targets: 18 };
            prop_assert_eq!(limits.yuv_textures(&reserved, &request).unwrap(), request.textures);
            let yuv = request.textures * request.conversions * request.descriptors;
            let budget = limits.budget(&reserved, yuv);
            prop_assert_eq!(budget.samplers, WANTED_SAMPLERS);
            let fits = wanted <= 200_000;
            prop_assert!(!fits || budget.texture_count(wanted).unwrap() == wanted);
        }

        #[test]
        fn halving_ends_at_what_fits(wanted in 2..=u32::MAX, most in number()) {
            let found = largest_fitting(wanted, |textures| textures <= most).ok();
            prop_assert_eq!(found.is_some(), most >= MIN_TEXTURES);
            prop_assert!(found.is_none_or(|found| found <= most && (found == wanted || found > most / 2 - 1)));
        }
    }

    /// Limits that Vulkan guarantees on every device with `descriptorIndexing`.
    fn promised() -> DescriptorLimits {
        let many = 500_000;
        DescriptorLimits {
            samplers: many,
            sampled_images: many,
            storage_images: many,
            resources: many,
            in_pools: many,
        }
    }

    #[test]
    fn conversions_and_pools_leave_less_for_textures() {
        let (limits, reserved) = (promised(), ReservedDescriptors { in_set: 257, targets: 18 });
        assert_eq!(limits.budget(&reserved, 0).textures, (500_000 - 257 - 18 - 1_024) / 2);
        assert_eq!(
            limits.budget(&reserved, 4 * 1_025 * 3).textures,
            (500_000 - 257 - 18 - 1_024 - 12_300) / 2
        );
        let small_pools = DescriptorLimits { in_pools: 20_000, ..limits };
        assert_eq!(small_pools.budget(&reserved, 36).textures, (20_000 - 257 - 1_024 - 36) / 2);
    }

    #[test]
    fn tightened_limits_bound_the_budget() {
        let budget = DescriptorBudget { textures: 10, samplers: 2 };
        assert_eq!(budget.at_most(9, 3), DescriptorBudget { textures: 9, samplers: 2 });
    }

    #[test]
    fn too_many_conversions_are_refused() {
        let request = YuvRequest { conversions: 83_334, textures: 2, descriptors: 3 };
        let refused = promised().yuv_textures(&ReservedDescriptors::default(), &request);
        assert!(refused.unwrap_err().to_string().contains("ContextDesc::yuv"));
        let less = YuvRequest { conversions: 83_333, ..request };
        assert_eq!(promised().yuv_textures(&ReservedDescriptors::default(), &less).unwrap(), 1);
    }

    #[test]
    fn a_device_without_a_slot_for_a_texture_is_refused() {
        let budget = DescriptorBudget { textures: 1, samplers: 1 };
        assert!(budget.texture_count(5).is_err());
        assert!(largest_fitting(9, |_| false).is_err());
    }
}
