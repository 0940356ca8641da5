//! Deferred destruction: an item is freed once no open command buffer and no submission can use it.

use std::collections::VecDeque;

/// A queue of items to destroy later.
///
/// A command buffer that was open when an item was destroyed may use it. The item therefore first waits until that
/// command buffer is submitted or dropped. After that no new submission can use the item, and the timeline value of the
/// last submission so far bounds the GPU's use.
#[derive(Debug)]
pub(crate) struct DeferredFree<T> {
    /// Items that wait for open command buffers, with the newest such sequence number.
    open: Vec<(T, Option<u64>)>,
    /// Items that wait for the GPU, with the timeline value to reach. Values never fall from front to back.
    stamped: VecDeque<(T, u64)>,
}

impl<T> Default for DeferredFree<T> {
    fn default() -> Self {
        Self { open: Vec::new(), stamped: VecDeque::new() }
    }
}

impl<T> DeferredFree<T> {
    /// Queues `item`. `newest_open` is the newest sequence number of a command buffer so far; `None` if no command
    /// buffer can use the item.
    pub(crate) fn push(&mut self, item: T, newest_open: Option<u64>) {
        self.open.push((item, newest_open));
    }

    /// Returns the number of waiting items.
    pub(crate) fn len(&self) -> usize {
        self.open.len() + self.stamped.len()
    }

    /// Takes the items that can be destroyed now.
    ///
    /// `oldest_open` is the sequence number of the oldest command buffer still being recorded, `submitted` the timeline
    /// value of the last submission and `completed` the one the GPU has reached.
    pub(crate) fn take_completed(
        &mut self,
        oldest_open: Option<u64>,
        submitted: u64,
        completed: u64,
    ) -> Vec<T> {
        if self.len() == 0 {
            return Vec::new();
        }
        let blocked =
            |newest: Option<u64>| newest.zip(oldest_open).is_some_and(|(newest, open)| open <= newest);
        let stamp = self.stamped.back().map_or(submitted, |(_, last)| submitted.max(*last));
        let unblocked = self.open.extract_if(.., |(_, newest)| !blocked(*newest));
        self.stamped.extend(unblocked.map(|(item, _)| (item, stamp)));
        let done = self.stamped.partition_point(|(_, stamp)| *stamp <= completed);
        self.stamped.drain(..done).map(|(item, _)| item).collect()
    }

    /// Takes all items. The device is idle.
    pub(crate) fn drain_all(&mut self) -> Vec<T> {
        let stamped = self.stamped.drain(..).map(|(item, _)| item);
        stamped.chain(self.open.drain(..).map(|(item, _)| item)).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, Clone)]
    enum DeferredOp {
        Open,
        /// Submits or drops one of the open command buffers.
        Close {
            which: prop::sample::Index,
            submit: bool,
        },
        Destroy,
        Complete,
        Collect,
    }

    fn op() -> impl Strategy<Value = DeferredOp> {
        prop_oneof![
            Just(DeferredOp::Open),
            (any::<prop::sample::Index>(), any::<bool>())
                .prop_map(|(which, submit)| DeferredOp::Close { which, submit }),
            Just(DeferredOp::Destroy),
            Just(DeferredOp::Complete),
            Just(DeferredOp::Collect),
        ]
    }

    /// The command buffers that may use a destroyed item, and the last submission of any of them.
    struct DeferredItem {
        users: BTreeSet<u64>,
        last_use: u64,
    }

    #[derive(Default)]
    struct DeferredModel {
        next: u64,
        open: BTreeSet<u64>,
        submitted: u64,
        completed: u64,
        items: Vec<Option<DeferredItem>>,
    }

    impl DeferredModel {
        fn close(&mut self, which: &prop::sample::Index, submit: bool) {
            if self.open.is_empty() {
                return;
            }
            let list: Vec<u64> = self.open.iter().copied().collect();
            let closed = *which.get(&list);
            self.open.remove(&closed);
            self.submitted += u64::from(submit);
            for item in self.items.iter_mut().flatten() {
                if item.users.remove(&closed) && submit {
                    item.last_use = self.submitted;
                }
            }
        }
    }

    proptest! {
        #[test]
        fn nothing_in_use_is_returned_and_nothing_is_kept_or_lost(ops in prop::collection::vec(op(), 0..120)) {
            let mut deferred = DeferredFree::default();
            let mut model = DeferredModel::default();
            for op in ops {
                match op {
                    DeferredOp::Open => {
                        model.open.insert(model.next);
                        model.next += 1;
                    }
                    DeferredOp::Close { which, submit } => model.close(&which, submit),
                    DeferredOp::Destroy => {
                        deferred.push(model.items.len(), model.next.checked_sub(1));
                        let item = DeferredItem { users: model.open.clone(), last_use: model.submitted };
                        model.items.push(Some(item));
                    }
                    DeferredOp::Complete => model.completed = (model.completed + 1).min(model.submitted),
                    DeferredOp::Collect => {
                        let oldest = model.open.first().copied();
                        for index in deferred.take_completed(oldest, model.submitted, model.completed) {
                            let item = model.items[index].take();
                            prop_assert!(item.is_some(), "returned twice");
                            let item = item.unwrap();
                            prop_assert!(item.users.is_empty() && item.last_use <= model.completed);
                        }
                    }
                }
            }
            model.submitted += 1;
            deferred.take_completed(None, model.submitted, 0).into_iter().for_each(|index| model.items[index] = None);
            let rest = deferred.take_completed(None, model.submitted, model.submitted);
            let kept: Vec<usize> =
                model.items.iter().enumerate().filter(|(_, item)| item.is_some()).map(|(at, _)| at).collect();
            let mut sorted = rest;
            sorted.sort_unstable();
            prop_assert_eq!(sorted, kept);
            prop_assert!(deferred.drain_all().is_empty());
        }
    }

    #[test]
    fn item_waits_for_the_command_buffer_and_then_for_the_gpu() {
        let mut deferred = DeferredFree::default();
        deferred.push("texture", Some(7));
        assert!(deferred.take_completed(Some(7), 3, 3).is_empty());
        assert!(deferred.take_completed(Some(8), 4, 3).is_empty());
        assert!(deferred.take_completed(Some(8), 9, 3).is_empty());
        assert_eq!(deferred.take_completed(Some(8), 9, 4), ["texture"]);
    }

    #[test]
    fn unused_item_of_an_idle_queue_goes_at_once() {
        let mut deferred = DeferredFree::default();
        deferred.push("buffer", None);
        assert_eq!(deferred.take_completed(Some(0), 0, 0), ["buffer"]);
    }

    #[test]
    fn draining_returns_every_item() {
        let mut deferred = DeferredFree::default();
        deferred.push(1, Some(1));
        deferred.push(2, None);
        assert!(deferred.take_completed(Some(1), 5, 0).is_empty());
        assert_eq!(deferred.drain_all(), [2, 1]);
    }
}
