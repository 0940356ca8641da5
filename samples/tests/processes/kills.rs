//! Processes that are killed (SIGKILL): what they leave is whole, and the next start works.

use std::process::Command;
use std::time::Instant;

use rustix::process::Signal;

use crate::kill_point::{KillPoint, kill_points, wait_for};
use crate::program::{Desk, Ended, Task, has_device};

/// Counts of kills.
#[derive(Debug, Default)]
struct Tally {
    killed: usize,
    /// Processes that ended before their moment had come.
    ended_before: usize,
    /// Kills that left temporary files.
    with_leftovers: usize,
    leftovers: usize,
}

/// Kills a process at `point`, checks the files, and starts again. Where `is_aged`, the temporary files that are left look old, and
/// must be gone afterwards; else the next start must leave them alone.
fn kill_at(desk: &Desk, point: KillPoint, is_aged: bool, tally: &mut Tally) {
    let mut child = desk.start(0);
    if wait_for(point, desk, &mut child) {
        child.kill().unwrap();
    }
    // A process that ends by itself meanwhile is not killed.
    match desk.wait(child, 0) {
        ended if ended.is_by_signal(Signal::KILL.as_raw()) => tally.killed += 1,
        ended => {
            assert_eq!(ended.status.code(), Some(0), "{}", ended.err);
            tally.ended_before += 1;
        }
    }
    desk.assert_whole();
    let left = desk.leftovers();
    tally.with_leftovers += usize::from(!left.is_empty());
    tally.leftovers += left.len();
    if is_aged {
        desk.age_leftovers();
    }
    desk.assert_next_start();
    let expected = if is_aged { Vec::new() } else { left };
    assert_eq!(desk.leftovers(), expected, "after the next start");
}

/// Kills `count` processes of a task, each on cold caches. Returns how many the signal ended.
fn kill_many(task: Task, seed: u64, count: usize) -> usize {
    let expected = task.expected();
    let start = Instant::now();
    let mut tally = Tally::default();
    for (index, point) in kill_points(seed, count, expected.length, expected.files).into_iter().enumerate() {
        eprintln!("{task:?}, kill {index}: {point:?}");
        kill_at(&Desk::new(task), point, index % 2 == 1, &mut tally);
    }
    eprintln!("{task:?}, seed {seed}: {tally:?} in {:.0} s", start.elapsed().as_secs_f32());
    tally.killed
}

#[test]
fn only_a_process_that_the_signal_ended_counts_as_killed() {
    let ends = |script: &str| {
        let status = Command::new("sh").args(["-c", script]).status().unwrap();
        Ended { status, err: String::new() }.is_by_signal(Signal::KILL.as_raw())
    };
    assert!(ends("kill -KILL $$"));
    assert!(!ends("kill -SEGV $$") && !ends("exit 137") && !ends("true"));
}

#[test]
fn a_killed_process_leaves_whole_files_and_the_next_start_works() {
    if !has_device() {
        return;
    }
    let tasks = [(Task::Small, 8), (Task::Sequence, 8), (Task::Hybrid, 2), (Task::Structures, 2)];
    let killed: usize = tasks.into_iter().map(|(task, count)| kill_many(task, 1, count)).sum();
    assert!(killed >= 5, "{killed} of 20 processes were killed");
}

/// `LVK_KILLS=N` kills N processes in place of 300, `LVK_KILLS_SEED` chooses other moments.
#[test]
#[ignore = "minutes to hours: `.ci/slow processes`"]
fn many_killed_processes_leave_whole_files_and_the_next_start_works() {
    let number = |name, usual| std::env::var(name).map_or(usual, |text| text.parse().unwrap());
    let (count, seed) = (number("LVK_KILLS", 300), number("LVK_KILLS_SEED", 100));
    let killed: usize =
        Task::shares(count as usize).into_iter().map(|(task, count)| kill_many(task, seed, count)).sum();
    assert!(2 * killed as u64 >= count, "{killed} of {count} processes were killed");
}
