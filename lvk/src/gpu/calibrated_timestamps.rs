//! The clocks of device and host, read at the same time.

use std::num::NonZeroU64;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use ash::vk;

use super::caps::features::Calibration;
use super::host_clock::{HostClock, duration_of_ticks};
use super::start::instance::Instance;
use crate::error::{Error, Result};

/// One moment on the clock of the GPU and on the clock of the host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedTimestamps {
    /// Milliseconds on the scale of [`Context::timestamps_ms`](crate::Context::timestamps_ms).
    pub gpu_ms: f64,
    /// Time of [`clock`](Self::clock) since its start. Comparable with other readings of that clock, also by other
    /// programs.
    pub host: Duration,
    /// The clock that `host` is a time of: `CLOCK_MONOTONIC` on Linux and Android, the performance counter on Windows,
    /// `mach_continuous_time` on Apple's systems.
    pub clock: HostClock,
    /// Maximum time between the two readings.
    pub deviation: Duration,
    /// The same moment as an instant, whichever clock the system counts instants by. Read with the standard library
    /// around the call of the driver.
    pub instant: Instant,
    /// Maximum distance of `instant` from the moment, beside [`deviation`](Self::deviation): half the time of the
    /// call.
    pub instant_deviation: Duration,
}

impl CalibratedTimestamps {
    /// Converts a GPU time to a time of the host's clock. Returns zero for times before the start of the
    /// host's clock and for values that are not finite. The clocks drift apart: read a new pair about every
    /// second.
    pub fn host_at(&self, gpu_ms: f64) -> Duration {
        let apart = self.time_from(gpu_ms).unwrap_or_default();
        if gpu_ms < self.gpu_ms { self.host.saturating_sub(apart) } else { self.host.saturating_add(apart) }
    }

    /// Converts a GPU time to an instant. `None` for values that are not finite, and for times that an instant cannot
    /// hold. The clocks drift apart, as for [`host_at`](Self::host_at).
    pub fn instant_at(&self, gpu_ms: f64) -> Option<Instant> {
        let apart = self.time_from(gpu_ms)?;
        if gpu_ms < self.gpu_ms { self.instant.checked_sub(apart) } else { self.instant.checked_add(apart) }
    }

    /// Returns the time between this moment and a GPU time, without its sign.
    fn time_from(&self, gpu_ms: f64) -> Option<Duration> {
        Duration::try_from_secs_f64((gpu_ms - self.gpu_ms).abs() * 1e-3).ok()
    }
}

/// Reads the clocks of device and host together.
pub(crate) struct ClockReader {
    physical: vk::PhysicalDevice,
    functions: Functions,
    /// The host's clock and the ticks of its second, once the driver has said which clocks it reads; inside, `None` without any.
    clock: OnceLock<Option<(HostClock, NonZeroU64)>>,
}

enum Functions {
    Ext(ash::ext::calibrated_timestamps::Instance, ash::ext::calibrated_timestamps::Device),
    Khr(ash::khr::calibrated_timestamps::Instance, ash::khr::calibrated_timestamps::Device),
}

/// The object in errors.
const CLOCKS: &str = "clocks of device and host";

impl ClockReader {
    /// `None` without an extension of such clocks.
    pub(crate) fn new(
        instance: &Instance,
        device: &ash::Device,
        physical: vk::PhysicalDevice,
        calibration: Calibration,
    ) -> Option<Self> {
        let (entry, raw) = (&instance.entry, &instance.raw);
        let functions = match calibration {
            Calibration::None => return None,
            Calibration::Ext => Functions::Ext(
                ash::ext::calibrated_timestamps::Instance::new(entry, raw),
                ash::ext::calibrated_timestamps::Device::new(raw, device),
            ),
            Calibration::Khr => Functions::Khr(
                ash::khr::calibrated_timestamps::Instance::new(entry, raw),
                ash::khr::calibrated_timestamps::Device::new(raw, device),
            ),
        };
        Some(Self { physical, functions, clock: OnceLock::new() })
    }

    /// Returns the host's clock and the ticks of its second. A failed question is asked again by the next call.
    fn clock(&self) -> Result<(HostClock, NonZeroU64)> {
        let clock = match self.clock.get() {
            Some(clock) => *clock,
            None => {
                let clock = HostClock::choose(&self.domains()?);
                *self.clock.get_or_init(|| Some((clock?, clock?.frequency()?)))
            }
        };
        clock.ok_or_else(|| {
            Error::unsupported(CLOCKS, "the driver reads no clock of the host that this system has")
        })
    }

