//! The clocks of device and host, read at the same time.

use std::time::Duration;

use ash::vk;

use super::caps::features::Calibration;
use super::start::instance::Instance;
use crate::error::{Error, Result};

/// One instant on the clock of the GPU and on the clock of the host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedTimestamps {
    /// Milliseconds on the scale of [`Context::timestamps_ms`](crate::Context::timestamps_ms).
    pub gpu_ms: f64,
    /// Time of the host's `CLOCK_MONOTONIC`, which [`Instant`](std::time::Instant) counts on Linux.
    pub host: Duration,
    /// Maximum time between the two readings.
    pub deviation: Duration,
}

impl CalibratedTimestamps {
    /// Converts a GPU time to a time of the host's clock. Returns zero for times before the start of the
    /// host's clock and for values that are not finite. The clocks drift apart: read a new pair about every
    /// second.
    pub fn host_at(&self, gpu_ms: f64) -> Duration {
        let apart = Duration::try_from_secs_f64((gpu_ms - self.gpu_ms).abs() * 1e-3).unwrap_or_default();
        if gpu_ms < self.gpu_ms { self.host.saturating_sub(apart) } else { self.host.saturating_add(apart) }
    }
}

/// Reads both clocks.
pub(crate) enum HostClock {
    Ext(ash::ext::calibrated_timestamps::Device),
    Khr(ash::khr::calibrated_timestamps::Device),
}

impl HostClock {
    /// `None` if the device or the driver cannot read both clocks, or supports only another host clock.
    pub(crate) fn new(
        instance: &Instance,
        device: &ash::Device,
        physical: vk::PhysicalDevice,
        calibration: Calibration,
    ) -> Option<Self> {
        let (entry, raw) = (&instance.entry, &instance.raw);
        let (clock, domains) = match calibration {
            Calibration::None => return None,
            Calibration::Ext => {
                let ext = ash::ext::calibrated_timestamps::Instance::new(entry, raw);
                // SAFETY: the physical device belongs to the instance and has the extension.
                let domains = unsafe { ext.get_physical_device_calibrateable_time_domains(physical) };
                (Self::Ext(ash::ext::calibrated_timestamps::Device::new(raw, device)), domains)
            }
            Calibration::Khr => {
                let khr = ash::khr::calibrated_timestamps::Instance::new(entry, raw);
                // SAFETY: as above.
                let domains = unsafe { khr.get_physical_device_calibrateable_time_domains(physical) };
                (Self::Khr(ash::khr::calibrated_timestamps::Device::new(raw, device)), domains)
            }
        };
        let domains = domains.unwrap_or_default();
        let needed = [vk::TimeDomainKHR::DEVICE, vk::TimeDomainKHR::CLOCK_MONOTONIC];
        needed.iter().all(|domain| domains.contains(domain)).then_some(clock)
    }

    /// Returns the ticks of the device, the nanoseconds of the host, and the maximum deviation in
    /// nanoseconds.
    pub(crate) fn read(&self) -> Result<(u64, u64, u64)> {
        let infos = [vk::TimeDomainKHR::DEVICE, vk::TimeDomainKHR::CLOCK_MONOTONIC]
            .map(|domain| vk::CalibratedTimestampInfoKHR::default().time_domain(domain));
        // SAFETY: the device has the extension and both domains.
        let read = unsafe {
            match self {
                Self::Ext(device) => device.get_calibrated_timestamps(&infos),
                Self::Khr(device) => device.get_calibrated_timestamps(&infos),
            }
        };
        let (values, deviation) = read.map_err(Error::vulkan("vkGetCalibratedTimestamps"))?;
        Ok((values[0], values[1], deviation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_carried_over_in_both_directions() {
        let pair =
            CalibratedTimestamps { gpu_ms: 500.0, host: Duration::from_millis(7), deviation: Duration::ZERO };
        assert_eq!(pair.host_at(502.5), Duration::from_micros(9_500));
        assert_eq!(pair.host_at(499.0), Duration::from_millis(6));
        assert_eq!(pair.host_at(0.0), Duration::ZERO);
        assert_eq!(pair.host_at(f64::NAN), pair.host);
    }
}
