//! The program of the `deferred` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::deferred::Deferred>()
}
