//! Structures of the library's own: bottom-level ones are built by the CPU when they are created, but those that the GPU
//! builds.
//!
//! `disabled.rs` has the names that other files use, for builds without the feature `software-ray-query`.

use std::sync::Arc;

use super::Context;
use super::create_accel::blas_object;
use super::holder::Holder;
use super::plan_blas::input;
use super::read_bounds::geometry_bytes;
use crate::accel::AccelStruct;
use crate::accel::blas::{Blas, BlasBody};
use crate::accel::blas_file::Blob;
use crate::accel::desc::BlasDesc;
use crate::command::transfer::BufferCopy;
use crate::device_state::{Garbage, Shared};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::parallel::make_all;
use crate::software_ray_query::blas::{
    Origin, SoftwareBlas, body_bytes, builds_on_gpu, gpu_plan, refit_plan,
};
use crate::software_ray_query::bvh::encode_blas::{self, BlasBlob};
use crate::software_ray_query::bvh::primitives::Mesh;
use crate::software_ray_query::bvh::rebraid::room;
use crate::software_ray_query::bvh::settings::Quality;
use crate::software_ray_query::bvh::subtrees::parts;
use crate::software_ray_query::bvh_cache::TreeKey;
use crate::software_ray_query::gpu_build::layout::GpuBuildPlan;
use crate::software_ray_query::rebraid_parts::Parts;
use crate::software_ray_query::storage::SoftwareBody;
use crate::software_ray_query::tlas::SoftwareTlas;
use crate::software_ray_query::validate_blob::{self, Expected};

/// Stands in front of structures that no driver wrote; as long as what drivers begin with.
const MARK: [u8; 32] = *b"lvk software structure, form 3\0\0";

impl Context {
    /// The structures of meshes that the CPU builds, on all its cores; nothing for those that the GPU builds, and where
    /// the device traces queries itself. Waits for the GPU to read the inputs back.
    pub(super) fn software_blobs(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Option<BlasBlob>>> {
        if !self.shared().gpu.caps.software_ray_query() {
            return Ok(descs.iter().map(|_| None).collect());
        }
        let is_of_cpu = |desc: &&BlasDesc<'_>| !builds_on_gpu(desc.flags);
        let read: Vec<_> = descs.iter().filter(is_of_cpu).collect();
        let pieces = self.read_inputs(&read)?;
        let build = |desc: &BlasDesc<'_>| {
            let bytes = |geometry| (geometry_bytes(geometry, &pieces), geometry.flags());
            let quality = Quality::of(desc.flags);
            let mesh = Mesh::new(&desc.geometries.iter().map(bytes).collect::<Vec<_>>(), quality);
            self.built(&mesh, quality)
        };
        Ok(make_all(descs, |desc| is_of_cpu(&desc).then(|| build(desc))))
    }

    /// The structure of a mesh, of an earlier run where trees are kept.
    fn built(&self, mesh: &Mesh, quality: Quality) -> BlasBlob {
        let build = || encode_blas::build(mesh, quality);
        match &self.shared().tree_cache {
            Some(cache) => {
                let expected = Expected::of_mesh(mesh);
                cache.get_or(TreeKey::of(mesh, quality), &expected, build)
            }
            None => build(),
        }
    }

    /// Memory for a structure that the CPU built, or that the GPU is to build; nothing where the device traces queries
    /// itself.
    pub(super) fn software_blas(
        &self,
        desc: &BlasDesc<'_>,
        blob: Option<&BlasBlob>,
    ) -> Result<Option<SoftwareBlas>> {
        let (shared, name) = (self.shared(), desc.debug_name);
        if !shared.gpu.caps.software_ray_query() {
            return Ok(None);
        }
        let plan = gpu_plan(name, desc.geometries, desc.flags)?;
        let (bytes, origin) = match blob {
            Some(blob) => {
                let refit = refit_plan(&blob.header(), desc);
                let parts = if refit.is_some() { Parts::whole(blob.bounds) } else { parts(blob) };
                let bytes = body_bytes(blob.bytes.len() as u64, refit.as_ref(), &plan);
                (bytes, Origin::Cpu { refit, rebuild: plan, parts: Arc::new(parts) })
            }
            None => (plan.blob_bytes, Origin::Gpu(plan)),
        };
        let body = SoftwareBody::new(&shared.gpu, &shared.accel_storage, name, bytes)?;
        Ok(Some(SoftwareBlas::new(Arc::new(body), origin)))
    }

