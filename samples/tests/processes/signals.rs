//! Processes that are asked to end (SIGTERM, SIGINT): their status, their files, and the time that this takes.

use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::kill_point::{kill_points, wait_for};
use crate::program::{Desk, Task, has_device};

/// Longest time from the signal to the end of the process, on a machine whose cores and disks are busy. A frame under way is
/// completed, and no process ends while it waits for the disk.
const LONGEST: Duration = Duration::from_secs(60);

/// Counts of signalled processes.
#[derive(Debug, Default)]
struct Tally {
    interrupted: usize,
    /// Processes that had done their work when the signal came, or nearly.
    completed: usize,
    /// Processes that did not listen yet, and had written nothing.
    not_listening: usize,
    longest: Duration,
}

/// Signals `count` processes of a task, each on cold caches. Returns how many were interrupted.
fn signal_many(task: Task, seed: u64, count: usize) -> usize {
    let expected = task.expected();
    let mut tally = Tally::default();
    for (index, point) in kill_points(seed, count, expected.length, expected.files).into_iter().enumerate() {
        let signal = if index / 2 % 2 == 0 { Signal::TERM } else { Signal::INT };
        let desk = Desk::new(task);
        let mut child = desk.start(0);
        let begun = wait_for(point, &desk, &mut child).then(|| {
            kill_process(Pid::from_child(&child), signal).unwrap();
            Instant::now()
        });
        let ended = desk.wait(child, 0);
        let taken = begun.map_or(Duration::ZERO, |begun| begun.elapsed());
        eprintln!("{task:?}, {signal:?} {index}: {point:?}: {:?} in {taken:?}", ended.status);
        assert!(taken < LONGEST, "{taken:?}");
        tally.longest = tally.longest.max(taken);
        desk.assert_whole();
        assert!(desk.leftovers().is_empty(), "{:?} {}", desk.leftovers(), ended.err);
        // Beside the lines of progress, and that of `--rt auto`.
        let is_usual = |line: &str| line.starts_with('[') || line.starts_with("note: ");
        let says: Vec<_> = ended.err.lines().filter(|line| !is_usual(line)).collect();
        match ended.status.code() {
            Some(130) => {
                tally.interrupted += 1;
                let is_plain = says.iter().all(|line| line.starts_with("error: interrupted after "));
                assert!(says.len() <= 1 && is_plain, "{}", ended.err);
            }
            Some(0) => {
                tally.completed += 1;
                assert!(says.is_empty(), "{}", ended.err);
                desk.assert_complete();
            }
            _ => {
                tally.not_listening += 1;
                assert!(ended.is_by_signal(signal.as_raw()), "{:?}: {}", ended.status, ended.err);
                let is_untouched = std::fs::read_dir(desk.output()).unwrap().next().is_none()
                    && std::fs::read_dir(desk.cache()).unwrap().next().is_none();
                assert!(is_untouched && says.is_empty(), "it did not listen: {}", ended.err);
            }
        }
        desk.assert_next_start();
    }
    eprintln!("{task:?}, seed {seed}: {tally:?}");
    tally.interrupted
}

#[test]
fn a_process_that_is_asked_to_end_does_so_and_leaves_nothing_in_part() {
    if !has_device() {
        return;
    }
    let tasks = [(Task::Small, 6), (Task::Sequence, 6), (Task::Hybrid, 2), (Task::Structures, 1)];
    let interrupted: usize = tasks.into_iter().map(|(task, count)| signal_many(task, 2, count)).sum();
    assert!(interrupted >= 3, "{interrupted} of 15 processes were interrupted");
}

/// Variables as those of the long test of kills.
#[test]
#[ignore = "minutes to hours: `.ci/slow processes`"]
fn many_processes_that_are_asked_to_end_do_so() {
    let number = |name, usual| std::env::var(name).map_or(usual, |text| text.parse().unwrap());
    let (count, seed) = (number("LVK_KILLS", 300), number("LVK_KILLS_SEED", 200));
    let interrupted: usize =
        Task::shares(count as usize).into_iter().map(|(task, count)| signal_many(task, seed, count)).sum();
    assert!(5 * interrupted as u64 >= count, "{interrupted} of {count} processes were interrupted");
}
