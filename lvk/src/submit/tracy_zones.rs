//! GPU zones for Tracy, from the timestamps of finished command buffers.

use std::time::{Duration, Instant};

use tracy_client::{Client, GpuContext, GpuContextType};

use crate::gpu::Gpu;
use crate::queue::Queue;

/// The GPU contexts of Tracy, one for each queue that was measured.
#[derive(Default)]
pub(crate) struct TracyZones {
    queues: [Option<QueueZones>; 3],
    /// True if Tracy has no place for another context, which was logged.
    is_full: bool,
}

/// The zones of a queue.
struct QueueZones {
    context: GpuContext,
    clock: TickClock,
    /// Id of the next timestamp. Each is uploaded at once, so that ids may repeat.
    next_id: u16,
    synchronised: Instant,
}

/// Time between two synchronisations with the clock of the host.
const SYNC_PERIOD: Duration = Duration::from_secs(1);

/// Extends the ticks of a counter that wraps to a count that does not.
#[derive(Debug, Clone, Copy)]
struct TickClock {
    mask: u64,
    last: u64,
    count: i64,
}

impl TracyZones {
    /// Emits the scopes of a command buffer. Begins and ends of `stamps` have the times `ticks`.
    pub(crate) fn emit(&mut self, gpu: &Gpu, queue: Queue, stamps: &[Option<Box<str>>], ticks: &[u64]) {
        let Some(&last) = ticks.last().filter(|_| is_balanced(stamps, ticks)) else { return };
        if let Some(zones) = self.zones(gpu, queue, last) {
            zones.synchronise(gpu);
            stamps.iter().zip(ticks).for_each(|(name, tick)| zones.stamp(name.as_deref(), *tick));
        }
    }

    /// Returns the zones of a queue. `last` is its latest known tick.
    fn zones(&mut self, gpu: &Gpu, queue: Queue, last: u64) -> Option<&mut QueueZones> {
        let place = &mut self.queues[queue.index()];
        if place.is_none() && !self.is_full {
            *place = QueueZones::new(gpu, queue, last);
            self.is_full = place.is_none();
        }
        place.as_mut()
    }
}

impl QueueZones {
    fn new(gpu: &Gpu, queue: Queue, last: u64) -> Option<Self> {
        // Without a common clock, the end of the first command buffer counts as this moment.
        let now = gpu.device_ticks().unwrap_or(last);
        let clock = TickClock::new(gpu.caps.queue(queue).timestamp_bits, now);
        let name = format!("{} {} queue", gpu.caps.device_name, queue.label());
        let period = gpu.caps.limits.timestamp_period_ns;
        let context =
            Client::start().new_gpu_context(Some(&name), GpuContextType::Vulkan, clock.count, period);
        match context {
            Ok(context) => Some(Self { context, clock, next_id: 0, synchronised: Instant::now() }),
            Err(error) => {
                log::warn!("Tracy shows no zones of the {name}: {error}");
                None
            }
        }
    }

    /// Tells Tracy the time of the GPU, whose clock drifts from the host's.
    fn synchronise(&mut self, gpu: &Gpu) {
        if self.synchronised.elapsed() < SYNC_PERIOD {
            return;
        }
        self.synchronised = Instant::now();
        if let Some(now) = gpu.device_ticks() {
            // The latest tick of the counter stays that of a timestamp: command buffers end before this moment.
            let mut clock = self.clock;
            self.context.sync_gpu_time(clock.count(now));
        }
    }

    /// Begins the zone `name`, or ends the innermost one, at a tick.
    fn stamp(&mut self, name: Option<&str>, tick: u64) {
        let id = self.next_id;
        self.next_id = id.wrapping_add(1);
        match name {
            Some("") => self.context.begin_span_alloc("command buffer", "", file!(), line!(), id),
            Some(name) => self.context.begin_span_alloc(name, "", file!(), line!(), id),
            None => self.context.end_span(id),
        }
        self.context.upload_gpu_timestamp(id, self.clock.count(tick));
    }
}

impl TickClock {
    /// Begins at a tick of a counter with this number of bits.
    fn new(bits: u32, tick: u64) -> Self {
        let mask = u64::MAX >> (64 - bits.clamp(1, 64));
        Self { mask, last: tick & mask, count: i64::try_from(tick & mask).unwrap_or_default() }
    }

    /// Returns the count of a tick, which is less than half the counter's range from the last.
    fn count(&mut self, tick: u64) -> i64 {
        let ahead = tick.wrapping_sub(self.last) & self.mask;
        let behind = self.last.wrapping_sub(tick) & self.mask;
        let step = if ahead <= behind { ahead.cast_signed() } else { -behind.cast_signed() };
        self.last = tick & self.mask;
        self.count = self.count.wrapping_add(step);
        self.count
    }
}

/// True if every begin has its end behind it, and every timestamp its tick.
fn is_balanced(stamps: &[Option<Box<str>>], ticks: &[u64]) -> bool {
    let mut open = 0_usize;
    let never_below = stamps.iter().all(|stamp| match stamp {
        Some(_) => {
            open += 1;
            true
        }
        None => open.checked_sub(1).inspect(|left| open = *left).is_some(),
    });
    never_below && open == 0 && stamps.len() == ticks.len()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn stamps(text: &str) -> Vec<Option<Box<str>>> {
        text.split_whitespace().map(|word| (word != ")").then(|| word.into())).collect()
    }

    #[test]
    fn only_balanced_scopes_become_zones() {
        let balanced = |text: &str, ticks: usize| is_balanced(&stamps(text), &vec![0; ticks]);
        assert!(balanced("a b ) )", 4) && balanced("", 0) && balanced("a ) b )", 4));
        assert!(!balanced("a b )", 3) && !balanced(") a", 2) && !balanced("a )", 1));
    }

    #[test]
    fn a_counter_that_wraps_is_counted_on() {
        let mut clock = TickClock::new(8, 250);
        assert_eq!([253, 3, 1, 100].map(|tick| clock.count(tick)), [253, 259, 257, 356]);
        let mut clock = TickClock::new(64, u64::MAX);
        assert_eq!(clock.count(1) - clock.count(u64::MAX), 2);
    }

    /// Tracy's client queues events while no server is connected.
    #[test]
    fn zones_are_emitted_without_a_server() {
        let clock = TickClock::new(36, 100);
        let context = Client::start().new_gpu_context(Some("test"), GpuContextType::Vulkan, clock.count, 1.0);
        let mut zones =
            QueueZones { context: context.unwrap(), clock, next_id: u16::MAX, synchronised: Instant::now() };
        for (name, tick) in [(Some(""), 110), (Some("a"), 120), (None, 130), (None, 131)] {
            zones.stamp(name, tick);
        }
        assert_eq!((zones.next_id, zones.clock.count), (3, 131));
    }

    proptest! {
        /// Steps of less than half the range are found again, forwards and backwards.
        #[test]
        fn counts_differ_as_the_ticks_do(bits in 8..64_u32, start in any::<u64>(), steps in prop::collection::vec(-100..100_i64, 0..50)) {
            let (mut clock, mut tick) = (TickClock::new(bits, start), start);
            for step in steps {
                let before = clock.count;
                tick = tick.wrapping_add_signed(step);
                prop_assert_eq!(clock.count(tick) - before, step);
            }
        }
    }
}
