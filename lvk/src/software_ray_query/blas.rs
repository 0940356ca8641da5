//! A BLAS for software traversal.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use super::gpu_build::geometry::vertex_count;
use super::gpu_build::layout::{BlasShape, BlobOffsets, GpuBuildPlan, VERTEX_BYTES};
use super::gpu_build::refit_layout::{GpuRefitPlan, NodeFormat};
use super::layout::BlobHeader;
use super::layout::LeafKind;
use super::rebraid_parts::RebraidParts;
use super::storage::SoftwareAccelStorage;
use crate::accel::desc::BlasDesc;
use crate::accel::flags::{AccelStructSizes, BuildFlags};
use crate::accel::geometry::BlasGeometry;
use crate::error::Result;

/// The software half of a BLAS.
pub(crate) struct SoftwareBlas {
    /// The memory that instances refer to as long as the handle lives.
    pub(crate) storage: Arc<SoftwareAccelStorage>,
    pub(crate) origin: BvhOrigin,
    /// Target of a rebuild on the GPU of a BLAS that the CPU built. It is `storage` if that is large enough, else other
    /// memory, and `storage` then contains its address. Created at the first rebuild.
    rebuilt: OnceLock<Arc<SoftwareAccelStorage>>,
    /// True once a rebuild into `rebuilt` was submitted.
    has_moved: AtomicBool,
}

/// The builder of the first tree.
pub(crate) enum BvhOrigin {
    /// The CPU, from inputs that were read back. Its trees are better.
    Cpu {
        /// Plan of refits; `None` without `ALLOW_UPDATE`.
        refit: Option<GpuRefitPlan>,
        /// Plan of rebuilds.
        rebuild: GpuBuildPlan,
        /// The subtrees, valid until a refit or rebuild.
        parts: Arc<RebraidParts>,
    },
    /// The GPU, which also builds it again.
    Gpu(GpuBuildPlan),
}

impl SoftwareBlas {
    pub(crate) fn new(body: Arc<SoftwareAccelStorage>, origin: BvhOrigin) -> Self {
        Self { storage: body, origin, rebuilt: OnceLock::new(), has_moved: AtomicBool::new(false) }
    }

    /// Returns the target of rebuilds, once a rebuild was recorded.
    pub(crate) fn storage_after_rebuild(&self) -> Option<&Arc<SoftwareAccelStorage>> {
        self.rebuilt.get()
    }

    /// Returns the memory after everything submitted, if the BLAS was rebuilt.
    pub(crate) fn moved_storage(&self) -> Option<&Arc<SoftwareAccelStorage>> {
        self.rebuilt.get().filter(|_| self.has_moved.load(Ordering::Acquire))
    }

    /// Marks that a rebuild was submitted.
    pub(crate) fn set_moved_storage(&self) {
        self.has_moved.store(true, Ordering::Release);
    }

    /// True if the CPU built the first tree, so that a rebuild replaces it by another one.
    pub(crate) fn is_built_on_cpu(&self) -> bool {
        matches!(self.origin, BvhOrigin::Cpu { .. })
    }

    /// Returns the target of rebuilds; `make` allocates it the first time.
    pub(crate) fn storage_after_rebuild_or(
        &self,
        make: impl FnOnce() -> Result<SoftwareAccelStorage>,
    ) -> Result<&Arc<SoftwareAccelStorage>> {
        if let Some(rebuilt) = self.rebuilt.get() {
            return Ok(rebuilt);
        }
        let rebuilt = if self.rebuilds_in_place() { Arc::clone(&self.storage) } else { Arc::new(make()?) };
        Ok(self.rebuilt.get_or_init(|| rebuilt))
    }

    /// True if a rebuild fits into `storage`. It is false if the BLAS cannot be refitted: TLASes may then reference
    /// parts of the first tree, which must not change.
    fn rebuilds_in_place(&self) -> bool {
        let room = self.storage.memory_bytes();
        matches!(&self.origin, BvhOrigin::Cpu { refit: Some(_), rebuild, .. } if rebuild.blob_bytes <= room)
    }

    /// Returns the subtrees if the host knows them: the BLAS cannot be refitted, and no rebuild was recorded.
    pub(crate) fn rebraid_parts(&self) -> Option<&Arc<RebraidParts>> {
        match &self.origin {
            BvhOrigin::Cpu { refit: None, parts, .. } if self.rebuilt.get().is_none() => Some(parts),
            _ => None,
        }
    }

    /// Returns the bytes of memory.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let elsewhere = self.rebuilt.get().filter(|rebuilt| !Arc::ptr_eq(rebuilt, &self.storage));
        let rebuilt = elsewhere.map_or(0, |rebuilt| rebuilt.memory_bytes());
        self.storage.memory_bytes() + rebuilt
    }

    /// Returns the scratch bytes of the first build: 0 if the CPU built it.
    pub(crate) fn initial_scratch_bytes(&self) -> u64 {
        match &self.origin {
            BvhOrigin::Cpu { .. } => 0,
            BvhOrigin::Gpu(plan) => plan.scratch_bytes,
        }
    }

    /// Returns the sizes of the BLAS and of its builds, with the flags of its creation.
    pub(crate) fn sizes(&self, flags: BuildFlags) -> AccelStructSizes {
        let (rebuild, refit) = match &self.origin {
            BvhOrigin::Cpu { rebuild, refit, .. } => (rebuild, refit.as_ref()),
            BvhOrigin::Gpu(plan) => (plan, None),
        };
        AccelStructSizes {
            structure_bytes: self.storage.memory_bytes(),
            build_scratch_bytes: rebuild.scratch_bytes,
            update_scratch_bytes: refit_scratch_bytes(rebuild, flags)
                .max(refit.map_or(0, GpuRefitPlan::scratch_bytes)),
        }
    }
}

