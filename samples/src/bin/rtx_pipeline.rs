//! The program of the `rtx_pipeline` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::rtx_pipeline::RtxPipeline>()
}
