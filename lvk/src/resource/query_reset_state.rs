//! Which queries of a pool may be written: each once after it was reset.

/// The query was written before it was reset here: it must be ready before the command buffer.
const NEEDED: u8 = 1;
/// It was reset last.
const RESET: u8 = 2;
/// It was written last.
const WRITTEN: u8 = 4;

/// What one command buffer does to the queries of one pool, or what all submitted ones have done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct QueryResetState(Vec<u8>);

impl QueryResetState {
    /// Nothing was done to `count` queries.
    pub(crate) fn new(count: u32) -> Self {
        Self(vec![0; count as usize])
    }

    /// Whether the query may be written, as far as is known here.
    pub(crate) fn is_ready(&self, query: u32) -> bool {
        self.0.get(query as usize).is_some_and(|mark| mark & WRITTEN == 0)
    }

    /// The query is written.
    pub(crate) fn write(&mut self, query: u32) {
        if let Some(mark) = self.0.get_mut(query as usize) {
            let needed = if *mark & RESET == 0 { NEEDED } else { 0 };
            *mark = (*mark & NEEDED) | needed | WRITTEN;
        }
    }

    /// The query is reset.
    pub(crate) fn reset(&mut self, query: u32) {
        if let Some(mark) = self.0.get_mut(query as usize) {
            *mark = (*mark & NEEDED) | RESET;
        }
    }

    /// The first query that `next`, which runs after this, writes although it was written and not reset.
    pub(crate) fn first_conflict(&self, next: &Self) -> Option<u32> {
        let mut pairs = self.0.iter().zip(&next.0);
        let place = pairs.position(|(before, after)| before & WRITTEN != 0 && after & NEEDED != 0);
        place.map(|place| place as u32)
    }

    /// `next` runs after this.
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
        /// Command buffers are accepted exactly where one after the other never writes a query twice without a reset.
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
                        // Refused while it is recorded: the rest of the command buffer goes on.
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
    fn what_is_outside_of_the_pool_is_never_ready() {
        let mut marks = QueryResetState::new(2);
        marks.write(7);
        assert!(marks.is_ready(1) && !marks.is_ready(2));
        marks.write(1);
        assert!(!marks.is_ready(1));
        marks.reset(1);
        assert!(marks.is_ready(1));
    }
}
