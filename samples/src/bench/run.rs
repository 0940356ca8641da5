//! The program on the command line.

use std::io::Write as _;
use std::process::ExitCode;

use super::args::{BenchArgs, Benchmark};
use super::error::BenchError;
use super::setup::Setup;
use super::table::Table;
use super::{batch, compaction, order, overhead, paper, split, tlas};

/// Does what the command line says. Prints a table to standard output, errors in one line to standard error; the
/// status is 0 when everything was measured, 1 for trouble with the device, 2 for wrong input.
#[must_use]
pub fn run(args: &BenchArgs) -> ExitCode {
    match measured(args) {
        Ok(table) => {
            let _ = write!(std::io::stdout(), "{table}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.status())
        }
    }
}

fn measured(args: &BenchArgs) -> Result<Table, BenchError> {
    let setup = Setup::new(args)?;
    let table = match &args.benchmark {
        Benchmark::Batch(args) => batch::measure(&setup, args),
        Benchmark::Compaction(args) => compaction::measure(&setup, args),
        Benchmark::Split(args) => split::measure(&setup, args),
        Benchmark::Tlas(args) => tlas::measure(&setup, args),
        Benchmark::Order(args) => order::measure(&setup, args),
        Benchmark::Overhead(args) => overhead::measure(&setup, args),
        Benchmark::Paper(args) => paper::run(&setup, args),
    }?;
    let messages = setup.validation_messages();
    if messages.is_empty() { Ok(table) } else { Err(BenchError::Validation(messages)) }
}
