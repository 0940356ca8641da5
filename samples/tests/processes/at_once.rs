//! Processes that start at once on shared cold caches.

use crate::kill_point::{KillPoint, wait_for};
use crate::program::{Desk, Task, assert_complete_in, assert_whole_in, has_device};

/// Starts `count` processes with one cache folder, and kills the first of them at `kill`. Each writes pictures of its own, or all
/// write the same files.
fn start_at_once(task: Task, count: usize, shares_pictures: bool, kill: Option<KillPoint>) {
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
    let is_killed = kill.is_some_and(|point| wait_for(point, &desk, &mut children[0]));
    if is_killed {
        children[0].kill().unwrap();
    }
    for (number, child) in children.into_iter().enumerate() {
        let ended = desk.wait(child, number);
        if number == 0 && is_killed {
            assert_whole_in(task, &folder(0));
            continue;
        }
        ended.assert_success();
        assert!(!ended.err.contains("warning"), "{number}: {}", ended.err);
        assert_complete_in(task, &folder(number));
    }
    if !is_killed {
        assert_eq!(desk.leftovers(), Vec::<std::path::PathBuf>::new());
    }
    let words = desk.words_to(&folder(count).join(task.file_name()));
    std::fs::create_dir_all(folder(count)).unwrap();
    let ended = desk.run_command(desk.command(&words));
    ended.assert_success();
    assert!(!ended.err.contains("warning"), "{}", ended.err);
    assert_complete_in(task, &folder(count));
}

fn start_all_at_once(round: usize) {
    for task in Task::ALL {
        start_at_once(task, 2, false, None);
        start_at_once(task, 4, true, None);
        start_at_once(task, 2, true, Some(KillPoint::Completed(round % task.expected().files + 1)));
        start_at_once(task, 4, false, Some(KillPoint::Temporary(round % task.expected().files + 1)));
    }
}

#[test]
fn processes_at_once_share_cold_caches() {
    if !has_device() {
        return;
    }
    start_at_once(Task::Small, 2, false, None);
    start_at_once(Task::Sequence, 4, true, None);
    start_at_once(Task::Small, 2, true, Some(KillPoint::Temporary(3)));
}

/// `LVK_KILLS=N` makes N / 30 rounds of 16 sets of processes.
#[test]
#[ignore = "minutes to hours: `.ci/slow processes`"]
fn many_processes_at_once_share_cold_caches() {
    let kills = std::env::var("LVK_KILLS").map_or(300, |text| text.parse::<usize>().unwrap());
    for round in 0..kills.div_ceil(30) {
        eprintln!("round {round}");
        start_all_at_once(round);
    }
}
