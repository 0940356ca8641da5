//! Report of the wrong bindless indices that shaders have used.

use super::Context;
use super::readback::READBACK;
use crate::bindless::index_checks::{IndexChecks, IndexFault};
use crate::command::transfer::BufferCopy;
use crate::error::{Error, Result};

impl Context {
    /// Returns every wrong index of a bindless array that shaders have used so far, in the order of arrays, indices and
    /// shaders. Submits pending work and waits for the GPU.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) unless [`ContextDesc::check_indices`](crate::ContextDesc::check_indices)
    /// is set.
    pub fn index_faults(&self) -> Result<Vec<IndexFault>> {
        let message = "set ContextDesc::check_indices to have indices checked";
        let checks = self.device_state().bindless.checks.as_ref();
        let checks = checks.ok_or_else(|| Error::usage("index_faults", message))?;
        let bytes = IndexChecks::fault_bytes();
        let mut words = vec![0_u32; bytes as usize / 4];
        self.read_back(bytes, bytemuck::cast_slice_mut(&mut words), |cmd, target| {
            cmd.copy_buffer_objects(
                &checks.buffer,
                target,
                &[BufferCopy { source_offset: 0, target_offset: 0, size: bytes }],
            )
        })
        .map_err(|error| error.with_owner(READBACK, "index_faults"))?;
        Ok(checks.report_faults(&words))
    }
}
