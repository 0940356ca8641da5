//! A bottom-level acceleration structure (BLAS): one object for the caller, one or more parts for Vulkan.

use std::sync::Arc;

use super::build::BuildInput;
use super::flags::AccelStructSizes;
use super::geometry::BlasGeometry;
use super::primitive_map::PrimitiveMap;
use super::raw_accel_struct::RawAccelStruct;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Buffer;
use crate::software_ray_query::blas::SoftwareBlas;

/// The inputs of a BLAS and its acceleration structures.
pub(crate) struct Blas {
    pub(crate) geometries: Vec<BlasGeometry>,
    /// Transform matrices that were given by value, 48 bytes for each geometry; `None` if no geometry has one.
    pub(crate) transforms: Option<Buffer>,
    /// Parts of the mesh; a mesh that is not split has one part.
    pub(crate) parts: Vec<BlasPart>,
    /// The BVH that software ray queries traverse; `None` if no ray queries run in software.
    pub(crate) software: Option<SoftwareBlas>,
    state: Mutex<BlasState>,
}

/// State that changes with builds and compaction.
struct BlasState {
    structures: Arc<BlasStructures>,
    /// Builds in command buffers that are not submitted yet.
    open_builds: u32,
    /// Builds submitted so far, without refits. A compacted size is valid only while this number stays the same.
    builds: u64,
    /// Refits submitted since the last rebuild.
    refits: u32,
    compaction: CompactionState,
}

/// State of the compaction of a BLAS that is not compacted yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CompactionState {
    /// No compaction is requested.
    None,
    /// A compaction is pending.
    Open,
    /// The compaction failed.
    Failed,
    /// Compaction would save nothing.
    Idle,
}

/// Input of the builds of one part.
pub(crate) struct BlasPart {
    /// The geometries in Vulkan's form, for the size query, for builds and for refits. Some geometries may have no
    /// primitives in a part.
    pub(crate) input: BuildInput,
    /// Maps the part's primitives to those of the mesh; `None` if the part holds the whole mesh in its own order.
    pub(crate) map: Option<PrimitiveMap>,
    pub(crate) sizes: AccelStructSizes,
}

/// The Vulkan acceleration structures of all parts. Compaction replaces them. Users of the old ones keep those alive.
pub(crate) struct BlasStructures {
    pub(crate) structures: Vec<RawAccelStruct>,
    /// Bytes of the acceleration structures before compaction; `None` if they are not compacted.
    pub(crate) compacted_from: Option<u64>,
    /// True if the acceleration structures have enough memory for a rebuild.
    pub(crate) rebuildable: bool,
}

impl BlasStructures {
    /// Bytes of memory of all parts.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.structures.iter().map(RawAccelStruct::memory_bytes).sum()
    }
}

impl Blas {
    pub(crate) fn new(
        geometries: Vec<BlasGeometry>,
        transforms: Option<Buffer>,
        parts: Vec<BlasPart>,
        body: BlasStructures,
        software: Option<SoftwareBlas>,
    ) -> Self {
        let state = BlasState {
            structures: Arc::new(body),
            open_builds: 0,
            builds: 0,
            refits: 0,
            compaction: CompactionState::None,
        };
        Self { geometries, transforms, parts, software, state: Mutex::new(Rank::BlasState, state) }
    }

    /// The present acceleration structures.
    pub(crate) fn structures(&self) -> Arc<BlasStructures> {
        Arc::clone(&self.lock_state().structures)
    }

    /// Replaces the acceleration structures by compacted ones and returns the old ones. Replaces nothing and returns
    /// `None` unless exactly `builds` builds were submitted and no recorded build waits for its submission.
    pub(crate) fn replace_structures(
        &self,
        body: BlasStructures,
        builds: u64,
    ) -> Option<Arc<BlasStructures>> {
        let mut state = self.lock_state();
        if state.open_builds > 0 || state.builds != builds {
            // The parameter `body` is dropped after the guard: its memory is freed under another lock.
            return None;
        }
        Some(std::mem::replace(&mut state.structures, Arc::new(body)))
    }

