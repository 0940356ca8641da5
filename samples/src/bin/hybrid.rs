//! The program of the `hybrid` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::hybrid::HybridSequence>()
}
