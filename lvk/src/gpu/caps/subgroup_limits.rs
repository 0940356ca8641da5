//! Limits of subgroups.

use ash::vk;

/// Limits of subgroups, and of pipelines that choose their size
/// ([`ComputePipelineDesc::required_subgroup_size`](crate::ComputePipelineDesc::required_subgroup_size)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SubgroupLimits {
    /// Invocations of a subgroup where no pipeline chooses another size (`subgroupSize`). A power of two.
    pub size: u32,
    /// Minimum size that a pipeline may require (`minSubgroupSize`). Equals [`size`](Self::size) without
    /// [`OptionalFeature::SubgroupSizeControl`](crate::OptionalFeature::SubgroupSizeControl).
    pub min_size: u32,
    /// Maximum size that a pipeline may require (`maxSubgroupSize`), bounded like [`min_size`](Self::min_size).
    pub max_size: u32,
    /// Maximum number of subgroups in a compute workgroup of a pipeline that requires a size
    /// (`maxComputeWorkgroupSubgroups`).
    pub max_workgroup_subgroups: u32,
    /// Stages that may require a size (`requiredSubgroupSizeStages`). Empty without
    /// [`OptionalFeature::SubgroupSizeControl`](crate::OptionalFeature::SubgroupSizeControl).
    pub required_size_stages: vk::ShaderStageFlags,
}

impl SubgroupLimits {
    /// Converts the limits reported by the device.
    pub(crate) fn from_properties(
        v11: &vk::PhysicalDeviceVulkan11Properties<'_>,
        v13: &vk::PhysicalDeviceVulkan13Properties<'_>,
    ) -> Self {
        Self {
            size: v11.subgroup_size,
            min_size: v13.min_subgroup_size,
            max_size: v13.max_subgroup_size,
            max_workgroup_subgroups: v13.max_compute_workgroup_subgroups,
            required_size_stages: v13.required_subgroup_size_stages,
        }
    }

    /// Returns the limits of a device whose pipelines cannot choose a size.
    #[must_use]
    pub(crate) fn without_size_control(self) -> Self {
        Self {
            min_size: self.size,
            max_size: self.size,
            max_workgroup_subgroups: 0,
            required_size_stages: vk::ShaderStageFlags::empty(),
            ..self
        }
    }
}
