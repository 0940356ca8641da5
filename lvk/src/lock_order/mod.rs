//! Locks that are taken in one order, so that no two threads ever wait for each other. Where debug assertions are on, each
//! thread knows what it holds, and taking a lock out of order is an error: every test checks the order along its way.
//! Otherwise these are the locks of the standard library, which are used nowhere else.
//!
//! A `OnceLock` is a lock only while it is initialised. Those of the library are made of values that exist by then, or by a
//! question to the driver, and so take no lock but that of [`Rank::ValidationMessages`]; keep it so.

#![expect(clippy::disallowed_types, reason = "everybody else is to use these")]

mod held;
mod rank;
#[cfg(all(test, debug_assertions))]
mod tests;

use std::ops::{Deref, DerefMut};
use std::sync::{MutexGuard, PoisonError, RwLockReadGuard, RwLockWriteGuard};

use held::{HeldLock, LockPlace};

pub(crate) use rank::Rank;

/// A mutex with a place in the order. A thread that panicked with it does not close it to others.
#[derive(Debug)]
pub(crate) struct Mutex<T> {
    inner: std::sync::Mutex<T>,
    rank: LockPlace,
}

/// Access to what a [`Mutex`] holds.
pub(crate) struct Guard<'a, T> {
    inner: MutexGuard<'a, T>,
    _held: HeldLock,
}

impl<T> Mutex<T> {
    pub(crate) const fn new(rank: Rank, value: T) -> Self {
        Self { inner: std::sync::Mutex::new(value), rank: LockPlace::new(rank) }
    }

    /// Waits for the lock.
    #[inline]
    pub(crate) fn lock(&self) -> Guard<'_, T> {
        let _held = HeldLock::new(self.rank);
        Guard { inner: self.inner.lock().unwrap_or_else(PoisonError::into_inner), _held }
    }

    /// What nobody else can have.
    pub(crate) fn get_mut(&mut self) -> &mut T {
        self.inner.get_mut().unwrap_or_else(PoisonError::into_inner)
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

/// A lock for many readers or one writer, with a place in the order. A thread that panicked with it does not close it to
/// others.
#[derive(Debug)]
pub(crate) struct RwLock<T> {
    inner: std::sync::RwLock<T>,
    rank: LockPlace,
}

/// Shared access to what an [`RwLock`] holds.
pub(crate) struct ReadGuard<'a, T> {
    inner: RwLockReadGuard<'a, T>,
    _held: HeldLock,
}

/// Access to what an [`RwLock`] holds.
pub(crate) struct WriteGuard<'a, T> {
    inner: RwLockWriteGuard<'a, T>,
    _held: HeldLock,
}

impl<T> RwLock<T> {
    pub(crate) const fn new(rank: Rank, value: T) -> Self {
        Self { inner: std::sync::RwLock::new(value), rank: LockPlace::new(rank) }
    }

    /// Waits until nobody writes.
    #[inline]
    pub(crate) fn read(&self) -> ReadGuard<'_, T> {
        let _held = HeldLock::new(self.rank);
        ReadGuard { inner: self.inner.read().unwrap_or_else(PoisonError::into_inner), _held }
    }

    /// Waits until nobody reads or writes.
    #[inline]
    pub(crate) fn write(&self) -> WriteGuard<'_, T> {
        let _held = HeldLock::new(self.rank);
        WriteGuard { inner: self.inner.write().unwrap_or_else(PoisonError::into_inner), _held }
    }
}

impl<T> Deref for ReadGuard<'_, T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        &self.inner
    }
}

impl<T> Deref for WriteGuard<'_, T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        &self.inner
    }
}

impl<T> DerefMut for WriteGuard<'_, T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.inner
    }
}

/// What a thread holds while it waits for threads that work for it: locks that these must not wait for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldLocks(held::HeldLocks);

impl HeldLocks {
    /// Of this thread.
    #[inline]
    pub(crate) fn of_current_thread() -> Self {
        Self(held::HeldLocks::of_current_thread())
    }

    /// Works for the one who waits.
    #[inline]
    pub(crate) fn run_with<R>(self, work: impl FnOnce() -> R) -> R {
        let _assumed = self.0.assume();
        work()
    }
}

/// Without the check, locks and guards are what they are made of.
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
