//! The scale of timestamps: conversion of ticks to times, and differences of ticks.

use super::caps::capabilities::Capabilities;
use super::caps::queues::shared_timestamp_bits;
use crate::queue::Queue;

/// Period and width of the device's timestamp counter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimestampScale {
    period_ns: f64,
    /// Valid bits of timestamps of the graphics queue.
    mask: u64,
    /// Bits that timestamps of all queues have.
    shared_mask: u64,
}

impl TimestampScale {
    pub(crate) fn new(caps: &Capabilities) -> Self {
        let bits = Queue::ALL.map(|queue| caps.queue(queue).timestamp_bits);
        Self {
            period_ns: caps.limits.timestamp_period_ns.into(),
            mask: u64::MAX >> (64 - caps.limits.timestamp_bits.clamp(1, 64)),
            shared_mask: shared_timestamp_bits(bits),
        }
    }

    /// Converts timestamp ticks to milliseconds since an arbitrary start.
    pub(crate) fn milliseconds(&self, ticks: u64) -> f64 {
        (ticks & self.mask) as f64 * self.period_ns * 1e-6
    }

    /// Returns the ticks from `earlier` to `later`, which may come from different queues. The counter may
    /// wrap once in between.
    pub(crate) fn ticks_since(&self, earlier: u64, later: u64) -> u64 {
        later.wrapping_sub(earlier) & self.shared_mask
    }

    /// Returns the ticks from `earlier` to `later`, which may come from different queues. `None` if `later`
    /// is not later.
    pub(crate) fn ticks_until(&self, earlier: u64, later: u64) -> Option<u64> {
        let (ticks, back) = (self.ticks_since(earlier, later), self.ticks_since(later, earlier));
        (ticks > 0 && ticks <= back).then_some(ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: TimestampScale = TimestampScale { period_ns: 10.0, mask: 0xfff, shared_mask: 0xff };

    #[test]
    fn ticks_become_milliseconds_without_the_invalid_bits() {
        assert_eq!(SCALE.milliseconds(0x1_0064), 1e-3);
    }

    #[test]
    fn differences_cross_the_end_of_the_counter() {
        assert_eq!(SCALE.ticks_since(0xfe, 0x101), 3);
        assert_eq!((SCALE.ticks_until(0xfe, 0x01), SCALE.ticks_until(0x01, 0xfe)), (Some(3), None));
        assert_eq!(SCALE.ticks_until(7, 7), None);
    }
}
