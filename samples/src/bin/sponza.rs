//! The program of the `sponza` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::sponza::Sponza>()
}