    /// Bytes of memory of the BVH for software ray queries. Compaction does not change it.
    pub(crate) fn software_bytes(&self) -> u64 {
        self.software.as_ref().map_or(0, SoftwareBlas::memory_bytes)
    }

    /// Scratch bytes of the first builds of all parts and of the BVH for software ray queries.
    pub(crate) fn initial_scratch_bytes(&self) -> u64 {
        let parts: u64 = self.parts.iter().map(|part| part.sizes.build_scratch_bytes).sum();
        let software = self.software.as_ref().map_or(0, SoftwareBlas::initial_scratch_bytes);
        parts.saturating_add(software)
    }

    /// Bytes of the buffers that the library keeps for the BLAS: primitive maps and transform matrices.
    pub(crate) fn table_bytes(&self) -> u64 {
        let maps = self.parts.iter().filter_map(|part| part.map.as_ref());
        let matrices = self.transforms.as_ref().map_or(0, |buffer| buffer.size_bytes);
        maps.map(PrimitiveMap::table_bytes).sum::<u64>() + matrices
    }

    /// Begins the recording of a build and returns the acceleration structures to build. They are not replaced until
    /// [`close_build`](Self::close_build).
    pub(crate) fn open_build(&self) -> Arc<BlasStructures> {
        let mut state = self.lock_state();
        state.open_builds += 1;
        Arc::clone(&state.structures)
    }

    /// Ends a recorded build or refit: its command buffer was submitted or discarded.
    pub(crate) fn close_build(&self, submitted: bool, refit: bool) {
        let mut state = self.lock_state();
        state.open_builds = state.open_builds.saturating_sub(1);
        match (submitted, refit) {
            (false, _) => {}
            (true, true) => state.refits = state.refits.saturating_add(1),
            (true, false) => {
                state.builds += 1;
                state.refits = 0;
            }
        }
    }

    /// Number of builds submitted so far, without refits.
    pub(crate) fn build_count(&self) -> u64 {
        self.lock_state().builds
    }

    /// True if recorded builds wait for their submission.
    pub(crate) fn has_open_builds(&self) -> bool {
        self.lock_state().open_builds > 0
    }

    /// Number of refits submitted since the last rebuild.
    pub(crate) fn refit_count(&self) -> u32 {
        self.lock_state().refits
    }

    /// State of the compaction.
    pub(crate) fn compaction_state(&self) -> CompactionState {
        self.lock_state().compaction
    }

    /// Sets the state of the compaction and returns the previous one.
    pub(crate) fn set_compaction_state(&self, wish: CompactionState) -> CompactionState {
        std::mem::replace(&mut self.lock_state().compaction, wish)
    }

    fn lock_state(&self) -> Guard<'_, BlasState> {
        self.state.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blas() -> Blas {
        let body = BlasStructures { structures: Vec::new(), compacted_from: None, rebuildable: true };
        Blas::new(Vec::new(), None, Vec::new(), body, None)
    }

    #[test]
    fn cancelled_builds_leave_the_counts_alone() {
        let blas = blas();
        for (submitted, refit, counts) in [
            (true, false, (1, 0)),
            (true, true, (1, 1)),
            (false, true, (1, 1)),
            (true, true, (1, 2)),
            (false, false, (1, 2)),
            (true, false, (2, 0)),
        ] {
            blas.open_build();
            assert!(blas.has_open_builds());
            blas.close_build(submitted, refit);
            assert_eq!((blas.build_count(), blas.refit_count()), counts);
            assert!(!blas.has_open_builds());
        }
    }

    #[test]
    fn a_body_is_replaced_only_where_no_build_came_in_between() {
        let blas = blas();
        let copy = || BlasStructures { structures: Vec::new(), compacted_from: Some(1), rebuildable: false };
        blas.open_build();
        assert!(blas.replace_structures(copy(), 0).is_none(), "a build waits for its submission");
        blas.close_build(true, false);
        assert!(blas.replace_structures(copy(), 0).is_none(), "it was built since");
        assert!(blas.replace_structures(copy(), 1).is_some());
        assert_eq!(blas.structures().compacted_from, Some(1));
    }
}
