//! A scenario with a defect: it proves that the layer sees leaks.

use lvk::ContextDesc;
use lvk::ash::vk;

use crate::{Failure, context};

/// Creates a fence and forgets it.
pub(crate) fn forgotten_fence() -> Result<Vec<u8>, Failure> {
    let ctx = context(ContextDesc::default())?;
    // SAFETY: the description is valid.
    let _fence = unsafe { ctx.raw_device().create_fence(&vk::FenceCreateInfo::default(), None)? };
    Ok(b"done".to_vec())
}
