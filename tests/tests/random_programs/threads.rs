//! Runs programs whose operations belong to several threads, and makes failing ones small.

use std::sync::Barrier;

use super::environment::{Environment, Queues};
use super::op::{Op, write_program};
use super::run::{Failure, run};
use super::shrink::shrink;
use super::watchdog::Watchdog;

/// Runs of a program whose failure may depend on timing.
const REPEATS: usize = 5;
/// Most programs that are tried while a failing one is shrunk.
pub const TRIES: usize = 400;

/// Returns how often to run a program: several times if it has several threads, or queues in a random order.
pub fn repeats(queues: Queues, ops: &[Op]) -> usize {
    let is_threaded = ops.iter().any(|op| op.thread != ops[0].thread);
    if is_threaded || queues == Queues::Unordered { REPEATS } else { 1 }
}

/// Runs the operations of each thread as a program of its own, all at once on one context, and checks that nothing is
/// left.
///
/// # Errors
/// The failure of the first thread that has one.
pub fn run_and_check(env: &Environment, ops: &[Op]) -> Result<(), Failure> {
    let threads = ops.iter().map(|op| op.thread).max().unwrap_or(0);
    let of_thread = |thread| ops.iter().filter(|op| op.thread == thread).copied().collect::<Vec<Op>>();
    let programs: Vec<Vec<Op>> = (0..=threads).map(of_thread).filter(|ops| !ops.is_empty()).collect();
    env.set_threads(programs.len());
    let start = Barrier::new(programs.len());
    let outcomes: Vec<_> = std::thread::scope(|scope| {
        let run = |ops| {
            start.wait();
            run(env, ops)
        };
        let threads: Vec<_> = programs.iter().map(|ops| scope.spawn(move || run(ops))).collect();
        threads.into_iter().map(|thread| thread.join()).collect()
    });
    for outcome in outcomes {
        outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    }
    let gone = env.check_all_gone().and_then(|()| env.check_messages());
    gone.map_err(|message| Failure { at: ops.len(), message })
}

/// Runs candidates one after the other, on a context that a failure replaces.
struct Candidates<'a> {
    queues: Queues,
    dog: &'a Watchdog,
    env: Option<Environment>,
}

impl Candidates<'_> {
    /// Runs a program, several times if its failure may depend on timing.
    fn run(&mut self, ops: &[Op]) -> Result<(), Failure> {
        for _ in 0..repeats(self.queues, ops) {
            self.dog.program_ended();
            let Some(env) = self.env.take().or_else(|| Environment::new(self.queues)) else { return Ok(()) };
            run_and_check(&env, ops)?;
            self.env = Some(env);
        }
        Ok(())
    }
}

/// Shrinks a failing program. Returns a report with the text of the small one. Of a program on several threads, `ops`
/// holds the operations of all, those of the thread that failed as thread 0: it is tried alone first.
pub fn report(queues: Queues, ops: &[Op], failure: &Failure, dog: &Watchdog) -> String {
    eprintln!("a program with {queues:?} fails and is shrunk: {failure:?}");
    let mut candidates = Candidates { queues, dog, env: None };
    let alone: Vec<Op> = ops.iter().filter(|op| op.thread == 0).copied().collect();
    let begin = &alone[..(failure.at + 1).min(alone.len())];
    let failing = [begin, &alone, ops].into_iter().find(|ops| candidates.run(ops).is_err());
    let Some(failing) = failing else {
        return format!("{failure:?}, but not in {REPEATS} more runs of\n{}", write_program(ops));
    };
    let small = shrink(failing, TRIES, |ops| candidates.run(ops).is_err());
    let outcome = candidates.run(&small);
    format!(
        "operation {}: {}\nshrunk to these operations, a file for the folder kept:\n{}which end with {outcome:?}",
        failure.at,
        failure.message,
        write_program(&small)
    )
}

#[cfg(test)]
mod tests {
    use super::super::op::{Kind, program};
    use super::*;

    /// A model that is wrong only beside other threads: the program that shows it keeps two of its four threads.
    #[test]
    fn a_wrong_model_beside_other_threads_is_detected_and_the_program_shrunk() {
        let Some(mut env) = Environment::new(Queues::Own) else { return };
        env.wrong_about = Some((Kind::FillBuffer, 2));
        let of_thread = |thread: u8| {
            let ops = program(u64::from(thread), 300).into_iter();
            ops.map(move |op| Op { thread, ..op })
        };
        let ops: Vec<Op> = (0..4).flat_map(of_thread).collect();
        assert!(run_and_check(&env, &ops).is_err());
        let small = shrink(&ops, TRIES, |ops| run_and_check(&env, ops).is_err());
        assert!(small.len() <= 4, "{small:#?}");
        assert!(small.iter().any(|op| op.kind == Kind::FillBuffer), "{small:#?}");
        assert!(small.iter().any(|op| op.thread != small[0].thread), "{small:#?}");
        env.wrong_about = None;
        assert!(run_and_check(&env, &small).is_ok(), "the library itself is right");
    }
}
