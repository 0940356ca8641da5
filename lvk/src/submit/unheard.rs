//! Values that the host learns of while the validation layer listens.

use std::collections::VecDeque;

use super::last_access::PerQueue;
use crate::error::Result;
use crate::gpu::Gpu;

/// Timeline values that the validation layer has not heard of, of each queue and in rising order.
///
/// Synchronization validation (1.4.364) takes more or less as finished than it should when the host learns of a value:
/// - If it has heard of the value before, it takes the next submission of the queue as finished.
/// - It takes what the queue itself did as finished, but not what other queues did before a wait of that queue.
///
/// Then it misses hazards, and reports others that are none. So while it listens, the host learns of each value once, of
/// all queues together, and no submission comes between (`docs/drivers.md`).
#[derive(Debug, Default)]
pub(super) struct Unheard(PerQueue<VecDeque<u64>>);

impl Unheard {
    /// Records a submitted value, if the layer listens.
    pub(super) fn push(&mut self, gpu: &Gpu, queue_index: usize, value: u64) {
        if gpu.is_watched() {
            self.0[queue_index].push_back(value);
        }
    }

    /// Lets the host learn of all values that the queues have reached. `reaches` asks whether a queue has reached a value.
    pub(super) fn hear(&mut self, mut reaches: impl FnMut(usize, u64) -> Result<bool>) -> Result<()> {
        let mut is_new = true;
        // A queue that is asked later may have gone on, and what it waited for is to be heard too.
        while std::mem::take(&mut is_new) {
            for (queue_index, values) in self.0.iter_mut().enumerate() {
                while let Some(value) = values.front()
                    && reaches(queue_index, *value)?
                {
                    values.pop_front();
                    is_new = true;
                }
            }
        }
        Ok(())
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

    proptest! {
        /// While queues go on between the questions, no value is heard twice, and none without what precedes it.
        #[test]
        fn values_are_heard_once_and_with_all_that_precedes_them(
            works in works(),
            steps in prop::collection::vec(0..4_usize, 1..200),
        ) {
            let mut unheard = Unheard::default();
            for (place, (queue_index, _)) in works.iter().enumerate() {
                unheard.0[*queue_index].push_back(place as u64);
            }
            let queue_of = |place: usize| works[place].0;
            let waits_for = |place: usize| -> Vec<usize> {
                let same_queue = (0..place).rev().find(|before| queue_of(*before) == queue_of(place));
                let waits = works[place].1.iter().filter(|_| place > 0).map(|wait| wait.index(place));
                waits.chain(same_queue).collect()
            };
            let (mut done, mut heard) = (vec![false; works.len()], vec![false; works.len()]);
            let mut steps = steps.into_iter();
            while let Some(first) = steps.next() {
                let mut step = Some(first);
                let asked = unheard.hear(|queue_index, value| {
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
                    assert!(queue_of(place) == queue_index && !heard[place], "{value} is heard again");
                    heard[place] = done[place];
                    Ok(done[place])
                });
                prop_assert!(asked.is_ok());
                for place in (0..works.len()).filter(|place| heard[*place]) {
                    prop_assert!(waits_for(place).iter().all(|before| heard[*before]), "{} precedes", place);
                }
            }
        }
    }
}
