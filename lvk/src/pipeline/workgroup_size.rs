//! Check of the size of a workgroup, with the given specialization constants, against the device.

use super::shader_module::ShaderModule;
use super::stage::SpecializationConstant;
use crate::error::{Error, Result, check_limit};

/// The largest workgroup of a stage.
pub(super) struct WorkgroupLimits {
    /// Most invocations along each axis.
    pub(super) size: [u32; 3],
    /// Most invocations in total.
    pub(super) invocations: u32,
}

/// Returns the size of a workgroup of `module` along each axis. Fails if it is empty or larger than `limits`.
pub(super) fn check_workgroup_size(
    pipeline: &str,
    module: &ShaderModule,
    specialization: &[SpecializationConstant],
    limits: &WorkgroupLimits,
) -> Result<[u32; 3]> {
    let mut invocations = 1_u64;
    let mut workgroup = module.reflection.local_size;
    for (axis, side) in workgroup.iter_mut().enumerate() {
        let id = module.reflection.local_size_ids[axis];
        let given = specialization.iter().find(|constant| Some(constant.id) == id);
        let size = given.map_or(*side, |constant| constant.value.bits() as u32);
        if size == 0 {
            return Err(Error::usage(pipeline, "a workgroup needs at least one invocation along each axis"));
        }
        check_limit(pipeline, "workgroup size along an axis", size.into(), limits.size[axis].into())?;
        invocations = invocations.saturating_mul(size.into());
        *side = size;
    }
    check_limit(pipeline, "invocations of a workgroup", invocations, limits.invocations.into())?;
    Ok(workgroup)
}
