//! Measures what `lvk` costs and gains; `--help` tells the rest.

use std::process::ExitCode;

use clap::Parser;
use lvk_bench::{BenchArgs, CountingAllocator, run};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    run(&BenchArgs::parse())
}
