//! Tracks which queries of a pool may be written: each query once after a reset.

/// The first write comes before any reset here: the query must be reset before the command buffer.
const NEEDED: u8 = 1;
/// The last operation was a reset.
const RESET: u8 = 2;
/// The last operation was a write.
const WRITTEN: u8 = 4;

/// State of the queries of one pool after one command buffer, or after all submitted command buffers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct QueryResetState(Vec<u8>);

impl QueryResetState {
    /// Creates the state of `count` queries without any operation.
    pub(crate) fn new(count: u32) -> Self {
        Self(vec![0; count as usize])
    }

    /// True if the operations recorded here allow a write of the query.
    pub(crate) fn is_ready(&self, query: u32) -> bool {
        self.0.get(query as usize).is_some_and(|mark| mark & WRITTEN == 0)
    }

    /// Records a write of the query.
    pub(crate) fn write(&mut self, query: u32) {
        if let Some(mark) = self.0.get_mut(query as usize) {
            let needed = if *mark & RESET == 0 { NEEDED } else { 0 };
            *mark = (*mark & NEEDED) | needed | WRITTEN;
        }
    }

    /// Records a reset of the query.
    pub(crate) fn reset(&mut self, query: u32) {
        if let Some(mark) = self.0.get_mut(query as usize) {
            *mark = (*mark & NEEDED) | RESET;
        }
    }

    /// Returns the first query that `next` writes although it was written and not reset. `next` runs after this state.
    pub(crate) fn first_conflict(&self, next: &Self) -> Option<u32> {
        let mut pairs = self.0.iter().zip(&next.0);
        let place = pairs.position(|(before, after)| before & WRITTEN != 0 && after & NEEDED != 0);
        place.map(|place| place as u32)
    }

    /// Appends the operations of `next`, which runs after this state.
    pub(crate) fn append(&mut self, next: &Self) {
        for (mark, after) in self.0.iter_mut().zip(&next.0) {
            let last = after & (RESET | WRITTEN);
            *mark = if last == 0 { *mark } else { (*mark & NEEDED) | last };
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Command buffers are accepted exactly if, one after the other, they never write a query twice without a
        /// reset.
        #[test]
        fn split_over_command_buffers_or_not_the_rule_is_one(
            buffers in prop::collection::vec(prop::collection::vec((0..4_u32, any::<bool>()), 0..12), 0..6)
        ) {
            let mut queue = QueryResetState::new(4);
            let mut written = [false; 4];
            for steps in buffers {
                let (mut local, mut after) = (QueryResetState::new(4), written);
                let (mut refused, mut conflict) = (false, None);
                for (query, reset) in steps {
                    let place = query as usize;
                    if reset {
                        local.reset(query);
                        after[place] = false;
                    } else if !local.is_ready(query) {
                        // The write is refused during recording. The rest of the command buffer is recorded.
                        refused = true;
                        prop_assert!(after[place]);
                    } else {
                        conflict = conflict.or(after[place].then_some(query));
                        local.write(query);
                        after[place] = true;
                    }
                }
                prop_assert_eq!(queue.first_conflict(&local).is_some(), conflict.is_some(), "{} {:?}", refused, local);
                if conflict.is_none() {
                    queue.append(&local);
                    written = after;
                }
            }
        }
    }

    #[test]
    fn queries_outside_of_the_pool_are_never_ready() {
        let mut marks = QueryResetState::new(2);
        marks.write(7);
        assert!(marks.is_ready(1) && !marks.is_ready(2));
        marks.write(1);
        assert!(!marks.is_ready(1));
        marks.reset(1);
        assert!(marks.is_ready(1));
    }
}
