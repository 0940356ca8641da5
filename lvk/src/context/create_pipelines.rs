//! Creates many pipelines at once.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::Context;
use super::holder::Holder;
use crate::error::Result;
use crate::handle::{ComputePipelineHandle, RenderPipelineHandle};
use crate::lock::Waiting;
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::graphics_desc::RenderPipelineDesc;

impl Context {
    /// [`create_render_pipeline`](Self::create_render_pipeline) for each description, on all cores of the CPU. Answers in
    /// the order of the descriptions; one that fails stops no other.
    pub fn create_render_pipelines(
        &self,
        descs: &[RenderPipelineDesc<'_>],
    ) -> Vec<Result<Holder<RenderPipelineHandle>>> {
        on_all_cores(descs, |desc| self.create_render_pipeline(desc))
    }

    /// [`create_compute_pipeline`](Self::create_compute_pipeline) for each description, on all cores of the CPU. Answers
    /// in the order of the descriptions; one that fails stops no other.
    pub fn create_compute_pipelines(
        &self,
        descs: &[ComputePipelineDesc<'_>],
    ) -> Vec<Result<Holder<ComputePipelineHandle>>> {
        on_all_cores(descs, |desc| self.create_compute_pipeline(desc))
    }
}

/// `make` of each item, in their order. Who is done takes the next: pipelines take very different times.
fn on_all_cores<T: Sync, R: Send>(items: &[T], make: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let cores = thread::available_parallelism().map_or(1, usize::from).min(items.len());
    let next = AtomicUsize::new(0);
    let work = || {
        let mut made = Vec::new();
        while let Some((place, item)) = {
            let place = next.fetch_add(1, Ordering::Relaxed);
            items.get(place).map(|item| (place, item))
        } {
            made.push((place, make(item)));
        }
        made
    };
    let waiting = Waiting::here();
    let mut made: Vec<(usize, R)> = thread::scope(|scope| {
        let others: Vec<_> = (1..cores).map(|_| scope.spawn(|| waiting.work(work))).collect();
        let mut made = work();
        for other in others {
            made.extend(other.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
        made
    });
    made.sort_unstable_by_key(|(place, _)| *place);
    made.into_iter().map(|(_, made)| made).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_stand_in_the_order_of_the_items() {
        for count in [0, 1, 2, 1_000_u64] {
            let items: Vec<u64> = (0..count).collect();
            let expected: Vec<u64> = items.iter().map(|item| item * item).collect();
            assert_eq!(on_all_cores(&items, |item| item * item), expected);
        }
    }
}
