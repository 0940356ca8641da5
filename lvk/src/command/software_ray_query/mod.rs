//! Builds of the library's own structures.
//!
//! `disabled.rs` has the names that other files use, for builds without the feature `software-ray-query`.

pub(crate) mod gpu_build;

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use crate::accel::AccelStruct;
use crate::accel::blas::Blas;
use crate::accel::blas_refs::{Shown, ShownSet};
use crate::accel::build::instance_bytes;
use crate::accel::instance::{DeviceInstances, INSTANCE_BYTES, TlasInstance, check, pack};
use crate::software_ray_query::blas::{Origin, SoftwareBlas};
use crate::software_ray_query::gpu_build::geometry::{GpuGeometry, gpu_geometries};
use crate::software_ray_query::gpu_build::layout::{BuildSource, GpuBuildPlan};
use crate::software_ray_query::gpu_build::refit_layout::GpuRefitPlan;
use crate::software_ray_query::layout::{MOVED, MovedHeader};
use crate::software_ray_query::storage::SoftwareBody;
use crate::software_ray_query::tlas::SoftwareTlas;

use crate::barrier::{ResourceId, Stages, Use};
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::resource::Buffer;
use crate::software_ray_query::bvh::encode_instances::{PlacedInstance, ShownStructure, place};
use crate::software_ray_query::bvh::encode_tlas;

use gpu_build::{GpuBuild, GpuRefit};

/// So many instances the CPU builds a tree over that is worth more than its time. A driver that runs on the CPU has no
/// faster builds.
const MOST_ON_CPU: usize = 512;
/// Addresses of tables and records.
const ALIGNMENT: u64 = 16;

/// Builds and refits to record side by side.
#[derive(Default)]
pub(super) struct SoftwareWork {
    targets: Vec<ResourceId>,
    builds: Vec<GpuBuild>,
    refits: Vec<GpuRefit>,
    moves: Vec<Move>,
}

/// A structure that the CPU built and that has a tree of the GPU from now on.
struct Move {
    target: ResourceId,
    /// What it leaves if that lies elsewhere, and what has to be said there.
    left: Option<(Arc<SoftwareBody>, MovedHeader)>,
}

impl CommandBuffer {
    /// Copies what the CPU built into a bottom-level structure.
    pub(crate) fn fill_software_blas(
        &mut self,
        target: &AccelStruct,
        body: &SoftwareBody,
        bytes: &[u8],
    ) -> Result<()> {
        self.fill_software(target, self.shared.new_blas[self.recording.queue_index], body, bytes)
    }

    /// The next command copies what software traces.
    pub(crate) fn read_software_blas(&mut self, body: &SoftwareBody) {
        self.use_shown(Use::transfer_read());
        self.use_buffer(body.buffer(), Use::transfer_read());
    }

    fn fill_software(
        &mut self,
        target: &AccelStruct,
        all: ResourceId,
        body: &SoftwareBody,
        bytes: &[u8],
    ) -> Result<()> {
        let region = self.shared.staging.write(bytes, ALIGNMENT, self.recording.staging_key())?;
        self.notes.uses.id(target.id, Use::transfer_write());
        self.notes.uses.accumulate(all, Use::transfer_write());
        self.use_buffer(body.buffer(), Use::transfer_write());
        self.flush();
        let copy =
            vk::BufferCopy { src_offset: region.offset, dst_offset: body.offset(), size: bytes.len() as u64 };
        // SAFETY: the structure has room for the bytes, which lie in the staging memory.
        unsafe {
            self.shared.gpu.device.cmd_copy_buffer(self.raw(), region.buffer, body.buffer().raw, &[copy]);
        }
        Ok(())
    }

    /// What has to be built on the GPU of structures that have nothing yet; what the CPU built is ready.
    pub(super) fn plan_software_first(&self, structures: &[Arc<AccelStruct>]) -> Result<SoftwareWork> {
        let is_of_gpu = |target: &&Arc<AccelStruct>| {
            let software = target.blas().ok().and_then(|blas| blas.software.as_ref());
            software.is_some_and(|software| matches!(software.origin, Origin::Gpu(_)))
        };
        let structures: Vec<_> = structures.iter().filter(is_of_gpu).cloned().collect();
        let rebuilds = vec![false; structures.len()];
        self.plan_software(&structures, &rebuilds)
    }

    /// Builds what software traces of a structure for the first time.
    pub(crate) fn build_software_of(&mut self, target: &Arc<AccelStruct>) -> Result<()> {
        let work = self.plan_software_first(std::slice::from_ref(target))?;
        self.record_software(work)
    }

    /// Makes room for builds or refits of what software traces of these structures; records nothing.
    pub(super) fn plan_software(
        &self,
        structures: &[Arc<AccelStruct>],
        refits: &[bool],
    ) -> Result<SoftwareWork> {
        let mut work = SoftwareWork::default();
        for (target, refit) in structures.iter().zip(refits) {
            let blas = target.blas()?;
            if let Some(software) = &blas.software {
                work.targets.push(target.id);
                self.plan_one(target, blas, software, *refit, &mut work)?;
            }
        }
        Ok(work)
    }

