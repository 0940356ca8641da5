//! The tests: seeds of the bounded tests, kept programs, programs on several threads, and the long run.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::environment::Environment;
use super::op::{Kind, Op, program};
use super::plan::QUEUES;
use super::run::{Failure, run};
use super::shrink::shrink;
use super::world::Tally;

/// Operations of a program.
const LENGTH: usize = 400;
/// Programs of the bounded tests, for each kind of queues.
const BOUNDED_SEEDS: u64 = 400;
/// Most runs of a failing program while it is shrunk.
const TRIES: usize = 400;
/// Programs after which objects and memory are counted.
const CHECKED_EVERY: u64 = 16;
/// A program that takes longer hangs.
const HANG: Duration = Duration::from_secs(120);

/// Seeds whose programs have failed, by a mistake of the library or of the model. They are always replayed.
const KEPT_SEEDS: [u64; 7] = [5, 22, 30, 1_000_026, 20_000_381, 20_009_249, 100_001_171];

/// Ends the process if the count of finished programs stands still.
struct Watchdog {
    finished: AtomicU64,
    is_over: AtomicBool,
}

impl Watchdog {
    /// Runs `work` under the watch.
    fn watch<T>(work: impl FnOnce(&Self) -> T) -> T {
        let dog = Self { finished: AtomicU64::new(0), is_over: AtomicBool::new(false) };
        std::thread::scope(|scope| {
            scope.spawn(|| dog.wait_for_hang());
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&dog)));
            dog.is_over.store(true, Ordering::Relaxed);
            result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }

    fn wait_for_hang(&self) {
        let (mut seen, mut since) = (u64::MAX, Instant::now());
        while !self.is_over.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(50));
            let finished = self.finished.load(Ordering::Relaxed);
            if finished != seen {
                (seen, since) = (finished, Instant::now());
            } else if since.elapsed() > HANG {
                eprintln!("a program hangs after {finished} finished ones");
                std::process::abort();
            }
        }
    }
}

/// Returns the text of a failing program of a seed, shrunk.
fn report((seed, queues): (u64, lvk::QueueRequest), ops: &[Op], failure: &Failure, dog: &Watchdog) -> String {
    eprintln!("seed {seed}, {queues:?} fails and is shrunk: {failure:?}");
    let fails = |ops: &[Op]| {
        dog.finished.fetch_add(1, Ordering::Relaxed);
        Environment::new(queues).is_some_and(|env| run_and_check(&env, ops).is_err())
    };
    let end = (failure.at + 1).min(ops.len());
    let begin = if fails(&ops[..end]) { &ops[..end] } else { ops };
    let small = shrink(begin, TRIES, fails);
    let outcome = Environment::new(queues).map(|env| run_and_check(&env, &small));
    format!(
        "seed {seed}, {queues:?}, operation {}: {}\nshrunk to {small:#?}\nwhich ends with {outcome:?}",
        failure.at, failure.message
    )
}

/// Runs a program alone on a context, and checks that nothing is left.
fn run_and_check(env: &Environment, ops: &[Op]) -> Result<(), Failure> {
    run(env, ops)?;
    let gone = env.check_all_gone().and_then(|()| env.check_messages());
    gone.map_err(|message| Failure { at: ops.len(), message })
}

/// Runs the programs of seeds one after the other. Returns what they have done.
///
/// # Panics
/// When one of them fails.
fn run_seeds(queues: lvk::QueueRequest, seeds: impl Iterator<Item = u64>, dog: &Watchdog) -> Option<Tally> {
    let env = Environment::new(queues)?;
    let mut total = Tally::default();
    for (count, seed) in (1..).zip(seeds) {
        let ops = program(seed, LENGTH);
        let outcome = run(&env, &ops).and_then(|done| {
            if count % CHECKED_EVERY == 0 {
                let gone = env.check_all_gone().and_then(|()| env.check_messages());
                gone.map_err(|message| Failure { at: LENGTH, message })?;
            }
            Ok(done)
        });
        match outcome {
            Ok(done) => total += done,
            Err(failure) => unreachable!("{}", report((seed, queues), &ops, &failure, dog)),
        }
        dog.finished.fetch_add(1, Ordering::Relaxed);
    }
    assert_eq!(env.check_all_gone(), Ok(()));
    assert_eq!(env.check_messages(), Ok(()));
    Some(total)
}

