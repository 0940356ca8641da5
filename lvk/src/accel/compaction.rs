//! Compactions under way: sizes are asked of the GPU, and the copies made once it has answered.

use std::sync::{Arc, Weak};

use super::accel_struct::AccelStruct;
use super::blas::BlasStructures;
use crate::error::{Error, Result};
use crate::lock_order::{Mutex, Rank};
use crate::resource::QueryPool;

/// All compactions of a context.
#[derive(Default)]
pub(crate) struct Compactions {
    /// Those whose sizes the GPU is to answer.
    pub(crate) queries: Vec<Arc<CompactedSizeQuery>>,
    /// Copies to be made.
    pub(crate) copies: Vec<PlannedCopy>,
    /// What copies took the place of: memory that comes back.
    pub(crate) replaced: Vec<Weak<BlasStructures>>,
}

/// A copy whose sizes are known.
pub(crate) struct PlannedCopy {
    /// Nothing is kept for the sake of its copy.
    pub(crate) target: Weak<AccelStruct>,
    /// Bytes of each part.
    pub(crate) sizes: Vec<u64>,
    /// How many builds the structure had seen when it was asked.
    pub(crate) builds: u64,
    /// Why there was no room for it when that was last tried.
    pub(crate) refused: Option<CompactionRefusal>,
}

/// There was no room for a copy.
pub(crate) struct CompactionRefusal {
    pub(crate) error: Error,
    /// Bytes that structures had in use.
    pub(crate) used_bytes: u64,
    /// The last submission by then: what was destroyed before is freed when the GPU is done with it.
    pub(crate) submitted: u64,
}

impl Compactions {
    pub(crate) fn is_empty(&self) -> bool {
        self.queries.is_empty() && self.copies.is_empty()
    }

    /// Forgets what is freed by now.
    pub(crate) fn drop_freed(&mut self) {
        self.replaced.retain(|body| body.strong_count() > 0);
    }

    /// The copies without room, where nothing under way will free any, with the GPU as far as submission `completed`.
    pub(crate) fn drain_stuck(&mut self, completed: u64) -> Vec<PlannedCopy> {
        let waits =
            |copy: &PlannedCopy| copy.refused.as_ref().is_none_or(|refusal| refusal.submitted > completed);
        let hope = !self.queries.is_empty() || !self.replaced.is_empty() || self.copies.iter().any(waits);
        if hope { Vec::new() } else { std::mem::take(&mut self.copies) }
    }
}

impl PlannedCopy {
    /// Whether to try it, with so many bytes of structures in use.
    pub(crate) fn should_retry(&self, used_bytes: u64) -> bool {
        self.refused.as_ref().is_none_or(|refusal| used_bytes < refusal.used_bytes)
    }
}

/// Compacted sizes asked for together.
pub(crate) struct CompactedSizeQuery {
    pub(crate) pool: QueryPool,
    /// Each with the query of its first part; its other parts follow.
    pub(crate) targets: Vec<(Arc<AccelStruct>, u32)>,
    /// For each target how many builds the GPU will have seen when it answers; empty before the submission.
    builds: Mutex<Vec<u64>>,
}

impl CompactedSizeQuery {
    pub(crate) fn new(pool: QueryPool, targets: Vec<(Arc<AccelStruct>, u32)>) -> Self {
        Self { pool, targets, builds: Mutex::new(Rank::SizeQuery, Vec::new()) }
    }

    /// The query went to the GPU, behind all builds submitted so far.
    pub(crate) fn mark_submitted(&self) {
        let builds =
            |(target, _): &(Arc<AccelStruct>, u32)| target.blas().map_or(0, |blas| blas.build_count());
        *self.builds.lock() = self.targets.iter().map(builds).collect();
    }

    /// The copies to be made, once the GPU has answered.
    pub(crate) fn results(&self) -> Result<Option<Vec<PlannedCopy>>> {
        let Some(builds) = self.build_counts() else { return Ok(None) };
        let sizes: Option<Vec<_>> = self.pool.values(0, self.pool.count)?.into_iter().collect();
        let Some(sizes) = sizes else { return Ok(None) };
        let copy = |((target, first), builds): (&(Arc<AccelStruct>, u32), u64)| {
            let parts = sizes.iter().skip(*first as usize).take(target.blas()?.parts.len());
            let (target, sizes) = (Arc::downgrade(target), parts.copied().collect());
            Ok(PlannedCopy { target, sizes, builds, refused: None })
        };
        self.targets.iter().zip(builds).map(copy).collect::<Result<_>>().map(Some)
    }

    /// The builds each target's size is of; `None` before the submission.
    fn build_counts(&self) -> Option<Vec<u64>> {
        let builds = self.builds.lock();
        (builds.len() == self.targets.len()).then(|| builds.clone())
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
    fn what_had_no_room_is_tried_again_when_memory_was_freed() {
        assert!(copy(None).should_retry(100));
        assert!(copy(Some(100)).should_retry(99));
        assert!(!copy(Some(100)).should_retry(100));
    }

    #[test]
    fn copies_are_given_up_when_nothing_will_free_memory() {
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
