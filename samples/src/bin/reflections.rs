//! The program of the `reflections` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::reflections::Reflections>()
}
