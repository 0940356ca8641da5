//! Creation of BLAS and TLAS for software traversal. The CPU builds the BVH of a BLAS when it is created, unless the
//! GPU builds it.
//!
//! `disabled/create.rs` has the names that other files use, for builds without the feature `software-ray-query`.

use std::sync::Arc;

use rayon::prelude::*;

use crate::accel::AccelStruct;
use crate::accel::blas::{Blas, BlasStructures};
use crate::accel::blas_file::BlasFile;
use crate::accel::desc::BlasDesc;
use crate::accel::flags::BuildMode;
use crate::command::transfer::BufferCopy;
use crate::context::Context;
use crate::context::holder::Holder;
use crate::context::plan_blas::{BlasInputs, convert_geometries, new_blas_object};
use crate::context::read_bounds::geometry_bytes;
use crate::context::readback::READBACK;
use crate::device_state::{DeferredObject, DeviceState};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::lock_order::HeldLocks;
use crate::resource::buffer::zeroed_bytes;
use crate::software_ray_query::blas::{
    BvhOrigin, SoftwareBlas, builds_on_gpu, gpu_plan, refit_plan, storage_bytes,
};
use crate::software_ray_query::bvh::build_threads::on_build_threads;
use crate::software_ray_query::bvh::encode_blas::{self, BlasBlob};
use crate::software_ray_query::bvh::primitives::Mesh;
use crate::software_ray_query::bvh::rebraid::record_capacity;
use crate::software_ray_query::bvh::settings::BvhSettings;
use crate::software_ray_query::bvh::subtrees::subtree_parts;
use crate::software_ray_query::bvh_cache::BvhKey;
use crate::software_ray_query::expected_mesh::ExpectedMesh;
use crate::software_ray_query::gpu_build::layout::GpuBuildPlan;
use crate::software_ray_query::rebraid_parts::RebraidParts;
use crate::software_ray_query::storage::SoftwareAccelStorage;
use crate::software_ray_query::tlas::SoftwareTlas;
use crate::software_ray_query::validate_blob;

/// Marks serialized BVHs that no driver wrote. It is as long as the UUIDs that blobs of drivers begin with.
pub(crate) const SOFTWARE_BLOB_UUID: [u8; 32] = *b"lvk software structure, form 3\0\0";

impl Context {
    /// Builds the BVHs of meshes on all CPU cores; `None` for those that the GPU builds, and for all if no ray is
    /// traced in software. Waits for the GPU to read the inputs back.
    pub(crate) fn software_blobs(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Option<BlasBlob>>> {
        if !self.device_state().gpu.caps.builds_software_structures() {
            return Ok(descs.iter().map(|_| None).collect());
        }
        let is_of_cpu = |desc: &&BlasDesc<'_>| !builds_on_gpu(desc.flags);
        let read: Vec<_> = descs.iter().filter(is_of_cpu).collect();
        let pieces = self.read_inputs(&read)?;
        let waiting = HeldLocks::of_current_thread();
        let build = |desc: &BlasDesc<'_>| {
            let bytes = |geometry| (geometry_bytes(geometry, &pieces), geometry.flags());
            let quality = BvhSettings::from_flags(desc.flags);
            let mesh = Mesh::new(&desc.geometries.iter().map(bytes).collect::<Vec<_>>(), quality);
            self.build_on_cpu(&mesh, quality)
        };
        let build_if_cpu = |desc| is_of_cpu(&desc).then(|| waiting.run_with(|| build(desc)));
        Ok(on_build_threads(|| descs.par_iter().map(build_if_cpu).collect()))
    }

    /// Builds the BVH of a mesh, or takes it from an earlier run if the context keeps BVHs in files.
    fn build_on_cpu(&self, mesh: &Mesh, quality: BvhSettings) -> BlasBlob {
        let build = || encode_blas::encode_blas(mesh, quality);
        match &self.device_state().tree_cache {
            Some(cache) => {
                let expected = ExpectedMesh::from_mesh(mesh);
                cache.get_or_build(BvhKey::from_mesh(mesh, quality), &expected, build)
            }
            None => build(),
        }
    }

    /// Allocates memory for a BVH that the CPU built, or that the GPU is to build; `None` if no ray is traced in
    /// software.
    pub(crate) fn software_blas(
        &self,
        desc: &BlasDesc<'_>,
        blob: Option<&BlasBlob>,
    ) -> Result<Option<SoftwareBlas>> {
        let (shared, name) = (self.device_state(), desc.debug_name);
        if !shared.gpu.caps.builds_software_structures() {
            return Ok(None);
        }
        let plan = gpu_plan(name, desc.geometries, desc.flags)?;
        let (bytes, origin) = match blob {
            Some(blob) => {
                let refit = refit_plan(&blob.header(), desc);
                let parts =
                    if refit.is_some() { RebraidParts::single(blob.bounds) } else { subtree_parts(blob) };
                let bytes = storage_bytes(blob.bytes.len() as u64, refit.as_ref(), &plan);
                (bytes, BvhOrigin::Cpu { refit, rebuild: plan, parts: Arc::new(parts) })
            }
            None => (plan.blob_bytes, BvhOrigin::Gpu(plan)),
        };
        let body = SoftwareAccelStorage::new(&shared.gpu, &shared.accel_storage, name, bytes)?;
        Ok(Some(SoftwareBlas::new(Arc::new(body), origin)))
    }

