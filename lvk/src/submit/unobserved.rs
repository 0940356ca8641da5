//! Timeline values that the host has not observed, where the validation layer must learn of each in order.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::last_access::PerQueue;
use crate::error::Result;
use crate::gpu::Gpu;

/// Submitted timeline values that the host has not observed, of each queue and in rising order.
///
/// Synchronization validation (1.4.364) takes the wrong work as finished when the host observes a value:
/// - If the host has observed the value before, the layer takes the next submission of the queue as finished.
/// - The layer does not take as finished what other queues did before a wait of that queue.
///
/// So it misses hazards, and reports others that are none. It does neither if the host observes each value once, those of
/// all queues together, and no submission comes between (`docs/drivers.md` has the programs that show it).
#[derive(Debug, Default)]
pub(super) struct Unobserved {
    values: PerQueue<VecDeque<u64>>,
    /// Time of the first question since the last that found a value.
    idle_since: Option<Instant>,
}

/// Answer of [`Unobserved::observe`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Progress {
    /// A value was observed within [`LONGEST_IDLE`], or none is left.
    Recent,
    /// Questions have found no value for longer.
    Stalled,
}

/// Time without a new value after which the device may be lost.
const LONGEST_IDLE: Duration = Duration::from_secs(2);

/// True if the host must observe values in order: the validation layer is on and sees several queues, or tests request it.
pub(super) fn must_observe_in_order(gpu: &Gpu) -> bool {
    #[cfg(any(test, feature = "test-hooks"))]
    let with_one_queue = crate::test_support::hooks::observes_one_queue();
    #[cfg(not(any(test, feature = "test-hooks")))]
    let with_one_queue = false;
    gpu.instance.validated && (gpu.queues.has_several_raw() || with_one_queue)
}

impl Unobserved {
    /// Records a submitted value.
    pub(super) fn push(&mut self, queue_index: usize, value: u64) {
        self.values[queue_index].push_back(value);
    }

    /// Observes all values that the queues have reached. `reaches` asks whether a queue has reached a value.
    pub(super) fn observe(
        &mut self,
        mut reaches: impl FnMut(usize, u64) -> Result<bool>,
    ) -> Result<Progress> {
        let (mut found, mut is_new) = (false, true);
        // Work that a queue waited for is done too, maybe on a queue that was asked before.
        while std::mem::take(&mut is_new) {
            for (queue_index, values) in self.values.iter_mut().enumerate() {
                while let Some(value) = values.front()
                    && reaches(queue_index, *value)?
                {
                    values.pop_front();
                    is_new = true;
                }
            }
            found |= is_new;
        }
        if found || self.values.iter().all(VecDeque::is_empty) {
            self.idle_since = None;
            return Ok(Progress::Recent);
        }
        let idle = self.idle_since.get_or_insert_with(Instant::now).elapsed();
        Ok(if idle < LONGEST_IDLE { Progress::Recent } else { Progress::Stalled })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::last_access::QUEUE_COUNT;
    use super::*;

    /// Work of a queue, with the number of earlier works that it waits for.
    fn works() -> impl Strategy<Value = Vec<(usize, Vec<prop::sample::Index>)>> {
        let work = (0..QUEUE_COUNT, prop::collection::vec(any::<prop::sample::Index>(), 0..3));
        prop::collection::vec(work, 1..20)
    }

    #[test]
    fn a_value_that_is_never_reached_ends_the_progress() {
        let mut unobserved = Unobserved::default();
        assert_eq!(unobserved.observe(|_, _| Ok(false)).unwrap(), Progress::Recent, "nothing is submitted");
        unobserved.push(1, 4);
        unobserved.push(1, 7);
        assert_eq!(unobserved.observe(|_, _| Ok(false)).unwrap(), Progress::Recent);
        unobserved.idle_since = Instant::now().checked_sub(LONGEST_IDLE);
        assert_eq!(unobserved.observe(|_, _| Ok(false)).unwrap(), Progress::Stalled);
        assert_eq!(unobserved.observe(|_, value| Ok(value == 4)).unwrap(), Progress::Recent);
        assert_eq!(unobserved.observe(|_, _| Ok(false)).unwrap(), Progress::Recent);
    }

    proptest! {
        /// While queues go on between the questions, no value is observed twice, and none without what precedes it.
        #[test]
        fn values_are_observed_once_and_with_all_that_precedes_them(
            works in works(),
            steps in prop::collection::vec(0..4_usize, 1..200),
        ) {
            let mut unobserved = Unobserved::default();
            for (place, (queue_index, _)) in works.iter().enumerate() {
                unobserved.values[*queue_index].push_back(place as u64);
            }
            let queue_of = |place: usize| works[place].0;
            let waits_for = |place: usize| -> Vec<usize> {
                let same_queue = (0..place).rev().find(|before| queue_of(*before) == queue_of(place));
                let waits = works[place].1.iter().filter(|_| place > 0).map(|wait| wait.index(place));
                waits.chain(same_queue).collect()
            };
            let (mut done, mut observed) = (vec![false; works.len()], vec![false; works.len()]);
            let mut steps = steps.into_iter();
            while let Some(first) = steps.next() {
                let mut step = Some(first);
                let asked = unobserved.observe(|queue_index, value| {
                    let step = step.take().or_else(|| steps.next()).unwrap_or_default();
                    for turn in 0..step {
                        let is_next = |place: &usize| {
                            !done[*place] && waits_for(*place).iter().all(|before| done[*before])
                        };
                        let next: Vec<usize> = (0..works.len()).filter(is_next).collect();
                        if !next.is_empty() {
                            done[next[(step + turn) % next.len()]] = true;
                        }
                    }
                    let place = value as usize;
                    assert!(queue_of(place) == queue_index && !observed[place], "{value} is observed again");
                    observed[place] = done[place];
                    Ok(done[place])
                });
                prop_assert!(asked.is_ok());
                for place in (0..works.len()).filter(|place| observed[*place]) {
                    prop_assert!(waits_for(place).iter().all(|before| observed[*before]), "{} precedes", place);
                }
            }
        }
    }
}
