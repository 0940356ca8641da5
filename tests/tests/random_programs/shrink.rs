//! Shrinks failing programs.

use super::op::Op;

/// Returns a smaller program that still fails: without parts that the failure does not need, on fewer threads, and with
/// smaller numbers. `fails` is called at most `tries` times. Where failures depend on timing, it runs a program several
/// times.
pub fn shrink(ops: &[Op], mut tries: usize, mut fails: impl FnMut(&[Op]) -> bool) -> Vec<Op> {
    let mut attempt = |candidate: &[Op]| {
        tries = tries.saturating_sub(1);
        tries > 0 && fails(candidate)
    };
    let mut best = ops.to_vec();
    for thread in 0..=ops.iter().map(|op| op.thread).max().unwrap_or(0) {
        keep_if(&mut best, &mut attempt, |ops| ops.retain(|op| op.thread != thread));
    }
    remove_parts(&mut best, &mut attempt);
    for thread in 1..=ops.iter().map(|op| op.thread).max().unwrap_or(0) {
        let of_thread = |op: &&mut Op| op.thread == thread;
        keep_if(&mut best, &mut attempt, |ops| {
            ops.iter_mut().filter(of_thread).for_each(|op| op.thread = 0);
        });
    }
    reduce_numbers(&mut best, &mut attempt);
    best
}

/// Changes the program if the changed one still fails. Returns whether it does.
fn keep_if(
    best: &mut Vec<Op>,
    attempt: &mut impl FnMut(&[Op]) -> bool,
    change: impl FnOnce(&mut Vec<Op>),
) -> bool {
    let mut candidate = best.clone();
    change(&mut candidate);
    let kept = candidate != *best && attempt(&candidate);
    if kept {
        *best = candidate;
    }
    kept
}

/// Removes parts: halves first, single operations at the end.
fn remove_parts(best: &mut Vec<Op>, attempt: &mut impl FnMut(&[Op]) -> bool) {
    let mut part = best.len().div_ceil(2).max(1);
    loop {
        let (mut removed, mut start) = (false, 0);
        while start < best.len() {
            let end = (start + part).min(best.len());
            if keep_if(best, attempt, |ops| drop(ops.drain(start..end))) {
                removed = true;
            } else {
                start = end;
            }
        }
        if part == 1 && !removed {
            return;
        }
        part = part.div_ceil(2);
    }
}

fn reduce_numbers(best: &mut Vec<Op>, attempt: &mut impl FnMut(&[Op]) -> bool) {
    for at in 0..best.len() {
        for number in 0..best[at].n.len() {
            let found = best[at].n[number];
            let smaller = [0, found % 32, found / 2].into_iter().filter(|smaller| *smaller < found);
            for smaller in smaller {
                if keep_if(best, attempt, |ops| ops[at].n[number] = smaller) {
                    break;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::op::{Kind, op, program};
    use super::*;

    #[test]
    fn parts_that_a_failure_does_not_need_go() {
        let mut ops = program(1, 60);
        ops.insert(20, op(Kind::Label, [40, 7, 9, 9, 9, 9]));
        ops.insert(50, op(Kind::WaitIdle, [5; 6]));
        let fails = |ops: &[Op]| {
            let label = ops.iter().position(|op| op.kind == Kind::Label && op.n[0] >= 8);
            label.is_some_and(|at| ops[at..].iter().any(|op| op.kind == Kind::WaitIdle))
        };
        let found = shrink(&ops, 10_000, fails);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(fails(&found));
        assert_eq!(found[1].n, [0; 6]);
    }

    /// A failure that needs two threads, and shows in one of three runs.
    #[test]
    fn a_program_on_threads_keeps_those_that_its_failure_needs() {
        let of_thread = |thread: u8| move |op: Op| Op { thread, ..op };
        let mut ops: Vec<Op> = (0..4)
            .flat_map(|thread| program(u64::from(thread), 60).into_iter().map(of_thread(thread)))
            .collect();
        ops.insert(100, of_thread(1)(op(Kind::Label, [40, 7, 9, 9, 9, 9])));
        ops.insert(200, of_thread(3)(op(Kind::WaitIdle, [5; 6])));
        let mut runs = 0;
        let mut run = |ops: &[Op]| {
            runs += 1;
            let label = ops.iter().find(|op| op.kind == Kind::Label && op.n[0] >= 8);
            let beside =
                |label: &Op| ops.iter().any(|op| op.kind == Kind::WaitIdle && op.thread != label.thread);
            runs % 3 == 0 && label.is_some_and(beside)
        };
        let found = shrink(&ops, 10_000, |ops| (0..3).any(|_| run(ops)));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].thread == 0 || found[1].thread == 0, "{found:?}");
        assert_ne!(found[0].thread, found[1].thread, "{found:?}");
    }

    #[test]
    fn the_number_of_tries_is_bounded() {
        let mut calls = 0;
        shrink(&program(2, 200), 10, |_| {
            calls += 1;
            true
        });
        assert!(calls <= 10);
    }
}
