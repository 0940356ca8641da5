//! Locks with a fixed order, which prevents deadlocks between threads.
//!
//! With debug assertions, each thread records the locks that it holds, and taking a lock out of order panics.
//! So every test checks the order on its code path. Without debug assertions these are the locks of the
//! standard library, which are used nowhere else.
//!
//! A `OnceLock` is a lock only during its initialisation. The library initialises them from values that
//! already exist, or by a query to the driver. Their initialisation therefore takes no lock except that of
//! [`Rank::ValidationMessages`], and this must stay so.

#![expect(clippy::disallowed_types, reason = "other modules must use these")]

mod held;
mod rank;
#[cfg(all(test, debug_assertions))]
mod tests;

use std::ops::{Deref, DerefMut};
use std::sync::{MutexGuard, PoisonError, RwLockReadGuard, RwLockWriteGuard};

use held::{HeldLock, LockPlace};

pub(crate) use rank::Rank;

/// A mutex with a rank in the lock order. It is not poisoned if a thread panics while it holds the lock.
#[derive(Debug)]
pub(crate) struct Mutex<T> {
    inner: std::sync::Mutex<T>,
    rank: LockPlace,
}

impl<T> Mutex<T> {
    pub(crate) const fn new(rank: Rank, value: T) -> Self {
        Self { inner: std::sync::Mutex::new(value), rank: LockPlace::new(rank) }
    }

    /// Waits for the lock.
    #[inline]
    pub(crate) fn lock(&self) -> Guard<'_, T> {
        let _held = HeldLock::new(self.rank);
        RankedGuard { inner: self.inner.lock().unwrap_or_else(PoisonError::into_inner), _held }
    }

    /// Returns the value without locking, by unique access.
    pub(crate) fn get_mut(&mut self) -> &mut T {
        self.inner.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A read-write lock with a rank in the lock order. It is not poisoned if a thread panics while it holds the
/// lock.
#[derive(Debug)]
pub(crate) struct RwLock<T> {
    inner: std::sync::RwLock<T>,
    rank: LockPlace,
}

impl<T> RwLock<T> {
    pub(crate) const fn new(rank: Rank, value: T) -> Self {
        Self { inner: std::sync::RwLock::new(value), rank: LockPlace::new(rank) }
    }

    /// Waits until no thread holds the lock for writing.
    #[inline]
    pub(crate) fn read(&self) -> ReadGuard<'_, T> {
        let _held = HeldLock::new(self.rank);
        RankedGuard { inner: self.inner.read().unwrap_or_else(PoisonError::into_inner), _held }
    }

    /// Waits until no thread holds the lock.
    #[inline]
    pub(crate) fn write(&self) -> WriteGuard<'_, T> {
        let _held = HeldLock::new(self.rank);
        RankedGuard { inner: self.inner.write().unwrap_or_else(PoisonError::into_inner), _held }
    }
}

/// Access to the value of a lock, by the guard `G` of the standard library.
pub(crate) struct RankedGuard<G> {
    inner: G,
    _held: HeldLock,
}

/// Access to the value of a [`Mutex`].
pub(crate) type Guard<'a, T> = RankedGuard<MutexGuard<'a, T>>;
/// Shared access to the value of an [`RwLock`].
pub(crate) type ReadGuard<'a, T> = RankedGuard<RwLockReadGuard<'a, T>>;
/// Exclusive access to the value of an [`RwLock`].
pub(crate) type WriteGuard<'a, T> = RankedGuard<RwLockWriteGuard<'a, T>>;

impl<G: Deref> Deref for RankedGuard<G> {
    type Target = G::Target;

    #[inline]
    fn deref(&self) -> &G::Target {
        &self.inner
    }
}

impl<G: DerefMut> DerefMut for RankedGuard<G> {
    #[inline]
    fn deref_mut(&mut self) -> &mut G::Target {
        &mut self.inner
    }
}

/// Locks held by a thread that waits for worker threads. The workers must not wait for these locks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldLocks(held::HeldLocks);

impl HeldLocks {
    /// Returns the locks of the current thread.
    #[inline]
    pub(crate) fn of_current_thread() -> Self {
        Self(held::HeldLocks::of_current_thread())
    }

    /// Runs `work` on behalf of the waiting thread.
    #[inline]
    pub(crate) fn run_with<R>(self, work: impl FnOnce() -> R) -> R {
        let _assumed = self.0.assume();
        work()
    }
}

/// Without the check, locks and guards have the size of the standard types.
#[cfg(not(debug_assertions))]
const _: () = {
    use std::mem::{needs_drop, size_of};

    assert!(size_of::<Mutex<u64>>() == size_of::<std::sync::Mutex<u64>>());
    assert!(size_of::<RwLock<u64>>() == size_of::<std::sync::RwLock<u64>>());
    assert!(size_of::<Guard<'_, u64>>() == size_of::<MutexGuard<'_, u64>>());
    assert!(size_of::<ReadGuard<'_, u64>>() == size_of::<RwLockReadGuard<'_, u64>>());
    assert!(size_of::<WriteGuard<'_, u64>>() == size_of::<RwLockWriteGuard<'_, u64>>());
    assert!(size_of::<HeldLocks>() == 0 && !needs_drop::<HeldLock>() && !needs_drop::<HeldLocks>());
};
