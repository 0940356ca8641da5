//! Programs that have failed, by a mistake of the library or of the model. They are kept as operations, in files of the
//! folder `kept`, so that they stay what they are when the generator changes. Only the commands of `RecordOnThreads` and
//! `RecordAnyOnThreads` follow from their numbers.

use std::path::{Path, PathBuf};

use super::environment::{Environment, QUEUES};
use super::op::{Op, parse_program};
use super::threads::{repeats, run_and_check};
use super::watchdog::Watchdog;

/// Returns every kept program with the path of its file, in the order of names.
fn kept_programs() -> Vec<(PathBuf, Vec<Op>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/random_programs/kept");
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut paths: Vec<PathBuf> = entries.iter().flatten().map(std::fs::DirEntry::path).collect();
    paths.sort();
    let parse = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).map_err(|error| error.to_string());
        match text.and_then(|text| parse_program(&text)) {
            Ok(ops) => (path, ops),
            Err(error) => unreachable!("{}: {error}", path.display()),
        }
    };
    paths.into_iter().map(parse).collect()
}

#[test]
fn kept_programs_do_what_the_model_says() {
    let programs = kept_programs();
    assert!(programs.len() >= 12, "{} programs", programs.len());
    Watchdog::watch(|dog| {
        for queues in QUEUES {
            let Some(env) = Environment::new(queues) else { return };
            for (path, ops) in &programs {
                assert!(!ops.is_empty(), "{} has no operations", path.display());
                for _ in 0..repeats(queues, ops) {
                    let outcome = run_and_check(&env, ops);
                    assert!(outcome.is_ok(), "{}, {queues:?}: {outcome:?}", path.display());
                    dog.program_ended();
                }
            }
        }
    });
}
