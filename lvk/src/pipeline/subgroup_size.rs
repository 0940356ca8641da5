//! Check of the subgroups that a compute pipeline requires, against the device.

use ash::vk;

use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::subgroup_limits::SubgroupLimits;

/// The subgroups that a compute pipeline requires.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct SubgroupRequest {
    /// Invocations of each subgroup.
    pub(super) size: Option<u32>,
    /// True if no subgroup may have inactive invocations at its start.
    pub(super) full: bool,
}

impl SubgroupRequest {
    /// Fails unless the device can run workgroups of `workgroup` invocations along each axis in such subgroups.
    pub(super) fn check(self, gpu: &Gpu, pipeline: &str, workgroup: [u32; 3]) -> Result<()> {
        if let Some(size) = self.size {
            let what = format!("the subgroup size {size} of '{pipeline}'");
            gpu.require(OptionalFeature::SubgroupSizeControl, &what)?;
        }
        if self.full {
            gpu.require(OptionalFeature::ComputeFullSubgroups, &format!("full subgroups of '{pipeline}'"))?;
        }
        self.check_limits(pipeline, workgroup, &gpu.caps.limits.subgroup)
    }

    fn check_limits(self, pipeline: &str, workgroup: [u32; 3], limits: &SubgroupLimits) -> Result<()> {
        if let Some(size) = self.size {
            check_size(pipeline, size, limits)?;
            let invocations = workgroup.into_iter().fold(1_u64, |all, side| all.saturating_mul(side.into()));
            let subgroups = invocations.div_ceil(size.into());
            let most = limits.max_workgroup_subgroups.into();
            check_limit(
                pipeline,
                "subgroups of a workgroup (maxComputeWorkgroupSubgroups)",
                subgroups,
                most,
            )?;
        }
        // Without a size, SPIR-V 1.6 lets the device choose any size up to the largest.
        let (width, of) = match self.size {
            Some(size) => (size, "required_subgroup_size"),
            None => (limits.max_size.max(1), "Limits::subgroup.max_size"),
        };
        if !self.full || workgroup[0].is_multiple_of(width) {
            return Ok(());
        }
        let message = format!(
            "full subgroups need a workgroup whose size along x is a multiple of {width} ({of}), not {}",
            workgroup[0]
        );
        Err(Error::usage(pipeline, message))
    }

    /// Returns the flags of the shader stage.
    pub(super) fn flags(self) -> vk::PipelineShaderStageCreateFlags {
        match self.full {
            true => vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS,
            false => vk::PipelineShaderStageCreateFlags::empty(),
        }
    }
}

/// Fails unless compute pipelines may require `size`.
fn check_size(pipeline: &str, size: u32, limits: &SubgroupLimits) -> Result<()> {
    if !limits.required_size_stages.contains(vk::ShaderStageFlags::COMPUTE) {
        let why =
            "requiredSubgroupSizeStages of the device has no compute stage; leave the size to the device";
        return Err(Error::unsupported(format!("the subgroup size {size} of '{pipeline}'"), why));
    }
    if !size.is_power_of_two() {
        let message = format!("a subgroup size is a power of two, not {size}");
        return Err(Error::usage(pipeline, message));
    }
    if size < limits.min_size {
        let message = format!(
            "the subgroup size {size} is less than {}, the least that the device takes (minSubgroupSize)",
            limits.min_size
        );
        return Err(Error::usage(pipeline, message));
    }
    check_limit(pipeline, "subgroup size (maxSubgroupSize)", size.into(), limits.max_size.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: SubgroupLimits = SubgroupLimits {
        size: 64,
        min_size: 32,
        max_size: 64,
        max_workgroup_subgroups: 16,
        required_size_stages: vk::ShaderStageFlags::COMPUTE,
    };

    fn outcome(size: Option<u32>, full: bool, workgroup: [u32; 3], limits: &SubgroupLimits) -> String {
        let request = SubgroupRequest { size, full };
        request
            .check_limits("blur", workgroup, limits)
            .map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn sizes_within_the_limits_are_accepted() {
        for (size, full, workgroup) in [
            (None, false, [7, 3, 1]),
            (None, true, [128, 3, 1]),
            (Some(32), false, [7, 3, 1]),
            (Some(32), true, [32, 16, 1]),
            (Some(64), true, [64, 16, 1]),
            (Some(64), false, [1024, 1, 1]),
        ] {
            assert_eq!(outcome(size, full, workgroup, &LIMITS), "", "{size:?} {full} {workgroup:?}");
        }
    }

    #[test]
    fn each_refusal_names_its_limit() {
        for (size, full, workgroup, part) in [
            (Some(0), false, [64, 1, 1], "power of two, not 0"),
            (Some(48), false, [64, 1, 1], "power of two, not 48"),
            (Some(16), false, [64, 1, 1], "minSubgroupSize"),
            (Some(128), false, [64, 1, 1], "maxSubgroupSize) is 128, the device takes at most 64"),
            (
                Some(32),
                false,
                [513, 1, 1],
                "maxComputeWorkgroupSubgroups) is 17, the device takes at most 16",
            ),
            (Some(32), false, [u32::MAX; 3], "maxComputeWorkgroupSubgroups"),
            (Some(32), true, [48, 2, 1], "a multiple of 32 (required_subgroup_size), not 48"),
            (None, true, [32, 2, 1], "a multiple of 64 (Limits::subgroup.max_size), not 32"),
        ] {
            let told = outcome(size, full, workgroup, &LIMITS);
            assert!(told.contains(part) && told.contains("blur"), "{told}");
        }
    }

    #[test]
    fn a_stage_that_cannot_choose_is_refused() {
        let limits = SubgroupLimits { required_size_stages: vk::ShaderStageFlags::FRAGMENT, ..LIMITS };
        let told = outcome(Some(32), false, [64, 1, 1], &limits);
        assert!(told.contains("requiredSubgroupSizeStages"), "{told}");
        assert_eq!(outcome(None, true, [64, 1, 1], &limits), "");
    }

    #[test]
    fn a_device_without_control_has_one_size() {
        let limits = LIMITS.without_size_control();
        assert_eq!((limits.min_size, limits.max_size), (64, 64));
        assert!(outcome(Some(64), false, [64, 1, 1], &limits).contains("requiredSubgroupSizeStages"));
    }
}
