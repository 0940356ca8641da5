//! Processes that start at once on shared cold caches.

use std::path::PathBuf;

use rustix::process::Signal;

use crate::kill_point::{KillPoint, wait_for};
use crate::program::{Desk, Task, assert_complete_in, assert_whole_in, has_device};

/// Starts `count` processes with one cache folder, and kills the first of them at `kill`. Each writes pictures of its own, or all
/// write the same files. Returns true if the signal ended the first.
fn start_at_once(task: Task, count: usize, shares_pictures: bool, kill: Option<KillPoint>) -> bool {
    let desk = Desk::new(task);
    let folder = |number: usize| match shares_pictures {
        true => desk.output(),
        false => desk.output().join(number.to_string()),
    };
    let start = |number: usize| {
        std::fs::create_dir_all(folder(number)).unwrap();
        let words = desk.words_to(&folder(number).join(task.file_name()));
        desk.start_command(desk.command(&words), number)
    };
    let mut children: Vec<_> = (0..count).map(start).collect();
    if kill.is_some_and(|point| wait_for(point, &desk, &mut children[0])) {
        children[0].kill().unwrap();
    }
    // A process that ends by itself meanwhile is not killed.
    let mut is_killed = false;
    for (number, child) in children.into_iter().enumerate() {
        let ended = desk.wait(child, number);
        if number == 0 && kill.is_some() && ended.is_by_signal(Signal::KILL.as_raw()) {
            assert_whole_in(task, &folder(0));
            is_killed = true;
            continue;
        }
        ended.assert_success();
        assert!(!ended.err.contains("warning"), "{number}: {}", ended.err);
        assert_complete_in(task, &folder(number));
    }
    if is_killed {
        desk.age_leftovers();
    } else {
        assert_eq!(desk.leftovers(), Vec::<PathBuf>::new());
    }
    // The next start removes what the killed one left where it writes itself.
    let next = if is_killed { folder(0) } else { folder(count) };
    std::fs::create_dir_all(&next).unwrap();
    let ended = desk.run_command(desk.command(&desk.words_to(&next.join(task.file_name()))));
    ended.assert_success();
    assert!(!ended.err.contains("warning"), "{}", ended.err);
    assert_complete_in(task, &next);
    assert_eq!(desk.leftovers(), Vec::<PathBuf>::new(), "after the next start");
    is_killed
}

/// Returns the number of processes that the signal ended, of eight.
fn start_all_at_once(round: usize) -> usize {
    let mut killed = 0;
    for task in Task::ALL {
        start_at_once(task, 2, false, None);
        start_at_once(task, 4, true, None);
        let file = round % task.expected().files + 1;
        killed += usize::from(start_at_once(task, 2, true, Some(KillPoint::Completed(file))));
        killed += usize::from(start_at_once(task, 4, false, Some(KillPoint::Temporary(file))));
    }
    killed
}

#[test]
fn processes_at_once_share_cold_caches() {
    if !has_device() {
        return;
    }
    start_at_once(Task::Small, 2, false, None);
    start_at_once(Task::Sequence, 4, true, None);
    // A process may end before its moment is seen.
    let is_killed =
        |attempt: usize| start_at_once(Task::Small, 2, true, Some(KillPoint::Temporary(attempt % 3 + 1)));
    assert!((0..8).any(is_killed), "none of 8 processes was killed");
}

/// `LVK_KILLS=N` makes N / 30 rounds of 16 sets of processes.
#[test]
#[ignore = "minutes to hours: `.ci/slow processes`"]
fn many_processes_at_once_share_cold_caches() {
    let kills = std::env::var("LVK_KILLS").map_or(300, |text| text.parse::<usize>().unwrap());
    let rounds = kills.div_ceil(30);
    let killed: usize = (0..rounds).map(start_all_at_once).sum();
    eprintln!("{killed} of {} processes were killed beside others", 8 * rounds);
    assert!(4 * killed >= 8 * rounds, "{killed} of {} processes were killed", 8 * rounds);
}
