//! A watchdog of reads without an end: it keeps the input and ends the process, since nothing else ends a thread.
//!
//! What counts is the time that the processor worked for the thread of a read, which other work of the machine does not lengthen.
//! A read that waits takes none, so the clock counts too, for a multiple of that time.

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};
use std::{process, thread};

/// Most processor time of one input. An input of a few KiB takes milliseconds.
pub const MOST_TIME: Duration = Duration::from_secs(30);
/// The environment variable of another number of seconds, for a test of the watchdog.
pub const MOST_SECONDS_VARIABLE: &str = "LVK_FUZZ_MOST_SECONDS";
/// Most time of one input by the clock, as a multiple of the most processor time.
const CLOCK_MULTIPLE: u32 = 10;
/// Times that the watchdog looks at a read that takes its whole time.
const LOOKS: u32 = 30;
/// Longest input whose bytes are in the message.
const MOST_PRINTED: usize = 1 << 10;

static THREADS: Mutex<Vec<Arc<Thread>>> = Mutex::new(Vec::new());
static START: Once = Once::new();

thread_local! {
    static THREAD: Arc<Thread> = Thread::listed();
}

/// A thread that reads inputs.
struct Thread {
    /// File with the times of the thread; `None` on systems without.
    times: Option<PathBuf>,
    read: Mutex<Read>,
}

/// The read of a thread that is under way, or the last one.
#[derive(Default)]
struct Read {
    /// Reads of the thread that have begun.
    number: u64,
    is_under_way: bool,
    target: &'static str,
    input: Vec<u8>,
    /// What the last look at the thread saw.
    seen: Option<Seen>,
}

/// A moment of a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Moment {
    /// Time by the clock since the watchdog began.
    clock: Duration,
    /// Time that the processor has worked for the thread; `clock` where the system does not tell.
    processor: Duration,
}

/// The read that a look at a thread saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Seen {
    number: u64,
    /// When it was seen first.
    first: Moment,
}

/// Ends the watch of a read, also of one that panics.
struct End;

impl Drop for End {
    fn drop(&mut self) {
        _ = THREAD.try_with(|thread| thread.read().is_under_way = false);
    }
}

/// Runs a read. If the read does not end, a message names the target, the input is kept in a file, and the process ends.
pub(crate) fn watched<R>(target: &'static str, input: &[u8], read: impl FnOnce() -> R) -> R {
    START.call_once(|| _ = thread::spawn(|| watch(most_time())));
    THREAD.with(|thread| thread.begin(target, input));
    let _end = End;
    read()
}

fn most_time() -> Duration {
    let told = std::env::var(MOST_SECONDS_VARIABLE).ok().and_then(|text| text.parse().ok());
    told.map_or(MOST_TIME, Duration::from_secs)
}

/// Looks at all threads, for ever.
fn watch(most: Duration) {
    let start = Instant::now();
    loop {
        thread::sleep(most / LOOKS);
        let mut threads = locked(&THREADS);
        // A thread that has ended holds its own no more.
        threads.retain(|thread| Arc::strong_count(thread) > 1);
        for thread in threads.iter() {
            let mut read = thread.read();
            let now = thread.moment(start);
            let seen = Seen::look(read.seen, read.number, now);
            read.seen = Some(seen);
            if read.is_under_way && seen.is_overdue(now, most) {
                give_up(&read);
            }
        }
    }
}

/// Keeps the input of a read, tells of it, and ends the process.
fn give_up(read: &Read) -> ! {
    let file = std::env::temp_dir().join(format!("lvk-fuzz-{}-{}", read.target, process::id()));
    let kept = match std::fs::write(&file, &read.input) {
        Ok(()) => format!("it is kept as {}", file.display()),
        Err(error) => format!("it cannot be kept as {}: {error}", file.display()),
    };
    let bytes = match read.input.len() {
        0..=MOST_PRINTED => format!("'{}'", read.input.escape_ascii()),
        length => format!("an input of {length} bytes"),
    };
    // The macros for output write to what a test captures, which is lost here.
    _ = writeln!(std::io::stderr(), "\ntarget '{}' does not end on {bytes}; {kept}", read.target);
    process::abort();
}

impl Thread {
    /// Returns the current thread, which the watchdog looks at from now on.
    fn listed() -> Arc<Self> {
        let own = std::fs::read_link("/proc/thread-self").ok();
        let times = own.map(|own| PathBuf::from("/proc").join(own).join("stat"));
        let thread = Arc::new(Self { times, read: Mutex::new(Read::default()) });
        locked(&THREADS).push(Arc::clone(&thread));
        thread
    }

