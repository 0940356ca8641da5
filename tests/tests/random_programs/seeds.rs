//! The tests: seeds of the bounded tests, programs on several threads, and the long run.

use std::ffi::OsStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

use lvk_tests::subprocess::in_subprocess;

use super::environment::{Environment, QUEUES, Queues};
use super::op::{Kind, Op, program};
use super::run::{Failure, run};
use super::shrink::shrink;
use super::threads::{TRIES, report, run_and_check};
use super::watchdog::Watchdog;
use super::world::{Problem, Tally};

/// Operations of a program.
const LENGTH: usize = 400;
/// Programs of the bounded tests, for each kind of queues.
const BOUNDED_SEEDS: u64 = 400;
/// Programs of the bounded test by lowered pipelines, which take longer to create.
const LOWERED_SEEDS: u64 = 60;
/// Most programs that are tried with a model that is wrong about one kind.
const MOST_TRIED: u64 = 60;
/// Programs after which objects and memory are counted.
const CHECKED_EVERY: u64 = 16;

/// Runs the programs of seeds one after the other. Returns what they have done.
///
/// # Panics
/// When one of them fails.
fn run_seeds(queues: Queues, seeds: impl Iterator<Item = u64>, dog: &Watchdog) -> Option<Tally> {
    let mut seeds = seeds.peekable();
    let env = Environment::with_seed(queues, seeds.peek().copied().unwrap_or(0))?;
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
            Err(failure) => unreachable!("seed {seed}, {}", report(queues, &ops, &failure, dog)),
        }
        dog.program_ended();
    }
    assert_eq!(env.check_all_gone(), Ok(()));
    assert_eq!(env.check_messages(), Ok(()));
    Some(total)
}

/// Runs the programs of seeds on several threads of one context. Returns what they have done.
///
/// # Panics
/// When one of them fails. It is shrunk together with those that ran beside it.
fn run_on_threads(queues: Queues, seeds: &[u64], threads: usize, dog: &Watchdog) -> Option<Tally> {
    let env = Environment::with_seed(queues, seeds.first().copied().unwrap_or(0))?;
    let (next, total) = (AtomicU64::new(0), Mutex::new(Tally::default()));
    let running: Vec<Mutex<Option<u64>>> = (0..threads).map(|_| Mutex::default()).collect();
    let failed: OnceLock<(Vec<u64>, Failure)> = OnceLock::new();
    let work = |thread: usize| {
        let set_running = |seed| *running[thread].lock().unwrap_or_else(PoisonError::into_inner) = seed;
        while failed.get().is_none()
            && let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed) as usize)
        {
            set_running(Some(*seed));
            match run(&env, &program(*seed, LENGTH)) {
                Ok(done) => *total.lock().unwrap_or_else(PoisonError::into_inner) += done,
                Err(failure) => drop(failed.set((beside(*seed, &running), failure))),
            }
            set_running(None);
            dog.program_ended();
        }
    };
    std::thread::scope(|scope| {
        (0..threads).for_each(|thread| drop(scope.spawn(move || work(thread))));
    });
    if let Some((seeds, failure)) = failed.get() {
        drop(env);
        let ops: Vec<Op> = (0..).zip(seeds).flat_map(|(thread, seed)| on_thread(*seed, thread)).collect();
        unreachable!("seeds {seeds:?} side by side, {}", report(queues, &ops, failure, dog));
    }
    assert_eq!(env.check_all_gone(), Ok(()));
    assert_eq!(env.check_messages(), Ok(()));
    total.into_inner().ok()
}

/// Returns a seed, and those whose programs run beside it.
fn beside(seed: u64, running: &[Mutex<Option<u64>>]) -> Vec<u64> {
    let seeds = running.iter().filter_map(|seed| *seed.lock().unwrap_or_else(PoisonError::into_inner));
    std::iter::once(seed).chain(seeds.filter(|other| *other != seed)).collect()
}

/// Returns the program of a seed, for a thread.
fn on_thread(seed: u64, thread: u8) -> impl Iterator<Item = Op> {
    program(seed, LENGTH).into_iter().map(move |op| Op { thread, ..op })
}

#[test]
fn random_programs_do_what_the_model_says() {
    Watchdog::watch(|dog| {
        for queues in QUEUES {
            let Some(total) = run_seeds(queues, 0..BOUNDED_SEEDS, dog) else { return };
            eprintln!("{queues:?}: {total}");
            let programs = BOUNDED_SEEDS;
            assert!(total.executed > programs * LENGTH as u64 / 2, "most operations find nothing to work on");
            assert!(total.refused > 5 * programs && total.hits > 5 * programs, "errors or rays are too rare");
            let Some(env) = Environment::new(queues) else { return };
            assert_eq!(unseen(&total, &env), [], "no program has these kinds with these problems");
        }
    });
}

/// True if the device has what operations of a kind need.
fn is_supported(env: &Environment, kind: Kind) -> bool {
    let caps = env.ctx().capabilities();
    match kind {
        Kind::DrawMesh => caps.mesh_shader,
        Kind::DrawCounted => caps.has(lvk::OptionalFeature::DrawIndirectCount),
        Kind::CreateRays | Kind::DestroyRays | Kind::TraceRays => caps.ray_tracing_pipeline,
        _ => true,
    }
}

