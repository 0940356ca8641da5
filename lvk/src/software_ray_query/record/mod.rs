//! Records builds of software BVHs.
//!
//! `disabled/record.rs` has the names that other files use, for builds without the feature `software-ray-query`.

pub(crate) mod gpu_build;
mod place_instances;

use std::sync::Arc;

use ash::vk;

use crate::accel::AccelStruct;
use crate::accel::blas::Blas;
use crate::accel::blas_refs::{BlasRef, BlasRefSet};
use crate::accel::instance::{DeviceInstances, TlasInstance, instance_bytes};
use crate::accel::instance_writing::write_plain_addresses;
use crate::command::CommandBuffer;
use crate::software_ray_query::blas::{BvhOrigin, SoftwareBlas};
use crate::software_ray_query::gpu_build::geometry::{GpuGeometry, gpu_geometries};
use crate::software_ray_query::gpu_build::layout::{BuildSource, GpuBuildPlan};
use crate::software_ray_query::gpu_build::refit_layout::GpuRefitPlan;
use crate::software_ray_query::layout::{FORMAT_MOVED, MovedHeader};
use crate::software_ray_query::storage::SoftwareAccelStorage;
use crate::software_ray_query::tlas::SoftwareTlas;

use crate::barrier::{ResourceId, Stages, Use};
use crate::error::{Error, Result};
use crate::resource::Buffer;
use crate::software_ray_query::bvh::encode_tlas;

use gpu_build::{GpuBuild, GpuRefit};
use place_instances::place_instances;

/// Up to this many instances, the CPU builds the BVH of a TLAS, whose quality is worth its time. A driver that runs on
/// the CPU has no faster builds.
const MAX_CPU_TLAS_INSTANCES: usize = 512;
/// Alignment of tables and records, in bytes.
const ALIGNMENT: u64 = 16;

/// Builds and refits to record together.
#[derive(Default)]
pub(crate) struct SoftwareBuilds {
    targets: Vec<ResourceId>,
    builds: Vec<GpuBuild>,
    refits: Vec<GpuRefit>,
    moves: Vec<BlobMove>,
}

/// A BLAS whose CPU-built BVH is replaced by one of the GPU.
struct BlobMove {
    target: ResourceId,
    /// The old storage and the header to write there, if the new BVH lies elsewhere.
    left: Option<(Arc<SoftwareAccelStorage>, MovedHeader)>,
}

impl CommandBuffer {
    /// Copies a BVH that the CPU built into the storage of a BLAS.
    pub(crate) fn fill_software_blas(
        &mut self,
        target: &AccelStruct,
        body: &SoftwareAccelStorage,
        bytes: &[u8],
    ) -> Result<()> {
        self.fill_software_storage(target, self.shared.new_blas[self.recording.queue_index], body, bytes)
    }

    /// Declares that the next command copies the software BVH.
    pub(crate) fn read_software_blas(&mut self, body: &SoftwareAccelStorage) {
        self.use_all_blas(Use::transfer_read());
        self.use_buffer(body.buffer(), Use::transfer_read());
    }

    fn fill_software_storage(
        &mut self,
        target: &AccelStruct,
        all: ResourceId,
        body: &SoftwareAccelStorage,
        bytes: &[u8],
    ) -> Result<()> {
        let region = self.shared.staging.write(bytes, ALIGNMENT, self.recording.staging_key())?;
        self.state.accesses.add_id(target.id, Use::transfer_write());
        self.state.accesses.add_accumulating(all, Use::transfer_write());
        self.use_buffer(body.buffer(), Use::transfer_write());
        self.flush_barriers();
        let copy =
            vk::BufferCopy { src_offset: region.offset, dst_offset: body.offset(), size: bytes.len() as u64 };
        // SAFETY: the storage has at least as many bytes, and the bytes lie in the staging memory.
        unsafe {
            self.shared.gpu.device.cmd_copy_buffer(self.raw(), region.buffer, body.buffer().raw, &[copy]);
        }
        Ok(())
    }

    /// Plans the builds of the GPU for BLAS that have no BVH yet. BVHs that the CPU built need no build.
    pub(crate) fn plan_first_software_builds(
        &self,
        structures: &[Arc<AccelStruct>],
    ) -> Result<SoftwareBuilds> {
        let is_of_gpu = |target: &&Arc<AccelStruct>| {
            let software = target.blas().ok().and_then(|blas| blas.software.as_ref());
            software.is_some_and(|software| matches!(software.origin, BvhOrigin::Gpu(_)))
        };
        let structures: Vec<_> = structures.iter().filter(is_of_gpu).cloned().collect();
        let rebuilds = vec![false; structures.len()];
        self.plan_software_builds(&structures, &rebuilds)
    }

    /// Builds the software BVH of a BLAS for the first time.
    pub(crate) fn build_software_blas(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let work = self.plan_first_software_builds(std::slice::from_ref(target))?;
        self.record_software_builds(work, false)
    }

