//! Pending compactions: size queries on the GPU, and the copies that follow their results.

use std::sync::{Arc, Weak};

use super::accel_struct::AccelStruct;
use super::blas::BlasStructures;
use crate::error::{Error, Result};
use crate::lock_order::{Mutex, Rank};
use crate::resource::QueryPool;

/// All pending compactions of a context.
#[derive(Default)]
pub(crate) struct Compactions {
    /// Size queries without results yet.
    pub(crate) queries: Vec<Arc<CompactedSizeQuery>>,
    /// Copies that are not recorded yet.
    pub(crate) copies: Vec<PlannedCopy>,
    /// Acceleration structures that copies replaced. Their memory is freed later.
    pub(crate) replaced: Vec<Weak<BlasStructures>>,
    /// True if a TLAS could not be written again at the last submission.
    pub(crate) rewrite_failed: bool,
}

/// A copy with known sizes.
pub(crate) struct PlannedCopy {
    /// Weak, so that a planned copy does not keep a destroyed BLAS alive.
    pub(crate) target: Weak<AccelStruct>,
    /// Compacted bytes of each part.
    pub(crate) sizes: Vec<u64>,
    /// Number of builds of the BLAS at the time of the size query.
    pub(crate) builds: u64,
    /// Failure of the last attempt for lack of memory; `None` if none has failed.
    pub(crate) refused: Option<CompactionRefusal>,
}

/// A failure to allocate the memory of a copy.
pub(crate) struct CompactionRefusal {
    pub(crate) error: Error,
    /// Bytes that acceleration structures used at that time.
    pub(crate) used_bytes: u64,
    /// The last submission at that time. Objects destroyed earlier are freed once the GPU has completed it.
    pub(crate) submitted: u64,
}

impl Compactions {
    pub(crate) fn is_empty(&self) -> bool {
        self.queries.is_empty() && self.copies.is_empty()
    }

    /// Drops the entries of `replaced` whose memory is freed.
    pub(crate) fn drop_freed(&mut self) {
        self.replaced.retain(|body| body.strong_count() > 0);
    }

    /// Takes the copies that lack memory, if no pending work can free any. The GPU has completed the submissions up to
    /// `completed`.
    pub(crate) fn drain_stuck(&mut self, completed: u64) -> Vec<PlannedCopy> {
        let waits =
            |copy: &PlannedCopy| copy.refused.as_ref().is_none_or(|refusal| refusal.submitted > completed);
        let hope = !self.queries.is_empty() || !self.replaced.is_empty() || self.copies.iter().any(waits);
        if hope { Vec::new() } else { std::mem::take(&mut self.copies) }
    }
}

impl PlannedCopy {
    /// True if the copy was never refused, or if less memory is in use than at the refusal. `used_bytes` is the memory
    /// of acceleration structures in use.
    pub(crate) fn should_retry(&self, used_bytes: u64) -> bool {
        self.refused.as_ref().is_none_or(|refusal| used_bytes < refusal.used_bytes)
    }
}

/// A query of the compacted sizes of several BLAS.
pub(crate) struct CompactedSizeQuery {
    pub(crate) pool: QueryPool,
    /// Each BLAS with the query index of its first part. The queries of its other parts follow.
    pub(crate) targets: Vec<(Arc<AccelStruct>, u32)>,
    /// The submission of the query; `None` before it.
    submission: Mutex<Option<QuerySubmission>>,
}

/// The submission of a size query.
struct QuerySubmission {
    /// Timeline value at which the results are there.
    value: u64,
    /// For each target, the number of builds before the query.
    builds: Vec<u64>,
}

impl CompactedSizeQuery {
    pub(crate) fn new(pool: QueryPool, targets: Vec<(Arc<AccelStruct>, u32)>) -> Self {
        Self { pool, targets, submission: Mutex::new(Rank::SizeQuery, None) }
    }

    /// Records that the query was submitted with this timeline value, after all builds submitted so far.
    pub(crate) fn mark_submitted(&self, value: u64) {
        let builds =
            |(target, _): &(Arc<AccelStruct>, u32)| target.blas().map_or(0, |blas| blas.build_count());
        let builds = self.targets.iter().map(builds).collect();
        *self.submission.lock() = Some(QuerySubmission { value, builds });
    }

    /// Returns the copies to record; `None` until the GPU has written the results. `completed` is the value that it has reached. Availability
    /// alone does not tell: lavapipe also answers queries that are not written yet.
    pub(crate) fn results(&self, completed: u64) -> Result<Option<Vec<PlannedCopy>>> {
        let builds = match &*self.submission.lock() {
            Some(submission) if submission.value <= completed => submission.builds.clone(),
            _ => return Ok(None),
        };
        let sizes: Option<Vec<_>> = self.pool.values(0, self.pool.count)?.into_iter().collect();
        let Some(sizes) = sizes else { return Ok(None) };
        let copy = |((target, first), builds): (&(Arc<AccelStruct>, u32), u64)| {
            let parts = sizes.iter().skip(*first as usize).take(target.blas()?.parts.len());
            let (target, sizes) = (Arc::downgrade(target), parts.copied().collect());
            Ok(PlannedCopy { target, sizes, builds, refused: None })
        };
        self.targets.iter().zip(builds).map(copy).collect::<Result<_>>().map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn copy(used_bytes: Option<u64>) -> PlannedCopy {
        let error = Error::usage("", "");
        let refused = used_bytes.map(|used_bytes| CompactionRefusal { error, used_bytes, submitted: 7 });
        PlannedCopy { target: Weak::new(), sizes: Vec::new(), builds: 1, refused }
    }

    #[test]
    fn a_copy_without_memory_is_tried_again_when_memory_was_freed() {
        assert!(copy(None).should_retry(100));
        assert!(copy(Some(100)).should_retry(99));
        assert!(!copy(Some(100)).should_retry(100));
    }

    #[test]
    fn copies_are_cancelled_when_nothing_will_free_memory() {
        let body =
            Arc::new(BlasStructures { structures: Vec::new(), compacted_from: None, rebuildable: true });
        let mut all = Compactions { copies: vec![copy(Some(1)), copy(None)], ..Default::default() };
        assert!(all.drain_stuck(7).is_empty(), "another copy is not tried yet");
        all.copies.pop();
        all.replaced.push(Arc::downgrade(&body));
        all.drop_freed();
        assert!(all.drain_stuck(7).is_empty(), "a replaced body will be freed");
        drop(body);
        all.drop_freed();
        assert!(all.drain_stuck(6).is_empty(), "the GPU may yet use what was destroyed");
        assert_eq!(all.drain_stuck(7).len(), 1);
        assert!(all.is_empty());
    }
}
