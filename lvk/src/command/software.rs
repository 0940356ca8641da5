//! Builds of the library's own structures.

use ash::vk;

use super::CommandBuffer;
use crate::accel::AccelStruct;
use crate::accel::instance::TlasInstance;
use crate::barrier::{ResourceId, Use};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::software::body::SoftwareBody;
use crate::software::instances::{PlacedInstance, ShownStructure, place};
use crate::software::tlas_blob;

impl CommandBuffer {
    /// Copies what the CPU built into a bottom-level structure.
    pub(crate) fn fill_software_blas(
        &mut self,
        target: &AccelStruct,
        body: &SoftwareBody,
        bytes: &[u8],
    ) -> Result<()> {
        self.fill_software(target, self.shared.all_blas, body, bytes)
    }

    /// Builds a top-level structure of the library's own from instances of the host.
    pub(super) fn build_software_tlas(
        &mut self,
        target: &AccelStruct,
        body: &SoftwareBody,
        instances: &[TlasInstance],
    ) -> Result<()> {
        let mut placed: Vec<PlacedInstance> = Vec::with_capacity(instances.len());
        let mut last: Option<(AccelStructHandle, ShownStructure)> = None;
        for (number, instance) in (0..).zip(instances) {
            let shown = match last {
                Some((handle, shown)) if handle == instance.blas => shown,
                _ => self.shown_structure(instance.blas)?,
            };
            last = Some((instance.blas, shown));
            placed.extend(place(number, instance, &shown));
        }
        let bytes = tlas_blob::build(&placed);
        self.fill_software(target, self.shared.all_tlas, body, &bytes)
    }

    fn shown_structure(&self, handle: AccelStructHandle) -> Result<ShownStructure> {
        let blas = self.shared.store.accel_structs.get(handle)?;
        let body = blas.blas()?.software.as_ref();
        let known = body.and_then(|body| Some(ShownStructure { address: body.address, bounds: body.bounds? }));
        known.ok_or_else(|| Error::usage(&blas.name, "the structure has nothing that software could trace"))
    }

    fn fill_software(
        &mut self,
        target: &AccelStruct,
        all: ResourceId,
        body: &SoftwareBody,
        bytes: &[u8],
    ) -> Result<()> {
        let region = self.shared.staging.write(bytes, 16, self.recording.sequence)?;
        self.retire_temporary(region.temporary);
        self.uses.id(target.id, Use::transfer_write());
        self.uses.accumulate(all, Use::transfer_write());
        self.flush();
        let copy = vk::BufferCopy {
            src_offset: region.offset,
            dst_offset: body.offset(),
            size: bytes.len() as u64,
        };
        // SAFETY: the structure has room for the bytes, which lie in the staging memory.
        unsafe {
            self.shared.gpu.device.cmd_copy_buffer(self.raw(), region.buffer, body.buffer().raw, &[copy]);
        }
        Ok(())
    }
}