    /// Returns the clocks that the driver reads.
    fn domains(&self) -> Result<Vec<vk::TimeDomainKHR>> {
        let physical = self.physical;
        // SAFETY: the physical device belongs to the instance and has the extension.
        let (found, command) = unsafe {
            match &self.functions {
                Functions::Ext(instance, _) => (
                    instance.get_physical_device_calibrateable_time_domains(physical),
                    "vkGetPhysicalDeviceCalibrateableTimeDomainsEXT",
                ),
                Functions::Khr(instance, _) => (
                    instance.get_physical_device_calibrateable_time_domains(physical),
                    "vkGetPhysicalDeviceCalibrateableTimeDomainsKHR",
                ),
            }
        };
        found.map_err(Error::vulkan(command, CLOCKS))
    }

    /// Reads both clocks; `milliseconds` converts ticks of the device.
    pub(crate) fn read(&self, milliseconds: impl FnOnce(u64) -> f64) -> Result<CalibratedTimestamps> {
        let (clock, frequency) = self.clock()?;
        let before = Instant::now();
        let (device, host, deviation) = self.read_ticks(clock)?;
        let half = before.elapsed() / 2;
        Ok(CalibratedTimestamps {
            gpu_ms: milliseconds(device),
            host: duration_of_ticks(host, frequency),
            clock,
            deviation: Duration::from_nanos(deviation),
            instant: before + half,
            instant_deviation: half,
        })
    }

    /// Returns the ticks of the device's clock at this moment.
    #[cfg(feature = "tracy")]
    pub(crate) fn device_ticks(&self) -> Result<u64> {
        Ok(self.read_ticks(self.clock()?.0)?.0)
    }

    /// Returns the ticks of the device, those of the host, and the maximum deviation in nanoseconds.
    fn read_ticks(&self, clock: HostClock) -> Result<(u64, u64, u64)> {
        let infos = [vk::TimeDomainKHR::DEVICE, clock.domain()]
            .map(|domain| vk::CalibratedTimestampInfoKHR::default().time_domain(domain));
        // SAFETY: the device has the extension and both domains.
        let (read, command) = unsafe {
            match &self.functions {
                Functions::Ext(_, device) => {
                    (device.get_calibrated_timestamps(&infos), "vkGetCalibratedTimestampsEXT")
                }
                Functions::Khr(_, device) => {
                    (device.get_calibrated_timestamps(&infos), "vkGetCalibratedTimestampsKHR")
                }
            }
        };
        let (values, deviation) = read.map_err(Error::vulkan(command, CLOCKS))?;
        Ok((values[0], values[1], deviation))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pair() -> CalibratedTimestamps {
        CalibratedTimestamps {
            gpu_ms: 500.0,
            host: Duration::from_millis(7),
            clock: HostClock::Monotonic,
            deviation: Duration::ZERO,
            instant: Instant::now(),
            instant_deviation: Duration::ZERO,
        }
    }

    #[test]
    fn times_are_carried_over_in_both_directions() {
        let pair = pair();
        assert_eq!(pair.host_at(502.5), Duration::from_micros(9_500));
        assert_eq!(pair.host_at(499.0), Duration::from_millis(6));
        assert_eq!(pair.host_at(0.0), Duration::ZERO);
        assert_eq!(pair.host_at(f64::NAN), pair.host);
        assert_eq!(pair.instant_at(500.0), Some(pair.instant));
        assert_eq!(pair.instant_at(502.5), Some(pair.instant + Duration::from_micros(2_500)));
        assert_eq!(pair.instant_at(499.0), Some(pair.instant - Duration::from_millis(1)));
        for outside in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e30, -1e30] {
            assert_eq!(pair.instant_at(outside), None, "{outside}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Both scales have the same distances, and no number of the GPU is too large for either.
        #[test]
        fn instants_and_host_times_agree(gpu_ms in prop_oneof![any::<f64>(), -1e3..1e6_f64]) {
            let pair = CalibratedTimestamps { host: Duration::from_secs(10), ..pair() };
            let host = pair.host_at(gpu_ms);
            if let Some(instant) = pair.instant_at(gpu_ms)
                && gpu_ms > -9e3
            {
                let later = instant.saturating_duration_since(pair.instant);
                let earlier = pair.instant.saturating_duration_since(instant);
                prop_assert_eq!(host + earlier, pair.host + later);
            }
        }
    }
}
