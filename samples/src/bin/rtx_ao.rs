//! The program of the `rtx_ao` sample.

fn main() -> std::process::ExitCode {
    lvk_samples::app::cli::main::<lvk_samples::rtx_ao::RtxAo>()
}
