//! The program of the `large_scene` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::large_scene::LargeScene>()
}
