//! The program of the `hybrid_oit` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::hybrid_oit::HybridOit>()
}
