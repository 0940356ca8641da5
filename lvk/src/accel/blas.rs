//! A bottom-level structure: one for the caller, one or more for Vulkan.

use std::sync::Arc;

use super::flags::AccelStructSizes;
use super::geometry::BlasGeometry;
use super::primitive_map::PrimitiveMap;
use super::raw_accel_struct::RawStructure;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Buffer;
use crate::software_ray_query::blas::SoftwareBlas;

/// What a bottom-level structure is built from, and what was built.
pub(crate) struct Blas {
    pub(crate) geometries: Vec<BlasGeometry>,
    /// The matrices of geometries that have one by value, 48 bytes for each geometry.
    pub(crate) transforms: Option<Buffer>,
    /// The parts a mesh was cut into; a single one where it was not.
    pub(crate) parts: Vec<PartShape>,
    /// What software traces, where it does.
    pub(crate) software: Option<SoftwareBlas>,
    state: Mutex<BlasState>,
}

/// What changes with builds and compaction.
struct BlasState {
    body: Arc<BlasBody>,
    /// Builds in command buffers that are not submitted yet.
    open_builds: u32,
    /// Builds submitted so far, refits not counted; tells whether a compacted size still holds.
    builds: u64,
    /// Refits submitted since the last rebuild.
    refits: u32,
    wish: CompactionWish,
}

/// What has become of the wish to compact a structure that is not compacted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CompactionWish {
    /// Nobody has it.
    None,
    /// It is under way.
    Open,
    /// It could not be met.
    Failed,
    /// There is nothing to gain.
    Idle,
}

/// What one part is built from.
pub(crate) struct PartShape {
    /// Primitives of each geometry; a part may have none of some.
    pub(crate) counts: Vec<u32>,
    /// Which primitives these are, where they are not all of the mesh in its own order.
    pub(crate) map: Option<PrimitiveMap>,
    pub(crate) sizes: AccelStructSizes,
}

/// The Vulkan structures of all parts. Compaction replaces the body; who still uses the old one keeps it alive.
pub(crate) struct BlasBody {
    pub(crate) structures: Vec<RawStructure>,
    /// Bytes of its structures before compaction, for a body that is compacted.
    pub(crate) compacted_from: Option<u64>,
    /// Whether another build from scratch fits.
    pub(crate) rebuildable: bool,
}

impl BlasBody {
    /// Bytes of memory of all parts.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.structures.iter().map(RawStructure::memory_bytes).sum()
    }
}

impl Blas {
    pub(crate) fn new(
        geometries: Vec<BlasGeometry>,
        transforms: Option<Buffer>,
        parts: Vec<PartShape>,
        body: BlasBody,
        software: Option<SoftwareBlas>,
    ) -> Self {
        let state = BlasState {
            body: Arc::new(body),
            open_builds: 0,
            builds: 0,
            refits: 0,
            wish: CompactionWish::None,
        };
        Self { geometries, transforms, parts, software, state: Mutex::new(Rank::BlasState, state) }
    }

    /// What stands for it now.
    pub(crate) fn body(&self) -> Arc<BlasBody> {
        Arc::clone(&self.lock().body)
    }

    /// Puts a compacted body in place of the present one, which is returned, if exactly `builds` builds were
    /// submitted and none waits for its submission.
    pub(crate) fn replace_body(&self, body: BlasBody, builds: u64) -> Option<Arc<BlasBody>> {
        let mut state = self.lock();
        let settled = state.open_builds == 0 && state.builds == builds;
        settled.then(|| std::mem::replace(&mut state.body, Arc::new(body)))
    }

    /// Bytes of memory of what software traces, which compaction leaves alone.
    pub(crate) fn software_bytes(&self) -> u64 {
        self.software.as_ref().map_or(0, SoftwareBlas::memory_bytes)
    }

    /// Scratch bytes of the first builds of all parts and of what software traces.
    pub(crate) fn first_build_scratch_bytes(&self) -> u64 {
        let parts: u64 = self.parts.iter().map(|part| part.sizes.build_scratch_bytes).sum();
        let software = self.software.as_ref().map_or(0, SoftwareBlas::first_build_scratch_bytes);
        parts.saturating_add(software)
    }

    /// Buffers the library keeps for it, in bytes: maps of primitives and matrices.
    pub(crate) fn table_bytes(&self) -> u64 {
        let maps = self.parts.iter().filter_map(|part| part.map.as_ref());
        let matrices = self.transforms.as_ref().map_or(0, |buffer| buffer.size_bytes);
        maps.map(PrimitiveMap::bytes).sum::<u64>() + matrices
    }

    /// A build of the body is about to be recorded; it stays in place until [`close_build`](Self::close_build).
    pub(crate) fn open_build(&self) -> Arc<BlasBody> {
        let mut state = self.lock();
        state.open_builds += 1;
        Arc::clone(&state.body)
    }

    /// The command buffer with a recorded build, a refit or not, was submitted, or given up.
    pub(crate) fn close_build(&self, submitted: bool, refit: bool) {
        let mut state = self.lock();
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
    pub(crate) fn builds(&self) -> u64 {
        self.lock().builds
    }

    /// Whether builds wait for their submission.
    pub(crate) fn has_open_builds(&self) -> bool {
        self.lock().open_builds > 0
    }

    /// Refits submitted since the last rebuild.
    pub(crate) fn refits(&self) -> u32 {
        self.lock().refits
    }

    /// What has become of the wish to compact it.
    pub(crate) fn wish(&self) -> CompactionWish {
        self.lock().wish
    }

    /// Changes that; answers what it was before.
    pub(crate) fn set_wish(&self, wish: CompactionWish) -> CompactionWish {
        std::mem::replace(&mut self.lock().wish, wish)
    }

    fn lock(&self) -> Guard<'_, BlasState> {
        self.state.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blas() -> Blas {
        let body = BlasBody { structures: Vec::new(), compacted_from: None, rebuildable: true };
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
            assert_eq!((blas.builds(), blas.refits()), counts);
            assert!(!blas.has_open_builds());
        }
    }

    #[test]
    fn a_body_is_replaced_only_where_no_build_came_in_between() {
        let blas = blas();
        let copy = || BlasBody { structures: Vec::new(), compacted_from: Some(1), rebuildable: false };
        blas.open_build();
        assert!(blas.replace_body(copy(), 0).is_none(), "a build waits for its submission");
        blas.close_build(true, false);
        assert!(blas.replace_body(copy(), 0).is_none(), "it was built since");
        assert!(blas.replace_body(copy(), 1).is_some());
        assert_eq!(blas.body().compacted_from, Some(1));
    }
}
