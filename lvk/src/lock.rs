//! Locks that are taken in one order, so that no two threads ever wait for each other. Where debug assertions are on, each
//! thread knows what it holds, and taking a lock out of order is an error: every test checks the order along its way.

use std::ops::{Deref, DerefMut};
use std::sync::{MutexGuard, PoisonError};

/// Which lock: those further down may be taken while those further up are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Rank {
    /// A swapchain.
    Swapchain,
    /// Compactions under way.
    Compactions,
    /// What runs before the next submission.
    Pending,
    /// Staging memory.
    Staging,
    /// States, command buffers and garbage of what is submitted.
    Submitter,
    /// The bindless set.
    Bindless,
    /// A queue of the device.
    Queue,
    /// Device memory.
    Memory,
}

/// A mutex with a place in the order. A thread that panicked with it does not close it to others.
#[derive(Debug)]
pub(crate) struct Mutex<T> {
    inner: std::sync::Mutex<T>,
    rank: Rank,
}

/// Access to what a [`Mutex`] holds.
pub(crate) struct Guard<'a, T> {
    inner: MutexGuard<'a, T>,
    _held: held::Held,
}

impl<T> Mutex<T> {
    pub(crate) const fn new(rank: Rank, value: T) -> Self {
        Self { inner: std::sync::Mutex::new(value), rank }
    }

    /// Waits for the lock.
    #[inline]
    pub(crate) fn lock(&self) -> Guard<'_, T> {
        let _held = held::Held::new(self.rank);
        Guard { inner: self.inner.lock().unwrap_or_else(PoisonError::into_inner), _held }
    }
}

impl<T> Deref for Guard<'_, T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        &self.inner
    }
}

impl<T> DerefMut for Guard<'_, T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.inner
    }
}

#[cfg(debug_assertions)]
mod held {
    use std::cell::RefCell;

    use super::Rank;

    thread_local! {
        static RANKS: RefCell<Vec<Rank>> = const { RefCell::new(Vec::new()) };
    }

    /// A lock that this thread has, or waits for.
    pub(super) struct Held(Rank);

    impl Held {
        pub(super) fn new(rank: Rank) -> Self {
            RANKS.with_borrow_mut(|held| {
                assert!(may_take(held, rank), "the lock of {rank:?} is taken while {held:?} are held");
                held.push(rank);
            });
            Self(rank)
        }
    }

    impl Drop for Held {
        fn drop(&mut self) {
            // Guards need not go in the order in which they came.
            RANKS.with_borrow_mut(|held| {
                if let Some(place) = held.iter().rposition(|rank| *rank == self.0) {
                    held.remove(place);
                }
            });
        }
    }

    /// Whether a thread that has these may wait for another one.
    pub(super) fn may_take(held: &[Rank], next: Rank) -> bool {
        held.iter().all(|held| *held < next)
    }
}

#[cfg(not(debug_assertions))]
mod held {
    /// Nothing is checked.
    pub(super) struct Held;

    impl Held {
        #[inline]
        pub(super) fn new(_: super::Rank) -> Self {
            Self
        }
    }
}

#[cfg(all(test, debug_assertions))]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use proptest::prelude::*;

    use super::held::may_take;
    use super::*;

    const RANKS: [Rank; 7] = [
        Rank::Compactions,
        Rank::Pending,
        Rank::Staging,
        Rank::Submitter,
        Rank::Bindless,
        Rank::Queue,
        Rank::Memory,
    ];

    #[test]
    fn locks_are_taken_in_their_order_alone() {
        let locks = RANKS.map(|rank| Mutex::new(rank, ()));
        let guards: Vec<_> = locks.iter().map(Mutex::lock).collect();
        drop(guards);
        let takes = |first: &Mutex<()>, second: &Mutex<()>| {
            catch_unwind(AssertUnwindSafe(|| {
                let _first = first.lock();
                let _second = second.lock();
            }))
            .is_ok()
        };
        for first in &locks {
            for second in &locks {
                let (a, b) = (first.rank, second.rank);
                assert_eq!(takes(first, second), a < b, "{a:?}, {b:?}");
            }
        }
    }

    /// Which lock each thread has reached in its list, and which locks are held.
    struct Threads {
        wanted: Vec<Vec<usize>>,
        held: Vec<Vec<usize>>,
    }

    impl Threads {
        /// Lets a thread take its next lock, or give all back; `false` where it has to wait.
        fn step(&mut self, thread: usize) -> bool {
            let Some(&next) = self.wanted[thread].get(self.held[thread].len()) else {
                self.held[thread].clear();
                self.wanted[thread].clear();
                return true;
            };
            if self.held.iter().any(|held| held.contains(&next)) {
                return false;
            }
            self.held[thread].push(next);
            true
        }

        fn is_done(&self) -> bool {
            self.wanted.iter().all(Vec::is_empty)
        }
    }

    proptest! {
        /// Any schedule of threads whose every step the check allows comes to its end.
        #[test]
        fn what_the_check_allows_never_stands_still(
            lists in prop::collection::vec(prop::collection::vec(0..RANKS.len(), 0..5), 1..6),
            schedule in prop::collection::vec(any::<prop::sample::Index>(), 0..60)
        ) {
            let allowed = |list: &Vec<usize>| {
                (0..list.len()).all(|place| {
                    let held: Vec<_> = list[..place].iter().map(|rank| RANKS[*rank]).collect();
                    may_take(&held, RANKS[list[place]])
                })
            };
            let wanted: Vec<_> = lists.into_iter().filter(allowed).collect();
            let mut threads = Threads { held: vec![Vec::new(); wanted.len()], wanted };
            for which in schedule {
                if !threads.wanted.is_empty() {
                    let thread = which.index(threads.wanted.len());
                    threads.step(thread);
                }
            }
            while !threads.is_done() {
                let moved = (0..threads.wanted.len())
                    .filter(|thread| !threads.wanted[*thread].is_empty())
                    .collect::<Vec<_>>()
                    .into_iter()
                    .any(|thread| threads.step(thread));
                prop_assert!(moved, "all wait: {:?} have {:?}", threads.wanted, threads.held);
            }
        }
    }
}