    /// Plans builds or refits of the software BVHs of these BLAS, and allocates their memory. Records nothing.
    pub(crate) fn plan_software_builds(
        &self,
        structures: &[Arc<AccelStruct>],
        refits: &[bool],
    ) -> Result<SoftwareBuilds> {
        let mut work = SoftwareBuilds::default();
        for (target, refit) in structures.iter().zip(refits) {
            let blas = target.blas()?;
            if let Some(software) = &blas.software {
                work.targets.push(target.id);
                self.plan_software_build(target, blas, software, *refit, &mut work)?;
            }
        }
        Ok(work)
    }

    /// Records the planned builds and refits.
    pub(crate) fn record_software_builds(&mut self, work: SoftwareBuilds, is_first: bool) -> Result<()> {
        let SoftwareBuilds { targets, builds, refits, moves } = work;
        if builds.is_empty() && refits.is_empty() {
            return Ok(());
        }
        let write = Use::shader_write(Stages::COMPUTE);
        targets.into_iter().for_each(|target| self.state.accesses.add_id(target, write));
        let group = self.built_group(is_first);
        self.state.accesses.add_accumulating(group, write);
        if !builds.is_empty() {
            self.record_gpu_builds(&builds)?;
        }
        if !refits.is_empty() {
            self.record_gpu_refits(&refits)?;
        }
        moves.iter().for_each(|moved| self.record_blob_move(moved));
        Ok(())
    }

    fn plan_software_build(
        &self,
        target: &Arc<AccelStruct>,
        blas: &Blas,
        software: &SoftwareBlas,
        refit: bool,
        work: &mut SoftwareBuilds,
    ) -> Result<()> {
        let geometries = self.gpu_geometries(target, blas)?;
        let reads = self.build_input_buffers(blas)?;
        let moved = self.moved_storage(target, software);
        let refit_of = |plan: GpuRefitPlan, body: &SoftwareAccelStorage| GpuRefit {
            plan,
            geometries: geometries.clone(),
            blob: body.address,
            target: Arc::clone(body.buffer()),
            read_buffers: reads.clone(),
        };
        let build_of = |plan: &_, body: &SoftwareAccelStorage| GpuBuild {
            plan: Clone::clone(plan),
            source: BuildSource::Geometries(geometries.clone()),
            blob: body.address,
            target: Arc::clone(body.buffer()),
            read_buffers: reads.clone(),
        };
        match (refit, &software.origin, moved) {
            (true, BvhOrigin::Cpu { rebuild, .. }, Some(rebuilt)) => {
                work.refits.push(refit_of(GpuRefitPlan::from_build(rebuild), rebuilt));
            }
            (true, BvhOrigin::Cpu { refit: Some(plan), .. }, None) => {
                work.refits.push(refit_of(*plan, &software.storage))
            }
            (true, BvhOrigin::Cpu { refit: None, .. }, None) => target.check_refit()?,
            (true, BvhOrigin::Gpu(plan), _) => {
                work.refits.push(refit_of(GpuRefitPlan::from_build(plan), &software.storage));
            }
            (false, BvhOrigin::Gpu(plan), _) => work.builds.push(build_of(plan, &software.storage)),
            (false, BvhOrigin::Cpu { rebuild, .. }, _) => {
                let rebuilt =
                    software.storage_after_rebuild_or(|| self.storage_for_rebuild(target, rebuild))?;
                work.builds.push(build_of(rebuild, rebuilt));
                let is_elsewhere = !Arc::ptr_eq(rebuilt, &software.storage);
                let header = MovedHeader { format: FORMAT_MOVED, leaf_kind: 0, address: rebuilt.address };
                let left = is_elsewhere.then(|| (Arc::clone(&software.storage), header));
                work.moves.push(BlobMove { target: target.id, left });
            }
        }
        Ok(())
    }