    /// Records what was planned.
    pub(super) fn record_software(&mut self, work: SoftwareWork) -> Result<()> {
        let SoftwareWork { targets, builds, refits, moves } = work;
        if builds.is_empty() && refits.is_empty() {
            return Ok(());
        }
        let write = Use::shader_write(Stages::COMPUTE);
        targets.into_iter().for_each(|target| self.notes.uses.id(target, write));
        let group = self.built_group();
        self.notes.uses.accumulate(group, write);
        if !builds.is_empty() {
            self.record_gpu_builds(&builds)?;
        }
        if !refits.is_empty() {
            self.record_gpu_refits(&refits)?;
        }
        moves.iter().for_each(|moved| self.record_move(moved));
        Ok(())
    }

    fn plan_one(
        &self,
        target: &Arc<AccelStruct>,
        blas: &Blas,
        software: &SoftwareBlas,
        refit: bool,
        work: &mut SoftwareWork,
    ) -> Result<()> {
        let geometries = self.gpu_geometries(target, blas)?;
        let reads = self.reads(blas)?;
        let moved = self.moved_tree(target, software);
        let refit_of = |plan: GpuRefitPlan, body: &SoftwareBody| GpuRefit {
            plan,
            geometries: geometries.clone(),
            blob: body.address,
            target: Arc::clone(body.buffer()),
            reads: reads.clone(),
        };
        let build_of = |plan: &_, body: &SoftwareBody| GpuBuild {
            plan: Clone::clone(plan),
            source: BuildSource::Geometries(geometries.clone()),
            blob: body.address,
            target: Arc::clone(body.buffer()),
            reads: reads.clone(),
        };
        match (refit, &software.origin, moved) {
            (true, Origin::Cpu { rebuild, .. }, Some(rebuilt)) => {
                work.refits.push(refit_of(GpuRefitPlan::of_build(rebuild), rebuilt));
            }
            (true, Origin::Cpu { refit: Some(plan), .. }, None) => {
                work.refits.push(refit_of(*plan, &software.body))
            }
            (true, Origin::Cpu { refit: None, .. }, None) => target.check_refit()?,
            (true, Origin::Gpu(plan), _) => {
                work.refits.push(refit_of(GpuRefitPlan::of_build(plan), &software.body));
            }
            (false, Origin::Gpu(plan), _) => work.builds.push(build_of(plan, &software.body)),
            (false, Origin::Cpu { rebuild, .. }, _) => {
                let rebuilt = software.rebuilt_or(|| self.room_for(target, rebuild))?;
                work.builds.push(build_of(rebuild, rebuilt));
                let is_elsewhere = !Arc::ptr_eq(rebuilt, &software.body);
                let header = MovedHeader { format: MOVED, leaf_kind: 0, address: rebuilt.address };
                let left = is_elsewhere.then(|| (Arc::clone(&software.body), header));
                work.moves.push(Move { target: target.id, left });
            }
        }
        Ok(())
    }