    /// Reads back the bytes of the software BVH, after a mark that no driver writes. Waits for the GPU.
    pub(crate) fn read_software_bytes(&self, blas: &Blas) -> Result<Vec<u8>> {
        let Some(software) = &blas.software else { return Ok(Vec::new()) };
        let body = software.moved_storage().unwrap_or(&software.storage);
        let (shared, size) = (self.device_state(), body.memory_bytes());
        let mut bytes = zeroed_bytes("serialize_blas", READBACK, SOFTWARE_BLOB_UUID.len() as u64 + size)?;
        bytes[..SOFTWARE_BLOB_UUID.len()].copy_from_slice(&SOFTWARE_BLOB_UUID);
        self.read_back(size, &mut bytes[SOFTWARE_BLOB_UUID.len()..], |cmd, target| {
            shared.free_later(DeferredObject::SoftwareStorage(Arc::clone(body)));
            cmd.read_software_blas(body);
            cmd.copy_buffer_objects(
                body.buffer(),
                target,
                &[BufferCopy { source_offset: body.offset(), target_offset: 0, size }],
            )
        })?;
        Ok(bytes)
    }

    /// Creates a BLAS from bytes that [`read_software_bytes`](Self::read_software_bytes) returned.
    pub(crate) fn load_software_blas(
        &self,
        desc: &BlasDesc<'_>,
        blob: &BlasFile,
    ) -> Result<Holder<AccelStructHandle>> {
        let reject = |reason: &str| Error::Serialized {
            object: desc.debug_name.to_owned(),
            reason: reason.to_owned(),
        };
        let (transforms, _) = convert_geometries(self.device_state(), desc)?;
        let bytes = match &blob.parts[..] {
            [part] => part.driver.strip_prefix(&SOFTWARE_BLOB_UUID[..]),
            _ => None,
        };
        let bytes = bytes.ok_or_else(|| reject("a driver or another version of the library wrote it"))?;
        let validated =
            validate_blob::validate_blob(bytes, &ExpectedMesh::from_desc(desc)).map_err(reject)?;
        let built = BlasBlob { bytes: bytes.to_vec(), bounds: validated.bounds };
        let software = self.software_blas(desc, Some(&built))?;
        let body = BlasStructures { structures: Vec::new(), compacted_from: None, rebuildable: true };
        let inputs = BlasInputs { transforms, parts: Vec::new() };
        let object = new_blas_object(desc, inputs, body, software);
        let handle = self.device_state().store.accel_structs.insert(object);
        let holder = Holder::new(self, handle, 0);
        let object = self.device_state().store.accel_structs.get(handle)?;
        self.upload_software_blob(&object, &built)?;
        self.record_in_prologue(|cmd| {
            let plan = cmd.plan_blas_builds(std::slice::from_ref(&object), BuildMode::Rebuild, true)?;
            cmd.record_blas_builds(plan)
        })?;
        Ok(holder)
    }

    /// Copies a BVH that the CPU built to its storage.
    pub(crate) fn upload_software_blob(&self, target: &Arc<AccelStruct>, blob: &BlasBlob) -> Result<()> {
        let Some(software) = target.blas()?.software.as_ref() else { return Ok(()) };
        let body = &software.storage;
        self.record_in_prologue(|cmd| {
            self.device_state().free_later(DeferredObject::SoftwareStorage(Arc::clone(body)));
            cmd.fill_software_blas(target, body, &blob.bytes)
        })
    }
}

/// Allocates a software TLAS; `None` if no ray is traced in software.
pub(crate) fn software_tlas(shared: &DeviceState, name: &str, capacity: u32) -> Result<Option<SoftwareTlas>> {
    if !shared.gpu.caps.builds_software_structures() {
        return Ok(None);
    }
    let plan = GpuBuildPlan::tlas(name, capacity)?;
    let built_capacity = record_capacity(capacity);
    let bytes = GpuBuildPlan::tlas(name, built_capacity)?.blob_bytes;
    let body = SoftwareAccelStorage::new(&shared.gpu, &shared.accel_storage, name, bytes)?;
    Ok(Some(SoftwareTlas { storage: Arc::new(body), plan, record_capacity: built_capacity }))
}
