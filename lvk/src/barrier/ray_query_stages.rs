//! Graphics stages that may use ray queries. Render passes wait for these before any pipeline is bound.

use std::sync::atomic::{AtomicU16, Ordering};

use super::access::{Stages, Use};
use super::resource_id::ResourceId;
use super::tracker::Tracker;

/// The stages in which any graphics pipeline created so far uses ray queries.
///
/// A destroyed pipeline still counts, which costs a barrier and nothing else.
#[derive(Debug, Default)]
pub(crate) struct RayQueryStages(AtomicU16);

impl RayQueryStages {
    /// Records the creation of a pipeline that uses ray queries in `stages`.
    pub(crate) fn insert(&self, stages: Stages) {
        self.0.fetch_or(stages.bits(), Ordering::Relaxed);
    }

    /// Returns the stages to which a pass that begins now must make the acceleration structures visible that
    /// its command buffer has built. `None` if it has built none, or if they are already visible to these
    /// stages. Acceleration structures built by earlier submissions are synchronised by the queue, once a
    /// pipeline with ray queries is bound.
    ///
    /// `reads` returns all reads of ray queries in the given stages.
    pub(crate) fn waiting_stages<const N: usize>(
        &self,
        tracker: &Tracker,
        reads: impl FnOnce(Stages) -> [(ResourceId, Use); N],
    ) -> Option<Stages> {
        let stages = Stages::from_bits_truncate(self.0.load(Ordering::Relaxed));
        let waits = |(id, read)| tracker.needs_barrier_buffer(id, read);
        reads(stages).into_iter().any(waits).then_some(stages)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::barrier::batch::Barriers;

    const GRAPHICS: Stages = Stages::PRE_RASTER.union(Stages::FRAGMENT);

    struct RecordedCommands {
        tracker: Tracker,
        structures: [ResourceId; 2],
    }

    impl RecordedCommands {
        fn new() -> Self {
            Self { tracker: Tracker::default(), structures: [ResourceId::next(), ResourceId::next()] }
        }

        fn build(&mut self, which: usize) {
            let id = self.structures[which];
            self.tracker.accumulate_buffer(id, Use::accel_build_write(), &mut Barriers::default());
        }

        fn query(&mut self, stages: Stages) {
            for id in self.structures {
                self.tracker.use_buffer(id, Use::accel_read(stages), &mut Barriers::default());
            }
        }

        fn waiting(&self, of_pipelines: Stages) -> Option<Stages> {
            let stages = RayQueryStages::default();
            stages.insert(of_pipelines);
            self.waiting_for(&stages)
        }

        fn waiting_for(&self, pipelines: &RayQueryStages) -> Option<Stages> {
            pipelines.waiting_stages(&self.tracker, |stages| {
                self.structures.map(|id| (id, Use::accel_read(stages)))
            })
        }
    }

    #[test]
    fn a_pass_waits_for_builds_of_either_level_before_it() {
        for level in [0, 1] {
            let mut recorded = RecordedCommands::new();
            assert_eq!(recorded.waiting(GRAPHICS), None, "nothing was built");
            recorded.build(level);
            assert_eq!(recorded.waiting(GRAPHICS), Some(GRAPHICS));
            assert_eq!(recorded.waiting(Stages::FRAGMENT), Some(Stages::FRAGMENT));
            recorded.query(GRAPHICS);
            assert_eq!(recorded.waiting(GRAPHICS), None, "the pass before has waited");
            recorded.build(level);
            assert_eq!(recorded.waiting(GRAPHICS), Some(GRAPHICS));
        }
    }

    #[test]
    fn a_pass_waits_for_nothing_where_no_pipeline_queries() {
        let mut recorded = RecordedCommands::new();
        recorded.build(0);
        assert_eq!(recorded.waiting(Stages::empty()), None);
    }

    #[test]
    fn queries_of_other_stages_do_not_wait_for_a_pass() {
        let mut recorded = RecordedCommands::new();
        recorded.build(1);
        recorded.query(Stages::COMPUTE);
        assert_eq!(recorded.waiting(Stages::PRE_RASTER), Some(Stages::PRE_RASTER));
        recorded.query(Stages::FRAGMENT);
        assert_eq!(recorded.waiting(Stages::FRAGMENT), None);
        assert_eq!(recorded.waiting(GRAPHICS), Some(GRAPHICS));
    }

    #[test]
    fn structures_of_earlier_submissions_need_no_barrier_in_front_of_a_pass() {
        let mut recorded = RecordedCommands::new();
        recorded.query(Stages::COMPUTE);
        assert_eq!(recorded.waiting(GRAPHICS), None);
    }

    #[test]
    fn stages_of_all_pipelines_add_up() {
        let stages = RayQueryStages::default();
        stages.insert(Stages::FRAGMENT);
        stages.insert(Stages::empty());
        stages.insert(Stages::PRE_RASTER);
        let mut recorded = RecordedCommands::new();
        recorded.build(0);
        assert_eq!(recorded.waiting_for(&stages), Some(GRAPHICS));
    }
}
