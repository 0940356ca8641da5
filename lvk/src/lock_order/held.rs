//! Locks that the current thread holds. Tracked with debug assertions only.

#[cfg(debug_assertions)]
pub(super) use checked::*;
#[cfg(not(debug_assertions))]
pub(super) use unchecked::*;

#[cfg(debug_assertions)]
mod checked {
    use std::cell::Cell;
    use std::fmt;

    use crate::lock_order::Rank;

    thread_local! {
        // The type has no destructor, so destructors of other thread-local variables can still take locks.
        static HELD: Cell<Ranks> = const { Cell::new(Ranks::NONE) };
    }

    /// The rank of one lock.
    #[derive(Debug, Clone, Copy)]
    pub(in crate::lock_order) struct LockPlace(Rank);

    impl LockPlace {
        pub(in crate::lock_order) const fn new(rank: Rank) -> Self {
            Self(rank)
        }
    }

    /// A set of ranks, one bit for each.
    #[derive(Clone, Copy, PartialEq, Eq)]
    pub(in crate::lock_order) struct Ranks(u64);

    impl Ranks {
        pub(in crate::lock_order) const NONE: Self = Self(0);

        pub(in crate::lock_order) const fn from_rank(rank: Rank) -> Self {
            Self(1 << rank as u8)
        }

        pub(in crate::lock_order) const fn union(self, other: Self) -> Self {
            Self(self.0 | other.0)
        }

        const fn without(self, other: Self) -> Self {
            Self(self.0 & !other.0)
        }

        /// True if a thread that holds these locks may wait for a lock of rank `next`.
        pub(in crate::lock_order) const fn may_take(self, next: Rank) -> bool {
            self.0 >> next.first_in_the_way() == 0
        }
    }

    impl fmt::Debug for Ranks {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.debug_list().entries(Rank::ALL.iter().filter(|rank| self.0 >> **rank as u8 & 1 != 0)).finish()
        }
    }

    /// A lock that this thread holds or waits for.
    pub(in crate::lock_order) struct HeldLock(Ranks);

    impl HeldLock {
        pub(in crate::lock_order) fn new(LockPlace(rank): LockPlace) -> Self {
            let held = HELD.get();
            assert!(held.may_take(rank), "the lock of {rank:?} is taken while {held:?} are held");
            HELD.set(held.union(Ranks::from_rank(rank)));
            Self(Ranks::from_rank(rank))
        }
    }

    impl Drop for HeldLock {
        fn drop(&mut self) {
            // Guards may be dropped in any order.
            HELD.set(HELD.get().without(self.0));
        }
    }

    /// Locks held by a thread that waits for other threads.
    #[derive(Debug, Clone, Copy)]
    pub(in crate::lock_order) struct HeldLocks(Ranks);

    impl HeldLocks {
        pub(in crate::lock_order) fn of_current_thread() -> Self {
            Self(HELD.get())
        }

        /// Treats the locks as held by this thread too, as long as the returned value lives.
        pub(in crate::lock_order) fn assume(self) -> Assumed {
            Assumed { before: HELD.replace(HELD.get().union(self.0)) }
        }
    }

    /// Locks of a waiting thread, treated as held by the thread that works for it.
    pub(in crate::lock_order) struct Assumed {
        before: Ranks,
    }

    impl Drop for Assumed {
        fn drop(&mut self) {
            HELD.set(self.before);
        }
    }
}

#[cfg(not(debug_assertions))]
mod unchecked {
    use crate::lock_order::Rank;

    #[derive(Debug, Clone, Copy)]
    pub(in crate::lock_order) struct LockPlace;

    impl LockPlace {
        #[inline]
        pub(in crate::lock_order) const fn new(_: Rank) -> Self {
            Self
        }
    }

    pub(in crate::lock_order) struct HeldLock;

    impl HeldLock {
        #[inline]
        pub(in crate::lock_order) fn new(_: LockPlace) -> Self {
            Self
        }
    }

    pub(in crate::lock_order) struct Assumed;

    #[derive(Debug, Clone, Copy)]
    pub(in crate::lock_order) struct HeldLocks;

    impl HeldLocks {
        #[inline]
        pub(in crate::lock_order) fn of_current_thread() -> Self {
            Self
        }

        #[inline]
        pub(in crate::lock_order) fn assume(self) -> Assumed {
            Assumed
        }
    }
}
