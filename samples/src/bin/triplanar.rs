//! The program of the `triplanar` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::triplanar::Triplanar>()
}
