//! The program of the `viewer` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_viewer::Viewer>()
}