    /// Returns the storage of a CPU-built BVH as of the next command, if it was rebuilt.
    pub(crate) fn moved_storage<'a>(
        &self,
        target: &AccelStruct,
        software: &'a SoftwareBlas,
    ) -> Option<&'a Arc<SoftwareAccelStorage>> {
        let here = software.storage_after_rebuild().filter(|_| self.state.moved_blas.contains(&target.id.0));
        here.or(software.moved_storage())
    }

    /// Allocates storage for GPU builds of a BVH that the CPU built first.
    fn storage_for_rebuild(&self, target: &AccelStruct, plan: &GpuBuildPlan) -> Result<SoftwareAccelStorage> {
        let shared = &self.shared;
        SoftwareAccelStorage::new(&shared.gpu, &shared.accel_storage, &target.name, plan.blob_bytes)
    }

    fn gpu_geometries(&self, target: &AccelStruct, blas: &Blas) -> Result<Vec<GpuGeometry>> {
        let find = |handle| self.shared.store.buffers.get(handle);
        let matrices = blas.transforms.as_ref().map(|buffer| buffer.address);
        gpu_geometries(&target.name, &blas.geometries, &find, matrices)
    }

    /// Writes the address of the new BVH to the storage that it leaves.
    fn record_blob_move(&mut self, moved: &BlobMove) {
        self.state.moved_blas.insert(moved.target.0);
        let Some((body, header)) = &moved.left else { return };
        self.use_buffer(body.buffer(), Use::transfer_write());
        self.state.accesses.add_accumulating(self.shared.all_blas, Use::transfer_write());
        self.flush_barriers();
        let bytes = bytemuck::bytes_of(header);
        // SAFETY: the storage begins with a header, at a multiple of 4.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_update_buffer(self.raw(), body.buffer().raw, body.offset(), bytes);
        }
    }

    /// Builds a software TLAS from instances of the host.
    pub(crate) fn build_software_tlas(
        &mut self,
        target: &AccelStruct,
        software: &SoftwareTlas,
        instances: &[TlasInstance],
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        if (shared.gpu.caps.is_cpu || instances.len() <= MAX_CPU_TLAS_INSTANCES)
            && let Some(placed) = place_instances(&shared, &target.name, instances)?
        {
            let bytes = encode_tlas::encode_tlas(&placed, software.record_capacity);
            self.expect_unmoved_blas(instances)?;
            return self.fill_software_storage(target, shared.all_tlas, &software.storage, &bytes);
        }
        let bytes = instance_bytes(instances.len().max(1) as u32);
        let (region, written) =
            shared.staging.write_with(bytes, ALIGNMENT, self.recording.staging_key(), |out| {
                let resolve = |handle| {
                    let blas = shared.store.accel_structs.get(handle)?;
                    Ok(software_storage(&blas.name, blas.blas()?)?.address)
                };
                write_plain_addresses(&target.name, instances, &resolve, out)
            })?;
        written?;
        let count = instances.len() as u32;
        let source = BuildSource::Instances { records: region.address, count, table: None };
        self.record_software_tlas(target, software, source, Vec::new())
    }

    /// As [`build_software_tlas`](Self::build_software_tlas), from records in a buffer that name BLAS by index.
    pub(crate) fn build_software_tlas_from_buffer(
        &mut self,
        target: &AccelStruct,
        software: &SoftwareTlas,
        instances: &DeviceInstances<'_>,
        shown: &BlasRefSet,
    ) -> Result<()> {
        let buffer = self.shared.store.buffers.get(instances.buffer)?;
        let address = |shown: &BlasRef| Ok(software_storage(&target.name, &shown.blas)?.address);
        let mut table = shown.refs().iter().map(address).collect::<Result<Vec<u64>>>()?;
        let entries = table.len() as u32;
        table.resize(table.len().max(1), 0);
        let bytes = bytemuck::cast_slice(&table);
        let region = self.shared.staging.write(bytes, ALIGNMENT, self.recording.staging_key())?;
        let source = BuildSource::Instances {
            records: buffer.address + instances.offset,
            count: instances.count,
            table: Some((region.address, entries)),
        };
        self.record_software_tlas(target, software, source, vec![buffer])
    }

    /// Declares that the BLAS of the instances must not be rebuilt before the command buffer is submitted.
    fn expect_unmoved_blas(&mut self, instances: &[TlasInstance]) -> Result<()> {
        let mut last = None;
        for handle in instances.iter().map(|instance| instance.blas) {
            if last.replace(handle) != Some(handle) {
                let blas = self.shared.store.accel_structs.get(handle)?;
                self.state.placed_blas.entry(blas.id.0).or_insert(blas);
            }
        }
        Ok(())
    }

    fn record_software_tlas(
        &mut self,
        target: &AccelStruct,
        software: &SoftwareTlas,
        source: BuildSource,
        reads: Vec<Arc<Buffer>>,
    ) -> Result<()> {
        let write = Use::shader_write(Stages::COMPUTE);
        self.state.accesses.add_id(target.id, write);
        self.use_all_blas(Use::shader_read(Stages::COMPUTE));
        self.state.accesses.add_accumulating(self.shared.all_tlas, write);
        self.record_gpu_builds(&[GpuBuild {
            plan: software.plan.clone(),
            source,
            blob: software.storage.address,
            target: Arc::clone(software.storage.buffer()),
            read_buffers: reads,
        }])
    }
}

/// Fails if a submission has moved the BVH of a BLAS since the host wrote its address to an update.
pub(crate) fn check_unmoved(blas: &AccelStruct) -> Result<()> {
    let software = blas.blas()?.software.as_ref();
    if software.is_none_or(|software| software.moved_storage().is_none()) {
        return Ok(());
    }
    let message = "a TLAS was updated to reference it, but a submission since then has rebuilt it; record \
                   the update anew";
    Err(Error::usage(&blas.name, message))
}

/// Returns the storage of the software BVH of a BLAS.
fn software_storage<'a>(name: &str, blas: &'a Blas) -> Result<&'a Arc<SoftwareAccelStorage>> {
    let none = || Error::usage(name, "the acceleration structure has no BVH for software traversal");
    Ok(&blas.software.as_ref().ok_or_else(none)?.storage)
}
