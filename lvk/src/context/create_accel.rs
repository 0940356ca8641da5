//! Creates acceleration structures. Their builds run before the next submission; nothing waits.

use super::Context;
use super::holder::Holder;
use crate::accel::AccelStruct;
use crate::accel::build::{BuildInput, transforms};
use crate::accel::desc::{BlasDesc, TlasDesc};
use crate::accel::structure::{AccelKind, AccelStructSizes, Blas, BuildMode, Tlas};
use crate::error::{Error, Result, check_limit};
use crate::gpu::memory::MemoryKind;
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::shared::Shared;

impl Context {
    /// Creates a bottom-level structure from geometries and builds it before the next submission.
    pub fn create_blas(&self, desc: &BlasDesc<'_>) -> Result<Holder<AccelStructHandle>> {
        let mut made = self.create_blas_batch(std::slice::from_ref(desc))?;
        made.pop().ok_or_else(|| Error::usage(desc.debug_name, "nothing was built"))
    }

    /// Creates many bottom-level structures, built together within the scratch budget before the next submission.
    pub fn create_blas_batch(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Holder<AccelStructHandle>>> {
        let mut holders = Vec::with_capacity(descs.len());
        let mut objects = Vec::with_capacity(descs.len());
        for desc in descs {
            let handle = self.shared().store.accel_structs.insert(new_blas(self.shared(), desc)?);
            holders.push(Holder::new(self, handle, 0));
            objects.push(self.shared().store.accel_structs.get(handle)?);
        }
        self.before_next_submission(|cmd| cmd.build_all(&objects, BuildMode::Rebuild))?;
        Ok(holders)
    }

    /// Creates a top-level structure and builds it before the next submission. [`Holder::index`] is its element of
    /// `kTLAS[]`.
    pub fn create_tlas(&self, desc: &TlasDesc<'_>) -> Result<Holder<AccelStructHandle>> {
        let shared = self.shared();
        shared.gpu.accel()?;
        let slot = shared.reserve(|| shared.bindless.reserve_tlas(desc.debug_name))?;
        let tlas = new_tlas(shared, desc, slot).inspect_err(|_| shared.bindless.free_tlas(slot))?;
        shared.bindless.set_tlas(slot, tlas.raw);
        let handle = shared.store.accel_structs.insert(tlas);
        let holder = Holder::new(self, handle, slot);
        self.before_next_submission(|cmd| cmd.update_tlas(handle, desc.instances, BuildMode::Rebuild))?;
        Ok(holder)
    }

    /// Bytes a bottom-level structure would take (`vkGetAccelerationStructureBuildSizesKHR`).
    pub fn blas_sizes(&self, desc: &BlasDesc<'_>) -> Result<AccelStructSizes> {
        sizes_of_blas(self.shared(), desc)
    }

    /// Bytes an acceleration structure takes.
    pub fn accel_struct_sizes(&self, handle: AccelStructHandle) -> Result<AccelStructSizes> {
        Ok(self.shared().store.accel_structs.get(handle)?.sizes)
    }
}

fn sizes_of_blas(shared: &Shared, desc: &BlasDesc<'_>) -> Result<AccelStructSizes> {
    desc.flags.check(desc.debug_name)?;
    let find = |handle| shared.store.buffers.get(handle);
    let has_transforms = desc.geometries.iter().any(|geometry| geometry.transform().is_some());
    // A size query only looks at whether the address is null.
    let transforms = has_transforms.then_some(16);
    shared.gpu.accel()?;
    BuildInput::blas(&shared.gpu, desc.debug_name, desc.geometries, desc.flags, &find, transforms)?
        .sizes(&shared.gpu)
}

fn new_blas(shared: &Shared, desc: &BlasDesc<'_>) -> Result<AccelStruct> {
    let sizes = sizes_of_blas(shared, desc)?;
    let transforms = match transforms(desc.geometries) {
        Some(matrices) => Some(new_transforms(shared, desc.debug_name, &matrices)?),
        None => None,
    };
    let blas = Blas { geometries: desc.geometries.to_vec(), transforms };
    AccelStruct::new(&shared.gpu, desc.debug_name, desc.flags, sizes, AccelKind::Blas(blas))
}

fn new_transforms(shared: &Shared, name: &str, matrices: &[f32]) -> Result<Buffer> {
    let bytes: &[u8] = bytemuck::cast_slice(matrices);
    let desc = BufferDesc {
        size_bytes: bytes.len() as u64,
        usage: BufferUsage::ACCEL_INPUT,
        memory: MemoryKind::HostVisible,
        data: None,
        debug_name: name,
    };
    let buffer = Buffer::new(&shared.gpu, &desc, InternalUsage::NONE)?;
    buffer.write(0, bytes);
    Ok(buffer)
}

/// Makes a top-level structure for a slot the caller reserved; nothing is built yet.
pub(super) fn new_tlas(shared: &Shared, desc: &TlasDesc<'_>, slot: u32) -> Result<AccelStruct> {
    let name = desc.debug_name;
    desc.flags.check(name)?;
    let count = u32::try_from(desc.instances.len()).unwrap_or(u32::MAX);
    let capacity = desc.capacity.max(count);
    check_limit(name, "instance capacity", capacity.into(), shared.gpu.caps.limits.max_tlas_instances)?;
    let sizes = BuildInput::tlas(desc.flags, 0, capacity).sizes(&shared.gpu)?;
    AccelStruct::new(&shared.gpu, name, desc.flags, sizes, AccelKind::Tlas(Tlas::new(slot, capacity)))
}
