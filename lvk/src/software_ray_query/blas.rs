//! A bottom-level structure of the library's own.

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

/// What stands behind the handle of a bottom-level structure for software to trace.
pub(crate) struct SoftwareBlas {
    /// What instances refer to as long as the handle lives.
    pub(crate) storage: Arc<SoftwareAccelStorage>,
    pub(crate) origin: BvhOrigin,
    /// Where a structure that the CPU built is built again on the GPU: its own body where that has room, else another one, to
    /// which the body refers then. Made when first needed.
    rebuilt: OnceLock<Arc<SoftwareAccelStorage>>,
    /// Whether a submission builds it there.
    has_moved: AtomicBool,
}

/// Who built it first.
pub(crate) enum BvhOrigin {
    /// The CPU, from inputs that were read back: the better trees.
    Cpu {
        /// How it is refitted, where it may be.
        refit: Option<GpuRefitPlan>,
        /// How it is rebuilt.
        rebuild: GpuBuildPlan,
        /// Where it lies, as long as it is neither refitted nor rebuilt.
        parts: Arc<RebraidParts>,
    },
    /// The GPU, as every build of it.
    Gpu(GpuBuildPlan),
}

impl SoftwareBlas {
    pub(crate) fn new(body: Arc<SoftwareAccelStorage>, origin: BvhOrigin) -> Self {
        Self { storage: body, origin, rebuilt: OnceLock::new(), has_moved: AtomicBool::new(false) }
    }

    /// Where it is rebuilt, once a rebuild was recorded.
    pub(crate) fn storage_after_rebuild(&self) -> Option<&Arc<SoftwareAccelStorage>> {
        self.rebuilt.get()
    }

    /// Where it lies after everything submitted, if it was rebuilt.
    pub(crate) fn moved_storage(&self) -> Option<&Arc<SoftwareAccelStorage>> {
        self.rebuilt.get().filter(|_| self.has_moved.load(Ordering::Acquire))
    }

    /// A rebuild was submitted.
    pub(crate) fn set_moved_storage(&self) {
        self.has_moved.store(true, Ordering::Release);
    }

    /// Whether the CPU has built it first, so that a rebuild puts another tree in its place.
    pub(crate) fn is_built_on_cpu(&self) -> bool {
        matches!(self.origin, BvhOrigin::Cpu { .. })
    }

    /// Where it is rebuilt; `make` makes room the first time.
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

    /// Whether the body has room for what a rebuild makes. Of what may not be refitted, top-level structures may show parts of
    /// the first tree, which must stay what it was.
    fn rebuilds_in_place(&self) -> bool {
        let room = self.storage.memory_bytes();
        matches!(&self.origin, BvhOrigin::Cpu { refit: Some(_), rebuild, .. } if rebuild.blob_bytes <= room)
    }

    /// Where it lies, if the host knows: then it never was nor will be refitted, nor was a rebuild recorded.
    pub(crate) fn rebraid_parts(&self) -> Option<&Arc<RebraidParts>> {
        match &self.origin {
            BvhOrigin::Cpu { refit: None, parts, .. } if self.rebuilt.get().is_none() => Some(parts),
            _ => None,
        }
    }

    /// Bytes of memory.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let elsewhere = self.rebuilt.get().filter(|rebuilt| !Arc::ptr_eq(rebuilt, &self.storage));
        let rebuilt = elsewhere.map_or(0, |rebuilt| rebuilt.memory_bytes());
        self.storage.memory_bytes() + rebuilt
    }

    /// Scratch bytes of the first build: none where the CPU has made it.
    pub(crate) fn initial_scratch_bytes(&self) -> u64 {
        match &self.origin {
            BvhOrigin::Cpu { .. } => 0,
            BvhOrigin::Gpu(plan) => plan.scratch_bytes,
        }
    }

    /// What it takes and its builds take, with the flags it was made with.
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

/// Bytes for a structure that the CPU built in so many: as many as its rebuild takes, where it may be refitted and that makes
/// little difference.
pub(crate) fn storage_bytes(blob_bytes: u64, refit: Option<&GpuRefitPlan>, rebuild: &GpuBuildPlan) -> u64 {
    const MAX_REMOVED_SHARE: u64 = 32;
    let in_place = refit.is_some() && rebuild.blob_bytes <= blob_bytes + blob_bytes / MAX_REMOVED_SHARE;
    if in_place { blob_bytes.max(rebuild.blob_bytes) } else { blob_bytes }
}

/// What structures of these geometries, which have been checked, take at most.
pub(crate) fn max_sizes(
    name: &str,
    geometries: &[BlasGeometry],
    flags: BuildFlags,
) -> Result<AccelStructSizes> {
    let plan = gpu_plan(name, geometries, flags)?;
    let of_gpu = refit_scratch_bytes(&plan, flags);
    // A tree of the CPU has no more nodes than one of two children and one primitive in each leaf.
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

/// Scratch bytes of the refit of what the GPU built; 0 where it cannot be refitted.
fn refit_scratch_bytes(plan: &GpuBuildPlan, flags: BuildFlags) -> u64 {
    if flags.contains(BuildFlags::ALLOW_UPDATE) { GpuRefitPlan::from_build(plan).scratch_bytes() } else { 0 }
}

/// Whether the GPU makes the first build too.
pub(crate) fn builds_on_gpu(flags: BuildFlags) -> bool {
    flags.contains(BuildFlags::FAST_BUILD)
}

/// A build on the GPU of these geometries, which have been checked.
pub(crate) fn gpu_plan(name: &str, geometries: &[BlasGeometry], flags: BuildFlags) -> Result<GpuBuildPlan> {
    const IMPROVEMENTS: u32 = 2;
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
        improvements: if flags.contains(BuildFlags::FAST_TRACE) { IMPROVEMENTS } else { 0 },
    };
    GpuBuildPlan::blas(name, &shape)
}

/// Whether leaves that name vertices, of which all are copied, take less than copies of the corners.
fn saves_memory(naming: LeafKind, primitives: u32, vertices: u32) -> bool {
    let leaves = |kind: LeafKind| u64::from(primitives) * kind.primitive_bytes();
    leaves(naming) + u64::from(vertices) * VERTEX_BYTES < leaves(LeafKind::Triangles)
}

/// Whether a leaf that names vertices has room for the numbers of geometry and primitive.
fn do_ids_fit(geometries: &[BlasGeometry]) -> bool {
    const MAX_GEOMETRIES: usize = 1 << 8;
    const MAX_PRIMITIVES: u32 = 1 << 24;
    let few = |geometry: &BlasGeometry| geometry.primitive_count() < MAX_PRIMITIVES;
    geometries.len() <= 1 || (geometries.len() <= MAX_GEOMETRIES && geometries.iter().all(few))
}

/// How a structure with this header, which the CPU built, is refitted; `None` where it may not be.
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