/// Runs the programs of seeds on several threads of one context. Returns what they have done.
///
/// # Panics
/// When one of them fails.
fn run_on_threads(queues: lvk::QueueRequest, seeds: &[u64], threads: usize, dog: &Watchdog) -> Option<Tally> {
    let env = Environment::new(queues)?;
    let (next, total) = (AtomicU64::new(0), Mutex::new(Tally::default()));
    let work = || {
        while let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed) as usize) {
            match run(&env, &program(*seed, LENGTH)) {
                Ok(done) => *total.lock().unwrap_or_else(std::sync::PoisonError::into_inner) += done,
                Err(failure) => unreachable!("seed {seed}, {queues:?}, {threads} threads: {failure:?}"),
            };
            dog.finished.fetch_add(1, Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    assert_eq!(env.check_all_gone(), Ok(()));
    assert_eq!(env.check_messages(), Ok(()));
    total.into_inner().ok()
}

#[test]
fn random_programs_do_what_the_model_says() {
    Watchdog::watch(|dog| {
        for queues in QUEUES {
            let seeds = KEPT_SEEDS.into_iter().chain(0..BOUNDED_SEEDS);
            let Some(total) = run_seeds(queues, seeds, dog) else { return };
            eprintln!("{queues:?}: {total}");
            let programs = BOUNDED_SEEDS;
            assert!(total.executed > programs * LENGTH as u64 / 2, "most operations find nothing to work on");
            assert!(total.refused > 5 * programs && total.hits > 5 * programs, "errors or rays are too rare");
        }
    });
}

#[test]
fn random_programs_on_four_threads_of_one_context_do_what_the_model_says() {
    Watchdog::watch(|dog| {
        for queues in QUEUES {
            let seeds: Vec<u64> = (1_000_000..1_000_000 + BOUNDED_SEEDS / 2).collect();
            let Some(total) = run_on_threads(queues, &seeds, 4, dog) else { return };
            eprintln!("{queues:?}, four threads: {total}");
        }
    });
}

#[test]
fn an_empty_program_leaves_nothing() {
    let Some(env) = Environment::new(lvk::QueueRequest::OwnHardware) else { return };
    assert!(run_and_check(&env, &[]).is_ok(), "{:?}", run_and_check(&env, &[]));
}

/// A model that is wrong about one kind of commands is found out, and the program shrinks to what shows it.
#[test]
fn a_wrong_model_is_detected_and_the_program_shrunk() {
    let Some(mut env) = Environment::new(lvk::QueueRequest::OwnHardware) else { return };
    env.lies = true;
    let failing = (0..).map(|seed| program(seed, LENGTH)).find(|ops| run(&env, ops).is_err());
    let Some(ops) = failing else { return };
    let small = shrink(&ops, TRIES, |ops| run(&env, ops).is_err());
    assert!(small.len() <= 3, "{small:#?}");
    assert!(small.iter().any(|op| op.kind == Kind::FillBuffer), "{small:#?}");
    assert!(small.iter().any(|op| op.kind == Kind::CreateBuffer), "{small:#?}");
    env.lies = false;
    assert!(run(&env, &small).is_ok(), "the library itself is right");
}

fn number(variable: &str, default: u64) -> u64 {
    std::env::var(variable).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
}

/// Runs `LVK_RANDOM_PROGRAMS` programs from seed `LVK_RANDOM_SEED` on, on `LVK_RANDOM_THREADS` threads, for both kinds
/// of queues in turn.
#[test]
#[ignore = "long: .ci/slow random"]
fn many_random_programs() {
    const BLOCK: u64 = 500;
    let (first, count) = (number("LVK_RANDOM_SEED", 10_000_000), number("LVK_RANDOM_PROGRAMS", 2_000));
    let threads = number("LVK_RANDOM_THREADS", 1) as usize;
    let (start, mut total) = (Instant::now(), Tally::default());
    Watchdog::watch(|dog| {
        for (block, begin) in (first..first + count).step_by(BLOCK as usize).enumerate() {
            let seeds = begin..(begin + BLOCK).min(first + count);
            let queues = QUEUES[block % QUEUES.len()];
            let done = match threads {
                1 => run_seeds(queues, seeds, dog),
                threads => run_on_threads(queues, &seeds.collect::<Vec<_>>(), threads, dog),
            };
            let Some(done) = done else { return };
            total += done;
            let rate = total.executed as f64 / start.elapsed().as_secs_f64();
            eprintln!("{total}; {rate:.0} operations a second");
        }
    });
}
