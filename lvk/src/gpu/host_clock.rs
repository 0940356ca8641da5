//! The clock of the host that a device reads together with its own, and its unit.

use std::num::NonZeroU64;
use std::time::Duration;

use ash::vk;

/// Ticks of a second of the clocks that count nanoseconds.
const NANOSECONDS: NonZeroU64 = NonZeroU64::new(1_000_000_000).unwrap();

/// A clock of the host, as [`CalibratedTimestamps::host`](crate::CalibratedTimestamps::host) reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum HostClock {
    /// `CLOCK_MONOTONIC` (`VK_TIME_DOMAIN_CLOCK_MONOTONIC_KHR`): the clock of [`Instant`](std::time::Instant) on Linux
    /// and Android.
    Monotonic,
    /// `CLOCK_MONOTONIC_RAW` (`VK_TIME_DOMAIN_CLOCK_MONOTONIC_RAW_KHR`), which no time service adjusts. MoltenVK calls
    /// its only host clock so: the nanoseconds of `mach_continuous_time`, which counts while the machine sleeps.
    /// [`Instant`](std::time::Instant) counts another clock: on macOS and iOS it is `CLOCK_UPTIME_RAW`, which does not.
    MonotonicRaw,
    /// `QueryPerformanceCounter` (`VK_TIME_DOMAIN_QUERY_PERFORMANCE_COUNTER_KHR`): the clock of
    /// [`Instant`](std::time::Instant) on Windows.
    PerformanceCounter,
}

/// Clocks of the host, best first: that of [`Instant`](std::time::Instant), where the system has it, is the first.
const PREFERENCE: [HostClock; 3] =
    [HostClock::Monotonic, HostClock::PerformanceCounter, HostClock::MonotonicRaw];

impl HostClock {
    /// Chooses from the time domains that a device can read together. `None` without a domain of the device, or
    /// without one of the host.
    pub(crate) fn choose(domains: &[vk::TimeDomainKHR]) -> Option<Self> {
        let has = |domain| domains.contains(&domain);
        PREFERENCE.into_iter().find(|clock| has(vk::TimeDomainKHR::DEVICE) && has(clock.domain()))
    }

    /// Returns the time domain.
    pub(crate) fn domain(self) -> vk::TimeDomainKHR {
        match self {
            Self::Monotonic => vk::TimeDomainKHR::CLOCK_MONOTONIC,
            Self::MonotonicRaw => vk::TimeDomainKHR::CLOCK_MONOTONIC_RAW,
            Self::PerformanceCounter => vk::TimeDomainKHR::QUERY_PERFORMANCE_COUNTER,
        }
    }

    /// Returns the ticks of a second; `None` if this system has no such clock.
    pub(crate) fn frequency(self) -> Option<NonZeroU64> {
        match self {
            Self::Monotonic | Self::MonotonicRaw => Some(NANOSECONDS),
            Self::PerformanceCounter => performance_counter_frequency(),
        }
    }
}

/// Converts ticks to the time since the clock's start, rounded down to nanoseconds.
pub(crate) fn duration_of_ticks(ticks: u64, per_second: NonZeroU64) -> Duration {
    let nanoseconds =
        u128::from(ticks % per_second) * u128::from(NANOSECONDS.get()) / u128::from(per_second.get());
    // Less than a second.
    Duration::new(ticks / per_second, nanoseconds as u32)
}

/// Asks Windows for the ticks of a second, a number that stands still while the system runs.
#[cfg(windows)]
fn performance_counter_frequency() -> Option<NonZeroU64> {
    #[link(name = "kernel32")]
    unsafe extern "system" {
        fn QueryPerformanceFrequency(frequency: *mut i64) -> i32;
    }
    let mut frequency = 0;
    // SAFETY: the function writes one integer of 64 bits.
    let is_known = unsafe { QueryPerformanceFrequency(&raw mut frequency) } != 0;
    is_known.then(|| u64::try_from(frequency).ok().and_then(NonZeroU64::new)).flatten()
}

/// Only Windows has this counter.
#[cfg(not(windows))]
fn performance_counter_frequency() -> Option<NonZeroU64> {
    None
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const DEVICE: vk::TimeDomainKHR = vk::TimeDomainKHR::DEVICE;

    #[test]
    fn each_platform_gets_the_clock_of_instants_where_its_drivers_have_that() {
        let monotonic = HostClock::Monotonic.domain();
        let (raw, counter) = (HostClock::MonotonicRaw.domain(), HostClock::PerformanceCounter.domain());
        for (domains, chosen) in [
            (&[DEVICE, monotonic, raw][..], Some(HostClock::Monotonic)),
            (&[raw, monotonic, DEVICE], Some(HostClock::Monotonic)),
            (&[DEVICE, counter], Some(HostClock::PerformanceCounter)),
            (&[DEVICE, raw], Some(HostClock::MonotonicRaw)),
            (&[DEVICE, raw, counter], Some(HostClock::PerformanceCounter)),
            (&[DEVICE], None),
            (&[monotonic, raw, counter], None),
            (&[DEVICE, vk::TimeDomainKHR::from_raw(77)], None),
            (&[], None),
        ] {
            assert_eq!(HostClock::choose(domains), chosen, "{domains:?}");
        }
    }

    #[test]
    fn clocks_of_this_system_have_a_unit() {
        assert_eq!(HostClock::Monotonic.frequency(), Some(NANOSECONDS));
        assert_eq!(HostClock::MonotonicRaw.frequency(), Some(NANOSECONDS));
        assert_eq!(HostClock::PerformanceCounter.frequency().is_some(), cfg!(windows));
    }

    #[test]
    fn ticks_become_time() {
        let of = |ticks, per_second| duration_of_ticks(ticks, NonZeroU64::new(per_second).unwrap());
        assert_eq!(of(123_456_789_012, 10_000_000), Duration::new(12_345, 678_901_200));
        assert_eq!(of(u64::MAX, NANOSECONDS.get()), Duration::from_nanos(u64::MAX));
        assert_eq!(of(u64::MAX, 1), Duration::from_secs(u64::MAX));
        assert_eq!(of(u64::MAX, u64::MAX), Duration::from_secs(1));
        assert_eq!(of(2, 3), Duration::from_nanos(666_666_666));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_tick_is_lost_or_overflows(ticks: u64, per_second in 1..=u64::MAX, more in 0..1_000_u64) {
            let per_second = NonZeroU64::new(per_second).unwrap();
            let time = duration_of_ticks(ticks, per_second);
            // The remainder of the exact quotient is less than one nanosecond.
            let whole = u128::from(ticks) * 1_000_000_000;
            prop_assert_eq!(time.as_nanos(), whole / u128::from(per_second.get()));
            prop_assert!(duration_of_ticks(ticks.saturating_add(more), per_second) >= time);
        }
    }
}