    fn begin(&self, target: &'static str, input: &[u8]) {
        let mut read = self.read();
        read.number += 1;
        (read.is_under_way, read.target) = (true, target);
        read.input.clear();
        read.input.extend_from_slice(input);
    }

    fn read(&self) -> MutexGuard<'_, Read> {
        locked(&self.read)
    }

    fn moment(&self, start: Instant) -> Moment {
        let clock = start.elapsed();
        let stat = self.times.as_ref().and_then(|file| std::fs::read_to_string(file).ok());
        let processor = stat.and_then(|stat| processor_time(&stat));
        Moment { clock, processor: processor.unwrap_or(clock) }
    }
}

impl Seen {
    /// Returns what is seen of read `number` at this moment; `before` is what the look before saw.
    fn look(before: Option<Self>, number: u64, now: Moment) -> Self {
        before.filter(|before| before.number == number).unwrap_or(Self { number, first: now })
    }

    /// True if the read has had its time.
    fn is_overdue(&self, now: Moment, most: Duration) -> bool {
        let processor = now.processor.saturating_sub(self.first.processor);
        let clock = now.clock.saturating_sub(self.first.clock);
        processor >= most || clock >= most * CLOCK_MULTIPLE
    }
}

/// Returns the time of the processor in a file `stat` of Linux: in user mode and in the kernel, in hundredths of a second. `None` for
/// another text.
fn processor_time(stat: &str) -> Option<Duration> {
    // The name of the thread, in parentheses, may have any characters.
    let (_, behind) = stat.rsplit_once(')')?;
    let mut numbers = behind.split_ascii_whitespace().skip(11).map(str::parse::<u64>);
    let (user, kernel) = (numbers.next()?.ok()?, numbers.next()?.ok()?);
    Some(Duration::from_millis(user.saturating_add(kernel).saturating_mul(10)))
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(clock: u64, processor: u64) -> Moment {
        Moment { clock: Duration::from_secs(clock), processor: Duration::from_secs(processor) }
    }

    #[test]
    fn time_of_the_processor_counts_and_not_that_of_other_work() {
        let seen = Seen::look(None, 3, moment(100, 50));
        let is_overdue = |now| seen.is_overdue(now, MOST_TIME);
        assert!(!is_overdue(moment(129, 79)));
        assert!(!is_overdue(moment(390, 79)), "others had the processor");
        assert!(is_overdue(moment(130, 80)));
        assert!(!is_overdue(moment(399, 50)));
        assert!(is_overdue(moment(400, 50)), "it waits for ever");
    }

    #[test]
    fn each_read_has_its_own_time() {
        let first = Seen::look(None, 1, moment(0, 0));
        assert_eq!(Seen::look(Some(first), 1, moment(9, 9)), first);
        let second = Seen::look(Some(first), 2, moment(29, 29));
        assert!(!second.is_overdue(moment(31, 31), MOST_TIME));
    }

    #[test]
    fn times_are_read_behind_the_name_of_a_thread() {
        let stat = "9521 (a) 1 (b) R 9478 9478 22030 0 -1 4194368 4 6361 0 0 100 7 5 0 20 0 2 0 8055293";
        assert_eq!(processor_time(stat), Some(Duration::from_millis(1_070)));
        for text in ["", "1 (a) R 2 3", "1 (a) R 1 2 3 4 5 6 7 8 9 10 x 7", "no parenthesis"] {
            assert_eq!(processor_time(text), None, "{text}");
        }
    }

    #[test]
    fn a_thread_is_watched_during_its_reads() {
        let is_watched = || THREAD.with(|thread| thread.read().is_under_way);
        assert!(watched("a", b"1", is_watched));
        assert!(!is_watched());
        assert!(std::panic::catch_unwind(|| watched("a", b"2", || panic!("a defect"))).is_err());
        assert!(!is_watched(), "a panic ends a read too");
        assert_eq!(THREAD.with(|thread| thread.read().input.clone()), b"2");
    }

    /// Where the system tells the time of a thread, work lengthens it and sleep does not.
    #[test]
    fn work_takes_time_of_the_processor() {
        let (thread, start) = (THREAD.with(Arc::clone), Instant::now());
        if thread.times.is_none() {
            return;
        }
        let before = thread.moment(start).processor;
        thread::sleep(Duration::from_millis(200));
        let slept = thread.moment(start).processor;
        assert!(slept - before < Duration::from_millis(150), "{before:?} {slept:?}");
        while thread.moment(start).processor < slept + Duration::from_millis(50) {
            assert!(start.elapsed() < Duration::from_secs(60), "no time has passed");
        }
    }
}