    /// Where a structure that the CPU built lies at the next command, if it was rebuilt.
    pub(super) fn moved_tree<'a>(
        &self,
        target: &AccelStruct,
        software: &'a SoftwareBlas,
    ) -> Option<&'a Arc<SoftwareBody>> {
        let here = software.rebuilt().filter(|_| self.notes.moved.contains(&target.id.0));
        here.or(software.moved())
    }

    /// Room for builds on the GPU of what the CPU built first.
    fn room_for(&self, target: &AccelStruct, plan: &GpuBuildPlan) -> Result<SoftwareBody> {
        let shared = &self.shared;
        SoftwareBody::new(&shared.gpu, &shared.accel_storage, &target.name, plan.blob_bytes)
    }

    fn gpu_geometries(&self, target: &AccelStruct, blas: &Blas) -> Result<Vec<GpuGeometry>> {
        let find = |handle| self.shared.store.buffers.get(handle);
        let matrices = blas.transforms.as_ref().map(|buffer| buffer.address);
        gpu_geometries(&target.name, &blas.geometries, &find, matrices)
    }

    /// Has the body that a structure leaves refer to the other one.
    fn record_move(&mut self, moved: &Move) {
        self.notes.moved.insert(moved.target.0);
        let Some((body, header)) = &moved.left else { return };
        self.use_buffer(body.buffer(), Use::transfer_write());
        self.notes.uses.accumulate(self.shared.all_blas, Use::transfer_write());
        self.flush();
        let bytes = bytemuck::bytes_of(header);
        // SAFETY: the body begins with a header, at a multiple of 4.
        unsafe {
            let device = &self.shared.gpu.device;
            device.cmd_update_buffer(self.raw(), body.buffer().raw, body.offset(), bytes);
        }
    }

    /// Builds a top-level structure of the library's own from instances of the host.
    pub(super) fn build_software_tlas(
        &mut self,
        target: &AccelStruct,
        software: &SoftwareTlas,
        instances: &[TlasInstance],
    ) -> Result<()> {
        let shared = Arc::clone(&self.shared);
        if (shared.gpu.caps.is_cpu || instances.len() <= MOST_ON_CPU)
            && let Some(placed) = self.place_instances(target, instances)?
        {
            let bytes = encode_tlas::build(&placed, software.room);
            self.rely_on_places(instances)?;
            return self.fill_software(target, shared.all_tlas, &software.body, &bytes);
        }
        let bytes = instance_bytes(instances.len().max(1) as u32);
        let (region, written) =
            shared.staging.write_with(bytes, ALIGNMENT, self.recording.staging_key(), |out| {
                self.write_software_instances(target, instances, out)
            })?;
        written?;
        let count = instances.len() as u32;
        let source = BuildSource::Instances { records: region.address, count, table: None };
        self.record_software_tlas(target, software, source, Vec::new())
    }

    /// As [`build_software_tlas`](Self::build_software_tlas), from records in a buffer that name structures by place.
    pub(super) fn build_software_tlas_from(
        &mut self,
        target: &AccelStruct,
        software: &SoftwareTlas,
        instances: &DeviceInstances<'_>,
        shown: &ShownSet,
    ) -> Result<()> {
        let buffer = self.shared.store.buffers.get(instances.buffer)?;
        let address = |shown: &Shown| Ok(software_body(&shown.blas)?.address);
        let mut table = shown.list().iter().map(address).collect::<Result<Vec<u64>>>()?;
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

    /// The instances for a build on the CPU; nothing where it does not know all of their bounds.
    fn place_instances(
        &self,
        target: &AccelStruct,
        instances: &[TlasInstance],
    ) -> Result<Option<Vec<PlacedInstance>>> {
        let mut placed = Vec::with_capacity(instances.len());
        let mut last: Option<(AccelStructHandle, ShownStructure)> = None;
        for (number, instance) in instances.iter().enumerate() {
            check(&target.name, number, instance)?;
            let shown = match last {
                Some((handle, shown)) if handle == instance.blas => shown,
                _ => match self.shown_structure(instance.blas)? {
                    Some(shown) => shown,
                    None => return Ok(None),
                },
            };
            placed.extend(place(number as u32, instance, &shown));
            last = Some((instance.blas, shown));
        }
        Ok(Some(placed))
    }

    /// What the instances show must not be rebuilt before this is submitted.
    fn rely_on_places(&mut self, instances: &[TlasInstance]) -> Result<()> {
        let mut last = None;
        for handle in instances.iter().map(|instance| instance.blas) {
            if last.replace(handle) != Some(handle) {
                let blas = self.shared.store.accel_structs.get(handle)?;
                self.notes.placed.entry(blas.id.0).or_insert(blas);
            }
        }
        Ok(())
    }

    fn shown_structure(&self, handle: AccelStructHandle) -> Result<Option<ShownStructure>> {
        let blas = self.shared.store.accel_structs.get(handle)?;
        let address = software_body(&blas)?.address;
        let parts = blas.blas()?.software.as_ref().and_then(SoftwareBlas::known_parts);
        Ok(parts.map(|parts| ShownStructure { address, parts: Arc::clone(parts) }))
    }

    fn write_software_instances(
        &self,
        target: &AccelStruct,
        instances: &[TlasInstance],
        out: &mut [u8],
    ) -> Result<()> {
        let mut last: Option<(AccelStructHandle, u64)> = None;
        for (index, (instance, out)) in instances.iter().zip(out.chunks_exact_mut(INSTANCE_BYTES)).enumerate()
        {
            check(&target.name, index, instance)?;
            let address = match last {
                Some((handle, address)) if handle == instance.blas => address,
                _ => software_body(&*self.shared.store.accel_structs.get(instance.blas)?)?.address,
            };
            last = Some((instance.blas, address));
            out.copy_from_slice(bytemuck::bytes_of(&pack(instance, address)));
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
        self.notes.uses.id(target.id, write);
        self.use_shown(Use::shader_read(Stages::COMPUTE));
        self.notes.uses.accumulate(self.shared.all_tlas, write);
        self.record_gpu_builds(&[GpuBuild {
            plan: software.plan.clone(),
            source,
            blob: software.body.address,
            target: Arc::clone(software.body.buffer()),
            reads,
        }])
    }
}

/// Fails if a submission has moved the tree of a structure that the host placed when it recorded an update.
pub(super) fn check_placed(blas: &AccelStruct) -> Result<()> {
    let software = blas.blas()?.software.as_ref();
    if software.is_none_or(|software| software.moved().is_none()) {
        return Ok(());
    }
    let message = "a top-level structure was updated to show it, but a submission since then has rebuilt it; record \
                   the update anew";
    Err(Error::usage(&blas.name, message))
}

/// What software traces of a bottom-level structure.
fn software_body(blas: &AccelStruct) -> Result<&Arc<SoftwareBody>> {
    let none = || Error::usage(&blas.name, "the structure has nothing that software could trace");
    Ok(&blas.blas()?.software.as_ref().ok_or_else(none)?.body)
}
