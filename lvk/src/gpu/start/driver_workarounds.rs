//! What must not happen at once, on whatever devices of the process.
//!
//! NVIDIA's driver (580.159.04) locks up where one thread makes or destroys a device and another one makes or destroys a ray
//! tracing pipeline: each waits for a lock of the driver that the other one has. So there devices come and go alone.

use ash::vk;

use crate::lock_order::{Rank, RwLock};

static DEVICE_LIFETIME: RwLock<()> = RwLock::new(Rank::DeviceLifetime, ());

/// Makes or destroys a device of this driver.
pub(crate) fn with_exclusive_device_lock<R>(driver: vk::DriverId, change: impl FnOnce() -> R) -> R {
    let _alone = needs_device_lock(driver).then(|| DEVICE_LIFETIME.write());
    change()
}

/// Makes or destroys a ray tracing pipeline of this driver.
pub(crate) fn with_shared_device_lock<R>(driver: vk::DriverId, change: impl FnOnce() -> R) -> R {
    let _beside_others = needs_device_lock(driver).then(|| DEVICE_LIFETIME.read());
    change()
}

/// Where debug assertions are on, any driver: so tests see on each that the lock is taken in its order.
fn needs_device_lock(driver: vk::DriverId) -> bool {
    cfg!(debug_assertions) || driver == vk::DriverId::NVIDIA_PROPRIETARY
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::thread;

    use super::*;

    const NVIDIA: vk::DriverId = vk::DriverId::NVIDIA_PROPRIETARY;

    #[test]
    fn pipelines_are_made_side_by_side() {
        let together = Barrier::new(2);
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| with_shared_device_lock(NVIDIA, || together.wait()));
            }
        });
    }

    #[test]
    fn no_pipeline_is_made_while_a_device_comes_or_goes() {
        let made = AtomicU32::new(0);
        let make = || {
            made.fetch_add(1, Ordering::SeqCst);
            thread::yield_now();
            made.fetch_sub(1, Ordering::SeqCst);
        };
        thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| (0..500).for_each(|_| with_shared_device_lock(NVIDIA, make)));
            }
            for _ in 0..500 {
                assert_eq!(with_exclusive_device_lock(NVIDIA, || made.load(Ordering::SeqCst)), 0);
            }
        });
    }
}
