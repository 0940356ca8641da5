//! Measures `lvk` and other libraries beside plain `ash`; see `--help`.

use std::process::ExitCode;

use clap::Parser;
use lvk_bench::peers::{PeersArgs, RunOptions, run};

/// Measures lvk, wgpu, blade-graphics and vk-graph beside plain ash, and prints a Markdown table.
///
/// Every row is the same work by all libraries, each in a process of its own. Default sizes depend on the device.
#[derive(Parser)]
#[command(name = "peers", version)]
struct Cli {
    #[command(flatten)]
    peers: PeersArgs,

    /// Smoke test: tiny sizes, two rounds
    #[arg(long)]
    quick: bool,

    /// Rounds of each row [default: by device]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    runs: Option<u32>,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let options = RunOptions { quick: cli.quick, runs: cli.runs, ..RunOptions::default() };
    match run(&lvk_bench_peers::peers(), &cli.peers, &options) {
        Ok(report) => {
            print!("{report}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
