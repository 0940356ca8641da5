//! Measures the costs and gains of `lvk`; see `--help`.

use std::process::ExitCode;

use clap::Parser;
use lvk_bench::{BenchArgs, CountingAllocator, run};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    run(&BenchArgs::parse())
}