/// Returns the bytes to allocate for a BLAS of `blob_bytes` that the CPU built.
///
/// If the BLAS can be refitted and its rebuild needs little more, this is the size of the rebuild.
pub(crate) fn storage_bytes(blob_bytes: u64, refit: Option<&GpuRefitPlan>, rebuild: &GpuBuildPlan) -> u64 {
    const MAX_REMOVED_SHARE: u64 = 32;
    let in_place = refit.is_some() && rebuild.blob_bytes <= blob_bytes + blob_bytes / MAX_REMOVED_SHARE;
    if in_place { blob_bytes.max(rebuild.blob_bytes) } else { blob_bytes }
}

/// Returns the maximum sizes of a BLAS of these validated geometries.
pub(crate) fn max_sizes(
    name: &str,
    geometries: &[BlasGeometry],
    flags: BuildFlags,
) -> Result<AccelStructSizes> {
    let plan = gpu_plan(name, geometries, flags)?;
    let of_gpu = refit_scratch_bytes(&plan, flags);
    // A tree of the CPU has at most as many nodes as one with two children a node and one primitive a leaf.
    let of_cpu = match builds_on_gpu(flags) || !flags.contains(BuildFlags::ALLOW_UPDATE) {
        true => 0,
        false => GpuRefitPlan {
            format: NodeFormat::Wide,
            node_count: plan.capacity.saturating_sub(1),
            ..GpuRefitPlan::from_build(&plan)
        }
        .scratch_bytes(),
    };
    Ok(AccelStructSizes {
        structure_bytes: plan.blob_bytes + if builds_on_gpu(flags) { 0 } else { plan.bvh2_excess_bytes() },
        build_scratch_bytes: plan.scratch_bytes,
        update_scratch_bytes: of_gpu.max(of_cpu),
    })
}

/// Returns the scratch bytes of a refit of a BLAS that the GPU built; 0 if it cannot be refitted.
fn refit_scratch_bytes(plan: &GpuBuildPlan, flags: BuildFlags) -> u64 {
    if flags.contains(BuildFlags::ALLOW_UPDATE) { GpuRefitPlan::from_build(plan).scratch_bytes() } else { 0 }
}

/// True if the GPU also makes the first build.
pub(crate) fn builds_on_gpu(flags: BuildFlags) -> bool {
    flags.contains(BuildFlags::FAST_BUILD)
}

/// Returns the plan of a build on the GPU of these validated geometries.
pub(crate) fn gpu_plan(name: &str, geometries: &[BlasGeometry], flags: BuildFlags) -> Result<GpuBuildPlan> {
    let boxes = geometries.first().is_some_and(BlasGeometry::is_aabbs);
    let sum = |of: fn(&BlasGeometry) -> u32| geometries.iter().map(of).fold(0_u32, u32::saturating_add);
    let (primitive_count, vertex_count) = (sum(BlasGeometry::primitive_count), sum(vertex_count));
    let naming = LeafKind::with_vertex_indices(vertex_count as usize);
    let shape = BlasShape {
        leaf_kind: match (boxes, flags.contains(BuildFlags::LOW_MEMORY) && do_ids_fit(geometries)) {
            (true, _) => LeafKind::Boxes,
            (false, true) if saves_memory(naming, primitive_count, vertex_count) => naming,
            (false, _) => LeafKind::Triangles,
        },
        primitive_count,
        vertex_count,
        geometry_count: geometries.len() as u32,
    };
    GpuBuildPlan::blas(name, &shape)
}

/// True if leaves with vertex indices and a copy of all vertices are smaller than leaves with vertex positions.
fn saves_memory(naming: LeafKind, primitives: u32, vertices: u32) -> bool {
    let leaves = |kind: LeafKind| u64::from(primitives) * kind.primitive_bytes();
    leaves(naming) + u64::from(vertices) * VERTEX_BYTES < leaves(LeafKind::Triangles)
}

/// True if a leaf with vertex indices has enough bits for the geometry and the primitive.
fn do_ids_fit(geometries: &[BlasGeometry]) -> bool {
    const MAX_GEOMETRIES: usize = 1 << 8;
    const MAX_PRIMITIVES: u32 = 1 << 24;
    let few = |geometry: &BlasGeometry| geometry.primitive_count() < MAX_PRIMITIVES;
    geometries.len() <= 1 || (geometries.len() <= MAX_GEOMETRIES && geometries.iter().all(few))
}

/// Returns the refit plan of a BLAS with this header, which the CPU built; `None` if it cannot be refitted.
pub(crate) fn refit_plan(header: &BlobHeader, desc: &BlasDesc<'_>) -> Option<GpuRefitPlan> {
    if !desc.flags.contains(BuildFlags::ALLOW_UPDATE) {
        return None;
    }
    let kinds = [LeafKind::Boxes, LeafKind::IndexedTriangles, LeafKind::PackedTriangles];
    let kind = kinds.into_iter().find(|kind| *kind as u32 == header.leaf_kind);
    let leaf_kind = kind.unwrap_or(LeafKind::Triangles);
    Some(GpuRefitPlan {
        format: if header.format == NodeFormat::Wide as u32 { NodeFormat::Wide } else { NodeFormat::Binary },
        leaf_kind,
        offsets: BlobOffsets {
            nodes: header.nodes,
            primitives: header.primitives,
            vertices: header.vertices,
            geometries: header.geometries,
        },
        node_count: header.node_count,
        primitive_count: header.primitive_count,
    })
}