    /// The bytes of what software traces, behind a mark that no driver writes. Waits for the GPU.
    pub(super) fn software_bytes(&self, blas: &Blas) -> Result<Vec<u8>> {
        let Some(software) = &blas.software else { return Ok(Vec::new()) };
        let body = software.moved().unwrap_or(&software.body);
        let size = body.memory_bytes();
        let mut bytes = vec![0; MARK.len() + size as usize];
        bytes[..MARK.len()].copy_from_slice(&MARK);
        self.read_back(size, &mut bytes[MARK.len()..], |cmd, target| {
            cmd.read_software_blas(body);
            cmd.copy_buffer_objects(
                body.buffer(),
                target,
                &[BufferCopy { source_offset: body.offset(), target_offset: 0, size }],
            )
        })?;
        Ok(bytes)
    }

    /// A structure of what [`software_bytes`](Self::software_bytes) answered.
    pub(super) fn load_software_blas(
        &self,
        desc: &BlasDesc<'_>,
        blob: &Blob,
    ) -> Result<Holder<AccelStructHandle>> {
        let reject = |reason: &str| Error::Serialized {
            object: desc.debug_name.to_owned(),
            reason: reason.to_owned(),
        };
        input(self.shared(), desc)?;
        let bytes = match &blob.parts[..] {
            [part] => part.driver.strip_prefix(&MARK[..]),
            _ => None,
        };
        let bytes = bytes.ok_or_else(|| reject("a driver or another version of the library wrote it"))?;
        let sound = validate_blob::check(bytes, &Expected::of_desc(desc)).map_err(reject)?;
        let built = BlasBlob { bytes: bytes.to_vec(), bounds: sound.bounds };
        let software = self.software_blas(desc, Some(&built))?;
        let body = BlasBody { structures: Vec::new(), compacted_from: None, rebuildable: true };
        let object = blas_object(self.shared(), desc, Vec::new(), body, software)?;
        let handle = self.shared().store.accel_structs.insert(object);
        let holder = Holder::new(self, handle, 0);
        let object = self.shared().store.accel_structs.get(handle)?;
        self.fill_software(&object, &built)?;
        self.before_next_submission(|cmd| cmd.build_first(std::slice::from_ref(&object)))?;
        Ok(holder)
    }

    /// Copies what the CPU built.
    pub(super) fn fill_software(&self, target: &Arc<AccelStruct>, blob: &BlasBlob) -> Result<()> {
        let Some(software) = target.blas()?.software.as_ref() else { return Ok(()) };
        let body = &software.body;
        self.before_next_submission(|cmd| {
            self.shared().retire(Garbage::Software(Arc::clone(body)));
            cmd.fill_software_blas(target, body, &blob.bytes)
        })
    }
}

/// Room for what software traces, where it does.
pub(super) fn software_tlas(shared: &Shared, name: &str, capacity: u32) -> Result<Option<SoftwareTlas>> {
    if !shared.gpu.caps.software_ray_query() {
        return Ok(None);
    }
    let plan = GpuBuildPlan::tlas(name, capacity)?;
    let room = room(capacity);
    let bytes = GpuBuildPlan::tlas(name, room)?.blob_bytes;
    let body = SoftwareBody::new(&shared.gpu, &shared.accel_storage, name, bytes)?;
    Ok(Some(SoftwareTlas { body: Arc::new(body), plan, room }))
}
