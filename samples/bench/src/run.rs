//! Runs the benchmark that the command line selects.

use std::io::Write as _;
use std::process::ExitCode;

use crate::args::{BenchArgs, Benchmark};
use crate::error::BenchError;
use crate::growth::GrowthArgs;
use crate::peers::{self, PeersArgs, RunOptions};
use crate::setup::Setup;
use crate::table::Table;
use crate::{
    batch, builds, compaction, cpu_overhead, growth, lowered, order, overhead, paper, queries, split, tlas,
};
use lvk_samples::app::{device, scene_list};

/// Runs the selected benchmark. Prints tables to standard output, and an error in one line to standard error. The exit status
/// is 0 on success, 1 for a device error, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &BenchArgs) -> ExitCode {
    match execute(args) {
        Ok(text) => {
            let _ = write!(std::io::stdout(), "{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {}", lvk::readable_text(&error.to_string()));
            ExitCode::from(error.status())
        }
    }
}

fn execute(args: &BenchArgs) -> Result<String, BenchError> {
    if let Some(folder) = &args.list_scenes {
        return Ok(scene_list::listing(Some(std::path::Path::new(folder))) + "\n");
    }
    if args.list_devices {
        device::list(args.profile.as_ref())?;
        return Ok(String::new());
    }
    let benchmark = args.benchmark.as_ref().ok_or(BenchError::NoBenchmark)?;
    if let Benchmark::Peers(peers) = benchmark {
        return compare_peers(args, peers);
    }
    if let Benchmark::Growth(GrowthArgs { load: Some(file), .. }) = benchmark {
        return growth::load(file);
    }
    let tables = measure(args, benchmark)?;
    Ok(tables.iter().map(Table::to_string).collect::<Vec<_>>().join("\n"))
}

fn compare_peers(args: &BenchArgs, peers: &PeersArgs) -> Result<String, BenchError> {
    if args.device.is_some() || args.profile.is_some() {
        return Err(BenchError::PeersDevice);
    }
    let options =
        RunOptions { quick: args.quick, runs: args.runs, validate: args.validate, subcommand: Some("peers") };
    peers::run(&peers::own_peers(), peers, &options).map_err(|error| BenchError::Peers(error.to_string()))
}

fn measure(args: &BenchArgs, benchmark: &Benchmark) -> Result<Vec<Table>, BenchError> {
    if let Benchmark::Builds(builds) = benchmark {
        return Ok(vec![builds::measure(args, builds)?]);
    }
    let setup = Setup::new(args)?;
    let tables = match benchmark {
        Benchmark::Batch(args) => vec![batch::measure(&setup, args)?],
        Benchmark::Builds(_) | Benchmark::Peers(_) => Vec::new(),
        Benchmark::Compaction(args) => vec![compaction::measure(&setup, args)?],
        Benchmark::Core => vec![cpu_overhead::measure(&setup)?],
        Benchmark::Growth(args) => growth::measure(&setup, args)?,
        Benchmark::Lowered(image) => vec![lowered::measure(&setup, image)?],
        Benchmark::Split(args) => vec![split::measure(&setup, args)?],
        Benchmark::Tlas(args) => vec![tlas::measure(&setup, args)?],
        Benchmark::Order(args) => vec![order::measure(&setup, args)?],
        Benchmark::Queries(args) => queries::measure(&setup, args)?,
        Benchmark::Overhead(args) => vec![overhead::measure(&setup, args)?],
        Benchmark::Paper(args) => vec![paper::run(&setup, args)?],
    };
    let messages = setup.validation_messages();
    if messages.is_empty() { Ok(tables) } else { Err(BenchError::Validation(messages)) }
}
