//! Shrinks failing programs.

use super::op::Op;

/// Returns a smaller program that still fails: without parts that the failure does not need, and with smaller numbers.
/// `fails` is called at most `tries` times.
pub fn shrink(ops: &[Op], mut tries: usize, mut fails: impl FnMut(&[Op]) -> bool) -> Vec<Op> {
    let mut best = ops.to_vec();
    let mut part = best.len().div_ceil(2).max(1);
    let mut attempt = |candidate: &[Op]| {
        tries = tries.saturating_sub(1);
        tries > 0 && fails(candidate)
    };
    loop {
        let mut removed = false;
        let mut start = 0;
        while start < best.len() {
            let end = (start + part).min(best.len());
            let candidate: Vec<Op> = best[..start].iter().chain(&best[end..]).copied().collect();
            if attempt(&candidate) {
                best = candidate;
                removed = true;
            } else {
                start = end;
            }
        }
        if part == 1 && !removed {
            break;
        }
        part = part.div_ceil(2);
    }
    for at in 0..best.len() {
        for number in 0..best[at].n.len() {
            for smaller in [0, best[at].n[number] % 32, best[at].n[number] / 2] {
                if smaller >= best[at].n[number] {
                    continue;
                }
                let mut candidate = best.clone();
                candidate[at].n[number] = smaller;
                if attempt(&candidate) {
                    best = candidate;
                    break;
                }
            }
        }
    }
    best
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
