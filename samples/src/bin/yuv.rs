//! The program of the `yuv` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::yuv::Yuv>()
}
