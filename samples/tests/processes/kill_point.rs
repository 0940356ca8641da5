//! The moments at which a process is killed: spread over its run, or when files appear.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

use crate::program::{Desk, is_temporary, paths};

/// A moment in the run of a process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum KillPoint {
    /// A time after the start.
    After(Duration),
    /// The moment when the temporary file of this number is seen, counted from 1.
    Temporary(usize),
    /// The moment when the completed file of this number is seen, counted from 1.
    Completed(usize),
}

/// Returns `count` points, equal for equal seeds: half of them at times spread over a run of `length`, the other half when one
/// of `files` files appears under its temporary or under its final name.
pub(crate) fn kill_points(seed: u64, count: usize, length: Duration, files: usize) -> Vec<KillPoint> {
    let mut random = Random(seed);
    let by_time = count.div_ceil(2);
    let point = |index: usize| match index % 4 {
        0 | 2 => KillPoint::After(length.mul_f64((index as f64 / 2.0 + random.share()) / by_time as f64)),
        1 => KillPoint::Temporary(1 + random.below(files)),
        _ => KillPoint::Completed(1 + random.below(files)),
    };
    (0..count).map(point).collect()
}

/// Waits until the moment has come. False if the process has ended before.
pub(crate) fn wait_for(point: KillPoint, desk: &Desk, child: &mut Child) -> bool {
    let start = Instant::now();
    let folders = [desk.cache(), desk.output()];
    let mut seen = BTreeSet::new();
    loop {
        let has_come = match point {
            KillPoint::After(delay) => start.elapsed() >= delay,
            KillPoint::Temporary(number) => count(&folders, &mut seen, true) >= number,
            KillPoint::Completed(number) => count(&folders, &mut seen, false) >= number,
        };
        if has_come || child.try_wait().unwrap().is_some() {
            return has_come;
        }
        if let KillPoint::After(delay) = point {
            std::thread::sleep(delay.saturating_sub(start.elapsed()).min(Duration::from_millis(2)));
        }
    }
}

/// The number of files that were ever seen, either temporary or completed ones.
fn count(
    folders: &[impl AsRef<Path>],
    seen: &mut BTreeSet<std::path::PathBuf>,
    wants_temporary: bool,
) -> usize {
    let all = folders.iter().flat_map(|folder| paths(folder.as_ref()));
    seen.extend(all.filter(|path| is_temporary(path) == wants_temporary));
    seen.len()
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// A number from 0 to less than 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, end: usize) -> usize {
        (self.share() * end as f64) as usize
    }
}

#[test]
fn kill_points_cover_the_whole_run_and_repeat_for_a_seed() {
    let length = Duration::from_secs(10);
    let all = kill_points(7, 40, length, 12);
    assert_eq!(all, kill_points(7, 40, length, 12));
    assert_ne!(all, kill_points(8, 40, length, 12));
    let mut seconds = Vec::new();
    for point in all {
        match point {
            KillPoint::After(delay) => seconds.push(delay.as_secs_f64()),
            KillPoint::Temporary(number) | KillPoint::Completed(number) => {
                assert!((1..=12).contains(&number))
            }
        }
    }
    assert_eq!(seconds.len(), 20);
    for (index, second) in seconds.iter().enumerate() {
        assert!((index as f64 * 0.5..index as f64 * 0.5 + 0.5).contains(second), "{index}: {second}");
    }
}
