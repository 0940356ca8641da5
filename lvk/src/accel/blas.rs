//! A bottom-level structure: one for the caller, one or more for Vulkan.

use std::sync::Arc;

use super::build::BuildInput;
use super::flags::AccelStructSizes;
use super::geometry::BlasGeometry;
use super::primitive_map::PrimitiveMap;
use super::raw_accel_struct::RawAccelStruct;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Buffer;
use crate::software_ray_query::blas::SoftwareBlas;

/// What a bottom-level structure is built from, and what was built.
pub(crate) struct Blas {
    pub(crate) geometries: Vec<BlasGeometry>,
    /// The matrices of geometries that have one by value, 48 bytes for each geometry.
    pub(crate) transforms: Option<Buffer>,
    /// The parts a mesh was cut into; a single one where it was not.
    pub(crate) parts: Vec<BlasPart>,
    /// What software traces, where it does.
    pub(crate) software: Option<SoftwareBlas>,
    state: Mutex<BlasState>,
}

/// What changes with builds and compaction.
struct BlasState {
    structures: Arc<BlasStructures>,
    /// Builds in command buffers that are not submitted yet.
    open_builds: u32,
    /// Builds submitted so far, refits not counted; tells whether a compacted size still holds.
    builds: u64,
    /// Refits submitted since the last rebuild.
    refits: u32,
    compaction: CompactionState,
}

/// What has become of the wish to compact a structure that is not compacted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CompactionState {
    /// Nobody has it.
    None,
    /// It is under way.
    Open,
    /// It could not be met.
    Failed,
    /// There is nothing to gain.
    Idle,
}

/// Input of the builds of one part.
pub(crate) struct BlasPart {
    /// The geometries as Vulkan takes them: for the size query, for builds and for refits. A part may have no primitives of
    /// some geometries.
    pub(crate) input: BuildInput,
    /// Which primitives these are, where they are not all of the mesh in its own order.
    pub(crate) map: Option<PrimitiveMap>,
    pub(crate) sizes: AccelStructSizes,
}

/// The Vulkan structures of all parts. Compaction replaces the body; who still uses the old one keeps it alive.
pub(crate) struct BlasStructures {
    pub(crate) structures: Vec<RawAccelStruct>,
    /// Bytes of its structures before compaction, for a body that is compacted.
    pub(crate) compacted_from: Option<u64>,
    /// Whether another build from scratch fits.
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

    /// What stands for it now.
    pub(crate) fn structures(&self) -> Arc<BlasStructures> {
        Arc::clone(&self.lock_state().structures)
    }

    /// Puts a compacted body in place of the present one, which is returned, if exactly `build_count` builds were
    /// submitted and none waits for its submission.
    pub(crate) fn replace_structures(
        &self,
        body: BlasStructures,
        builds: u64,
    ) -> Option<Arc<BlasStructures>> {
        let mut state = self.lock_state();
        let settled = state.open_builds == 0 && state.builds == builds;
        settled.then(|| std::mem::replace(&mut state.structures, Arc::new(body)))
    }

    /// Bytes of memory of what software traces, which compaction leaves alone.
    pub(crate) fn software_bytes(&self) -> u64 {
        self.software.as_ref().map_or(0, SoftwareBlas::memory_bytes)
    }

    /// Scratch bytes of the first builds of all parts and of what software traces.
    pub(crate) fn initial_scratch_bytes(&self) -> u64 {
        let parts: u64 = self.parts.iter().map(|part| part.sizes.build_scratch_bytes).sum();
        let software = self.software.as_ref().map_or(0, SoftwareBlas::initial_scratch_bytes);
        parts.saturating_add(software)
    }

    /// Buffers the library keeps for it, in bytes: maps of primitives and matrices.
    pub(crate) fn table_bytes(&self) -> u64 {
        let maps = self.parts.iter().filter_map(|part| part.map.as_ref());
        let matrices = self.transforms.as_ref().map_or(0, |buffer| buffer.size_bytes);
        maps.map(PrimitiveMap::table_bytes).sum::<u64>() + matrices
    }

    /// A build of the body is about to be recorded; it stays in place until [`close_build`](Self::close_build).
    pub(crate) fn open_build(&self) -> Arc<BlasStructures> {
        let mut state = self.lock_state();
        state.open_builds += 1;
        Arc::clone(&state.structures)
    }

    /// The command buffer with a recorded build, a refit or not, was submitted, or given up.
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

    /// How many builds were submitted so far, refits not counted.
    pub(crate) fn build_count(&self) -> u64 {
        self.lock_state().builds
    }

    /// Whether builds wait for their submission.
    pub(crate) fn has_open_builds(&self) -> bool {
        self.lock_state().open_builds > 0
    }

    /// Refits submitted since the last rebuild.
    pub(crate) fn refit_count(&self) -> u32 {
        self.lock_state().refits
    }

    /// What has become of the wish to compact it.
    pub(crate) fn compaction_state(&self) -> CompactionState {
        self.lock_state().compaction
    }

    /// Changes that; answers what it was before.
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
    fn builds_given_up_leave_the_counts_alone() {
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
