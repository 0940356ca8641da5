//! A bottom-level structure: one for the caller, one or more for Vulkan.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::flags::AccelStructSizes;
use super::geometry::BlasGeometry;
use super::primitive_map::PrimitiveMap;
use super::raw_structure::RawStructure;
use crate::resource::Buffer;

/// What a bottom-level structure is built from, and what was built.
pub(crate) struct Blas {
    pub(crate) geometries: Vec<BlasGeometry>,
    /// The matrices of geometries that have one by value, 48 bytes for each geometry.
    pub(crate) transforms: Option<Buffer>,
    /// The parts a mesh was cut into; a single one where it was not.
    pub(crate) parts: Vec<PartShape>,
    state: Mutex<BlasState>,
}

/// What changes with builds and compaction.
struct BlasState {
    body: Arc<BlasBody>,
    /// Builds in command buffers that are not submitted yet.
    open_builds: u32,
    /// Builds submitted so far, refits not counted; tells whether a compacted size still holds.
    builds: u64,
    /// Refits recorded since the last rebuild.
    refits: u32,
    compaction_requested: bool,
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
    /// Bytes before compaction, for a body that is compacted or was loaded.
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
    ) -> Self {
        let state = BlasState {
            body: Arc::new(body),
            open_builds: 0,
            builds: 0,
            refits: 0,
            compaction_requested: false,
        };
        Self { geometries, transforms, parts, state: Mutex::new(state) }
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

    /// The command buffer with a recorded build was submitted, or given up; `rebuilt` if it was submitted and is no
    /// refit, which leaves sizes as they are.
    pub(crate) fn close_build(&self, rebuilt: bool) {
        let mut state = self.lock();
        state.builds += u64::from(rebuilt);
        state.open_builds = state.open_builds.saturating_sub(1);
    }

    /// How many builds were submitted so far, refits not counted.
    pub(crate) fn builds(&self) -> u64 {
        self.lock().builds
    }

    /// Whether builds wait for their submission.
    pub(crate) fn has_open_builds(&self) -> bool {
        self.lock().open_builds > 0
    }

    /// Refits recorded since the last rebuild.
    pub(crate) fn refits(&self) -> u32 {
        self.lock().refits
    }

    /// A build was recorded, a refit or not.
    pub(crate) fn count_refit(&self, refit: bool) {
        let mut state = self.lock();
        state.refits = if refit { state.refits.saturating_add(1) } else { 0 };
    }

    /// Compaction is under way from now on, or no longer; answers whether it was before.
    pub(crate) fn request_compaction(&self, on: bool) -> bool {
        std::mem::replace(&mut self.lock().compaction_requested, on)
    }

    /// Whether compaction is under way.
    pub(crate) fn is_compacting(&self) -> bool {
        self.lock().compaction_requested
    }

    fn lock(&self) -> MutexGuard<'_, BlasState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
