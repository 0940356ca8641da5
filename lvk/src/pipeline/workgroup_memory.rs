//! Check of the shared memory and payload of a workgroup, with the given specialization constants, against the device.

use super::shader_module::ShaderModule;
use super::stage::SpecializationConstant;
use crate::error::{Result, check_limit};
use crate::shader::SharedBytes;

/// Memory limits of a workgroup of a stage, in bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkgroupMemoryLimits {
    /// Limit of shared memory.
    pub(super) shared: u32,
    /// Limit of the payload that a task workgroup passes to its mesh workgroups.
    pub(super) payload: u32,
    /// Limit of shared memory and payload together.
    pub(super) together: u32,
}

/// Fails if a workgroup of `module` uses more memory than `limits` allow.
pub(super) fn check_workgroup_memory(
    pipeline: &str,
    module: &ShaderModule,
    specialization: &[SpecializationConstant],
    limits: &WorkgroupMemoryLimits,
) -> Result<()> {
    let given = specialization.iter().map(|constant| (constant.id, constant.value.bits() as u32));
    check_shared_bytes(pipeline, module.reflection.shared_memory.bytes(&given.collect()), limits)
}

fn check_shared_bytes(pipeline: &str, found: SharedBytes, limits: &WorkgroupMemoryLimits) -> Result<()> {
    let SharedBytes { shared, payload } = found;
    check_limit(pipeline, "shared memory of a workgroup in bytes", shared, limits.shared.into())?;
    check_limit(pipeline, "payload of a task workgroup in bytes", payload, limits.payload.into())?;
    let both = shared.saturating_add(payload);
    check_limit(pipeline, "shared memory and payload of a workgroup in bytes", both, limits.together.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_limit_counts_and_both_together() {
        let limits = WorkgroupMemoryLimits { shared: 100, payload: 50, together: 120 };
        for (shared, payload, expected) in [
            (100, 20, None),
            (70, 50, None),
            (101, 0, Some("shared memory of a workgroup")),
            (0, 51, Some("payload of a task")),
            (100, 21, Some("shared memory and payload")),
            (u64::MAX, u64::MAX, Some("shared memory of a workgroup")),
        ] {
            let found = check_shared_bytes("p", SharedBytes { shared, payload }, &limits)
                .err()
                .map(|error| error.to_string());
            assert!(found.is_some() == expected.is_some(), "{found:?}");
            assert!(
                expected.is_none_or(|expected| found.is_some_and(|found| found.contains(expected))),
                "{expected:?}"
            );
        }
    }
}
