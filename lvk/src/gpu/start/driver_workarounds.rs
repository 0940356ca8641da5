//! Serialises Vulkan calls that a driver or the loader cannot run concurrently, across all devices of the process.
//!
//! NVIDIA's driver (580.159.04) deadlocks if one thread creates or destroys a device while another thread
//! creates or destroys a ray tracing pipeline. Each thread then waits for a driver lock that the other one
//! holds. On that driver, creation and destruction of a device therefore exclude both.
//!
//! The loader (1.3.239) searches its list of all devices of all instances in `vkSetDebugUtilsObjectNameEXT` and
//! `vkCreateSwapchainKHR`, and takes no lock for the devices in it. If another thread destroys a device at that time, the
//! search reads freed memory. Creation and destruction of devices and instances therefore exclude both calls.

use ash::vk;

use crate::lock_order::{Rank, RwLock};

static DEVICE_LIFETIME: RwLock<()> = RwLock::new(Rank::DeviceLifetime, ());

static LOADER_LISTS: RwLock<()> = RwLock::new(Rank::LoaderLists, ());

/// Runs `change`, which creates or destroys a device of this driver, under both exclusive locks.
pub(crate) fn with_exclusive_device_lock<R>(driver: vk::DriverId, change: impl FnOnce() -> R) -> R {
    let _alone = needs_device_lock(driver).then(|| DEVICE_LIFETIME.write());
    with_exclusive_loader_lock(change)
}

/// Runs `change`, which creates or destroys a ray tracing pipeline of this driver, under the shared lock.
pub(crate) fn with_shared_device_lock<R>(driver: vk::DriverId, change: impl FnOnce() -> R) -> R {
    let _beside_others = needs_device_lock(driver).then(|| DEVICE_LIFETIME.read());
    change()
}

/// Runs `change`, which creates or destroys an instance or a device, while no thread searches the loader's lists.
pub(crate) fn with_exclusive_loader_lock<R>(change: impl FnOnce() -> R) -> R {
    let _alone = LOADER_LISTS.write();
    change()
}

/// Runs `search`, a call in which the loader searches its lists, while no instance or device is created or destroyed.
pub(crate) fn with_shared_loader_lock<R>(search: impl FnOnce() -> R) -> R {
    let _beside_others = LOADER_LISTS.read();
    search()
}

/// True if the driver needs the lock. With debug assertions every driver takes it, so that tests check the
/// lock order everywhere.
fn needs_device_lock(driver: vk::DriverId) -> bool {
    cfg!(debug_assertions) || driver == vk::DriverId::NVIDIA_PROPRIETARY
}

#[cfg(test)]
#[expect(clippy::disallowed_types, reason = "a lock between tests has no order among those of the library")]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::sync::{Barrier, Mutex, PoisonError};
    use std::thread;

    use super::*;

    const NVIDIA: vk::DriverId = vk::DriverId::NVIDIA_PROPRIETARY;

    /// Held by tests of the lock of devices: where a thread of another test waits to write, a second reader waits behind that
    /// thread, and would never meet the first.
    static ONE_TEST: Mutex<()> = Mutex::new(());

    #[test]
    fn pipelines_are_made_side_by_side() {
        let _alone = ONE_TEST.lock().unwrap_or_else(PoisonError::into_inner);
        let together = Barrier::new(2);
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| with_shared_device_lock(NVIDIA, || together.wait()));
            }
        });
    }

    /// A call under a shared lock, which another one must not meet.
    struct SharedCall(AtomicU32);

    impl SharedCall {
        fn run(&self) {
            self.0.fetch_add(1, Ordering::SeqCst);
            thread::yield_now();
            self.0.fetch_sub(1, Ordering::SeqCst);
        }

        fn running(&self) -> u32 {
            self.0.load(Ordering::SeqCst)
        }
    }

    /// Asserts that none of three threads is inside of a call by `shared` when `exclusive` counts the calls.
    fn assert_excluded(shared: impl Fn(&SharedCall) + Sync, exclusive: impl Fn(&SharedCall) -> u32) {
        let call = SharedCall(AtomicU32::new(0));
        thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| (0..500).for_each(|_| shared(&call)));
            }
            for _ in 0..500 {
                assert_eq!(exclusive(&call), 0);
            }
        });
    }

    #[test]
    fn no_list_is_searched_while_a_device_or_an_instance_comes_or_goes() {
        let _alone = ONE_TEST.lock().unwrap_or_else(PoisonError::into_inner);
        let search = |call: &SharedCall| with_shared_loader_lock(|| call.run());
        assert_excluded(search, |call| with_exclusive_loader_lock(|| call.running()));
        assert_excluded(search, |call| with_exclusive_device_lock(NVIDIA, || call.running()));
    }

    #[test]
    fn no_pipeline_is_made_while_a_device_comes_or_goes() {
        let _alone = ONE_TEST.lock().unwrap_or_else(PoisonError::into_inner);
        assert_excluded(
            |call| with_shared_device_lock(NVIDIA, || call.run()),
            |call| with_exclusive_device_lock(NVIDIA, || call.running()),
        );
    }
}