/// Returns what the bounded programs must have and do not: every kind without a problem, as far as the device has what it needs, and BLAS that
/// calls and commands refuse, one by one and in lists, and uses of shared objects that are gone.
fn unseen(total: &Tally, env: &Environment) -> Vec<(Kind, Option<Problem>)> {
    const OF_BLAS: [Kind; 10] = [
        Kind::CreateTlas,
        Kind::UpdateTlas,
        Kind::UpdateTlasFromBuffer,
        Kind::BuildBlas,
        Kind::Compact,
        Kind::CompactSeveral,
        Kind::AccelInfo,
        Kind::AskAccel,
        Kind::ReloadBlas,
        Kind::WrongStructure,
    ];
    // A wrong structure is a problem by itself.
    let is_wanted = |kind: &Kind| *kind != Kind::WrongStructure && is_supported(env, *kind);
    let kinds = Kind::all().filter(is_wanted).map(|kind| (kind, None));
    let of_blas = |kind| [Problem::Stale, Problem::Foreign].map(|problem| (kind, Some(problem)));
    let of_replaced = (Kind::UseReplaced, Some(Problem::Stale));
    let wanted = kinds.chain(OF_BLAS.into_iter().flat_map(of_blas)).chain([of_replaced]);
    wanted.filter(|wanted| !total.seen.contains(wanted)).collect()
}

#[test]
fn random_programs_on_four_threads_of_one_context_do_what_the_model_says() {
    Watchdog::watch(|dog| {
        for queues in QUEUES {
            let seeds: Vec<u64> = (1_000_000..1_000_000 + BOUNDED_SEEDS / 2).collect();
            let Some(total) = run_on_threads(queues, &seeds, 4, dog) else { return };
            eprintln!("{queues:?}, four threads: {total}");
            let programs = seeds.len() as u64;
            assert!(total.executed > programs * LENGTH as u64 / 2, "most operations find nothing to work on");
            assert!(total.refused > 5 * programs && total.hits > 5 * programs, "errors or rays are too rare");
        }
    });
}

/// The device's ray queries and the library's traversal, in a process of its own, whose environment chooses the pipelines.
#[test]
fn random_programs_by_lowered_pipelines_do_what_the_model_says() {
    let variables = [("LVK_TEST_RAY_PIPELINE", Some(OsStr::new("software")))];
    in_subprocess(random_programs_by_lowered_pipelines_do_what_the_model_says, &variables, || {
        Watchdog::watch(|dog| {
            let seeds = 2_000_000..2_000_000 + LOWERED_SEEDS;
            let Some(total) = run_seeds(Queues::Own, seeds, dog) else { return };
            assert!(total.hits > LOWERED_SEEDS, "rays are too rare");
            assert!(total.seen.contains(&(Kind::TraceRays, None)), "no pipeline is traced");
        });
    });
}

#[test]
fn an_empty_program_leaves_nothing() {
    let Some(env) = Environment::new(Queues::Own) else { return };
    assert!(run_and_check(&env, &[]).is_ok(), "{:?}", run_and_check(&env, &[]));
}

/// A model that is wrong about one kind of commands is found out, and the program shrinks to what shows it.
#[test]
fn a_wrong_model_is_detected_and_the_program_shrunk() {
    let Some(mut env) = Environment::new(Queues::Own) else { return };
    env.wrong_about = Some((Kind::FillBuffer, 1));
    let failing = (0..MOST_TRIED).map(|seed| program(seed, LENGTH)).find(|ops| run(&env, ops).is_err());
    let ops = failing.unwrap_or_default();
    assert!(!ops.is_empty(), "no program of {MOST_TRIED} finds out that the model is wrong");
    let small = shrink(&ops, TRIES, |ops| run(&env, ops).is_err());
    assert!(small.len() <= 3, "{small:#?}");
    let fills = [Kind::FillBuffer, Kind::RecordOnThreads, Kind::RecordAnyOnThreads];
    assert!(small.iter().any(|op| fills.contains(&op.kind)), "{small:#?}");
    assert!(small.iter().any(|op| op.kind == Kind::CreateBuffer), "{small:#?}");
    env.wrong_about = None;
    assert!(run(&env, &small).is_ok(), "the library itself is right");
}

/// A model that is wrong about any operation with an effect is found out.
#[test]
fn a_wrong_model_of_each_operation_is_detected() {
    let Some(mut env) = Environment::new(Queues::Own) else { return };
    let kinds: Vec<Kind> = Kind::with_effect().into_iter().filter(|kind| is_supported(&env, *kind)).collect();
    eprintln!("{} kinds", kinds.len());
    assert!(kinds.len() > 30, "{kinds:?}");
    for kind in kinds {
        env.wrong_about = Some((kind, 1));
        let failing = (0..MOST_TRIED).find(|seed| run(&env, &program(*seed, LENGTH)).is_err());
        assert!(
            failing.is_some(),
            "no program of {MOST_TRIED} finds out that the model of {kind:?} is wrong"
        );
    }
}

fn number(variable: &str, default: u64) -> u64 {
    std::env::var(variable).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
}

/// Runs `LVK_RANDOM_PROGRAMS` programs from seed `LVK_RANDOM_SEED` on, on `LVK_RANDOM_THREADS` threads, for each kind of
/// queues in turn.
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
