//! Compactions under way: sizes asked of the GPU, and for whom.

use std::sync::{Arc, Mutex, PoisonError};

use super::structure::AccelStruct;
use crate::resource::QueryPool;

/// Compacted sizes asked for together.
pub(crate) struct SizeQuery {
    pub(crate) pool: QueryPool,
    /// Each with the query of its first part; its other parts follow.
    pub(crate) targets: Vec<(Arc<AccelStruct>, u32)>,
    /// For each target how many builds the GPU will have seen when it answers; empty before the submission.
    builds: Mutex<Vec<u64>>,
}

impl SizeQuery {
    pub(crate) fn new(pool: QueryPool, targets: Vec<(Arc<AccelStruct>, u32)>) -> Self {
        Self { pool, targets, builds: Mutex::default() }
    }

    /// The query went to the GPU, behind all builds submitted so far.
    pub(crate) fn submit(&self) {
        let builds = |(target, _): &(Arc<AccelStruct>, u32)| target.blas().map_or(0, |blas| blas.builds());
        *self.builds.lock().unwrap_or_else(PoisonError::into_inner) =
            self.targets.iter().map(builds).collect();
    }

    /// The builds each target's size is of; `None` before the submission.
    pub(crate) fn builds(&self) -> Option<Vec<u64>> {
        let builds = self.builds.lock().unwrap_or_else(PoisonError::into_inner);
        (builds.len() == self.targets.len()).then(|| builds.clone())
    }
}
